"""Intervals in which rays about a point run inside the region, bounded by roots of the margins.

The region is where all margins of a `Field` are positive. Along a ray each margin is solved on its own, not the
smallest of them. Two margins that cross zero close together (a cusp of the region) then bound a thin interval exactly,
however coarse the scan; and margins that are differences of squared distances are quadratic along the ray, so that
three samples give their roots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism.algebra import picked
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots, dips
from mechdesign.region.field import Field, Places

# Rays traced at once (measured: smaller blocks cost more in calls than they save in cache).
BLOCK = 8192
# Accuracy of roots along a ray, as a fraction of the radius.
ROUNDING = 1e-14
# Roots nearer to each other than this fraction of the reach are one boundary, named by the first of its margins.
SAME_ROOT = 1e-9
# A margin is quadratic if a parabola through three samples meets two more to this fraction of the largest.
QUADRATIC = 1e-13
# Intervals no wider than this fraction of the reach are due to rounding.
NARROWEST = 1e-10
# Least number of samples of an interval where expressions are limited, which may oscillate along a ray.
OF_EXPRESSIONS = 48
# Largest turn of a link from one sample to the next (chord of the unit circle).
FARTHEST_TURN = 0.5
# Distance of the first and the last sample from the ends of an interval, as a fraction of it.
INSET = 1e-10
# Places along a ray, as fractions of its reach, at which margins are tested for being quadratic.
FIVE = np.linspace(0.0, 1.0, 5)


@dataclass(frozen=True)
class Effort:
    """How finely a region is scanned.

    Parameters
    ----------
    rays : int
        Rays over the scan.
    samples : int
        Samples of each interval, for margins that are not quadratic along rays.
    cells : int
        Cells of the raster in x, and in y, over a box that the point cannot leave: pieces and holes that hold the
        circle around a cell are never lost.
    """

    rays: int
    samples: int
    cells: int


# For a single design, and for each of thousands, which is refined where the error estimate asks for it.
SINGLE = Effort(128, 48, 192)
BATCH = Effort(16, 12, 24)


def is_turn(scan: tuple[float, float]) -> bool:
    """Whether a scan is a full turn, but for rounding."""
    return scan[1] - scan[0] >= 2 * np.pi * (1 - 1e-12)


def ray_through(offset: Complexes, start: float) -> Floats:
    """Angles of the rays to places at an `offset` from the centre, in the turn that begins at the angle `start`."""
    return np.asarray(start + (np.angle(offset) - start) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class Designs:
    """Several designs of one mechanism, scanned about one point.

    Parameters
    ----------
    places : mapping of str to ndarray, shape (designs,)
        Values of each design where they differ from the nominal ones: dimensions and numbers of the field.
    count : int
        Number of designs.
    about : complex
        Centre of the scan.
    scan : (float, float)
        First and last angle of the rays (radians).
    centres : ndarray of complex, shape (designs,), optional
        Start of the rays of each design, where it is not the centre of the scan.
    """

    field: Field
    places: Places
    count: int
    about: complex
    scan: tuple[float, float]
    effort: Effort
    centres: Complexes | None = None

    @property
    def members(self) -> tuple[Designs, ...]:
        """The same designs in each mode of the field."""
        return (self,)

    @cached_property
    def in_any_assembly(self) -> Designs:
        """The same designs without the margins of the assembly."""
        return replace(self, field=replace(self.field, same_assembly=False))

    def of(self, index: Ints) -> Places:
        """Values of the designs `index`, in the shape of `index`."""
        return {name: np.asarray(value)[index] for name, value in self.places.items()}

    def starts(self, design: Ints) -> Complexes:
        """Where the rays of each of `design` start."""
        return np.full(design.shape, self.about) if self.centres is None else self.centres[design]

    def inside(self, z: Complexes, design: Ints) -> Flags:
        """Whether places lie in the region; shape (places, designs), one column for each of `design`."""
        return self.look(z, design)[0]

    def look(self, z: Complexes, design: Ints, *, assembly: bool = False) -> tuple[Flags, Floats]:
        """Whether places lie in the region, as `inside`, and the margins there, shape (margins, places, designs).

        Without `assembly`, margins of the assembly are inf where other margins exclude a place.
        """
        field, places = self.field, self.of(design)
        complete = assembly or field.plan.iterative or not field.same_assembly
        margins = field.margins(z, places, assembly=complete)
        inside = np.asarray((margins > 0).all(axis=0))
        if not complete:
            # Determinants cost as much as all other margins together: they are computed only where they decide.
            place, lane = np.nonzero(inside)
            all_margins = field.margins(z[place, lane], {name: picked(value, lane) for name, value in places.items()})
            inside[place, lane] = (all_margins > 0).all(axis=0)
            of_assembly = np.full((len(all_margins) - len(margins), *z.shape), np.inf)
            of_assembly[:, place, lane] = all_margins[len(margins) :]
            margins = np.concatenate([margins, of_assembly])
        return inside, margins

    def traced(self, design: Ints, theta: Floats, reach: Floats, slack: float) -> Intervals:
        """Intersect one block of rays with the region, as `trace` does.

        First with the margins that are quadratic along the rays; then, in what is left, with the others. The intervals
        of a ray do not depend on the other rays of the block.
        """
        places, centre, direction = self.of(design), self.starts(design), np.exp(1j * theta)
        values = self.field.margins(centre + FIVE[:, None] * reach * direction, places, assembly=False)
        quadratic, (a, b, c) = _parabolas(values)
        if not quadratic.all():
            # Margins that are not quadratic are replaced by 1, which has no root.
            a, b, c = np.where(quadratic, a, 1.0), np.where(quadratic, b, 0.0), np.where(quadratic, c, 0.0)
        margin, ray, turn, x, start = _quadratic_roots(a, b, c)
        intervals = intervals_between(margin, ray, turn, x * reach[ray], start, reach, slack)
        intervals = replace(intervals, cut=np.zeros(len(theta), dtype=bool))
        if not (quadratic.all() and not self.field.same_assembly):
            intervals = _cut_by_others(self, places, centre, direction, intervals, quadratic, slack, reach)
        wide = intervals.outer - intervals.inner > NARROWEST * reach[intervals.ray]
        return intervals if slack else intervals.kept(wide)


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
    """

    ray: Ints
    inner: Floats
    outer: Floats
    enters: Ints
    leaves: Ints
    beyond: Flags
    cut: Flags

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


def trace(designs: Designs, design: Ints, theta: Floats, reach: Floats, slack: float = 0.0) -> Intervals:
    """Intersect rays with the region.

    Parameters
    ----------
    design, theta, reach : ndarray, shape (rays,)
        Design, direction (radians) and length of each ray.
    slack : float
        Intervals whose ends rounding has exchanged, by up to this fraction of the reach, are kept (for rays through a
        cusp).
    """
    parts = [
        designs.traced(design[k : k + BLOCK], theta[k : k + BLOCK], reach[k : k + BLOCK], slack)
        for k in range(0, max(len(theta), 1), BLOCK)
    ]
    starts = np.arange(len(parts)) * BLOCK
    return joined([start + np.arange(len(part.beyond)) for start, part in zip(starts, parts, strict=True)], parts)


def joined(rays: Sequence[Ints], parts: Sequence[Intervals]) -> Intervals:
    """Intervals of rays that were traced in several parts; `rays` are the numbers of the rays of each part."""
    if len(parts) == 1:
        return parts[0]
    ray = np.concatenate([numbers[part.ray] for numbers, part in zip(rays, parts, strict=True)])
    order, ray_order = np.argsort(ray, kind="stable"), np.argsort(np.concatenate(rays))

    def column(name: str, order: Ints) -> NDArray[Any]:
        return np.concatenate([getattr(part, name) for part in parts])[order]

    inner, outer, enters, leaves = (column(name, order) for name in ("inner", "outer", "enters", "leaves"))
    return Intervals(ray[order], inner, outer, enters, leaves, column("beyond", ray_order), column("cut", ray_order))


def _parabolas(values: Floats) -> tuple[Flags, tuple[Floats, Floats, Floats]]:
    """Which margins are quadratic on each ray, and coefficients of a + b x + c x^2 through x = 0, 1/2 and 1.

    `values` are samples at x = 0, 1/4, 1/2, 3/4 and 1, shape (margins, 5, rays). Those at 1/4 and 3/4 show which
    margins are quadratic along a ray, as differences of squared distances are.
    """
    at_0, at_1, at_2, at_3, at_4 = (values[:, k] for k in range(5))
    a, b, c = at_0, 4 * at_2 - 3 * at_0 - at_4, 2 * (at_0 + at_4) - 4 * at_2
    with np.errstate(invalid="ignore"):
        allowed = QUADRATIC * np.abs(values).max(axis=1)
        fits = np.abs(a + 0.25 * (b + 0.25 * c) - at_1) <= allowed
        fits &= np.abs(a + 0.75 * (b + 0.75 * c) - at_3) <= allowed
    return fits, (a, b, c)


def _quadratic_roots(a: Floats, b: Floats, c: Floats) -> tuple[Ints, Ints, Ints, Floats, Ints]:
    """Margin, ray, direction (1 rising) and x of all roots in (0, 1); and how many margins of a ray begin negative."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        half = -0.5 * (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
        roots = np.stack([half / c, a / half])
        margin_of = (roots > SAME_ROOT) & (roots < 1)
    which, margin, ray = np.nonzero(margin_of)
    # The slope at the first of the two roots has the sign of -b, at the other that of b, even where they coincide.
    rising = np.signbit(b[margin, ray]) == (which == 0)
    x, start = roots[which, margin, ray], (a + SAME_ROOT * (b + SAME_ROOT * c) <= 0).sum(axis=0)
    return margin, ray, np.where(rising, 1, -1), x, start


def _cut_by_others(
    designs: Designs,
    places: Places,
    centre: Complexes,
    direction: Complexes,
    intervals: Intervals,
    quadratic: Flags,
    slack: float,
    reach: Floats,
) -> Intervals:
    """Intervals less the parts where a margin that is not `quadratic` along its ray is negative or unknown."""
    assembly_count = len(designs.field.labels) - len(quadratic)
    solved = np.concatenate([quadratic, np.zeros((assembly_count, len(direction)), dtype=bool)])
    sampled = np.flatnonzero(~np.asarray(solved.all(axis=0))[intervals.ray])
    owner, inner, width = intervals.ray[sampled], intervals.inner[sampled], (intervals.outer - intervals.inner)[sampled]
    local = {name: picked(value, owner) for name, value in places.items()}
    turning = any(bound.coordinate.kind == "expression" for bound in designs.field.mechanism.bounds)
    count = max(designs.effort.samples, OF_EXPRESSIONS if turning else 0)
    fraction = np.clip(0.5 * (1 - np.cos(np.linspace(0, np.pi, count))), INSET, 1 - INSET)
    radii = inner + fraction[:, None] * width
    rows = np.flatnonzero(~solved.all(axis=1))

    def places_at(lane: Ints, radius: Floats) -> tuple[Complexes, Places]:
        z = centre[owner[lane]] + radius * direction[owner[lane]]
        return z, {name: picked(value, lane) for name, value in local.items()}

    def look(lane: Ints, radius: Floats) -> tuple[Floats, Floats]:
        values, turned = designs.field.sampled(*places_at(lane, radius))
        return without_solved(values[rows], lane), turned

    def margins_at(lane: Ints, radius: Floats) -> Floats:
        return without_solved(designs.field.margins(*places_at(lane, radius))[rows], lane)

    def without_solved(values: Floats, lane: Ints) -> Floats:
        """Margins with those set to 1 whose roots bound the intervals already."""
        margin, column = np.nonzero(solved[rows][:, owner[lane]])
        values[margin, ..., column] = 1.0
        return values

    radii, values = _refined_by_turn(look, radii, SAME_ROOT * reach[owner])
    noise = designs.field.rounding[rows]
    radii, values = with_dips(margins_at, radii, _without_rounding(values, noise), noise)
    lanes = np.flatnonzero(~(values > 0).all(axis=(0, 1)) & (width > slack * reach[owner]))
    if not lanes.size:
        return intervals
    radii, values = radii[:, lanes], values[:, :, lanes]
    cut_of = sampled[lanes]
    margin, lane, turn, radius, start = sign_changes(
        lambda lane, radius: margins_at(lanes[lane], radius), radii, values, ROUNDING * intervals.outer[cut_of]
    )
    remaining = intervals_between(rows[margin], lane, turn, radius, start, intervals.outer[cut_of], slack)
    return _replace(intervals, cut_of, remaining, NARROWEST * reach)


def sign_changes(
    margins_at: Callable[[Ints, Floats], Floats], radii: Floats, values: Floats, tolerance: Floats
) -> tuple[Ints, Ints, Ints, Floats, Ints]:
    """Roots between samples of margins on several lanes, stretches of rays.

    Parameters
    ----------
    margins_at : callable
        Margins, shape (margins, ...), on given lanes at given radii.
    radii : ndarray, shape (samples, lanes)
    values : ndarray, shape (margins, samples, lanes)
    tolerance : ndarray, shape (lanes,)
        Accuracy of the roots' radii.

    Returns
    -------
    (margin, lane, direction, radius, negative)
        Of each root its margin, lane, direction (1 rising, -1 falling) and radius; of each lane the number of margins
        that are negative at its first sample.
    """
    positive = values > 0
    margin, cell, lane = np.nonzero(positive[:, 1:] != positive[:, :-1])
    ends = np.stack([cell, cell + 1, np.where(cell > 0, cell - 1, np.minimum(cell + 2, len(radii) - 1))])
    x, f = radii[ends, lane], values[margin, ends, lane]
    # Where another margin is negative at both ends of the cell no interval ends: the middle is near enough.
    radius = 0.5 * (x[0] + x[1])
    idle = ~(positive[:, 1:] | positive[:, :-1])
    bounding = np.flatnonzero(~idle[:, cell, lane].any(axis=0))

    def evaluate(which: Ints, radius: Floats) -> Floats:
        which = bounding[which]
        return margins_at(lane[which], radius)[margin[which], np.arange(len(which))]

    (a, b, c), (fa, fb, fc) = x[:, bounding], f[:, bounding]
    radius[bounding] = bracketed_roots(evaluate, a, fa, b, fb, c, fc, tolerance[lane[bounding]])
    return margin, lane, np.where(f[1] > 0, 1, -1), radius, (~positive[:, 0]).sum(axis=0)


def _refined_by_turn(
    look: Callable[[Ints, Floats], tuple[Floats, Floats]], radii: Floats, nearest: Floats
) -> tuple[Floats, Floats]:
    """Samples of margins, refined until no link turns by more than `FARTHEST_TURN` between two of them.

    Samples at most `nearest` (of each lane) apart are not divided further. A link whose pin passes closely by another
    one turns within a stretch of the ray as short as the distance between the two.
    """
    values, turned = look(np.arange(radii.shape[1]), radii)
    cell, lane = np.nonzero(turned > FARTHEST_TURN)
    ends = np.stack([radii[cell, lane], radii[cell + 1, lane]])
    lanes, places, more = [lane[:0]], [ends[0, :0]], [values[:, 0, :0]]
    while True:
        wide = ends[1] - ends[0] > nearest[lane]
        lane, ends = lane[wide], ends[:, wide]
        if not lane.size:
            break
        middle = 0.5 * (ends[0] + ends[1])
        between, turned = look(lane, np.stack([ends[0], middle, ends[1]]))
        lanes.append(lane)
        places.append(middle)
        more.append(between[:, 1])
        half, which = np.nonzero(turned > FARTHEST_TURN)
        lane, ends = lane[which], np.stack([ends[0], middle, ends[1]])[[half, half + 1], which]
    return _with_more(radii, values, np.concatenate(lanes), np.concatenate(places), np.concatenate(more, axis=1))


def _with_more(radii: Floats, values: Floats, lane: Ints, place: Floats, more: Floats) -> tuple[Floats, Floats]:
    """Samples (margins, samples, lanes) and more of them, each at a `place` of a `lane`, in order outwards."""
    if not len(lane):
        return radii, values
    order = np.argsort(lane, kind="stable")
    lane, place, more = lane[order], place[order], more[:, order]
    # Each lane gets as many samples as the lane that needs most: copies of its last one fill the rest.
    slot = np.arange(len(lane)) - np.searchsorted(lane, lane)
    most = int(slot.max(initial=-1)) + 1
    padded, padded_values = np.repeat(radii[-1:], most, axis=0), np.repeat(values[:, -1:], most, axis=1)
    padded[slot, lane], padded_values[:, slot, lane] = place, more
    radii, values = np.concatenate([radii, padded]), np.concatenate([values, padded_values], axis=1)
    order = np.argsort(radii, axis=0, kind="stable")
    return np.take_along_axis(radii, order, axis=0), np.take_along_axis(values, order[None], axis=1)


def _without_rounding(values: Floats, noise: Floats) -> Floats:
    """Margins (margins, samples, lanes) with samples below their `noise` set to the sign that both neighbours have."""
    beside, noise = np.sign(values[:, :-2]), noise[:, None, None]
    with np.errstate(invalid="ignore"):
        doubtful = (np.abs(values[:, 1:-1]) <= noise) & (beside == np.sign(values[:, 2:]))
    values[:, 1:-1] = np.where(doubtful, beside * noise, values[:, 1:-1])
    return values


def with_dips(
    margins_at: Callable[[Ints, Floats], Floats], radii: Floats, values: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Samples of margins, and further ones where a margin changes its sign twice between two samples.

    A minimum above zero (or a maximum below) is sought where the slopes beside it admit a zero; also beside the ends of
    a lane, where a leg may be stretched or folded.
    """
    lane, place = _beside_ends(radii, values)
    if lane.size:
        radii, values = _with_more(radii, values, lane, place, margins_at(lane, place))
    before, middle, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    left, right = radii[1:-1] - radii[:-2], radii[2:] - radii[1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        sign = np.sign(middle)
        height, fall, rise = np.abs(middle), sign * (before - middle), sign * (after - middle)
        lowest = (fall >= 0) & (rise >= 0) & (sign * before > 0) & (sign * after > 0)
        slope = np.maximum(fall / left, rise / right)
        lowest &= (height <= slope * np.maximum(left, right)) & np.isfinite(height)
    margin, row, lane = np.nonzero(lowest)
    if not len(margin):
        return radii, values
    rows, sign = row + np.arange(3)[:, None], sign[margin, row, lane]

    def evaluate(which: Ints, radius: Floats) -> Floats:
        margin_values = margins_at(lane[which], radius)[margin[which], np.arange(len(which))]
        return np.asarray(sign[which] * margin_values)

    place, value = dips(evaluate, radii[rows, lane], sign * values[margin, rows, lane], -noise[margin])
    hidden = value < -noise[margin]
    lane, place = lane[hidden], place[hidden]
    return _with_more(radii, values, lane, place, margins_at(lane, place))


def _beside_ends(radii: Floats, values: Floats) -> tuple[Ints, Floats]:
    """Lanes and radii, between an end sample and the next, of minima that may come near to zero (maxima likewise).

    They are those of parabolas in the square root of the distance from the end, in which a margin that ends there is
    smooth.
    """
    every = np.arange(radii.shape[1])
    last = (radii < radii[-1]).sum(axis=0)
    lanes, places = [every[:0]], [radii[0, :0]]
    for end, step in ((0 * last, 1), (last, -1)):
        rows = np.clip(end + step * np.arange(3)[:, None], 0, len(radii) - 1)
        x, f = radii[rows, every], values[:, rows, every]
        root = np.sqrt(np.abs(x - x[0]))
        with np.errstate(invalid="ignore", divide="ignore"):
            near, far = (f[:, 1] - f[:, 0]) / root[1], (f[:, 2] - f[:, 0]) / root[2]
            bend = (far - near) / (root[2] - root[1])
            slope = near - bend * root[1]
            turning, fall = -0.5 * slope / bend, 0.25 * slope * slope / np.abs(bend)
            same_sign, height = np.sign(f[:, 0]) == np.sign(f[:, 1]), np.abs(f[:, 0])
            low = same_sign & (bend * f[:, 0] > 0) & (turning > 0) & (turning < root[1]) & (2 * fall >= height)
        margin, lane = np.nonzero(low)
        lanes.append(lane)
        places.append(x[0, lane] + step * turning[margin, lane] ** 2)
    return np.concatenate(lanes), np.concatenate(places)


def _replace(intervals: Intervals, lanes: Ints, remaining: Intervals, tie: Floats) -> Intervals:
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
    return Intervals(owner[order], inner[order], outer[order], enters[order], leaves[order], beyond, cut)


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
    key = radius + np.where(turn < 0, slack * reach[ray], 0.0)
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
    enters = _first_named(owner, inner, enters, margin[turn > 0], ray[turn > 0], radius[turn > 0], tie)
    leaves = _first_named(owner, outer, leaves, margin[turn < 0], ray[turn < 0], radius[turn < 0], tie)
    return Intervals(owner, inner, np.maximum(outer, inner), enters, leaves, beyond, np.ones(rays, dtype=bool))


def _ascending(values: Ints) -> Ints:
    """Order of small integers, stable."""
    return np.argsort(values.astype(np.min_scalar_type(values.max(initial=0))), kind="stable")


def _first_named(owner: Ints, at: Floats, label: Ints, margin: Ints, ray: Ints, radius: Floats, tie: Floats) -> Ints:
    """First of the margins with a root within `tie` of an end of an interval: rounding does not choose the label."""
    best = label.copy()
    begin = np.searchsorted(ray, owner)
    end = np.searchsorted(ray, owner, side="right")
    for k in range(int(np.max(end - begin, initial=0))):
        at_k = np.minimum(begin + k, max(len(ray) - 1, 0))
        match = (begin + k < end) & (label >= 0)
        match[match] = np.abs(radius[at_k[match]] - at[match]) <= tie[owner[match]]
        best[match] = np.minimum(best[match], margin[at_k[match]])
    return best
