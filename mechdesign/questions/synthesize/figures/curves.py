"""The curves of centre points and circle points of four positions."""

from __future__ import annotations

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Dots, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.pictures import View, picture
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.questions.synthesize.body import Positions

# Poles that are shown lie within so many sizes of the task, and what is shown is larger than them by a factor.
_NEAR, _AROUND = 3.0, 1.5


@picture(View, "centre_points", order=30)
def centre_points_picture(view: View) -> Picture | None:
    """Where links through four positions have their pivots in the frame, and their pins in the body."""
    table = view.result.tables.get("centre_points")
    if table is None or not len(table):
        return None
    drawn, best = DrawnSolutions.of(view.result), view.result.tables["solutions"]
    task, links = Positions(drawn.places, drawn.directions), np.asarray(best["kind"]) == "four_bar"
    pole, panels = task.poles, []
    first = np.triu_indices(4, 1)[0]
    body = (pole - task.places[first]) / task.rotations[first]
    for name, title, own, places, joints in (
        ("centre", "pivots in the frame", pole, task.places, ("ground.O", "ground.D")),
        ("circle", "pins in the body", body, np.zeros(1, dtype=complex), ("coupler.A", "coupler.B")),
    ):
        way = table[f"{name}.x"] + 1j * table[f"{name}.y"]
        way = np.insert(way, np.flatnonzero(np.diff(table["curve"])) + 1, np.nan)
        used = np.concatenate([best[f"{joint}.x"][links] + 1j * best[f"{joint}.y"][links] for joint in joints])
        marks: list[PanelMark] = [
            Trace(way.real, way.imag, label="links through all four positions", look={"color": style.BLUE}),
            _dots(used, "links of the solutions", {"color": style.VERMILION, "markersize": 4}),
            _dots(own, "poles", {"color": style.INK, "marker": "x", "markersize": 5}),
            _dots(places, "origin of the body", {"color": style.GREEN, "marker": "s", "markersize": 4}),
        ]
        # Away from the poles and the task the curve is nearly straight.
        near = np.concatenate([own[np.abs(own - own.mean()) <= _NEAR * task.size], places])
        panels.append(drawn_plane(marks, near.mean() + _AROUND * (near - near.mean()), drawn.study, title))
    return Picture("Links through four positions", panels, across=2)


def _dots(places: Complexes, label: str, look: dict[str, object]) -> Dots:
    return Dots(places.real, places.imag, label=label, look=look)
