"""Lists that may be written short: one name or number instead of a list of one."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator

from mechdesign.study.text.numbers import (
    NAME_FORM,
    NUMBER_FORM,
    CoordinateName,
    Number,
    OrShort,
)


def one_or_many(raw: Any) -> Any:
    return [raw] if isinstance(raw, str) else raw


def as_list(raw: Any) -> list[Any]:
    return raw if isinstance(raw, list) else [] if raw is None else [raw]


CoordinateNames = Annotated[tuple[CoordinateName, ...], BeforeValidator(one_or_many), OrShort((NAME_FORM,))]


Numbers = Annotated[tuple[Number, ...], BeforeValidator(as_list), OrShort((NUMBER_FORM,))]
