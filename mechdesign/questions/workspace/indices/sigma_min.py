"""Smallest singular value of the Jacobian: the output's rate per unit of drive rates in the slowest direction."""

from mechdesign.questions.workspace.index import Index, of_jacobian, singular_value_unit

INDEX = Index(
    "smallest singular value of the Jacobian", of_jacobian(lambda local: local.singular_values[0]), singular_value_unit
)
