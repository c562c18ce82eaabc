"""Largest singular value of the Jacobian: the output's rate per unit of drive rates in the fastest direction."""

import numpy as np

from mechdesign.analyses.workspace.index import Index, of_jacobian, singular_value_unit

# sigma_max = a + a sqrt(w) with a = (sigma_max + sigma_min)/2.
INDEX = Index(
    "largest singular value of the Jacobian", of_jacobian(lambda local: local.singular_values[1]),
    singular_value_unit, crossing=float("inf"), kink=lambda local: 0.5 * np.add(*local.singular_values),
)  # fmt: skip
