"""Pictures of the cases of a matrix: what each entry that varies does to each result, and every two against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

from mechdesign.errors import counted, cut
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.text.units import Amount

# Inches.
_MARGINS = {"left": 1.1, "right": 0.15, "bottom": 0.75}
_LEGEND = 0.25  # a line of it
_GAP = 0.1
_LETTER = 0.09
_NARROWEST = 0.9  # of a panel
_ACROSS, _DOWN = 0.22, 0.22
_TALL, _FLAT = 2.6, 1.5  # of a panel of main effects, in one row and in many
_SQUARE = 3.6  # of a panel of scatters, at most
# Entries, rows of panels, and quantities that a picture has room for.
MOST_ENTRIES = 6
MOST_ROWS = 6
MOST_SCATTERED = 7
# More values than that are gathered into classes of as many cases.
MOST_VALUES = 12
CLASSES = 8
MOST_LETTERS = 10  # of a word at an axis
MOST_LINES = 3  # of a name
FEW_VALUES = 4  # whose ticks are the values themselves
_NAME, _TITLE = 9.0, 10.0  # points
_APART = 0.22  # part of the range between values whose numbers do not touch
_ROOM_AROUND = 0.08  # part of the range beyond the values
# Cases by how they ended: what is said of them, colour and marker.
_MET = ("meets every requirement", style.BLUE, "o")
_MISSED = ("does not meet one", style.VERMILION, "X")
_FAILED = ("failed", style.FAINT, "s")


@dataclass(frozen=True, eq=False)
class _Axis:
    """An entry that varies or a result: its values over the cases, words as 0, 1, 2, and the limits required of it."""

    name: str
    unit: str
    values: Floats
    words: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    varied: bool = True

    @classmethod
    def of(cls, column: Column, low: float | None = None, high: float | None = None, *, varied: bool = True) -> _Axis:
        """The axis of a column."""
        name = column.name.removeprefix("mechanism.parameters.").removeprefix("mechanism.")
        if column.numeric:
            low, high = (None if each is None else Amount.of(each).within(column.unit) for each in (low, high))
            return cls(name, column.unit, column.values.astype(float), (), low, high, varied)
        words = tuple(dict.fromkeys(map(str, column.values)))
        return cls(name, "", np.array([words.index(str(word)) for word in column.values], dtype=float), words)

    @property
    def limits(self) -> list[float]:
        """The limits that there are."""
        return [limit for limit in (self.low, self.high) if limit is not None]

    def label(self, room: float) -> str:
        """Name and unit in lines of so many inches; a long name is broken after its points, or cut in front."""
        bar, plain = self.name[: self.name.startswith("|")], self.name.lstrip("|")
        for name in (self.name, bar + (plain.partition(".")[2] or plain)):
            text = style.axis_label(name.replace(".", ". "), self.unit)
            lines = [line.replace(". ", ".") for line in style.folded(text, _NAME, room).split("\n")]
            if len(lines) < MOST_LINES:
                break
        return "\n".join(lines[:MOST_LINES])

    def span(self) -> tuple[float, float]:
        """From the lowest to the highest value or limit, and some room."""
        known = [*self.values[np.isfinite(self.values)].tolist(), *self.limits]
        low, high = (min(known), max(known)) if known else (0.0, 1.0)
        room = _ROOM_AROUND * (high - low) or 0.5 * max(abs(low), 1e-12)
        return (-0.5, len(self.words) - 0.5) if self.words else (low - room, high + room)

    def groups(self) -> list[tuple[float, Flags]]:
        """Cases of each value, or where there are many of each class of values: its middle, and which they are."""
        values = np.unique(self.values)
        if len(values) <= MOST_VALUES:
            return [(float(value), self.values == value) for value in values]
        order = np.argsort(np.argsort(self.values, kind="stable"), kind="stable")
        number = order * CLASSES // len(order)
        return [(float(self.values[number == k].mean()), number == k) for k in range(CLASSES)]


def figures(study: Study, result: Result) -> Gallery:
    """``main_effects`` and ``scatter``."""
    table, found = result.main, Gallery()
    entries = [_Axis.of(table.column(name)) for name in result.drawn["entries"]]
    entries = [each for each in entries if len(np.unique(each.values)) > 1]
    results = [_Axis.of(table.column(name), *limits, varied=False) for name, limits in result.drawn["results"].items()]
    if entries and results:
        found.add("main_effects", main_effects, entries, results, len(table))
        found.add("scatter", scatter, entries, results, table, required=bool(study.requirements))
    return found


def main_effects(entries: Sequence[_Axis], results: Sequence[_Axis], count: int) -> Figure:
    """A row of panels a result, a column an entry: mean and range over the cases of each value; dashed, its limits.

    Where there is no room for all entries side by side, the rest stands below.
    """
    across = entries[:MOST_ENTRIES]
    columns = min(len(across), _fitting())
    blocks = [across[k : k + columns] for k in range(0, len(across), columns)]
    down = results[: max(1, MOST_ROWS // len(blocks))]
    alone = all(which.sum() == 1 for each in across for _, which in each.groups())
    gathered = any(len(np.unique(each.values)) > MOST_VALUES for each in across)
    by = f"value, many values in {CLASSES} classes of as many cases" if gathered else "value"
    shown = "each case" if alone else f"mean (dot) and range (bar) of the cases of each {by}"
    words = f"main effects over {counted(count, 'case')}: {shown}"
    if any(each.limits for each in down):
        words += "; grey: not met"
    words += _without(down, count) + _left(entries, across, "entries") + _left(results, down, "results")
    title, top = _title(words)
    tall = max(_FLAT, _TALL / len(down))
    # Below each block of several stand its names.
    gap = _DOWN if len(blocks) == 1 else _MARGINS["bottom"]
    figure, panels = style.page(
        columns * len(down) * len(blocks), columns, tall, top=top, across=_ACROSS, down=gap, **_MARGINS
    )  # fmt: skip
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), title, va="top", fontsize=_TITLE)
    room = panels[0].get_position().width * style.width()
    for k, axes in enumerate(panels):
        row, column = divmod(k, columns)
        block, number = blocks[row // len(down)], down[row % len(down)]
        if column >= len(block):
            axes.remove()
            continue
        named = len(blocks) > 1 or row == len(down) - 1
        _effect(axes, block[column], number)
        _ticks(axes, block[column], number, room, outer_x=named, outer_y=column == 0)
        if named:
            axes.set_xlabel(block[column].label(room + _ACROSS / 2), fontsize=_NAME)
        if column == 0:
            axes.set_ylabel(number.label(tall), fontsize=_NAME)
    return figure


def _effect(axes: Axes, entry: _Axis, number: _Axis) -> None:
    """Mean and range of a result over the cases of each value of an entry."""
    groups = [(x, number.values[which & np.isfinite(number.values)]) for x, which in entry.groups()]
    groups = [(x, values) for x, values in groups if values.size]
    places = [x for x, _ in groups]
    _limits(axes, number, upright=False)
    low, high = ([end(values) for _, values in groups] for end in (np.min, np.max))
    axes.vlines(places, low, high, color=style.SKY, linewidth=2.5 if style.narrow() else 4.0, zorder=2)
    axes.plot(
        places, [values.mean() for _, values in groups], "o", color=style.BLUE, markersize=3 if style.narrow() else 4,
        linestyle="none" if entry.words else "-", linewidth=1.2, zorder=3,
    )  # fmt: skip
    axes.set_xlim(*entry.span())
    axes.set_ylim(*number.span())


def scatter(entries: Sequence[_Axis], results: Sequence[_Axis], table: Table, *, required: bool) -> Figure:
    """Every two of the entries and results against another, a point a case; those that do not meet a limit marked."""
    most = min(MOST_SCATTERED, _fitting() + 2)
    taken = [*entries[: most - 1]]
    taken += results[: most - len(taken)]
    size = len(taken) - 1
    side = min(_SQUARE, (style.width() - _MARGINS["left"] - _MARGINS["right"] - (size - 1) * _ACROSS) / size)
    codes = table["exit_code"]
    met = _MET if required else ("answered", *_MET[1:])
    kinds = [(*kind, which) for kind, which in ((met, codes == 0), (_MISSED, codes == 1), (_FAILED, codes > 1))]
    kinds = [kind for kind in kinds if kind[-1].any()]
    limits = "; grey: not met" if any(each.limits for each in taken) else ""
    told = _left(entries, taken, "entries") + _left(results, taken, "results")
    title, top = _title(f"cases: every two quantities against each other{limits}{told}")
    columns = 1 if style.narrow() else len(kinds)
    legend = top
    top += _LEGEND * -(-len(kinds) // columns)
    figure, panels = style.page(size * size, size, side, top=top, across=_ACROSS, down=_DOWN, **_MARGINS)
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), title, va="top", fontsize=_TITLE)
    for words, color, marker, which in kinds:
        label = f"{words} ({counted(int(which.sum()), 'case')})"
        panels[0].plot([], [], marker, color=color, markersize=6, linestyle="none", label=label)
    place = (0.0, 1 - (legend - _GAP) / figure.get_figheight())
    figure.legend(*panels[0].get_legend_handles_labels(), loc="upper left", bbox_to_anchor=place, ncols=columns,
                  borderaxespad=0.0)  # fmt: skip
    room = panels[0].get_position().width * style.width()
    for k, axes in enumerate(panels):
        row, column = divmod(k, size)
        if column > row:
            axes.remove()
            continue
        x, y = taken[column], taken[row + 1]
        _limits(axes, x, upright=True)
        _limits(axes, y, upright=False)
        for _, color, marker, which in kinds:
            axes.plot(
                x.values[which], y.values[which], marker, color=color, markersize=3 if style.narrow() else 4.5,
                markeredgewidth=0.4, markeredgecolor="white", linestyle="none", zorder=3,
            )  # fmt: skip
        axes.set_xlim(*x.span())
        axes.set_ylim(*y.span())
        _ticks(axes, x, y, room, outer_x=row == size - 1, outer_y=column == 0)
        if row == size - 1:
            axes.set_xlabel(x.label(room + _ACROSS / 2), fontsize=_NAME)
        if column == 0:
            axes.set_ylabel(y.label(side), fontsize=_NAME)
    return figure


def _fitting() -> int:
    """Panels for which the page has room side by side."""
    room = style.width() - _MARGINS["left"] - _MARGINS["right"]
    return max(1, int((room + _ACROSS) / (_NARROWEST + _ACROSS)))


def _limits(axes: Axes, of: _Axis, *, upright: bool) -> None:
    """Dashed lines at the limits of a requirement, and what lies beyond them in grey."""
    line, span = (axes.axvline, axes.axvspan) if upright else (axes.axhline, axes.axhspan)
    lowest, highest = of.span()
    for limit, end in ((of.low, lowest), (of.high, highest)):
        if limit is not None:
            line(limit, color=style.INK, linestyle=style.DASHES[1], linewidth=1.0, zorder=1.5)
            span(min(limit, end), max(limit, end), color=style.FAINT, alpha=0.18, linewidth=0, zorder=0.5)


def _ticks(axes: Axes, x: _Axis, y: _Axis, room: float, *, outer_x: bool, outer_y: bool) -> None:
    """Few ticks, words where there are words, at the outer edges only; `room` is the width of the panel."""
    for axis, of, outer in ((axes.xaxis, x, outer_x), (axes.yaxis, y, outer_y)):
        if of.words:
            letters = MOST_LETTERS if of is y else max(3, int(room / len(of.words) / _LETTER))
            axis.set_ticks(range(len(of.words)), [cut(word, letters) if outer else "" for word in of.words])
            continue
        axis.set_major_locator(MaxNLocator(2 if style.narrow() else 4, steps=[1, 2, 2.5, 5, 10]))
        values = np.unique(of.values)
        if of.varied and len(values) <= FEW_VALUES and np.diff(values).min() > _APART * np.ptp(values):
            axis.set_major_locator(FixedLocator(values.tolist()))
        axis.set_major_formatter(FuncFormatter(lambda value, _: _number(value)))
        axis.set_tick_params(labelbottom=outer, labelleft=outer)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("e+0", "e").replace("e-0", "e-").replace("-", "\N{MINUS SIGN}")


def _title(words: str) -> tuple[str, float]:
    """A title in lines, and the room that it takes (inches)."""
    folded = style.folded(words, _TITLE, style.width() - 0.2)
    return folded, style.line(_TITLE) * (folded.count("\n") + 1) + 2 * _GAP


def _left(all_of: Sequence[_Axis], shown: Sequence[_Axis], what: str) -> str:
    left = len([each for each in all_of if each not in shown])
    return f"; {left} more {what} in sweep.csv" if left else ""


def _without(shown: Sequence[_Axis], count: int) -> str:
    """How many cases have not every number."""
    lost = int(np.isnan([each.values for each in shown]).any(axis=0).sum())
    return f"; {lost} of {counted(count, 'case')} without a number left out" if lost else ""
