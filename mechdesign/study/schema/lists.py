"""Lists that may be written short: one name or number instead of a list of one."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.study.text.numbers import CoordinateName, Number


class OrOne:
    """Annotation that adds one entry, which a validator makes a list of, to a list's JSON Schema."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        many = handler(schema)
        return {"anyOf": [many, many["items"]]}


def one_or_many(raw: Any) -> Any:
    return [raw] if isinstance(raw, str) else raw


def as_list(raw: Any) -> list[Any]:
    return raw if isinstance(raw, list) else [] if raw is None else [raw]


CoordinateNames = Annotated[tuple[CoordinateName, ...], BeforeValidator(one_or_many), OrOne()]
Numbers = Annotated[tuple[Number, ...], BeforeValidator(as_list), OrOne()]
