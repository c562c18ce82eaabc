"""What an index is: value, unit, what it needs of the study, and how it behaves where the mechanism is singular."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.ground import indices
from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.questions.columns import power_of_length
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.workspace.local import Local
from mechdesign.region.field import Field

if TYPE_CHECKING:
    from mechdesign.study import Study

# Configurations that an index is computed from at once.
BLOCK = 4096


Evaluate = Callable[[Local], Value]


@dataclass(frozen=True)
class Index:
    """A local performance index; the docstring of its file says what it tells of a mechanism.

    Its file is read with the study's schema: what only its computation needs is imported where it is prepared.

    Parameters
    ----------
    prepare : function of a study
        Makes what evaluates it; raises `StudyError` where the study lacks what it needs.
    crossing : float or None
        What it tends to where a forward determinant vanishes inside the region (``assembly: any``); infinite if it
        grows as 1/distance; None where it stays finite.
    bounds : (float, float)
        What it can never be below or above.
    section : str
        Section of the study that it needs beside the workspace; empty where the Jacobian is enough.
    formula, source : str
        How it is computed, where `meaning` does not say that, and where it comes from.
    """

    meaning: str
    prepare: Callable[[Study], Evaluate]
    unit: Callable[[Study, Field], str]
    crossing: float | None = None
    bounds: tuple[float, float] = (0.0, float("inf"))
    section: str = ""
    formula: str = ""
    source: str = ""


@dataclass(frozen=True, eq=False)
class Prepared:
    """An index made ready for one study."""

    name: str
    index: Index
    evaluate: Evaluate = dataclasses.field(repr=False)

    def values(self, local: Local) -> Value:
        """Values at points, computed once."""
        if self.name not in local.values:
            local.values[self.name] = self.evaluate(local)
        return local.values[self.name]


def prepare(study: Study, names: Sequence[str]) -> tuple[Prepared, ...]:
    """Indices made ready for a study.

    Raises
    ------
    StudyError
        If the study lacks what one of them needs.
    """
    return tuple(Prepared(name, index, index.prepare(study)) for name in names for index in (indices.index(name),))


def of_jacobian(evaluate: Evaluate) -> Callable[[Study], Evaluate]:
    """The `prepare` of an index that the Jacobian alone gives."""
    return lambda study: evaluate


def of_configurations(evaluate: Callable[[Configuration], Floats]) -> Evaluate:
    """An index from what evaluates flat batches of assembled configurations, in blocks; nan where there is none."""

    def everywhere(local: Local) -> Floats:
        whole = local.configuration
        configuration = replace(whole, reason=np.broadcast_to(whole.reason, whole.shape))
        finite = np.ones(configuration.shape, dtype=bool)
        for node in configuration.nodes:
            finite &= np.isfinite(node)
        values = np.full(configuration.shape, np.nan)
        rows = np.nonzero(finite)
        for k in range(0, len(rows[0]), BLOCK):
            block = tuple(row[k : k + BLOCK] for row in rows)
            values[block] = evaluate(configuration.take(block))
        return values

    return everywhere


def of_compliance(study: Study, value: Callable[[Floats], Floats], free: float) -> Evaluate:
    """An index from compliances at the stiffness section's point, shape (n, size, size), to values, shape (n,).

    Parameters
    ----------
    free : float
        Its value where a twist is free.

    Raises
    ------
    StudyError
        If nothing gives: every stiffness would be infinite.
    """
    from mechdesign.questions.stiffness.body import ask, hold

    section = StiffnessSection.of(study)
    if not (section.elastic or section.actuators or section.bearings):
        message = "indices of stiffness need something that gives: elastic links, actuators or bearings"
        raise StudyError((study.problem(message, "stiffness"),))
    question = ask(study)

    def evaluate(configuration: Configuration) -> Floats:
        soft = hold(question, configuration)[0].compliance
        values = value(soft)
        return np.where(np.isnan(soft).any(axis=(1, 2)), free, values)

    return of_configurations(evaluate)


def number(study: Study, where: Field) -> str:
    """Pure number."""
    return ""


def length(study: Study, where: Field) -> str:
    """That of length."""
    return study.units.label("length")


def stiffness(study: Study, where: Field) -> str:
    """Force over length."""
    return study.units.label("stiffness")


def determinant(study: Study, where: Field) -> str:
    """That of det J: lengths of outputs over those of drives, per radian."""
    return power_of_length(study.units, determinant_power(where))


def inverse_determinant(study: Study, where: Field) -> str:
    """That of 1/det J."""
    return power_of_length(study.units, -determinant_power(where))


def determinant_power(where: Field) -> int:
    """Power of length in the determinant of a Jacobian, per radian."""
    lengths = sum(c.quantity == "length" for c in where.outputs)
    return lengths - sum(c.quantity == "length" for c in where.mechanism.forward.structure.given)


def singular_value_unit(study: Study, where: Field) -> str:
    """That of an output over that of a drive, per radian; none with a characteristic length."""
    driven = where.mechanism.forward.structure.given[0].quantity
    power = int(where.outputs[0].quantity == "length") - int(driven == "length")
    return "" if where.length is not None else power_of_length(study.units, power)
