"""What a mechanism does to its frame: the hodograph of the shaking force, and the shaking moment over the motion."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Complexes
from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.report.figures import style
from mechdesign.report.figures.framing import RIGHT, fit
from mechdesign.report.figures.joints import NOTHING, force_axes, hodograph, peak
from mechdesign.report.figures.panels import quantity, tick_abscissa
from mechdesign.report.figures.pictures import picture

# Inches.
_TALL = 3.4
_ABOVE, _BELOW = 0.62, 0.55
_LEFT, _BETWEEN = 0.85, 1.05
_LOOK = {"color": style.BLUE, "linestyle": "-"}


@picture(DynamicsView, "shaking", order=50)
def shaking_figure(view: DynamicsView) -> Figure | None:
    """Shaking force and moment of a motion; None of poses at rest, and where both stay the same."""
    over = view.swept
    if over is None or not view.question.moves:
        return None
    force, moment = view.force("shaking."), view.column("shaking_moment")
    joints, _ = view.joints
    least = NOTHING * 1e-3 * peak(joints)
    shakes = bool(np.nanmax(np.abs(force), initial=0.0) > least)
    turns = bool(np.nanmax(np.abs(moment), initial=0.0) > least * view.study.mechanism.size)
    if not shakes and not turns:
        return None
    unit, figure, panels = view.study.units, *_layout(shakes + turns)
    if shakes:
        _hodograph(view, panels[0], force)
    if turns:
        axes = panels[-1]
        axes.plot(over.values, moment, color=style.VERMILION, linewidth=1.8)
        axes.axhline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)
        axes.set_xlim(float(over.values.min()), float(over.values.max()))
        axes.set_xlabel(over.label)
        axes.set_ylabel(style.axis_label("shaking moment", unit.label("moment")))
        tick_abscissa(axes, over)
    style.name_powers(panels)
    extremes = view.result.tables["extremes"]
    shown = [("shaking", "force", "force; dot: first pose, ring: largest")] * shakes
    shown += [("shaking_moment", "moment", "moment about the origin")] * turns
    for axes, (name, kind, words) in zip(panels, shown, strict=True):
        row = extremes.take(extremes.where(output=name))
        most, rms = (quantity(float(row[key][0]), unit.label(kind)) for key in ("peak", "rms"))
        axes.set_title(
            f"Shaking {words}\nat most {most}, rms {rms}", loc="left", fontsize=8.0 if style.narrow() else 9.5
        )
    return figure


def _layout(count: int) -> tuple[Figure, list[Axes]]:
    """Panels side by side, on a narrow page one below the other."""
    columns = 1 if style.narrow() else count
    figure, panels = style.page(count, columns, _TALL, left=_LEFT, right=RIGHT, top=_ABOVE, bottom=_BELOW,
                                across=_BETWEEN, down=_ABOVE + _BELOW)  # fmt: skip
    return figure, panels


def _hodograph(view: DynamicsView, axes: Axes, force: Complexes) -> None:
    """The way of the shaking force's tip on equal scales."""
    box, figure = axes.get_position(), axes.get_figure(root=True)
    assert figure is not None
    wide, tall = box.width * figure.get_figwidth(), box.height * figure.get_figheight()
    window = fit(np.append(force, 0.0), wide, _TALL, 0.2)
    half = complex(wide, tall) / 2 / window.scale
    axes.set_xlim(window.middle.real - half.real, window.middle.real + half.real)
    axes.set_ylim(window.middle.imag - half.imag, window.middle.imag + half.imag)
    axes.set_aspect("equal")
    force_axes(view.study, axes)
    hodograph(axes, force, _LOOK)
