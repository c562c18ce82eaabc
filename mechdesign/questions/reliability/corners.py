"""Where a coordinate is not linear however small its errors: lengths of vectors about zero, and corners of expressions.

A distance, `abs`, `hypot` and the root of squares are lengths of vectors, whose components are smooth. Elsewhere
(`min`, `max`, `sqrt`, a quotient, a length within an expression) an argument near its corner is all that is known.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from mechdesign.ground.expressions import Expression
from mechdesign.ground.functions import Tabulated
from mechdesign.mechanism.coordinates import Coordinate


@dataclass(frozen=True)
class Bend:
    """What is not smooth where all `arguments` have one of the levels at once; with a period (0: none)."""

    arguments: tuple[Any, ...]  # coordinates, or expressions in the variables of loads
    levels: tuple[float, ...] = (0.0,)
    period: float = 0.0


def vector_of(coordinate: Coordinate) -> tuple[Coordinate, ...]:
    """The components, one or two, of the vector whose length a coordinate is; none of another."""
    if coordinate.kind == "distance":
        return _span(coordinate)
    if coordinate.expression is None:
        return ()
    function, arguments = coordinate.expression.outermost()
    if function == "sqrt":
        arguments = _squared(arguments[0])
    elif function not in ("abs", "hypot"):
        return ()
    return tuple(_inner(coordinate, argument) for argument in arguments)


def bends(coordinate: Coordinate) -> Iterator[Bend]:
    """Where the coordinate is not smooth, and the parts of its expression are not; the ends of a table left out."""
    if coordinate.kind == "distance":
        yield Bend(_span(coordinate))
    if coordinate.expression is not None:
        for bend in bends_of(coordinate.expression):
            arguments = (_inner(coordinate, part) for part in bend.arguments if isinstance(part, Expression))
            yield replace(bend, arguments=tuple(arguments))
    for part in coordinate.parts:
        yield from bends(part)


def bends_of(expression: Expression) -> Iterator[Bend]:
    """Where an expression is not smooth in its variables, its arguments as expressions."""
    function, arguments = expression.outermost()
    if function in ("hypot", "atan2"):
        yield Bend(tuple(arguments))
    elif not isinstance(function, Tabulated):
        inner = {corner for argument in arguments for corner in argument.corners()}
        for corner in expression.corners() if function else ():
            if corner.levels and corner not in inner:
                yield Bend((corner.argument,), corner.levels, corner.period)
    for argument in arguments:
        yield from bends_of(argument)


def _squared(sum_of: Expression) -> list[Expression]:
    """What is squared in a sum of one or two squares; nothing of another expression."""
    function, terms = sum_of.outermost()
    roots = []
    for term in terms if function == "+" else [sum_of]:
        function, factors = term.outermost()
        power = function == "**" and factors[1].program == (("constant", 2.0),)
        if not power and not (function == "*" and factors[0].program == factors[1].program):
            return []
        roots.append(factors[0])
    return roots


def _inner(coordinate: Coordinate, argument: Expression) -> Coordinate:
    """An argument in the expression of a coordinate, as a coordinate of its own in the same unit."""
    parts = tuple(part for part in coordinate.parts if part.name in argument.names)
    return replace(coordinate, expression=argument, parts=parts, turn=0.0)


def _span(distance: Coordinate) -> tuple[Coordinate, Coordinate]:
    """The components of the vector from the one point of a distance to the other."""
    ends = [
        [Coordinate(f"{number}", axis, "length", node=node, links=(link, ""))
         for number, (link, node) in enumerate(distance.ends)] for axis in ("x", "y")
    ]  # fmt: skip
    difference = Expression(distance.name, (("name", "1"), ("name", "0"), ("call", "-")))
    x, y = (Coordinate(distance.name, "expression", "length", expression=difference, parts=(*pair,)) for pair in ends)
    return x, y
