"""What stands around the links of a drawing: arrows of the drives, and names."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mechdesign.report.figures import shapes, style
from mechdesign.report.figures.labels import Label
from mechdesign.report.figures.scene import GROUND, Scene, hull

_LEAST_SWEEP = 0.2  # radians; a smaller angle gets an arrow of the positive sense instead
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
            if abs(sweep) < _LEAST_SWEEP:
                sweep = 4 * _LEAST_SWEEP
            arrows.append(Turn(name, place, start, sweep, shapes.ARC + _NESTING * rank))
        elif drive.kind == "length":
            ends = scene.description.links[drive.target].ends
            assert ends is not None
            base, leg = scene.points[ends[0]], scene.points[ends[1]] - scene.points[ends[0]]
            arrows.append(Push(name, base + 0.36 * leg, leg / abs(leg), shapes.BAR / 2 + 6))
        else:
            guide = next(guide for guide in scene.guides if guide.joint == drive.target)
            arrows.append(Push(name, guide.pin, guide.along, shapes.BLOCK[1] / 2 + 6))
    return tuple(arrows)


def name_labels(scene: Scene, colors: Mapping[str, str], arrows: Sequence[Arrow], drive_color: str) -> list[Label]:
    """Names of points, drives, slides and links, the most needed first."""
    return [
        *_point_labels(scene),
        *_drive_labels(arrows, drive_color),
        *_slide_labels(scene),
        *_link_labels(scene, colors),
    ]


def _point_labels(scene: Scene) -> list[Label]:
    slid = {guide.point for guide in scene.guides if guide.slider is not None}
    labels = []
    for name, kind in scene.kinds().items():
        if kind != "none" or name in slid:
            reach = shapes.BLOCK[1] / 2 if name in slid else shapes.PIN
            labels.append(Label(name, (scene.points[name],), style.INK, reach + 4, size=10.5))
    return labels


def _drive_labels(arrows: Sequence[Arrow], color: str) -> list[Label]:
    labels = []
    for arrow in arrows:
        if isinstance(arrow, Turn):
            reach, heading = arrow.radius + 4, arrow.start + arrow.sweep / 2
        else:
            reach, heading = arrow.away + 5, cmath.phase(1j * arrow.along)
        labels.append(Label(arrow.name, (arrow.place,), color, reach, heading))
    return labels


def _slide_labels(scene: Scene) -> list[Label]:
    return [
        Label(guide.joint, (guide.pin,), style.FAINT, shapes.BLOCK[1] / 2 + 8, -math.pi / 3, 9, True, True)
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
            anchors, reach, heading = (places[0],), shapes.BLOCK[1] / 2 + 4, -math.pi / 2
        elif len(corners := hull(places)) > 2:
            # The middle of a plate is its own best place.
            anchors, reach, heading = (sum(corners) / len(corners),), 0.0, 0.0
        else:
            run = places[1] - places[0]
            anchors = tuple(places[0] + share * run for share in (0.5, 0.4, 0.6, 0.3, 0.7))
            reach, heading = shapes.BAR / 2 + 3, cmath.phase(1j * run if (1j * run).imag >= 0 else -1j * run)
        labels.append(Label(name, anchors, shapes.darker(colors[name]), reach, heading, 9, True, True))
    return labels
