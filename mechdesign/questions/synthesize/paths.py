"""Linkages whose coupler point passes near given points: sampled, found by the form of their curves, and polished.

No timing is given or it is free: the crank angle of each point is what is nearest on the curve. In the polish it is
projected out of the errors, whose components along the curve's tangent do not count to first order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.questions.synthesize.bounds import Bounds
from mechdesign.questions.synthesize.kinds import Kind

_Numbers = TypeVar("_Numbers", Floats, Complexes)
# Poses of a curve, and points at equal arc length by which forms are compared.
POSES = 64
# Most linkages of a kind and an assembly whose curves are polished, and how many go on after so many rounds.
POLISHED = 1000
_KEPT = {12: 500, 24: 200, 40: 100}
ROUNDS = 120
# Of more points than linkages pass exactly the best go on for as many rounds.
_BEST = 20
# Most points that linkages can pass exactly; of these no start is left behind, so that the exact ones are counted.
MOST_EXACT = 9
# Root of the sum of the squared distances, as a part of the task's size, that is rounding.
_CONVERGED = 1e-14
# Linkages with a larger damping are stuck.
_STUCK = 1e8
# Largest change of the drive in a round, as a part of its course.
_LARGEST_STEP = 0.05
# Of samples with poses at which the linkage cannot be assembled few poses are enough to see it.
_COARSE = 16
# Starts and lengths of the windows of a curve with which an open path is compared, as parts of a turn.
_WINDOWS = [(begin / 24, length) for length in (0.15, 0.25, 0.35, 0.5, 0.7, 0.9) for begin in range(24)]


@dataclass(frozen=True, eq=False)
class PathPoints:
    """Points that a path passes, x + i y, and their crank angles if these are given (radians, the first is free)."""

    points: Complexes
    closed: bool
    timing: Floats | None = None

    @property
    def centre(self) -> complex:
        """The middle of the points."""
        return complex(self.points.mean())

    @property
    def size(self) -> float:
        """The greatest distance between two of their coordinates."""
        return float(max(np.ptp(self.points.real), np.ptp(self.points.imag)))

    @property
    def samples(self) -> tuple[Complexes, Floats]:
        """Points with which curves are compared, for every way of passing them, and where the path's own lie there.

        They are at equal arc length, begun anywhere on a closed path, in both directions; with timing those given. Both
        have shape (ways, points); the place of a point is a number, with its fraction, of the first.
        """
        if self.timing is not None:
            return self.points[None], np.arange(len(self.points), dtype=float)[None]
        around = np.append(self.points, self.points[:1]) if self.closed else self.points
        arc = np.append(0.0, np.cumsum(np.abs(np.diff(around))))
        count = POSES if self.closed else _COARSE
        places = np.arange(count) / count if self.closed else np.linspace(0, 1, count)
        at = _interpolated(places[None] * arc[-1], arc[None])
        shown = at_poses(around[None], at)[0]
        parts = (count if self.closed else count - 1) * arc[: len(self.points)] / max(arc[-1], np.finfo(float).tiny)
        ways = [(shown, parts), (shown[::-1], count - 1 - parts)]
        if self.closed:
            ways = [(np.roll(one, k), np.mod(own + k, count)) for one, own in ways for k in range(count)]
        wanted, lying = zip(*ways, strict=True)
        return np.stack(wanted), np.stack(lying)


@dataclass(frozen=True, eq=False)
class Starts:
    """Linkages of a kind, the crank angle of each at each point (radians), and the numbers of their starts, from 0."""

    values: Floats  # shape (count, places)
    angles: Floats  # shape (count, points)
    numbers: Ints


@dataclass(frozen=True, eq=False)
class Fits(Starts):
    """Linkages in an assembly, best first."""

    costs: Floats  # sum of the squared distances


def starts(
    kind: Kind, modes: tuple[int, ...], task: PathPoints, samples: Floats, bound: Bounds, most: int = POLISHED
) -> Starts:
    """The linkages among samples, about so many, whose curves have most the form of the task; those first."""
    samples = samples[bound.accepts(modes, samples)]
    if bound.in_place and task.timing is None:
        values, angles = _near(kind, modes, task, samples, 4 * most)
    else:
        values, angles = begun(kind, modes, task, samples, most, bound)
    values = bound(values)
    whole = np.isfinite(kind.points(kind.solve(values, angles, modes))).all(axis=1)
    return Starts(values[whole], angles[whole], np.arange(np.count_nonzero(whole)))


def fits(
    kind: Kind, modes: tuple[int, ...], task: PathPoints, start: Starts, bound: Bounds, *, whole: bool = False
) -> Fits:
    """Linkages polished from starts; `bound` keeps their values, and with `whole` no start is left behind."""
    if whole:
        return polish(kind, modes, task, start, bound)
    found = polish(kind, modes, task, start, bound, _KEPT)
    # The best of linkages with many dimensions still come nearer.
    first = Starts(found.values[:_BEST], found.angles[:_BEST], found.numbers[:_BEST])
    best = polish(kind, modes, task, first, bound)
    values, angles, numbers, costs = (
        np.concatenate([getattr(best, name), getattr(found, name)[_BEST:]])
        for name in ("values", "angles", "numbers", "costs")
    )
    order = np.argsort(costs, kind="stable")
    return Fits(values[order], angles[order], numbers[order], costs[order])


def _interpolated(wanted: Floats, rising: Floats) -> Floats:
    """Where, with its fraction, each row of rising numbers takes values; shape of `wanted`."""
    if not len(rising):
        return wanted
    scale = np.maximum(rising[:, -1:], np.finfo(float).tiny)
    rows = 2.0 * np.arange(len(rising))[:, None]
    flat = (rising / scale + rows).ravel()
    places = np.broadcast_to(np.arange(rising.shape[1], dtype=float), rising.shape).ravel()
    return np.interp((np.clip(wanted / scale, 0, 1) + rows).ravel(), flat, places).reshape(wanted.shape)


def at_poses(curves: _Numbers, poses: Floats) -> _Numbers:
    """Points of curves between their poses, on their chords."""
    first = np.minimum(poses.astype(np.intp), curves.shape[1] - 2)
    part, rows = poses - first, np.arange(len(curves))[:, None]
    between: _Numbers = curves[rows, first] * (1 - part) + curves[rows, first + 1] * part
    return between


def _centred(curves: Complexes) -> tuple[Complexes, Complexes, Floats]:
    """Curves about their middle and of size 1, with the middle and the size."""
    middle = curves.mean(axis=1)
    about = curves - middle[:, None]
    size = np.maximum(np.linalg.norm(about, axis=1), np.finfo(float).tiny)
    return about / size[:, None], middle, size


def begun(
    kind: Kind, modes: tuple[int, ...], task: PathPoints, values: Floats, most: int, bound: Bounds
) -> tuple[Floats, Floats]:
    """The linkages with a curve that comes nearest to the task, and the drive at its points.

    Those that the `bound` has in place stay as they are; others are turned, scaled and shifted to the task, and
    |<w, q>| of curve and task, both of size 1, tells the best fit over all similar curves.
    """
    values, curves = _curves(kind, modes, values, whole=bound.turning)
    wanted, parts = task.samples
    forms, (middle, *_), (size, *_) = _centred(wanted)
    likeness, way = np.full(len(values), -np.inf), np.zeros(len(values), dtype=np.intp)
    fit, middles, sizes = np.ones(len(values), dtype=complex), 0j * likeness, np.zeros(len(values))
    kept = np.zeros((len(values), wanted.shape[1]))
    for some, poses in _windows(kind, task, curves):
        own, here, sized = _centred(at_poses(curves[some], poses))
        fits = np.conj(own) @ forms.T
        like = np.abs(fits)
        if bound.in_place:
            off = poses.shape[1] * np.abs(here - middle) ** 2 + sized**2
            like = 2 * size * sized[:, None] * fits.real - off[:, None]
        best = like.argmax(axis=1)
        better = np.flatnonzero(like[np.arange(len(like)), best] > likeness[some])
        rows, best = some[better], best[better]
        likeness[rows], way[rows], fit[rows] = like[better, best], best, fits[better, best]
        middles[rows], sizes[rows], kept[rows] = here[better], sized[better], poses[better]
    best = np.argsort(-likeness, kind="stable")[: min(most, np.count_nonzero(np.isfinite(likeness)))]
    kept = np.column_stack([kept[best], kept[best, :1] + POSES]) if task.closed and task.timing is None else kept[best]
    begin, span = kind.course
    angles = begin + at_poses(kept, parts[way[best]]) * span / POSES
    if bound.in_place:
        return values[best], angles
    turn = fit[best] * size / sizes[best]
    return kind.moved(values[best], turn, middle - turn * middles[best]), angles + np.angle(turn)[:, None]


def _near(kind: Kind, modes: tuple[int, ...], task: PathPoints, values: Floats, most: int) -> tuple[Floats, Floats]:
    """The linkages whose curves, as they are, pass nearest to the points in any order; and the drive there."""
    begin, span = kind.course
    angles = begin + span * np.arange(POSES + 1) / POSES
    curves = kind.points(kind.solve(values, angles[None], modes))
    gaps = np.stack([np.nan_to_num(np.abs(curves - point), nan=np.inf) for point in task.points], axis=1)
    best = np.argsort((gaps.min(axis=2) ** 2).sum(axis=1), kind="stable")[:most]
    return values[best], angles[gaps[best].argmin(axis=2)]


def _curves(kind: Kind, modes: tuple[int, ...], values: Floats, *, whole: bool) -> tuple[Floats, Complexes]:
    """Linkages, those whose drives turn fully where `whole`, and their curves over a turn, two turns, or the course.

    Curves have shape (count, poses), nan where a linkage cannot be assembled.
    """
    begin, span = kind.course
    angles = begin + span * np.arange(POSES + 1) / POSES
    if whole:
        values = values[kind.solve(values, angles[None, : -1 : POSES // _COARSE], modes).valid.all(axis=1)]
    curves = kind.points(kind.solve(values, angles[None], modes))
    if whole:
        some = np.isfinite(curves).all(axis=1)
        return values[some], curves[some]
    return values, np.concatenate([curves, curves[:, 1:]], axis=1) if kind.turns else curves


def _windows(kind: Kind, task: PathPoints, curves: Complexes) -> Iterator[tuple[Ints, Floats]]:
    """Parts of curves that may be the task's: which curves have no gap there, and their poses, with fractions."""
    if task.timing is not None:
        for start in 2 * np.pi * np.arange(POSES) / POSES:
            poses = np.mod(task.timing + start, 2 * np.pi) * POSES / (2 * np.pi)
            some = np.flatnonzero(np.isfinite(at_poses(curves, poses[None])).all(axis=1))
            yield some, np.broadcast_to(poses, (len(some), len(poses)))
        return
    steps = np.abs(np.diff(curves, axis=1, prepend=curves[:, :1]))
    gaps, arc = np.cumsum(~np.isfinite(curves), axis=1), np.cumsum(np.nan_to_num(steps), axis=1)
    shown = np.arange(POSES) / POSES if task.closed else np.linspace(0, 1, _COARSE)
    for start, length in [(0.0, 1.0)] if task.closed else _WINDOWS:
        first, last = round(start * POSES), round((start + length) * POSES)
        if last < curves.shape[1]:
            some = np.flatnonzero((gaps[:, last] == gaps[:, first]) & np.isfinite(curves[:, first]))
            begin, end = arc[some, first, None], arc[some, last, None]
            yield some, _interpolated(begin + shown * (end - begin), arc[some])


def polish(
    kind: Kind, modes: tuple[int, ...], task: PathPoints, start: Starts, bound: Bounds,
    kept: Mapping[int, int] = MappingProxyType({}),
) -> Fits:  # fmt: skip
    """All linkages at once by Levenberg and Marquardt's method; `kept` are how many go on after so many rounds."""

    def cost(values: Floats, angles: Floats) -> Floats:
        gaps = kind.points(kind.solve(values, angles, modes)) - task.points
        return np.asarray(np.nan_to_num((np.abs(gaps) ** 2).sum(axis=1), nan=np.inf, posinf=np.inf))

    values, angles, numbers = start.values, start.angles, start.numbers
    costs, damping = cost(values, angles), np.full(len(values), 1e-3)
    for turn in range(ROUNDS):
        best = np.argsort(costs, kind="stable")[: kept.get(turn, len(costs))]
        best = best[np.isfinite(costs[best])]
        values, angles, costs, damping, numbers = (
            values[best], angles[best], costs[best], damping[best], numbers[best],
        )  # fmt: skip
        going = np.flatnonzero((costs > (_CONVERGED * task.size) ** 2) & (damping < _STUCK))
        if not len(going):
            break
        moved, turned = _step(kind, modes, task, values[going], angles[going], damping[going], bound)
        new = cost(moved, turned)
        better = (new < costs[going]) & bound.accepts(modes, moved)
        rows = going[better]
        values[rows], angles[rows], costs[rows] = moved[better], turned[better], new[better]
        damping[going] = np.where(better, np.maximum(damping[going] / 4, 1e-12), 5 * damping[going])
    best = np.argsort(costs, kind="stable")
    return Fits(values[best], angles[best], numbers[best], costs[best])


def _step(
    kind: Kind, modes: tuple[int, ...], task: PathPoints, values: Floats, angles: Floats, damping: Floats, bound: Bounds
) -> tuple[Floats, Floats]:
    """Where a round leads: values and angles."""
    (begin, span), count = kind.course, len(kind.places)
    largest = _LARGEST_STEP * span
    poses = kind.solve(values, angles, modes)
    gaps = kind.points(poses) - task.points
    by_place, by_drive = kind.derivatives(values, poses)
    by_place = bound.left(values, by_place)
    speed = np.maximum(np.abs(by_drive), np.finfo(float).tiny)
    along = by_drive / speed
    if task.timing is None:
        across = np.conj(1j * along)
        right, matrix = (across * gaps).real, (across * by_place).real
    else:
        right = np.concatenate([gaps.real, gaps.imag], axis=1)
        whole = np.concatenate([by_place, by_drive[None]])
        matrix = np.concatenate([whole.real, whole.imag], axis=2)
    # Rows of linkages, columns of unknowns.
    normal = np.einsum("inj,knj->nik", matrix, matrix)
    slope = np.einsum("inj,nj->ni", matrix, right)
    size = np.einsum("nii->ni", normal)
    size = np.maximum(size, 1e-9 * size.max(axis=1, keepdims=True) + np.finfo(float).tiny)
    normal[:, range(normal.shape[1]), range(normal.shape[1])] += damping[:, None] * size
    step = -np.linalg.solve(normal, slope[..., None])[..., 0]
    moved = bound(values + step[:, :count])
    if task.timing is not None:
        return moved, angles + step[:, count:]
    left = gaps + np.einsum("inj,ni->nj", by_place, moved - values)
    turned = angles - np.clip((np.conj(along) * left).real / speed, -largest, largest)
    return moved, turned if kind.turns else np.clip(turned, begin, begin + span)
