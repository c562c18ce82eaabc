"""The linkages of a synthesis with their curves and the task, and error against transmission angle."""

from __future__ import annotations

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import Axis, Dots, Panel, PanelMark, Picture, Trace, Words
from mechdesign.drawing.panels import drawn_plane, quantity
from mechdesign.drawing.pictures import View, picture
from mechdesign.drawing.scene import Scene
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.questions.synthesize.solutions import Solution

# Linkages on the page, and poses of their curves.
_SHOWN, _POSES = 9, 181
_FEW = 20


@picture(View, "solutions", order=10)
def solutions_picture(view: View) -> Picture:
    """The best linkages, each at the first position of the task, with its curve and the points."""
    drawn, unit = DrawnSolutions.of(view.result), view.result.tables["solutions"].column("error").unit
    panels = []
    for number, solution in enumerate(drawn.solutions[:_SHOWN], 1):
        first = (np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp))
        scene = Scene(solution.variant, solution.poses.take(first))
        still = scene.at(0)
        assert still is not None
        curve, points = _curve(solution), drawn.task.points
        marks: list[PanelMark] = [Posed(still, names=False, drives=False)]
        if len(points):
            marks += [
                Trace(curve.real, curve.imag, label="its curve", look={"color": style.BLUE, "linewidth": 1.2}),
                Dots(points.real, points.imag, label="the task", look={"color": style.VERMILION, "markersize": 4}),
            ]
        shows = np.concatenate([curve[np.isfinite(curve)] if len(points) else points, points, [*still.points.values()]])
        error = quantity(float(drawn.errors[number - 1]), unit)
        words = f"{number}: {solution.kind.name.replace('_', ' ')}, error {error}"
        faults = f"defect: {solution.defects}" if solution.defects else ""
        panels.append(drawn_plane(marks, shows, drawn.study, "\n".join(filter(None, (words, faults)))))
    return Picture(f"The best {len(panels)} of {len(drawn.solutions)} linkages", panels, across=3)


def _curve(solution: Solution) -> Complexes:
    """The way of the point P over a turn, or between the positions where the drive does not turn."""
    low, high = float(solution.angles.min()), float(solution.angles.max())
    angles = np.linspace(low, low + 2 * np.pi if solution.full_turn else high, _POSES)
    return np.asarray(solution.kind.points(solution.kind.solve(solution.values[None], angles[None], solution.modes))[0])


@picture(View, "trade", order=20)
def trade_picture(view: View) -> Picture | None:
    """Error against the smallest transmission angle; the front is those that none surpasses in both."""
    table, errors = view.result.tables["solutions"], DrawnSolutions.of(view.result).errors
    angles = np.asarray(table["transmission_angle"])
    if len(table) < 2:
        return None
    best = np.array([not ((errors < e) & (angles >= a) | (errors <= e) & (angles > a)).any()
                     for e, a in zip(errors, angles, strict=True)])  # fmt: skip
    order = np.flatnonzero(best)[np.argsort(angles[best])]
    marks: list[PanelMark] = [
        Trace(angles[order], errors[order], label="front: no other is better in both",
              look={"color": style.BLUE, "drawstyle": "steps-pre", "linewidth": 1.2}),
        Dots(angles, errors, label="linkages", look={"color": style.VERMILION, "markersize": 5}),
        *(Words(angles[k], errors[k], f" {k + 1}") for k in order[:_FEW].tolist()),
    ]  # fmt: skip
    across = Axis("smallest transmission angle, more is better", table.column("transmission_angle").unit)
    return Picture("What error costs in transmission", [
        Panel(marks, across, Axis("error, less is better", table.column("error").unit))
    ])  # fmt: skip
