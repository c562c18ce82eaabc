"""What an output should be, as the study file gives it: an expression, a number, a list or a CSV file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from mechdesign.expressions import Expression, ExpressionError
from mechdesign.study.text.numbers import Context, failure, read_number, shown
from mechdesign.study.text.units import QUANTITY

FILES = (".csv", ".txt", ".dat")
FORMS = "an expression, a number, {file: path.csv}, a list of numbers, of [x, y] or of [drive, x, y]"


@dataclass(frozen=True)
class Wanted:
    """One target as it was written: exactly one of the three.

    Parameters
    ----------
    expression : Expression or None
        Over coordinates and parameters; a number is one without names.
    rows : tuple of tuple of float or None
        Rows of equal length, in the study's units.
    file : str or None
        Name of a CSV file.
    """

    expression: Expression | None = None
    rows: tuple[tuple[float, ...], ...] | None = None
    file: str | None = None


class _TargetValue:
    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": ["number", "string", "array", "object"], "description": FORMS}

    def _validate(self, raw: Any, info: ValidationInfo) -> Wanted:
        context: Context = info.context or Context()
        if isinstance(raw, dict):
            if set(raw) != {"file"} or not isinstance(raw["file"], str):
                raise failure(f"expected {FORMS}, not {shown(raw)}")
            return Wanted(file=raw["file"])
        if isinstance(raw, list):
            return Wanted(rows=_rows(raw, context))
        if isinstance(raw, str) and raw.lower().endswith(FILES):
            return Wanted(file=raw)
        if isinstance(raw, str) and not QUANTITY.fullmatch(raw):
            return Wanted(expression=_expression(raw, context))
        if raw is None:
            raise failure(f"expected {FORMS}")
        number = read_number(raw, context).nominal
        # A number that is lost has been told already.
        return Wanted(expression=Expression.parse(repr(0.0 if math.isnan(number) else number)))


def _expression(text: str, context: Context) -> Expression:
    try:
        expression = context.expression(text)
        if not expression.names:
            expression.evaluate({})
    except ExpressionError as error:
        raise failure(str(error)) from None
    return expression


def _rows(raw: list[Any], context: Context) -> tuple[tuple[float, ...], ...]:
    rows: list[tuple[float, ...]] = []
    for index, item in enumerate(raw):
        parts = item if isinstance(item, list) else [item]
        try:
            row = tuple(read_number(part, context).nominal for part in parts)
        except PydanticCustomError as error:
            raise failure(f"entry {index}: {error.message()}") from None
        if len(row) not in (1, 2, 3) or (rows and len(row) != len(rows[0])):
            raise failure(f"entry {index}: every row holds the same one, two or three numbers, not {shown(item)}")
        rows.append(row)
    if not rows:
        raise failure("an empty list: no target")
    return tuple(rows)


TargetValue = Annotated[Wanted, _TargetValue()]
