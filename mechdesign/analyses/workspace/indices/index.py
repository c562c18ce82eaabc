"""What an index is: its name, its value at points, and how it behaves where the mechanism is singular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.algebra import Value, quiet

if TYPE_CHECKING:
    from mechdesign.analyses.region.field import Field
    from mechdesign.study import Study

Evaluate = Callable[[Local], Value]


@dataclass(frozen=True)
class Index:
    """A local performance index.

    Parameters
    ----------
    name : str
        Its column, and what the study calls it.
    meaning : str
    prepare : function of a study
        Makes what evaluates it; raises `StudyError` where the study lacks what it needs.
    unit : function of a study and a field
    crossing : float or None
        What it tends to where a forward determinant vanishes inside the region (``assembly: any``); infinite if it
        grows as 1/distance; None where it stays finite.
    bounds : (float, float)
        What it can never be below or above.
    section : str
        Section of the study that it needs beside the workspace; empty where the Jacobian is enough.
    """

    name: str
    meaning: str
    prepare: Callable[[Study], Evaluate]
    unit: Callable[[Study, Field], str]
    crossing: float | None = None
    bounds: tuple[float, float] = (0.0, float("inf"))
    section: str = ""


@dataclass(frozen=True, eq=False)
class Prepared:
    """An index made ready for one study."""

    index: Index
    evaluate: Evaluate = field(repr=False)

    @property
    def name(self) -> str:
        """Name of the index."""
        return self.index.name

    @quiet
    def values(self, local: Local) -> Value:
        """Values at points, computed once."""
        if self.name not in local.found:
            local.found[self.name] = self.evaluate(local)
        return local.found[self.name]


def of_jacobian(evaluate: Evaluate) -> Callable[[Study], Evaluate]:
    """The `prepare` of an index that the Jacobian alone gives."""
    return lambda study: evaluate


def number(study: Study, where: Field) -> str:
    """The unit of pure numbers."""
    return ""


def power_of_length(study: Study, power: int) -> str:
    """The study's unit of length to a power."""
    name = "" if study.units.length == "dimensionless" else study.units.length
    text = name if abs(power) == 1 else f"{name}^{abs(power)}"
    return "" if power == 0 or not name else text if power > 0 else f"1/{text}"


def determinant_power(where: Field) -> int:
    """Power of length in the determinant of a Jacobian, per radian."""
    lengths = sum(c.quantity == "length" for c in where.outputs)
    return lengths - sum(c.quantity == "length" for c in where.mechanism.forward.structure.given)


def singular_value_unit(study: Study, where: Field) -> str:
    """Unit of a singular value: outputs by drives, or none where a characteristic length makes both lengths."""
    driven = where.mechanism.forward.structure.given[0].quantity
    power = int(where.outputs[0].quantity == "length") - int(driven == "length")
    return "" if where.length is not None else power_of_length(study, power)
