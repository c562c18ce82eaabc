"""Resistivity: how little the output moves when the drives do; infinite where a leg is stretched or folded."""

import numpy as np

from mechdesign.questions.workspace.index import Index, inverse_determinant, of_jacobian

INDEX = Index(
    "1/abs(det J)", of_jacobian(lambda local: 1 / np.abs(local.determinant)),
    inverse_determinant, crossing=0.0, source="S1, eq. 25",
)  # fmt: skip
