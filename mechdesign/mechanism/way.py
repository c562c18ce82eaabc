"""The way of the given coordinates of a plan from a start to poses: see `continuation`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism.algebra import TURN, Value, nearest, picked
from mechdesign.mechanism.continuation import Start, follow
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.solve import State
from mechdesign.mechanism.structure import Structure

# Between the start and a pose, corrections this small are enough (radians, or parts of the mechanism's size).
PATH_PRECISION = 1e-3


class Way(NamedTuple):
    """What solves the poses on the way: a plan's structure and core, its counted angles, what paces it, its solver."""

    structure: Structure
    core: Core
    angles: Sequence[Coordinate]
    pacing: Sequence[int]
    run: Callable[..., State]
    modes_at: Callable[[Sequence[Value]], Any]

    def to(
        self, values: Sequence[Value], dims: Mapping[str, Value], shape: tuple[int, ...], begin: Start
    ) -> tuple[Floats, Flags, Floats]:
        """Unknowns at the ends of the ways of some poses, which of these were reached, and the counted angles there.

        Where the given turns are not reached, the given angles are those less than half a turn from the start.
        """
        geometry, count = self.core.geometry, int(np.prod(shape))
        begin = begin.map(lambda value: flat(value, shape))
        places = {name: flat(v, shape) for name, v in dims.items()}

        def stepped(
            at: Sequence[Value], sizes: Mapping[str, Value], guess: Floats, steps: int, near: Floats
        ) -> tuple[State, Floats]:
            state = self.run(at, geometry.vectors(sizes), guess, self.modes_at(at), steps, PATH_PRECISION, turns=near)
            there = state.pose()
            turned = [*(there.value(angle) for angle in self.angles), *(state.given[k] for k in self.pacing)]
            shape = near.shape[1:]
            return state, np.array([np.broadcast_to(value, shape) for value in turned]).reshape(near.shape)

        def solve(given: Sequence[Value], rows: Ints) -> tuple[Floats, Flags, Floats]:
            own = [picked(v, rows) for v in given]
            sizes = {name: picked(v, rows) for name, v in places.items()}
            start = begin.map(lambda value: picked(value, rows))
            nominal, size = self.core.nominal, self.core.size
            return follow(self.structure, stepped, start, own, sizes, nominal, size, len(rows), units)

        pacing = [self.structure.values[k] for k in self.pacing]
        units = np.array([
            *(angle.turn / TURN for angle in self.angles),
            *(1.0 if c.quantity == "angle" else self.core.size for c in pacing),
        ])  # fmt: skip
        given = [flat(v, shape) for v in values]
        unknowns, reached, near = solve(given, np.arange(count))
        # Where the given turns are not reached, the pose is the same with its angles less than half a turn away.
        turned = [
            nearest(v, at) if c.quantity == "angle" else v
            for c, v, at in zip(self.structure.given, given, begin.given, strict=True)
        ]
        other = np.any([np.broadcast_to(one != two, (count,)) for one, two in zip(given, turned, strict=True)], axis=0)
        rows = np.flatnonzero(other & ~reached & np.isfinite(near).all(axis=0))
        if len(rows):
            better, there, turns = solve(turned, rows)
            unknowns[:, rows[there]], reached[rows] = better[:, there], there
            near[:, rows[there]] = turns[:, there]
        near = near[: len(self.angles)]
        return unknowns.reshape(len(unknowns), *shape), reached.reshape(shape), near.reshape(len(near), *shape)


def flat(value: Value, shape: tuple[int, ...]) -> Value:
    """A flat batch; a value that is the same for every pose stays a single number."""
    value = np.asarray(value)
    return value if value.ndim == 0 else np.broadcast_to(value, shape).reshape(-1)
