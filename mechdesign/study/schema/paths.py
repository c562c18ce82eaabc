"""Paths of a coordinate or a point as the study file gives them.

A path is points or numbers one after another, a circle, an arc, or a line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, model_validator

from mechdesign.study.text import fields
from mechdesign.study.text.inputs import file_of
from mechdesign.study.text.reading import Context, read_number, read_rows
from mechdesign.study.text.units import Amount

# Default numbers of poses: of a circle (steps of 5 deg); of a line or an arc, both ends included.
CIRCLE_POSES = 72
LINE_POSES = 51
_ROWS = {"type": ["array", "string", "number"], "title": "[[x, y], ...] or [number, ...] or file or number"}

Speed = Annotated[float, fields.number("velocity", 0.0, exclusive=True)]
Point = Annotated[tuple[fields.Length, fields.Length], fields.pair_of("[x, y]")]


def _radians(raw: Any, context: Context) -> float:
    return Amount.by("angle*unit", angle=read_number(raw, context, "angle"), unit=context.units.angle_factor)


Radians = Annotated[float, fields.Read(_radians, fields.NUMBER_FORM, "angle")]


class Circle(fields.Model):
    """A whole circle, counter-clockwise unless it says otherwise; the last pose is one step before it closes."""

    center: Point
    """Centre [x, y]. Example: [0, 220]"""
    radius: fields.PositiveLength
    """Radius of the circle. Example: 40"""
    from_: Radians = Field(0.0, alias="from")
    """Angle of the first place about the centre, from the x axis. Example: 90"""
    clockwise: bool = False
    """Whether it is passed clockwise."""

    @property
    def to(self) -> float:
        """Angle at which it closes."""
        return Amount.by("begin + turn", begin=self.from_, turn=(-2.0 if self.clockwise else 2.0) * math.pi)


class Arc(fields.Model):
    """Part of a circle between two angles from the x axis, both ends included; clockwise where they fall."""

    center: Point
    """Centre [x, y]. Example: [0, 220]"""
    radius: fields.PositiveLength
    """Radius of the circle. Example: 40"""
    from_: Radians = Field(alias="from")
    """Angle of the first place about the centre, from the x axis. Example: 0"""
    to: Radians
    """Angle of the last place; less than ``from``: clockwise. Example: 180"""

    def misfits(self) -> Iterator[fields.Misfit]:
        yield fields.Misfit(
            self.from_ == self.to, "an arc needs two different angles 'from' and 'to'; a whole turn is a 'circle'"
        )


def _through(raw: Any, context: Context) -> tuple[tuple[float, ...], ...]:
    """Numbers or [x, y] one after another; a number alone is held."""
    rule = "a list of [x, y] (of a point) or a list of numbers, not a mixture, is expected"
    if not isinstance(raw, list):
        return read_rows([raw], context, 1, rule, "")
    return read_rows(raw, context, 2, rule, "an empty path; give its points, [[x, y], ...]")


class PathSection(fields.Model):
    """What one coordinate or point passes; a list, a CSV file's name or a number alone are short forms."""

    short = (_ROWS,)
    one_of = ("a path is one of through, file, circle, arc, line", "through", "file", "circle", "arc", "line")
    through: Annotated[tuple[tuple[float, ...], ...], fields.Read(_through, _ROWS)] | None = None
    """Places [x, y] of a point, or numbers of a coordinate, one a pose; a list alone means this. Example: [[10, 20],
    [15, 20], [20, 25]] Example: [0, 5, 20]
    """
    file: str | None = None
    """CSV file beside the study with a pose a line: two columns of a point, one of a coordinate; its name alone means
    this. Example: path.csv
    """
    circle: Circle | None = None
    arc: Arc | None = None
    line: (
        Annotated[tuple[Point, Point], fields.pair_of("a line from [x, y] to [x, y], as a list of the two")] | None
    ) = None
    """Straight line [[x, y], [x, y]], both ends included. Example: [[0, 0], [50, 0]]"""
    points: Annotated[int, fields.whole(2, 10_000_000)] | None = None
    """How many poses, evenly spaced. Left out: |CIRCLE_POSES| on a circle, |LINE_POSES| on an arc or a line, on a
    spline its own points. Example: 36
    """
    spline: bool = False
    """Whether a smooth curve (cubic spline) is laid through the listed points, closed where they are."""

    @property
    def shape(self) -> str | None:
        """The key of its figure (circle, arc, line); None for a list of points."""
        return next(iter(self.given("circle", "arc", "line")), None)

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, str) and file_of(raw) is not None:
            return {"file": raw}
        return raw if isinstance(raw, dict | PathSection) else {"through": raw}

    def faults(self) -> Iterator[str]:
        if self.spline and self.shape:
            yield f"{self.shape!r} is smooth already: 'spline' is for a list of points"
        if self.points is not None and not self.shape and not self.spline:
            yield ("a list of points has its own number; 'points' goes with a spline, a circle, an arc or a line")
