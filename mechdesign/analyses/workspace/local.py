"""What local indices are computed from: the mechanism at points of its region, and its Jacobian there."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field as dataclass_field

import numpy as np

from mechdesign.analyses.region.field import Field, Places
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.derivatives import Jacobian
from mechdesign.numerics.arrays import Complexes


@dataclass(frozen=True, eq=False)
class Local(Jacobian):
    """The Jacobian of a field's outputs at a batch of points.

    Parameters
    ----------
    configuration : Configuration
    found : dict
        Values of indices that were computed already, by name.
    """

    configuration: Configuration
    found: dict[str, Value] = dataclass_field(default_factory=dict)

    @staticmethod
    def at(field: Field, z: Complexes, places: Places) -> Local:
        """What local indices at points `z` are computed from."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            configuration = field.configuration(z, places)
            jacobian = Jacobian.of(field.mechanism.linearize(configuration), field.outputs, field.length)
            return Local(jacobian.entries, jacobian.homogeneous, jacobian.shape, configuration)
