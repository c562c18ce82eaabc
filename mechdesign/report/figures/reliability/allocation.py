"""Tolerances as given and as allocated, and what they cost."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import fitting, framed, title
from mechdesign.results import Table
from mechdesign.study import Study

MOST_SOURCES = 20
_LINE = 0.36  # inches


def allocation_figure(study: Study, table: Table) -> Figure:
    """Bars for each source: its tolerance, given and allocated, and its cost."""
    rows = np.arange(len(table))[:MOST_SOURCES]
    kinds = [str(table["kind"][row]) for row in rows]
    names = [
        f"{table['source'][row]}" + f" ({kind})" * (kind != "tolerance") for row, kind in zip(rows, kinds, strict=True)
    ]
    units = [str(table["unit"][row]) for row in rows]
    margin = 0.35 + 0.075 * max(len(name) for name in names)
    height = 0.8 + _LINE * len(rows) + 1.05
    across = 0.45
    figure = framed(height, left=margin, right=0.2, top=0.8, bottom=1.05, apart=(0.0, across))
    one, two = figure.subplots(1, 2, sharey=True)
    alike = len(set(units)) == 1
    given, allocated = table["given"][rows], table["allocated"][rows]
    # Tolerances of several units do not share an axis: their ratios do.
    scale = np.ones(len(rows)) if alike else given
    _pair(one, given / scale, allocated / scale)
    one.set_xlabel(style.axis_label("tolerance", units[0]) if alike else "tolerance over the given one")
    for place, row in enumerate(rows):
        text = f" {table['allocated'][row]:.3g}" + ("" if alike else f" {units[place]}")
        one.text(float((allocated / scale)[place]), place + 0.2, text, va="center", fontsize=8)
    costs = table["cost_given"][rows], table["cost_allocated"][rows]
    _pair(two, *costs)
    two.set_xlabel("cost")
    one.set_yticks(np.arange(len(rows)), names)
    one.invert_yaxis()
    two.tick_params(axis="y", length=0)
    for axis in (one, two):
        axis.grid(visible=False, axis="y")
        axis.margins(x=0.16, y=0.02)
        axis.locator_params(axis="x", nbins=5)
    section = study.reliability
    assert section is not None
    assert section.allocate is not None
    total = [float(np.nansum(table[name])) for name in ("cost_given", "cost_allocated")]
    note = f"cost {total[0]:.4g} as given, {total[1]:.4g} allocated ({100 * (total[1] / total[0] - 1):+.1f} %)"
    title(figure, f"Cheapest tolerances for a reliability of {section.allocate.reliability:.10g}", note, left=margin)
    handles, labels = one.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=fitting(labels), borderaxespad=0.2)
    return figure


def _pair(axis: Axes, given: Floats, allocated: Floats) -> None:
    places = np.arange(len(given))
    axis.barh(places - 0.2, given, 0.36, color=style.FAINT, label="as given")
    axis.barh(places + 0.2, allocated, 0.36, color=style.BLUE, label="allocated")
