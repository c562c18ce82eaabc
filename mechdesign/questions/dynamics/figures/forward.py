"""A motion in time: values and velocities of the drives, with the limits that they reach."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import MAX_PANELS, clear_of_ticks, stack, tick_abscissa
from mechdesign.report.figures.pictures import picture

_FEW_PANELS = 4  # more of them are lower
_TALL, _LOW = 1.75, 1.3  # inches


@picture(DynamicsView, "forward", order=10)
def forward_figure(view: DynamicsView) -> Figure | None:
    """Values and velocities of the drives over time; None of poses that are given."""
    over, tables = view.swept, view.result.tables
    if over is None or "forward" not in tables:
        return None
    table, events = tables["forward"], tables["events"]
    drives = view.study.mechanism.drives
    names = [name for drive in drives for name in (drive, f"{drive}_velocity")][:MAX_PANELS]
    tall = _LOW if len(names) > _FEW_PANELS else _TALL
    happened = np.isfinite(events["time"])
    times, words = events["time"][happened], dict.fromkeys(events["event"][happened].tolist())
    note = f"dotted: {', '.join(words)}" if words else ""
    figure, panels = stack(len(names), "Motion in time", over.label, note=note, tall=tall)
    for axes, name in zip(panels, names, strict=True):
        column = table.column(name)
        axes.plot(*view.broken(column.values), color=style.BLUE if name in drives else style.GREEN, linewidth=1.8)
        for time in np.unique(times):
            axes.axvline(time, color=style.FAINT, linestyle=":", linewidth=1.0, zorder=1.5)
        axes.set_ylabel(style.axis_label(name if name in drives else "velocity", column.unit))
        axes.set_title(name, loc="left", fontsize=9.5)
    panels[-1].set_xlim(float(table["time"][0]), float(table["time"][-1]))
    tick_abscissa(panels[-1], over)
    clear_of_ticks(figure, panels)
    return figure
