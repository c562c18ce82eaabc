"""Inverse condition number: how evenly the drives move the output, 1 where all directions are alike (isotropy)."""

import numpy as np

from mechdesign.analyses.workspace.index import Index, number, of_jacobian
from mechdesign.analyses.workspace.local import Local
from mechdesign.mechanism.algebra import Value

# w is nearly 1 only where the index is nearly 0, far from its kink.
SINGULAR = 1e-6


def kink(local: Local) -> Value:
    """c = (1 + w)/(1 - w) - sqrt(w) 2/(1 - w)."""
    return -2 / np.maximum(1 - local.roundness, SINGULAR)


# sigma_min/sigma_max [S1, eq. 23].
INDEX = Index(
    "smallest over largest singular value of the Jacobian", of_jacobian(lambda local: local.inverse_condition),
    number, crossing=0.0, bounds=(0.0, 1.0), kink=kink,
)  # fmt: skip
