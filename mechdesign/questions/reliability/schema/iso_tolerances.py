"""Limit deviations by tolerance class: ISO 286-1:2010 (``h7``, ``H7/g6``) and ISO 2768-1:1989 (general tolerances).

The fundamental deviation of a letter is the limit next to the nominal size, and the standard tolerance (IT) of the
number lies beyond it. Those of holes follow from those of shafts: EI = -es from A to H, ES = -ei + Delta from K on with
Delta = ITn - IT(n-1) for K, M, N up to grade 8 and P to ZC up to grade 7 [ISO 286-1:2010, 4.3.2.5].
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats


class ToleranceClassError(ValueError):
    """No such tolerance class, or not for this size; the message names those there are."""


def _numbers(text: str) -> Floats:
    return np.array([math.nan if word == "-" else float(word) for word in text.split()])


# Rows of the tables of both standards by their names; the file says what they are.
_LINES = Path(__file__).with_name("iso_tables.txt").read_text(encoding="utf-8").splitlines()
_TABLES = {name: _numbers(row) for name, _, row in (line.partition(" ") for line in _LINES) if name != "#"}
_ENDS, _FINE_ENDS = _TABLES["SIZES"], _TABLES["FINE_SIZES"]
# Largest size with fundamental deviations other than 0 here, mm.
_LARGEST = 500.0
_GRADES = [numbers for name, numbers in _TABLES.items() if name.startswith("IT")]
_DEVIATIONS = {name: numbers for name, numbers in _TABLES.items() if name.islower() and name.isalpha()}
LETTERS = (*(letter for letter in _DEVIATIONS if letter < "h"), "h", "js", "j", *(k for k in _DEVIATIONS if k > "j"))
"""Letters of shafts; those of holes are their capitals."""
# Coarsest grades, of sizes above 1 mm alone.
_COARSE = 14
_CLEARANCE = LETTERS[: LETTERS.index("h") + 1]

# Smallest length of ISO 2768-1, mm.
_SMALLEST_LENGTH = 0.5

_CLASS = re.compile(r"([A-Za-z]{1,2})([1-9]\d?)")
_GENERAL = re.compile(r"ISO\s*2768(?:-1)?\s*[- ]\s*(\w+)", re.IGNORECASE)
_FIT = re.compile(r"[⌀Øø]?\s*(\d+(?:\.\d+)?)(?:\s*mm)?\s*([A-Za-z]+\d+)\s*/\s*([A-Za-z]+\d+)")


def is_class(text: str) -> bool:
    """Whether a text is written as a tolerance class, of either standard."""
    match = _CLASS.fullmatch(text.strip())
    named = match is not None and (match[1].islower() or match[1].isupper()) and match[1].lower() in LETTERS
    return named or text.strip().upper().startswith("ISO")


def deviations(text: str, size: ArrayLike) -> tuple[Number, Number]:
    """Lower and upper limit deviation of lengths by their class, mm.

    Parameters
    ----------
    text : str
        ``h7``, ``JS9`` or ``ISO 2768-m``.
    size : array_like
        Nominal sizes, mm.

    Raises
    ------
    ToleranceClassError
        Where the text is no class, or the standard does not give it for a size.
    """
    general, size = _GENERAL.fullmatch(text.strip()), np.asarray(size, dtype=float)
    if general is None:
        return _by_class(text.strip(), size)
    table = _of_general("length", general[1])
    half = table[np.minimum(np.searchsorted(_TABLES["LENGTHS"], size), len(table) - 1)]
    least = 3.0 if general[1] == "v" else _SMALLEST_LENGTH
    most = _TABLES["LENGTHS"][-2] if general[1] == "f" else _TABLES["LENGTHS"][-1]
    wrong = (size < _SMALLEST_LENGTH) | (size > _TABLES["LENGTHS"][-1]) | np.isnan(half)
    if wrong.any():
        first = size[wrong][0]
        raise ToleranceClassError(
            f"{text.strip()} is of lengths from {least:g} to {most:g} mm, not of {first:g} mm; give it in numbers"
        )
    return -half, half


def angle_deviations(text: str, leg: ArrayLike) -> tuple[Number, Number]:
    """Lower and upper limit deviation, degrees, of angles whose shorter legs are so long (mm); see `deviations`."""
    general = _GENERAL.fullmatch(text.strip())
    if general is None:
        raise ToleranceClassError(f"{text!r} is of lengths; of angles give a number, or ISO 2768-m with the 'leg'")
    half = _of_general("angle", general[1])[np.searchsorted(_TABLES["LEGS"], leg)] / 60.0
    return -half, half


def standard_tolerance(grade: int, size: ArrayLike) -> Number:
    """Standard tolerance of a grade (7 of IT7) for nominal sizes, both in mm.

    Raises
    ------
    ToleranceClassError
        Where the standard gives none for a size.
    """
    return _width(grade, np.asarray(size, dtype=float)) * 1e-3


def _width(grade: int, size: Floats) -> Floats:
    """Standard tolerances, micrometres."""
    wrong = ~((size > 0) & (size <= _ENDS[-1]))
    if wrong.any():
        first, most = size[wrong][0], _ENDS[-1]
        raise ToleranceClassError(
            f"ISO 286 gives classes of sizes above 0 up to {most:g} mm, not of {first:g} mm; give it in numbers"
        )
    if grade >= _COARSE and (size <= 1).any():
        first = size[size <= 1][0]
        raise ToleranceClassError(f"ISO 286 gives grades from {_COARSE} on of sizes above 1 mm, not of {first:g} mm")
    return np.asarray(_GRADES[grade - 1][np.searchsorted(_ENDS, size)])


def _of_general(kind: str, letter: str) -> Floats:
    if f"{kind}-{letter}" not in _TABLES:
        raise ToleranceClassError(f"ISO 2768-1 has the classes ISO 2768-f, -m, -c and -v, not {letter!r}")
    return _TABLES[f"{kind}-{letter}"]


def _by_class(text: str, size: Floats) -> tuple[Number, Number]:
    match = _CLASS.fullmatch(text)
    letter, grade = (match[1].lower(), int(match[2])) if match else ("", 0)
    if match is None or match[1] not in (letter, letter.upper()) or letter not in LETTERS or grade > len(_GRADES):
        raise ToleranceClassError(
            f"{text!r} is no tolerance class: those are a letter ({', '.join(LETTERS)}; of holes capitals) and a grade "
            f"from 1 to {len(_GRADES)}, such as h7, js9 or H7; or ISO 2768-m"
        )
    width, hole = _width(grade, size), match[1].isupper()
    nearest = -0.5 * width if letter == "js" else 0.0 * width if letter == "h" else _nearest(letter, grade, hole, size)
    none = np.isnan(nearest)
    if none.any():
        first, hint = size[none][0], _given(letter, grade, hole)
        raise ToleranceClassError(f"ISO 286 gives no {text} of {first:g} mm here; {hint}")
    above = letter == "js" or (letter in _CLEARANCE) == hole
    low, high = (nearest, nearest + width) if above else (nearest - width, nearest)
    return low * 1e-3, high * 1e-3


def _nearest(letter: str, grade: int, hole: bool, size: Floats) -> Floats:
    """The limits next to the nominal sizes, micrometres; nan where the standard gives none."""
    part = np.searchsorted(_ENDS, size)
    name = f"{'J' if hole else 'j'}{grade}" if letter == "j" else letter
    numbers = _TABLES.get(name, np.array([math.nan]))
    ranges = np.searchsorted(_FINE_ENDS, size) if len(numbers) == len(_FINE_ENDS) else part
    number = numbers[np.minimum(ranges, len(numbers) - 1)]
    number = np.where((size > _LARGEST) | ((size <= 1) & (letter in ("a", "b"))), math.nan, number)
    if letter == "j" or (not hole and letter not in _CLEARANCE):
        return 0.0 * number if letter == "k" and not 4 <= grade <= 7 else number
    if letter in _CLEARANCE:
        return number if hole else -number
    # Of holes ES = -ei + Delta; no Delta is given up to 3 mm.
    coarse = grade > (8 if letter in ("k", "m", "n") else 7)
    if grade < 3:
        return np.full_like(number, math.nan)
    if coarse:
        none = ((letter == "k") & (part > 0)) | ((letter == "n") & (size <= 1))
        return np.where(none, math.nan, np.where((letter == "n") & (part > 0), 0.0 * number, -number))
    limit = -number + np.where(part > 0, _GRADES[grade - 1][part] - _GRADES[grade - 2][part], 0.0)
    special = (letter == "m") & (grade == 6) & (size > 250) & (size <= 315)
    return np.where(special, -9.0, limit)


def _given(letter: str, grade: int, hole: bool) -> str:
    """The sizes for which a class is given."""
    sizes = _FINE_ENDS[~np.isnan(_nearest(letter, grade, hole, _FINE_ENDS))]
    if len(sizes):
        low = max([0.0, *_FINE_ENDS[sizes[0] > _FINE_ENDS]]) or (1.0 if letter in ("a", "b", "n") else 0.0)
        return f"it is given of sizes above {low:g} up to {sizes[-1]:g} mm"
    if letter == "j":
        return f"{'J6, J7 and J8' if hole else 'j5, j6, j7 and (up to 3 mm) j8'} are given"
    return "holes from K on are given from grade 3 on"


def fit_deviations(text: str) -> tuple[float, tuple[Number, Number], tuple[Number, Number]]:
    """Nominal size of a fit such as ``20 H7/g6``, and the limit deviations of its hole and of its shaft, mm.

    Raises
    ------
    ToleranceClassError
        Where it is no fit, or one of its classes is not given for the size.
    """
    match = _FIT.fullmatch(text.strip())
    if match is None or not match[2].isupper() or not match[3].islower():
        raise ToleranceClassError(
            f"{text!r} is no fit: those are a size in mm, the hole's class and the shaft's, such as 20 H7/g6"
        )
    size = np.asarray(match[1], dtype=float)
    return float(size), _by_class(match[2], size), _by_class(match[3], size)
