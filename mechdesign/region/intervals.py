"""Intervals in which rays run inside a region, between the roots of its margins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints

# Roots nearer to each other than this fraction of the reach are one boundary, named by the first of its margins.
SAME_ROOT = 1e-9
# Intervals no wider than this fraction of the reach are due to rounding.
NARROWEST = 1e-10


@dataclass(frozen=True, eq=False)
class Intervals:
    """Inside intervals of rays, ordered by ray and radius.

    Parameters
    ----------
    ray : ndarray of int, shape (n,)
        Ray of each interval.
    inner, outer : ndarray, shape (n,)
        Radii where it begins and ends.
    enters, leaves : ndarray of int, shape (n,)
        Margin that is zero there; -1 where the interval begins at the centre or does not end within the reach.
    beyond : ndarray of bool, shape (rays,)
        Rays that are still inside at their reach.
    cut : ndarray of bool, shape (rays,)
        Rays that margins which are not quadratic along them, such as those of the assembly, shorten or divide.
    doubt : ndarray, shape (rays,)
        Integral of the radius over the stretches of each ray of which it stays undecided whether they are inside.
    """

    ray: Ints
    inner: Floats
    outer: Floats
    enters: Ints
    leaves: Ints
    beyond: Flags
    cut: Flags
    doubt: Floats

    @property
    def counts(self) -> Ints:
        """Number of intervals of each ray."""
        return np.bincount(self.ray, minlength=len(self.beyond))

    @property
    def slot(self) -> Ints:
        """Number of each interval on its ray, counted outwards from 0."""
        return np.arange(len(self.ray)) - np.searchsorted(self.ray, self.ray)

    def by_ray(self, *values: Floats | Ints) -> Floats:
        """Values of the intervals of each ray, outwards, shape (values, largest count, rays); nan beyond the last."""
        table = np.full((len(values), int(self.counts.max(initial=0)), len(self.beyond)), np.nan)
        table[:, self.slot, self.ray] = values
        return table

    def whole(self, near: Floats | float) -> tuple[Ints, Floats, Floats, Ints, Ints]:
        """Ray, radii and margins of the intervals; two that only a point divides (a leg of no length) count as one.

        Intervals of a ray are joined where the gap between them is at most `near`.
        """
        ray = self.ray
        meets = (ray[1:] == ray[:-1]) & (self.inner[1:] - self.outer[:-1] <= near)
        begins, ends = np.append(True, ~meets)[: len(ray)], np.append(~meets, True)[: len(ray)]
        return ray[begins], self.inner[begins], self.outer[ends], self.enters[begins], self.leaves[ends]

    def modes(self, near: Floats | float) -> tuple[Ints, Floats, Floats, Ints, Ints]:
        """As `whole`, but nothing is joined: where another assembly mode goes on, the margin is -1."""
        meets = (self.ray[1:] == self.ray[:-1]) & (self.inner[1:] - self.outer[:-1] <= near)
        enters, leaves = self.enters.copy(), self.leaves.copy()
        enters[1:][meets] = leaves[:-1][meets] = -1
        return self.ray, self.inner, self.outer, enters, leaves

    def kept(self, keep: Flags) -> Intervals:
        """The intervals that `keep` marks, on the same rays."""
        if keep.all():
            return self
        return replace(self, ray=self.ray[keep], inner=self.inner[keep], outer=self.outer[keep],
                       enters=self.enters[keep], leaves=self.leaves[keep])  # fmt: skip


def joined(rays: Sequence[Ints], parts: Sequence[Intervals]) -> Intervals:
    """Intervals of rays that were traced in several parts; `rays` are the numbers of the rays of each part."""
    if len(parts) == 1:
        return parts[0]
    ray = np.concatenate([numbers[part.ray] for numbers, part in zip(rays, parts, strict=True)])
    order, ray_order = np.argsort(ray, kind="stable"), np.argsort(np.concatenate(rays))

    def column(name: str, order: Ints) -> NDArray[Any]:
        return np.concatenate([getattr(part, name) for part in parts])[order]

    inner, outer, enters, leaves = (column(name, order) for name in ("inner", "outer", "enters", "leaves"))
    return Intervals(ray[order], inner, outer, enters, leaves,
                     *(column(name, ray_order) for name in ("beyond", "cut", "doubt")))  # fmt: skip


def shortened(intervals: Intervals, lanes: Ints, remaining: Intervals, tie: Floats) -> Intervals:
    """Intervals with those at `lanes` replaced by what `remaining` leaves of them.

    A cut within `tie` (of each ray) of an end of the interval is that end, so that rounding does not choose its name.
    """
    source = lanes[remaining.ray]
    tolerance = tie[intervals.ray[source]]
    at_start = (remaining.enters < 0) | (remaining.inner - intervals.inner[source] <= tolerance)
    at_end = (remaining.leaves < 0) | (intervals.outer[source] - remaining.outer <= tolerance)
    keep = np.ones(len(intervals.ray), dtype=bool)
    keep[lanes] = False
    owner = np.concatenate([intervals.ray[keep], intervals.ray[source]])
    inner = np.concatenate([intervals.inner[keep], np.where(at_start, intervals.inner[source], remaining.inner)])
    outer = np.concatenate([intervals.outer[keep], np.where(at_end, intervals.outer[source], remaining.outer)])
    enters = np.concatenate([intervals.enters[keep], np.where(at_start, intervals.enters[source], remaining.enters)])
    leaves = np.concatenate([intervals.leaves[keep], np.where(at_end, intervals.leaves[source], remaining.leaves)])
    order = np.lexsort((inner, owner))
    beyond = np.zeros(len(intervals.beyond), dtype=bool)
    beyond[owner[leaves < 0]] = True
    cut = intervals.cut.copy()
    cut[intervals.ray[lanes]] = True
    return Intervals(owner[order], inner[order], outer[order], enters[order], leaves[order], beyond, cut,
                     intervals.doubt)  # fmt: skip


def intervals_between(
    margin: Ints, ray: Ints, turn: Ints, radius: Floats, start: Ints, reach: Floats, slack: float
) -> Intervals:
    """Stretches of each ray between its roots where no margin is negative; all rays are marked as `cut`.

    Parameters
    ----------
    margin, ray, turn, radius : ndarray, shape (roots,)
        Margin, ray, direction (1 rising, -1 falling) and radius of each root.
    start : ndarray of int, shape (rays,)
        How many margins are negative at the centre.
    """
    rays = len(reach)
    key = radius + np.where(turn < 0, slack * reach[ray], 0.0) if slack else radius
    order = _ascending(margin + np.where(turn < 0, margin.max(initial=0) + 1, 0))
    order = order[_ascending(ray[order])]
    margin, ray, turn = (values[order] for values in (margin, ray, turn))
    radius, key = radius[order], key[order]
    number = np.bincount(ray, minlength=rays)
    first, slot = np.cumsum(number) - number, np.arange(number.max(initial=0))
    # A row for each ray, as rays have few roots.
    has = slot < number[:, None]
    rows = np.full(has.shape, np.inf)
    rows[has] = key
    order = (first[:, None] + np.argsort(rows, axis=1, kind="stable"))[has]
    margin, turn, radius = margin[order], turn[order], radius[order]
    total = np.cumsum(-turn)
    before = np.append(0, total)[first]
    negative = total - before[ray] + start[ray]
    # An interval begins at a root after which nothing is negative, or at the centre.
    begins = np.nonzero(negative == 0)[0]
    central = np.nonzero(start == 0)[0]
    ends = np.append(ray, -1)
    after = begins + 1
    closed = ends[after] == ray[begins]
    inner = np.concatenate([np.zeros(len(central)), radius[begins]])
    enters = np.concatenate([np.full(len(central), -1), margin[begins]])
    owner = np.concatenate([central, ray[begins]])
    last = np.append(np.where(number[central] > 0, first[central], -1), np.where(closed, after, -1)).astype(np.intp)
    outer = np.where(last >= 0, np.append(radius, 0.0)[last], reach[owner])
    leaves = np.where(last >= 0, np.append(margin, -1)[last], -1)
    if central.size:
        sort = np.lexsort((inner, owner))
        owner, inner, outer, enters, leaves = (v[sort] for v in (owner, inner, outer, enters, leaves))
    beyond = np.zeros(rays, dtype=bool)
    beyond[owner[leaves < 0]] = True
    tie = SAME_ROOT * reach
    rising, falling = np.flatnonzero(turn > 0), np.flatnonzero(turn < 0)
    enters = _first_named(owner, inner, enters, margin[rising], ray[rising], radius[rising], tie)
    leaves = _first_named(owner, outer, leaves, margin[falling], ray[falling], radius[falling], tie)
    return Intervals(owner, inner, np.maximum(outer, inner), enters, leaves, beyond, np.ones(rays, dtype=bool),
                     np.zeros(rays))  # fmt: skip


def of_modes(modes: Sequence[Intervals], labels: int, reach: Floats, slack: float) -> Intervals:
    """Intervals of several assembly modes on the same rays, each less those of the modes before it.

    Margins are counted on from mode to mode, each of which has as many `labels`. Where the mode changes an interval
    ends, too.
    """
    first, *others = modes
    for shift, other in enumerate(others, start=1):
        enters, leaves = (np.where(ends >= 0, ends + shift * labels, ends) for ends in (other.enters, other.leaves))
        first = _with(first, replace(other, enters=enters, leaves=leaves), reach, slack)
    return first


def _with(before: Intervals, other: Intervals, reach: Floats, slack: float) -> Intervals:
    """Intervals of both on the same rays, the other ones less those `before`; ends at which both meet are the same."""
    # Of the other ones an end is a root of their own margin, and the gaps between those before are where another is
    # positive: its roots keep the names of the margins that bound the gap.
    rising = [(other.enters, other.inner, other.ray), (before.leaves, before.outer, before.ray)]
    falling = [(other.leaves, other.outer, other.ray), (before.enters, before.inner, before.ray)]
    roots = [tuple(values[ends[0] >= 0] for values in ends) for ends in (*rising, *falling)]
    margin, radius, ray = (np.concatenate(column) for column in zip(*roots, strict=True))
    turn = np.repeat([1, 1, -1, -1], [len(root[0]) for root in roots])
    rays = len(reach)
    start = 1 - np.bincount(other.ray[other.enters < 0], minlength=rays)
    start = start + np.bincount(before.ray[before.enters < 0], minlength=rays)
    rest = intervals_between(margin, ray, turn, radius, start, reach, slack)
    # What rounding leaves beside an interval is none; by itself it may be the tip of a cusp.
    tie = SAME_ROOT * reach[rest.ray]
    beside = np.zeros(len(rest.ray), dtype=bool)
    for inner, outer in zip(*before.by_ray(before.inner, before.outer), strict=True):
        beside |= (inner[rest.ray] <= rest.outer + tie) & (rest.inner - tie <= outer[rest.ray])
    rest = rest.kept((rest.outer - rest.inner > NARROWEST * reach[rest.ray]) | (~beside & (slack > 0)))
    order = np.lexsort((np.concatenate([before.inner, rest.inner]), np.concatenate([before.ray, rest.ray])))
    columns = {name: np.concatenate([getattr(before, name), getattr(rest, name)])[order]
               for name in ("ray", "inner", "outer", "enters", "leaves")}  # fmt: skip
    return Intervals(**columns, beyond=before.beyond | other.beyond, cut=before.cut | other.cut,
                     doubt=before.doubt + other.doubt)  # fmt: skip


def _ascending(values: Ints) -> Ints:
    """Order of small integers, stable."""
    return np.argsort(values.astype(np.min_scalar_type(values.max(initial=0))), kind="stable")


def _first_named(owner: Ints, at: Floats, label: Ints, margin: Ints, ray: Ints, radius: Floats, tie: Floats) -> Ints:
    """First of the margins with a root within `tie` of an end of an interval: rounding does not choose the label."""
    best, number = label.copy(), np.bincount(ray, minlength=len(tie))
    begin, tie = (np.cumsum(number) - number)[owner], tie[owner]
    number = np.where(label >= 0, number[owner], 0)
    for k in range(int(number.max(initial=0))):
        some = np.flatnonzero(number > k)
        root = begin[some] + k
        match = np.abs(radius[root] - at[some]) <= tie[some]
        some = some[match]
        best[some] = np.minimum(best[some], margin[root[match]])
    return best
