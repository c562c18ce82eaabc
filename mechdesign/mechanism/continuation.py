"""Groups without a closed form: from a solved pose to another along a straight line in the given coordinates.

Every step solves all groups by Newton's method from the last accepted pose. It is accepted if the method converged,
the unknowns moved little, and no determinant of a group changed its sign (a singularity lies between the
assemblies); otherwise it is halved, pose by pose. What is not reached is another assembly, or none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism.algebra import Value, angle_of, wrap
from mechdesign.mechanism.solve import Guess, State
from mechdesign.mechanism.structure import Structure

MAX_CHANGE = 0.35
SMALLEST_STEP = 2e-4
MAX_ROUNDS = 400


@dataclass(frozen=True)
class Start:
    """A solved pose to continue from: its given values, dimensions, unknowns by group, signs of the determinants."""

    given: Sequence[Value]
    places: Mapping[str, Value]
    unknowns: Guess
    signs: Sequence[Value]


Solver = Callable[[Sequence[Value], Mapping[str, Value], Guess], State]


def unknowns_of(structure: Structure, rotations: Sequence[Value], slides: Sequence[Value]) -> Guess:
    """Angles and slides of the Newton groups in a solved pose."""
    return {
        index: ([angle_of(np.asarray(rotations[root])) for root in group.angles], [slides[s] for s in group.slides])
        for index, group in enumerate(structure.groups)
        if group.form == "newton"
    }


def _pick(value: Value, mask: NDArray[np.bool_]) -> Value:
    return np.broadcast_to(np.asarray(value, dtype=float), mask.shape)[mask]


def follow(
    structure: Structure,
    solver: Solver,
    start: Start,
    given: Sequence[Value],
    places: Mapping[str, Value],
    nominal: Mapping[str, float],
    size: float,
    count: int,
) -> tuple[Guess, NDArray[np.bool_]]:
    """Continue `count` poses from `start`; returns their unknowns and which poses were reached.

    Parameters
    ----------
    given, places : values at the end of the path, scalars or arrays of shape (count,)
    nominal : nominal value of every place
    size : a length of the mechanism, against which slides are judged
    """
    indices = [index for index, group in enumerate(structure.groups) if group.form == "newton"]
    flat = {
        index: [np.array(np.broadcast_to(v, (count,)), dtype=float) for part in start.unknowns[index] for v in part]
        for index in indices
    }
    scales = {
        index: np.array([1.0] * len(structure.groups[index].angles) + [size] * len(structure.groups[index].slides))
        for index in indices
    }
    begin = [np.broadcast_to(np.asarray(v, dtype=float), (count,)) for v in start.given]
    end = [np.broadcast_to(np.asarray(v, dtype=float), (count,)) for v in given]
    names = set(places) | set(start.places)
    path = {
        name: (start.places.get(name, nominal.get(name, 0.0)), places.get(name, nominal.get(name, 0.0)))
        for name in names
    }
    signs = [np.broadcast_to(np.asarray(v), (count,)) for v in start.signs]
    done = np.zeros(count)
    step = np.ones(count)
    moving = np.ones(count, dtype=bool)
    for _ in range(MAX_ROUNDS):
        if not moving.any():
            break
        target = np.minimum(1.0, done + step)[moving]
        now = [b[moving] + target * (e[moving] - b[moving]) for b, e in zip(begin, end, strict=True)]
        dims = {
            name: _pick(a, moving) + target * (_pick(b, moving) - _pick(a, moving)) for name, (a, b) in path.items()
        }
        old = {index: [v[moving] for v in flat[index]] for index in indices}
        guess = {index: _split(structure, index, old[index]) for index in indices}
        state = solver(now, dims, guess)
        good = np.ones(len(target), dtype=bool)
        for converged, determinant, sign in zip(state.converged, state.determinants, signs, strict=True):
            good &= converged & (np.sign(determinant) == sign[moving])
        new = unknowns_of(structure, state.rotations, state.slides)
        for index in indices:
            angles = len(structure.groups[index].angles)
            values = [np.broadcast_to(v, good.shape) for part in new[index] for v in part]
            for position, (value, before) in enumerate(zip(values, old[index], strict=True)):
                change = wrap(value - before) if position < angles else value - before
                good &= np.abs(change) <= MAX_CHANGE * scales[index][position]
            where = np.flatnonzero(moving)[good]
            for store, value in zip(flat[index], values, strict=True):
                store[where] = value[good]
        active = np.flatnonzero(moving)
        done[active[good]] = target[good]
        step[active[good]] *= 2
        step[active[~good]] /= 2
        moving = (done < 1) & (step >= SMALLEST_STEP)
    return {index: _split(structure, index, flat[index]) for index in indices}, done >= 1


def _split(structure: Structure, index: int, values: Sequence[Value]) -> tuple[list[Value], list[Value]]:
    angles = len(structure.groups[index].angles)
    return list(values[:angles]), list(values[angles:])
