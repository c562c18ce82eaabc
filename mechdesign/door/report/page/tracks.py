"""Poses of a mechanism, and its numbers in them, as integers that a small script draws from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from mechdesign.door.report.page.linkage import Canvas
from mechdesign.ground.columns import Column
from mechdesign.ground.numerals import printed, reading
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.ground.table_text import Rounding
from mechdesign.mechanism import Configuration, Reason
from mechdesign.mechanism.elements.links import Link
from mechdesign.mechanism.graph import GROUND

# Integers in a unit of a drawing, and in a degree.
PLACES = 20
TURNS = 100
TIMES = 10_000  # in the time of a motion
ROWS = 1_000_000  # from one row of a table to the next
# Digits of integers.
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
_BASE = 32
_NOTHING = "."
# Smallest number of steps between zero and the usual size of a number.
_STEPS = 1000
_SMALL, _LARGE = 1e-4, 1e7
_EXACT = 2.0**53  # integers below it are exact as numbers of 64 bits
_LONG = 10.0  # a number varies little whose size is so many times its range

_WHY = {
    Reason.NOT_CLOSED: "cannot be assembled here",
    Reason.OTHER_ASSEMBLY: "in another assembly only",
    Reason.LIMIT: "beyond a limit",
    Reason.NOT_HELD: "does not hold its load here",
    Reason.NOT_DETERMINED: "not determined here",
    Reason.NO_VALUE: "a coupling has no value here",
}


@dataclass(frozen=True)
class Cell:
    """A number in the pose that is drawn: its index among all numbers, its text and its unit."""

    number: int
    text: str
    unit: str


@dataclass(frozen=True)
class Map:
    """A map of a local index that a drawing can show."""

    index: str
    label: str  # with its unit
    meaning: str
    href: str  # the id of its group in the drawing
    window: str  # the view box around its region


@dataclass(frozen=True)
class MovingPicture:
    """A mechanism that moves in a page."""

    drawing: str  # inline SVG in one pose: what is seen without script and in print
    beside: str  # inline SVG that shows where it is: motion curves, or nothing where the drawing has the map
    data: Mapping[str, Any]  # what the script moves it by, as JSON
    words: str  # the pose drawn
    headings: Sequence[str]  # of the columns of numbers
    rows: Sequence[tuple[str, Sequence[Cell | None]]]  # numbers of the pose drawn, by what they are of
    meanings: Mapping[str, str]  # of these rows, where no unit tells what they are
    replaces: Sequence[str] = ()  # pictures of the question that show the same
    maps: Sequence[tuple[str, Sequence[Map]]] = ()  # maps to choose from, by what the orientation is

    def titled(self, title: str) -> MovingPicture:
        """The same with words before those of each pose, such as which case it is."""
        words = f"{title}: {self.words}"
        return replace(self, words=words, data={**self.data, "title": title}) if title else self


class ShownNumbers:
    """Columns as integers in units of their last shown decimal, and the text of each in the pose that is drawn.

    Those of further poses have as many decimals as `alike`, and the same units; `size` is that of the mechanism.
    """

    def __init__(
        self, table: Table, rows: Ints, begin: int, size: tuple[float, str], alike: ShownNumbers | None = None
    ) -> None:  # fmt: skip
        self.rows, self.begin, self.alike = rows, begin, alike
        self.rounding = Rounding.of(table.columns, size)
        self.sizes: dict[str, float] = {}
        for column in table.columns:
            if column.values.dtype.kind == "f":
                self.sizes[column.unit] = max(self.sizes.get(column.unit, 0.0), _size(column.values[rows]))
        self.tracks: list[list[Any]] = []
        self.scaled: dict[str, tuple[int, int, int]] = {}
        self.units: dict[str, str] = {}

    def add(self, column: Column) -> int:
        """Add a column and return its index among the numbers."""
        if column.name in self.scaled:
            return self.scaled[column.name][0]
        values = column.values[self.rows]
        if self.alike is None:
            decimals, power, self.units[column.name] = self._digits(column)
        else:
            _, decimals, power = self.alike.scaled[column.name]
            self.units[column.name] = self.alike.units[column.name]
        self.tracks.append([decimals, deltas(values, 10.0 ** (decimals - power))])
        self.scaled[column.name] = len(self.tracks) - 1, decimals, power
        return len(self.tracks) - 1

    def _digits(self, column: Column) -> tuple[int, int, str]:
        """Decimals of a column, the power of ten of which its numbers are multiples, and the unit that these have."""
        values = column.values[self.rows]
        size, largest = _size(values), self.sizes.get(column.unit, 0.0)
        still, known = self.rounding.still(column, column.unit), values[np.isfinite(values)]
        span = float(np.ptp(known)) if len(known) else 0.0
        if size <= still:
            # A column that is constant up to rounding gets as many digits as the columns that vary.
            size = largest if largest > still else 1.0
        power, unit = reading(size, column.unit)
        if unit.startswith("10"):
            # As key numbers: a power of ten where the number is very small or large alone.
            power, unit = (0, printed(column.unit)) if _SMALL <= size < _LARGE else (power, f"\N{MIDDLE DOT}{unit}")
        # Of what varies little beside its size the curve is seen.
        fine = min(size, _LONG * span) if span > still else size
        return max(0, math.ceil(math.log10(_STEPS * 10.0**power / fine))), power, unit

    def cell(self, column: Column) -> Cell:
        """The column's number in the pose drawn."""
        which = self.add(column)
        _, decimals, power = self.scaled[column.name]
        value = float(column.values[self.rows[self.begin]])
        # Adding zero turns -0.0 into 0.0.
        text = f"{round(value / 10.0**power, decimals) + 0.0:.{decimals}f}" if math.isfinite(value) else "\N{EN DASH}"
        return Cell(which, text, self.units[column.name])


def meanings(table: Table) -> dict[str, str]:
    """Meanings of the columns without a unit, such as indices."""
    return {column.name: column.meaning for column in table.columns if not column.unit and column.meaning}


def _size(values: Floats) -> float:
    """How large the numbers of a column usually are: the median of their absolute values, but for zero."""
    sizes = np.sort(np.abs(values[np.isfinite(values)]))
    count = len(sizes)
    return float(sizes[(count - 1) // 2] / 2 + sizes[count // 2] / 2 or sizes[-1]) if count else 0.0


def deltas(values: Floats, factor: float) -> str:
    """Values times a factor as integers in letters: the first, then the step from the last known one.

    A step s is 2 s, or -2 s - 1 where it is negative, in digits to the base 32, the lowest first; all but the last of
    them are 32 more. Where there is no value stands a point; steps of zero at the end are left out.
    """
    scaled = values * factor
    finite = np.isfinite(scaled)
    integers: Any = np.rint(scaled[finite])
    exact = np.abs(integers).max(initial=0.0) < _EXACT
    integers = integers.astype(np.int64) if exact else np.array([*map(int, integers.tolist())], dtype=object)
    steps = np.diff(integers, prepend=0)
    letters = map(_letters, np.where(steps >= 0, 2 * steps, -2 * steps - 1).tolist())
    return "".join([next(letters) if known else _NOTHING for known in finite.tolist()]).rstrip(_letters(0))


def steps(text: str, count: int) -> Floats:
    """The integers that `deltas` has written, shape (count,); where there is no value the last one before it."""
    integers, value, place = [], 0, 1
    for letter in text:
        digit = _LETTERS.find(letter)
        value += place * (digit % _BASE if digit >= 0 else 0)
        place *= _BASE
        if digit < _BASE:
            integers.append(-(value + 1) // 2 if value % 2 else value // 2)
            value, place = 0, 1
    return np.cumsum([*integers, *[0] * (count - len(integers))]).astype(np.float64)


def joined(part: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """A `MovingPicture` as plain data with the arrows and the numbers of another that moves along the same motion.

    These are taken straight between the poses of the other.
    """
    data, more = part["data"], other["data"]
    at, own = (_values(drawing["rows"], drawing["poses"]) for drawing in (data, more))
    same = np.minimum(np.searchsorted(own, at), len(own) - 1)

    def along(track: str, factor: float = 1.0, begin: float = 0.0) -> str:
        values = _values(track, len(own))
        return deltas(factor * np.where(own[same] == at, values[same], np.interp(at, own, values)) + begin, 1.0)

    # From one drawing to the other, whose windows may differ.
    factor = data["scale"] / more["scale"]
    shift = [PLACES * data["scale"] * sign * (there - here)
             for sign, there, here in zip((1, -1), more["corner"], data["corner"], strict=True)]  # fmt: skip

    def placed(place: str | Sequence[str]) -> str | list[str]:
        if isinstance(place, str):
            return place
        return [along(track, factor, begin) for track, begin in zip(place, shift, strict=True)]

    titles = {kind["title"] for group in data["arrows"] for kind in group["layers"]}
    groups = []
    for group in more["arrows"]:
        layers = [
            layer | {"shafts": [[words, placed(at), [*map(along, way)]] for words, at, way in layer["shafts"]]}
            for layer in group["layers"] if layer["title"] not in titles
        ]  # fmt: skip
        groups += [group | {"layers": layers}] if layers else []
    numbers = [[decimals, along(track)] for decimals, track in more["numbers"]]
    begin, named = len(data["numbers"]), {name for name, _ in part["rows"]}
    rows = [
        [name, [cell and cell | {"number": cell["number"] + begin} for cell in cells]]
        for name, cells in other["rows"] if name not in named
    ]  # fmt: skip
    data = {**data, "arrows": [*data["arrows"], *groups], "numbers": [*data["numbers"], *numbers]}
    rows = [*part["rows"], *rows]
    return {**part, "data": data, "rows": rows, "meanings": {**other["meanings"], **part["meanings"]}}


def _values(track: str, count: int) -> Floats:
    """The integers of `deltas`, nan where there is no value, shape (count,)."""
    given = np.array([letter == _NOTHING for letter in track if _LETTERS.find(letter) < _BASE], dtype=bool)
    gone = np.append(given, np.zeros(count - len(given), dtype=bool))
    return np.where(gone, np.nan, steps(track, count))


@lru_cache(4096)
def _letters(number: int) -> str:
    letters = ""
    while number >= _BASE:
        letters += _LETTERS[_BASE + number % _BASE]
        number //= _BASE
    return letters + _LETTERS[number]


def places(sheet: Canvas, configuration: Configuration, links: Mapping[str, Link]) -> dict[str, Any]:
    """Places of the points and directions of the links in every pose, in the drawing's units and degrees."""
    valid = configuration.valid
    tracks: dict[str, Any] = {"corner": [sheet.corner.real, sheet.corner.imag], "scale": sheet.scale,
                             "x": {}, "y": {}, "turn": {}}  # fmt: skip
    for point in dict.fromkeys(point for link in links.values() for point in link.all_points):
        at = sheet.all(np.where(valid, configuration.point(point), complex(np.nan, np.nan)))
        tracks["x"][point], tracks["y"][point] = deltas(at.real, PLACES), deltas(at.imag, PLACES)
    for name in links:
        if name != GROUND:
            angles = np.full(len(valid), np.nan)
            angles[valid] = np.unwrap(-np.angle(configuration.rotation(name)[valid]))
            tracks["turn"][name] = deltas(np.degrees(angles), TURNS)
    return tracks


def gaps(configuration: Configuration) -> list[tuple[int, int, str]]:
    """Runs of poses that are not valid: the first, the last, why in words."""
    reason = configuration.reason
    ends = np.flatnonzero(np.diff(reason)) + 1
    runs = zip(np.append(0, ends).tolist(), np.append(ends, len(reason)).tolist(), strict=True)
    return [(begin, end - 1, _WHY[Reason.of(int(reason[begin]))]) for begin, end in runs if reason[begin]]
