"""One region that the point reaches, with all that its tables, warnings and pictures tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.analyses.region.curves import Patch, patches_of_pieces
from mechdesign.analyses.region.pieces import Pieces
from mechdesign.analyses.region.rays import BATCH, SINGLE, Effort
from mechdesign.analyses.region.regions import RAYS
from mechdesign.analyses.workspace.answer import Evaluation, answer
from mechdesign.analyses.workspace.boundary import Boundary, boundary_of
from mechdesign.analyses.workspace.index import Local, Prepared
from mechdesign.analyses.workspace.inscribed import INSCRIBED, inscribed
from mechdesign.analyses.workspace.quadrature import integrate
from mechdesign.analyses.workspace.question import OF_RANGE, Question
from mechdesign.analyses.workspace.ranged import Ranged
from mechdesign.analyses.workspace.singularities import Locus, around, causes, inside, singular_everywhere
from mechdesign.errors import AssemblyError
from mechdesign.numerics.arrays import Complexes, Floats, Ints

# How finely a region over a range is looked for; its margins cost a hundred times as much.
OVER_RANGE = Effort(48, 16, 96)
# Relative accuracy of the area that lies in the other assembly.
LOOSE = 1e-3


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


@dataclass(frozen=True, eq=False)
class Reached:
    """A region as the study asks for it; one that is empty has no patches, and none of what follows from them.

    Parameters
    ----------
    answer : Evaluation
    singular : bool
        Whether every pose is a forward singularity; indices have no value then, and all assemblies count.
    areas : sequence of float
        Area of each piece.
    beyond : float
        Area that lies in the other assembly; 0 where that is not looked for, or has no end.
    shapes : ndarray
        The largest circle and rectangle inside, as `INSCRIBED` names them; nan where they were not found.
    loci : sequence of Locus
        Curves of singularities inside the region and around it.
    """

    question: Question
    answer: Evaluation
    singular: bool = False
    patches: Sequence[Patch] = ()
    areas: Sequence[float] = ()
    beyond: float = 0.0
    shapes: Floats = field(default_factory=lambda: np.full(len(INSCRIBED), np.nan))
    loci: Sequence[Locus] = ()
    boundary: Boundary | None = None
    nodes: Nodes | None = None


def reach(question: Question) -> Reached:
    """Everything about one region.

    Raises
    ------
    AssemblyError
        If the region has no end.
    """
    if isinstance(question.field, Ranged):
        return _over_range(question)
    singular = singular_everywhere(question.field)
    if singular:
        question = replace(question, field=replace(question.field, same_assembly=False))
        given = answer(replace(question, indices=(), wanted=OF_RANGE), {}, 1, SINGLE)
        nothing = {name: np.full(1, np.nan) for name in question.wanted}
        given = replace(given, values=nothing | given.values, errors=nothing | given.errors)
    else:
        given = answer(question, {}, 1, SINGLE)
    if not given.panels.closes[0]:
        return Reached(question, given, singular, beyond=_beyond(question, ()))
    assert given.pieces is not None
    field, told = question.field, causes(question.field)
    patches = patches_of_pieces(given.pieces, question.rays or RAYS)
    areas = _areas(question, given, given.pieces)
    own = [patch for patch in patches if patch.piece == 1 or not field.same_assembly]
    others = [patch for patch in patches if patch not in own]
    return Reached(
        question, given, singular, patches, areas, _beyond(question, areas),
        shapes=inscribed(field, question.scan, own, others),
        loci=[*([] if singular else inside(field, patches)), *around(told, patches)],
        boundary=boundary_of(field, patches, [words for _, words in told]),
        nodes=_nodes(question, patches),
    )  # fmt: skip


def _over_range(question: Question) -> Reached:
    """The region over a range of a held coordinate: its area, its pieces and its boundary."""
    given, over = answer(question, {}, 1, OVER_RANGE), question.field
    if not given.panels.closes[0]:
        return Reached(question, given)
    assert isinstance(over, Ranged)
    assert given.pieces is not None
    patches = patches_of_pieces(given.pieces, question.rays or RAYS)
    single = [words for _, words in causes(over.sliced)]
    told = [*single * 3, *(f"{a} and {b}" for a in single for b in single)]
    areas = _areas(question, given, given.pieces)
    return Reached(question, given, patches=patches, areas=areas, boundary=boundary_of(over, patches, told))


def _areas(question: Question, given: Evaluation, pieces: Pieces) -> list[float]:
    """Area of each piece of a region."""
    whole = float(given.values["area"][0])
    if pieces.number[0] == 1:
        return [whole]
    none = np.zeros((0, 1), dtype=bool)
    return [float(integrate(part, question.tolerance, question.scan, (), none, whole).area[0]) for part in pieces.all()]


def _beyond(question: Question, areas: Sequence[float]) -> float:
    """Area that lies in the other assembly, beside the pieces in the sketch's.

    It is looked for as loosely as of a design of many.
    """
    assembly = [name for _, name in question.field.labels if name.startswith("assembly ")]
    if not assembly:
        return 0.0
    both = replace(question.field, same_assembly=False)
    every = replace(question, field=both, indices=(), wanted=("area",), rule="gauss", tolerance=LOOSE)
    try:
        return float(answer(every, {}, 1, BATCH).values["area"][0]) - sum(areas)
    except AssemblyError:
        # In the other assembly the region has no end.
        return 0.0


def _nodes(question: Question, patches: Sequence[Patch]) -> Nodes:
    """Local indices at the nodes of the patches."""
    grids = [patch.grid for patch in patches]
    z = np.concatenate([grid.ravel() for grid in grids])
    local = Local.at(question.field, z, {})
    owner = np.repeat(np.arange(len(grids)), [grid.size for grid in grids])
    determinant = np.broadcast_to(local.determinant, z.shape)
    if question.field.same_assembly:
        # It has one sign all over a patch; at a tip where no node is off the boundary rounding would choose another.
        middle = Local.at(question.field, np.array([patch.middle for patch in patches]), {}).determinant
        determinant = np.copysign(determinant, np.broadcast_to(middle, len(patches))[owner])
    return Nodes(
        z, determinant, [(index, np.broadcast_to(index.values(local), z.shape)) for index in question.shown], owner,
        np.concatenate([np.repeat(np.arange(len(grid)), grid.shape[1]) for grid in grids]),
        np.concatenate([np.tile(np.arange(grid.shape[1]), len(grid)) for grid in grids]),
        np.array([patch.piece for patch in patches])[owner],
    )  # fmt: skip
