"""Markdown of made pages."""

from __future__ import annotations

import re
from collections.abc import Sequence

_BAR, _ESCAPED = re.compile(r"(?<!\\)\|"), r"\|"


def table(head: Sequence[str], *rows: Sequence[str]) -> str:
    """A table; bars in its cells are escaped."""
    lines = (head, ["---"] * len(head), *rows)
    return "\n".join(f"| {' | '.join(_BAR.sub(_ESCAPED, cell) for cell in line)} |" for line in lines)
