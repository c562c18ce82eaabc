"""Velocity and acceleration polygons of a pose: the rates of all points from one pole, and of each link's points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.arrows import RATES, Arrows
from mechdesign.drawing.drawing import write
from mechdesign.drawing.framing import extent
from mechdesign.drawing.labels import Label
from mechdesign.drawing.marks import Axis, Dots, Late, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import hull
from mechdesign.drawing.shapes import link_colors
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.kinematics.figures.poses import KINDS, place_of, rates_of
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.questions.kinematics.special_poses import SpecialPose

MOST_POSES = 3
POLE = "p"
_SAME = 1e-6  # of the largest rate: tips as near as this are one
_NAME = 9.0  # points


@picture(MotionView, "polygons", order=70)
def polygons_picture(view: MotionView) -> Picture | None:
    """A row for each of a few poses, or of the listed ones, with both polygons; where the study asks for it."""
    regular = [special for special in view.drawn.special.shown if np.isfinite(list(special.velocities.values())).all()]
    if not view.asks_for("polygons") or not regular:
        return None
    # Where links are in line their velocities are, too: other poses tell more.
    shown = ([special for special in regular if not special.event] or regular)[: 1 if style.narrow() else MOST_POSES]
    note = f"from the pole {POLE} to the tip of each point's vector; thin dashes: acceleration of a link's second point"
    note += " towards its first, and across the line between them"
    panels = [_panel(view, special, order) for special in shown for order in range(len(KINDS))]
    return Picture("Velocity and acceleration polygons", panels, (note,), across=2)


def images(view: MotionView, special: SpecialPose, order: int) -> Mapping[str, dict[str, complex]]:
    """The rates of every link's points at a pose by link and point, where it has two or more; the ground's are zero."""
    links, rates = view.study.mechanism.description.links, rates_of(special, order)
    still = dict.fromkeys(links[GROUND].all_points, 0j)
    own = {name: {point: complex((rates | still)[point]) for point in link.all_points}
           for name, link in links.items() if name != GROUND}  # fmt: skip
    return {name: points for name, points in own.items() if len(points) > 1}


def _panel(view: MotionView, special: SpecialPose, order: int) -> Panel:
    """The polygon of one order of rates: arrows from the pole, and the image of each link."""
    colors, tips = link_colors(view.study.mechanism.description), dict[str, complex]()
    for points in (links := images(view, special, order)).values():
        tips |= points
    parts = _parts(view, special, links) if order else {}
    places = np.array([0j, *tips.values(), *(path[1] for path in parts.values())])
    largest = float(np.abs(places).max())
    named: dict[complex, list[str]] = {0j: [POLE]}
    for point, tip in tips.items():
        same = next((other for other in named if abs(tip - other) <= _SAME * largest), tip)
        named.setdefault(same, []).append(point)
    marks: list[PanelMark] = []
    for link, points in links.items():
        outline = hull(list(points.values()))
        outline = [*outline, outline[0]] if len(outline) > 2 else outline
        look = {"color": colors[link], "linewidth": 1.8, "zorder": 4.9}
        marks.append(Trace(np.real(outline), np.imag(outline), label=link, look=look))
    for link, path in parts.items():
        thin = {"color": colors[link], "linewidth": 1.0, "linestyle": (0, (4, 2)), "zorder": 4.7}
        marks.append(Trace(path.real, path.imag, look=thin))
    pole = {"marker": "+", "color": style.INK, "markersize": 11, "markeredgewidth": 1.6, "zorder": 5}
    shows = places if largest else np.array([-1, 1j])
    middle, long = extent(shows)[0], np.array([tip for tip in named if tip], dtype=complex)
    labels = [Label(", ".join(names), (tip,), style.INK, 6.0, float(np.angle(tip - middle)), _NAME)
              for tip, names in named.items()]  # fmt: skip
    marks += [Dots([0], [0], look=pole), Arrows(0 * long, long, look=RATES[order]), Late(partial(write, labels=labels))]
    kind, unit = KINDS[order], view.study.units.label(KINDS[order])
    title = f"{kind.capitalize()} at {special.where}"
    return Panel(marks, Axis(f"{kind} x", unit), Axis(f"{kind} y", unit), title, equal=1.0, shows=shows)


def _parts(view: MotionView, special: SpecialPose, links: Mapping[str, dict[str, complex]]) -> dict[str, Complexes]:
    """By link, the acceleration of its second point from that of its first, over -omega^2 r; of links of one length."""
    described, parts = view.study.mechanism.description.links, {}
    for link, points in links.items():
        one, other, *_ = points
        if not described[link].telescopic:
            corner = points[one] + centripetal(special, one, other)
            parts[link] = np.array([points[one], corner, points[other]])
    return parts


def centripetal(special: SpecialPose, one: str, other: str) -> complex:
    """Acceleration of one point of a link towards another that it turns about: -omega^2 times its arm."""
    arm = place_of(special, other) - place_of(special, one)
    slip = complex(special.velocities.get(other, 0j)) - complex(special.velocities.get(one, 0j))
    return -(abs(slip) ** 2) * arm / abs(arm) ** 2
