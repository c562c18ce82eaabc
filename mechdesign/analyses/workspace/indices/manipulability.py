"""Manipulability: volume that a unit ball of drive rates fills at the output; infinite at a forward singularity."""

import numpy as np

from mechdesign.analyses.workspace.index import Index, determinant_power, of_jacobian, power_of_length

# sqrt(det(J J^T)), which is |det J| of a square Jacobian [Yoshikawa 1985].
INDEX = Index(
    "abs(det J)", of_jacobian(lambda local: np.abs(local.determinant)),
    lambda study, field: power_of_length(study, determinant_power(field)), crossing=float("inf"),
)  # fmt: skip
