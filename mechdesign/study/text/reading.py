"""Numbers and expressions of a study's text as they are read, and the errors that are raised where they are none.

A number is plain, with a unit, or an expression over the study's parameters. What reads one gets a `Context` and raises
with a message for a designer.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from pydantic_core import PydanticCustomError

from mechdesign.ground.errors import cut, suggestion
from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import ExpressionError
from mechdesign.study.text.units import QUANTITY, Amount, QuantityError, Units, kind_of

_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:\s*[^\W\d].*)?")
# A number with a unit inside an expression, where a ``*`` is a product.
_WITH_UNIT = re.compile(
    r"(?<![\w.])(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![eE][-+]?\d)[A-Za-zµμ°]+(?:\^?\d)?"
    r"(?:\s*/\s*[A-Za-zµμ°]+(?:\^?\d)?)?(?![\w(])"
)
# Magnitudes beyond which a number is likely a slip, as its powers would overflow: of numbers, and of lengths, which
# are multiplied with one another more often.
MAX_NUMBER = 1e60
MIN_NUMBER = 1e-60
MAX_LENGTH = 1e15
MIN_LENGTH = 1e-15
# Part of a spline's length below which two of its knots are the same: its equations would have no digits left.
APART = 1e-12
# Most names that a message lists in place of a wrong one.
MAX_NAMED = 12


@dataclass(frozen=True)
class Context:
    """What numbers are read with: units, values of the parameters (nan where one is wrong) and those not known yet.

    `quantities` are the texts of parameters that have a unit; `used` gathers the names in expressions that were read,
    `fixed` those in numbers that are the same for all designs that are answered together, such as whole numbers.
    """

    units: Units = field(default_factory=Units)
    parameters: Mapping[str, float] = field(default_factory=dict)
    below: Collection[str] = ()
    quantities: Mapping[str, str] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    fixed: set[str] = field(default_factory=set)

    def expression(self, text: str) -> Expression:
        """Parse an expression in the study's units and note the names in it.

        Raises
        ------
        ExpressionError
            If it cannot be read; of one with units the message has it without them.
        """
        try:
            expression = Expression.parse(text, self.units.angle_factor)
        except ExpressionError:
            if bare := self._without_units(text):
                raise ExpressionError(f"an expression takes no units: write {bare}") from None
            raise
        self.used.update(expression.names)
        return expression

    def _without_units(self, text: str) -> str:
        """``1.5 + balance (kg)`` for ``1500 g + balance``, in the study's units; empty where no number has a unit."""
        labels: dict[str, None] = {}

        def bare(part: re.Match[str]) -> str:
            try:
                value, kind = self.units.convert(part[0]), kind_of(part[0])
            except QuantityError:
                return part[0]
            labels[self.units.label(kind) if kind else part[0].removeprefix(part["number"]).strip()] = None
            return f"{value:.12g}"

        words = _WITH_UNIT.sub(bare, text)
        return f"{cut(words)} ({cut(', '.join(labels))})" if labels else ""


LOST = Amount(math.nan)
"""Stands for a number whose own mistake has been reported, so that the rest can be checked."""


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
    return repr(cut(value)) if isinstance(value, str) else cut(f"the number {value}")


def read_number(raw: object, context: Context, kind: str | None = None) -> Amount:
    """Read a number, a quantity or an expression over parameters.

    Raises
    ------
    PydanticCustomError
        Where it is none of them, not finite, too large, or a quantity of another kind than `kind`.
    """
    if isinstance(raw, Amount):
        return raw
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise failure(f"expected a number, not {shown(raw)}")
    try:
        value = _read_text(raw, context, kind) if isinstance(raw, str) else Amount(float(raw))
    except (QuantityError, ExpressionError) as error:
        raise failure(str(error)) from None
    except OverflowError:
        raise failure("too large a number; choose a larger unit") from None
    if not isinstance(raw, str) and not math.isfinite(value):
        raise failure(f"expected a finite number, not {value:g}")
    largest, noun = (MAX_LENGTH, "length") if kind == "length" else (MAX_NUMBER, "number")
    if abs(value) > largest:
        raise failure(f"{shown(raw)} is too large a {noun}: none is beyond {largest:g}; choose a larger unit")
    return value


def _read_text(text: str, context: Context, kind: str | None) -> Amount:
    if QUANTITY.fullmatch(text):
        number = context.units.convert(text, kind)
        if not math.isfinite(number):
            raise failure(f"{text!r} is too large a number")
        return Amount(number, text.strip())
    if text.rstrip().endswith("%"):
        raise failure(f"{text!r} is in per cent, which is no unit here: write the fraction, or what it is of, 0.01*r")
    if _DECIMAL_COMMA.fullmatch(text):
        raise failure(f"{text!r} has a decimal comma; a decimal is written with a point: {text.replace(',', '.')}")
    expression = context.expression(text)
    for name in sorted(expression.names - set(context.parameters)):
        hint = _known_names(name, context)
        raise failure(f"unknown name {name!r} in {shown(text)}{hint}")
    value = float(expression.evaluate(context.parameters))
    return Amount(value, context.quantities.get(text.strip(), ""), expression if expression.names else None)


def read_expression(raw: object, context: Context) -> Expression:
    """Read an expression whose names are looked up later; a number is one without names."""
    if not isinstance(raw, str) or QUANTITY.fullmatch(raw):
        number = float(read_number(raw, context))
        # The mistake of a lost number has been reported.
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
            row = tuple(read_number(part, context) for part in (item if isinstance(item, list) else [item]))
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
    listed = ", ".join(islice(context.parameters, MAX_NAMED))
    return suggestion(name, context.parameters) or (f"; the parameters are {listed}" if listed else "")
