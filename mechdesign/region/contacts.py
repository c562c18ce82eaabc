"""Where a shape that grows about its centre touches the end of a region, and whether its outline lies inside.

Rays from the shape's centre end where the region does. Each end allows a scale, that at which the shape's outline
passes through it; the smallest of all is the scale that fits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.numerics.roots import AROUND, lowest_near, parabola
from mechdesign.region.panels import Panels
from mechdesign.region.rays import BATCH, Scanned, is_turn, trace
from mechdesign.region.shapes import RAYS, Shape

# Places of an outline in its final check.
CHECKED = 720
# Contacts of a shape: so many of the lowest local minima of the scale over the rays, and one at a hole between rays.
MINIMA = 6
CONTACTS = MINIMA + 1
# Scales over the lowest one are equal if they agree in so many decimals.
EVEN = 10
# Between directions scales count up to this factor above those of the two.
BEYOND = 1.3
# Contacts up to this factor above the lowest are refined, in so many looks, and in more for the final check.
LOW = 1.3
LOOKS = 3
MORE_LOOKS = 5
# Places of a look: evenly spread between the directions beside a contact, as parts of the way to them, and nearer and
# nearer to where a parabola is lowest. What takes time is the look, not the number of its places.
EVENLY = np.array([-0.7, -0.35, 0.35, 0.7])[:, None]
NEARER = np.array([0, 1e-4, -1e-4, 0.01, -0.01])[:, None]
# A hole that no ray meets is looked for from these places, given from the centre in half widths and half heights. Two
# parabolas lead from the place where a margin is lowest to the hole: their sampling distances, and the longest step, in
# sampling distances.
LATTICE = (np.linspace(-1.2, 1.2, 11) + 1j * np.linspace(-1.2, 1.2, 11)[:, None]).ravel()
PARABOLAS = (0.12, 0.006)
FARTHEST = 5.0
# Gaps of a ray shorter than this part of its reach are points where a leg has no length: squares of lengths are exact
# to rounding only.
POINT = 1e-7
# Margins below this part of the largest one are rounding.
ROUNDING = 1e-12
# Angle between the rays on either side of a hole (radians).
ABOUT_HOLE = 1e-3
# A contact is at a corner of the shape if its direction is this near to the corner's (radians).
AT_CORNER = 1e-7
# Angle between the two rays that show the direction of the boundary at a corner (radians).
BESIDE = 1e-6


class Contacts:
    """Where shapes, each scaled about its centre, touch the regions of some designs.

    `theta` and `scales`, shape (contacts, lanes), are the directions of the contacts and the scales that they allow
    (infinite where there are fewer), `scale`, shape (lanes,), is the smallest; negative where the centre lies outside.
    """

    def __init__(self, shape: Shape, panels: Panels, design: Ints) -> None:
        """Contacts of a shape for each of `design`, the lanes; its centre is of shape (lanes,)."""
        every = panels.designs
        centre: Complexes = np.asarray(shape.centre, dtype=complex)
        self._shape, self._centre = shape, centre
        self._designs: Scanned = replace(
            every, places=every.of(design), count=len(design), centres=centre, effort=BATCH
        )  # fmt: skip
        self._reach = np.abs(centre - every.about) + panels.reach[design]
        _, traced, inside = panels.through(design, centre)
        self._inside = np.bincount(traced.ray[inside], minlength=len(design)) > 0
        around, beside = _valleys(*self._spread(RAYS))
        around, beside = self._with_overlooked(around, beside)
        contact, lane = np.nonzero(np.isfinite(beside[1]) & (beside[1] <= LOW * beside[1].min(axis=0)))
        self.theta, self.scales = around[1], beside[1]
        lowest = self._lowest(around[:, contact, lane], beside[:, contact, lane], lane, LOOKS)
        self.theta[contact, lane], self.scales[contact, lane] = lowest
        least = self.scales.min(axis=0)
        # Where no ray meets the region it is farther than it is wide, or all find outside what another found inside.
        farther = np.where(self._inside, 0.0, 2 * self._reach / np.minimum(shape.width, shape.height))
        least = np.where(np.isfinite(least), least, farther)
        self.scale = np.where(self._inside, least, -least)

    def _spread(self, number: int) -> tuple[Floats, Floats]:
        """Directions to places spread along the outline, and the scales that they allow, (places, lanes)."""
        theta, lanes = self._shape.directions(number), len(self._centre)
        theta = np.broadcast_to(theta, (len(theta), lanes))
        lane = np.tile(np.arange(lanes), len(theta))
        return theta, self.at(lane, theta.ravel()).reshape(theta.shape)

    def _with_overlooked(self, theta: Floats, scales: Floats) -> tuple[Floats, Floats]:
        """Contacts, and one more where a margin is lowest in a hole between the rays."""
        shape, lanes = self._shape, np.arange(len(self._centre))
        scale, sizes = np.where(self._inside, scales[1].min(axis=0), 0.0), self._designs.of(lanes)

        def margins(part: Complexes) -> Floats:
            z: Complexes = self._centre + 0.5 * scale * (shape.width * part.real + 1j * shape.height * part.imag)
            return np.nan_to_num(self._designs.field.margins(z, sizes), nan=np.inf)

        values = margins(np.broadcast_to(LATTICE[:, None], (len(LATTICE), len(lanes))))
        rounding = ROUNDING * np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=1)
        part = LATTICE[values.argmin(axis=1)]
        margin = np.arange(len(part))[:, None]
        for step in PARABOLAS:
            # A parabola through the places around leads to the lowest: for squares of distances it is exact.
            around = part + step * AROUND[:, None, None]
            around_values = margins(around.reshape(-1, len(lanes))).reshape(len(values), *around.shape)
            (dx, dy), good, _ = lowest_near(around_values[margin, :, margin, lanes].transpose(2, 0, 1))
            way = dx + 1j * dy
            good &= np.abs(way) < FARTHEST
            part = part + step * np.where(good, way, 0.0)
        way = shape.width * part.real + 1j * shape.height * part.imag
        there = margins(part)[margin, margin, lanes] < -rounding
        nearest = np.where(there, shape.scale_at(way), np.inf)
        row = nearest.argmin(axis=0)
        lane = np.flatnonzero(np.isfinite(nearest[row, lanes]))
        more = np.zeros((3, 1, len(lanes))), np.full((3, 1, len(lanes)), np.inf)
        angles = np.angle(way[row, lanes])[lane] + ABOUT_HOLE * np.array([[-1], [0], [1]])
        more[0][:, 0, lane] = angles
        more[1][:, 0, lane] = self.at(np.tile(lane, 3), angles.ravel()).reshape(3, -1)
        return np.concatenate([theta, more[0]], axis=1), np.concatenate([scales, more[1]], axis=1)

    def _lowest(self, theta: Floats, scales: Floats, lane: Ints, looks: int) -> tuple[Floats, Floats]:
        """Directions and scales of contacts between three directions, the middle one the lowest, of each of `lane`."""
        for _ in range(looks):
            low, middle, high = theta
            _, _, vertex = parabola(theta, scales)
            vertex = np.where((vertex > low) & (vertex < high), vertex, middle)
            even = middle + EVENLY * np.where(EVENLY > 0, high - middle, middle - low)
            places = np.concatenate([even, vertex + NEARER * np.minimum(high - vertex, vertex - low)])
            most = np.tile(BEYOND * scales.max(axis=0), len(places))
            values = self.at(np.tile(lane, len(places)), places.ravel(), most).reshape(places.shape)
            places, values = np.concatenate([theta, places]), np.concatenate([scales, values])
            order = places.argsort(axis=0, kind="stable")
            places, values = np.take_along_axis(places, order, axis=0), np.take_along_axis(values, order, axis=0)
            best = values.argmin(axis=0).clip(1, len(values) - 2) + np.array([[-1], [0], [1]])
            theta, scales = np.take_along_axis(places, best, axis=0), np.take_along_axis(values, best, axis=0)
        return theta[1], scales[1]

    def checked(self) -> Floats:
        """The scale, or less where the outline lies outside between the rays that were traced so far."""
        scale = self.scale.copy()
        around, beside = _valleys(*self._spread(CHECKED))
        contact, lane = np.nonzero(self._inside & (beside[1] <= LOW * scale))
        np.minimum.at(
            scale, lane, self._lowest(around[:, contact, lane], beside[:, contact, lane], lane, MORE_LOOKS)[1]
        )
        return scale

    def at(self, lane: Ints, theta: Floats, most: Floats | float = np.inf) -> Floats:
        """Scales at which the outline passes through the ends of rays; from outside, where they enter the region.

        Seen from inside, scales above `most` are that.
        """
        radius = self._shape.of(lane).radius(theta)
        return self._radii(lane, theta, most * radius) / radius

    def _radii(self, lane: Ints, theta: Floats, most: Floats | float = np.inf) -> Floats:
        """Where rays leave or enter the region for the first time."""
        if not lane.size:
            return np.zeros(0)
        inside, reach, begin = self._inside[lane], self._reach[lane], np.zeros(len(lane))
        if not is_turn(self._designs.scan):
            begin, end = within_scan(self._designs, self._centre[lane], theta)
            reach = np.minimum(reach, end)
        # Nothing counts that lies beyond the scan, or farther away than asked for.
        reach = np.where(inside, np.minimum(reach, most), reach)
        traced = trace(self._designs, lane, theta, reach)
        ray, inner, outer, _, _ = traced.whole(POINT * reach[traced.ray[1:]])
        first = np.searchsorted(ray, np.arange(len(lane)))
        meets = np.append(ray, -1)[first] == np.arange(len(lane))
        inner, outer = (np.append(ends, np.inf)[np.where(meets, first, -1)] for ends in (inner, outer))
        inner = np.maximum(inner, begin)
        # A ray that begins in a piece that does not count has to leave that piece.
        enters = np.where(inner > 0, np.where(inner < outer, inner, np.inf), outer)
        return np.where(inside, np.where(inner > 0, 0.0, outer), enters)

    def slopes(self) -> Floats:
        """How the contacts' scales change with the shape, as `Shape.slopes`, shape (3, contacts, lanes)."""
        normal = self._shape.normal(self.theta)
        away = np.abs(self.theta[..., None] - self._shape.corners) % (2 * np.pi)
        at_corner = (np.minimum(away, 2 * np.pi - away) < AT_CORNER).any(axis=-1)
        contact, lane = np.nonzero(at_corner & np.isfinite(self.scales))
        theta = self.theta[contact, lane]
        beside = (theta + BESIDE * np.array([[-1], [1]])).ravel()
        low, high = (self._radii(np.tile(lane, 2), beside) * np.exp(1j * beside)).reshape(2, -1)
        size = np.abs(high - low)
        straight = np.isfinite(size) & (size > 0)
        normal[contact[straight], lane[straight]] = -1j * ((high - low) / size)[straight]
        return self._shape.slopes(normal)


def _valleys(theta: Floats, scales: Floats) -> tuple[Floats, Floats]:
    """Local minima of scales, given as (directions, lanes): each direction with its two neighbours, and their scales.

    Both are of shape (3, contacts, lanes); the scales are infinite where there are fewer.
    """
    # A side that touches a straight boundary all along is one contact.
    even = np.round(scales / scales.min(axis=0), EVEN)
    after = np.roll(even, -1, axis=0)
    rises = even < after
    # A circle that touches a circular boundary all around has one contact, too.
    rises[-1] |= even[-1] == after[-1]
    low = (even <= np.roll(even, 1, axis=0)) & rises & np.isfinite(even)
    row = np.argsort(np.where(low, scales, np.inf), axis=0, kind="stable")[:MINIMA]
    turn = np.concatenate([theta[-1:] - 2 * np.pi, theta, theta[:1] + 2 * np.pi])
    lanes = np.arange(scales.shape[1])
    beside = scales[(row + np.array([[[-1]], [[0]], [[1]]])) % len(theta), lanes]
    missing = ~np.take_along_axis(low, row, axis=0)
    return turn[row + np.arange(3)[:, None, None], lanes], np.where(missing, np.inf, beside)


def within_scan(designs: Scanned, z: Complexes, theta: Floats) -> tuple[Floats, Floats]:
    """Distances at which rays enter and leave a scan of less than a turn for the first time; infinite where never."""
    first, last = (np.exp(-1j * angle) for angle in designs.scan)
    way, step = np.broadcast_arrays(z - designs.about, np.exp(1j * theta))
    height = np.stack([(way * first).imag, -(way * last).imag])
    slope = np.stack([(step * first).imag, -(step * last).imag])
    crossing = -height / slope
    within = height >= 0
    begin = np.where(within, 0.0, np.where(slope > 0, crossing, np.inf))
    end = np.where(within & (slope < 0), crossing, np.inf)
    if designs.scan[1] - designs.scan[0] <= np.pi:
        return begin.max(axis=0), end.min(axis=0)
    # A scan of more than half a turn holds what lies on the inner side of either of its end rays.
    order = begin.argsort(axis=0)
    begin, end = np.take_along_axis(begin, order, axis=0), np.take_along_axis(end, order, axis=0)
    return begin[0], np.where(begin[1] <= end[0], end.max(axis=0), end[0])
