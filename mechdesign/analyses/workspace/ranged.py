"""Rays through the region of a point over a range of a held coordinate: where some value of it, or every one, serves.

Along a ray the region at each single value is intervals. Over the range these are put together, or what lies between
them is. An end of what results is extreme over the range: at an end of the range, where the radius at which one margin
vanishes has no slope (the boundary is an envelope there), or where two margins vanish. Within each of these the
boundary is smooth. After C. M. Gosselin and M. Jean, Determination of the workspace of planar parallel manipulators
with joint limits, Robotics and Autonomous Systems 17 (1996).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from mechdesign.analyses.region.curves import SLACK
from mechdesign.analyses.region.field import Field, Places
from mechdesign.analyses.region.rays import Designs, Intervals, trace
from mechdesign.analyses.workspace.across import Across
from mechdesign.analyses.workspace.extremes import Starts, extended
from mechdesign.analyses.workspace.slices import VALUE, Lanes, Misses, Sliced, Stretches, as_intervals, merged
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Values of the range that are looked at everywhere, and rounds in which others are put between.
VALUES, ROUNDS = 25, 6
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
    # A kink so little inside a panel costs no more than its square; nearer to where labels change, rounding chooses.
    accuracy: ClassVar[float] = 1e-7

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

    def label(self, one: Ints, two: Ints) -> Ints:
        """Labels of pairs of margins of which the two after the last are the ends of the range."""
        count = len(self.sliced.labels)
        low, high = np.minimum(one, two), np.maximum(one, two)
        single = np.where(high == low, low, low + (1 + high - count) * count)
        return np.asarray(np.where((high < count) & (high > low), (3 + low) * count + high, single))

    @property
    def singular(self) -> Flags:
        """No square roots are looked for."""
        return np.zeros(len(self.labels), dtype=bool)

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """Unknown, shape (labels, *z.shape): nothing but rays tells where labels change."""
        return np.broadcast_to(np.nan, (len(self.labels), *z.shape))


@dataclass(frozen=True, eq=False)
class RangedDesigns(Designs):
    """Rays through a region over a range: `field` is of `Endings`, and so are the labels of what rays meet."""

    def inside(self, z: Complexes, design: Ints) -> Flags:
        """As `Designs.inside`, by single values of the range."""
        field = self.field
        assert isinstance(field, Endings)
        found = np.full(z.shape, field.every)
        for value in np.linspace(field.low, field.high, VALUES):
            at = Designs(field.sliced, {VALUE: np.full(self.count, value)}, self.count, self.about).inside(z, design)
            found = found & at if field.every else found | at
        return found

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
        for _ in range(0 if field.every else ROUNDS):
            # Between values where nothing is quite met.
            ray, value = misses.hidden(lanes)
            if not len(ray):
                break
            count = len(lanes.ray)
            fresh = Lanes(ray, value)
            lanes = Lanes(np.concatenate([lanes.ray, ray]), np.concatenate([lanes.value, value]))
            more = slices(fresh)
            parts, misses = parts.joined(more[0], count), misses.joined(more[1], count)
        ray, ends, source = merged(lanes.ray[parts.lane], parts.ends)
        sides = np.array([[0], [1]])
        labels, value = parts.labels[sides, source], lanes.value[parts.lane[source]]
        # Each end may go on as far as the next stretch.
        same = ray[1:] == ray[:-1]
        limit = np.stack([np.zeros(len(ray)), reach[ray]])
        limit[0, 1:][same], limit[1, :-1][same] = ends[1, :-1][same], ends[0, 1:][same]
        side, which = np.nonzero(labels >= 0)
        owner, count = ray[which], len(field.sliced.labels)
        at_end = np.where(value == field.low, count, np.where(value == field.high, count + 1, -1))
        start = Starts(
            ends[side, which], value[side, which], (ends[1] - ends[0])[which],
            np.stack([labels, at_end])[:, side, which], limit[side, which],
            np.where(side, 1.0, -1.0), reach[owner], (field.high - field.low) / (VALUES - 1),
            np.append(field.sliced.singular, [False, False]),
        )  # fmt: skip
        across = Across(field.sliced, theta[owner], self.about, field.low, field.high, field.every, labels[side, which])
        radius, at, pair = extended(across.margins, across.cut, start, field.every)
        ends[side, which], value[side, which] = radius, at
        known = (pair >= 0).all(axis=0)
        labels[side[known], which[known]] = field.label(*pair[:, known])
        labels[side[~known & (radius == 0)], which[~known & (radius == 0)]] = -1
        ray, ends, source = merged(ray, ends)
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
