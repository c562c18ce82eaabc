"""Values of a column beside one that is stated: which equal it, and which there are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.errors import nearest
from mechdesign.ground.numerics.arrays import Flags

# Number of a column's values that a message names.
MOST_VALUES = 12


def present_words(values: NDArray[Any], stated: object) -> str:
    """The values of a column in words: all of them, or of many numbers the smallest, the largest and the nearest."""
    number = values.dtype.kind in "fiub"
    present = list(dict.fromkeys((values[np.isfinite(values)] if number else values).tolist()))
    if not number and (longer := [name for name in present if str(name).startswith(f"{stated}_")]):
        return f"did you mean {' or '.join(map(repr, longer[:MOST_VALUES]))}?"
    if not number and (close := nearest(str(stated), present)):
        return f"did you mean {close!r}?"
    if number and len(present) > MOST_VALUES and isinstance(stated, (int, float)):
        beside = min(present, key=lambda value: abs(value - stated))
        return f"there are {min(present):.12g} to {max(present):.12g}, {beside:.12g} the nearest"
    shown = [f"{value:.12g}" if isinstance(value, float) else str(value) for value in present[:MOST_VALUES]]
    rest = ", ..." * (len(present) > MOST_VALUES)
    return f"there {'is' if len(present) == 1 else 'are'} {', '.join(shown) or 'none'}{rest}"


def equal_to(values: NDArray[Any], stated: object) -> Flags:
    """Which values are the stated one: numbers within rounding, words to the letter."""
    if values.dtype.kind in "fiub" and isinstance(stated, (int, float)):
        return np.asarray(np.isclose(values.astype(float), float(stated), rtol=1e-9, atol=1e-12))
    if values.dtype.kind == "U":
        return np.asarray(values == str(stated))
    return np.array([str(value) == str(stated) for value in values.tolist()], dtype=bool)
