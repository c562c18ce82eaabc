"""Inverse condition number: how evenly the drives move the output, 1 where all directions are alike (isotropy)."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.workspace.indices.index import Index, number, of_jacobian
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value

# w is nearly 1 only where the index is nearly 0, far from its kink.
SINGULAR = 1e-6


def evaluate(local: Local) -> Value:
    """sigma_min/sigma_max [S1, eq. 23]."""
    return local.inverse_condition


def kink(local: Local) -> Value:
    """c = (1 + w)/(1 - w) - sqrt(w) 2/(1 - w)."""
    return -2 / np.maximum(1 - local.roundness, SINGULAR)


INDEX = Index(
    "inverse_condition", "smallest over largest singular value of the Jacobian", of_jacobian(evaluate), number,
    crossing=0.0, bounds=(0.0, 1.0), kink=kink,
)  # fmt: skip
