"""Paths of points as arrays: places, how long the way to them is, and the direction and bend of the path there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.study.schema.paths import ROUND, STRAIGHT, Arc, Circle

# Pieces of a spline between two of its points whose lengths are added up.
PIECES = 64


@dataclass(frozen=True, eq=False)
class Course:
    """The path of a point; all arrays have the shape (poses,).

    Parameters
    ----------
    places : ndarray of complex
        x + i y.
    way : ndarray
        Length of the path up to each place.
    directions : ndarray of complex
        Unit vector along the path, the derivative of the place by its length.
    bends : ndarray of complex
        Second derivative of the place by the path's length: towards the centre of curvature, 1 / radius long.
    closed : bool
        Whether the path goes on from its last place to its first.
    """

    places: Complexes
    way: Floats
    directions: Complexes
    bends: Complexes
    closed: bool = False


def circle(given: Circle, points: int | None, turn: float) -> Course:
    """A circle; `turn` is a full turn in the study's unit."""
    count = points or ROUND
    sign = -1.0 if given.clockwise else 1.0
    angles = 2 * np.pi * (given.from_ / turn + sign * np.arange(count) / count)
    return _round(complex(*given.center), given.radius, angles, sign, closed=True)


def arc(given: Arc, points: int | None, turn: float) -> Course:
    """Part of a circle, both ends included."""
    angles = 2 * np.pi / turn * np.linspace(given.from_, given.to, points or STRAIGHT)
    return _round(complex(*given.center), given.radius, angles, float(np.sign(given.to - given.from_)), closed=False)


def _round(center: complex, radius: float, angles: Floats, sign: float, *, closed: bool) -> Course:
    outward = np.exp(1j * angles).astype(np.complex128)
    way = radius * np.abs(angles - angles[0])
    return Course(center + radius * outward, way, complex(0.0, sign) * outward, outward / -radius, closed)


def line(begin: complex, end: complex, points: int | None) -> Course:
    """A straight line between two different places, both included."""
    part = np.linspace(0.0, 1.0, points or STRAIGHT)
    places: Complexes = np.asarray(begin + part * (end - begin), dtype=np.complex128)
    direction = np.full(len(part), (end - begin) / abs(end - begin))
    return Course(places, part * abs(end - begin), direction, np.zeros(len(part), dtype=complex))


def polyline(places: Complexes) -> Course:
    """Straight segments; a corner has the direction of the segment that begins there, directions nan for one place."""
    steps = np.diff(places)
    lengths = np.abs(steps)
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    directions = np.full(len(places), complex(np.nan, np.nan))
    moving = np.flatnonzero(lengths > 0)
    if len(moving):
        units = steps[moving] / lengths[moving]
        # The segment that begins at each place, or the next one with a length.
        after = np.searchsorted(moving, np.arange(len(places)))
        last = 0 if places[0] == places[-1] else len(moving) - 1
        directions = units[np.where(after < len(moving), after, last)]
    return Course(places, way, directions, np.zeros(len(places), dtype=complex))


def spline(places: Complexes, points: int | None) -> Course:
    """A cubic spline by the length of the chords through three places or more, periodic where the first is the last."""
    from scipy.interpolate import CubicSpline

    chords = np.abs(np.diff(places))
    knots = np.concatenate([[0.0], np.cumsum(chords)])
    table = np.stack([places.real, places.imag], axis=1)
    curve: Any = CubicSpline(knots, table, bc_type="periodic" if places[0] == places[-1] else "not-a-knot")

    def at(x: Floats, order: int = 0) -> Complexes:
        found = curve(x, order)
        plane: Complexes = found[:, 0] + 1j * found[:, 1]
        return plane

    fine = np.unique(np.concatenate([np.linspace(a, b, PIECES + 1) for a, b in pairwise(knots)]))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    middle, half = (fine[1:] + fine[:-1]) / 2, np.diff(fine) / 2
    speeds = np.abs(at((middle[:, None] + half[:, None] * nodes).ravel(), 1)).reshape(len(middle), -1)
    length = np.concatenate([[0.0], np.cumsum(half * (speeds @ weights))])
    x = knots if points is None else np.interp(np.linspace(0.0, length[-1], points), length, fine)
    first, second = at(x, 1), at(x, 2)
    speed = np.abs(first)
    unit = first / speed
    across = second - (second * np.conj(unit)).real * unit
    return Course(places if points is None else at(x), np.interp(x, fine, length), unit, across / speed**2)
