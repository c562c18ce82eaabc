"""The largest circle and the largest axis-parallel rectangle inside a region.

Both are sought from the best places of a raster, then grown until nothing is left to gain: maximise the size such that
every margin of the region is positive all along the border. Where a margin is smallest along the border, places are
added closer and closer to each other. Holes are respected: one cannot pass through the border, and the raster knows
where they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechdesign.numerics.arrays import Complexes, Flags, Floats
from mechdesign.region.field import Field
from mechdesign.region.patches import Patch
from mechdesign.region.rays import is_turn

# Columns of both shapes.
INSCRIBED = (
    "circle_x", "circle_y", "circle_radius", "rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height"
)  # fmt: skip
# Cells of the raster along each side, and the number of its best places that shapes grow from.
CELLS, TRIALS = 96, 4
# Places of a border that are judged in every round; a rectangle's corners are among them.
PLACES = 64
# Contacts, the places where a margin is smallest: so many at most get further places beside them, at these distances.
CONTACTS, CLOSER = 12, np.linspace(-1, 1, 9)
# A shape grows in rounds. Lengths are parts of the region's size.
ROUNDS = 24
# The farthest that a side or the centre moves in one round.
LEAP = 0.06
# Growing ends when a round gains less than this, and no more than this of the border lies outside.
DEPTH = 1e-9
# After the last round so much may lie outside; a border farther out counts as not found.
LATE = 1e-7
# A curve shorter than this part of the region is a point.
POINT = 1e-6
# A place of the raster is tried if the shape there is at least this part of the best one so far.
HOPEFUL = 0.8
# Step of differences, as a part of the region's size.
STEP = 1e-6
# A margin whose slope is below this part of it is far from zero.
FLAT = 1e-6

# Borders, linear in their parameters: derivatives of points by each parameter at places u of the border in [0, 1).
Border = Callable[[Floats], Complexes]
# What shall be large, with its slopes by the parameters.
Size = Callable[[Floats], tuple[float, Floats]]


def inscribed(field: Field, scan: tuple[float, float], patches: Sequence[Patch], others: Sequence[Patch]) -> Floats:
    """The largest circle and rectangle inside one region, as `INSCRIBED` names it; nan for what was not found.

    Parameters
    ----------
    scan : (float, float)
        Range of angle of the scan (radians): what lies beyond a scan of less than a turn does not count.
    patches : sequence of Patch
        The region's parts.
    others : sequence of Patch
        Parts of pieces that do not count.
    """
    ends = [(edge.places, edge.margin) for patch in patches for edge in patch.edges]
    # Single points, where a leg has no length, bound nothing.
    extent = max(float(np.ptp(z.real) + np.ptp(z.imag)) for z, _ in ends)
    ends = [(z, margin) for z, margin in ends if np.ptp(z.real) + np.ptp(z.imag) > POINT * extent]
    every = np.concatenate([z for z, _ in ends])
    corner = complex(every.real.min(), every.imag.min())
    # With a cell more all round, so that what ends the region along a side of its box is met, too.
    cell = np.array([np.ptp(every.real), np.ptp(every.imag)]) / (CELLS - 2)
    size = float((CELLS - 2) * cell.max())
    x, y = (low + step * (np.arange(CELLS) - 0.5) for low, step in zip((corner.real, corner.imag), cell, strict=True))
    sector = _sector(patches[0].about, scan)

    def margins(z: Complexes) -> Floats:
        return np.concatenate([field.margins(z, {}), sector(z)])

    cells = (x[:, None] + 1j * y).ravel()
    inside = margins(cells) > 0
    counts = inside.all(axis=0)
    for other in others:
        counts &= ~other.holds(cells)
    free = counts.reshape(CELLS, CELLS)
    met = (np.stack([every.real - corner.real, every.imag - corner.imag]) / cell[:, None]).astype(int)
    free[tuple(np.clip(met + 1, 1, CELLS - 2))] = False
    # What is negative nowhere (the length of a leg) is no border.
    borders = np.array(~inside.all(axis=1), dtype=bool)
    borders[[*(margin for _, margin in ends), *range(len(field.labels), len(borders))]] = True

    def grown(border: Border, value: Size, start: Floats) -> Floats:
        shape = _grown(border, value, lambda z: margins(size * z)[borders] / size, start / size)
        return np.full(len(start), np.nan) if shape is None else size * shape

    circle, best = np.full(3, np.nan), 0.0
    for i, j, radius in _discs(free, cell) or [_thin(patches, x, y)]:
        if radius >= HOPEFUL * best:
            p = grown(_circle, _radius, np.array([x[i], y[j], 0.9 * radius]))
            held = np.abs(every - complex(p[0], p[1])) - p[2] < -POINT * size
            if p[2] > best and not held.any():
                circle, best = p, float(p[2])
    rectangle, best = np.full(4, np.nan), 0.0
    for i, j, m, n in _boxes(free):
        if (x[m] - x[i] + cell[0]) * (y[n] - y[j] + cell[1]) >= HOPEFUL * best:
            p = grown(_rectangle, _area, np.array([x[i], x[m], y[j], y[n]]))
            aside = np.stack([p[0] - every.real, every.real - p[1], p[2] - every.imag, every.imag - p[3]])
            held = aside.max(axis=0) < -POINT * size
            if (p[1] - p[0]) * (p[3] - p[2]) > best and not held.any():
                rectangle, best = p, float((p[1] - p[0]) * (p[3] - p[2]))
    left, right, low, high = rectangle
    return np.array([*circle, 0.5 * (left + right), 0.5 * (low + high), right - left, high - low])


def crossed(shapes: Floats, z: Complexes) -> list[str]:
    """Which of the shapes, as `INSCRIBED` names them, have one of some places inside: ``circle``, ``rectangle``."""
    x, y, radius, middle_x, middle_y, width, height = shapes
    inside = 1 - POINT
    within = {
        "circle": np.abs(z - complex(x, y)) < inside * radius,
        "rectangle": (np.abs(z.real - middle_x) < inside * width / 2)
        & (np.abs(z.imag - middle_y) < inside * height / 2),
    }
    return [name for name, places in within.items() if places.any()]


def _sector(about: complex, scan: tuple[float, float]) -> Callable[[Complexes], Floats]:
    """Margins of a scan of less than a turn: distances from its sides (beyond half a turn one is enough)."""
    start, stop = (np.exp(1j * angle) for angle in scan)
    span = scan[1] - scan[0]

    def margins(z: Complexes) -> Floats:
        if is_turn(scan):
            return np.zeros((0, *z.shape))
        left, right = ((z - about) * np.conj(start)).imag, -((z - about) * np.conj(stop)).imag
        return np.stack([left, right]) if span <= np.pi * (1 + 1e-12) else np.maximum(left, right)[None]

    return margins


def _discs(free: Flags, cell: Floats) -> list[tuple[int, int, float]]:
    """Cells far from the boundary, the farthest first, none within another's circle: column, row, distance."""
    from scipy.ndimage import distance_transform_edt

    far = distance_transform_edt(np.pad(free, 1), sampling=tuple(cell))[1:-1, 1:-1]
    column, row = np.arange(CELLS)[:, None] * cell[0], np.arange(CELLS) * cell[1]
    discs: list[tuple[int, int, float]] = []
    while len(discs) < TRIALS and far.any():
        i, j = (int(k) for k in np.unravel_index(int(np.argmax(far)), far.shape))
        discs.append((i, j, float(far[i, j])))
        far = np.where(np.hypot(column - i * cell[0], row - j * cell[1]) < far[i, j], 0.0, far)
    return discs


def _thin(patches: Sequence[Patch], x: Floats, y: Floats) -> tuple[int, int, float]:
    """The cell at the middle of the widest interval, where every cell is met by the boundary."""
    z = max(patches, key=lambda patch: patch.width).middle
    return int(np.argmin(np.abs(x - z.real))), int(np.argmin(np.abs(y - z.imag))), float(x[1] - x[0])


def _boxes(free: Flags) -> list[tuple[int, int, int, int]]:
    """Large rectangles of free cells, the largest first, each with its middle outside those before it.

    For every first row the largest: first column, first row, last column, last row.
    """
    place, boxes = np.arange(CELLS), []
    for row in range(CELLS):
        # Down to each last row: of each column how many up to it are free in all the rows.
        full = np.logical_and.accumulate(free[:, row:], axis=1)
        run = place[:, None] - np.maximum.accumulate(np.where(full, -1, place[:, None]), axis=0)
        last, wide = run.argmax(axis=0), run.max(axis=0)
        k = int((wide * (1 + place[: len(wide)])).argmax())
        boxes.append((int(wide[k]) * (k + 1), int(last[k] - wide[k]) + 1, row, int(last[k]), row + k))
    kept: list[tuple[int, int, int, int]] = []
    for area, i, j, m, n in sorted(boxes, reverse=True):
        middle = (i + m) / 2, (j + n) / 2
        if area and not any(a <= middle[0] <= c and b <= middle[1] <= d for a, b, c, d in kept):
            kept.append((i, j, m, n))
    return kept[:TRIALS]


def _circle(u: Floats) -> Complexes:
    """Borders by x and y of the centre and the radius."""
    return np.stack([np.ones(len(u)), np.full(len(u), 1j), np.exp(2j * np.pi * u)])


def _radius(p: Floats) -> tuple[float, Floats]:
    return float(p[2]), np.array([0.0, 0.0, 1.0])


def _rectangle(u: Floats) -> Complexes:
    """Borders by left, right, lower and upper side: from the lower left corner, counterclockwise."""
    v = 4 * (u % 1.0)
    a, b = np.clip(np.minimum(v, 3 - v), 0, 1), np.clip(np.minimum(v - 1, 4 - v), 0, 1)
    return np.stack([1 - a + 0j, a + 0j, 1j * (1 - b), 1j * b])


def _area(p: Floats) -> tuple[float, Floats]:
    """Logarithm of the area: concave, and its slopes are of the sides alone."""
    width, height = max(p[1] - p[0], 1e-12), max(p[3] - p[2], 1e-12)
    return float(np.log(width * height)), np.array([-1 / width, 1 / width, -1 / height, 1 / height])


def _grown(border: Border, size: Size, margins: Callable[[Complexes], Floats], p: Floats) -> Floats | None:
    """Parameters of the largest shape near a first one, in parts of the region's size; None where none was found."""
    from scipy.optimize import minimize as scipy_minimize

    minimize: Any = scipy_minimize

    def with_slopes(z: Complexes) -> tuple[Floats, Complexes]:
        """Margins, and their slopes along x and y as one number."""
        around = margins(z[:, None] + STEP * np.array([0, 1, -1, 1j, -1j]))
        x, y = around[..., 1] - around[..., 2], around[..., 3] - around[..., 4]
        return around[..., 0], np.asarray((x + 1j * y) / (2 * STEP))

    def constraints(places: Floats, which: Flags, steep: Floats) -> dict[str, Any]:
        """Margins at places of the border, each divided by its slope as it is now."""
        along = border(places)

        def values(q: Floats) -> Floats:
            margin = margins(q @ along)[which] / steep
            return np.where(np.isfinite(margin), margin, 1.0)

        def slopes(q: Floats) -> Floats:
            slope = with_slopes(q @ along)[1]
            slope_by = np.stack([(slope * np.conj(way)).real[which] / steep for way in along], axis=1)
            return np.where(np.isfinite(slope_by), slope_by, 0.0)

        return {"type": "ineq", "fun": values, "jac": slopes}

    uniform = np.arange(PLACES) / PLACES
    inwards = np.array([0, 0, -1.0] if len(p) == 3 else [1.0, -1, 1, -1])
    places, met, width, gain = uniform, uniform[:0], 1 / PLACES, 1.0
    for number in range(ROUNDS + 1):
        value, slope = with_slopes(p @ border(places))
        steep = np.abs(slope)
        # Where a margin is unknown another is negative; one that does not change is no border.
        known = np.isfinite(steep) & (steep > FLAT * np.abs(value))
        distance = np.where(known, value / np.where(known, steep, 1.0), 1.0)
        if max(gain, width**2, -distance.min()) < DEPTH or number == ROUNDS:
            break
        which = distance < 3 * LEAP
        # From inside, and in steps of some cells, since only what is near is looked at.
        start = p + max(-distance.min(), 0.0) * inwards
        larger = minimize(
            lambda q: -size(q)[0], start, jac=lambda q: -size(q)[1], method="SLSQP",
            bounds=[(v - LEAP, v + LEAP) for v in p], constraints=constraints(places, which, steep[which]),
            options={"ftol": 1e-14, "maxiter": 60},
        ).x  # fmt: skip
        if not np.isfinite(larger).all():
            return None
        gain, move, p = abs(size(larger)[0] - size(p)[0]), float(np.abs(larger - p).max()), larger
        low = (distance <= np.roll(distance, 1, axis=1)) & (distance < np.roll(distance, -1, axis=1))
        lowest = np.argsort(np.where(low, distance, np.inf).min(axis=0))[:CONTACTS]
        closer = places[lowest][:, None] + width * CLOSER
        width = min(1 / PLACES, max(width / 3, 4 * move))
        met = np.concatenate([met, places[lowest]])
        places = np.unique(np.concatenate([uniform, met, closer.ravel() % 1.0]))
    return p if distance.min() > -LATE else None
