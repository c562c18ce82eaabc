"""Numbers of poses as the script of a report's page reads them."""

from __future__ import annotations

import re
import string

import numpy as np


def decoded(text: str, count: int, unit: float = 1) -> np.ndarray:
    """Values of steps in letters, as the script reads them: a point for none, or digits to the base 32."""
    digits = string.ascii_uppercase + string.ascii_lowercase + string.digits + "-_"
    numbers = []
    for word in re.findall(r"\.|[g-z0-9_-]*[A-Za-f]", text):
        value = sum((digits.index(letter) % 32) * 32**k for k, letter in enumerate(word) if word != ".")
        numbers.append(None if word == "." else -(value + 1) // 2 if value % 2 else value // 2)
    numbers += [0] * (count - len(numbers))
    known = np.array([step is not None for step in numbers])
    return np.where(known, np.cumsum([step or 0 for step in numbers]) / unit, np.nan)
