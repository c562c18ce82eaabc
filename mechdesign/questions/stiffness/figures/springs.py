"""How the body is held in a pose: its legs as equivalent springs [S4, Fig. 6], and a motion that nothing holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from typing import NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.callouts import point_labels
from mechdesign.drawing.drawing import Posed, draw, write
from mechdesign.drawing.labels import Label
from mechdesign.drawing.marks import Late, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Still, hull, pose
from mechdesign.drawing.shapes import Line, Shape, Strut, Symbol, coil
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.stiffness.analysis import DrawnPose
from mechdesign.questions.stiffness.figures.view import StiffnessView

_COIL_LENGTH = 0.17  # over the size of the mechanism
_SHARES = (0.5, 0.3, 0.75)  # of a spring's length, where the labels of some stand
_ALONG = np.array([0.0, 0.06, -0.06, 0.12, -0.12])  # and beside these
LARGEST_MOVE = 0.12  # largest drawn displacement over the size of the mechanism


@picture(StiffnessView, "springs", order=10)
def springs_picture(view: StiffnessView) -> Picture | None:
    """The equivalent springs at the first pose, as coils, each with its stiffness away from the other springs."""
    study, drawn = view.study, view.drawn.first
    scene = pose(study.mechanism, drawn.configuration) if drawn is not None else None
    if drawn is None or scene is None or not (springs := [*_springs(drawn, scene)]):
        return None
    inside = sum(spring.place + spring.anchor for spring in springs) / (2 * len(springs))
    # On a narrow page labels of neighbours would stand above each other between both.
    shares, labels = cycle(_SHARES if style.narrow() else (0.5,)), []
    for spring, share in zip(springs, shares, strict=False):
        span, unit = spring.anchor - spring.place, study.units.label("stiffness")
        out = 1j * span * np.copysign(1, ((spring.place + 0.5 * span - inside) * (1j * span).conjugate()).real)
        anchors = tuple(spring.place + part * span for part in share + _ALONG)
        words = quantity(spring.stiffness, unit)
        labels.append(Label(words, anchors, style.VERMILION, 16, float(np.angle(out)), 9.5))
    shapes = [shape for spring in springs for shape in spring.shapes(_COIL_LENGTH * scene.span)]
    marks = [Posed(scene, names=False, drives=False), Late(partial(draw, drawn=shapes, order=5.0)),
             Late(partial(write, labels=[*labels, *point_labels(scene)]))]  # fmt: skip
    ends = np.array([end for spring in springs for end in (spring.place, spring.anchor)])
    return posed_picture(view, drawn, [scene.places, ends], "Equivalent springs", marks)


class LegSpring(NamedTuple):
    """A spring from the point where it holds to its anchor; `tip` is the end of its leg.

    The anchor of a grounded one is a joint of the ground, which the mechanism's drawing shows already.
    """

    stiffness: float
    place: complex
    anchor: complex
    tip: complex
    grounded: bool

    def shapes(self, length: float) -> Iterator[Shape]:
        """A coil with its middle so long, its anchor hatched, and a dashed line to where the leg ends."""
        span = self.anchor - self.place
        if abs(self.place - self.tip) > 1e-3 * abs(span):
            yield Line((self.tip, self.place), style.VERMILION, 1.1, 0.0, dashes=(0, (4, 3)))
        half = min(0.7, length / abs(span)) / 2
        for color, width in (("white", 3.6), (style.VERMILION, 1.5)):
            yield Strut((self.place, self.anchor), ("", ""), coil(0.5 - half, 0.5 + half), color, width, 0.1)
        yield Symbol(self.place, 0.3, radius=2.5, fill=style.VERMILION, edge="white")
        if not self.grounded:
            hatch = [(complex(0, y), complex(4, y + 4)) for y in range(-10, 11, 4)]
            yield Symbol(self.anchor, 0.1, ((-12j, 12j), *hatch), edge=style.VERMILION, width=1.3,
                         direction=span / abs(span))  # fmt: skip


def _springs(drawn: DrawnPose, scene: Still) -> Iterator[LegSpring]:
    """The equivalent springs of the legs."""
    legs, length, own = drawn.body.legs or (), _COIL_LENGTH * scene.span, drawn.springs
    columns = (own.leg, own.place, own.angle, own.stiffness)
    for k, place, angle, stiffness in zip(*(column.tolist() for column in columns), strict=True):
        if np.isnan(angle):
            continue
        leg, along = legs[k], complex(np.exp(1j * angle))
        base, tip = scene.points[leg.base], scene.points[leg.tip]
        inward = ((base - place) * along.conjugate()).real
        grounded = abs(inward) > length and abs(base - place - inward * along) < 1e-6 * scene.span
        if not grounded:
            # Its line passes the leg's base: away from the body.
            body = scene.points[drawn.body.section.point]
            base = place + 1.4 * length * (along if ((place - body) * along.conjugate()).real > 0 else -along)
        yield LegSpring(stiffness, place, base, tip, grounded)


@picture(StiffnessView, "free", order=30)
def free_motion_picture(view: StiffnessView) -> Picture | None:
    """The asked body moved both ways along its free twist, at the first pose that has one."""
    study, table, drawn = view.study, view.result.tables["stiffness"], view.drawn.loose
    if drawn is None:
        return None
    section, row = drawn.body.section, drawn.row
    scene = pose(study.mechanism, drawn.configuration)
    if scene is None:
        return None
    at = scene.points[section.point]
    body = [at, *hull([scene.points[p] for p in scene.link_points(section.link)])] if section.link else [at]
    turn = float(table["free_phi"][row]) if "free_phi" in table else 0.0
    rest = np.array([*body[1:], *body[1:2]] if len(body) > 1 else body)
    shift = complex(table["free_x"][row], table["free_y"][row])
    move = shift + 1j * turn * (rest - at)
    scale = LARGEST_MOVE * scene.span / max(float(np.abs(move).max()), 1e-300)
    if turn:
        # Turned about its instantaneous centre, so that it keeps its shape.
        centre = at + 1j * shift / turn
        ways = [centre + (rest - centre) * np.exp(1j * way * scale * turn) for way in (1, -1)]
    else:
        ways = [rest + way * scale * move for way in (1, -1)]
    look = {"color": style.VERMILION, "linewidth": 2, "zorder": 6, "marker": "o" if len(rest) == 1 else ""}
    marks = [Trace(line.real, line.imag, label="free to move", look=look | {"linestyle": dashes})
             for line, dashes in zip(ways, ("-", "--"), strict=True)]  # fmt: skip
    return posed_picture(view, drawn, [scene.places, *ways], "Free motion", [*marks, Posed(scene)])


def posed_picture(
    view: StiffnessView, drawn: DrawnPose, places: Sequence[Complexes], heading: str, marks: Sequence[PanelMark]
) -> Picture:  # fmt: skip
    """The mechanism in a pose, in a window that holds these places, too."""
    title = f"{heading} at {pose_in_words(view.study, view.poses, drawn.row)}"
    return Picture(title, [drawn_plane(marks, np.concatenate(places), view.study)])
