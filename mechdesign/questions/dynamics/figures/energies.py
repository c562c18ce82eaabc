"""Energies of a motion: kinetic, potential, and both together."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Panel, Picture, Trace
from mechdesign.drawing.panels import quantity
from mechdesign.drawing.pictures import picture
from mechdesign.questions.dynamics.figures.view import DynamicsView

_FLAT, _STILL = 0.03, 1e-4  # of the range of all curves; of that
_LOOKS: dict[str, dict[str, Any]] = {
    "kinetic": {"color": style.BLUE, "linewidth": 1.8},
    "potential": {"color": style.VERMILION, "linestyle": (0, (6, 2)), "linewidth": 1.8},
    "sum": {"color": style.INK, "linestyle": (0, (1.5, 1.2)), "linewidth": 1.8},
}


@picture(DynamicsView, "energies", order=60)
def energies_picture(view: DynamicsView) -> Picture | None:
    """Energies over a motion; None where none changes."""
    over, arrays = view.swept, view.drawn.motion.arrays
    if over is None:
        return None
    curves = {kind: view.column(name) for kind in _LOOKS
              if (name := f"{kind}_energy") in arrays and view.moves(name)}  # fmt: skip
    if not curves:
        return None
    unit = view.study.units.label("moment")
    most = max(float(np.nanmax(np.abs(values))) for values in curves.values())
    ends = {kind: [quantity(float(end(values)), unit, most) for end in (np.nanmin, np.nanmax)]
            for kind, values in curves.items()}  # fmt: skip
    notes = [f"{kind} from {low} to {high}" for kind, (low, high) in ends.items()]
    if several := len(curves) > 1:
        curves["sum"] = np.sum([*curves.values()], axis=0)
    broken = "forward" in view.result.tables
    # Where one that moves would be flat beside the others each has a panel.
    every = np.ma.masked_invalid([*curves.values()])
    spans, flat = np.ptp(every, axis=1), _FLAT * float(np.ptp(every))
    apart = bool(((spans > _STILL * flat) & (spans < flat)).any())
    marks = [Trace(*(view.broken(values) if broken else (over.values, values)), label=kind * several, look=_LOOKS[kind])
             for kind, values in curves.items()]  # fmt: skip
    panels = [[mark] for mark in marks] if apart else [marks]
    return Picture("Energies", [Panel(some, over.axis, Axis("energy", unit)) for some in panels], (", ".join(notes),),
                   share="x")  # fmt: skip
