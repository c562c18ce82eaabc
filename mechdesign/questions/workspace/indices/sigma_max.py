"""Largest singular value of the Jacobian: the output's rate per unit of drive rates in the fastest direction."""

from mechdesign.questions.workspace.index import Index, of_jacobian, singular_value_unit

INDEX = Index(
    "largest singular value of the Jacobian", of_jacobian(lambda local: local.singular_values[1]),
    singular_value_unit, crossing=float("inf"),
)  # fmt: skip
