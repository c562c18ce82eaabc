"""Smallest singular value of the Jacobian: the output's rate per unit of drive rates in the slowest direction."""

import numpy as np

from mechdesign.analyses.workspace.index import Index, of_jacobian, singular_value_unit

# sigma_min = a - a sqrt(w) with a = (sigma_max + sigma_min)/2.
INDEX = Index(
    "smallest singular value of the Jacobian", of_jacobian(lambda local: local.singular_values[0]),
    singular_value_unit, kink=lambda local: -0.5 * np.add(*local.singular_values),
)  # fmt: skip
