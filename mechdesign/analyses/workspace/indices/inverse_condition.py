"""Inverse condition number: how evenly the drives move the output, 1 where all directions are alike (isotropy)."""

from __future__ import annotations

from mechdesign.analyses.workspace.indices.index import Index, number, of_jacobian
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value


def evaluate(local: Local) -> Value:
    """sigma_min/sigma_max [S1, eq. 23]."""
    return local.inverse_condition


INDEX = Index(
    "inverse_condition", "smallest over largest singular value of the Jacobian", of_jacobian(evaluate), number,
    crossing=0.0, bounds=(0.0, 1.0)
)  # fmt: skip
