"""What is written and drawn about a mechanism: arrows of its drives, forces and moments, and names."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.labels import Label
from mechdesign.drawing.scene import Still, hull, spring_points
from mechdesign.drawing.shapes import (
    BAR,
    COIL,
    PIN,
    SLIDER_SIZE,
    SPRING_COLOR,
    Dashes,
    Shape,
    Symbol,
    darker,
    link_colors,
)
from mechdesign.mechanism.graph import GROUND

# In points on paper.
ARC = 25.0  # radius of an angle drive's arrow
FORCE = 34.0  # length of a force's arrow
_NESTING = 9.0  # between the arrows of drives at one pivot
_PUSH = 30.0  # length of a straight arrow
_MIN_SWEEP = 0.2  # radians; a smaller angle gets an arrow of the positive sense instead
DRIVE_COLOR = style.VERMILION


def drive_shapes(scene: Still) -> tuple[list[Shape], list[Label]]:
    """An arrow for each drive, and their names.

    That of an angle runs from the line it is measured from, that of a length or slide in its positive sense.
    """
    shapes: list[Shape] = []
    labels: list[Label] = []
    turned: list[complex] = []
    for name, drive in scene.description.drives.items():
        if drive.kind == "angle":
            place = scene.points[scene.pivot(drive.target, drive.reference)]
            radius = ARC + _NESTING * turned.count(place)
            turned.append(place)
            start = cmath.phase(scene.rotations[drive.reference])
            sweep = cmath.phase(scene.rotations[drive.target] / scene.rotations[drive.reference])
            if abs(sweep) < _MIN_SWEEP:
                sweep = 4 * _MIN_SWEEP
            shapes += arc(place, start, sweep, radius, DRIVE_COLOR)
            base = (0j, (radius + 9) * cmath.exp(1j * start))
            shapes.append(Symbol(place, 0.3, (base,), edge=DRIVE_COLOR, width=0.9, dashes=(0, (3, 2))))
            labels.append(Label(name, (place,), DRIVE_COLOR, radius + 4, start + sweep / 2))
            continue
        if drive.kind == "length":
            ends = scene.description.links[drive.target].ends
            assert ends is not None
            foot, leg = scene.points[ends[0]], scene.points[ends[1]] - scene.points[ends[0]]
            place, along, away = foot + 0.36 * leg, leg / abs(leg), BAR / 2 + 6
        else:
            guide = next(guide for guide in scene.guides if guide.joint == drive.target)
            place, along, away = guide.pin, guide.along, SLIDER_SIZE[1] / 2 + 6
        stem = (complex(-_PUSH / 2, away), complex(_PUSH / 2 - 4, away))
        shapes += _arrow(place, stem, complex(_PUSH / 2, away), 1.0, 7.0, DRIVE_COLOR, along)
        labels.append(Label(name, (place,), DRIVE_COLOR, away + 5, cmath.phase(1j * along)))
    return shapes, labels


def arc(place: complex, start: float, sweep: float, radius: float, color: str) -> list[Shape]:
    """A curved arrow about a place, from the angle `start` over `sweep` (radians); the radius in points."""
    angles = start + np.linspace(0.0, sweep, 48)
    # The head is as long on the arc as it looks; a small angle has a small head.
    head = min(7.0, 0.7 * abs(sweep) * radius)
    stem = radius * np.exp(1j * angles[np.abs(angles - start) <= abs(sweep) - 0.6 * head / radius])
    sign = math.copysign(1.0, sweep)
    tip = radius * np.exp(1j * angles[-1])
    tangent = 1j * sign * np.exp(1j * (angles[-1] - sign * head / (2 * radius)))
    return _arrow(place, stem.tolist(), complex(tip), complex(tangent), head, color)


def force(place: complex, direction: complex, color: str) -> list[Shape]:
    """A force: an arrow that ends at the place where it acts."""
    return _arrow(place, (complex(-FORCE - PIN), complex(-PIN - 6)), complex(-PIN), 1.0, 9.0, color, direction)


def arrow(place: complex, tail: complex, tip: complex, color: str, dashes: Dashes = "-") -> list[Shape]:
    """A straight arrow from and to points on paper beside a place."""
    way = tip - tail
    if not way:
        return []
    along, head = way / abs(way), min(8.0, 0.7 * abs(way))
    stem = (tail, tip - 0.6 * head * along)
    line, *rest = _arrow(place, stem, tip, along, head, color)
    assert isinstance(line, Symbol)
    return [replace(line, dashes=dashes), *rest]


def _arrow(
    place: complex, stem: Sequence[complex], tip: complex, along: complex, head: float, color: str,
    direction: complex = 1.0,
) -> list[Shape]:  # fmt: skip
    back = tip - head * along
    wings = (tip, back + 0.45j * head * along, back - 0.45j * head * along)
    shapes: list[Shape] = [Symbol(place, 0.6, (wings,), fill=color, edge=None, direction=direction)]
    if len(stem) > 1:
        shapes.insert(0, Symbol(place, 0.6, (stem,), edge=color, width=1.7, direction=direction))
    return shapes


def point_labels(scene: Still) -> list[Label]:
    """Names of points; what slides in a line has none but its own."""
    slid = {guide.point for guide in scene.guides if guide.slider is not None}
    labels = []
    for name, kind in scene.kinds().items():
        if kind != "none" or name in slid:
            away = SLIDER_SIZE[1] / 2 if name in slid else PIN
            labels.append(Label(name, (scene.points[name],), style.INK, away + 4, size=10.5))
    return labels


def slide_labels(scene: Still) -> list[Label]:
    """Names of the slides that are no drive."""
    return [
        Label(guide.joint, (guide.pin,), style.FAINT, SLIDER_SIZE[1] / 2 + 8, -math.pi / 3, 9, optional=True)
        for guide in scene.guides
        if guide.joint not in scene.description.drives
    ]


def spring_labels(scene: Still) -> list[Label]:
    """Names of the springs between points."""
    labels = []
    for name, spring in scene.description.springs.items():
        if not spring.turning:
            begin, end = (scene.points[point] for point in spring_points(spring))
            anchors = tuple(begin + share * (end - begin) for share in (0.5, 0.35, 0.65))
            labels.append(
                Label(name, anchors, SPRING_COLOR, 2 * COIL + 2, cmath.phase(1j * (end - begin)), 9, optional=True)
            )
    return labels


def link_labels(scene: Still, *, driven: bool = False) -> list[Label]:
    """Names of the moving links, with those that are `driven` or without."""
    colors, labels = link_colors(scene.description), []
    for name in scene.description.links:
        places = [scene.points[point] for point in scene.link_points(name)]
        if name == GROUND or (name in scene.description.drives and not driven) or not places:
            continue
        anchors: tuple[complex, ...]
        if len(places) == 1:
            anchors, away, heading = (places[0],), SLIDER_SIZE[1] / 2 + 4, -math.pi / 2
        elif len(corners := hull(places)) > 2:
            # The middle of a plate is its own best place.
            anchors, away, heading = (sum(corners) / len(corners),), 0.0, 0.0
        else:
            run = places[1] - places[0]
            anchors = tuple(places[0] + share * run for share in (0.5, 0.4, 0.6, 0.3, 0.7))
            away, heading = BAR / 2 + 3, cmath.phase(1j * run if (1j * run).imag >= 0 else -1j * run)
        labels.append(Label(name, anchors, darker(colors[name]), away, heading, 9, optional=True))
    return labels
