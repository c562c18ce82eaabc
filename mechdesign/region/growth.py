"""The largest circle or rectangle in a region: the shape grows until the boundary of the region stops it.

A free centre, and the sides of a rectangle that stretches, change until the scale that fits is largest. The contacts,
which limit the scale, show the way: a step goes to where the lowest of their planes, less the curvature that the steps
before have met, is highest. This is sequential quadratic programming with a damped step, for many designs at once.
"""

from __future__ import annotations

import itertools

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.region.contacts import CONTACTS, Contacts, within_scan
from mechdesign.region.intervals import SAME_ROOT
from mechdesign.region.panels import Panels
from mechdesign.region.rays import is_turn
from mechdesign.region.rules import cubic, spread
from mechdesign.region.shapes import Shape

# Rays about the scan's centre on which a free centre starts: number in a full turn, and least number in a panel.
TURN_RAYS = 96
PANEL_RAYS = 7
# Places on each interval of these rays, as parts of it; and the number of places that centres start from.
FRACTIONS = np.array([0.08, 0.25, 0.5, 0.75, 0.92])
TRIALS = 2
# Distances from places to ends of intervals that are compared for one design. Where there are more, the places with the
# most room on their own interval are.
MOST_DISTANCES = 2_000_000
# First stretches (see `Shape.placed`) of a rectangle of free proportions.
STRETCHES = (-0.7, 0.0, 0.7)
# Most steps of a shape.
STEPS = 40
# Damping of the first step: a plane that rises by the scale over the shape's size allows a step of 1/damping of the
# size. It is multiplied by these after a step without gain, and after one with nearly the gain hoped for.
DAMPING, SHORTER, LONGER = 4.0, 4.0, 0.25
LEAST_DAMPING = 1e-6
# Slopes show a curvature where their change has this part of itself along the step.
ALONG = 1e-3
# A step is not made if it gains less than this part of the scale.
LEAST_GAIN = 1e-14
# A start is given up if so many times its predicted gain would not reach the best start of the same design.
LEAD = 3.0
# Or if a larger shape of the same design is so near, in sizes and stretches: both grow to the same largest one.
NEAR = 0.01
# Logarithm of the scale of a missing contact.
MISSING = 1e3
# Sets of contacts that may stop a shape together, one a row: at most one contact more than there are free parameters.
SETS = np.array([members for members in itertools.product([False, True], repeat=CONTACTS) if 1 <= sum(members) <= 4])
# Regularisation, as a part of the largest coefficient, of equations whose contacts have dependent slopes.
RIDGE = 1e-13


def fitted(shape: Shape, panels: Panels) -> tuple[Floats, Shape]:
    """The largest factor by which a shape may be scaled and still lie in the region, shape (designs,), and the shape.

    What is free in the shape is then given, of shape (designs,). The factor is 1 or more where the region holds the
    shape. Negative values say how far the centre lies outside: the shape, scaled so, would just touch the region. It is
    nan where the region is empty.

    It is judged on rays from the centre through 120 places of the outline, at the lowest place of every margin and, in
    the end, at 720 places of the outline. One of several holes that lies between two rays may be overlooked, and a
    notch that ends between two of those places.
    """
    some, count = np.flatnonzero(panels.closes), len(panels.closes)
    scales, stretch = np.full(count, np.nan), np.zeros(count)
    centre = np.full(count, complex(np.nan, np.nan) if shape.centre is None else shape.centre)
    if shape.centre is None and some.size:
        lane, at, by, reached = _largest(shape, panels, *_beginnings(shape, panels, some))
        # Of several values of one design the last assigned is the largest.
        order = np.argsort(reached, kind="stable")
        centre[lane[order]], stretch[lane[order]] = at[order], by[order]
        some = np.unique(lane)
    placed = shape.placed(centre, stretch)
    if some.size:
        scales[some] = Contacts(placed.of(some), panels, some).checked()
    return scales, placed


def _beginnings(shape: Shape, panels: Panels, some: Ints) -> tuple[Ints, Complexes, Floats]:
    """Designs, centres and stretches with the most room, as far as rays about the centre of the scan tell."""
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
    lanes, centres, stretches = [], [], []
    for k, stretch in itertools.product(some.tolist(), STRETCHES if shape.stretches else (0.0,)):
        own = shape.of(k).placed(0j, stretch)
        mine = slice(*np.searchsorted(owner, [k, k + 1]))
        z = within[:, mine].ravel()
        most = MOST_DISTANCES // max(ends[:, mine].size, 1)
        if z.size > most:
            least = own.scale_at(ends[:, None, mine] - within[:, mine]).min(axis=0).ravel()
            z = z[np.sort(np.argsort(-least, kind="stable")[:most])]
        room = own.scale_at(ends[:, mine].ravel() - z[:, None]).min(axis=1, initial=np.inf)
        if not is_turn(designs.scan):
            around = own.directions()[:, 0]
            _, end = within_scan(designs, z[:, None], around)
            room = np.minimum(room, (end / own.radius(around)).min(axis=1))
        for _ in range(TRIALS if room.size else 0):
            best = int(room.argmax())
            lanes.append(k)
            centres.append(z[best])
            stretches.append(stretch)
            room[own.scale_at(z - z[best]) <= room[best]] = -1.0
            if room.max() <= 0:
                break
    return np.array(lanes, dtype=np.intp), np.array(centres), np.array(stretches)


def _largest(
    shape: Shape, panels: Panels, lane: Ints, centre: Complexes, stretch: Floats
) -> tuple[Ints, Complexes, Floats, Floats]:
    """The designs `lane`, the centres and stretches at which the scale that fits is largest, and that scale."""

    def look(rows: Ints, centre: Complexes, stretch: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """The scale; of the contacts the angles, the logarithms of scales, and their slopes by a step, in `size`."""
        contacts = Contacts(shape.of(lane[rows]).placed(centre, stretch), panels, lane[rows])
        there = np.isfinite(contacts.scales)
        slopes = np.where(there, contacts.slopes(), 0.0)
        slopes[:2] *= size[rows] / np.where(there, np.maximum(contacts.scales, least), 1.0)
        slopes[2] *= shape.stretches
        heights = np.where(there, np.log(np.maximum(contacts.scales, least)), MISSING)
        return contacts.scale, contacts.theta.T, heights.T, slopes.transpose(2, 1, 0)

    every, least = np.arange(len(lane)), np.finfo(float).tiny
    size = np.broadcast_to(0.5 * (shape.of(lane).width + shape.of(lane).height), lane.shape).astype(float)
    scale, theta, heights, slopes = look(every, centre, stretch)
    size, slopes[..., :2] = size * scale, slopes[..., :2] * scale[:, None, None]
    curvature, damping = np.zeros((len(lane), 3, 3)), np.full(len(lane), DAMPING)
    # Rays of another centre may leave undecided, or find outside, what those of the scan find inside.
    left = np.flatnonzero(scale > 0)
    for _ in range(STEPS if left.size else 0):
        step, hoped, shares = _step(heights[left], slopes[left], curvature[left], damping[left])
        best = np.zeros(len(panels.closes))
        np.maximum.at(best, lane, scale)
        worth = (hoped > LEAST_GAIN) & (LEAD * hoped >= np.log(best[lane[left]] / scale[left]))
        worth &= ~_behind(lane, scale, centre / size, stretch)[left]
        left, step, hoped, shares = left[worth], step[worth], hoped[worth], shares[worth]
        if not left.size:
            break
        to, by = centre[left] + size[left] * (step[:, 0] + 1j * step[:, 1]), stretch[left] + step[:, 2]
        now = look(left, to, by)
        gain = np.log(np.maximum(now[0], least) / scale[left])
        better = gain > 0
        damping[left] *= np.where(gain > 0.75 * hoped, LONGER, np.where(better, 1.0, SHORTER))
        damping[left] = np.maximum(damping[left], LEAST_DAMPING)
        kept = left[better]
        new_scale, new_theta, new_heights, new_slopes = (values[better] for values in now)
        curvature[kept] = _bent(
            curvature[kept], step[better], shares[better], theta[kept], slopes[kept], new_theta, new_slopes
        )
        centre[kept], stretch[kept] = to[better], by[better]
        scale[kept], theta[kept], heights[kept], slopes[kept] = new_scale, new_theta, new_heights, new_slopes
    return lane, centre, stretch, scale


def _behind(lane: Ints, scale: Floats, centre: Complexes, stretch: Floats) -> Flags:
    """Which shapes have a larger one of the same of the designs `lane` near; of equal ones the first is the larger."""
    near = (lane[:, None] == lane) & (np.abs(centre[:, None] - centre) < NEAR)
    near &= np.abs(stretch[:, None] - stretch) < NEAR
    place = np.lexsort((np.arange(len(lane)), -scale)).argsort()
    return np.asarray((near & (place < place[:, None])).any(axis=1))


def _step(heights: Floats, slopes: Floats, curvature: Floats, damping: Floats) -> tuple[Floats, Floats, Floats]:
    """Steps that maximise the lowest plane less curvature and damping; their gains; the multipliers of the planes.

    Of shapes (lanes, 3), (lanes,) and (lanes, contacts). The shares, which weigh the planes' slopes, make the highest
    possible value lowest: of all sets of planes one has it where its planes are equally high.

    Parameters
    ----------
    heights, slopes : ndarray, shapes (lanes, contacts) and (lanes, contacts, 3)
    curvature : ndarray, shape (lanes, 3, 3)
    """
    count = CONTACTS
    heights = heights - heights.min(axis=1, keepdims=True)
    ways = slopes @ np.linalg.inv(curvature + damping[:, None, None] * np.eye(3))
    gram = ways @ slopes.swapaxes(1, 2)
    gram = gram + RIDGE * np.abs(gram).max(axis=(1, 2), keepdims=True) * np.eye(count)
    equations = np.zeros((len(heights), len(SETS), count + 1, count + 1))
    equations[..., :count, :count] = np.where(SETS[:, :, None] & SETS[:, None], gram[:, None], np.eye(count))
    equations[..., :count, count], equations[..., count, :count] = -1.0 * SETS, SETS
    right = np.ones((len(heights), len(SETS), count + 1))
    right[..., :count] = np.where(SETS, -heights[:, None], 0.0)
    shares = np.linalg.solve(equations, right[..., None])[..., :count, 0]
    value = (shares * (0.5 * np.einsum("lij,lsj->lsi", gram, shares) + heights[:, None])).sum(axis=2)
    best = np.where((shares >= 0).all(axis=2), value, np.inf).argmin(axis=1)
    chosen = shares[np.arange(len(best)), best]
    step = np.einsum("lk,lkc->lc", chosen, ways)
    highest = (heights + np.einsum("lkc,lc->lk", slopes, step)).min(axis=1)
    return step, highest - 0.5 * np.einsum("li,lij,lj->l", step, curvature, step), chosen


def _bent(
    curvature: Floats, step: Floats, shares: Floats, theta: Floats, slopes: Floats, now: Floats, new_slopes: Floats
) -> Floats:
    """Curvature of the limiting contacts after a step, from the change of their slopes (BFGS).

    A contact is the same as the one before, at `theta`, that is nearest in angle, `now`.
    """
    apart = np.abs(np.angle(np.exp(1j * (now[:, None] - theta[:, :, None]))))
    same = np.where(np.any(new_slopes != 0, axis=2)[:, None], apart, np.inf).argmin(axis=2)
    change = np.take_along_axis(new_slopes, same[..., None], axis=1) - slopes
    turned = -np.einsum("lk,lkc->lc", shares, change)
    along = np.einsum("lij,lj->li", curvature, step)
    bend, before = (turned * step).sum(axis=1), (along * step).sum(axis=1)
    bent = bend > ALONG * np.linalg.norm(turned, axis=1) * np.linalg.norm(step, axis=1)
    for way, size, counts in ((turned, bend, bent), (along, -before, before > 0)):
        curvature = curvature + way[:, :, None] * (way / np.where(counts, size, np.inf)[:, None])[:, None]
    return curvature
