"""Hodographs: the way of the tip of a point's velocity, and of its acceleration, drawn from one pole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.mechanism.algebra import vector
from mechdesign.numerics.arrays import Complexes
from mechdesign.questions.kinematics.figures.paths import Steps, steps_of
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.panels import legend_at_left
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table

MOST_POINTS = 5
MOST_TICKS = 6
_TALL = 3.3  # inches, a panel
_LEFT, _RIGHT, _TOP, _BELOW, _BETWEEN = 0.85, 0.15, 0.75, 0.95, 0.95
_DOWN = 0.85  # inches between panels one below the other
_MARGIN = 0.15  # of the size of a hodograph, left free around it
# As for forces, rare peaks near a dead centre leave the panel.
_USUAL, _BEYOND = 0.9, 4.0
_DASHES = ("-", (0, (6, 1.5)), (0, (2, 1)), (0, (6, 1.5, 1, 1.5)), (0, (9, 2)))
_NUMBER = 8.0  # points, the type of a number


@picture(MotionView, "hodographs", order=60)
def hodographs_figure(view: MotionView) -> Figure | None:
    """Velocities of points and their accelerations over a motion, a panel each; where the study asks for it."""
    sweep = view.sweep
    table = view.result.tables["motion"].take(sweep.rows)
    if not view.asks_for("hodographs") or not sweep.poses.motion:
        return None
    points = [name.removesuffix(".x_velocity") for name in table.names if name.endswith(".x_velocity")]
    points = [point for point in points if f"{point}.y_velocity" in table][:MOST_POINTS]
    if not points:
        return None
    columns = 1 if style.narrow() else 2
    figure, panels = style.page(2, columns, _TALL, left=_LEFT, right=_RIGHT, top=_TOP, bottom=_BELOW, across=_BETWEEN,
                                down=_DOWN)  # fmt: skip
    steps = steps_of(sweep)
    words = "Hodographs: the tips of the vectors of each point, drawn from the pole +"
    if steps is not None:
        words += f"\ndots {steps.words}; ring: the first pose"
    words = style.folded(words, 9, style.width() - _LEFT)
    style.grow(figure, above=style.line(9) * max(words.count("\n") - 1, 0))
    figure.text(_LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=9)
    for axes, order in zip(panels, ("velocity", "acceleration"), strict=True):
        _draw(axes, table, points, order, steps)
    handles = [line for line in panels[0].lines if not str(line.get_label()).startswith("_")]
    legend_at_left(figure, handles, len(handles))
    return figure


def _draw(axes: Axes, table: Table, points: Sequence[str], order: str, steps: Steps | None) -> None:
    """One order of rates of some points, with dots at equal steps of what is swept."""
    rates = {point: _rates(table, point, order) for point in points}
    finite = np.concatenate([z[np.isfinite(z)] for z in rates.values()])
    usual = finite[np.abs(finite) <= _BEYOND * np.quantile(np.abs(finite), _USUAL)] if len(finite) else finite
    window = np.append(usual, 0.0)
    size = max(float(np.ptp(window.real)), float(np.ptp(window.imag)), 1e-300)
    middle = complex(window.real.min() + window.real.max(), window.imag.min() + window.imag.max()) / 2
    box, figure = axes.get_position(), axes.get_figure(root=True)
    assert figure is not None
    sides = complex(figure.get_figwidth() * box.width, figure.get_figheight() * box.height)
    half = (0.5 + _MARGIN) * size / min(sides.real, sides.imag) * sides
    axes.set_xlim((middle - half).real, (middle + half).real)
    axes.set_ylim((middle - half).imag, (middle + half).imag)
    axes.set_aspect("equal")
    axes.locator_params(nbins=MOST_TICKS)
    axes.plot([0], [0], "+", color=style.INK, markersize=11, markeredgewidth=1.6, zorder=4)
    numbers: list[Label] = []
    for (point, z), color, dashes in zip(rates.items(), style.PALETTE, _DASHES, strict=False):
        axes.plot(z.real, z.imag, color=color, linestyle=dashes, linewidth=1.7, label=point)
        first = z[np.isfinite(z)][:1]
        axes.plot(first.real, first.imag, "o", color=color, markersize=8, markerfacecolor="none", markeredgewidth=1.4)
        if steps is not None:
            dots = z[steps.rows]
            axes.plot(dots.real, dots.imag, "o", color=color, markersize=3.5, linestyle="none")
            for row, text in steps.written.items():
                if np.isfinite(z[row]):
                    away = float(np.angle(z[row] - middle))
                    numbers.append(Label(text, (complex(z[row]),), color, 4.0, away, _NUMBER, optional=True))
    unit = table.column(f"{points[0]}.x_{order}").unit
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        axis.set_label_text(style.axis_label(f"{order} {name}", unit))
    place_labels(axes, numbers, covered(axes), order=5.0)


def _rates(table: Table, point: str, order: str) -> Complexes:
    return np.asarray(vector(table[f"{point}.x_{order}"], table[f"{point}.y_{order}"]))
