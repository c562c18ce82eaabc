"""Pictures of the cases of a matrix: what each entry that varies does to each result, and every two against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator

from mechdesign.errors import counted, cut
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study

# Inches.
_MARGINS = {"left": 1.05, "right": 0.15, "bottom": 0.75}
_TOP, _TOP_OF_LEGEND = 0.55, 0.8
_ACROSS, _DOWN = 0.22, 0.22
_TALL, _FLAT = 2.6, 1.5  # of a panel of main effects, in one row and in many
_SQUARE = 3.6  # of a panel of scatters, at most
# Entries, and results, that a picture has room for.
MOST_ENTRIES = 6
MOST_RESULTS = 6
MOST_SCATTERED = 7
# More values than that are gathered into classes of as many cases.
MOST_VALUES = 12
CLASSES = 8
MOST_LETTERS = 10  # of a word at an axis
FEW_VALUES = 4  # whose ticks are the values themselves
_NAME, _TITLE = 9.0, 10.0  # points
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

    @classmethod
    def of(cls, column: Column, low: float | None = None, high: float | None = None) -> _Axis:
        """The axis of a column."""
        name = column.name.removeprefix("mechanism.parameters.").removeprefix("mechanism.")
        if column.numeric:
            return cls(name, column.unit, column.values.astype(float), (), low, high)
        words = tuple(dict.fromkeys(map(str, column.values)))
        return cls(name, "", np.array([words.index(str(word)) for word in column.values], dtype=float), words)

    @property
    def limits(self) -> list[float]:
        """The limits that there are."""
        return [limit for limit in (self.low, self.high) if limit is not None]

    def label(self, room: float) -> str:
        """Name and unit in lines of so many inches; a long name is broken after its points."""
        text = style.axis_label(self.name.replace(".", ". "), self.unit)
        return "\n".join(line.replace(". ", ".") for line in style.folded(text, _NAME, room).split("\n"))

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
    results = [_Axis.of(table.column(name), *limits) for name, limits in result.drawn["results"].items()]
    if entries and results:
        found.add("main_effects", main_effects, entries, results, len(table))
        found.add("scatter", scatter, entries, results, table, required=bool(study.requirements))
    return found


def main_effects(entries: Sequence[_Axis], results: Sequence[_Axis], count: int) -> Figure:
    """A row of panels a result, a column an entry: mean and range over the cases of each value; dashed, its limits."""
    across, down = entries[:MOST_ENTRIES], results[:MOST_RESULTS]
    tall = max(_FLAT, _TALL / len(down))
    figure, panels = style.page(
        len(across) * len(down), len(across), tall, top=_TOP, across=_ACROSS, down=_DOWN, **_MARGINS
    )  # fmt: skip
    room = panels[0].get_position().width * style.width()
    for k, axes in enumerate(panels):
        row, column = divmod(k, len(across))
        entry, number = across[column], down[row]
        groups = [(x, number.values[which & np.isfinite(number.values)]) for x, which in entry.groups()]
        groups = [(x, values) for x, values in groups if values.size]
        places = np.array([x for x, _ in groups])
        means = np.array([values.mean() for _, values in groups])
        low = np.array([values.min() for _, values in groups])
        high = np.array([values.max() for _, values in groups])
        _limits(axes, number, upright=False)
        axes.vlines(places, low, high, color=style.SKY, linewidth=4.0, zorder=2)
        dashes = "none" if entry.words else "-"
        axes.plot(places, means, "o", color=style.BLUE, markersize=4, linestyle=dashes, linewidth=1.2, zorder=3)
        axes.set_xlim(*entry.span())
        axes.set_ylim(*number.span())
        _ticks(axes, entry, number, outer_x=row == len(down) - 1, outer_y=column == 0)
        if row == len(down) - 1:
            axes.set_xlabel(entry.label(room + _ACROSS / 2), fontsize=_NAME)
        if column == 0:
            axes.set_ylabel(number.label(tall), fontsize=_NAME)
    alone = all(which.sum() == 1 for each in across for _, which in each.groups())
    gathered = any(len(np.unique(each.values)) > MOST_VALUES for each in across)
    by = f"value, many values in {CLASSES} classes of as many cases" if gathered else "value"
    shown = "each case" if alone else f"mean (dot) and range (bar) of the cases of each {by}"
    words = f"main effects over {counted(count, 'case')}: {shown}"
    if any(each.limits for each in down):
        words += "; grey: not met"
    _title(figure, words + _without(down, count) + _left(entries, across, "entries") + _left(results, down, "results"))
    return figure


def scatter(entries: Sequence[_Axis], results: Sequence[_Axis], table: Table, *, required: bool) -> Figure:
    """Every two of the entries and results against another, a point a case; those that do not meet a limit marked."""
    taken = [*entries[: MOST_SCATTERED - 1]]
    taken += results[: MOST_SCATTERED - len(taken)]
    size = len(taken) - 1
    side = min(_SQUARE, (style.width() - _MARGINS["left"] - _MARGINS["right"] - (size - 1) * _ACROSS) / size)
    figure, panels = style.page(size * size, size, side, top=_TOP_OF_LEGEND, across=_ACROSS, down=_DOWN, **_MARGINS)
    room = panels[0].get_position().width * style.width()
    codes = table["exit_code"]
    kinds = [
        (_MET if required else ("answered", *_MET[1:]), codes == 0), (_MISSED, codes == 1), (_FAILED, codes > 1),
    ]  # fmt: skip
    for k, axes in enumerate(panels):
        row, column = divmod(k, size)
        if column > row:
            axes.remove()
            continue
        x, y = taken[column], taken[row + 1]
        _limits(axes, x, upright=True)
        _limits(axes, y, upright=False)
        for (_, color, marker), which in kinds:
            axes.plot(
                x.values[which], y.values[which], marker, color=color, markersize=4.5, markeredgewidth=0.4,
                markeredgecolor="white", linestyle="none", zorder=3,
            )  # fmt: skip
        axes.set_xlim(*x.span())
        axes.set_ylim(*y.span())
        _ticks(axes, x, y, outer_x=row == size - 1, outer_y=column == 0)
        if row == size - 1:
            axes.set_xlabel(x.label(room + _ACROSS / 2), fontsize=_NAME)
        if column == 0:
            axes.set_ylabel(y.label(side), fontsize=_NAME)
    for (words, color, marker), which in kinds:
        if which.any():
            label = f"{words} ({counted(int(which.sum()), 'case')})"
            panels[0].plot([], [], marker, color=color, markersize=6, linestyle="none", label=label)
    handles, labels = panels[0].get_legend_handles_labels()
    top = 1 - 0.3 / figure.get_figheight()
    figure.legend(handles, labels, loc="upper left", bbox_to_anchor=(0.0, top), ncols=3, fontsize=_NAME)
    limits = "; grey: not met" if any(each.limits for each in taken) else ""
    told = _left(entries, taken, "entries") + _left(results, taken, "results")
    _title(figure, f"cases: every two quantities against each other{limits}{told}")
    return figure


def _limits(axes: Axes, of: _Axis, *, upright: bool) -> None:
    """Dashed lines at the limits of a requirement, and what lies beyond them in grey."""
    line, span = (axes.axvline, axes.axvspan) if upright else (axes.axhline, axes.axhspan)
    lowest, highest = of.span()
    for limit, end in ((of.low, lowest), (of.high, highest)):
        if limit is not None:
            line(limit, color=style.INK, linestyle=style.DASHES[1], linewidth=1.0, zorder=1.5)
            span(min(limit, end), max(limit, end), color=style.FAINT, alpha=0.18, linewidth=0, zorder=0.5)


def _ticks(axes: Axes, x: _Axis, y: _Axis, *, outer_x: bool, outer_y: bool) -> None:
    """Few ticks, words where there are words, numbers at the outer edges only."""
    for axis, of, outer in ((axes.xaxis, x, outer_x), (axes.yaxis, y, outer_y)):
        if of.words:
            axis.set_ticks(range(len(of.words)), [cut(word, MOST_LETTERS) if outer else "" for word in of.words])
        else:
            values = np.unique(of.values[np.isfinite(of.values)])
            few = 1 < len(values) <= FEW_VALUES and not of.limits
            axis.set_major_locator(FixedLocator(values.tolist()) if few else MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
            axis.set_tick_params(labelbottom=outer, labelleft=outer)


def _title(figure: Figure, words: str) -> None:
    folded = style.folded(words, _TITLE, style.width() - 0.2)
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), folded, va="top", fontsize=_TITLE)


def _left(all_of: Sequence[_Axis], shown: Sequence[_Axis], what: str) -> str:
    left = len([each for each in all_of if each not in shown])
    return f"; {left} more {what} in sweep.csv" if left else ""


def _without(shown: Sequence[_Axis], count: int) -> str:
    """How many cases have not every number."""
    lost = int(np.isnan([each.values for each in shown]).any(axis=0).sum())
    return f"; {lost} of {counted(count, 'case')} without a number left out" if lost else ""
