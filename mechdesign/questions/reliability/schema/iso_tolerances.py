"""Limit deviations by tolerance class: ISO 286-1:2010 (``h7``, ``H7/g6``) and ISO 2768-1:1989 (general tolerances).

The fundamental deviation of a letter is the limit next to the nominal size, and the standard tolerance (IT) of the
number lies beyond it. Those of holes follow from those of shafts: EI = -es from A to H, ES = -ei + Delta from K on with
Delta = ITn - IT(n-1) for K, M, N up to grade 8 and P to ZC up to grade 7 [ISO 286-1:2010, 4.3.2.5].
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Floats


class ToleranceClassError(ValueError):
    """No such tolerance class, or not for this size; the message names those there are."""


def _numbers(text: str) -> Floats:
    return np.array([math.nan if word == "-" else float(word) for word in text.split()])


# Upper ends of the ranges of nominal sizes, mm: of the standard tolerances, and the finer ones of some deviations.
_ENDS = _numbers("3 6 10 18 30 50 80 120 180 250 315 400 500 630 800 1000 1250 1600 2000 2500 3150")
_FINE_ENDS = _numbers("3 6 10 14 18 24 30 40 50 65 80 100 120 140 160 180 200 225 250 280 315 355 400 450 500")
# Largest size with fundamental deviations other than 0 here, mm.
_LARGEST = 500.0

# Standard tolerances IT1 to IT18 by range, micrometres [ISO 286-1:2010, table 1].
_GRADES = np.array([_numbers(line) for line in """
    0.8 1 1 1.2 1.5 1.5 2 2.5 3.5 4.5 6 7 8 9 10 11 13 15 18 22 26
    1.2 1.5 1.5 2 2.5 2.5 3 4 5 7 8 9 10 11 13 15 18 21 25 30 36
    2 2.5 2.5 3 4 4 5 6 8 10 12 13 15 16 18 21 24 29 35 41 50
    3 4 4 5 6 7 8 10 12 14 16 18 20 22 25 28 33 39 46 55 68
    4 5 6 8 9 11 13 15 18 20 23 25 27 32 36 40 47 55 65 78 96
    6 8 9 11 13 16 19 22 25 29 32 36 40 44 50 56 66 78 92 110 135
    10 12 15 18 21 25 30 35 40 46 52 57 63 70 80 90 105 125 150 175 210
    14 18 22 27 33 39 46 54 63 72 81 89 97 110 125 140 165 195 230 280 330
    25 30 36 43 52 62 74 87 100 115 130 140 155 175 200 230 260 310 370 440 540
    40 48 58 70 84 100 120 140 160 185 210 230 250 280 320 360 420 500 600 700 860
    60 75 90 110 130 160 190 220 250 290 320 360 400 440 500 560 660 780 920 1100 1350
    100 120 150 180 210 250 300 350 400 460 520 570 630 700 800 900 1050 1250 1500 1750 2100
    140 180 220 270 330 390 460 540 630 720 810 890 970 1100 1250 1400 1650 1950 2300 2800 3300
    250 300 360 430 520 620 740 870 1000 1150 1300 1400 1550 1750 2000 2300 2600 3100 3700 4400 5400
    400 480 580 700 840 1000 1200 1400 1600 1850 2100 2300 2500 2800 3200 3600 4200 5000 6000 7000 8600
    600 750 900 1100 1300 1600 1900 2200 2500 2900 3200 3600 4000 4400 5000 5600 6600 7800 9200 11000 13500
    1000 1200 1500 1800 2100 2500 3000 3500 4000 4600 5200 5700 6300 7000 8000 9000 10500 12500 15000 17500 21000
    1400 1800 2200 2700 3300 3900 4600 5400 6300 7200 8100 8900 9700 11000 12500 14000 16500 19500 23000 28000 33000
""".strip().splitlines()])  # fmt: skip

# Size of the fundamental deviations of shafts by range, micrometres [ISO 286-1:2010, tables 4 and 5]: es is minus that
# of a to h, ei that of k to zc. A letter has one number a range, or one a finer range.
_DEVIATIONS = {
    line.split()[0]: _numbers(line.partition(" ")[2])
    for line in """
a 270 270 280 290 290 300 300 310 320 340 360 380 410 460 520 580 660 740 820 920 1050 1200 1350 1500 1650
b 140 140 150 150 150 160 160 170 180 190 200 220 240 260 280 310 340 380 420 480 540 600 680 760 840
c 60 70 80 95 95 110 110 120 130 140 150 170 180 200 210 230 240 260 280 300 330 360 400 440 480
cd 34 46 56 70 85 100 - - - - - - -
d 20 30 40 50 65 80 100 120 145 170 190 210 230
e 14 20 25 32 40 50 60 72 85 100 110 125 135
ef 10 14 18 23 28 35 - - - - - - -
f 6 10 13 16 20 25 30 36 43 50 56 62 68
fg 4 6 8 10 12 15 - - - - - - -
g 2 4 5 6 7 9 10 12 14 15 17 18 20
k 0 1 1 1 2 2 2 3 3 4 4 4 5
m 2 4 6 7 8 9 11 13 15 17 20 21 23
n 4 8 10 12 15 17 20 23 27 31 34 37 40
p 6 12 15 18 22 26 32 37 43 50 56 62 68
r 10 15 19 23 23 28 28 34 34 41 43 51 54 63 65 68 77 80 84 94 98 108 114 126 132
s 14 19 23 28 28 35 35 43 43 53 59 71 79 92 100 108 122 130 140 158 170 190 208 232 252
t - - - - - - 41 48 54 66 75 91 104 122 134 146 166 180 196 218 240 268 294 330 360
u 18 23 28 33 33 41 48 60 70 87 102 124 144 170 190 210 236 258 284 315 350 390 435 490 540
v - - - - 39 47 55 68 81 102 120 146 172 202 228 252 284 310 340 385 425 475 530 595 660
x 20 28 34 40 45 54 64 80 97 122 146 178 210 248 280 310 350 385 425 475 525 590 660 740 820
y - - - - - 63 75 94 114 144 174 214 254 300 340 380 425 470 520 580 650 730 820 920 1000
z 26 35 42 50 60 73 88 112 136 172 210 258 310 365 415 465 520 575 640 710 790 900 1000 1100 1250
za 32 42 52 64 77 98 118 148 180 226 274 335 400 470 535 600 670 740 820 920 1000 1150 1300 1450 1600
zb 40 50 67 90 108 136 160 200 242 300 360 445 525 620 700 780 880 960 1050 1200 1300 1500 1650 1850 2100
zc 60 80 97 130 150 188 218 274 325 405 480 585 690 800 900 1000 1150 1250 1350 1550 1700 1900 2100 2400 2600
""".strip().splitlines()
}
# ei of shafts j and ES of holes J, by their grades.
_J = {
    "j5": _numbers("-2 -2 -2 -3 -4 -5 -7 -9 -11 -13 -16 -18 -20"),
    "j6": _numbers("-2 -2 -2 -3 -4 -5 -7 -9 -11 -13 -16 -18 -20"),
    "j7": _numbers("-4 -4 -5 -6 -8 -10 -12 -15 -18 -21 -26 -28 -32"),
    "j8": _numbers("-6 - - - - - - - - - - - -"),
    "J6": _numbers("2 5 5 6 8 10 13 16 18 22 25 29 33"),
    "J7": _numbers("4 6 8 10 12 14 18 22 26 30 36 39 43"),
    "J8": _numbers("6 10 12 15 20 24 28 34 41 47 55 60 66"),
}
LETTERS = (*(letter for letter in _DEVIATIONS if letter < "h"), "h", "js", "j", *(k for k in _DEVIATIONS if k > "j"))
"""Letters of shafts; those of holes are their capitals."""
# Coarsest grades, of sizes above 1 mm alone.
_COARSE = 14
_CLEARANCE = LETTERS[: LETTERS.index("h") + 1]

# Upper ends of the ranges of ISO 2768-1, mm, and half the tolerances of each class there: lengths, mm (table 1), and
# angles by the length of the shorter leg, degrees (table 3).
_LENGTH_ENDS = _numbers("3 6 30 120 400 1000 2000 4000")
_SMALLEST_LENGTH = 0.5
_LENGTHS = {
    "f": _numbers("0.05 0.05 0.1 0.15 0.2 0.3 0.5 -"),
    "m": _numbers("0.1 0.1 0.2 0.3 0.5 0.8 1.2 2"),
    "c": _numbers("0.2 0.3 0.5 0.8 1.2 2 3 4"),
    "v": _numbers("- 0.5 1 1.5 2.5 4 6 8"),
}
_LEG_ENDS = _numbers("10 50 120 400 inf")
_ANGLES = {
    "f": np.array([1.0, 1 / 2, 1 / 3, 1 / 6, 1 / 12]),
    "m": np.array([1.0, 1 / 2, 1 / 3, 1 / 6, 1 / 12]),
    "c": np.array([1.5, 1.0, 1 / 2, 1 / 4, 1 / 6]),
    "v": np.array([3.0, 2.0, 1.0, 1 / 2, 1 / 3]),
}

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
    table = _of_general(general[1], _LENGTHS)
    half = table[np.minimum(np.searchsorted(_LENGTH_ENDS, size), len(table) - 1)]
    least = 3.0 if general[1] == "v" else _SMALLEST_LENGTH
    most = _LENGTH_ENDS[-2] if general[1] == "f" else _LENGTH_ENDS[-1]
    wrong = (size < _SMALLEST_LENGTH) | (size > _LENGTH_ENDS[-1]) | np.isnan(half)
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
    half = _of_general(general[1], _ANGLES)[np.searchsorted(_LEG_ENDS, leg)]
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


def _of_general(letter: str, table: Mapping[str, Floats]) -> Floats:
    if letter not in table:
        raise ToleranceClassError(f"ISO 2768-1 has the classes ISO 2768-f, -m, -c and -v, not {letter!r}")
    return table[letter]


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
    numbers = (
        _J.get(("J" if hole else "j") + str(grade), np.array([math.nan])) if letter == "j" else _DEVIATIONS[letter]
    )
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
