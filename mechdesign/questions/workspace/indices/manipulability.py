"""Manipulability: volume that a unit ball of drive rates fills at the output; infinite at a forward singularity."""

import numpy as np

from mechdesign.questions.workspace.index import Index, determinant, of_jacobian

INDEX = Index(
    "abs(det J)", of_jacobian(lambda local: np.abs(local.determinant)),
    determinant, crossing=float("inf"), formula="sqrt(det(J J^T))", source="Yoshikawa 1985",
)  # fmt: skip
