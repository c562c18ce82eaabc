"""What a mechanism does to its frame: the hodograph of the shaking force, and the shaking moment over the motion."""

from __future__ import annotations

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.joints import NOTHING, force_panel, hodograph, peak
from mechdesign.drawing.marks import Axis, Lines, Panel, Picture, Trace
from mechdesign.drawing.panels import quantity
from mechdesign.drawing.pictures import picture
from mechdesign.questions.dynamics.figures.view import DynamicsView


@picture(DynamicsView, "shaking", order=50)
def shaking_picture(view: DynamicsView) -> Picture | None:
    """Shaking force and moment of a motion; None of poses at rest, and where both stay the same."""
    over, units, extremes = view.swept, view.study.units, view.result.tables["extremes"]
    if over is None or not view.question.moves:
        return None
    force, moment = view.force("shaking."), view.column("shaking_moment")
    joints, _ = view.joints
    least = NOTHING * 1e-3 * peak(joints)

    def words(name: str, kind: str, meaning: str) -> str:
        row = extremes.take(extremes.where(output=name))
        most, rms = (quantity(float(row[key][0]), units.label(kind), float(row["peak"][0])) for key in ("peak", "rms"))
        return f"Shaking {meaning}\nat most {most}, rms {rms}"

    panels = []
    if np.nanmax(np.abs(force), initial=0.0) > least:
        way = hodograph(force, {"color": style.BLUE, "linestyle": "-"})
        panels.append(force_panel(view.study, way, words("shaking", "force", "force; dot: first pose, ring: largest")))
    if np.nanmax(np.abs(moment), initial=0.0) > least * view.study.mechanism.size:
        marks = [Trace(over.values, moment, look={"color": style.VERMILION, "linewidth": 1.8}),
                 Lines([0.0], look={"color": style.FAINT, "linewidth": 0.9, "zorder": 1.5})]  # fmt: skip
        title = words("shaking_moment", "moment", "moment about the origin")
        panels.append(Panel(marks, over.axis, Axis("shaking moment", units.label("moment")), title))
    return Picture("", panels, across=2) if panels else None
