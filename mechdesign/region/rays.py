"""Intervals in which rays about a point run inside the region, bounded by roots of the margins.

The region is where all margins of a `Field` are positive. Along a ray each margin is solved on its own, not the
smallest of them. Two margins that cross zero close together (a cusp of the region) then bound a thin interval exactly,
however coarse the scan; and margins that are differences of squared distances are quadratic along the ray, so that
three samples give their roots.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import picked
from mechdesign.region.crossings import sign_changes
from mechdesign.region.field import Field, Places
from mechdesign.region.intervals import (
    NARROWEST,
    SAME_ROOT,
    Intervals,
    intervals_between,
    joined,
    of_modes,
    shortened,
)
from mechdesign.region.rules import cosine, spread

# Rays traced at once (measured: smaller blocks cost more in calls than they save in cache).
BLOCK = 8192
# Accuracy of roots along a ray, as a fraction of the radius.
ROUNDING = 1e-14
# A margin is quadratic if a parabola through three samples meets two more to this fraction of the largest.
QUADRATIC = 1e-13
# A leg shorter than this fraction of the mechanism's size, as the root of a margin, is rounding.
SHORTEST = 1e-7
# Least number of samples of an interval where expressions are limited, which may oscillate along a ray.
OF_EXPRESSIONS = 48
# Samples of an interval are even steps of an angle, and radii go with its cosine: margins that are square roots of the
# distance from an end are smooth in it. The first and the last sample are this part of the angle from the ends, 1e-10
# of the interval.
INSET = 6e-6
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
    bends : float
        How many times as far as a few rays tell margins may bend along the ends of the intervals between these rays.
    """

    rays: int
    samples: int
    cells: int
    bends: float


# For a single design, and for each of thousands, which is refined where the error estimate asks for it.
SINGLE = Effort(128, 16, 192, 4.0)
BATCH = Effort(16, 12, 24, 1.5)


def is_turn(scan: tuple[float, float]) -> bool:
    """Whether a scan is a full turn, but for rounding."""
    return scan[1] - scan[0] >= 2 * np.pi * (1 - 1e-12)


def ray_through(offset: Complexes, start: float) -> Floats:
    """Angles of the rays to places at an `offset` from the centre, in the turn that begins at the angle `start`."""
    return np.asarray(start + (np.angle(offset) - start) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class Scanned:
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

    @cached_property
    def members(self) -> tuple[Scanned, ...]:
        """The same designs in each mode of the field."""
        several = self.field.members if len(self.field.members) > 1 else ()
        return tuple(replace(self, field=member) for member in several) or (self,)

    @cached_property
    def in_any_assembly(self) -> Scanned:
        """The same designs without the margins of the assembly."""
        return replace(self, field=replace(self.field, same_assembly=False)) if self.field.same_assembly else self

    def of(self, index: Ints) -> Places:
        """Values of the designs `index`, in the shape of `index`."""
        return {name: np.asarray(value)[index] for name, value in self.places.items()}

    def starts(self, design: Ints) -> Complexes:
        """Where the rays of each of `design` start."""
        return np.full(design.shape, self.about) if self.centres is None else self.centres[design]

    def look(self, z: Complexes, design: Ints, *, assembly: bool = False) -> tuple[Flags, Floats, Floats]:
        """Whether places lie in the region of one mode, and margins there, shape (margins, places, designs).

        With `Field.away` of them. Without `assembly`, margins of the assembly are inf where other margins exclude a
        place.
        """
        field, places = self.field, self.of(design)
        complete = assembly or field.plan.iterative or not field.same_assembly
        margins, configuration = field.look(z, places, complete)
        inside, away = np.asarray((margins > 0).all(axis=0)), field.away(configuration, margins)
        if not complete:
            # Determinants cost as much as all other margins together: they are computed only where they decide.
            place, lane = np.nonzero(inside)
            all_margins = field.margins(z[place, lane], {name: picked(value, lane) for name, value in places.items()})
            inside[place, lane] = (all_margins > 0).all(axis=0)
            of_assembly = np.full((len(all_margins) - len(margins), *z.shape), np.inf)
            of_assembly[:, place, lane] = all_margins[len(margins) :]
            margins, away = np.concatenate([margins, of_assembly]), np.concatenate([away, np.zeros(of_assembly.shape)])
        return inside, margins, away

    def traced(self, design: Ints, theta: Floats, reach: Floats, slack: float) -> Intervals:
        """Intersect one block of rays with the region, as `trace` does.

        First with the margins that are quadratic along the rays; then, in what is left, with the others, as far as
        possible in the order in which links are placed. The intervals of a ray do not depend on the other rays of the
        block.
        """
        if len(self.members) > 1:
            modes = [mode.traced(design, theta, reach, slack) for mode in self.members]
            return of_modes(modes, len(self.members[0].field.labels), reach, slack)
        places, centre, direction = self.of(design), self.starts(design), np.exp(1j * theta)
        values = self.field.margins(centre + FIVE[:, None] * reach * direction, places, assembly=False)
        quadratic, (a, b, c) = _parabolas(values)
        if not quadratic.all():
            # Margins that are not quadratic are replaced by 1, which has no root.
            a, b, c = np.where(quadratic, a, 1.0), np.where(quadratic, b, 0.0), np.where(quadratic, c, 0.0)
        margin, ray, turn, x, start = _quadratic_roots(a, b, c)
        intervals = intervals_between(margin, ray, turn, x * reach[ray], start, reach, slack)
        intervals = replace(intervals, cut=np.zeros(len(theta), dtype=bool))
        others = np.ones((len(self.field.labels), len(theta)), dtype=bool)
        others[: len(quadratic)] = ~quadratic
        for rows in self.field.tiers:
            if others[rows].any():
                intervals = self._cut(intervals, rows, others[rows], design, theta, reach, slack)
        width = intervals.outer - intervals.inner
        if not slack:
            return intervals.kept(width > NARROWEST * reach[intervals.ray])
        # What rounding has closed is a tip only where no other margin is clearly negative.
        narrow = np.flatnonzero(width <= slack * reach[intervals.ray])
        lane, closed = intervals.ray[narrow], np.zeros(len(width), dtype=bool)
        z = centre[lane] + intervals.inner[narrow] * direction[lane]
        there = self.field.margins(z, {name: picked(value, lane) for name, value in places.items()}, assembly=False)
        closed[narrow] = (there < -np.sqrt(slack) * np.abs(values).max(axis=1)[:, lane]).any(axis=0)
        return intervals.kept(~closed)

    def _cut(
        self, intervals: Intervals, rows: Ints, counted: Flags, design: Ints, theta: Floats, reach: Floats, slack: float
    ) -> Intervals:
        """Intervals less the parts where one of the margins `rows`, where it is `counted`, is negative or unknown."""
        width = intervals.outer - intervals.inner
        sampled = np.flatnonzero(
            np.asarray(counted.any(axis=0))[intervals.ray] & (width > slack * reach[intervals.ray])
        )
        if not sampled.size:
            return intervals
        first, used = rows[0], counted.any(axis=1)
        rows, counted = rows[used], counted[used]
        owner, width = intervals.ray[sampled], width[sampled]
        inner, outer = intervals.inner[sampled], intervals.outer[sampled]
        local = self.of(design[owner])
        start, direction = self.starts(design[owner]), np.exp(1j * theta[owner])
        # Links turn as the square roots of the margins of legs that are solved already.
        legs = np.flatnonzero(self.field.singular[:first])
        assembly = bool(rows[-1] == len(self.field.labels) - 1)
        expressions = any(bound.coordinate.kind == "expression" for bound in self.field.mechanism.bounds)

        def radius_at(lane: Ints, part: Floats) -> Floats:
            return spread(inner[lane], outer[lane], np.clip(part, INSET, 1 - INSET), cosine)[0]

        def look(lane: Ints, part: Floats) -> tuple[Floats, Floats, Complexes]:
            z = start[lane] + radius_at(lane, part) * direction[lane]
            of_lanes = {name: picked(value, lane) for name, value in local.items()}
            values, away, rotations = self.field.sampled(z, of_lanes, assembly=assembly)
            lengths = np.sqrt(np.fmax(values[legs], np.finfo(float).tiny))
            values, away = values[rows], np.concatenate([away[rows], np.zeros(lengths.shape)])
            # Margins whose roots bound the intervals already have none.
            margin, column = np.nonzero(~counted[:, owner[lane]])
            values[margin, ..., column] = 1.0
            return np.concatenate([values, lengths]), away, rotations

        margin, lane, turn, part, negative, (doubtful, ends) = sign_changes(
            look, len(sampled), max(self.effort.samples, OF_EXPRESSIONS if expressions else 0),
            ROUNDING * outer / width, SAME_ROOT * reach[owner] / width,
            np.append(self.field.rounding[rows], np.full(len(legs), SHORTEST * self.field.mechanism.size)),
            np.arange(len(rows) + len(legs)) >= len(rows),
        )  # fmt: skip
        less = np.flatnonzero((negative > 0) | (np.bincount(lane, minlength=len(sampled)) > 0))
        if not (less.size or doubtful.size):
            return intervals
        remaining = intervals_between(
            rows[margin], np.searchsorted(less, lane), turn, radius_at(lane, part), negative[less], outer[less], slack
        )
        near, far = radius_at(doubtful, ends)
        doubt = np.bincount(owner[doubtful], 0.5 * (far - near) * (far + near), len(theta))
        intervals = replace(intervals, doubt=intervals.doubt + doubt)
        return shortened(intervals, sampled[less], remaining, NARROWEST * reach)


def trace(designs: Scanned, design: Ints, theta: Floats, reach: Floats, slack: float = 0.0) -> Intervals:
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


def _parabolas(values: Floats) -> tuple[Flags, tuple[Floats, Floats, Floats]]:
    """Which margins are quadratic on each ray, and coefficients of a + b x + c x^2 through x = 0, 1/2 and 1.

    `values` are samples at x = 0, 1/4, 1/2, 3/4 and 1, shape (margins, 5, rays). Those at 1/4 and 3/4 show which
    margins are quadratic along a ray, as differences of squared distances are.
    """
    at_0, at_1, at_2, at_3, at_4 = (values[:, k] for k in range(5))
    a, b, c = at_0, 4 * at_2 - 3 * at_0 - at_4, 2 * (at_0 + at_4) - 4 * at_2
    allowed = QUADRATIC * np.abs(values).max(axis=1)
    fits = np.abs(a + 0.25 * (b + 0.25 * c) - at_1) <= allowed
    fits &= np.abs(a + 0.75 * (b + 0.75 * c) - at_3) <= allowed
    return fits, (a, b, c)


def _quadratic_roots(a: Floats, b: Floats, c: Floats) -> tuple[Ints, Ints, Ints, Floats, Ints]:
    """Margin, ray, direction (1 rising) and x of all roots in (0, 1); and how many margins of a ray begin negative."""
    roots = np.empty((2, *a.shape))
    half = -0.5 * (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
    np.divide(half, c, out=roots[0])
    np.divide(a, half, out=roots[1])
    margin_of = (roots > SAME_ROOT) & (roots < 1)
    which, margin, ray = np.nonzero(margin_of)
    # The slope at the first of the two roots has the sign of -b, at the other that of b, even where they coincide.
    rising = np.signbit(b[margin, ray]) == (which == 0)
    x, start = roots[which, margin, ray], (a + SAME_ROOT * (b + SAME_ROOT * c) <= 0).sum(axis=0)
    return margin, ray, np.where(rising, 1, -1), x, start
