"""Smallest singular value of the Jacobian: the output's rate per unit of drive rates in the slowest direction."""

from __future__ import annotations

from mechdesign.analyses.workspace.indices.index import Index, of_jacobian, singular_value_unit
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value


def evaluate(local: Local) -> Value:
    """sigma_min."""
    return local.singular_values[0]


INDEX = Index("sigma_min", "smallest singular value of the Jacobian", of_jacobian(evaluate), singular_value_unit)
