"""Pictures of the cases of a matrix: what each entry that varies does to each result, and every two against another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.layout import fitting_panels
from mechdesign.drawing.marks import Dots, Own, Panel, Picture
from mechdesign.drawing.pictures import picture
from mechdesign.experiments.figures.sweep.quantities import (
    CLASSES,
    MOST_DRAWN,
    MOST_VALUES,
    CaseAxis,
    CaseNames,
    kinds_of,
    left_out,
    limit_marks,
    names_of,
    sample,
    without_number,
)
from mechdesign.experiments.figures.sweep.view import CasesView
from mechdesign.ground.errors import counted

# Entries, rows of panels, and quantities that a picture has room for.
MOST_ENTRIES = 6
MOST_ROWS = 6
MOST_SCATTERED = 7


@picture(CasesView, "main_effects", order=20)
def main_effects(view: CasesView) -> Picture | None:
    """A row of panels a result, a column an entry: mean and range over the cases of each value; dashed, its limits.

    Where there is no room for all entries side by side, the rest stands below.
    """
    if view.empty:
        return None
    entries, results, count = view.entries, view.results, len(view.table)
    shown = entries[:MOST_ENTRIES]
    columns = min(len(shown), fitting_panels("grid"))
    blocks = [shown[k : k + columns] for k in range(0, len(shown), columns)]
    down = results[: max(1, MOST_ROWS // len(blocks))]
    alone = all(which.sum() == 1 for axis in shown for _, which in axis.groups())
    gathered = any(len(axis.distinct) > MOST_VALUES for axis in shown)
    by = f"value, many values in {CLASSES} classes of as many cases" if gathered else "value"
    title = f"Main effects over {counted(count, 'case')}: "
    title += "each case" if alone else f"mean (dot) and range (bar) of the cases of each {by}"
    title += "; grey: not met" * any(axis.limits for axis in down)
    title += without_number(down, count) + left_out(entries, shown, "entry") + left_out(results, down, "result")
    panels: list[Panel | None] = []
    for block in blocks:
        for number in down:
            panels += [_effect(entry, number, names_of(view.table, entry, number) if alone else [])
                       for entry in block] + [None] * (columns - len(block))  # fmt: skip
    return Picture(title, panels, across=columns, share="grid" if len(blocks) == 1 else "")


def _effect(entry: CaseAxis, number: CaseAxis, names: Sequence[CaseNames]) -> Panel:
    """Mean and range of a result over the cases of each value of an entry."""
    groups = [(x, number.values[which & np.isfinite(number.values)]) for x, which in entry.groups()]
    groups = [(x, values) for x, values in groups if values.size]
    places = [x for x, _ in groups]
    low, high = ([end(values) for _, values in groups] for end in (np.min, np.max))
    bars: dict[str, Any] = {"color": style.SKY, "linewidth": 2.5 if style.narrow() else 4.0, "zorder": 2}
    dots = {"color": style.BLUE, "markersize": 3 if style.narrow() else 4, "linewidth": 1.2, "zorder": 3,
            "linestyle": "none" if entry.words else "-"}  # fmt: skip
    marks = [*limit_marks(number), Own(lambda axes: axes.vlines(places, low, high, **bars)),
             Dots(places, [values.mean() for _, values in groups], look=dots), *names]  # fmt: skip
    return Panel(marks, entry.axis, number.axis)


@picture(CasesView, "scatter", order=30)
def scatter(view: CasesView) -> Picture | None:
    """Every two of the entries and results against another, a point a case; those that do not meet a limit marked."""
    if view.empty:
        return None
    entries, results, table, required = view.entries, view.results, view.table, bool(view.study.requirements)
    most = min(MOST_SCATTERED, fitting_panels("grid") + 1)
    taken = [*entries[: most - 1]]
    taken += results[: most - len(taken)]
    kinds, (drawn, dot) = kinds_of(table, required=required), sample(table, MOST_DRAWN)
    size = min(dot, 3.0) if style.narrow() else dot
    cases = "cases" if len(drawn) == len(table) else f"an even sample of {len(drawn):,} of {len(table):,} cases"
    limits = "; grey: not met" if any(axis.limits for axis in taken) else ""
    omitted = left_out(entries, taken, "entry") + left_out(results, taken, "result")
    panels = [
        Panel([*limit_marks(x, "x"), *limit_marks(y), *(kind.dots(x, y, drawn, size) for kind in kinds),
               *names_of(table, x, y)], x.axis, y.axis)
        if column <= row else None
        for row, y in enumerate(taken[1:]) for column, x in enumerate(taken[:-1])
    ]  # fmt: skip
    title = f"Every two quantities of {cases} against each other{limits}{omitted}"
    return Picture(title, panels, across=len(taken) - 1, share="grid")
