"""Resistivity: how little the output moves when the drives do; infinite where a leg is stretched or folded."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.workspace.indices.index import Index, determinant_power, of_jacobian, power_of_length
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value


def evaluate(local: Local) -> Value:
    """1/|det J| [S1, eq. 25]."""
    return 1 / np.abs(local.determinant)


INDEX = Index(
    "resistivity", "1/abs(det J)", of_jacobian(evaluate),
    lambda study, field: power_of_length(study, -determinant_power(field)), crossing=0.0,
)  # fmt: skip
