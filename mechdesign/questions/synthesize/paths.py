"""Linkages whose coupler point passes near given points: sampled, found by the form of their curves, and polished.

No timing is given or it is free: the crank angle of each point is what is nearest on the curve. In the polish it is
projected out of the errors, whose components along the curve's tangent do not count to first order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.questions.synthesize.kinds import Kind

# Poses of a curve, and points at equal arc length by which forms are compared.
POSES = 64
# Most linkages of a kind and an assembly whose curves are polished, and how many go on after so many rounds.
POLISHED = 1000
_KEPT = {12: 500, 24: 200, 40: 100}
ROUNDS = 120
# Most points that linkages can pass exactly; of these no start is left behind, so that the exact ones are counted.
MOST_EXACT = 9
# Root of the sum of the squared distances, as a part of the task's size, that is rounding.
_CONVERGED = 1e-14
# Largest change of a crank angle in a round, radians.
_LARGEST_TURN = 0.3
# Of samples with poses at which the linkage cannot be assembled few poses are enough to see it.
_COARSE = 16
# Starts and lengths of the windows of a curve with which an open path is compared, as parts of a turn.
_WINDOWS = [(begin / 24, length) for length in (0.15, 0.25, 0.35, 0.5, 0.7, 0.9) for begin in range(24)]


@dataclass(frozen=True, eq=False)
class Points:
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


@dataclass(frozen=True, eq=False)
class Fits:
    """Linkages of a kind in an assembly, best first: their values, and the crank angle at each point (radians)."""

    kind: Kind
    modes: tuple[int, ...]
    values: Floats  # shape (count, places)
    angles: Floats  # shape (count, points)
    costs: Floats  # sum of the squared distances
    starts: Ints  # which of the linkages that were polished each was, from 0


class Bound(Protocol):
    """What keeps linkages within their conditions while they are polished."""

    fixed: Flags  #: which places have their values
    in_place: bool  #: whether samples are where they must be, so that only their forms are free

    def __call__(self, values: Floats) -> Floats:
        """The nearest values within the limits of each."""

    def accepts(self, modes: tuple[int, ...], values: Floats) -> Flags:
        """Which linkages keep what their motion is asked for."""


def fits(
    kind: Kind, modes: tuple[int, ...], task: Points, samples: Floats, bound: Bound, polished: int = POLISHED
) -> Fits:
    """The linkages among samples whose curves have the form of the task, polished; `bound` keeps their values."""
    samples = samples[bound.accepts(modes, samples)]
    if bound.in_place and task.timing is None:
        values, angles = _near(kind, modes, task, samples, 4 * polished)
    else:
        values, angles = _alike(kind, modes, task, samples, polished)
    return polish(kind, modes, task, bound(values), angles, bound, culled=len(task.points) > MOST_EXACT)


def samples(kind: Kind, random: np.random.Generator, count: int, ratio: float, *, full_turn: bool) -> Floats:
    """Random linkages of a kind in no special place and size, about `count` of them; their cranks turn or may not.

    Lengths are log-uniform over a ratio; the crank is more often the shortest than by chance, as then it may turn.
    """
    values, few = np.tile(kind.nominal, (count, 1)), np.log(ratio)
    lengths = [k for k, place in enumerate(kind.places) if place.endswith(".length")]
    values[:, lengths] = np.exp(random.uniform(0, few, (count, len(lengths))))
    for number, (x, y) in enumerate(kind.pivots):
        # The frame begins at O.
        away = np.exp(random.uniform(0, few, count) + 1j * random.uniform(-np.pi, np.pi, count))
        away = 0 * away if kind.places[x] == "ground.O.x" else np.abs(away) if not number else away
        values[:, x], values[:, y] = away.real, away.imag
    for x, y in _points(kind):
        link = kind.places[x].partition(".")[0]
        length = values[:, kind[f"{link}.length"]]
        arm = length * np.exp(random.uniform(-2, 1, count) + 1j * random.uniform(-np.pi, np.pi, count))
        values[:, x], values[:, y] = length / 2 + arm.real, arm.imag
    if kind.directions:
        # The slide runs along x, beside the crank's pivot by up to its coupler.
        (x, y), (crank, coupler) = kind.pivots[0], (kind["crank.length"], kind["coupler.length"])
        values[:, kind.directions] = 0.0
        values[:, x], values[:, y] = 0.0, values[:, coupler] * random.uniform(-0.8, 0.8, count)
        values[:, crank] = values[:, coupler] * np.exp(random.uniform(-few, 0, count))
        return values
    links = kind.links(values)
    others = np.min([links[name] for name in ("ground", "coupler", "rocker")], axis=0)
    shortest = random.uniform(size=count) < (0.85 if full_turn else 0.6)
    values[:, kind["crank.length"]] = np.where(
        shortest, others * np.exp(random.uniform(-few, 0, count) / 2), links["crank"]
    )
    return values


def _points(kind: Kind) -> list[tuple[int, int]]:
    """Columns of x and y of the points of moving links."""
    return [(k, kind[f"{place[:-1]}y"]) for k, place in enumerate(kind.places)
            if place.endswith(".x") and not place.startswith("ground.")]  # fmt: skip


def turning(kind: Kind, modes: tuple[int, ...], values: Floats) -> tuple[Floats, Complexes]:
    """Those linkages whose cranks turn fully, and their curves at equal crank angles, shape (count, POSES)."""
    angles = 2 * np.pi * np.arange(POSES) / POSES
    some = kind.solve(values, angles[None, :: POSES // _COARSE], modes).valid.all(axis=1)
    values = values[some]
    curves = kind.points(kind.solve(values, angles[None], modes))
    whole = np.isfinite(curves).all(axis=1)
    return values[whole], curves[whole]


def resampled(curves: Complexes, count: int, *, closed: bool) -> tuple[Complexes, Floats]:
    """Points at equal arc length of curves of shape (curves, poses), and at which pose, with its fraction, each is."""
    around = np.concatenate([curves, curves[:, :1]], axis=1) if closed else curves
    arc = np.cumsum(np.abs(np.diff(around, axis=1, prepend=around[:, :1])), axis=1)
    parts = np.arange(count) / count if closed else np.linspace(0, 1, count)
    poses = _interpolated(parts[None] * arc[:, -1:], arc)
    return at_poses(around, poses), poses


def _interpolated(wanted: Floats, rising: Floats) -> Floats:
    """Where, with its fraction, each row of rising numbers takes values; shape of `wanted`."""
    if not len(rising):
        return wanted
    scale = np.maximum(rising[:, -1:], np.finfo(float).tiny)
    rows = 2.0 * np.arange(len(rising))[:, None]
    flat = (rising / scale + rows).ravel()
    places = np.broadcast_to(np.arange(rising.shape[1], dtype=float), rising.shape).ravel()
    return np.interp((np.clip(wanted / scale, 0, 1) + rows).ravel(), flat, places).reshape(wanted.shape)


def at_poses(curves: Complexes, poses: Floats) -> Complexes:
    """Points of curves between their poses, on their chords."""
    first = np.minimum(poses.astype(np.intp), curves.shape[1] - 2)
    part, rows = poses - first, np.arange(len(curves))[:, None]
    return np.asarray(curves[rows, first] * (1 - part) + curves[rows, first + 1] * part)


def _centred(curves: Complexes) -> tuple[Complexes, Complexes, Floats]:
    """Curves about their middle and of size 1, with the middle and the size."""
    middle = curves.mean(axis=1)
    about = curves - middle[:, None]
    size = np.maximum(np.linalg.norm(about, axis=1), np.finfo(float).tiny)
    return about / size[:, None], middle, size


def _alike(kind: Kind, modes: tuple[int, ...], task: Points, values: Floats, most: int) -> tuple[Floats, Floats]:
    """The linkages whose curves, turned, scaled and shifted, come nearest to the task, there; and their crank angles.

    |<w, q>| of curve and task, both of size 1, is the best fit over all similar curves.
    """
    if task.timing is not None:
        return _alike_in_time(kind, modes, task, values, most)
    if not task.closed:
        return _alike_open(kind, modes, task, values, most)
    values, curves = turning(kind, modes, values)
    points, poses = resampled(curves, POSES, closed=True)
    forms, middles, sizes = _centred(points)
    wanted, (middle,), (size,) = _centred(resampled(task.points[None], POSES, closed=True)[0])
    turned = np.stack([np.roll(way, k) for way in (wanted[0], wanted[0, ::-1]) for k in range(POSES)])
    fit = np.conj(forms) @ turned.T
    which = np.abs(fit).argmax(axis=1)
    fit = fit[np.arange(len(fit)), which]
    best = np.argsort(-np.abs(fit), kind="stable")[:most]
    which, scale = which[best], fit[best] * size / sizes[best]
    around = np.append(task.points, task.points[:1])
    arc = np.cumsum(np.abs(np.diff(around)))
    parts = POSES * np.append(0.0, arc[:-1]) / max(arc[-1], np.finfo(float).tiny)
    parts = np.where(which[:, None] < POSES, parts, POSES - 1 - parts)
    at = np.mod(parts + (which % POSES)[:, None], POSES)
    around_poses = np.concatenate([poses, np.full((len(poses), 1), float(POSES))], axis=1)[best]
    angles = at_poses(around_poses, at) * 2 * np.pi / POSES
    return kind.moved(values[best], scale, middle - scale * middles[best]), angles + np.angle(scale)[:, None]


def _near(kind: Kind, modes: tuple[int, ...], task: Points, values: Floats, most: int) -> tuple[Floats, Floats]:
    """The linkages whose curves, as they are, pass nearest to the points; and their crank angles there."""
    angles = 2 * np.pi * np.arange(POSES) / POSES
    curves = kind.points(kind.solve(values, angles[None], modes))
    gaps = np.stack([np.nan_to_num(np.abs(curves - point), nan=np.inf) for point in task.points], axis=1)
    best = np.argsort((gaps.min(axis=2) ** 2).sum(axis=1), kind="stable")[:most]
    return values[best], angles[gaps[best].argmin(axis=2)]


def _alike_open(kind: Kind, modes: tuple[int, ...], task: Points, values: Floats, most: int) -> tuple[Floats, Floats]:
    """The same for a path that is not closed, which a part of the curve resembles."""
    grid = 2 * np.pi * np.arange(2 * POSES) / POSES
    curves = kind.points(kind.solve(values, grid[None, :POSES], modes))
    curves = np.concatenate([curves, curves], axis=1)
    steps = np.abs(np.diff(curves, axis=1, prepend=curves[:, :1]))
    broken, arc = np.cumsum(~np.isfinite(curves), axis=1), np.cumsum(np.nan_to_num(steps), axis=1)
    wanted, (middle,), (size,) = _centred(resampled(task.points[None], _COARSE, closed=False)[0])
    fits, shown = np.zeros((len(_WINDOWS), len(values)), dtype=complex), np.linspace(0, 1, _COARSE)
    found = []
    for number, (begin, length) in enumerate(_WINDOWS):
        first, last = round(begin * POSES), round((begin + length) * POSES)
        whole = (broken[:, last] == broken[:, first]) & np.isfinite(curves[:, first])
        some = np.flatnonzero(whole)
        poses = _interpolated(arc[some, first, None] + shown * (arc[some, last] - arc[some, first])[:, None], arc[some])
        forms, middles, sizes = _centred(np.nan_to_num(at_poses(curves[some], poses)))
        fits[number, some] = np.conj(forms) @ wanted[0]
        found.append((some, poses, middles, sizes))
    likeness = np.abs(fits).max(axis=0)
    # Some linkages have no window in which they can be assembled throughout.
    best = np.argsort(-likeness, kind="stable")[: min(most, np.count_nonzero(likeness))]
    window, scale, start, centre = np.abs(fits[:, best]).argmax(axis=0), [], [], []
    arcs = np.append(0.0, np.cumsum(np.abs(np.diff(task.points))))
    parts = (_COARSE - 1) * arcs / max(arcs[-1], np.finfo(float).tiny)
    for lane, number in zip(best.tolist(), window.tolist(), strict=True):
        some, poses, middles, sizes = found[number]
        row = int(np.searchsorted(some, lane))
        scale.append(fits[number, lane] * size / sizes[row])
        centre.append(middles[row])
        start.append(at_poses(poses[row : row + 1], parts[None])[0])
    turn, angles = np.array(scale), np.reshape(start, (len(best), len(parts))) * 2 * np.pi / POSES
    return kind.moved(values[best], turn, middle - turn * np.array(centre)), angles + np.angle(turn)[:, None]


def _alike_in_time(
    kind: Kind, modes: tuple[int, ...], task: Points, values: Floats, most: int
) -> tuple[Floats, Floats]:
    """The same where the crank angles of the points are given, but for the first."""
    assert task.timing is not None
    values, curves = turning(kind, modes, values)
    curves = np.concatenate([curves, curves[:, :1]], axis=1)
    wanted, (middle,), (size,) = _centred(task.points[None])
    best_fit, phase = np.zeros(len(values), dtype=complex), np.zeros(len(values))
    middles, sizes = np.zeros(len(values), dtype=complex), np.ones(len(values))
    for start in 2 * np.pi * np.arange(POSES) / POSES:
        poses = np.mod(task.timing + start, 2 * np.pi) * POSES / (2 * np.pi)
        forms, here, sized = _centred(at_poses(curves, np.broadcast_to(poses, (len(curves), len(poses)))))
        fit = np.conj(forms) @ wanted[0]
        better = np.abs(fit) > np.abs(best_fit)
        best_fit, phase = np.where(better, fit, best_fit), np.where(better, start, phase)
        middles, sizes = np.where(better, here, middles), np.where(better, sized, sizes)
    best = np.argsort(-np.abs(best_fit), kind="stable")[:most]
    turn = best_fit[best] * size / sizes[best]
    angles = task.timing + phase[best][:, None] + np.angle(turn)[:, None]
    return kind.moved(values[best], turn, middle - turn * middles[best]), angles


def polish(
    kind: Kind, modes: tuple[int, ...], task: Points, values: Floats, angles: Floats, bound: Bound,
    *, culled: bool = True,
) -> Fits:  # fmt: skip
    """All linkages at once by Levenberg and Marquardt's method, the worse ones left behind on the way if `culled`."""
    count = len(kind.places)

    def cost(values: Floats, angles: Floats) -> Floats:
        gaps = kind.points(kind.solve(values, angles, modes)) - task.points
        return np.asarray(np.nan_to_num((np.abs(gaps) ** 2).sum(axis=1), nan=np.inf, posinf=np.inf))

    costs, damping, starts = cost(values, angles), np.full(len(values), 1e-3), np.arange(len(values))
    for number in range(ROUNDS):
        best = np.argsort(costs, kind="stable")[: _KEPT.get(number, len(costs)) if culled else len(costs)]
        best = best[np.isfinite(costs[best])]
        values, angles, costs, damping, starts = (
            values[best], angles[best], costs[best], damping[best], starts[best],
        )  # fmt: skip
        if not (costs > (_CONVERGED * task.size) ** 2).any():
            break
        poses = kind.solve(values, angles, modes)
        gaps = kind.points(poses) - task.points
        by_place, by_drive = kind.derivatives(poses)
        by_place = np.where(bound.fixed[:, None, None], 0.0, by_place)
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
        if task.timing is None:
            left = gaps + np.einsum("inj,ni->nj", by_place, moved - values)
            turned = angles - np.clip((np.conj(along) * left).real / speed, -_LARGEST_TURN, _LARGEST_TURN)
        else:
            turned = angles + step[:, count:]
        new = cost(moved, turned)
        better = (new < costs) & bound.accepts(modes, moved)
        values, angles = np.where(better[:, None], moved, values), np.where(better[:, None], turned, angles)
        costs, damping = np.where(better, new, costs), np.where(better, np.maximum(damping / 4, 1e-12), 5 * damping)
    best = np.argsort(costs, kind="stable")
    return Fits(kind, modes, values[best], angles[best], costs[best], starts[best])
