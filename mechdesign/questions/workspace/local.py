"""The Jacobian at places of a region, from which local indices are computed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.jacobians import Jacobian
from mechdesign.region.field import LENGTH, Field, Places
from mechdesign.region.rays import Scanned


@dataclass(frozen=True, eq=False)
class Local(Jacobian):
    """The Jacobian of a field's outputs at a batch of points; `values` holds the indices computed so far."""

    configuration: Configuration
    values: dict[str, Value] = field(default_factory=dict)

    @staticmethod
    def at(field: Field, z: Complexes, places: Places) -> Local:
        """What local indices at points `z` are computed from."""
        configuration = field.configuration(z, places)
        jacobian = Jacobian.of(
            field.mechanism.linearize(configuration), field.outputs, places.get(LENGTH, field.length)
        )
        # Of a table on two slides they are the same everywhere.
        entries, homogeneous = (
            [[np.broadcast_to(entry, jacobian.shape) for entry in row] for row in rows]
            for rows in (jacobian.entries, jacobian.homogeneous)
        )
        return Local(entries, homogeneous, jacobian.shape, configuration)

    @staticmethod
    def on_rays(designs: Scanned, design: Ints, theta: Floats, radius: Floats) -> Local:
        """The same at places of rays, each of a design."""
        return Local.at(designs.field, designs.about + radius * np.exp(1j * theta), designs.of(design))
