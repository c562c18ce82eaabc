"""Rays through the region of a point over a range of a held coordinate: where some value of it, or every one, serves.

Along a ray the region at each single value is intervals. Over the range these are put together, or what lies between
them is. An end of what results is extreme over the range: at an end of the range, where the radius at which one margin
vanishes has no slope (the boundary is an envelope there), or where two margins vanish. Within each of these the
boundary is smooth. After C. M. Gosselin and M. Jean, Determination of the workspace of planar parallel manipulators
with joint limits, Robotics and Autonomous Systems 17 (1996).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.curves import SLACK
from mechdesign.analyses.workspace.extremes import Starts, improved
from mechdesign.analyses.workspace.field import Field, Places
from mechdesign.analyses.workspace.rays import Designs, Floats, Intervals, Ints, trace
from mechdesign.analyses.workspace.slices import VALUE, Lanes, Misses, Sliced, Stretches, as_intervals, merged
from mechdesign.analyses.workspace.summits import summits

Complex = NDArray[np.complex128]
# Values of the range that are looked at everywhere, and rounds in which others are put between.
VALUES, ROUNDS = 25, 6
# An extreme may lie so many times as far beyond its sample as the samples beside it fall short.
ROOM = 1.5
# Rays are told apart to this angle (radians).
QUANTUM = 2.0**-28


@dataclass(frozen=True, eq=False)
class Endings(Field):
    """A field over a range of a held coordinate, with a label for all that can end its region.

    First each of its margins inside the range, then at the lower end, then at the upper one; then pairs of margins.

    Parameters
    ----------
    which : int
        The held coordinate that ranges, from `low` to `high` (radians or length).
    every : bool
        Whether every value is to be reached, not only one.
    """

    which: int = 0
    low: float = 0.0
    high: float = 0.0
    every: bool = False

    @cached_property
    def sliced(self) -> Sliced:
        """The field at single values of the range."""
        return Sliced(self.mechanism, self.plan, self.held, self.same_assembly, self.length, self.which)

    @cached_property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Kind and name of the margins; of a pair, a limit only where both are."""
        single = self.sliced.labels
        pairs = [
            ("limit" if one[0] == other[0] == "limit" else "singularity", f"{one[1]} and {other[1]}")
            for one in single
            for other in single
        ]
        return (*single, *single, *single, *pairs)

    @property
    def singular(self) -> NDArray[np.bool_]:
        """No square roots are looked for."""
        return np.zeros(len(self.labels), dtype=bool)

    def margins(self, z: Complex, places: Places, *, assembly: bool = True) -> Floats:
        """Unknown, shape (labels, *z.shape): nothing but rays tells where labels change."""
        return np.broadcast_to(np.nan, (len(self.labels), *z.shape))


@dataclass(frozen=True, eq=False)
class RangedDesigns(Designs):
    """Rays through a region over a range: `field` is of `Endings`, and so are the labels of what rays meet."""

    def traced(self, design: Ints, theta: Floats, reach: Floats, samples: int, slack: float) -> Intervals:
        """As `Designs.traced`."""
        # Nearer to where labels change, rounding chooses them.
        return self.decided(QUANTUM * np.round(theta / QUANTUM), reach, samples, slack)[0]

    def decided(self, theta: Floats, reach: Floats, samples: int, slack: float) -> tuple[Intervals, Floats]:
        """As `traced`, and the values of the range that decide at both ends of each interval, shape (2, intervals)."""
        field = self.field
        assert isinstance(field, Endings)
        rays, values = len(theta), np.linspace(field.low, field.high, VALUES)

        def slices(lanes: Lanes) -> tuple[Stretches, Misses]:
            """What the rays meet at single values."""
            at = np.arange(len(lanes.ray))
            sliced = Designs(field.sliced, {VALUE: lanes.value}, len(at), self.about)
            found = trace(sliced, at, theta[lanes.ray], reach[lanes.ray], samples, slack)
            parts = Stretches.outside(found, reach[lanes.ray]) if field.every else Stretches.inside(found)
            return parts, Misses.of(found, len(field.sliced.labels))

        lanes = Lanes(np.repeat(np.arange(rays), VALUES), np.tile(values, rays))
        parts, misses = slices(lanes)
        for _ in range(ROUNDS):
            # Between values where something seems to end and another to begin, and where nothing is quite met.
            broken = parts.broken(lanes)
            ray, value = lanes.ray[broken], 0.5 * (lanes.value[broken] + lanes.value[lanes.beside[1, broken]])
            if not field.every:
                hidden = misses.hidden(lanes)
                ray, value = np.concatenate([ray, hidden[0]]), np.concatenate([value, hidden[1]])
            if not len(ray):
                break
            count = len(lanes.ray)
            fresh = Lanes(ray, value)
            lanes = Lanes(np.concatenate([lanes.ray, ray]), np.concatenate([lanes.value, value]))
            more = slices(fresh)
            parts, misses = parts.joined(more[0], count), misses.joined(more[1], count)
        peak, rise = parts.peaks(lanes)
        _, whole, _, part = merged(lanes.ray[parts.lane], parts.ends)
        side, which = np.nonzero(peak & (np.abs(whole[:, part] - parts.ends) <= ROOM * rise))
        owner = lanes.ray[parts.lane[which]]
        turn = np.exp(1j * theta[owner])
        ends, labels, value = parts.ends.copy(), parts.labels.copy(), np.tile(lanes.value[parts.lane], (2, 1))
        start = Starts(
            ends[side, which], value[side, which], labels[side, which],
            np.stack([parts.named_beside(lanes, side, which, step) for step in range(2)]),
            np.where(side, 1.0, -1.0), reach[owner],
            field.low, field.high, (field.high - field.low) / (VALUES - 1),
        )  # fmt: skip

        def margins(at: Ints, radius: Floats, value: Floats) -> Floats:
            return field.sliced.margins(self.about + radius * turn[at], {VALUE: value})

        def end(at: Ints, value: Floats) -> Floats:
            """Ends nearest to where they were at the samples, outwards positive, shape (1, n); nan where none is."""
            there = slices(Lanes(owner[at], value))[0]
            found, nearest = np.full(len(at), np.nan), np.full(len(at), np.inf)
            for j, some in there.near(np.arange(len(at))):
                gap = np.where(some, np.abs(there.ends[side[at], j] - start.radius[at]), np.inf)
                found = np.where(gap < nearest, start.outwards[at] * there.ends[side[at], j], found)
                nearest = np.minimum(gap, nearest)
            return found[None]

        radius, at, label, failed = improved(margins, start, len(field.sliced.labels), field.every)
        if len(failed):
            radius[failed], at[failed] = _climbed(end, start, failed)
        ends[side, which], labels[side, which], value[side, which] = radius, label, at
        ray, ends, source, _ = merged(lanes.ray[parts.lane], ends)
        sides = np.array([[0], [1]])
        return as_intervals(ray, ends, labels[sides, source], value[sides, source], reach, field.every)

    def deciding(self, theta: Floats, radius: Floats, reach: float, samples: int) -> Floats:
        """The value of the range that decides at points of the boundary, shape (n,)."""
        found, values = self.decided(theta, np.full(len(theta), reach), samples, SLACK)
        ray = np.tile(found.ray, 2)
        gap = np.abs(np.concatenate([found.inner, found.outer]) - radius[ray])
        order = np.lexsort((gap, ray))
        owner, first = np.unique(ray[order], return_index=True)
        value = np.full(len(theta), np.nan)
        value[owner] = values.ravel()[order[first]]
        return value


def _climbed(end: Callable[[Ints, Floats], Floats], start: Starts, lanes: Ints) -> tuple[Floats, Floats]:
    """Radius and value of extremes that Newton's method did not find, by the ends themselves."""
    value = start.value[lanes]
    a, c = np.maximum(value - start.step, start.low), np.minimum(value + start.step, start.high)
    at, height = summits(
        lambda which, x: end(lanes[which], x), (a, value, c), (end(lanes, a), end(lanes, value), end(lanes, c))
    )
    return start.outwards[lanes] * height, at
