"""A raster of a region: which cells of a box that holds all of it lie inside.

Rays about one point may pass a piece of a region by; cells cannot, if the piece is larger than they are. So the raster
says how far rays have to go, and between which of them something is hidden; and the number of its cells is an area
that shares nothing with the integrals but the margins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.rays import Designs, Intervals
from mechdesign.analyses.region.reach import box
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Cells looked at at once.
BLOCK = 1 << 17
# Share of their area by which cells on the boundary may be miscounted, if they all err alike.
EDGE = 0.5
# Times that a box is doubled whose outermost cells lie inside, where the mechanism's dimensions give no bound.
DOUBLINGS = 12


@dataclass(frozen=True, eq=False)
class Raster:
    """Cells of a box around the region of each design, by their centres.

    A circle larger than the one around a cell always holds a centre: pieces that hold one are met.

    Parameters
    ----------
    low, cell : ndarray of complex, shape (designs,)
        Lower left corner of the box, and width and height of a cell.
    inside : ndarray of bool, shape (designs, rows, columns)
        Whether a cell's centre lies in the region.
    """

    low: Complexes
    cell: Complexes
    inside: Flags

    @staticmethod
    def of(designs: Designs, cells: int, scan: tuple[float, float]) -> Raster:
        """Look at `cells` times `cells` places of each design, those within the scan."""
        low, high, bounded = box(designs)
        for _ in range(DOUBLINGS):
            found = Raster(low, (high - low) / cells, np.zeros((designs.count, cells, cells), dtype=bool))
            for some, z in found._centres(np.arange(designs.count)):
                found.inside[some] = (designs.inside(z, some) & _within(z - designs.about, scan)).T.reshape(
                    -1, cells, cells
                )
            rim = found.inside.copy()
            rim[:, 1:-1, 1:-1] = False
            open_ = rim.any(axis=(1, 2)) & ~bounded
            if not open_.any():
                break
            size = np.where(open_, high - low, 0)
            low, high = low - 0.5 * size, high + 0.5 * size
        return found

    @property
    def area(self) -> tuple[Floats, Floats]:
        """Area of the cells inside of each design, and what that is not known to."""
        inside, one = self.inside, self.cell.real * self.cell.imag
        edge = np.zeros(inside.shape, dtype=bool)
        for axis in (1, 2):
            change = np.diff(inside, axis=axis)
            one_side, other = [slice(None)] * 3, [slice(None)] * 3
            one_side[axis], other[axis] = slice(1, None), slice(None, -1)
            edge[tuple(one_side)] |= change
            edge[tuple(other)] |= change
        return inside.sum(axis=(1, 2)) * one, EDGE * edge.sum(axis=(1, 2)) * one

    def farthest(self, about: complex) -> Floats:
        """Distance from a point within which all cells inside lie, shape (designs,); 0 where there is none."""
        found = np.zeros(len(self.low))
        for some, z in self._centres(np.arange(len(self.low))):
            distance = np.where(self.inside[some].reshape(len(some), -1).T, np.abs(z - about), 0.0).max(axis=0)
            found[some] = np.where(distance > 0, distance + np.abs(self.cell[some]), 0.0)
        return found

    def hidden(
        self, some: Ints, about: complex, scan: tuple[float, float], design: Ints, angle: Floats, intervals: Intervals
    ) -> tuple[Ints, Floats]:
        """Design and angle of further rays, to what rays have passed by: pieces and holes between two of them.

        Parameters
        ----------
        some : ndarray of int
            Designs that are looked at.
        design, angle, intervals
            The rays, ascending by both; for each design at least those at both ends of the scan.
        """
        every = np.arange(len(self.low) + 1)
        first, held = np.searchsorted(design, every), _Held(intervals)
        owners, angles = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
        for block, z in self._centres(some):
            inside = self.inside[block].reshape(len(block), -1).T
            way = z - about
            theta = scan[0] + (np.angle(way) - scan[0]) % (2 * np.pi)
            radius = np.abs(way)
            at = np.empty(z.shape, dtype=np.intp)
            for lane, k in enumerate(block):
                rays = angle[first[k] : first[k + 1]]
                at[:, lane] = first[k] + np.clip(np.searchsorted(rays, theta[:, lane]) - 1, 0, len(rays) - 2)
            before, after = held.at(at, radius), held.at(at + 1, radius)
            passed = np.where(inside, ~before & ~after, before & after) & (theta < scan[1]) & (theta > scan[0])
            if not passed.any():
                continue
            # Of the places between the same two rays the one farthest from both: a piece, and a hole.
            cells, lanes = np.nonzero(passed)
            gap = at[cells, lanes]
            aside = np.minimum(theta[cells, lanes] - angle[gap], angle[gap + 1] - theta[cells, lanes])
            kind = 2 * gap + inside[cells, lanes]
            order = np.lexsort((-aside, kind))
            chosen = order[np.append(True, np.diff(kind[order]) > 0)]
            owners.append(block[lanes[chosen]])
            angles.append(theta[cells[chosen], lanes[chosen]])
        return np.concatenate(owners), np.concatenate(angles)

    def _centres(self, designs: Ints) -> Iterator[tuple[Ints, Complexes]]:
        """Some of the designs, and centres of their cells, shape (cells, designs), row by row."""
        size = self.inside.shape[1]
        place = np.arange(size) + 0.5
        x, y = np.tile(place, size)[:, None], np.repeat(place, size)[:, None]
        step = max(1, BLOCK // size**2)
        for k in range(0, len(designs), step):
            some = designs[k : k + step]
            low, cell = self.low[some], self.cell[some]
            yield some, low.real + x * cell.real + 1j * (low.imag + y * cell.imag)


class _Held:
    """Which radii the intervals of rays hold."""

    def __init__(self, intervals: Intervals) -> None:
        rays = len(intervals.beyond)
        slot = intervals.slot
        most = int(slot.max(initial=-1)) + 1
        self.inner, self.outer = np.full((most, rays), np.inf), np.full((most, rays), -np.inf)
        self.inner[slot, intervals.ray], self.outer[slot, intervals.ray] = intervals.inner, intervals.outer

    def at(self, ray: Ints, radius: Floats) -> Flags:
        held = np.zeros(ray.shape, dtype=bool)
        for inner, outer in zip(self.inner, self.outer, strict=True):
            held |= (inner[ray] <= radius) & (radius <= outer[ray])
        return held


def _within(way: Complexes, scan: tuple[float, float]) -> Flags:
    """Whether places seen from the centre of a scan lie between its first and last ray."""
    return np.asarray((np.angle(way) - scan[0]) % (2 * np.pi) <= scan[1] - scan[0])
