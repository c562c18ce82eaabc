"""Coordinates by name: ``C.x``, ``rocker.angle``, ``leg.length``, ``guide.slide``, drives and measures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from mechdesign.errors import MechanismError, suggestion
from mechdesign.expressions import Expression
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import MEASURED, Description, Drive, Measure, Quantity

Kind = Literal["x", "y", "angle", "slide", "distance", "expression", "parameter"]


@dataclass(frozen=True)
class Coordinate:
    """A scalar function of the configuration, by kind.

    ``x``, ``y`` of a node; ``angle`` from the x axis of body `reference` to that of `body`; ``slide`` displacement (a
    telescopic leg's is its length); ``distance`` of nodes `node` and `other`; ``expression`` of coordinates `parts`, of
    which a ``parameter`` is the same in every pose.
    """

    name: str
    kind: Kind
    quantity: Quantity
    node: int = -1
    other: int = -1
    body: str = ""
    reference: str = GROUND
    slide: int = -1
    expression: Expression | None = None
    parts: tuple[Coordinate, ...] = ()


def all_names(description: Description, graph: Graph) -> tuple[str, ...]:
    """Names of every coordinate of a mechanism, drives first."""
    names = [*description.drives]
    for node in graph.nodes:
        if ":" not in node:
            names += [f"{node}.x", f"{node}.y"]
    names += [f"{link}.angle" for link in description.links if link != GROUND]
    legs = {name for name, link in description.links.items() if link.telescopic}
    names += [f"{slide}.{'length' if slide in legs else 'slide'}" for slide in graph.slides]
    return tuple(dict.fromkeys([*names, *description.measures]))


def resolve(name: str, description: Description, graph: Graph) -> Coordinate:
    """Look a coordinate up by name.

    Raises
    ------
    MechanismError
        If there is none of that name; the message names the nearest.
    """
    if name in description.drives:
        return _drive(name, description.drives[name], graph)
    if name in description.measures:
        return _measure(name, description.measures[name], description, graph)
    owner, _, part = name.rpartition(".")
    if part in ("x", "y") and owner in graph.nodes:
        return Coordinate(name, "x" if part == "x" else "y", "length", node=graph.node(owner))
    if part == "angle" and owner in description.links:
        return Coordinate(name, "angle", "angle", body=owner)
    if part in ("length", "slide") and owner in graph.slides:
        slide = graph.slides.index(owner)
        if (part == "length") == (slide in graph.telescopic):
            return Coordinate(name, "slide", "length", slide=slide)
    hint = suggestion(name, all_names(description, graph))
    raise MechanismError(f"'{name}' is not a coordinate of this mechanism{hint}", name)


def angles_of(coordinates: Iterable[Coordinate]) -> dict[str, Coordinate]:
    """The angles among coordinates and in their expressions, by name."""
    found: dict[str, Coordinate] = {}
    for coordinate in coordinates:
        if coordinate.kind == "angle":
            found[coordinate.name] = coordinate
        found |= angles_of(coordinate.parts)
    return found


def _drive(name: str, drive: Drive, graph: Graph) -> Coordinate:
    if drive.kind == "angle":
        return Coordinate(name, "angle", "angle", body=drive.target, reference=drive.reference)
    return Coordinate(name, "slide", "length", slide=graph.slides.index(drive.target))


def _measure(name: str, measure: Measure, description: Description, graph: Graph) -> Coordinate:
    if measure.kind == "expression" and measure.expression is not None:
        parts = tuple(
            Coordinate(part, "parameter", "none")
            if MEASURED + part in description.places
            else resolve(part, description, graph)
            for part in sorted(measure.expression.names)
        )
        return Coordinate(name, "expression", "none", expression=measure.expression, parts=parts)
    return between(name, measure.kind, measure.items or ("", ""), graph)


def between(name: str, kind: str, items: Sequence[str], graph: Graph) -> Coordinate:
    """The ``angle`` from one link to another, or the distance of two points."""
    first, second = items
    if kind == "angle":
        return Coordinate(name, "angle", "angle", body=second, reference=first)
    return Coordinate(name, "distance", "length", node=graph.node(first), other=graph.node(second))
