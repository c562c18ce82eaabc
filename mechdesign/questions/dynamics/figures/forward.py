"""A motion in time: values and velocities of the drives, with the limits that they reach."""

from __future__ import annotations

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Lines, Panel, Picture, Trace
from mechdesign.drawing.panels import MAX_PANELS
from mechdesign.drawing.pictures import picture
from mechdesign.questions.dynamics.figures.view import DynamicsView

_DOTTED = {"color": style.FAINT, "linestyle": ":", "linewidth": 1.0, "zorder": 1.5}


@picture(DynamicsView, "forward", order=10)
def forward_picture(view: DynamicsView) -> Picture | None:
    """Values and velocities of the drives over time; None of poses that are given."""
    over, tables, drives = view.swept, view.result.tables, view.study.mechanism.drives
    if over is None or "forward" not in tables:
        return None
    table, events = tables["forward"], tables["events"]
    happened = np.isfinite(events["time"])
    limits, words = Lines(np.unique(events["time"][happened]), "x", look=_DOTTED), events["event"][happened].tolist()
    panels = []
    for name in [name for drive in drives for name in (drive, f"{drive}_velocity")][:MAX_PANELS]:
        column, look = table.column(name), {"color": style.BLUE if name in drives else style.GREEN, "linewidth": 1.8}
        axis = Axis(name if name in drives else "velocity", column.unit)
        panels.append(Panel([Trace(*view.broken(column.values), look=look), limits], over.axis, axis, name))
    note = f"dotted: {', '.join(dict.fromkeys(words))}" if words else ""
    return Picture("Motion in time", panels, (note,), share="x")
