"""Goals and conditions of designs: a number of the workspace, the worst row of any column, or an expression."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechdesign.family.judge import judge
from mechdesign.ground.expressions import Expression
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Result
from mechdesign.ground.rows import ChosenRows
from mechdesign.ground.statistics import STATISTICS, Request
from mechdesign.ground.terms import Sum, command_of, path_of, terms_of
from mechdesign.questions.optimize.schema import Containment, Outline
from mechdesign.questions.workspace.inscribed import INSCRIBED
from mechdesign.questions.workspace.question import COLUMNS, split
from mechdesign.region.shapes import Shape
from mechdesign.study import Study
from mechdesign.study.schema.conditions import Condition
from mechdesign.study.text.units import text_of

# A shape counts as contained if it fits up to this part of its size.
ROUNDING = 1e-9
# A rule for the mean square of errors along a motion.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class Goal:
    """A number that is maximised, minimised or bounded: of the workspace, the worst row of a column, or an expression.

    Parameters
    ----------
    name : str
        As the study gives it; of a condition with its bound.
    column : str
        As `mechdesign.ground.rows.terms_of` understands it; of an expression over parameters its text.
    smallest : bool
        Whether the largest row is the worst one; of a condition, whether its bound is an upper one.
    absolute : bool
        Judge absolute values.
    where : tuple of (str, object)
        Only rows whose columns have these values, or lie in these spans, count.
    unassembled : bool
        Whether poses that are not valid are left out; else they make a design infeasible.
    outline : Outline, optional
        A shape that the workspace has to contain; the largest scale at which it does is judged.
    gate : bool
        Whether it is a condition.
    single : bool
        Whether it is the one number that a row or a statistic gives, not the worst of several rows.
    whole : bool
        Of a case, whether it is nan where poses, samples or a part of the motion are missing.
    """

    name: str
    command: str
    column: str
    smallest: bool = False
    absolute: bool = False
    where: tuple[tuple[str, object], ...] = ()
    bound: float = 0.0
    unassembled: bool = False
    expression: Expression | None = None  # over parameters; `command` is empty then
    outline: Outline | None = None
    gate: bool = False
    single: bool = False
    whole: bool = False

    @property
    def sign(self) -> float:
        """1 where less is better, or the largest row the worst one; else -1."""
        return 1.0 if self.smallest else -1.0

    @property
    def regional(self) -> bool:
        """Whether it is a number of the whole workspace."""
        number = self.outline is not None or self.column in (*COLUMNS, *INSCRIBED) or bool(split(self.column)[0])
        return self.command == "workspace" and number and not self.where

    def margin(self, values: Floats) -> Floats:
        """By how much values keep the bound, negative where they do not."""
        return self.bound - values if self.smallest else values - self.bound

    def met(self, values: Floats) -> Flags:
        """Which values keep the bound; nan never does."""
        return self.margin(values) >= 0

    def judge(self, result: Result, designs: int = 1) -> Scored:
        """The value of each design, and the rows that make it.

        Parameters
        ----------
        result : Result
            The result of all designs, with the same number of rows for each, design by design.

        Raises
        ------
        UnknownColumnError
            If the result has no such column.
        """
        chosen = terms_of(result, self.column, dict(self.where))
        statistic = None if isinstance(chosen, Sum) else STATISTICS.get(chosen.statistic)
        number = self.single or isinstance(chosen, Sum) or (statistic is not None and statistic.end != self.sign)
        absolute = self.absolute or (statistic is not None and statistic.absolute and not number)
        bounds = (None, self.bound) if self.smallest else (self.bound, None)
        judged = judge(chosen, bounds, designs, absolute=absolute, assembled=self.unassembled, number=number)
        if number or isinstance(chosen, Sum):
            return Scored(judged.values, None)
        if chosen.table.name == "targets" and chosen.column == "rms" and "motion" in result.tables:
            outputs = {str(name) for name in chosen.table["output"][chosen.counts]}
            # A curve has errors at its points, and none at poses.
            if len(outputs) == 1 and all(f"{name}_error" in result.tables["motion"] for name in outputs):
                return Scored(judged.values, _errors(result, outputs.pop(), judged.values), squares=True)
        values, counts = chosen.shaped(designs, assembled=self.unassembled)
        if not designs or np.ptp(counts.sum(axis=1)):
            return Scored(judged.values, None)
        rows = values[counts].reshape(designs, -1)
        if self.gate:
            between = [np.where(np.isnan(one), judged.values, one) for one in judged.between]
            rows = np.column_stack([rows, *between])
        return Scored(judged.values, rows)

    def requests(self, chosen: ChosenRows) -> list[Request]:
        """How a column is followed between the poses; not at all where single poses are picked."""
        if chosen.picked:
            return []
        both = self.absolute or bool(chosen.statistic)
        return [request._replace(end=0 if both else 1 if self.smallest else -1) for request in chosen.requests]


class Scored(NamedTuple):
    """The values of a goal for some designs.

    Parameters
    ----------
    values : ndarray, shape (designs,)
        The worst of the rows and of the motion between them; nan where none counts or has no value.
    rows : ndarray, shape (designs, rows), or None
        The signed rows that count, then of a condition the worst value between them: that is not smooth in the design,
        and would mislead a search for the best, but a condition must hold there. None where designs do not have the
        same number of rows. Of a root mean square over targets, where the result has the motion, errors whose squares
        add up to its square.
    squares : bool
        Whether the rows are such errors.
    """

    values: Floats
    rows: Floats | None
    squares: bool = False


def _errors(result: Result, output: str, rms: Floats) -> Floats:
    """Errors from an output's target, scaled so that their squares add up to that of `rms`, shape (designs, errors).

    They are those at the nodes of a Gauss rule where the motion is followed between the poses, else those of the poses,
    0 where a pose has no target.
    """
    motion, designs = result.tables["motion"], len(rms)
    parts = [f"{output}_error"] if f"{output}.x_error" not in motion else [f"{output}.{k}_error" for k in "xy"]
    follow = motion.scope.follow if motion.scope is not None else None
    courses = follow([Request(name, (), True) for name in parts]) if follow is not None else []
    followed = [course.at((1 + _NODES) / 2) * np.sqrt(_WEIGHTS) for course in courses if course is not None]
    columns = followed or [motion[name].reshape(designs, -1) for name in parts]
    errors = np.nan_to_num(np.concatenate(columns, axis=1))
    size = np.linalg.norm(errors, axis=1)
    return np.asarray(errors * np.divide(rms, size, out=np.full(designs, np.nan), where=size > 0)[:, None])


def goal(
    result: str | Expression, *, smallest: bool = False, where: Mapping[str, object] | None = None,
    absolute: bool = False, unassembled: bool = False, single: bool = False, whole: bool = False,
) -> Goal:  # fmt: skip
    """Read a result's name, such as ``GII``, ``stiffness.k_min``, ``kinematics.extremes.C.x.range``.

    Of an error the absolute value always counts, unless it is a `single` number.
    """
    name, command, column, expression = _parts(result)
    rows = tuple((where or {}).items())
    title = f"{name} ({', '.join(f'{key} {value}' for key, value in rows)})" if rows else name
    absolute = absolute or (expression is None and column.endswith("_error") and not single)
    return Goal(
        title, command, column, smallest, absolute, rows, 0.0, unassembled, expression, single=single, whole=whole
    )


def bounds_of(condition: Condition | Containment, moved: Collection[str] = ()) -> Iterator[Goal]:
    """The goals by which a condition is judged, one for each bound; of a shape, the scale at which it fits.

    Designs differ in the parameters `moved`.
    """
    if isinstance(condition, Containment):
        name = condition.contains.named(moved)
        scale = f"scale of {name}"
        yield Goal(f"{name} contained", "workspace", scale, bound=1 - ROUNDING, outline=condition.contains, gate=True)
        return
    _, command, column, expression = _parts(condition.result)
    for bound, upper in ((condition.at_least, False), (condition.at_most, True)):
        if bound is not None:
            name = f"{condition.name} {'at most' if upper else 'at least'} {text_of(bound) or f'{bound:g}'}"
            where = tuple(condition.where.items())
            allowed = condition.unassembled is not None
            yield Goal(name, command, column, upper, condition.abs, where, bound, allowed, expression, gate=True)


def shape_of(outline: Outline, number: Callable[[float], Any] = float) -> Shape:
    """The shape of an outline; `number` evaluates its numbers, to one value or to one for each design."""
    centre = None
    if outline.center is not None:
        x, y = outline.center
        centre = number(x) + 1j * number(y)
    if outline.rectangle is not None:
        width, height = outline.rectangle
        return Shape(number(width), number(height), False, centre)
    assert outline.circle is not None
    return Shape(2 * number(outline.circle), 2 * number(outline.circle), True, centre)


def _parts(result: str | Expression) -> tuple[str, str, str, Expression | None]:
    """Name, command, column and expression of a judged result."""
    if isinstance(result, Expression):
        return result.text, "", result.text, result
    return result, command_of(result) or "workspace", path_of(result), None


def unit_of(study: Study, text: str) -> str:
    """Unit of an expression over parameters, known where it is a sum of multiples of parameters of one unit."""
    expression = Expression.parse(text)
    units = {study.unit_of(name) for name in expression.names}
    return (units.pop() or "") if len(units) == 1 and expression.is_linear() else ""
