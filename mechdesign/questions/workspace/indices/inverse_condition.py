"""Inverse condition number: how evenly the drives move the output, 1 where all directions are alike (isotropy)."""

from mechdesign.questions.workspace.index import Index, number, of_jacobian

INDEX = Index(
    "smallest over largest singular value of the Jacobian", of_jacobian(lambda local: local.inverse_condition),
    number, crossing=0.0, bounds=(0.0, 1.0), formula="sigma_min/sigma_max", source="S1, eq. 23",
)  # fmt: skip
