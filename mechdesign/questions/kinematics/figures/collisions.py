"""Plates in the pose in which they are nearest to each other, with what they have in common."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import Own, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Scene
from mechdesign.drawing.shapes import link_colors
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.mechanism.plates import Clearances, common
from mechdesign.questions.kinematics.collisions import Meeting, meetings, posed
from mechdesign.questions.kinematics.figures.view import MotionView

_MOST = 4  # pairs that overlap
_PLATE: dict[str, Any] = {"linewidth": 1.2, "zorder": 1.5}
_OVERLAP: dict[str, Any] = {"facecolor": style.VERMILION, "edgecolor": style.INK, "linewidth": 1.0, "zorder": 4.6,
                            "hatch": "////", "alpha": 0.75}  # fmt: skip
_GAP: dict[str, Any] = {"color": style.VERMILION, "linewidth": 2.2, "zorder": 4.6}


@picture(MotionView, "collisions", order=15)
def collisions_picture(view: MotionView) -> Picture | None:
    """Pairs of plates that overlap, each where they do most, or else the nearest pair; None where none is asked for."""
    drawn = view.drawn
    nearest = meetings(drawn.motion, drawn.along) if drawn.motion.question.pairs else []
    if not nearest:
        return None
    overlaps = sum(meeting.clearance < 0 for meeting in nearest)
    shown = nearest[: min(max(overlaps, 1), _MOST)]
    heading = "Plates that overlap" if overlaps else "Least clearance of plates"
    heading += f"; the {_MOST} deepest of {overlaps} pairs" * (overlaps > _MOST)
    return Picture(heading, [_panel(view, meeting) for meeting in shown], across=2)


def _panel(view: MotionView, meeting: Meeting) -> Panel:
    """The plates of the mechanism in one pose, with the overlap of two, or the way between them."""
    mechanism, drawn, study = view.study.mechanism, view.drawn, view.study
    configuration = posed(meeting, drawn.motion, drawn.along)
    still = Scene(mechanism, configuration, view.sweep.scene.travel).at(0)
    plates = mechanism.description.plates
    assert plates is not None
    clearances, colors = Clearances(mechanism, plates, configuration), link_colors(mechanism.description)
    marks, unit = list[PanelMark](), study.units.label("length")
    reached = [still.places] if still is not None else []
    items = dict.fromkeys(item for pair in drawn.motion.question.pairs.values() for item in (pair.one, pair.other))
    for item in items:
        outline, color = clearances.outline(item), colors.get(item.links[0], style.FAINT)
        alpha = 0.45 if item in (meeting.pair.one, meeting.pair.other) else 0.15
        marks.append(_filled(outline, _PLATE | {"facecolor": color, "edgecolor": color, "alpha": alpha}))
        reached.append(outline)
    both = [clearances.outline(item) for item in (meeting.pair.one, meeting.pair.other)]
    size = quantity(abs(meeting.clearance), unit)
    if len(overlap := common(*both)):
        marks.append(_filled(overlap, _OVERLAP, label="overlap"))
        words = f"{meeting.names} overlap by {size}"
    else:
        way = _between(*both)
        marks.append(Trace(way.real, way.imag, label="least clearance", look=_GAP))
        words = f"{meeting.names}: {size}"
    marks.append(Posed(still, drives=False))
    return drawn_plane(marks, np.concatenate(reached), study, f"{words} at {meeting.where}")


def _filled(places: Complexes, look: dict[str, Any], label: str = "") -> Own:
    def fill(axes: Axes, look: dict[str, Any]) -> Any:
        return axes.fill(places.real, places.imag, **look)[0]

    return Own(partial(fill, look=look), label=label)


def _between(one: Complexes, other: Complexes) -> Complexes:
    """The nearest places of two closed outlines, as far as they have some."""
    along = np.arange(0, 1, 0.02)
    one, other = ((outline[:, None] + along * (np.roll(outline, -1) - outline)[:, None]).ravel()
                  for outline in (one, other))  # fmt: skip
    first, second = np.unravel_index(np.abs(one[:, None] - other).argmin(), (len(one), len(other)))
    return np.array([one[first], other[second]])
