"""Motions over time as the study file gives them: moves by a law and dwells, or a file of times and values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.ground.motion_laws import LAWS
from mechdesign.mechanism.elements.segments import segment_faults, segments_faults
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.inputs import file_of
from mechdesign.study.text.reading import failure

# More are no study that a person reads: a file holds them.
MAX_SEGMENTS = 10_000
_RIGHT = "[{from: 0, to: 90, time: 0.3}, {dwell: 0.1}]"

Time = Annotated[float, fields.number("time", 0.0, exclusive=True)]


class Segment(fields.Model):
    """Part of a motion over time: a move ``to`` a value in a ``time``, or a ``dwell``."""

    one_of = ("a segment is a move, {to: 90, time: 0.3}, or a {dwell: 0.1}", "to", "dwell")
    from_: fields.Number | None = Field(None, alias="from")
    """Value at which the motion begins, in its first segment only. Left out: the motion is a cycle, and begins where it
    ends. Example: 0
    """
    to: fields.Number | None = None
    """Value at the end of the move, in the coordinate's unit. Example: 90"""
    time: Time | None = None
    """How long the move takes. Example: 0.3"""
    law: Annotated[str, fields.choice(LAWS, "motion law")] = "polynomial345"
    """Law of the move. Example: cycloidal"""
    dwell: Time | None = None
    """How long the coordinate stands still. Example: 0.1"""

    def faults(self) -> Iterator[str]:
        return segment_faults(self, "time", "a time", 0.3)

    @property
    def duration(self) -> float:
        """How long it takes."""
        duration = self.dwell if self.time is None else self.time
        assert duration is not None
        return duration


def _segments(raw: Any) -> Any:
    if isinstance(raw, list) and not raw:
        raise failure(f"an empty motion; give its segments, {_RIGHT}")
    if isinstance(raw, list) and len(raw) > MAX_SEGMENTS:
        raise failure(f"{len(raw)} segments; at most {MAX_SEGMENTS} are possible, and a CSV file holds more")
    return raw


class CourseText(fields.Model):
    """What one coordinate does over time; a list of segments, a CSV file's name or a number alone are short forms."""

    short = ({"type": ["string", "number"], "title": "file or number"},)
    one_of = ("a motion is one of segments, file, held", "segments", "file", "held")
    segments: Annotated[tuple[Segment, ...], BeforeValidator(_segments)] | None = None
    """Moves and dwells one after another; a list alone means this. Example: [{to: 90, time: 0.3, law: cycloidal},
    {dwell: 0.1}, {to: 0, time: 0.4}]
    """
    file: str | None = None
    """CSV file beside the study with a time and a value a line, through which a cubic spline is laid, periodic where
    the last value is the first; time counts from the first line. Its name alone means this. Example: law.csv
    """
    held: fields.Number | None = None
    """Value that it keeps; a number alone means this. Example: 30"""

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, dict) and not raw.keys().isdisjoint(("to", "dwell")):
            raise failure(f"segments of a motion stand in a list, {_RIGHT}")
        if isinstance(raw, dict | CourseText):
            return raw
        return {"segments" if isinstance(raw, list) else "file" if file_of(raw) is not None else "held": raw}

    def faults(self) -> Iterator[str]:
        return segments_faults(self.segments or (), "{to: 90, time: 0.3}", "{to: 0, time: 0.4}")

    def checked(self, checker: Checker, name: str, path: KeyPath) -> None:
        """Check the name of the coordinate, and the units of its values."""
        quantity = checker.coordinate(name, path, at_key=True)
        if quantity not in ("length", "angle"):
            return
        if self.held is not None:
            checker.kind((*path, "held"), quantity)
        for index in range(len(self.segments or ())):
            for key in ("from", "to"):
                checker.kind((*path, "segments", index, key), quantity)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        forms = super().__get_pydantic_json_schema__(schema, handler)["anyOf"]
        segments = forms[0]["properties"]["segments"]["anyOf"][0]
        return {"anyOf": [forms[0], segments, *forms[1:]]}
