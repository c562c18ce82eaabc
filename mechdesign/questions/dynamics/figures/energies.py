"""Energies of a motion: kinetic, potential, and both together."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import clear_of_ticks, legend_below, quantity, stack, tick_abscissa
from mechdesign.report.figures.pictures import picture

_TALL = 2.6  # inches
_LOOKS: dict[str, tuple[str, Any]] = {"kinetic": (style.BLUE, "-"), "potential": (style.VERMILION, (0, (6, 2)))}
_SUM: tuple[str, Any] = (style.INK, (0, (1.5, 1.2)))


@picture(DynamicsView, "energies", order=60)
def energies_figure(view: DynamicsView) -> Figure | None:
    """Energies over a motion; None where none changes."""
    over = view.swept
    if over is None:
        return None
    curves = {kind: view.column(name) for kind in _LOOKS if (name := f"{kind}_energy") in view.drawn.motion.arrays
              and view.moves(name)}  # fmt: skip
    if not curves:
        return None
    unit = view.study.units.label("moment")
    notes = [f"{kind} from {quantity(float(np.nanmin(values)), unit)} to {quantity(float(np.nanmax(values)), unit)}"
             for kind, values in curves.items()]  # fmt: skip
    looks = {kind: _LOOKS[kind] for kind in curves}
    if len(curves) > 1:
        curves["sum"], looks["sum"] = np.sum([*curves.values()], axis=0), _SUM
    figure, (axes,) = stack(1, "Energies", over.label, note=", ".join(notes), tall=_TALL)
    handles = []
    for kind, values in curves.items():
        color, dashes = looks[kind]
        line = view.broken(values) if "forward" in view.result.tables else (over.values, values)
        axes.plot(*line, color=color, linestyle=dashes, linewidth=1.8)
        handles.append(Line2D([], [], color=color, linestyle=dashes, linewidth=1.8, label=kind))
    axes.set_xlim(float(over.values.min()), float(over.values.max()))
    axes.set_ylabel(style.axis_label("energy", unit))
    tick_abscissa(axes, over)
    clear_of_ticks(figure, [axes])
    if len(handles) > 1:
        legend_below(figure, handles, list(curves))
    return figure
