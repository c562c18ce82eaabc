"""Numbers that a page shows as a field with a slider."""

from __future__ import annotations

import math
from typing import Any

_STEPS = 400  # of a slider


def number_field(
    name: str, label: str, value: float, unit: str, reach: float, *, least: float = -math.inf, whole: bool = False
) -> dict[str, Any]:  # fmt: skip
    """A number by the name of its change, and a slider that reaches so far to both sides, in round steps."""
    step = 1.0 if whole else 10.0 ** math.floor(math.log10(2 * reach / _STEPS))
    return {"name": name, "label": label, "value": float(value), "unit": unit, "low": max(value - reach, least),
            "high": value + reach, "step": step}  # fmt: skip
