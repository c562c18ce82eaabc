"""The Jacobian of some coordinates with respect to the drives, and what its entries say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.outputs import first

Entries = Sequence[Sequence[Value]]


def mixes(rows: Sequence[Coordinate], columns: Sequence[Coordinate]) -> bool:
    """Whether a Jacobian's rows, or its columns, have different units, so that its norm means nothing."""
    return len({c.quantity for c in rows}) > 1 or len({c.quantity for c in columns}) > 1


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Derivatives of coordinates (rows) by the drives (columns), which broadcast to the batch's shape.

    `entries` are per radian; in `homogeneous` angles count as arcs of a characteristic length, if there is one.
    """

    entries: Entries
    homogeneous: Entries
    shape: tuple[int, ...]

    @staticmethod
    def of(linear: Linearization, rows: Sequence[Coordinate], length: Value | None = None) -> Jacobian:
        """The Jacobian at configurations; with `length`, the arc of one radian, angles count as lengths."""
        drives = linear.structure.given
        entries = [[first(linear.configuration, row, rates) for rates in linear.by_drives] for row in rows]
        if length is None:
            return Jacobian(entries, entries, linear.configuration.shape)
        up, down = ([length if c.quantity == "angle" else 1.0 for c in side] for side in (rows, drives))
        arcs = [[entry * (u / d) for entry, d in zip(line, down, strict=True)]
                for line, u in zip(entries, up, strict=True)]  # fmt: skip
        return Jacobian(entries, arcs, linear.configuration.shape)

    @cached_property
    def matrix(self) -> Floats:
        """The entries as an array of shape (..., rows, drives)."""
        return _matrix(self.entries, self.shape)

    @cached_property
    def determinant(self) -> Value:
        """Determinant of a square Jacobian per radian; nan where an entry is nan."""
        return self._determinant(self.entries)

    def _determinant(self, entries: Entries) -> Value:
        if len(entries) == 1:
            return entries[0][0]
        if len(entries) == 2:
            (a, b), (c, d) = entries
            return a * d - b * c
        matrix = _matrix(entries, self.shape)
        finite = np.asarray(np.isfinite(matrix).all(axis=(-1, -2)))
        matrix = np.where(finite[..., None, None], matrix, 0.0)
        determinant = np.asarray(np.linalg.det(matrix))
        # Elimination may leave exactly 0 where entries are as large as at a forward singularity met to rounding: the
        # product of the singular values stays large there, and 0 where the rates of the output vanish.
        if (zero := finite & (determinant == 0)).any():
            determinant[zero] = np.linalg.svd(matrix[zero], compute_uv=False).prod(axis=-1)
        return np.where(finite, determinant, np.nan)

    @cached_property
    def inverse_condition(self) -> Value:
        """Smallest over largest singular value, 0 at a singularity; nan where an entry is."""
        if len(self.homogeneous) == 2:
            # ||J||_F^2 / |det J| is s = sigma_max/sigma_min and its inverse added [S1, eq. 8], 2 at isotropy.
            (a, b), (c, d) = self.homogeneous
            size = self.determinant if self.homogeneous is self.entries else self._determinant(self.homogeneous)
            # Its excess over 2 as a sum of squares, which keeps its digits near isotropy.
            more = np.where(size > 0, (a - d) ** 2 + (b + c) ** 2, (a + d) ** 2 + (b - c) ** 2) / np.abs(size)
            return 2 / (2 + more + np.sqrt(more * (more + 4)))
        least, largest = self.singular_values
        return np.where(largest > 0, least / largest, 0.0 * largest)

    @cached_property
    def singular_values(self) -> tuple[Value, Value]:
        """Smallest and largest singular value; nan where an entry is."""
        if len(self.homogeneous) == 1:
            return np.abs(self.homogeneous[0][0]), np.abs(self.homogeneous[0][0])
        if len(self.homogeneous) == 2:
            (a, b), (c, d) = self.homogeneous
            size = a * d - b * c
            # The sum of the squared entries less and more twice the determinant's size, as sums of squares.
            one, two = np.sqrt((a - d) ** 2 + (b + c) ** 2), np.sqrt((a + d) ** 2 + (b - c) ** 2)
            largest, size = 0.5 * (one + two), np.abs(size)
            return size / largest, largest
        matrix = _matrix(self.homogeneous, self.shape)
        finite = np.asarray(np.isfinite(matrix).all(axis=(-1, -2)))
        values = np.linalg.svd(np.where(finite[..., None, None], matrix, 0.0), compute_uv=False)
        return np.where(finite, values[..., -1], np.nan), np.where(finite, values[..., 0], np.nan)


def _matrix(entries: Entries, shape: tuple[int, ...]) -> Floats:
    return np.stack([np.stack([np.broadcast_to(e, shape) for e in row], axis=-1) for row in entries], axis=-2)
