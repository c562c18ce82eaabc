"""One region that the point reaches, with all that its tables, warnings and pictures tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.workspace.answer import Evaluation, answer, area_in_any_assembly, areas
from mechdesign.questions.workspace.inscribed import INSCRIBED, inscribed
from mechdesign.questions.workspace.question import Question
from mechdesign.questions.workspace.singularities import Locus, loci
from mechdesign.region.any_mode import in_any_assembly
from mechdesign.region.patches import Patch, patches_of_pieces
from mechdesign.region.rays import SINGLE
from mechdesign.region.regions import RAYS

# What a region has whose every pose is singular.
OF_AREA = ("SUI", "area", "box_area")


@dataclass(frozen=True, eq=False)
class Reached:
    """A region as the study asks for it; one that is empty has no patches, and none of what follows from them.

    Parameters
    ----------
    singular : bool
        Whether every pose is a forward singularity; indices have no value then, and all assemblies count.
    areas : sequence of float
        Area of each piece.
    everywhere : float
        Area in both assemblies; 0 where that is not looked for, or has no end.
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
    everywhere: float = 0.0
    shapes: Floats = field(default_factory=lambda: np.full(len(INSCRIBED), np.nan))
    loci: Sequence[Locus] = ()

    @property
    def beyond(self) -> float:
        """Area that lies in the other assembly, if any."""
        return self.everywhere - sum(self.areas)


def reach(question: Question) -> Reached:
    """Everything about one region.

    Raises
    ------
    AssemblyError
        If the region has no end.
    """
    singular = question.field.singular_everywhere
    if singular:
        question = replace(question, field=in_any_assembly(question.field))
        evaluation = answer(replace(question, indices=(), columns=OF_AREA), {}, 1, SINGLE)
        nothing = {name: np.full(1, np.nan) for name in question.columns}
        evaluation = replace(evaluation, values=nothing | evaluation.values, errors=nothing | evaluation.errors)
    else:
        evaluation = answer(question, {}, 1, SINGLE)
    everywhere = area_in_any_assembly(question)
    if not evaluation.panels.closes[0] or evaluation.pieces is None:
        return Reached(question, evaluation, singular, everywhere=everywhere)
    field, parts = question.field, list(evaluation.pieces.all())
    pieces = areas(question, evaluation, parts)
    patches = patches_of_pieces(evaluation.pieces.panels, parts, question.rays or RAYS)
    return Reached(
        question, evaluation, singular, patches, pieces, everywhere,
        shapes=np.concatenate(list(inscribed(evaluation.panels).values())),
        loci=loci(field, patches, singular=singular),
    )  # fmt: skip
