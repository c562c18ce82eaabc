"""Where rays about a point run inside the region: intervals between the roots of the margins.

The region is where all margins of a `Field` are positive. Along a ray every margin is followed by itself, not only the
smallest one: two margins that cross zero close together (a cusp of the region) bracket a thin interval exactly, however
coarse the scan, and margins that are differences of squared distances are quadratic, so that few samples find all
their roots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.analyses.region.field import Field, Places
from mechdesign.mechanism.algebra import picked
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots, dips

# Rays traced at once, measured: fewer cost more in calls than their smaller arrays save.
BLOCK = 8192
ROUNDING = 1e-14
# Roots nearer than this (relative to the reach) are the same boundary; of several margins the first is named.
SAME_ROOT = 1e-9
# Five samples that a parabola meets to this fraction of their size are of a quadratic function.
QUADRATIC = 1e-13
# Intervals no wider than this part of the reach are rounding's.
NARROWEST = 1e-10
# As many samples at least where expressions are limited, which may turn often along a ray.
OF_EXPRESSIONS = 48
# Farthest that a link may turn from one sample to the next (a chord of the unit circle).
FARTHEST_TURN = 0.5
# First and last sample of an interval, as fractions of it.
INSET = 1e-10
FIVE = np.linspace(0.0, 1.0, 5)


@dataclass(frozen=True)
class Effort:
    """How finely the region is looked for.

    Parameters
    ----------
    rays : int
        Rays over the scan.
    samples : int
        Samples of each interval, for margins that are not quadratic along rays.
    cells : int
        Cells of the raster over the width and height of what the point can reach at most: pieces and holes that hold
        a circle around a cell are never lost.
    """

    rays: int
    samples: int
    cells: int


# One design is looked at closely; of thousands each a little less, refined where the error estimate asks for it.
SINGLE = Effort(128, 48, 192)
BATCH = Effort(16, 12, 24)


def is_turn(scan: tuple[float, float]) -> bool:
    """Whether a scan goes all the way round, but for rounding."""
    return scan[1] - scan[0] >= 2 * np.pi * (1 - 1e-12)


def ray_through(way: Complexes, start: float) -> Floats:
    """Angles of the rays to places seen from their centre, from the first ray of the scan on."""
    return np.asarray(start + (np.angle(way) - start) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class Designs:
    """Several designs of one mechanism, scanned about one point.

    Parameters
    ----------
    places : mapping of str to ndarray, shape (designs,)
        Dimensions that differ from the nominal ones.
    count : int
        Number of designs.
    about : complex
        Where the rays start.
    scan : (float, float)
        First and last angle of the rays (radians).
    centres : ndarray of complex, shape (designs,), optional
        Where rays are traced from instead, of each design.
    """

    field: Field
    places: Places
    count: int
    about: complex
    scan: tuple[float, float]
    effort: Effort
    centres: Complexes | None = None

    @cached_property
    def in_any_assembly(self) -> Designs:
        """The same without margins of the assembly."""
        return replace(self, field=replace(self.field, same_assembly=False))

    def of(self, index: Ints) -> Places:
        """Dimensions of the designs `index`, in the shape of `index`."""
        return {name: np.asarray(value)[index] for name, value in self.places.items()}

    def starts(self, design: Ints) -> Complexes:
        """Where rays of the designs `design` start."""
        return np.full(design.shape, self.about) if self.centres is None else self.centres[design]

    def inside(self, z: Complexes, design: Ints) -> Flags:
        """Whether places lie in the region; shape (places, designs), one column for each of `design`."""
        return self.look(z, design)[0]

    def look(self, z: Complexes, design: Ints, *, assembly: bool = False) -> tuple[Flags, Floats]:
        """Whether places lie in the region, as `inside`, and margins there.

        Unless they are asked for, those of the `assembly` may be left out, as inf, where others exclude a place.
        """
        field, places = self.field, self.of(design)
        both = assembly or field.plan.iterative or not field.same_assembly
        found = field.margins(z, places, assembly=both)
        good = np.asarray((found > 0).all(axis=0))
        if not both:
            # Determinants cost as much as all other margins: only where they decide.
            place, lane = np.nonzero(good)
            margins = field.margins(z[place, lane], {name: picked(value, lane) for name, value in places.items()})
            good[place, lane] = (margins > 0).all(axis=0)
            rest = np.full((len(margins) - len(found), *z.shape), np.inf)
            rest[:, place, lane] = margins[len(found) :]
            found = np.concatenate([found, rest])
        return good, found

    def traced(self, design: Ints, theta: Floats, reach: Floats, slack: float) -> Intervals:
        """Intersect a block of rays with the region, as `trace` does."""
        return _trace_block(self, design, theta, reach, slack)


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
        Margin that is zero there; -1 where it begins at the centre or is not closed within the reach.
    beyond : ndarray of bool, shape (rays,)
        Rays still inside at their reach.
    cut : ndarray of bool, shape (rays,)
        Rays of which margins that are not quadratic along them, such as those of the assembly, leave out something.
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
        """Intervals of each ray."""
        return np.bincount(self.ray, minlength=len(self.beyond))

    @property
    def slot(self) -> Ints:
        """Place of each interval on its ray, outwards from 0."""
        return np.arange(len(self.ray)) - np.searchsorted(self.ray, self.ray)

    def by_ray(self, *values: Floats | Ints) -> Floats:
        """Values of intervals in order outwards, shape (values, most intervals of a ray, rays); nan where none is."""
        found = np.full((len(values), int(self.counts.max(initial=0)), len(self.beyond)), np.nan)
        found[:, self.slot, self.ray] = values
        return found

    def kept(self, keep: Flags) -> Intervals:
        """Some of the intervals, on the same rays."""
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
        Intervals that rounding closed, up to this fraction of the reach, are kept (for rays through a cusp).
    """
    parts = [
        designs.traced(design[k : k + BLOCK], theta[k : k + BLOCK], reach[k : k + BLOCK], slack)
        for k in range(0, max(len(theta), 1), BLOCK)
    ]
    starts = np.arange(len(parts)) * BLOCK
    return joined([start + np.arange(len(part.beyond)) for start, part in zip(starts, parts, strict=True)], parts)


def joined(rays: Sequence[Ints], parts: Sequence[Intervals]) -> Intervals:
    """Intervals of rays of which parts were traced apart; `rays` are the numbers of the rays of each part."""
    if len(parts) == 1:
        return parts[0]
    ray = np.concatenate([own[part.ray] for own, part in zip(rays, parts, strict=True)])
    of_ray, order = np.argsort(np.concatenate(rays)), np.argsort(ray, kind="stable")
    each = ([getattr(part, name) for part in parts] for name in ("inner", "outer", "enters", "leaves"))
    whole = ([getattr(part, name) for part in parts] for name in ("beyond", "cut"))
    ends, flags = ([np.concatenate(values)[at] for values in some] for some, at in ((each, order), (whole, of_ray)))
    return Intervals(ray[order], *ends, *flags)


def _trace_block(designs: Designs, design: Ints, theta: Floats, reach: Floats, slack: float) -> Intervals:
    """First what is quadratic along a ray, whose roots are known; then the other margins, within what is left.

    Each ray is judged by itself: what else is traced with it changes nothing.
    """
    places, start_of, direction = designs.of(design), designs.starts(design), np.exp(1j * theta)
    values = designs.field.margins(start_of + FIVE[:, None] * reach * direction, places, assembly=False)
    quadratic, (a, b, c) = _parabolas(values)
    if not quadratic.all():
        # What is not quadratic has no roots here.
        a, b, c = np.where(quadratic, a, 1.0), np.where(quadratic, b, 0.0), np.where(quadratic, c, 0.0)
    margin, ray, turn, x, start = _quadratic_roots(a, b, c)
    found = intervals_between(margin, ray, turn, x * reach[ray], start, reach, slack)
    found = replace(found, cut=np.zeros(len(theta), dtype=bool))
    if not (quadratic.all() and not designs.field.same_assembly):
        found = _others(designs, places, start_of, direction, found, quadratic, slack, reach)
    return found if slack else found.kept(found.outer - found.inner > NARROWEST * reach[found.ray])


def _parabolas(values: Floats) -> tuple[Flags, tuple[Floats, Floats, Floats]]:
    """Coefficients of a + b x + c x^2 through margins at x = 0, 1/2, 1, and which margins are such on each ray.

    Differences of squared distances are quadratic along a ray; the samples at 1/4 and 3/4 tell.
    """
    at_0, at_1, at_2, at_3, at_4 = (values[:, k] for k in range(5))
    a, b, c = at_0, 4 * at_2 - 3 * at_0 - at_4, 2 * (at_0 + at_4) - 4 * at_2
    with np.errstate(invalid="ignore"):
        allowed = QUADRATIC * np.abs(values).max(axis=1)
        fits = np.abs(a + 0.25 * (b + 0.25 * c) - at_1) <= allowed
        fits &= np.abs(a + 0.75 * (b + 0.75 * c) - at_3) <= allowed
    return fits, (a, b, c)


def _quadratic_roots(a: Floats, b: Floats, c: Floats) -> tuple[Ints, Ints, Ints, Floats, Ints]:
    """Margin, ray, direction and place of all roots in (0, 1), and how many margins are negative just after 0."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        half = -0.5 * (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
        roots = np.stack([half / c, a / half])
        margin_of = (roots > SAME_ROOT) & (roots < 1)
    which, margin, ray = np.nonzero(margin_of)
    # The slope at the first of the two roots has the sign of -b, at the other that of b: also where they are one.
    rising = np.signbit(b[margin, ray]) == (which == 0)
    x, start = roots[which, margin, ray], (a + SAME_ROOT * (b + SAME_ROOT * c) <= 0).sum(axis=0)
    return margin, ray, np.where(rising, 1, -1), x, start


def _others(
    designs: Designs,
    places: Places,
    start_of: Complexes,
    direction: Complexes,
    found: Intervals,
    quadratic: Flags,
    slack: float,
    reach: Floats,
) -> Intervals:
    """Cut intervals where one of the margins that are not quadratic along their ray is negative or unknown."""
    extra = len(designs.field.labels) - len(quadratic)
    known = np.concatenate([quadratic, np.zeros((extra, len(direction)), dtype=bool)])
    sampled = np.flatnonzero(~np.asarray(known.all(axis=0))[found.ray])
    owner, inner, width = found.ray[sampled], found.inner[sampled], (found.outer - found.inner)[sampled]
    local = {name: picked(value, owner) for name, value in places.items()}
    turning = any(bound.coordinate.kind == "expression" for bound in designs.field.mechanism.bounds)
    number = max(designs.effort.samples, OF_EXPRESSIONS if turning else 0)
    fraction = np.clip(0.5 * (1 - np.cos(np.linspace(0, np.pi, number))), INSET, 1 - INSET)
    radii = inner + fraction[:, None] * width
    rows = np.flatnonzero(~known.all(axis=1))

    def look(lane: Ints, radius: Floats) -> tuple[Floats, Floats]:
        z = start_of[owner[lane]] + radius * direction[owner[lane]]
        values, turned = designs.field.sampled(z, {name: picked(value, lane) for name, value in local.items()})
        return without_known(values[rows], lane), turned

    def margins_at(lane: Ints, radius: Floats) -> Floats:
        z = start_of[owner[lane]] + radius * direction[owner[lane]]
        values = designs.field.margins(z, {name: picked(value, lane) for name, value in local.items()})
        return without_known(values[rows], lane)

    def without_known(values: Floats, lane: Ints) -> Floats:
        """Roots that are known have ended the intervals."""
        margin, of = np.nonzero(known[rows][:, owner[lane]])
        values[margin, ..., of] = 1.0
        return values

    radii, values = _turn_by_turn(look, radii, SAME_ROOT * reach[owner])
    noise = designs.field.rounding[rows]
    radii, values = with_dips(margins_at, radii, _without_rounding(values, noise), noise)
    lanes = np.flatnonzero(~(values > 0).all(axis=(0, 1)) & (width > slack * reach[owner]))
    if not lanes.size:
        return found
    radii, values = radii[:, lanes], values[:, :, lanes]
    cut_of = sampled[lanes]
    margin, lane, turn, radius, start = sign_changes(
        lambda lane, radius: margins_at(lanes[lane], radius), radii, values, ROUNDING * found.outer[cut_of]
    )
    part = intervals_between(rows[margin], lane, turn, radius, start, found.outer[cut_of], slack)
    return _replace(found, cut_of, part, NARROWEST * reach)


def sign_changes(
    margins_at: Callable[[Ints, Floats], Floats], radii: Floats, values: Floats, tolerance: Floats
) -> tuple[Ints, Ints, Ints, Floats, Ints]:
    """Margin, lane, direction and place of roots of samples (margins, samples, lanes), and how many begin negative.

    `tolerance` is the wanted accuracy of the places on each lane.
    """
    positive = values > 0
    margin, cell, lane = np.nonzero(positive[:, 1:] != positive[:, :-1])
    ends = np.stack([cell, cell + 1, np.where(cell > 0, cell - 1, np.minimum(cell + 2, len(radii) - 1))])
    x, f = radii[ends, lane], values[margin, ends, lane]
    # Where another margin is negative at both ends nothing ends there: the middle will do.
    radius = 0.5 * (x[0] + x[1])
    idle = ~(positive[:, 1:] | positive[:, :-1])
    asked = np.flatnonzero(~idle[:, cell, lane].any(axis=0))

    def evaluate(which: Ints, radius: Floats) -> Floats:
        which = asked[which]
        return margins_at(lane[which], radius)[margin[which], np.arange(len(which))]

    (a, b, c), (fa, fb, fc) = x[:, asked], f[:, asked]
    radius[asked] = bracketed_roots(evaluate, a, fa, b, fb, c, fc, tolerance[lane[asked]])
    return margin, lane, np.where(f[1] > 0, 1, -1), radius, (~positive[:, 0]).sum(axis=0)


def _turn_by_turn(
    look: Callable[[Ints, Floats], tuple[Floats, Floats]], radii: Floats, least: Floats
) -> tuple[Floats, Floats]:
    """Samples of margins, with so many more that between two of them no link turns far; none nearer than `least`.

    Where a pin passes another one closely a link turns about it within as little of the ray as lies between the two.
    """
    values, turned = look(np.arange(radii.shape[1]), radii)
    cell, lane = np.nonzero(turned > FARTHEST_TURN)
    ends = np.stack([radii[cell, lane], radii[cell + 1, lane]])
    lanes, places, found = [lane[:0]], [ends[0, :0]], [values[:, 0, :0]]
    while True:
        wide = ends[1] - ends[0] > least[lane]
        lane, ends = lane[wide], ends[:, wide]
        if not lane.size:
            break
        middle = 0.5 * (ends[0] + ends[1])
        value, turned = look(lane, np.stack([ends[0], middle, ends[1]]))
        lanes.append(lane)
        places.append(middle)
        found.append(value[:, 1])
        half, which = np.nonzero(turned > FARTHEST_TURN)
        lane, ends = lane[which], np.stack([ends[0], middle, ends[1]])[[half, half + 1], which]
    return _with_more(radii, values, np.concatenate(lanes), np.concatenate(places), np.concatenate(found, axis=1))


def _with_more(radii: Floats, values: Floats, lane: Ints, place: Floats, found: Floats) -> tuple[Floats, Floats]:
    """Samples (margins, samples, lanes) with more of some lanes, of values `found`, in order outwards."""
    if not len(lane):
        return radii, values
    order = np.argsort(lane, kind="stable")
    lane, place, found = lane[order], place[order], found[:, order]
    # As many more samples a lane, all at its end but those that were found.
    slot = np.arange(len(lane)) - np.searchsorted(lane, lane)
    most = int(slot.max(initial=-1)) + 1
    more, more_values = np.repeat(radii[-1:], most, axis=0), np.repeat(values[:, -1:], most, axis=1)
    more[slot, lane], more_values[:, slot, lane] = place, found
    radii, values = np.concatenate([radii, more]), np.concatenate([values, more_values], axis=1)
    order = np.argsort(radii, axis=0, kind="stable")
    return np.take_along_axis(radii, order, axis=0), np.take_along_axis(values, order[None], axis=1)


def _without_rounding(values: Floats, noise: Floats) -> Floats:
    """Margins (margins, samples, lanes) with samples below their `noise` given the sign of both neighbours."""
    beside, noise = np.sign(values[:, :-2]), noise[:, None, None]
    with np.errstate(invalid="ignore"):
        doubtful = (np.abs(values[:, 1:-1]) <= noise) & (beside == np.sign(values[:, 2:]))
    values[:, 1:-1] = np.where(doubtful, beside * noise, values[:, 1:-1])
    return values


def with_dips(
    margins_at: Callable[[Ints, Floats], Floats], radii: Floats, values: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Samples of margins with those added at which a margin has the other sign than at the samples on both sides.

    A local minimum above zero (or maximum below) is looked at where the slopes beside it admit a zero; also one that
    must lie beside an end, where a leg may be stretched or folded.
    """
    lane, place = _beside_ends(radii, values)
    if lane.size:
        radii, values = _with_more(radii, values, lane, place, margins_at(lane, place))
    before, here, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    left, right = radii[1:-1] - radii[:-2], radii[2:] - radii[1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        sign = np.sign(here)
        height, fall, rise = np.abs(here), sign * (before - here), sign * (after - here)
        lowest = (fall >= 0) & (rise >= 0) & (sign * before > 0) & (sign * after > 0)
        slope = np.maximum(fall / left, rise / right)
        lowest &= (height <= slope * np.maximum(left, right)) & np.isfinite(height)
    margin, row, lane = np.nonzero(lowest)
    if not len(margin):
        return radii, values
    rows, sign = row + np.arange(3)[:, None], sign[margin, row, lane]

    def evaluate(which: Ints, radius: Floats) -> Floats:
        found = margins_at(lane[which], radius)[margin[which], np.arange(len(which))]
        return np.asarray(sign[which] * found)

    place, value = dips(evaluate, radii[rows, lane], sign * values[margin, rows, lane], -noise[margin])
    hidden = value < -noise[margin]
    lane, place = lane[hidden], place[hidden]
    return _with_more(radii, values, lane, place, margins_at(lane, place))


def _beside_ends(radii: Floats, values: Floats) -> tuple[Ints, Floats]:
    """Lanes and places between the first, or the last, two samples where a margin falls far towards zero and rises.

    By parabolas in the square root of the distance from the end, in which margins that end there are smooth.
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
            way, fall = -0.5 * slope / bend, 0.25 * slope * slope / np.abs(bend)
            same, height = np.sign(f[:, 0]) == np.sign(f[:, 1]), np.abs(f[:, 0])
            low = same & (bend * f[:, 0] > 0) & (way > 0) & (way < root[1]) & (2 * fall >= height)
        margin, lane = np.nonzero(low)
        lanes.append(lane)
        places.append(x[0, lane] + step * way[margin, lane] ** 2)
    return np.concatenate(lanes), np.concatenate(places)


def _replace(found: Intervals, lanes: Ints, part: Intervals, tie: Floats) -> Intervals:
    """Intervals with those at `lanes` replaced by the parts of them that `part` has left.

    A cut no farther from an end than `tie` (of each ray) is that end: rounding does not choose its name.
    """
    source = lanes[part.ray]
    near = tie[found.ray[source]]
    at_start = (part.enters < 0) | (part.inner - found.inner[source] <= near)
    at_end = (part.leaves < 0) | (found.outer[source] - part.outer <= near)
    keep = np.ones(len(found.ray), dtype=bool)
    keep[lanes] = False
    owner = np.concatenate([found.ray[keep], found.ray[source]])
    inner = np.concatenate([found.inner[keep], np.where(at_start, found.inner[source], part.inner)])
    outer = np.concatenate([found.outer[keep], np.where(at_end, found.outer[source], part.outer)])
    enters = np.concatenate([found.enters[keep], np.where(at_start, found.enters[source], part.enters)])
    leaves = np.concatenate([found.leaves[keep], np.where(at_end, found.leaves[source], part.leaves)])
    order = np.lexsort((inner, owner))
    beyond = np.zeros(len(found.beyond), dtype=bool)
    beyond[owner[leaves < 0]] = True
    cut = found.cut.copy()
    cut[found.ray[lanes]] = True
    return Intervals(owner[order], inner[order], outer[order], enters[order], leaves[order], beyond, cut)


def intervals_between(
    margin: Ints, ray: Ints, turn: Ints, radius: Floats, start: Ints, reach: Floats, slack: float
) -> Intervals:
    """Put the roots of each ray in order and keep the stretches where no margin is negative; all may be `cut`."""
    rays = len(reach)
    key = radius + np.where(turn < 0, slack * reach[ray], 0.0)
    order = _ascending(margin + np.where(turn < 0, margin.max(initial=0) + 1, 0))
    order = order[_ascending(ray[order])]
    margin, ray, turn = (values[order] for values in (margin, ray, turn))
    radius, key = radius[order], key[order]
    number = np.bincount(ray, minlength=rays)
    first, slot = np.cumsum(number) - number, np.arange(number.max(initial=0))
    # One row a ray: it has few roots.
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
    """Stable order of small numbers."""
    return np.argsort(values.astype(np.min_scalar_type(values.max(initial=0))), kind="stable")


def _first_named(owner: Ints, at: Floats, label: Ints, margin: Ints, ray: Ints, radius: Floats, tie: Floats) -> Ints:
    """The first of the margins that end an interval at the same place, so that rounding does not choose the name."""
    best = label.copy()
    begin = np.searchsorted(ray, owner)
    end = np.searchsorted(ray, owner, side="right")
    for k in range(int(np.max(end - begin, initial=0))):
        at_k = np.minimum(begin + k, max(len(ray) - 1, 0))
        match = (begin + k < end) & (label >= 0)
        match[match] = np.abs(radius[at_k[match]] - at[match]) <= tie[owner[match]]
        best[match] = np.minimum(best[match], margin[at_k[match]])
    return best
