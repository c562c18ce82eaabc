"""The largest circle and the largest axis-parallel rectangle inside a region.

Both are sought from the best places of a raster, then grown until nothing is left to gain: maximise the size such that
every margin of the region is positive all along the border. Of the border those points count where a margin is
smallest; they are sought anew until none is negative (an exchange method for semi-infinite programs, Hettich and
Kortanek 1993). Holes are respected: one cannot pass through the border, and the raster knows where they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.analyses.region.curves import Patch
from mechdesign.analyses.region.field import Field
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Cells of the raster along each side, and how many of its best places are tried.
CELLS, TRIALS = 96, 4
# Samples of a border; those of rectangles lie at its corners, too.
SAMPLES = 128
# Rounds of the exchange, and the depth (as a part of the region's size) to which a border may lie outside.
ROUNDS, DEPTH, LATE = 24, 1e-9, 1e-7
# How far a round may move (parts of the size).
LEAP = 0.06
# Places all round that are always looked at.
FIRM = 16
# A curve shorter than this part of the longest is a point; places of a border nearer to each other are one.
POINT, ONE_PLACE = 1e-6, 1e-7
# Step of differences as a part of the size; a trial that is not nearly as good as the best so far is left.
STEP, HOPEFUL = 1e-6, 0.8
# Rounds in which a shape may still reach as far out of the region as before.
PATIENCE = 4
# A margin whose slope is less than this part of it is far from zero.
FLAT = 1e-6


@dataclass(frozen=True)
class Circle:
    """A circle; nan where the region is empty."""

    centre: complex
    radius: float


@dataclass(frozen=True)
class Rectangle:
    """An axis-parallel rectangle; nan where the region is empty."""

    centre: complex
    width: float
    height: float


NO_CIRCLE = Circle(complex(np.nan, np.nan), np.nan)
NO_RECTANGLE = Rectangle(complex(np.nan, np.nan), np.nan, np.nan)


@dataclass(frozen=True)
class _Shape:
    """Borders by parameters: points, and their derivatives by each parameter, at places u of the border in [0, 1).

    `size` is what shall be large, with its slopes.
    """

    points: Callable[[Floats, Floats], Complexes]
    slopes: Callable[[Floats], Complexes]
    size: Callable[[Floats], tuple[float, Floats]]


def inscribed(
    field: Field, about: complex, scan: tuple[float, float], patches: Sequence[Patch], others: Sequence[Patch] = ()
) -> tuple[Circle, Rectangle]:
    """The largest circle and rectangle inside one region.

    Parameters
    ----------
    about, scan
        Centre and range of angle (radians) of the scan: what lies beyond a scan of less than a turn does not count.
    patches : sequence of Patch
        The region's parts.
    others : sequence of Patch
        Parts of pieces that do not count.
    """
    if not patches:
        return NO_CIRCLE, NO_RECTANGLE
    ends = [
        (about + r * np.exp(1j * p.theta), margin)
        for p in patches
        for r, margin in ((p.inner, p.enters), (p.outer, p.leaves))
        if margin >= 0
    ]
    # Single points, where a leg has no length, bound nothing.
    extent = max(float(np.ptp(z.real) + np.ptp(z.imag)) for z, _ in ends)
    ends = [(z, margin) for z, margin in ends if np.ptp(z.real) + np.ptp(z.imag) > POINT * extent]
    every = np.concatenate([z for z, _ in ends])
    low, high = complex(every.real.min(), every.imag.min()), complex(every.real.max(), every.imag.max())
    size = max(high.real - low.real, high.imag - low.imag)
    sector = _sector(about, scan, size)

    def margins(z: Complexes) -> Floats:
        return np.concatenate([field.margins(z, {}), sector(z)])

    # With a cell more all round, so that what ends the region along a side of its box is met, too.
    dx, dy = (high.real - low.real) / (CELLS - 2), (high.imag - low.imag) / (CELLS - 2)
    x = np.asarray(low.real + dx * (np.arange(CELLS) - 0.5), dtype=float)
    y = np.asarray(low.imag + dy * (np.arange(CELLS) - 0.5), dtype=float)
    cells = (x[:, None] + 1j * y).ravel()
    inside = margins(cells) > 0
    counts = inside.all(axis=0)
    for other in others:
        counts &= ~other.holds(cells, about)
    free = counts.reshape(CELLS, CELLS)
    # What is negative nowhere (the length of a leg) is no border.
    borders = np.array(~inside.all(axis=1), dtype=bool)
    borders[[*(margin for _, margin in ends), *range(len(field.labels), len(borders))]] = True
    column = np.clip(((every.real - low.real) / dx).astype(int) + 1, 1, CELLS - 2)
    row = np.clip(((every.imag - low.imag) / dy).astype(int) + 1, 1, CELLS - 2)
    free[column, row] = False
    grow = _Grow(lambda z: margins(z)[borders], size)
    circle, rectangle = NO_CIRCLE, NO_RECTANGLE
    for i, j, radius in _discs(free, dx, dy) or [_thin(patches, about, x, y)]:
        if radius < HOPEFUL * circle.radius:
            continue
        p = grow.best(CIRCLE, np.array([x[i], y[j], 0.9 * radius]))
        if p is not None and not p[2] <= circle.radius and not _holds(np.abs(every - complex(p[0], p[1])) - p[2], size):
            circle = Circle(complex(p[0], p[1]), float(p[2]))
    for i, j, m, n in _boxes(free):
        start = np.array([x[i], x[m], y[j], y[n]])
        area = (start[1] - start[0] + dx) * (start[3] - start[2] + dy)
        if area < HOPEFUL * rectangle.width * rectangle.height:
            continue
        p = grow.best(RECTANGLE, start)
        if p is None:
            continue
        outside = np.maximum(np.maximum(p[0] - every.real, every.real - p[1]),
                             np.maximum(p[2] - every.imag, every.imag - p[3]))  # fmt: skip
        width, height = float(p[1] - p[0]), float(p[3] - p[2])
        if not width * height <= rectangle.width * rectangle.height and not _holds(outside, size):
            rectangle = Rectangle(complex(p[0] + p[1], p[2] + p[3]) / 2, width, height)
    return circle, rectangle


def _holds(outside: Floats, size: float) -> bool:
    """Whether a shape holds a part of the boundary."""
    return bool((outside < -POINT * size).any())


def _sector(about: complex, scan: tuple[float, float], size: float) -> Callable[[Complexes], Floats]:
    """Margins of a scan of less than a turn: distances from its sides (beyond half a turn one is enough)."""
    start, stop = (np.exp(1j * angle) for angle in scan)
    span = scan[1] - scan[0]
    if span >= 2 * np.pi * (1 - 1e-12):
        return lambda z: np.zeros((0, *z.shape))

    def margins(z: Complexes) -> Floats:
        left, right = ((z - about) * np.conj(start)).imag, -((z - about) * np.conj(stop)).imag
        return np.stack([left, right]) if span <= np.pi * (1 + 1e-12) else np.maximum(left, right)[None]

    return margins


def _discs(free: Flags, dx: float, dy: float) -> list[tuple[int, int, float]]:
    """Cells far from the boundary, the farthest first, none within another's circle: column, row, distance."""
    from scipy.ndimage import distance_transform_edt

    far = distance_transform_edt(np.pad(free, 1), sampling=(dx, dy))[1:-1, 1:-1]
    column, row = np.arange(CELLS)[:, None] * dx, np.arange(CELLS) * dy
    found = []
    for _ in range(TRIALS):
        i, j = np.unravel_index(int(np.argmax(far)), far.shape)
        radius = float(far[i, j])
        if radius <= 0:
            break
        found.append((int(i), int(j), radius))
        far = np.where(np.hypot(column - i * dx, row - j * dy) < radius, 0.0, far)
    return found


def _thin(patches: Sequence[Patch], about: complex, x: Floats, y: Floats) -> tuple[int, int, float]:
    """The cell at the middle of the widest interval, where every cell is met by the boundary."""
    patch = max(patches, key=lambda p: float(np.max(p.outer - p.inner)))
    k = int(np.argmax(patch.outer - patch.inner))
    z = about + 0.5 * (patch.inner[k] + patch.outer[k]) * np.exp(1j * patch.theta[k])
    return (int(np.argmin(np.abs(x - z.real))), int(np.argmin(np.abs(y - z.imag))), float(x[1] - x[0]))


def _boxes(free: Flags) -> list[tuple[int, int, int, int]]:
    """Large rectangles of free cells, the largest first, each with its middle outside those before it.

    Per row the largest that stands on it, by the stack of rising columns: first column, row, last column, row.
    """
    heights = np.zeros(CELLS, dtype=int)
    found = []
    for row in range(CELLS):
        heights = np.where(free[:, row], heights + 1, 0)
        stack: list[tuple[int, int]] = []
        best = (0, 0, 0, 0, 0)
        for column, height in enumerate([*heights.tolist(), 0]):
            begin = column
            while stack and stack[-1][1] >= height:
                begin, tall = stack.pop()
                best = max(best, (tall * (column - begin), begin, row - tall + 1, column - 1, row))
            stack.append((begin, height))
        found.append(best)
    found.sort(reverse=True)
    kept: list[tuple[int, int, int, int]] = []
    for area, i, j, m, n in found:
        middle = (i + m) / 2, (j + n) / 2
        if area and not any(a <= middle[0] <= c and b <= middle[1] <= d for a, b, c, d in kept):
            kept.append((i, j, m, n))
    return kept[:TRIALS]


def _circle_points(p: Floats, u: Floats) -> Complexes:
    return np.asarray(complex(p[0], p[1]) + p[2] * np.exp(2j * np.pi * u))


def _circle_slopes(u: Floats) -> Complexes:
    return np.stack([np.ones(len(u)), np.full(len(u), 1j), np.exp(2j * np.pi * u)])


def _sides(u: Floats) -> tuple[Floats, Floats]:
    """Parts of width and height at a rectangle's border: from its lower left corner, counterclockwise."""
    v = 4 * (u % 1.0)
    return np.clip(np.minimum(v, 3 - v), 0, 1), np.clip(np.minimum(v - 1, 4 - v), 0, 1)


def _rectangle_points(p: Floats, u: Floats) -> Complexes:
    a, b = _sides(u)
    return np.asarray(p[0] + a * (p[1] - p[0]) + 1j * (p[2] + b * (p[3] - p[2])))


def _rectangle_slopes(u: Floats) -> Complexes:
    a, b = _sides(u)
    return np.stack([1 - a + 0j, a + 0j, 1j * (1 - b), 1j * b])


def _area(p: Floats) -> tuple[float, Floats]:
    """Logarithm of the area: concave, and its slopes are of the sides alone."""
    width, height = max(p[1] - p[0], 1e-12), max(p[3] - p[2], 1e-12)
    slopes = np.array([-1 / width, 1 / width, -1 / height, 1 / height])
    return float(np.log(width) + np.log(height)), slopes


CIRCLE = _Shape(_circle_points, _circle_slopes, lambda p: (float(p[2]), np.array([0.0, 0.0, 1.0])))
RECTANGLE = _Shape(_rectangle_points, _rectangle_slopes, _area)


@dataclass(frozen=True)
class _Grow:
    margins: Callable[[Complexes], Floats]
    size: float

    def best(self, shape: _Shape, start: Floats) -> Floats | None:
        """Parameters of the largest shape near a first one; None where none was found."""
        from scipy.optimize import minimize as scipy_minimize

        minimize: Any = scipy_minimize
        p = start / self.size
        u = np.arange(SAMPLES) / SAMPLES
        # Places all round, each with the margin that is nearest to zero there.
        places = u[:: SAMPLES // FIRM]
        which = np.argmin(self._distances(self.size * shape.points(p, places)), axis=0)
        firm, room, least, stuck = len(places), 0.0, -np.inf, 0
        for _ in range(ROUNDS):
            more_u, more_which, depth = self._lowest(shape, p, u)
            # Where a margin jumps no slope leads out of it.
            stuck = 0 if depth > least or room <= 0 else stuck + 1
            least = max(least, depth) if room > 0 else least
            if stuck > PATIENCE:
                break
            if room > 0 and depth > -DEPTH:
                return p * self.size
            later = self._fewer(np.concatenate([places[firm:], more_u]), np.concatenate([which[firm:], more_which]))
            places, which = np.concatenate([places[:firm], later[0]]), np.concatenate([which[:firm], later[1]])
            # In steps of some cells, since only a part of the border is looked at.
            answer = minimize(
                lambda q: -shape.size(q)[0], p, jac=lambda q: -shape.size(q)[1], method="SLSQP",
                bounds=[(v - LEAP, v + LEAP) for v in p],
                constraints=self._constraints(shape, p, places, which),
                options={"ftol": 1e-14, "maxiter": 60},
            )  # fmt: skip
            if not np.isfinite(answer.x).all():
                return None
            room = LEAP - float(np.abs(answer.x - p).max()) - 1e-9
            p = answer.x
        return p * self.size if depth > -LATE else None

    def _with_slopes(self, z: Complexes) -> tuple[Floats, Floats, Floats]:
        """Margins and their slopes along x and y, by parts of the size."""
        h = STEP * self.size
        around = self.margins(z[:, None] + np.array([0, h, -h, 1j * h, -1j * h]))
        x, y = (around[..., 1] - around[..., 2]) / (2 * STEP), (around[..., 3] - around[..., 4]) / (2 * STEP)
        return around[..., 0], x, y

    def _distances(self, z: Complexes) -> Floats:
        """Margins over their slopes: about the distance to the border, in parts of the size."""
        value, x, y = self._with_slopes(z)
        steep = np.hypot(x, y)
        # Where a margin is unknown another is negative; one that does not change is no border.
        known = np.isfinite(steep) & (steep > FLAT * np.abs(value))
        return np.where(known, value / np.where(known, steep, 1.0), 1.0)

    def _constraints(self, shape: _Shape, p: Floats, u: Floats, which: Ints) -> Mapping[str, Any]:
        """The margins at places of the border, each divided by its slope as it is now."""
        lane, along = np.arange(len(u)), shape.slopes(u)
        _, x, y = self._with_slopes(self.size * shape.points(p, u))
        steep = np.hypot(x, y)[which, lane]
        scale = np.where(steep > 0, steep, 1.0)

        def values(q: Floats) -> Floats:
            found: Floats = self.margins(self.size * shape.points(q, u))[which, lane] / scale
            return np.where(np.isfinite(found), found, 1.0)

        def slopes(q: Floats) -> Floats:
            _, x, y = self._with_slopes(self.size * shape.points(q, u))
            found = ((x[which, lane] * along.real + y[which, lane] * along.imag) / scale).T
            return np.where(np.isfinite(found), found, 0.0)

        return {"type": "ineq", "fun": values, "jac": slopes}

    def _lowest(self, shape: _Shape, p: Floats, u: Floats) -> tuple[Floats, Ints, float]:
        """Places of the border where a margin is smallest, the margins, and the lowest of them all."""
        values = self._distances(self.size * shape.points(p, u))
        low = (values <= np.roll(values, 1, axis=1)) & (values < np.roll(values, -1, axis=1))
        # A side along which a margin is the same has no lowest place of its own.
        lowest = values.argmin(axis=1)
        low[np.arange(len(values)), lowest] = True
        which, k = np.nonzero(low & (values < 0.5))
        if not len(k):
            return np.zeros(0), which, 0.0
        width = 1 / len(u)
        a, c = u[k] - width, u[k] + width
        # Towards the bottom by thirds: corners and smooth bottoms alike.
        for _ in range(4):
            inner = a + (c - a) * np.linspace(0, 1, 9)[:, None]
            depth = self._distances(self.size * shape.points(p, inner.ravel()))
            here = depth.reshape(len(depth), 9, -1)[which, :, np.arange(len(k))]
            best = np.clip(np.argmin(here, axis=1), 1, 7)
            lane = np.arange(len(k))
            a, c = inner[best - 1, lane], inner[best + 1, lane]
        k = np.clip(np.argmin(here, axis=1), 1, 7)
        before, at, after = here[lane, k - 1], here[lane, k], here[lane, k + 1]
        place, lowest = inner[np.argmin(here, axis=1), lane], here.min(axis=1)
        bend = before - 2 * at + after
        with np.errstate(invalid="ignore", divide="ignore"):
            vertex = inner[k, lane] + np.clip(0.5 * (before - after) / bend, -1, 1) * (inner[1] - inner[0])
        vertex = np.where(np.isfinite(vertex), vertex, place)
        depth = self._distances(self.size * shape.points(p, vertex))[which, lane]
        better = depth < lowest
        return np.where(better, vertex, place) % 1.0, which, float(np.minimum(depth, lowest).min())

    def _fewer(self, u: Floats, which: Ints) -> tuple[Floats, Ints]:
        """The latest of places that lie beside each other."""
        kept: list[int] = []
        for k in range(len(u) - 1, -1, -1):
            if all(which[k] != which[j] or abs((u[k] - u[j] + 0.5) % 1 - 0.5) > ONE_PLACE for j in kept):
                kept.append(k)
        return u[kept], which[kept]
