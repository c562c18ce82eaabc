"""Numbers as a study writes them: plain, with a unit, or as an expression over its parameters."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic_core import PydanticCustomError

from mechdesign.errors import suggestion
from mechdesign.expressions import RESERVED, Expression, ExpressionError
from mechdesign.study.text.units import QUANTITY, QuantityError, Units

NAME = re.compile(r"[^\W\d]\w*")
COORDINATE = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
# Magnitudes beyond which a number is a slip of writing: its square or reciprocal would soon overflow.
LARGEST, SMALLEST = 1e60, 1e-60
# The same for lengths, which are multiplied with one another more often.
LONGEST, SHORTEST = 1e15, 1e-15
# Endings of the names of files with a table.
FILES = (".csv", ".txt", ".dat")


@dataclass(frozen=True)
class Context:
    """What numbers are read with: units, values of the parameters (nan where one is wrong) and those not known yet.

    `used` gathers the names in expressions that were read.
    """

    units: Units = field(default_factory=Units)
    parameters: Mapping[str, float] = field(default_factory=dict)
    below: Collection[str] = ()
    used: set[str] = field(default_factory=set)

    def expression(self, text: str) -> Expression:
        """Parse an expression in the study's units and note the names in it."""
        found = Expression.parse(text, self.units.angle_factor)
        self.used.update(found.names)
        return found


@dataclass(frozen=True)
class StudyNumber:
    """A number in the study's units, with its expression where it depends on parameters."""

    nominal: float
    expression: Expression | None = None


LOST = StudyNumber(math.nan)
"""Stands for a number whose own mistake has been told, so that the rest can be checked."""


def failure(message: str) -> PydanticCustomError:
    """Build the error that a validator raises; the message reaches the user as it is."""
    return PydanticCustomError("study", "{message}", {"message": message})


def shown(value: object) -> str:
    """Write a raw value as the user wrote it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = repr(value) if isinstance(value, str) else f"the number {value}"
    return text if len(text) <= 60 else text[:57] + "..."


def read_number(raw: object, context: Context, kind: str | None = None) -> StudyNumber:
    """Read a number, a quantity or an expression over parameters.

    Raises
    ------
    PydanticCustomError
        Where it is none of them, not finite, too large, or a quantity of another kind than `kind`.
    """
    if isinstance(raw, StudyNumber):
        return raw
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise failure(f"expected a number, not {shown(raw)}")
    try:
        value = _read_text(raw, context, kind) if isinstance(raw, str) else StudyNumber(float(raw))
    except (QuantityError, ExpressionError) as error:
        raise failure(str(error)) from None
    except OverflowError:
        raise failure("too large a number") from None
    if not isinstance(raw, str) and not math.isfinite(value.nominal):
        raise failure(f"expected a finite number, not {value.nominal:g}")
    largest, what = (LONGEST, "length") if kind == "length" else (LARGEST, "number")
    if abs(value.nominal) > largest:
        raise failure(f"{shown(raw)} is too large a {what}: none is beyond {largest:g}; choose a larger unit")
    return value


def _read_text(text: str, context: Context, kind: str | None) -> StudyNumber:
    if QUANTITY.fullmatch(text):
        number = context.units.convert(text, kind)
        if not math.isfinite(number):
            raise failure(f"{text!r} is too large a number")
        return StudyNumber(number)
    expression = context.expression(text)
    for name in sorted(expression.names - set(context.parameters)):
        raise failure(f"unknown name {name!r} in {shown(text)}{_known_names(name, context)}")
    return StudyNumber(float(expression.evaluate(context.parameters)), expression if expression.names else None)


def read_expression(raw: object, context: Context) -> Expression:
    """Read an expression whose names are looked up later; a number is one without names."""
    if not isinstance(raw, str) or QUANTITY.fullmatch(raw):
        number = read_number(raw, context).nominal
        # A number that is lost has been told already.
        return Expression.parse(repr(0.0 if math.isnan(number) else number))
    try:
        expression = context.expression(raw)
        if not expression.names:
            expression.evaluate({})
    except ExpressionError as error:
        raise failure(str(error)) from None
    return expression


def read_rows(raw: list[Any], context: Context, most: int, rule: str, empty: str) -> tuple[tuple[float, ...], ...]:
    """Read a list of rows of equal length, from one number, which may stand alone, to `most`."""
    rows: list[tuple[float, ...]] = []
    for index, item in enumerate(raw):
        try:
            row = tuple(read_number(part, context).nominal for part in (item if isinstance(item, list) else [item]))
        except PydanticCustomError as error:
            raise failure(f"entry {index}: {error.message()}") from None
        if not 1 <= len(row) <= most or (rows and len(row) != len(rows[0])):
            raise failure(f"entry {index}: {rule}, not {shown(item)}")
        rows.append(row)
    if not rows:
        raise failure(empty)
    return tuple(rows)


def _known_names(name: str, context: Context) -> str:
    if name in context.below:
        return f"; a parameter may use those above it, and {name!r} is below"
    known = ", ".join(context.parameters)
    return suggestion(name, context.parameters) or (f"; the parameters are {known}" if known else "")


def check_parameter_name(name: str) -> str | None:
    """Say what is wrong with a parameter's name, or None."""
    if not NAME.fullmatch(name):
        return "a parameter's name is letters, digits and underscores, with a letter first"
    return f"{name!r} is a word of the expression language; choose another name" if name in RESERVED else None
