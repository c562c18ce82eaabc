"""Whether given coordinates determine a mechanism: the equations of each of its groups must not depend on each other.

A perfect matching of equations and unknowns is necessary, but not enough: in two dimensions a part may be joined
within itself too often while another floats, and every count still fits. So the rank of each group's equations
is taken for dimensions drawn at random.
"""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from mechdesign.mechanism.rigidity import TRIES, Equations, null_space
from mechdesign.mechanism.structure import Group, Structure, Undetermined
from mechdesign.numerics.arrays import Floats


def check_independent(equations: Equations, structure: Structure) -> None:
    """Check the groups without a closed form for equations that depend on each other whatever the dimensions.

    Each group is judged by itself, as what is nearly singular grows from group to group along a train; and by several
    draws, as chance can make a draw singular, though never a singular group regular. So the verdict does not hang on
    which unknown is drawn first.

    Raises
    ------
    Undetermined
        If there are any: a part that floats is joined within itself too often, and another is free.
    """
    draw = cache(partial(equations.drawn, structure.given))
    for group in structure.groups:
        if group.form != "newton":
            continue
        rows, moved = _block(equations, structure, group)
        singular = False
        for seed in range(TRIES):
            block = draw(seed)[rows] @ moved
            # A given expression may have no value at what is drawn, which says nothing.
            if np.isfinite(block).all():
                singular = null_space(block).shape[1] > 0
                if not singular:
                    break
        if singular:
            raise Undetermined("the given coordinates fix one part of the mechanism twice and leave another free")


def _block(equations: Equations, structure: Structure, group: Group) -> tuple[list[int], Floats]:
    """Rows of the Jacobian that a group solves; and what moves with each of its unknowns, shape (all, own).

    A given distance is a single row, whatever the direction of the link that stands for it in the structure.
    """
    graph, spans = equations.graph, dict(structure.spans)
    edges = sorted({k for loop in group.loops for k, _ in loop.edges} | {k for k, _ in group.tree})
    rows = [2 * k + part for k in edges if k not in spans for part in (0, 1)]
    scalars = (*group.conditions, *(spans[k] for k in edges if k in spans))
    rows += [2 * len(graph.edges) + which for which in scalars]
    together: dict[int, list[int]] = {angle: [] for angle in group.angles if angle < graph.classes}
    for frame in range(1, graph.classes):
        if structure.ties[frame].root in together:
            together[structure.ties[frame].root].append(frame - 1)
    columns = [*together.values(), *([equations.angles + slide] for slide in group.slides)]
    placed = [structure.edges[k].head if sign > 0 else structure.edges[k].tail for k, sign in group.tree]
    for node in (*placed, *group.bases):
        x = equations.inner + node - 1
        columns += [[x], [x + len(graph.nodes) - 1]]
    moved = np.zeros((equations.inner + 2 * (len(graph.nodes) - 1), len(columns)))
    for k, column in enumerate(columns):
        moved[column, k] = 1
    return rows, moved
