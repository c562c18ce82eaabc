"""What stands around the links of a drawing: arrows of the drives, names, and what names must not cover."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import shapes, style
from mechdesign.report.figures.labels import Label, paper
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


def obstacles(axes: Axes, scene: Scene, arrows: Sequence[Arrow], travel: Mapping[str, tuple[float, float]]) -> Floats:
    """Points on paper, shape (n, 2), that names should not cover: links, symbols, rails, arrows."""
    found = [_column(np.array([]))]

    def at(place: complex) -> Floats:
        return paper(axes, np.array([place]))

    for name, link in scene.description.links.items():
        places = [scene.points[point] for point in scene.link_points(name)]
        if name == GROUND or len(places) < 2:
            continue
        corners = places[:2] if link.telescopic else hull(places)
        width = shapes.BAR + 3 if link.telescopic else shapes.BAR
        closing = corners[:1] if len(corners) > 2 else []
        for start, end in zip(corners, corners[1:] + closing, strict=False):
            found.append(_strip(paper(axes, np.array([start, end])), width))
    ring = np.exp(1j * np.linspace(0, math.tau, 9))
    for place in scene.points.values():
        found.append(at(place) + (shapes.PIN + 1) * _column(ring))
    for point in scene.pivots():
        x, y = np.meshgrid(np.linspace(-12, 12, 7), np.linspace(-shapes.GROUND - 1, -2, 4))
        found.append(at(scene.points[point]) + _column(x + 1j * y))
    for guide in scene.guides:
        if guide.slider is not None:
            x, y = np.meshgrid(np.linspace(-0.5, 0.5, 7), np.linspace(-0.5, 0.5, 5))
            found.append(at(guide.pin) + _column((x * shapes.BLOCK[0] + 1j * y * shapes.BLOCK[1]) * guide.along))
        if guide.owner == GROUND:
            down = shapes.rail_side(guide.along) * (shapes.BLOCK[1] / 2 + 3)
            rail = paper(axes, np.array(guide.ends(travel, scene.span)))
            found.append(_strip(rail + np.array([down.real, down.imag]), 5))
    for arrow in arrows:
        if isinstance(arrow, Turn):
            arc = arrow.radius * np.exp(1j * (arrow.start + np.linspace(0, 1, 16) * arrow.sweep))
            found.append(at(arrow.place) + _column(arc))
        else:
            stem = arrow.along * (np.linspace(-0.5, 0.5, 9) * arrow.length + 1j * arrow.away)
            found.append(at(arrow.place) + _column(stem))
    return np.concatenate(found)


def _column(places: NDArray[Any]) -> Floats:
    flat = np.ravel(places)
    return np.column_stack([flat.real, flat.imag])


def _strip(ends: Floats, width: float) -> Floats:
    """Points over a straight strip of some width, about 4 points of paper apart."""
    run = ends[1] - ends[0]
    length = float(np.hypot(*run))
    if length == 0:
        return ends
    count = max(2, int(length / 4))
    normal = np.array([-run[1], run[0]]) / length * width / 2
    middle = ends[0] + np.linspace(0, 1, count)[:, None] * run
    return np.concatenate([middle - normal, middle, middle + normal])
