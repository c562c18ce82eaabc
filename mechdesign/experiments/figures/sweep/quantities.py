"""What the pictures of a sweep show of its cases: entries that vary, and results with what is required of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from matplotlib.axes import Axes

from mechdesign.door.report.cases import FRONT, RANK, best_of, short
from mechdesign.drawing import style
from mechdesign.drawing.drawing import write
from mechdesign.drawing.labels import Label
from mechdesign.drawing.marks import Axis, Dots, LateMark, Lines, PanelMark, Zone
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import counted, cut
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, evenly
from mechdesign.ground.results import Table
from mechdesign.study.text.units import Amount

# More values than this are gathered into classes of equal numbers of cases.
MOST_VALUES = 12
CLASSES = 8
MOST_LETTERS = 10  # of a word at an axis
PLURALS = {"entry": "entries", "result": "results"}
FEW_VALUES = 4  # whose ticks are the values themselves
_APART = 0.22  # part of the range between values whose numbers do not touch
_ROOM_AROUND = 0.08  # part of the range beyond the values
# Cases that are drawn one by one, at most, and over a map.
MOST_DRAWN, MOST_OVER_MAP = 5000, 800
_GOLDEN = 0.5 * (5**0.5 - 1)
_STAR, _DOT, _SMALL_DOT = 11.0, 4.0, 2.2  # points
_FEW_DOTS = 400
LABEL = "label"  # column of the names of cases
MOST_LABELLED, MOST_IN_LABEL = 30, 20  # cases, letters


@dataclass(frozen=True, eq=False)
class CaseAxis:
    """An entry that varies or a result: its values over the cases, words as 0, 1, 2, and the limits required of it."""

    name: str
    unit: str
    values: Floats
    words: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    varied: bool = True

    @classmethod
    def of(
        cls, column: Column, low: float | None = None, high: float | None = None, *, varied: bool = True
    ) -> CaseAxis:
        """The axis of a column."""
        name = short(column.name)
        if column.numeric:
            low, high = (None if bound is None else Amount.of(bound).within(column.unit) for bound in (low, high))
            return cls(name, column.unit, column.values.astype(float), (), low, high, varied)
        words = tuple(dict.fromkeys(map(str, column.values)))
        return cls(name, "", np.array([words.index(str(word)) for word in column.values], dtype=float), words)

    @property
    def limits(self) -> list[float]:
        """The limits that there are."""
        return [limit for limit in (self.low, self.high) if limit is not None]

    @cached_property
    def distinct(self) -> Floats:
        """The values, each once."""
        return np.unique(self.values)

    @property
    def ends(self) -> list[float]:
        """The smallest and the largest value; empty where there is none."""
        finite = self.distinct[np.isfinite(self.distinct)]
        return [float(finite[0]), float(finite[-1])] if len(finite) else []

    @property
    def axis(self) -> Axis:
        """The axis of panels over it."""
        values = self.distinct
        apart = self.varied and not self.words and 1 < len(values) <= FEW_VALUES
        few = apart and np.diff(values).min() > _APART * np.ptp(values)
        return Axis(self.name, self.unit, ends=self.span(), ticks=values.tolist() if few else (),
                    words=[cut(word, MOST_LETTERS) for word in self.words])  # fmt: skip

    def span(self) -> tuple[float, float]:
        """From the lowest to the highest value or limit, and some room."""
        ends = [*self.ends, *self.limits]
        low, high = (min(ends), max(ends)) if ends else (0.0, 1.0)
        room = _ROOM_AROUND * (high - low) or 0.5 * max(abs(low), 1e-12)
        return (-0.5, len(self.words) - 0.5) if self.words else (low - room, high + room)

    def groups(self) -> list[tuple[float, Flags]]:
        """Cases of each value, or where there are many of each class of values: its middle, and which they are."""
        values = self.distinct
        if len(values) <= MOST_VALUES:
            return [(float(value), self.values == value) for value in values]
        order = np.argsort(np.argsort(self.values, kind="stable"), kind="stable")
        number = order * CLASSES // len(order)
        return [(float(self.values[number == k].mean()), number == k) for k in range(CLASSES)]


@dataclass(frozen=True, eq=False)
class CaseKind:
    """Cases that are drawn alike: in words, their colour and marker, which they are, how large at least."""

    words: str
    color: str
    marker: str
    cases: Flags
    least: float = 0.0  # points

    def dots(self, x: CaseAxis, y: CaseAxis, drawn: Ints, size: float) -> Dots:
        """Those of some cases at their values, with markers of a size in points."""
        rows = drawn[self.cases[drawn]]
        look = {"marker": self.marker, "color": self.color, "markersize": max(size, self.least), "zorder": 3,
                "markeredgewidth": 1.0 if self.least else 0.4, "markeredgecolor": "white"}  # fmt: skip
        return Dots(x.values[rows], y.values[rows], label=self.words, look=look)


@dataclass(frozen=True, eq=False)
class CaseNames(LateMark):
    """Labels of cases at their places, as far as there is room."""

    x: Floats
    y: Floats
    names: Sequence[str]

    def draw(self, axes: Axes) -> None:
        named = [(name, complex(x, y)) for name, x, y in zip(self.names, self.x, self.y, strict=True)]
        write(axes, [Label(cut(name, MOST_IN_LABEL), (place,), style.INK, 5.0, None, 7.5, optional=True)
                     for name, place in named if name and np.isfinite(place)])  # fmt: skip


def names_of(table: Table, x: CaseAxis, y: CaseAxis) -> list[CaseNames]:
    """The labels of the cases of a file; of more than `MOST_LABELLED` those of the best."""
    if LABEL not in table:
        return []
    rows = np.arange(len(table))
    if len(table) > MOST_LABELLED:
        rows = np.flatnonzero(table[RANK] == 1)[:MOST_LABELLED] if RANK in table else rows[:0]
    return [CaseNames(x.values[rows], y.values[rows], table[LABEL][rows].tolist())]


def kinds_of(table: Table, *, required: bool) -> list[CaseKind]:
    """Cases by how they ended, and where they are ranked those on the front and the best, the better ones on top."""
    codes = table["exit_code"]
    met = "meets every requirement" if required else "answered"
    looks = [
        ("failed", style.FAINT, "s", codes > 1), ("does not meet one", style.VERMILION, "X", codes == 1),
        (met, style.BLUE, "o", codes == 0),
    ]  # fmt: skip
    best = best_of(table)
    if best is not None and best.front > best.equals:
        looks.append(("on the Pareto front", style.ORANGE, "D", table[FRONT] == 1))
    kinds = [
        CaseKind(f"{words} ({counted(int(cases.sum()), 'case')})", color, marker, cases)
        for words, color, marker, cases in looks
        if cases.any()
    ]
    return kinds if best is None else [*kinds, CaseKind(f"best: {best.words}", style.INK, "*", table[RANK] == 1, _STAR)]


def sample(table: Table, most: int) -> tuple[Ints, float]:
    """Numbers of the cases that are drawn, and the size of their dots in points.

    Where there are more cases than that, a sample with as many of those on the front at most, and with the best. Its
    numbers are multiples of the golden ratio, so that no period of a grid shows.
    """
    count = len(table)
    if count <= most:
        return np.arange(count), _DOT if count <= _FEW_DOTS else _SMALL_DOT
    rows = (np.arange(1, most + 1) * _GOLDEN % 1 * count).astype(np.intp)
    if RANK in table:
        on_front = np.flatnonzero(table[FRONT])
        rows = np.concatenate([rows, on_front[evenly(len(on_front), most)], np.flatnonzero(table[RANK] == 1)[:1]])
    return np.unique(rows), _SMALL_DOT


def limit_marks(of: CaseAxis, at: Literal["x", "y"] = "y") -> Iterator[PanelMark]:
    """Dashed lines at the limits of a requirement, and what lies beyond them in grey."""
    lowest, highest = of.span()
    for limit, end in ((of.low, lowest), (of.high, highest)):
        if limit is not None:
            dashed = {"color": style.INK, "linestyle": style.DASHES[1], "linewidth": 1.0, "zorder": 1.5}
            yield Lines([limit], at, look=dashed)
            yield Zone(min(limit, end), max(limit, end), at, look={"color": style.FAINT, "alpha": 0.18, "zorder": 0.5})


def number_text(value: float) -> str:
    return numeral(value).replace("-", "\N{MINUS SIGN}")


def left_out(all_of: Sequence[CaseAxis], shown: Sequence[CaseAxis], noun: str) -> str:
    """How many entries or results (by their `noun`) have no room, in words."""
    left = len([axis for axis in all_of if axis not in shown])
    return f"; {left} more {noun if left == 1 else PLURALS[noun]} in sweep.csv" if left else ""


def without_number(shown: Sequence[CaseAxis], count: int) -> str:
    """How many cases lack a number, in words."""
    lost = int(np.isnan([axis.values for axis in shown]).any(axis=0).sum())
    return f"; {lost} of {counted(count, 'case')} without a number left out" if lost else ""
