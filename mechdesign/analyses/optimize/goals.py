"""What designs are compared by: a number of the workspace, the worst row of any column, or an expression."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechdesign.analyses.kinematics.along import Along
from mechdesign.analyses.kinematics.analysis import A_ROW_A_POSE
from mechdesign.analyses.workspace.contained import Shape
from mechdesign.analyses.workspace.question import COLUMNS, split
from mechdesign.commands import COMMANDS
from mechdesign.expressions import Expression
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Result
from mechdesign.rows import Chosen, choose, worst
from mechdesign.study import Study
from mechdesign.study.schema.optimize import Condition, Containment, OptimizeSection
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import text_of

# A shape that fits but for this part of its size is contained.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Goal:
    """What is maximised, minimised or bounded: a number of the workspace, the worst row of a column, or an expression.

    Parameters
    ----------
    name : str
        As the study gives it; of a condition with its bound.
    column : str
        As `mechdesign.rows.choose` understands it; of an expression its text.
    smallest : bool
        Whether the largest row is the worst one; of a condition, whether its bound is an upper one.
    absolute : bool
        Judge absolute values.
    where : tuple of (str, object)
        Only rows whose columns have these values count.
    unassembled : bool
        Whether poses that are not valid are left out; else they make a design infeasible.
    shape : Shape, optional
        What the workspace is to hold; the largest scale at which it does is judged.
    gate : bool
        Whether it is a condition, which has to hold between the poses of a motion, too; of a goal the rows count.
    """

    name: str
    command: str
    column: str
    smallest: bool = False
    absolute: bool = False
    where: tuple[tuple[str, object], ...] = ()
    bound: float = 0.0
    unassembled: bool = False
    expression: Expression | None = None  # over parameters, which no command computes: its word is empty then
    shape: Shape | None = None
    gate: bool = False

    @property
    def regional(self) -> bool:
        """Whether it is a number of the whole workspace."""
        found = self.shape is not None or self.column in COLUMNS or bool(split(self.column)[0])
        return self.command == "workspace" and found and not self.where

    def margin(self, values: Floats) -> Floats:
        """By how much values keep the bound, negative where they do not."""
        return self.bound - values if self.smallest else values - self.bound

    def met(self, values: Floats) -> Flags:
        """Which values keep the bound; nan never does."""
        return self.margin(values) >= 0

    def judge(self, result: Result, designs: int = 1, along: Along | None = None) -> Judgement:
        """The value of each design, and the rows that make it.

        Parameters
        ----------
        result : Result
            Of several designs, as many rows of each, one design after the other.
        along : Along, optional
            Their motions between the poses, which the result of a single design knows itself.

        Raises
        ------
        UnknownColumnError
            If the result has no such column.
        """
        chosen = choose(result, self.column, dict(self.where))
        counts = chosen.counts
        if self.unassembled and "valid" in chosen.table:
            counts = counts & chosen.table["valid"].astype(bool)
        shape = designs, len(chosen.values) // designs
        values, counts = chosen.values.reshape(shape), counts.reshape(shape)
        found = worst(np.abs(values) if self.absolute else values, counts, largest=self.smallest)
        if chosen.table.name == "targets" and chosen.column == "rms" and "motion" in result.tables:
            outputs = {str(name) for name in chosen.table["output"][chosen.counts]}
            if len(outputs) == 1:
                return Judgement(found, _errors(result, outputs.pop(), designs), squares=True)
        alike = designs > 0 and np.ptp(counts.sum(axis=1)) == 0
        rows = values[counts].reshape(designs, -1) if alike else None
        between = self._between(chosen, along) if self.gate and not self.where else None
        if between is not None:
            take = np.fmax if self.smallest else np.fmin
            found = np.where(np.isnan(found), found, take(found, np.abs(between) if self.absolute else between))
            between = np.where(np.isnan(between), found, between)
            rows = None if rows is None else np.column_stack([rows, between])
        return Judgement(found, rows)

    def _between(self, chosen: Chosen, along: Along | None) -> Floats | None:
        """The worst value of each design's motion between its poses, where that is known."""
        sign = 1 if self.smallest else -1
        if along is not None and chosen.table.name in A_ROW_A_POSE and along.follows(chosen.column):
            return along.worst(chosen.column, sign, absolute=self.absolute)[0]
        scope = chosen.table.scope
        value = scope.worst(chosen.column, sign, self.absolute) if scope is not None and scope.worst else None
        return None if value is None else np.array([value[0]])


class Judgement(NamedTuple):
    """What a goal is for some designs.

    Parameters
    ----------
    values : ndarray, shape (designs,)
        The worst of the rows, of a condition also of the motion between them; nan where none counts or has no value.
    rows : ndarray, shape (designs, rows), or None
        The signed rows that count, then of a condition the worst between them; None where these are not as many in each
        design. Of a root mean square over targets, where the result has the motion, errors whose squares have about its
        square as their sum.
    squares : bool
        Whether the rows are such errors.
    """

    values: Floats
    rows: Floats | None
    squares: bool = False


def _errors(result: Result, output: str, designs: int) -> Floats:
    """Errors of an output's target, 0 where it has none, over the root of the number of poses that have it."""
    motion = result.tables["motion"]
    parts = [f"{output}_error"] if f"{output}.x_error" not in motion else [f"{output}.{k}_error" for k in "xy"]
    errors = np.stack([motion[name].reshape(designs, -1) for name in parts], axis=1)
    known = np.isfinite(errors)
    number = np.maximum(known[:, 0].sum(axis=1), 1)
    return np.asarray(np.where(known, errors, 0.0) / np.sqrt(number)[:, None, None]).reshape(designs, -1)


def goal(
    result: str | Expression, *, smallest: bool = False, where: Mapping[str, object] | None = None,
    absolute: bool = False, unassembled: bool = False,
) -> Goal:  # fmt: skip
    """Read a result's name, such as ``GII``, ``stiffness.k_min``, ``kinematics.extremes.C.x.range``.

    Of an error the absolute value counts in any case.
    """
    name, command, column, expression = _parts(result)
    rows = tuple((where or {}).items())
    title = f"{name} ({', '.join(f'{key} {value}' for key, value in rows)})" if rows else name
    absolute = absolute or (expression is None and column.endswith("_error"))
    return Goal(title, command, column, smallest, absolute, rows, 0.0, unassembled, expression)


def goals_of(section: OptimizeSection) -> dict[Goal, KeyPath]:
    """What a section maximises, then what it minimises, and where it says so."""
    return {
        goal(
            judged.result, smallest=key == "minimize", where=judged.where, absolute=judged.abs,
            unassembled=judged.unassembled is not None,
        ): ("optimize", key, k)
        for key in ("maximize", "minimize")
        for k, judged in enumerate(getattr(section, key))
    }  # fmt: skip


def conditions_of(section: OptimizeSection) -> dict[Goal, KeyPath]:
    """The worst rows that a section's conditions judge, and where it says so."""
    given = enumerate(section.subject_to)
    return {each: ("optimize", "subject_to", k) for k, condition in given for each in bounds_of(condition)}


def bounds_of(condition: Condition | Containment) -> Iterator[Goal]:
    """The worst rows that a condition judges, one for each of its bounds; or the scale at which a shape is held."""
    if isinstance(condition, Containment):
        outline = condition.contains
        width, height = outline.rectangle or (outline.circle, outline.circle)
        assert width is not None
        assert height is not None
        centre = None if outline.center is None else complex(*(each.nominal for each in outline.center))
        factor = 1.0 if outline.rectangle else 2.0
        shape = Shape(factor * width.nominal, factor * height.nominal, not outline.rectangle, centre)
        yield Goal(f"{shape.name} contained", "workspace", f"scale of {shape.name}", bound=1 - ROUNDING, shape=shape)
        return
    _, command, column, expression = _parts(condition.result)
    for bound, upper in ((condition.at_least, False), (condition.at_most, True)):
        if bound is not None:
            name = f"{condition.name} {'at most' if upper else 'at least'} {text_of(bound) or f'{bound:g}'}"
            where = tuple(condition.where.items())
            allowed = condition.unassembled is not None
            yield Goal(name, command, column, upper, condition.abs, where, bound, allowed, expression, gate=True)


def _parts(result: str | Expression) -> tuple[str, str, str, Expression | None]:
    """Name, command, column and expression of what is judged."""
    if isinstance(result, Expression):
        return result.text, "", result.text, result
    command, _, column = result.partition(".")
    return (result, command, column, None) if command in COMMANDS else (result, "workspace", result, None)


def unit_of(study: Study, text: str) -> str:
    """Unit of an expression over parameters, known where it is a sum of multiples of parameters of one unit."""
    expression = Expression.parse(text)
    units = {study.unit_of(name) for name in expression.names}
    return (units.pop() or "") if len(units) == 1 and expression.is_linear() else ""
