"""Results that a study names, which of their rows count, and conditions on them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, ValidationInfo
from pydantic_core import PydanticCustomError

from mechdesign.commands import COMMANDS
from mechdesign.ground.errors import suggestion
from mechdesign.ground.expressions import Expression
from mechdesign.ground.indices import INDEX_NAMES, REGIONAL, STATISTICS, needed_section
from mechdesign.ground.notation import ExpressionError
from mechdesign.ground.statistics import STATISTICS as STATISTICS_OF_ROWS
from mechdesign.ground.statistics import Interval
from mechdesign.ground.terms import command_of, sum_of
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import Context, failure, read_number, shown
from mechdesign.study.text.units import QUANTITY, Amount, QuantityError, text_of, turn_in, written

# Commands that need their section in the study.
_UNASSUMED = ("reliability", "stiffness")


# Statistics that may follow the name of a column.
WORDS = ", ".join(f"``{word}``" for word in STATISTICS_OF_ROWS)
_UNASSEMBLED = {
    "allowed": "only the part of the motion, or the samples, that are valid count; how much is missing is said"
}


def _statistics() -> tuple[str, ...]:
    """Results of a workspace that may be named without the command."""
    return (*REGIONAL, *(f"{index}_{kind}" for index in INDEX_NAMES for kind in STATISTICS))


def read_result(raw: Any, context: Context) -> str | Expression:
    """The name of a result, a sum of results, or an expression over parameters; a result comes first."""
    if not isinstance(raw, str) or QUANTITY.fullmatch(raw):
        raise failure(f"expected a result, such as GII or kinematics.mu, or an expression, not {shown(raw)}")
    if fields.COORDINATE.fullmatch(raw) and (raw not in context.parameters or raw in _statistics()):
        return raw
    try:
        if command_of(raw) and _is_sum(raw):
            return raw
        expression = context.expression(raw)
    except ExpressionError as error:
        raise failure(str(error)) from None
    for name in sorted(expression.names - context.parameters.keys()):
        cure = suggestion(name, context.parameters)
        if "." in name:
            cure = "; a measure takes coordinates and parameters: mechanism.measures: {NAME: ...}, then kinematics.NAME"
        raise failure(f"{name!r} in {shown(raw)} is not a parameter, and an expression here is over parameters{cure}")
    return expression


def _is_sum(raw: str) -> bool:
    """Whether a text is a sum of results of one command; raises ExpressionError where they are of several."""
    expression = sum_of(raw)
    commands = {command_of(name) for name in expression.names} if expression else {""}
    if "" not in commands and len(commands) > 1:
        raise ExpressionError(
            f"a sum is of results of one command, and {shown(raw)} has {' and '.join(sorted(commands))}"
        )
    return "" not in commands


def _required(raw: Any, context: Context) -> str:
    if isinstance(raw, str) and raw.startswith("optimize."):
        # Columns of its tables may be named by expressions.
        return raw
    if isinstance(reading := read_result(raw, context), str):
        return reading
    cure = f"give it as a measure, mechanism.measures: {{NAME: {raw}}}, and require kinematics.NAME"
    raise failure(f"a requirement judges the result of a command, and {shown(raw)} is of parameters alone; {cure}")


def _amount(value: str | float, info: ValidationInfo) -> str | float:
    """A quantity as an `Amount`; a text that only looks like one stays a word."""
    with suppress(PydanticCustomError):
        if text_of(value):
            return read_number(value, info.context or Context())
    return value


class Span(fields.Model):
    """A part of a motion, or rows: where a column lies between two values, above one or below one."""

    from_: fields.Number | None = Field(None, alias="from")
    """One end, in the column's unit or with one of its kind; of an angle whole turns aside. Example: 180"""
    to: fields.Number | None = None
    """The other end; of an angle it may be smaller, past a whole turn. Example: 300"""
    at_least: fields.Number | None = None
    """Lowest value, of an angle as it is counted along the motion. Example: 0"""
    at_most: fields.Number | None = None
    """Highest value, likewise. Example: 2 mm"""

    def faults(self) -> Iterator[str]:
        given = self.given("from_", "to", "at_least", "at_most")
        if not given or (given != ["from_", "to"] and {"from_", "to"} & {*given}):
            yield "a part of a motion has 'from' and 'to', or 'at_least', 'at_most' or both"

    def misfits(self) -> Iterator[fields.Misfit]:
        if self.from_ is not None:
            yield fields.Misfit(self.from_ == self.to, "nothing lies between {} and {}", (self.from_, self.to))
        if self.at_least is not None and self.at_most is not None:
            ends = (self.at_least, self.at_most)
            yield fields.Misfit(self.at_least >= self.at_most, "nothing is at least {} and at most {}", ends)

    def interval(self, unit: str) -> Interval:
        """The values in a unit; see `ValueRange` of `mechdesign.ground.statistics`.

        Raises
        ------
        QuantityError
            Where they are of another kind, or none lies between two that are no angles.
        """
        low, high = (
            None if end is None else Amount.of(end).within(unit)
            for end in ((self.at_least, self.at_most) if self.from_ is None else (self.from_, self.to))
        )
        turn = turn_in(unit) if self.from_ is not None else 0.0
        interval = Interval(-np.inf if low is None else low, np.inf if high is None else high, turn)
        if turn and interval.high - interval.low >= turn:
            return Interval()
        if not turn and not interval.low < interval.high:
            raise QuantityError(f"nothing lies {self}; the smaller one comes first")
        return interval

    def __str__(self) -> str:
        words = (("from", self.from_), ("to", self.to), ("at least", self.at_least), ("at most", self.at_most))
        return " ".join(f"{word} {written(end)}" for word, end in words if end is not None)


def _where_form(raw: Any) -> str:
    return "span" if isinstance(raw, Span | dict) else "value"


Rows = Annotated[
    Annotated[Span, Tag("span")] | Annotated[str | float | int, AfterValidator(_amount), Tag("value")],
    Discriminator(_where_form),
]


class Chosen(fields.Model):
    """A result, and the rows of it that count; or an expression over parameters."""

    bare = "result"
    short: ClassVar[tuple[fields.Form, ...]] = ({**fields.NAME_FORM, "title": "result"},)
    result: Annotated[
        str | Expression,
        fields.Read(read_result, {**fields.NAME_FORM, "title": "result, or expression over parameters"}),
    ]
    """A number of the workspace (GII, area, sigma_min_mean), COMMAND.COLUMN or COMMAND.TABLE.COLUMN, whose worst row
    counts, or which a word behind it makes one number (|WORDS|), along a motion also the worst place, or the number,
    of all between the rows; a sum of such numbers of one unit; or an expression over parameters. Example:
    kinematics.extremes.C.x.range Example: kinematics.C.x_velocity.peak Example: kinematics.C.y.range +
    2*kinematics.D.y.range
    """
    where: dict[str, Rows] = Field(default_factory=dict)
    """Rows that count: those whose columns have these values, in the column's unit or with one of its kind, or lie in
    these ranges, which along a motion are a part of it. Left out: all rows. Example: {method: monte_carlo} Example:
    {theta: {from: 180, to: 300}} Example: {P.y: {at_most: 2 mm}}
    """

    @property
    def name(self) -> str:
        """The result, and in parentheses which rows count."""
        where = ", ".join(f"{column} {value}" for column, value in self.where.items())
        text = self.result if isinstance(self.result, str) else self.result.text
        return f"{text} ({where})" if where else text

    def faults(self) -> Iterator[str]:
        if self.where and isinstance(self.result, Expression):
            yield f"{self.result.text!r} is one number for each design: it has no rows, so leave out 'where'"


class Judged(Chosen):
    """A result that is judged, and the rows of it that count; or an expression over parameters."""

    abs: bool = False
    """Whether the absolute value is judged."""
    unassembled: Annotated[str, fields.choice(_UNASSEMBLED, "answer to poses that are not valid")] | None = None
    """What becomes of a motion with poses that cannot be assembled or lie outside the limits, or of one in time that
    fails before its end, and of moments of samples some of which cannot be assembled. Left out: it is not met, and a
    design is infeasible, where one pose or sample is not valid or the motion ends between two. Example: allowed
    """

    def faults(self) -> Iterator[str]:
        yield from super().faults()
        if self.unassembled and not self.name.startswith(("kinematics.", "reliability.", "stiffness.", "dynamics.")):
            yield f"{self.name!r} is of no poses that could be missing: leave out 'unassembled'"


class Condition(Judged):
    """A result and its bounds."""

    bare, short = "", ()
    at_least: fields.Number | None = None
    """Lowest value, in the result's unit or with one of its kind. ``at_least``, ``at_most`` or both are given.
    Example: 0.35 Example: 3 cm
    """
    at_most: fields.Number | None = None
    """Highest value, likewise. Example: 2.5"""

    def faults(self) -> Iterator[str]:
        yield from super().faults()
        if self.at_least is None and self.at_most is None:
            yield "a condition needs 'at_least', 'at_most' or both"

    def misfits(self) -> Iterator[fields.Misfit]:
        if self.at_least is not None and self.at_most is not None:
            ends = (self.at_least, self.at_most)
            yield fields.Misfit(self.at_most < self.at_least, "nothing is at least {} and at most {}", ends)


class Requirement(Condition):
    """A condition on the result of a command."""

    result: Annotated[str, fields.Read(_required, {**fields.NAME_FORM, "title": "result"})]
    """COMMAND.COLUMN or COMMAND.TABLE.COLUMN, with a row's word between where it needs one; the worst row counts, along
    a motion the worst place between the rows, too, and nan is not met. A word behind it makes it one number
    (|WORDS|), and such numbers of one unit may be added. Example: kinematics.mu Example:
    kinematics.extremes.C.x.range Example: kinematics.C.x_velocity.rms
    """


def check_result(checker: Checker, name: str, path: KeyPath, *, required: bool = False) -> None:
    """Check the name of a result: a statistic of the workspace, or ``command.column``, as it must be if `required`.

    Of a sum each term is checked.
    """
    with suppress(ExpressionError):
        if command_of(name) and (total := sum_of(name)):
            for term in sorted(total.names):
                check_result(checker, term, path, required=required)
            return
    command, _, rest = name.partition(".")
    if rest:
        checker.check_name(command, COMMANDS, "command", path)
    elif required or name not in _statistics():
        statistics = _statistics()
        names = statistics if required else (*statistics, *checker.parameters.nominal)
        hint = suggestion(name, names) or f"; a result is one of {', '.join(REGIONAL)} or <command>.<column>"
        checker.report(path, f"there is no result {name!r}{hint}")
    if not required:
        column = name.rpartition(".")[2]
        checker.needs(command if command in _UNASSUMED else needed_section(column.rpartition("_")[0]), repr(name), path)
