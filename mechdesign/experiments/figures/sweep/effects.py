"""Pictures of the cases of a matrix: what each entry that varies does to each result, and every two against another."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.errors import counted
from mechdesign.experiments.figures.sweep.quantities import (
    CLASSES,
    GAP,
    MOST_DRAWN,
    MOST_VALUES,
    NAME,
    TITLE,
    Axis,
    draw_limits,
    frame,
    kinds_of,
    left_out,
    sample,
    title,
    without_number,
)
from mechdesign.experiments.figures.sweep.view import CasesView
from mechdesign.report.figures import style
from mechdesign.report.figures.pictures import picture

# Inches.
_MARGINS = {"left": 1.1, "right": 0.15, "bottom": 0.75}
_LEGEND = 0.25  # a line of it
_NARROWEST = 0.9  # of a panel
_ACROSS, _DOWN = 0.22, 0.22
_TALL, _FLAT = 2.6, 1.5  # of a panel of main effects, in one row and in many
_SQUARE = 3.6  # of a panel of scatters, at most
# Entries, rows of panels, and quantities that a picture has room for.
MOST_ENTRIES = 6
MOST_ROWS = 6
MOST_SCATTERED = 7


@picture(CasesView, "main_effects", order=20)
def main_effects(view: CasesView) -> Figure | None:
    """A row of panels a result, a column an entry: mean and range over the cases of each value; dashed, its limits.

    Where there is no room for all entries side by side, the rest stands below.
    """
    if view.empty:
        return None
    entries, results, count = view.entries, view.results, len(view.table)
    across = entries[:MOST_ENTRIES]
    columns = min(len(across), _fitting())
    blocks = [across[k : k + columns] for k in range(0, len(across), columns)]
    down = results[: max(1, MOST_ROWS // len(blocks))]
    alone = all(which.sum() == 1 for axis in across for _, which in axis.groups())
    gathered = any(len(axis.distinct) > MOST_VALUES for axis in across)
    by = f"value, many values in {CLASSES} classes of as many cases" if gathered else "value"
    shown = "each case" if alone else f"mean (dot) and range (bar) of the cases of each {by}"
    words = f"Main effects over {counted(count, 'case')}: {shown}"
    if any(axis.limits for axis in down):
        words += "; grey: not met"
    words += without_number(down, count) + left_out(entries, across, "entry") + left_out(results, down, "result")
    head, top = title(words)
    tall = max(_FLAT, _TALL / len(down))
    # Below each block of several stand its names.
    gap = _DOWN if len(blocks) == 1 else _MARGINS["bottom"]
    figure, panels = style.page(
        columns * len(down) * len(blocks), columns, tall, top=top, across=_ACROSS, down=gap, **_MARGINS
    )  # fmt: skip
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), head, va="top", fontsize=TITLE)
    room = panels[0].get_position().width * style.width()
    for k, axes in enumerate(panels):
        row, column = divmod(k, columns)
        block, number = blocks[row // len(down)], down[row % len(down)]
        if column >= len(block):
            axes.remove()
            continue
        named = len(blocks) > 1 or row == len(down) - 1
        _effect(axes, block[column], number)
        frame(axes, block[column], number, room, tall, between=_ACROSS / 2, outer_x=named, outer_y=column == 0)
    return figure


def _effect(axes: Axes, entry: Axis, number: Axis) -> None:
    """Mean and range of a result over the cases of each value of an entry."""
    groups = [(x, number.values[which & np.isfinite(number.values)]) for x, which in entry.groups()]
    groups = [(x, values) for x, values in groups if values.size]
    places = [x for x, _ in groups]
    draw_limits(axes, number, upright=False)
    low, high = ([end(values) for _, values in groups] for end in (np.min, np.max))
    axes.vlines(places, low, high, color=style.SKY, linewidth=2.5 if style.narrow() else 4.0, zorder=2)
    axes.plot(
        places, [values.mean() for _, values in groups], "o", color=style.BLUE, markersize=3 if style.narrow() else 4,
        linestyle="none" if entry.words else "-", linewidth=1.2, zorder=3,
    )  # fmt: skip


@picture(CasesView, "scatter", order=30)
def scatter(view: CasesView) -> Figure | None:
    """Every two of the entries and results against another, a point a case; those that do not meet a limit marked."""
    if view.empty:
        return None
    entries, results, table, required = view.entries, view.results, view.table, bool(view.study.requirements)
    most = min(MOST_SCATTERED, _fitting() + 2)
    taken = [*entries[: most - 1]]
    taken += results[: most - len(taken)]
    size = len(taken) - 1
    side = min(_SQUARE, (style.width() - _MARGINS["left"] - _MARGINS["right"] - (size - 1) * _ACROSS) / size)
    kinds, (drawn, dot) = kinds_of(table, required=required), sample(table, MOST_DRAWN)
    cases = "cases" if len(drawn) == len(table) else f"an even sample of {len(drawn):,} of {len(table):,} cases"
    limits = "; grey: not met" if any(axis.limits for axis in taken) else ""
    omitted = left_out(entries, taken, "entry") + left_out(results, taken, "result")
    head, top = title(f"Every two quantities of {cases} against each other{limits}{omitted}")
    columns = 1 if style.narrow() else 2
    words = [style.folded(kind.words, NAME, style.width() / columns - 0.6) for kind in kinds]
    legend = top
    top += _LEGEND * -(-len(kinds) // columns) + style.line(NAME) * sum(word.count("\n") for word in words)
    figure, panels = style.page(size * size, size, side, top=top, across=_ACROSS, down=_DOWN, **_MARGINS)
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), head, va="top", fontsize=TITLE)
    for kind in kinds:
        kind.draw_key(panels[0])
    place = (0.0, 1 - (legend - GAP) / figure.get_figheight())
    keys = panels[0].get_legend_handles_labels()[0]
    figure.legend(keys, words, loc="upper left", bbox_to_anchor=place, ncols=columns, borderaxespad=0.0)
    room = panels[0].get_position().width * style.width()
    for k, axes in enumerate(panels):
        row, column = divmod(k, size)
        if column > row:
            axes.remove()
            continue
        x, y = taken[column], taken[row + 1]
        draw_limits(axes, x, upright=True)
        draw_limits(axes, y, upright=False)
        for kind in kinds:
            kind.draw(axes, x.values, y.values, drawn, min(dot, 3.0) if style.narrow() else dot)
        frame(axes, x, y, room, side, between=_ACROSS / 2, outer_x=row == size - 1, outer_y=column == 0)
    return figure


def _fitting() -> int:
    """Panels for which the page has room side by side."""
    room = style.width() - _MARGINS["left"] - _MARGINS["right"]
    return max(1, int((room + _ACROSS) / (_NARROWEST + _ACROSS)))
