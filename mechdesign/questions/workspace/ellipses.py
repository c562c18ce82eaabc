"""Places over a region at which a picture shows the Jacobian as ellipses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.questions.workspace.local import Local
from mechdesign.region.field import Field
from mechdesign.region.patches import Patch

# Places wanted, at least; lattices are tried from coarse to fine, by how many places they have in the box around.
ENOUGH = 24
LATTICES = range(36, 1200, 12)
# So far from the boundary, as a part of the lattice's step, for an ellipse is no point.
CLEAR = 0.4


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Jacobians of a point by two drives at some places of its region.

    Parameters
    ----------
    places : ndarray of complex, shape (n,)
    matrices : ndarray, shape (n, 2, 2)
        Velocity of the point (x, y) by the rates of the drives, angles as arcs where there is a characteristic length,
        as of the singular values.
    spacing : float
        Distance of neighbouring places.
    """

    places: Complexes
    matrices: Floats
    spacing: float


def ellipses(field: Field, patches: Sequence[Patch]) -> Ellipses | None:
    """Jacobians on a square lattice of some thirty places; None where more is given than the point's place."""
    if len(field.outputs) != 2:
        return None
    edge = np.concatenate([
        patch.about + radius * np.exp(1j * patch.theta)
        for patch in patches for radius in (patch.inner, patch.outer)
    ])  # fmt: skip
    low, high = complex(edge.real.min(), edge.imag.min()), complex(edge.real.max(), edge.imag.max())
    size = high - low
    around = CLEAR * np.append(0.0, np.exp(0.25j * np.pi * np.arange(8)))
    places, spacing = np.zeros(0, dtype=complex), 0.0
    for number in LATTICES:
        spacing = float(np.sqrt(size.real * size.imag / number))
        x, y = (np.arange(count) - (count - 1) / 2 for count in (int(size.real / spacing), int(size.imag / spacing)))
        lattice = (low + high) / 2 + spacing * (x[:, None] + 1j * y).ravel()
        held = np.zeros((len(lattice), len(around)), dtype=bool)
        for patch in patches:
            held |= patch.holds(np.asarray(lattice[:, None] + spacing * around, dtype=complex))
        places = lattice[held.all(axis=1)]
        if len(places) >= ENOUGH:
            break
    local = Local.at(field, places, {})
    matrices = replace(local, entries=local.homogeneous).matrix
    finite = np.isfinite(matrices).all(axis=(1, 2))
    return Ellipses(places[finite], matrices[finite], spacing)
