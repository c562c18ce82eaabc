"""Groups without a closed form: from a solved pose to another along a straight line in the given coordinates.

Every step solves all groups by Newton's method from an extrapolation of the last. It is accepted if the method
converged, the unknowns moved little, and no determinant of a group changed its sign (a singularity lies between the
assemblies); otherwise it is halved, pose by pose. A pose that is not reached is in another assembly, or does not exist.

Where couplings follow angles that no sum of given angles fixes, the way counts their turns: neither they nor what moves
them may move far in one step, else whole turns would be lost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism.algebra import TURN, Value, picked, wrap
from mechdesign.mechanism.solve import NEWTON_STEPS, State
from mechdesign.mechanism.structure import Structure

# Largest change of an unknown in one step: radians, or parts of the mechanism's size.
MAX_CHANGE = 0.35
# Change for which steps are planned: a little less, so that few are refused.
PLANNED = 0.8 * MAX_CHANGE
# Largest change in one step of an angle whose turns are counted and of all that moves it (radians, or parts of the
# mechanism's size). The direction between two points turns by little more than half a turn while their places change
# by so little, so that a step cannot hide a turn.
MAX_TURNED = 0.8
SMALLEST_STEP = 2e-4
# Largest number of steps, enough for ten turns.
MAX_ROUNDS = 250
# Ways up to so many times longer are followed in as many times more and smaller steps; turns of others are not known.
LONGEST = 100.0
# Step that gives the first direction, as a part of the path.
FIRST_STEP = 1e-6


@dataclass(frozen=True)
class Start:
    """A solved pose to continue from: its given values, dimensions, unknowns, and signs of the determinants.

    `turns` are the angles whose turns are counted, then given and coupled values that move them.
    """

    given: Sequence[Value]
    places: Mapping[str, Value]
    unknowns: Sequence[Value]
    signs: Sequence[Value]
    turns: Sequence[Value] = ()

    def map(self, function: Callable[[Value], Value]) -> Start:
        """The start with a function applied to each of its arrays."""
        return Start(
            [function(v) for v in self.given],
            {name: function(v) for name, v in self.places.items()},
            [function(v) for v in self.unknowns],
            [function(v) for v in self.signs],
            [function(v) for v in self.turns],
        )


# Solves all groups from given values, dimensions, a guess, a number of Newton steps, and values near the `turns` of a
# start; returns the state and these.
Solver = Callable[[Sequence[Value], Mapping[str, Value], Floats, int, Floats], tuple[State, Floats]]


def table_of(unknowns: Sequence[Value], shape: tuple[int, ...]) -> Floats:
    """Unknowns of all groups, one a row."""
    return np.array([np.broadcast_to(value, shape) for value in unknowns]).reshape(len(unknowns), *shape)


def angle_rows(structure: Structure) -> Flags:
    """Which rows of a table are angles, shape (rows, 1)."""
    flags = [
        np.arange(rows.stop - rows.start) < len(structure.groups[k].angles) for k, rows in structure.unknowns.items()
    ]
    return np.concatenate([np.empty(0, dtype=bool), *flags])[:, None]


def scale_of(structure: Structure, size: float, table: Floats) -> Floats:
    """Units of changes of the unknowns: a radian, and the mechanism's size or the length itself if that is larger."""
    return np.where(angle_rows(structure), 1.0, np.maximum(size, np.abs(table)))


def follow(
    structure: Structure, solver: Solver, start: Start, given: Sequence[Value], places: Mapping[str, Value],
    nominal: Mapping[str, float], size: float, count: int, units: Floats,
) -> tuple[Floats, Flags, Floats]:  # fmt: skip
    """Continue `count` poses from `start`: the table of their unknowns, which poses were reached, and their `turns`.

    Turns at the end of a way that is too long are nan.

    `given` and `places` are the values at the end of the path, scalars or arrays of shape (count,); changes of slides
    are judged as parts of `size`, a length of the mechanism, those of `turns` as parts of `units`.
    """
    angles = angle_rows(structure)
    ends = list(zip(start.given, given, strict=True))
    sizes = {
        name: tuple(at.get(name, nominal.get(name, 0.0)) for at in (start.places, places))
        for name in {**places, **start.places}
    }
    signs = [np.broadcast_to(sign, (count,)) for sign in start.signs]

    def solve(rows: Ints, at: Value, guess: Floats, steps: int = NEWTON_STEPS) -> tuple[Floats, State, Floats]:
        """Unknowns, state and `turns` of some poses at parts `at` of their paths."""

        def between(begin: Value, end: Value) -> Value:
            a, b = picked(begin, rows), picked(end, rows)
            return a + at * (b - a)

        state, angles_there = solver(
            [between(*pair) for pair in ends], {name: between(*pair) for name, pair in sizes.items()},
            guess, steps, turns[:, rows],
        )  # fmt: skip
        return table_of(state.unknowns, rows.shape), state, angles_there

    def change(new: Floats, old: Floats) -> Floats:
        """Changes of the unknowns, angles the shorter way round; nan where a step failed."""
        return np.where(angles, wrap(new - old), new - old)

    def planned(slope: Floats, table: Floats, turning: Floats) -> Floats:
        """Step over which the unknowns and what is counted change by less than they may."""
        speed = (np.abs(slope) / scale_of(structure, size, table)).max(axis=0, initial=0.0)
        speed = np.maximum(speed, (np.abs(turning) / units[:, None]).max(axis=0, initial=0.0) * MAX_CHANGE / MAX_TURNED)
        return np.asarray(np.minimum(1.0, PLANNED / speed))

    table = table_of(start.unknowns, (count,)).copy()
    turns = np.array([np.broadcast_to(angle, (count,)) for angle in start.turns]).reshape(len(start.turns), count)
    moving = np.arange(count)
    # One step of Newton's method at the very beginning gives the direction in which the unknowns set out.
    first, _, turned = solve(moving, FIRST_STEP, table, 1)
    slope, turning = change(first, table) / FIRST_STEP, (turned - turns) / FIRST_STEP
    slope, turning = (np.where(np.isfinite(rate).all(axis=0), rate, 0.0) for rate in (slope, turning))
    done = np.zeros(count)
    step = planned(slope, table, turning)
    steady = np.ones(count, dtype=bool)
    # The way of all that turns, in units of ten turns.
    way = (np.abs(turning) / units[:, None]).max(axis=0, initial=0.0) / (10 * TURN)
    turns[:, way > LONGEST] = np.nan
    moving, way, rounds = moving[way <= LONGEST], np.clip(way, 1.0, LONGEST), 0
    while len(moving):
        rounds += 1
        target = np.minimum(1.0, done[moving] + step[moving])
        taken = target - done[moving]
        old = table[:, moving]
        new, state, turned = solve(moving, target, old + slope[:, moving] * taken)
        moved = change(new, old)
        good = (np.abs(moved) <= MAX_CHANGE * scale_of(structure, size, old)).all(axis=0)
        good &= (np.abs(turned - turns[:, moving]) <= MAX_TURNED * units[:, None]).all(axis=0)
        good &= state.solved(moving.shape, [sign[moving] for sign in signs])
        reached = moving[good]
        turning[:, reached] = (turned - turns[:, moving])[:, good] / taken[good]
        turns[:, reached] = turned[:, good]
        table[:, reached] = old[:, good] + moved[:, good]
        slope[:, reached] = moved[:, good] / taken[good]
        done[reached] = target[good]
        # Longer steps only after two in a row: before a singularity every second one is refused.
        growth = np.where(steady[reached], 2.0, 1.0)
        plan = planned(slope[:, reached], table[:, reached], turning[:, reached])
        step[reached] = np.minimum(plan, growth * step[reached])
        step[moving[~good]] = taken[~good] / 2
        steady[moving] = good
        left = (done < 1) & (step * way >= SMALLEST_STEP) & (rounds < MAX_ROUNDS * way)
        moving = moving[left[moving]]
    return table, done >= 1, turns
