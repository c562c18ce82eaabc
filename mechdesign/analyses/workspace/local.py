"""What local indices are computed from: the mechanism at points of its region, and its Jacobian there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import cached_property

import numpy as np

from mechdesign.analyses import jacobians
from mechdesign.analyses.region.field import Field, Places
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.rates import Rates
from mechdesign.numerics.arrays import Complexes, Floats

Entries = Sequence[Sequence[Value]]


@dataclass(frozen=True, eq=False)
class Local:
    """A mechanism at a batch of points.

    What several indices share is computed once.

    Parameters
    ----------
    configuration : Configuration
    jacobian : n rows of n arrays
        Derivatives of outputs by drives, per radian; entries broadcast to the shape of the configuration.
    homogeneous : n rows of n arrays
        The same with angles turned into lengths, where a characteristic length is given.
    found : dict
        Values of indices that were computed already, by name.
    """

    configuration: Configuration
    jacobian: Entries
    homogeneous: Entries
    found: dict[str, Value] = dataclass_field(default_factory=dict)

    @staticmethod
    def at(field: Field, z: Complexes, places: Places) -> Local:
        """What local indices at points `z` are computed from."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            configuration = field.configuration(z, places)
            return Local(configuration, *_jacobians(field, configuration))

    @cached_property
    @quiet
    def determinant(self) -> Value:
        """Determinant of the Jacobian."""
        if len(self.jacobian) == 2:
            (a, b), (c, d) = self.jacobian
            return a * d - b * c
        return jacobians.determinant(_matrix(self.jacobian))

    @cached_property
    @quiet
    def twice(self) -> Value:
        """||J||_F^2 / |det J| of two rows: sigma_max/sigma_min and its inverse added [S1, eq. 8]; 2 at isotropy."""
        (a, b), (c, d) = self.homogeneous
        size = self.determinant if self.homogeneous is self.jacobian else a * d - b * c
        return (a * a + b * b + c * c + d * d) / np.abs(size)

    @cached_property
    @quiet
    def inverse_condition(self) -> Value:
        """Smallest over largest singular value."""
        if len(self.homogeneous) == 2:
            return jacobians.of_two(self.twice)
        least, largest = self.singular_values
        return np.where(largest > 0, least / largest, 0.0 * largest)

    @cached_property
    @quiet
    def singular_values(self) -> tuple[Value, Value]:
        """Smallest and largest singular value; nan where an entry is."""
        if len(self.homogeneous) == 2:
            (a, b), (c, d) = self.homogeneous
            size = np.abs(a * d - b * c)
            square = a * a + b * b + c * c + d * d
            largest = 0.5 * (np.sqrt(square + 2 * size) + np.sqrt(np.maximum(square - 2 * size, 0.0)))
            return size / largest, largest
        matrix = _matrix(self.homogeneous)
        finite = np.asarray(np.isfinite(matrix).all(axis=(-1, -2)))
        values = np.linalg.svd(np.where(finite[..., None, None], matrix, 0.0), compute_uv=False)
        return np.where(finite, values[..., -1], np.nan), np.where(finite, values[..., 0], np.nan)

    @cached_property
    @quiet
    def roundness(self) -> Value:
        """w = ((sigma_max - sigma_min)/(sigma_max + sigma_min))^2, which is smooth where the two meet (w = 0)."""
        if len(self.homogeneous) == 2:
            return np.maximum(self.twice - 2, 0.0) / (self.twice + 2)
        return ((1 - self.inverse_condition) / (1 + self.inverse_condition)) ** 2


def _matrix(entries: Entries) -> Floats:
    shape = np.broadcast_shapes(*(np.shape(entry) for row in entries for entry in row))
    return np.stack([np.stack([np.broadcast_to(e, shape) for e in row], axis=-1) for row in entries], axis=-2)


def _jacobians(field: Field, configuration: Configuration) -> tuple[Entries, Entries]:
    """The Jacobian per radian, and with angles as lengths where there is a characteristic length."""
    mechanism, outputs, length = field.mechanism, field.outputs, field.length
    linear = mechanism.linearize(configuration)
    rest = [0.0] * len(linear.structure.edges)
    drives = linear.structure.given
    columns: list[Rates] = [linear.solve([float(j == k) for j in range(len(drives))], rest) for k in range(len(drives))]
    jacobian: list[list[Value]] = [[first(configuration, out, rates) for rates in columns] for out in outputs]
    if length is None:
        return jacobian, jacobian
    rows = [length if out.quantity == "angle" else 1.0 for out in outputs]
    scale = [1 / length if drive.quantity == "angle" else 1.0 for drive in drives]
    return jacobian, [[entry * r * c for entry, c in zip(row, scale, strict=True)]
                      for row, r in zip(jacobian, rows, strict=True)]  # fmt: skip
