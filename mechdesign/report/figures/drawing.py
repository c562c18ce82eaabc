"""A mechanism drawn into axes: links, joints, slides, ground, arrows of the drives and names; and as a ghost."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.graph import GROUND
from mechdesign.report.figures import shapes, style
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.scene import Guide, Scene, hull, pose
from mechdesign.report.figures.shapes import Pen

DRIVE_COLOR = style.VERMILION
LINK_COLORS = (style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, "#8A6A2A", "#5B4FA2", "#6E6E6E")
Travel = Mapping[str, tuple[float, float]]
_MIN_SWEEP = 0.2  # radians; a smaller angle gets an arrow of the positive sense instead
_NESTING = 9.0  # points between the arrows of drives at one pivot


@dataclass(frozen=True)
class Turn:
    """A curved arrow about a place, from the angle `start` over `sweep` (radians), radius in points."""

    name: str
    place: complex
    start: float
    sweep: float
    radius: float


@dataclass(frozen=True)
class Push:
    """A straight arrow, `length` points long, `away` points beside the line along a unit vector."""

    name: str
    place: complex
    along: complex
    away: float
    length: float = 30.0


Arrow = Turn | Push


def drive_arrows(scene: Scene) -> tuple[Arrow, ...]:
    """Arrow of each drive: an angle from the line it is measured from, a length or slide in its positive sense."""
    arrows: list[Arrow] = []
    for name, drive in scene.description.drives.items():
        if drive.kind == "angle":
            place = scene.points[scene.pivot(drive.target, drive.reference)]
            rank = sum(isinstance(arrow, Turn) and arrow.place == place for arrow in arrows)
            start = cmath.phase(scene.rotations[drive.reference])
            sweep = cmath.phase(scene.rotations[drive.target] / scene.rotations[drive.reference])
            if abs(sweep) < _MIN_SWEEP:
                sweep = 4 * _MIN_SWEEP
            arrows.append(Turn(name, place, start, sweep, shapes.ARC + _NESTING * rank))
        elif drive.kind == "length":
            ends = scene.description.links[drive.target].ends
            assert ends is not None
            base, leg = scene.points[ends[0]], scene.points[ends[1]] - scene.points[ends[0]]
            arrows.append(Push(name, base + 0.36 * leg, leg / abs(leg), shapes.BAR / 2 + 6))
        else:
            guide = next(guide for guide in scene.guides if guide.joint == drive.target)
            arrows.append(Push(name, guide.pin, guide.along, shapes.SLIDER_SIZE[1] / 2 + 6))
    return tuple(arrows)


def name_labels(scene: Scene, colors: Mapping[str, str], arrows: Sequence[Arrow]) -> list[Label]:
    """Names of points, drives, slides and links, the most needed first."""
    return [
        *_point_labels(scene),
        *_drive_labels(arrows),
        *_slide_labels(scene),
        *_link_labels(scene, colors),
    ]


def _point_labels(scene: Scene) -> list[Label]:
    slid = {guide.point for guide in scene.guides if guide.slider is not None}
    labels = []
    for name, kind in scene.kinds().items():
        if kind != "none" or name in slid:
            reach = shapes.SLIDER_SIZE[1] / 2 if name in slid else shapes.PIN
            labels.append(Label(name, (scene.points[name],), style.INK, reach + 4, size=10.5))
    return labels


def _drive_labels(arrows: Sequence[Arrow]) -> list[Label]:
    labels = []
    for arrow in arrows:
        if isinstance(arrow, Turn):
            reach, heading = arrow.radius + 4, arrow.start + arrow.sweep / 2
        else:
            reach, heading = arrow.away + 5, cmath.phase(1j * arrow.along)
        labels.append(Label(arrow.name, (arrow.place,), DRIVE_COLOR, reach, heading))
    return labels


def _slide_labels(scene: Scene) -> list[Label]:
    return [
        Label(guide.joint, (guide.pin,), style.FAINT, shapes.SLIDER_SIZE[1] / 2 + 8, -math.pi / 3, 9, True, True)
        for guide in scene.guides
        if guide.joint not in scene.description.drives
    ]


def _link_labels(scene: Scene, colors: Mapping[str, str]) -> list[Label]:
    labels = []
    for name in scene.description.links:
        places = [scene.points[point] for point in scene.link_points(name)]
        if name == GROUND or name in scene.description.drives or not places:
            continue
        anchors: tuple[complex, ...]
        if len(places) == 1:
            anchors, reach, heading = (places[0],), shapes.SLIDER_SIZE[1] / 2 + 4, -math.pi / 2
        elif len(corners := hull(places)) > 2:
            # The middle of a plate is its own best place.
            anchors, reach, heading = (sum(corners) / len(corners),), 0.0, 0.0
        else:
            run = places[1] - places[0]
            anchors = tuple(places[0] + share * run for share in (0.5, 0.4, 0.6, 0.3, 0.7))
            reach, heading = shapes.BAR / 2 + 3, cmath.phase(1j * run if (1j * run).imag >= 0 else -1j * run)
        labels.append(Label(name, anchors, shapes.darker(colors[name]), reach, heading, 9, True, True))
    return labels


def link_colors(mechanism: Mechanism) -> dict[str, str]:
    """The colour of each link, the same in every picture."""
    moving = [name for name in mechanism.description.links if name != GROUND]
    return {name: LINK_COLORS[k % len(LINK_COLORS)] for k, name in enumerate(moving)} | {GROUND: style.INK}


def draw_mechanism(
    axes: Axes,
    mechanism: Mechanism,
    configuration: Configuration,
    index: int = 0,
    *,
    faint: bool = False,
    labels: bool = True,
    drives: bool = True,
    travel: Travel | None = None,
    size: float = 1.0,
) -> None:
    """Draw a mechanism in one pose of a batch; a pose that cannot be assembled draws nothing.

    Sizes of symbols are in points on paper, so that limits may change after drawing; only labels need final limits.
    They keep off what is drawn before.

    Parameters
    ----------
    index : int
        Pose in the flattened batch.
    faint : bool
        Pale and below what is drawn otherwise, without labels and drives: for further poses.
    travel : mapping, optional
        Range of each slide (lengths from the line's origin), which its guide should cover.
    size : float
        Of the symbols; 1 for a drawing as wide as the page.
    """
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=0.22, order=2.0) if faint else Pen(axes, size=size)
    for point in scene.pivots():
        pen.pivot(scene.points[point])
    _draw_guides(pen, scene, colors, travel or {})
    for rank, (name, body) in enumerate(_bodies(scene)):
        if len(body) > 2:
            pen.plate(body, colors[name], rank)
        elif len(body) == 2:
            pen.bar(body, colors[name])
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            pen.leg(scene.points[link.ends[0]], scene.points[link.ends[1]], colors[name])
    for point, kind in scene.kinds().items():
        if kind == "pin":
            pen.pin(scene.points[point])
        elif kind == "clamp":
            pen.clamp(scene.points[point])
        elif kind == "tracer":
            owner = next(name for name in scene.description.links if point in scene.link_points(name))
            pen.tracer(scene.points[point], colors[owner])
    if faint:
        return
    arrows = drive_arrows(scene) if drives else ()
    for arrow in arrows:
        if isinstance(arrow, Turn):
            pen.turn(arrow.place, arrow.start, arrow.sweep, arrow.radius, DRIVE_COLOR)
        else:
            pen.push(arrow.place, arrow.along, arrow.length, arrow.away, DRIVE_COLOR)
    if labels:
        named = name_labels(scene, colors, arrows)
        place_labels(axes, named, covered(axes), order=pen.order + 2)


def draw_ghost(axes: Axes, mechanism: Mechanism, configuration: Configuration, index: int, *, share: float) -> None:
    """Draw a further pose as pale lines, which many of can lie over one another; `share` of it is colour."""
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=share, order=2.0)
    for name, body in _bodies(scene):
        if len(body) > 1:
            pen.line([*body, *(body[:1] if len(body) > 2 else [])], colors[name])
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            pen.line([scene.points[end] for end in link.ends], colors[name])
    for guide in scene.guides:
        if guide.owner != GROUND:
            pen.line(_reach(scene, guide, (guide.pin,)), colors[guide.owner])


def _bodies(scene: Scene) -> list[tuple[str, list[complex]]]:
    """Outline of each moving rigid link, the largest first so that none hides another."""
    found = []
    for name, link in scene.description.links.items():
        if name != GROUND:
            points = link.points if link.telescopic else scene.link_points(name)
            found.append((name, hull([scene.points[point] for point in points])))
    return sorted(found, key=lambda item: -_area(item[1]))


def _area(corners: list[complex]) -> float:
    turned = zip(corners, corners[1:] + corners[:1], strict=True)
    return abs(sum((a.conjugate() * b).imag for a, b in turned)) / 2 if len(corners) > 2 else 0.0


def _draw_guides(pen: Pen, scene: Scene, colors: Mapping[str, str], travel: Travel) -> None:
    for guide in scene.guides:
        start, end = guide.ends(travel, scene.span)
        if guide.owner == GROUND:
            pen.rail(start, end)
        else:
            pen.bar(_reach(scene, guide, (start, end)), colors[guide.owner])
            if guide.slider is None:
                pen.slot((start, end))
        if guide.slider is not None:
            pen.block(guide.pin, guide.along, colors[guide.slider])


def _reach(scene: Scene, guide: Guide, places: Iterable[complex]) -> list[complex]:
    """Ends of the line that a link carries: from its own points to where something slides."""
    own = [scene.points[point] for point in scene.link_points(guide.owner)]
    along = [((place - guide.origin) * guide.along.conjugate()).real for place in (*own, *places)]
    return [guide.origin + s * guide.along for s in (min(along), max(along))]
