"""Free bodies: every force on the mechanism, and on each of its links alone, in the pose of the largest joint force."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from mechdesign.drawing import shapes, style
from mechdesign.drawing.arrows import RATES, Arrows
from mechdesign.drawing.callouts import arc, arrow
from mechdesign.drawing.drawing import draw, write
from mechdesign.drawing.framing import extent, fitting_windows
from mechdesign.drawing.joints import NOTHING
from mechdesign.drawing.labels import Label
from mechdesign.drawing.marks import LateMark, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.panels import quantity, round_down
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Still, pose
from mechdesign.drawing.shapes import Dashes, Line, Shape, Strut
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.rounding import STILL
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.joint_contacts import PIN
from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.questions.dynamics.free_bodies import Action, actions_on, body_in_words, mass_centers
from mechdesign.questions.poses import pose_in_words

MAX_LINKS = 11
LEAST = 5e-3  # part of the largest force, and of the largest moment, below which nothing is drawn
_LONGEST = 45.0  # arrow, points
_OF_MASS = ("weight", "inertia")
_ARC = 19.0  # radius of a moment's arrow, points
_NOWHERE = np.empty(0, dtype=complex)


class _Look(NamedTuple):
    """How a kind of action is drawn, and what it is called in the legend."""

    words: str
    color: str
    dashes: Dashes = "-"


LOOKS = {
    "joint": _Look("by a joint", style.BLUE),
    "weight": _Look("weight", style.GREEN, (0, (4, 1))),
    "inertia": _Look("inertia", style.ORANGE, (0, (1.6, 0.8))),
    "load": _Look("load", style.VERMILION),
    "spring": _Look("spring", shapes.SPRING_COLOR, (0, (4, 1, 1, 1))),
    "effort": _Look("drive", style.PURPLE),
    "coupling": _Look("coupling", style.INK),
    "foundation": _Look("foundation", style.FAINT),
}


@picture(DynamicsView, "free_bodies", order=10)
def free_bodies_picture(view: DynamicsView) -> Picture | None:
    """The mechanism with what acts on it from outside, and each link with all that acts on it; None without forces."""
    drawn, mechanism = view.drawn, view.study.mechanism
    index, everywhere = _worst(view)
    scene = None if index is None else pose(mechanism, drawn.shown.configuration, index)
    if index is None or scene is None:
        return None
    acting = [own.at(0) for own in actions_on(drawn.motion, drawn.shown.take(np.array([index])))]
    largest = max(action.size for action in acting)
    rounding = NOTHING * largest, NOTHING * largest * mechanism.size
    bodies = {name: _telling([action for action in acting if action.link == name], rounding)
              for name in dict.fromkeys([*mechanism.description.links, *(action.link for action in acting)])
              if _alone_drawn(name, acting)}  # fmt: skip
    bodies = {name: mine for name, mine in bodies.items() if mine}
    # A page of paper holds the mechanism and so many links below it.
    bearing = sorted(bodies, key=lambda name: -max(action.size for action in bodies[name]))
    held = bearing[: fitting_windows(MAX_LINKS + 1) - 1]
    shown = {name: mine for name, mine in bodies.items() if name in held}
    unit, row = view.study.units.label("force"), int(drawn.shown.rows[index])
    where = pose_in_words(view.study, view.poses, row, 4)
    words = f"Forces on the links [{printed(unit)}] at {where}" + ", where a joint bears most" * (not everywhere)
    words += f"; of {len(bodies)} links those {len(shown)} with the largest forces" * (len(shown) < len(bodies))
    whole, centers = shapes.mechanism_shapes(scene), mass_centers(view.study, drawn.shown.configuration, index)
    outside = _telling([action for action in acting if action.link != GROUND and _outside(action, acting)], rounding)
    reached = np.concatenate([[*scene.points.values()], *(outline.places for outline in scene.outlines)])
    parts = [("Mechanism", whole, reached, outside, [*centers.values()])]
    for name, mine in shown.items():
        body, points = _alone(scene, name, whole), _points(scene, name)
        outlines = [place for shape in body if isinstance(shape, Line) for place in shape.places]
        own = [*(scene.points[point] for point in points), *outlines, *(a.place for a in mine)]
        marked = [place for body, place in centers.items() if body.partition(":")[0] == name]
        parts.append((_title(view, name, row, mine), body, np.array(own), mine, marked))
    key = Arrows(_NOWHERE, _NOWHERE, 72 * largest / _LONGEST, unit, True, label="force", look=RATES[0])
    kinds: list[PanelMark] = [
        Trace([], [], label=look.words, look={"color": look.color, "linestyle": look.dashes, "linewidth": 1.8})
        for kind, look in LOOKS.items() if any(action.kind == kind for _, _, _, mine, _ in parts for action in mine)
    ]  # fmt: skip
    panels = []
    for name, body, places, mine, marked in parts:
        most = max((action.size for action in mine), default=0.0) / largest
        longer = max(round_down(1 / most), 1.0) if most else 1.0
        free = FreeBody(view.study.units.label("moment"), longer * _LONGEST / largest, body, mine, marked)
        shows = np.array([*places, *marked])
        middle, *sides = extent(shows)
        if max(sides) < 1e-3 * mechanism.size:
            shows = middle + 1e-3 * mechanism.size * np.array([-1, 1, 1j, -1j])
        title = f"{name}, arrows \N{MULTIPLICATION SIGN}{longer:g}" if longer > 1 else name
        panels.append(Panel([free, *kinds, key], title=title, equal=1.0, shows=shows, bare=True))
    return Picture(words, panels, across=1 if style.narrow() else 3)


def _worst(view: DynamicsView) -> tuple[int | None, bool]:
    """The first of the shown poses with the largest joint force, None where no joint bears any; whether all have it."""
    rows = view.drawn.shown.rows
    forces = [np.nan_to_num(view.column(name)[rows]) for name in view.question.forces]
    if not forces or not np.any(forces):
        return None, False
    largest = np.max(forces, axis=0)
    most = largest >= (1 - STILL) * largest.max()
    return int(most.argmax()), bool(most.all() and len(rows) > 1)


def _alone_drawn(name: str, acting: Sequence[Action]) -> bool:
    """Whether a body has a panel: a moving link, and a pin or the ground on which more than links and springs act."""
    own = {action.kind for action in acting if action.link == name}
    return bool(own) and (name != GROUND or "load" in own) and (not name.startswith(PIN) or own != {"joint"})


def _telling(actions: Sequence[Action], rounding: tuple[float, float]) -> list[Action]:
    """Actions on a body beside whose largest force or moment, and beside rounding, they are something."""
    force = max(LEAST * max((action.size for action in actions), default=0.0), rounding[0])
    moment = max(LEAST * max((abs(action.moment) for action in actions), default=0.0), rounding[1])
    kept = [replace(own, force=own.force * (own.size > force), moment=own.moment * (abs(own.moment) > moment))
            for own in actions]  # fmt: skip
    return [action for action in kept if action.force or action.moment]


def _outside(action: Action, acting: Sequence[Action]) -> bool:
    """Whether it comes from outside of the moving links: not from what acts between them alone."""
    if action.kind not in ("joint", "spring", "effort", "coupling"):
        return True
    same = [other for other in acting if (other.link, other.kind, other.name) == (GROUND, action.kind, action.name)]
    return any(own.size > LEAST * action.size or abs(own.moment) > LEAST * abs(action.moment) for own in same)


def _alone(scene: Still, name: str, whole: Sequence[Shape]) -> list[Shape]:
    """The shapes of one link, with its pins and without springs."""
    points, links = _points(scene, name), scene.description.links
    ends = links[name].ends if name in links else None
    alone: list[Shape] = []
    for shape in whole:
        if isinstance(shape, Strut):
            own = shape.points == ends and shape.color != shapes.SPRING_COLOR
        elif isinstance(shape, Line):
            own = shape.link == name
        else:
            of_body = shape.point in points if shape.point else shape.link == name
            own = of_body and shape.edge != shapes.SPRING_COLOR
        if own:
            alone.append(shape)
    return alone


def _points(scene: Still, name: str) -> tuple[str, ...]:
    """Points of a link, or the one of a pin."""
    return (name.removeprefix(PIN),) if name.startswith(PIN) else scene.link_points(name)


def _title(view: DynamicsView, name: str, row: int, acting: Sequence[Action]) -> str:
    """A body by its name, the effort within a telescopic leg, and whose moments equilibrium leaves open."""
    words = body_in_words(name)
    for drive, own in view.study.mechanism.description.drives.items():
        if own.kind == "length" and own.target == name:
            effort = float(view.column(f"{drive}_effort")[row])
            words += f", {'pushes' if effort > 0 else 'pulls'} {quantity(abs(effort), '')}".rstrip()
    open_moments = ", ".join(action.name for action in acting if action.undetermined)
    return words + f"; open: moments of {open_moments}" * bool(open_moments)


@dataclass(frozen=True, eq=False)
class FreeBody(LateMark):
    """A body and what acts on it, forces to a scale of points."""

    unit: str  # of moments
    scale: float
    body: Sequence[Shape]
    acting: Sequence[Action]
    centers: Sequence[complex]

    @property
    def arrows(self) -> bool:
        return True

    def draw(self, axes: Axes) -> None:
        """The link, its arrows, and their sizes beside them."""
        draw(axes, [*self.body, *shapes.center_shapes(self.centers)])
        middle = complex(sum(axes.get_xlim()) / 2, sum(axes.get_ylim()) / 2)
        length = np.ptp(axes.get_xlim()) / (72 * axes.bbox.width / style.dots())  # of a point
        labels = []
        for action in sorted(self.acting, key=lambda action: -action.size):
            look, way = LOOKS[action.kind], self.scale * action.force
            if way:
                # A push ends at its place, a pull begins there.
                push = action.kind not in _OF_MASS and ((middle - action.place).conjugate() * way).real > 0
                tail, tip = (-way, 0j) if push else (0j, way)
                draw(axes, arrow(action.place, tail, tip, look.color, look.dashes))
                end = action.place + length * (tail if push else tip)
                labels.append(Label(self.words(action), (end, (2 * end + action.place) / 3), look.color, 3.0,
                                    cmath.phase(end - action.place), 8.5))  # fmt: skip
            if action.moment:
                sweep = np.copysign(1.4 * np.pi, action.moment)
                draw(axes, arc(action.place, -0.2 * np.pi, sweep, _ARC, look.color))
                words = quantity(abs(action.moment), self.unit)
                labels.append(Label(words, (action.place,), look.color, _ARC + 3, None, 8.5))
        write(axes, labels)

    @staticmethod
    def words(action: Action) -> str:
        """What exerts a force, and its size; weight and inertia are told by their look."""
        return f"{'' if action.kind in _OF_MASS else action.name} {quantity(action.size, '')}".strip()
