"""Manipulability: volume that a unit ball of drive rates fills at the output; infinite at a forward singularity."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.workspace.indices.index import Index, determinant_power, of_jacobian, power_of_length
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value


def evaluate(local: Local) -> Value:
    """sqrt(det(J J^T)), which is |det J| of a square Jacobian [Yoshikawa 1985]."""
    return np.abs(local.determinant)


INDEX = Index(
    "manipulability", "abs(det J)", of_jacobian(evaluate),
    lambda study, field: power_of_length(study, determinant_power(field)), crossing=float("inf"),
)  # fmt: skip
