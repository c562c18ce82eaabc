"""Resistivity: how little the output moves when the drives do; infinite where a leg is stretched or folded."""

import numpy as np

from mechdesign.analyses.workspace.index import Index, determinant_power, of_jacobian, power_of_length

# [S1, eq. 25]
INDEX = Index(
    "1/abs(det J)", of_jacobian(lambda local: 1 / np.abs(local.determinant)),
    lambda study, field: power_of_length(study, -determinant_power(field)), crossing=0.0,
)  # fmt: skip
