"""How large a circle or a rectangle may be for a region to hold it, about a given centre or anywhere.

Rays from the shape's centre end where the region does. Each end allows a scale, that at which the shape's outline
passes through it; the smallest of all is the scale that fits. A free centre is moved to where the smallest is largest:
what limits the scale there, the contacts, gives the way.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.numerics.roots import dips, lowest
from mechdesign.region.panels import Panels
from mechdesign.region.rays import SAME_ROOT, Designs, is_turn, trace
from mechdesign.region.rules import cubic, spread

# Rays from a shape's centre to places spread along its outline; a side of a rectangle has `SIDE_RAYS` or more.
RAYS = 120
SIDE_RAYS = 6
# The final check of an outline: its places, and the places between the centre and one of them.
CHECKED = 720
CHECKED_ALONG = 101
# The checked outline is smaller by this part, so that one that just touches the boundary passes.
TOUCHING = 1e-7
# Rounds of the check: an outline that lies outside shrinks and is checked again.
LOOKS = 4
# Contacts are the lowest local minima of the scales that rays allow: so many at most.
CONTACTS = 6
# Contacts within this factor of the lowest are found exactly, in so many steps.
LOW = 1.3
STEPS = 8
# A hole that no ray meets is looked for from these places, given from the centre in half widths and half heights. Two
# parabolas lead from the place where a margin is lowest to the hole: their sampling distances, the samples around the
# place, and the longest step, in sampling distances.
LATTICE = (np.linspace(-1.2, 1.2, 11) + 1j * np.linspace(-1.2, 1.2, 11)[:, None]).ravel()
PARABOLAS = (0.12, 0.006)
AROUND = np.array([0, 1, -1, 1j, -1j, 1 + 1j])
FARTHEST = 5.0
# Margins below this part of the largest one are rounding.
ROUNDING = 1e-12
# Angle between the rays on either side of a hole (radians).
ABOUT_HOLE = 1e-3
# A contact is at a corner of the shape if its direction is this near to the corner's (radians).
AT_CORNER = 1e-7
# Angle between the two rays that show the direction of the boundary at a corner (radians).
BESIDE = 1e-6
# A free centre starts at the best places on rays about the scan's centre: rays of a full turn, least rays of a panel.
TURN_RAYS = 96
PANEL_RAYS = 7
# Places on each interval of these rays, as parts of it; and the number of places that centres start from.
FRACTIONS = np.array([0.08, 0.25, 0.5, 0.75, 0.92])
TRIALS = 2
# Most moves of a centre.
MOVES = 24
# Longest first move, as a part of the largest shape that fits; no move is shorter than `LAST_MOVE` of the shape.
FIRST_MOVE = 0.3
LAST_MOVE = 1e-6
# A move is not made for a gain of the scale below this part of it.
LEAST_GAIN = 1e-7


@dataclass(frozen=True)
class Shape:
    """A circle, or a rectangle with sides along x and y; `centre` is None where it may lie anywhere.

    Numbers are the same for all designs, or of shape (designs,).
    """

    width: Number
    height: Number
    round: bool
    centre: complex | Complexes | None = None

    def of(self, design: Ints | int) -> Shape:
        """The shapes of some designs."""

        def some(value: Any) -> Any:
            return value[design] if isinstance(value, np.ndarray) and value.ndim else value

        return Shape(some(self.width), some(self.height), self.round, some(self.centre))

    def directions(self, number: int = RAYS) -> Floats:
        """Directions from the centre to places spread along the outline (radians in [0, 2 pi), ascending).

        Of shape (places, designs), or (places, 1) where they are the same for all designs.
        """
        if self.round:
            return (2 * np.pi * np.arange(number) / number)[:, None]
        width, height = np.broadcast_arrays(np.atleast_1d(self.width), np.atleast_1d(self.height))
        long = float(np.median(width / (width + height)))
        x, y = (np.linspace(-side / 2, side / 2, max(SIDE_RAYS, round(0.5 * number * share)) + 1)
                for side, share in ((width, long), (height, 1 - long)))  # fmt: skip
        around = np.concatenate([x[:-1] + 1j * y[0], x[1:] + 1j * y[-1], x[0] + 1j * y[1:], x[-1] + 1j * y[:-1]])
        return np.sort(np.angle(around) % (2 * np.pi), axis=0)

    @property
    def corners(self) -> Floats:
        """Directions of the corners from the centre (radians, in [0, 2 pi)), shape (..., corners)."""
        corner = np.arctan2(self.height, self.width)
        angles = [] if self.round else [corner, np.pi - corner, np.pi + corner, 2 * np.pi - corner]
        return np.stack(np.broadcast_arrays(*angles), axis=-1) if angles else np.array([])

    def radius(self, theta: Floats) -> Floats:
        """Distance of the outline from the centre."""
        if self.round:
            return np.broadcast_to(np.asarray(self.width) / 2, np.broadcast_shapes(theta.shape, np.shape(self.width)))
        with np.errstate(divide="ignore"):
            return 0.5 * np.minimum(self.width / np.abs(np.cos(theta)), self.height / np.abs(np.sin(theta)))

    def scale_at(self, way: Complexes) -> Floats:
        """Scale at which the outline passes through a place, seen from the centre."""
        return np.asarray(np.abs(way) / self.radius(np.angle(way)))

    def slope(self, theta: Floats) -> Complexes:
        """How the scale at which the outline passes through a place in a direction grows with x and y of the place."""
        if self.round:
            return np.asarray(np.exp(1j * theta) / (self.width / 2))
        x, y = np.cos(theta) / self.width, np.sin(theta) / self.height
        return np.where(np.abs(x) > np.abs(y), 2 * np.sign(x) / self.width, 2j * np.sign(y) / self.height)

    def slope_by(self, normal: Complexes) -> Complexes:
        """The same where a straight boundary with this unit normal is met by a corner."""
        extent = 0.5 * (self.width * np.abs(normal.real) + self.height * np.abs(normal.imag))
        return normal / extent


def fitting_scale(shape: Shape, panels: Panels) -> tuple[Floats, Complexes]:
    """The largest factor by which a shape may be scaled and still lie in the region, and its centre then.

    Both are of shape (designs,). The factor is 1 or more where the region holds the shape. Negative values say how far
    the centre lies outside: the shape, scaled so, would just touch the region. It is nan where the region is empty.

    It is judged on rays from the centre through 120 places of the outline, at the lowest place of every margin and, in
    the end, at 720 places of the outline. One of several holes that lies between two rays may be overlooked, and a
    notch that ends between two of those places.
    """
    some, count = np.flatnonzero(panels.closes), len(panels.closes)
    scales = np.full(count, np.nan)
    centres = np.full(count, complex(np.nan, np.nan) if shape.centre is None else shape.centre)
    if not some.size:
        return scales, centres
    if shape.centre is not None:
        scales[some] = _View(shape.of(some), panels, some, centres[some]).checked()
        return scales, centres
    lane, centre = _beginnings(shape, panels, some)
    centre, scale = _largest(shape, panels, lane, centre)
    # Of several values of one design the last assigned is the largest.
    order = np.argsort(scale, kind="stable")
    centres[lane[order]] = centre[order]
    some = np.unique(lane)
    scales[some] = _View(shape.of(some), panels, some, centres[some]).checked()
    return scales, centres


class _View:
    """The region of some designs, each seen from a centre: contacts of the shape scaled about it.

    `theta` and `scales`, shape (contacts, lanes), are their directions and the scales that they allow (infinite where
    there are fewer), `scale`, shape (lanes,), is the smallest; negative where the centre lies outside.
    """

    def __init__(self, shape: Shape, panels: Panels, design: Ints, centre: Complexes) -> None:
        every = panels.designs
        self._shape, self._centre = shape, centre
        self._designs: Designs = replace(every, places=every.of(design), count=len(design), centres=centre)
        self._reach = np.abs(centre - every.about) + panels.reach[design]
        _, traced, inside = panels.through(design, centre)
        self._inside = np.bincount(traced.ray[inside], minlength=len(design)) > 0
        around, beside = _valleys(*self._spread(RAYS))
        around, beside = self._with_overlooked(around, beside)
        contact, lane = np.nonzero(np.isfinite(beside[1]) & (beside[1] <= LOW * beside[1].min(axis=0)))
        self.theta, self.scales = around[1], beside[1]
        place, value = dips(
            lambda which, x: self.at(lane[which], x), around[:, contact, lane], beside[:, contact, lane],
            np.full(len(lane), -np.inf), STEPS,
        )  # fmt: skip
        self.theta[contact, lane], self.scales[contact, lane] = place, value
        least = self.scales.min(axis=0)
        # Where no ray meets the region it is farther than it is wide.
        least = np.where(np.isfinite(least), least, 2 * self._reach / np.minimum(shape.width, shape.height))
        self.scale = np.where(self._inside, least, -least)

    def _spread(self, number: int) -> tuple[Floats, Floats]:
        """Directions to places spread along the outline, and the scales that they allow, (places, lanes)."""
        theta, lanes = self._shape.directions(number), len(self._centre)
        theta = np.broadcast_to(theta, (len(theta), lanes))
        lane = np.tile(np.arange(lanes), len(theta))
        return theta, self.at(lane, theta.ravel()).reshape(theta.shape)

    def _with_overlooked(self, theta: Floats, scales: Floats) -> tuple[Floats, Floats]:
        """Contacts with one more where the lowest place of a margin is a hole between the rays."""
        shape, lanes = self._shape, np.arange(len(self._centre))
        scale, sizes = np.where(self._inside, scales[1].min(axis=0), 0.0), self._designs.of(lanes)

        def margins(part: Complexes) -> Floats:
            z = self._centre + 0.5 * scale * (shape.width * part.real + 1j * shape.height * part.imag)
            return np.nan_to_num(self._designs.field.margins(z, sizes), nan=np.inf)

        values = margins(np.broadcast_to(LATTICE[:, None], (len(LATTICE), len(lanes))))
        rounding = ROUNDING * np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=1)
        part = LATTICE[values.argmin(axis=1)]
        margin = np.arange(len(part))[:, None]
        for step in PARABOLAS:
            # A parabola through the places around leads to the lowest: for squares of distances it is exact.
            around = part + step * AROUND[:, None, None]
            around_values = margins(around.reshape(-1, len(lanes))).reshape(len(values), *around.shape)
            here, right, left, up, down, across = around_values[margin, :, margin, lanes].transpose(2, 0, 1)
            with np.errstate(invalid="ignore", divide="ignore"):
                gx, gy = 0.5 * (right - left), 0.5 * (up - down)
                xx, yy, xy = right + left - 2 * here, up + down - 2 * here, across + here - right - up
                det = xx * yy - xy * xy
                way = (gy * xy - gx * yy) / det + 1j * (gx * xy - gy * xx) / det
                good = (xx > 0) & (det > 0) & (np.abs(way) < FARTHEST)
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

    def checked(self) -> Floats:
        """The scale, or less where the outline lies outside between the rays that were traced so far."""
        scale, lanes = self.scale.copy(), np.arange(len(self._centre))
        theta, scales = self._spread(CHECKED)
        around, beside = _valleys(theta, scales)
        # Of a notch with a corner the lowest place is found by sections, not by parabolas.
        contact, lane = np.nonzero(self._inside & (beside[1] <= LOW * scale))
        lowest_scale = lowest(lambda x: self.at(lane, x), around[0, contact, lane], around[2, contact, lane])[1]
        np.minimum.at(scale, lane, np.minimum(lowest_scale, beside[1, contact, lane]))
        for _ in range(LOOKS):
            outline = (1 - TOUCHING) * scale * self._shape.radius(theta) * np.exp(1j * theta)
            place, lane = np.nonzero(self._inside & ~self._designs.inside(self._centre + outline, lanes))
            if not lane.size:
                break
            lowest_scale = self.at(lane, theta[place, lane])
            # Where a ray leaves the region and comes back between two of its samples, places along it tell.
            passed = np.flatnonzero(lowest_scale >= scale[lane])
            along = np.linspace(0, 1, CHECKED_ALONG)[:, None] * outline[place, lane][passed]
            first = self._designs.inside(self._centre[lane[passed]] + along, lane[passed]).argmin(axis=0)
            lowest_scale[passed] = scale[lane[passed]] * np.maximum(first - 1, 0) / (CHECKED_ALONG - 1)
            # A smaller outline may pass through what the larger one had left behind.
            np.minimum.at(scale, lane, lowest_scale)
        return scale

    def at(self, lane: Ints, theta: Floats) -> Floats:
        """Scales at which the outline passes through the ends of rays; from outside, where they enter the region."""
        return self._radii(lane, theta) / self._shape.of(lane).radius(theta)

    def _radii(self, lane: Ints, theta: Floats) -> Floats:
        if not lane.size:
            return np.zeros(0)
        reach = self._reach[lane]
        traced = trace(self._designs, lane, theta, reach)
        ray, inner, outer, _, _ = traced.whole(SAME_ROOT * reach[traced.ray[1:]])
        first = np.searchsorted(ray, np.arange(len(lane)))
        meets = np.append(ray, -1)[first] == np.arange(len(lane))
        inner, outer = (np.append(ends, np.inf)[np.where(meets, first, -1)] for ends in (inner, outer))
        if not is_turn(self._designs.scan):
            begin, end = _within_scan(self._designs, self._centre[lane], theta)
            inner, outer = np.maximum(inner, begin), np.minimum(outer, end)
        # From a piece that does not count the way out of it is meant.
        enters = np.where(inner > 0, np.where(inner < outer, inner, np.inf), outer)
        return np.where(self._inside[lane], np.where(inner > 0, 0.0, outer), enters)

    def slopes(self) -> Complexes:
        """Slopes of the contacts' scales by x and y of the centre, shape (contacts, lanes)."""
        slopes = -self._shape.slope(self.theta)
        away = np.abs(self.theta[..., None] - self._shape.corners) % (2 * np.pi)
        at_corner = (np.minimum(away, 2 * np.pi - away) < AT_CORNER).any(axis=-1)
        contact, lane = np.nonzero(at_corner & np.isfinite(self.scales))
        theta = self.theta[contact, lane]
        low, high = (self._radii(lane, theta + k * BESIDE) * np.exp(1j * (theta + k * BESIDE)) for k in (-1, 1))
        normal = -1j * (high - low)
        size = np.abs(normal)
        known = np.isfinite(size) & (size > 0)
        slope = -self._shape.of(lane).slope_by(np.where(known, normal / np.where(known, size, 1.0), 1.0 + 0.0j))
        slopes[contact[known], lane[known]] = slope[known]
        return slopes


def _valleys(theta: Floats, scales: Floats) -> tuple[Floats, Floats]:
    """Where scales are least around: directions with the two beside each, and the scales, given as (directions, lanes).

    Both are of shape (3, contacts, lanes); the scales are infinite where there are fewer.
    """
    low = (scales <= np.roll(scales, 1, axis=0)) & (scales <= np.roll(scales, -1, axis=0)) & np.isfinite(scales)
    row = np.argsort(np.where(low, scales, np.inf), axis=0, kind="stable")[:CONTACTS]
    turn = np.concatenate([theta[-1:] - 2 * np.pi, theta, theta[:1] + 2 * np.pi])
    lanes = np.arange(scales.shape[1])
    beside = scales[(row + np.array([[[-1]], [[0]], [[1]]])) % len(theta), lanes]
    missing = ~np.take_along_axis(low, row, axis=0)
    return turn[row + np.arange(3)[:, None, None], lanes], np.where(missing, np.inf, beside)


def _within_scan(designs: Designs, z: Complexes, theta: Floats) -> tuple[Floats, Floats]:
    """Distances at which rays enter and leave a scan of less than a turn for the first time; infinite where never."""
    first, last = (np.exp(-1j * angle) for angle in designs.scan)
    way, step = np.broadcast_arrays(z - designs.about, np.exp(1j * theta))
    height = np.stack([(way * first).imag, -(way * last).imag])
    slope = np.stack([(step * first).imag, -(step * last).imag])
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -height / slope
    within = height >= 0
    begin = np.where(within, 0.0, np.where(slope > 0, crossing, np.inf))
    end = np.where(within & (slope < 0), crossing, np.inf)
    if designs.scan[1] - designs.scan[0] <= np.pi:
        return begin.max(axis=0), end.min(axis=0)
    # Beyond half a turn the scan is what lies on the inner side of either.
    order = begin.argsort(axis=0)
    begin, end = np.take_along_axis(begin, order, axis=0), np.take_along_axis(end, order, axis=0)
    return begin[0], np.where(begin[1] <= end[0], end.max(axis=0), end[0])


def _beginnings(shape: Shape, panels: Panels, some: Ints) -> tuple[Ints, Complexes]:
    """Designs and centres with the most room around them, as far as rays about the centre of the scan tell."""
    designs, about = panels.designs, panels.designs.about
    number = np.maximum(PANEL_RAYS, np.ceil(TURN_RAYS * (panels.high - panels.low) / (2 * np.pi))).astype(np.intp)
    panel = np.repeat(np.arange(len(number)), number)
    part = (np.arange(len(panel)) - np.repeat(np.cumsum(number) - number, number) + 0.5) / number[panel]
    theta, design = spread(panels.low[panel], panels.high[panel], part, cubic)[0], panels.design[panel]
    traced = panels.trace(design, theta)
    ray, inner, outer, enters, _ = traced.whole(SAME_ROOT * panels.reach[design[traced.ray[1:]]])
    way, owner = np.exp(1j * theta[ray]), design[ray]
    ends = about + np.stack([np.where(enters >= 0, inner, outer), outer]) * way
    within = about + (inner + FRACTIONS[:, None] * (outer - inner)) * way
    lanes, centres = [], []
    for k in some.tolist():
        own = shape.of(k)
        mine = slice(*np.searchsorted(owner, [k, k + 1]))
        z = within[:, mine].ravel()
        room = own.scale_at(ends[:, mine].ravel() - z[:, None]).min(axis=1, initial=np.inf)
        if not is_turn(designs.scan):
            around = own.directions()[:, 0]
            _, end = _within_scan(designs, z[:, None], around)
            room = np.minimum(room, (end / own.radius(around)).min(axis=1))
        for _ in range(TRIALS if room.size else 0):
            best = int(room.argmax())
            lanes.append(k)
            centres.append(z[best])
            room[own.scale_at(z - z[best]) <= room[best]] = -1.0
            if room.max() <= 0:
                break
    return np.array(lanes, dtype=np.intp), np.array(centres)


def _largest(shape: Shape, panels: Panels, lane: Ints, centre: Complexes) -> tuple[Complexes, Floats]:
    """Centres moved to where the scale that fits is largest, and that scale."""
    view = _View(shape.of(lane), panels, lane, centre)
    scale, centre = view.scale.copy(), centre.copy()
    slopes, contacts = view.slopes(), view.scales.copy()
    move = FIRST_MOVE * np.maximum(scale, 0.1) * np.minimum(shape.of(lane).width, shape.of(lane).height)
    size = np.broadcast_to(np.hypot(shape.of(lane).width, shape.of(lane).height), lane.shape)
    left = np.arange(len(lane))
    for _ in range(MOVES):
        step, hoped = _step(contacts[:, left], slopes[:, left], move[left])
        hoped -= scale[left]
        worth = (hoped > LEAST_GAIN * np.abs(scale[left])) & (move[left] > LAST_MOVE * size[left] * np.abs(scale[left]))
        left, step, hoped = left[worth], step[worth], hoped[worth]
        if not left.size:
            break
        view = _View(shape.of(lane[left]), panels, lane[left], centre[left] + step)
        gain = view.scale - scale[left]
        better = gain > 0
        move[left] *= np.where(gain > 0.75 * hoped, 2.0, np.where(better, 1.0, 0.25))
        kept = left[better]
        scale[kept], centre[kept] = view.scale[better], (centre[left] + step)[better]
        contacts[:, kept], slopes[:, kept] = view.scales[:, better], view.slopes()[:, better]
    return centre, scale


def _step(scales: Floats, slopes: Complexes, move: Floats) -> tuple[Complexes, Floats]:
    """The move of each lane, at most `move` along x and y, after which the smallest scale is largest, and that scale.

    The scales change straight with their slopes, both of shape (contacts, lanes). The largest is at a corner of these
    planes and the sides of what is allowed: all are tried.
    """
    known = np.isfinite(scales)
    none = np.zeros((4, len(move)))
    # Of each plane: x and y and value on one side, a constant on the other.
    x = np.concatenate([np.where(known, -slopes.real, 0.0), none + np.array([[1], [-1], [0], [0]])])
    y = np.concatenate([np.where(known, -slopes.imag, 0.0), none + np.array([[0], [0], [1], [-1]])])
    t = np.concatenate([np.where(known, 1.0, 0.0), none])
    b = np.concatenate([np.where(known, scales, 0.0), none + move])
    i, j, k = np.array(list(itertools.combinations(range(len(b)), 3))).T
    det = _determinant(x, y, t, i, j, k)
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = _determinant(b, y, t, i, j, k) / det, _determinant(x, b, t, i, j, k) / det
    good = np.isfinite(dx) & np.isfinite(dy) & (np.maximum(np.abs(dx), np.abs(dy)) <= move * (1 + 1e-9))
    dx, dy = np.where(good, dx, 0.0), np.where(good, dy, 0.0)
    value = np.where(known, scales, np.inf)[:, None] + (slopes.real[:, None] * dx + slopes.imag[:, None] * dy)
    least = np.where(known[:, None], value, np.inf).min(axis=0)
    best, lane = least.argmax(axis=0), np.arange(len(move))
    return dx[best, lane] + 1j * dy[best, lane], least[best, lane]


def _determinant(a: Floats, b: Floats, c: Floats, i: Ints, j: Ints, k: Ints) -> Floats:
    """Determinants of rows i, j, k of three columns."""
    return np.asarray(
        a[i] * (b[j] * c[k] - b[k] * c[j]) - a[j] * (b[i] * c[k] - b[k] * c[i]) + a[k] * (b[i] * c[j] - b[j] * c[i])
    )
