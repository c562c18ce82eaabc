"""Local indices on a grid that follows the boundary of a region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.questions.workspace.index import Prepared
from mechdesign.questions.workspace.local import Local
from mechdesign.region.field import Field
from mechdesign.region.patches import Patch


@dataclass(frozen=True, eq=False)
class Nodes:
    """Local indices at the nodes of a region's patches.

    Parameters
    ----------
    z : ndarray of complex, shape (nodes,)
    determinant : ndarray, shape (nodes,)
        That of the Jacobian.
    values : sequence of (Prepared, ndarray)
        Each local index and its values, shape (nodes,).
    patch, ray, node, piece : ndarray of int, shape (nodes,)
        Number of the patch, of the ray in it, of the node along the ray, and of the patch's piece.
    """

    z: Complexes
    determinant: Floats
    values: Sequence[tuple[Prepared, Floats]]
    patch: Ints
    ray: Ints
    node: Ints
    piece: Ints


def nodes_of(field: Field, indices: Sequence[Prepared], patches: Sequence[Patch]) -> Nodes:
    """Local indices at the nodes of the patches."""
    grids = [patch.grid for patch in patches]
    z = np.concatenate([grid.ravel() for grid in grids])
    local = Local.at(field, z, {})
    owner = np.repeat(np.arange(len(grids)), [grid.size for grid in grids])
    determinant = np.broadcast_to(local.determinant, z.shape)
    if field.same_assembly:
        # It has one sign all over a patch; at a tip where no node is off the boundary rounding would choose another.
        middle = Local.at(field, np.array([patch.middle for patch in patches]), {}).determinant
        determinant = np.copysign(determinant, np.broadcast_to(middle, len(patches))[owner])
    return Nodes(
        z, determinant, [(index, np.broadcast_to(index.values(local), z.shape)) for index in indices], owner,
        np.concatenate([np.repeat(np.arange(len(grid)), grid.shape[1]) for grid in grids]),
        np.concatenate([np.tile(np.arange(grid.shape[1]), len(grid)) for grid in grids]),
        np.array([patch.piece for patch in patches])[owner],
    )  # fmt: skip
