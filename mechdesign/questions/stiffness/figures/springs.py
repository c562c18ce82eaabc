"""How the body is held in a pose: its legs as equivalent springs [S4, Fig. 6], and a motion that nothing holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mechdesign.numerics.arrays import Complexes
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.stiffness.analysis import DrawnPose
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.report.figures import style
from mechdesign.report.figures.callouts import point_labels
from mechdesign.report.figures.drawing import Posed, write
from mechdesign.report.figures.labels import Label
from mechdesign.report.figures.marks import Late, PanelMark, Picture, Trace
from mechdesign.report.figures.panels import drawn_plane, quantity
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Still, hull, pose
from mechdesign.study import Study

_COIL_LENGTH = 0.17  # over the size of the mechanism
_COIL_SWING = 0.12  # half the width of a coil over its length
_COIL_TURNS = 7
_SHARES = (0.5, 0.3, 0.75)  # of a spring's length, where the labels of some stand
_ALONG = np.array([0.0, 0.06, -0.06, 0.12, -0.12])  # and beside these
_ORDER = 5.0  # above the mechanism
LARGEST_MOVE = 0.12  # largest drawn displacement over the size of the mechanism


@picture(StiffnessView, "springs", order=10)
def springs_picture(view: StiffnessView) -> Picture | None:
    """The equivalent springs at the first pose, as coils."""
    study, drawn = view.study, view.drawn.first
    if drawn is None:
        return None
    scene = pose(study.mechanism, drawn.configuration)
    coils = _coils(study, drawn, scene) if scene is not None else []
    if scene is None or not coils:
        return None
    posed = Posed(scene, names=False, drives=False)
    labels = [coil.label for coil in coils] + point_labels(scene)
    marks = [posed, Late(partial(draw_coils, coils)), Late(partial(write, labels=labels))]
    ends = np.array([end for coil in coils for end in (coil.place, coil.anchor)])
    return posed_picture(view, drawn, [scene.places, ends], "Equivalent springs", marks)


def _coils(study: Study, drawn: DrawnPose, scene: Still) -> list[Coil]:
    legs, length = drawn.body.legs or (), _COIL_LENGTH * scene.span
    coils, own = [], drawn.springs
    columns = (own.leg, own.place, own.angle, own.stiffness)
    for k, place, angle, stiffness in zip(*(column.tolist() for column in columns), strict=True):
        if np.isnan(angle):
            continue
        leg, along = legs[k], complex(np.exp(1j * angle))
        base, tip = scene.points[leg.base], scene.points[leg.tip]
        inward = ((base - place) * along.conjugate()).real
        grounded = abs(inward) > length and abs(base - place - inward * along) < 1e-6 * scene.span
        if grounded:
            anchor = base
        else:
            # Its line passes the leg's base: away from the body.
            body = scene.points[drawn.body.section.point]
            anchor = place + 1.4 * length * (along if ((place - body) * along.conjugate()).real > 0 else -along)
        text = quantity(stiffness, study.units.label("stiffness"))
        coils.append(Coil(text, place, anchor, tip, length, grounded))
    inside = sum((coil.place + coil.anchor) / 2 for coil in coils) / max(len(coils), 1)
    # On a narrow page labels of neighbours would stand above each other between both.
    shares = cycle(_SHARES if style.narrow() else (0.5,))
    return [replace(coil, inside=inside, share=share) for coil, share in zip(coils, shares, strict=False)]


@dataclass(frozen=True)
class Coil:
    """A spring from the point where it holds to its anchor; `tip` is the end of its leg, `length` of its coiled middle.

    The anchor of a grounded one is a joint of the ground, which the mechanism's drawing shows already.
    """

    text: str
    place: complex
    anchor: complex
    tip: complex
    length: float
    grounded: bool
    inside: complex = 0j  # a place among all springs
    share: float = 0.5  # of the way from place to anchor, where its label stands best

    @property
    def path(self) -> Complexes:
        """The drawn line."""
        span = self.anchor - self.place
        share = np.linspace(0, 1, 600)
        part = min(0.7, self.length / abs(span))
        inside = np.clip((share - 0.5) / part + 0.5, 0, 1)
        wave = _COIL_SWING * self.length * np.sin(2 * np.pi * _COIL_TURNS * inside)
        return self.place + span * (share + 1j * wave / abs(span))

    @property
    def label(self) -> Label:
        """Its stiffness, beside its middle, away from the other springs."""
        span = self.anchor - self.place
        aside = 1j * span
        if ((self.place + 0.5 * span - self.inside) * aside.conjugate()).real < 0:
            aside = -aside
        anchors = tuple(self.place + share * span for share in self.share + _ALONG)
        return Label(self.text, anchors, style.VERMILION, 16, float(np.angle(aside)), 9.5)


def draw_coils(coils: Sequence[Coil], axes: Axes) -> None:
    """Coil springs along their lines, each with a hatched anchor, and a dashed line to where the leg ends."""
    for coil in coils:
        if abs(coil.place - coil.tip) > 1e-3 * abs(coil.anchor - coil.place):
            _line(axes, np.array([coil.tip, coil.place]), 1.1, 0.0, linestyle=(0, (4, 3)))
        _line(axes, coil.path, 3.6, 0.05, color="white")
        _line(axes, coil.path, 1.5, 0.1)
        axes.plot(
            [coil.place.real], [coil.place.imag], "o", markersize=5, color=style.VERMILION, markeredgecolor="white",
            zorder=_ORDER + 0.3,
        )  # fmt: skip
        if coil.grounded:
            continue
        along = coil.length * (coil.anchor - coil.place) / abs(coil.anchor - coil.place)
        bar = 0.2j * along
        _line(axes, np.array([coil.anchor - bar, coil.anchor + bar]), 1.6, 0.1)
        for foot in coil.anchor + np.linspace(-1, 1, 6) * bar:
            _line(axes, np.array([foot, foot + (0.1 + 0.07j) * along]), 1.0, 0.1)


def _line(axes: Axes, places: Complexes, width: float, lift: float, **look: object) -> None:
    options: dict[str, Any] = {"color": style.VERMILION, "solid_capstyle": "round", "solid_joinstyle": "round"} | look
    axes.add_line(Line2D(places.real, places.imag, lw=width, zorder=_ORDER + lift, **options))


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
