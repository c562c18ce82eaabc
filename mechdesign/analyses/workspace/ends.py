"""Where curves inside a region end at its boundary.

The outermost lines of a patch's grid lie a little inside the boundary. Where a leg is stretched or folded there, the
determinant grows as the square root of the distance to it: its zero curve is tangent to the boundary, and ends farther
along it than the grid's lines are away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.analyses.region.curves import GRID, Patch
from mechdesign.analyses.region.field import Field
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# How far the boundary may lie from where it is interpolated (far only where a ray is nearly tangent to it), the nearest
# first; and how exactly it is found: parts of the interval.
WIDE, ACCURACY = (1e-4, 1e-3, 1e-2, 0.1), 1e-15
# The curve is followed to these distances from the boundary, parts of the interval; from there to its end in square
# roots of the distance: half as far again.
BESIDE = np.array([1e-10, 4e-10])
STEPS = 10
# Angles are found to this part of a row; the end lies within so many rows.
CLOSE, ROWS = 1e-7, 2.0


@dataclass(frozen=True, eq=False)
class Ends:
    """Ends of zero curves of a determinant in a patch of a region.

    Parameters
    ----------
    determinant : callable
        The determinant at points of the plane.
    """

    field: Field
    about: complex
    patch: Patch
    determinant: Callable[[Complexes], Floats]

    @cached_property
    def _curves(self) -> Callable[[Floats], Floats]:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.patch.theta, np.stack([self.patch.inner, self.patch.outer]), axis=1)

    def extended(self, curve: Complexes, row: Floats, column: Floats) -> Complexes:
        """A curve, given by its points and their rows and columns, to the boundary where it ends beside it."""
        if len(curve) < 2 or curve[0] == curve[-1]:
            return curve
        for end in (0, -1):
            if column[end] in (0, GRID - 1):
                theta = float(np.interp(row[end], np.arange(len(self.patch.theta)), self.patch.theta))
                met = self._met(theta, outside=bool(column[end] > 0))
                if met is not None:
                    curve = np.append(curve, met) if end else np.append(met, curve)
        return curve

    def _met(self, start: float, *, outside: bool) -> complex | None:
        """Where the zero curve meets the boundary, if it does so near an angle."""
        patch = self.patch
        margin = patch.leaves if outside else patch.enters
        if margin < 0:
            return None
        row = float(np.max(np.diff(patch.theta)))

        def values(theta: Floats) -> tuple[Floats, Floats]:
            radius, inwards = self._boundary(theta, margin, outside=outside)
            z = self.about + (radius + BESIDE * inwards) * np.exp(1j * theta)
            return radius, self.determinant(np.asarray(z))

        # The secant method for both distances at once.
        before, theta = np.full(2, start - 1e-3 * row), np.full(2, start)
        last = values(before)[1]
        for _ in range(STEPS):
            now = values(theta)[1]
            with np.errstate(invalid="ignore", divide="ignore"):
                step = np.where(now == 0, 0.0, -now * (theta - before) / (now - last))
            before, last, theta = theta, now, theta + np.where(theta == before, 0.0, step)
            if not (np.abs(theta - start) <= ROWS * row).all():
                return None
            if (np.abs(step) <= CLOSE * row).all():
                break
        else:
            return None
        found = np.full(2, 2 * theta[0] - theta[1])
        radius = self._boundary(found, margin, outside=outside)[0][0]
        end = complex(self.about + radius * np.exp(1j * found[0]))
        return end if np.isfinite(end) else None

    def _boundary(self, theta: Floats, margin: int, *, outside: bool) -> tuple[Floats, Floats]:
        """Radii of the boundary, nan where it is not found, and the way inwards as long as the interval."""
        ends = self._curves(theta)
        middle, way = ends[int(outside)], ends[int(not outside)] - ends[int(outside)]

        def evaluate(which: Ints, t: Floats) -> Floats:
            z = self.about + (middle[which] + t * way[which]) * np.exp(1j * theta[which])
            return np.asarray(self.field.margins(np.asarray(z), {})[margin])

        every, nan = np.arange(len(theta)), np.full(len(theta), np.nan)
        wide, low, high = nan.copy(), nan.copy(), nan.copy()
        for part in WIDE:
            rest = np.flatnonzero(np.isnan(wide))
            before, after = (evaluate(rest, np.full(len(rest), side * part)) for side in (-1, 1))
            met = (before > 0) != (after > 0)
            wide[rest[met]], low[rest[met]], high[rest[met]] = part, before[met], after[met]
        met = np.isfinite(wide)
        t = nan.copy()

        def inside(which: Ints, t: Floats) -> Floats:
            return evaluate(every[met][which], t)

        t[met] = bracketed_roots(
            inside, -wide[met], low[met], wide[met], high[met], nan[met], nan[met], np.full(met.sum(), ACCURACY)
        )
        return middle + t * way, way
