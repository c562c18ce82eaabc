"""Named quantities of a mechanism, and limits of its motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from mechdesign.ground.expressions import Expression
from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element


@dataclass(frozen=True)
class Measure(Element):
    """A named quantity: exactly one of ``angle``, ``distance`` and ``expression``; a text alone is an expression."""

    one_of = (
        "a measure is one of {angle: [a, b]}, {distance: [P, Q]} or an expression over coordinates and parameters",
        "angle",
        "distance",
        "expression",
    )
    bare = "expression"

    angle: declared.TwoLinks | None = None
    """Angle from the first link's x axis to the second's, [a, b]. Example: [rod, rocker]"""
    distance: declared.TwoEnds | None = None
    """Distance between two points, [P, Q]; of a pin that gives or has a clearance rod.B is its end on link rod.
    Example: [P, Q]
    """
    # A name in it is a parameter if there is a place of that name behind `MEASURED`, else a coordinate.
    expression: Annotated[Expression, declared.Notation("text")] | None = None
    """Expression over coordinates, also of a link's end of a pin (rod.B.x), parameters and the measures above it.
    Example: B.x - A.x
    """


@dataclass(frozen=True)
class Limit(Element):
    """Bounds of a ``distance``, a ``drive``, an ``angle`` or a ``measure``, whose own unit they have."""

    one_of = (
        "a limit is one of distance: [P, Q], drive: name, angle: [a, b], measure: name",
        "distance",
        "drive",
        "angle",
        "measure",
    )

    distance: declared.TwoPoints | None = None
    """Two points whose distance is limited. Example: [P, Q]"""
    drive: declared.DriveName | None = None
    """Drive whose value is limited. Example: crank"""
    angle: declared.TwoLinks | None = None
    """Links [a, b]: the angle from a's x axis to b's is limited, whole turns aside. It needs both ``min`` and ``max``.
    Example: [rod, rocker]
    """
    measure: declared.MeasureName | None = None
    """Measure whose value is limited. Example: gap"""
    min: declared.AnySize | None = None
    """Lowest value. Left out: none. Example: 10"""
    max: declared.AnySize | None = None
    """Highest value. Left out: none. Example: 2*r + 10"""

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if not given.given("min", "max"):
            yield "a limit needs 'min', 'max' or both"
