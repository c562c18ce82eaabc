"""Coordinates by name: ``C.x``, ``rocker.angle``, ``leg.length``, ``guide.slide``, drives and measures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mechdesign.ground.errors import MechanismError, suggestion
from mechdesign.ground.expressions import Corner, Expression
from mechdesign.ground.functions import Share, Tabulated
from mechdesign.ground.notation import Step
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.elements.couplings import MEASURED, Coupling, play
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.measures import Measure
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import WOUND, Description

# The law of a cam closes after a turn where it misses its begin by less than this part of its lift.
CLOSED = 1e-6
# A span of so nearly a turn, as a part of it, is one: 2 pi is written 6.283.
LIKE_A_TURN = 1e-3
Kind = Literal["x", "y", "angle", "slide", "distance", "expression", "parameter"]


@dataclass(frozen=True)
class Coordinate:
    """A scalar function of the configuration, by kind.

    ``x``, ``y`` of a node; ``angle`` from the x axis of body `reference` to that of `body`; ``slide`` displacement (a
    telescopic leg's is its length); ``distance`` of nodes `node` and `other`; ``expression`` of coordinates `parts`, of
    which a ``parameter`` is the same in every pose. `turn` is the period of the value, such as 2 pi of an angle, and 0
    without one. Where `links` are named, the points are those of the links at the pins `node` and `other`, which differ
    from the pins by clearances.
    """

    name: str
    kind: Kind
    quantity: Quantity
    node: int = -1
    other: int = -1
    links: tuple[str, str] = ("", "")
    body: str = ""
    reference: str = GROUND
    slide: int = -1
    expression: Expression | None = None
    parts: tuple[Coordinate, ...] = ()
    turn: float = 0.0

    @property
    def formula(self) -> Expression:
        """The expression of one of this kind."""
        assert self.expression is not None
        return self.expression

    @property
    def linear(self) -> bool:
        """Whether an expression is linear in angles and slides, whatever its parameters."""
        if self.expression is None or any(part.kind not in ("angle", "slide", "parameter") for part in self.parts):
            return False
        unit = self.expression.angle_unit
        values = {
            part.name: 1.0 if part.kind == "parameter" else Expression(part.name, (("name", part.name),), unit)
            for part in self.parts
        }
        return self.expression.substituted(values).is_linear()

    def held(self, sides: Mapping[tuple[Step, ...], float]) -> Coordinate:
        """An expression of it, and those of its parts, on some sides of their corners; see `Expression.held`."""
        expression = None if self.expression is None else self.expression.held(sides)
        return replace(self, expression=expression, parts=(*(part.held(sides) for part in self.parts),))

    @property
    def ends(self) -> tuple[tuple[str, int], ...]:
        """Link and node of each point that the coordinate or a part of it is measured at."""
        nodes = {"x": (self.node,), "y": (self.node,), "distance": (self.node, self.other)}.get(self.kind, ())
        return (*zip(self.links, nodes, strict=False), *(end for part in self.parts for end in part.ends))


@dataclass(frozen=True)
class Coupled:
    """A coupling: coordinate `follower` has the value of `function`, so that `gap`, their difference, is zero."""

    name: str
    follower: Coordinate
    function: Coordinate
    gap: Coordinate


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
    if part in ("x", "y") and graph.is_point(owner):
        links = (owner.rpartition(".")[0], "")
        return Coordinate(name, "x" if part == "x" else "y", "length", node=graph.node(owner), links=links)
    if part == "angle" and owner in description.links:
        return _angle(name, owner)
    if part in ("length", "slide") and owner in graph.slides:
        slide = graph.slides.index(owner)
        if (part == "length") == (slide in graph.telescopic):
            return Coordinate(name, "slide", "length", slide=slide)
    hint = suggestion(name, all_names(description, graph))
    raise MechanismError(f"'{name}' is not a coordinate of this mechanism{hint}", name)


def leaves(coordinate: Coordinate) -> Iterator[Coordinate]:
    """The coordinates of an expression, without its parameters; another coordinate itself."""
    if coordinate.kind not in ("expression", "parameter"):
        yield coordinate
    for part in coordinate.parts:
        yield from leaves(part)


def angles_of(coordinates: Iterable[Coordinate]) -> dict[str, Coordinate]:
    """The angles among coordinates and in their expressions, arctangents too, by name."""
    angles: dict[str, Coordinate] = {}
    for coordinate in coordinates:
        if coordinate.turn:
            angles[coordinate.name] = coordinate
        angles |= angles_of(coordinate.parts)
    return angles


def expressions_of(coordinates: Iterable[Coordinate]) -> dict[str, Coordinate]:
    """The expressions among coordinates and in their parts by name, inner ones first."""
    expressions: dict[str, Coordinate] = {}
    for coordinate in coordinates:
        expressions |= expressions_of(coordinate.parts)
        if coordinate.kind == "expression":
            expressions[coordinate.name] = coordinate
    return expressions


def corners_of(coordinates: Iterable[Coordinate]) -> list[Corner]:
    """The corners of all expressions among coordinates and in their parts, inner ones first."""
    return [
        corner
        for coordinate in expressions_of(coordinates).values()
        if coordinate.expression is not None
        for corner in coordinate.expression.corners()
    ]


def _drive(name: str, drive: Drive, graph: Graph) -> Coordinate:
    if drive.kind == "angle":
        return _angle(name, drive.target, drive.reference)
    return Coordinate(name, "slide", "length", slide=graph.slides.index(drive.target))


def _measure(name: str, measure: Measure, description: Description, graph: Graph) -> Coordinate:
    if measure.kind == "expression" and measure.expression is not None:
        return _expression(name, measure.expression, _parts(measure.expression, description, graph))
    return between(name, measure.kind, measure.items or ("", ""), graph)


def coupled(coupling: Coupling, description: Description, graph: Graph) -> Coupled:
    """Coordinates of a coupling; its function, with the play, and its gap have the unit of the one that follows."""
    follower = resolve(coupling.set_, description, graph)
    name = play(coupling.name).removeprefix(MEASURED)
    law = _cam_law(coupling, description, graph)
    with_play = replace(law, program=(*law.program, ("name", name), ("call", "+")))
    parts = _parts(with_play, description, graph)
    gap = replace(with_play, program=(("name", follower.name), *with_play.program, ("call", "-")))
    function, gap_of = (
        replace(_expression(coupling.name, expression, parts | own), quantity=follower.quantity)
        for expression, own in ((with_play, {}), (gap, {follower.name: follower}))
    )
    return Coupled(coupling.name, follower, function, gap_of)


def _cam_law(coupling: Coupling, description: Description, graph: Graph) -> Expression:
    """What a coupling gives; the law of a cam that ends after a turn as it begins, with every turn of the cam again."""
    law, cam = coupling.function, coupling.cam
    periodic = any(isinstance(step, Tabulated | Share) for _, step in law.program)
    if cam is None or periodic or abs(cam.range[1] - cam.range[0] - TURN) > LIKE_A_TURN * TURN:
        return law
    parts, unit = _parts(law, description, graph), law.angle_unit
    (followed,) = (part for part in parts.values() if part.kind != "parameter")
    if followed.quantity != "angle":
        return law
    first, turn = cam.range[0] / unit, TURN / unit
    places = [
        description.places.get(MEASURED + name) or description.places[name] for name in parts if name != followed.name
    ]
    fixed = {
        place.name.removeprefix(MEASURED): place.nominal / (unit if place.quantity == "angle" else 1.0)
        for place in places
    }
    at = np.linspace(first, first + turn, cam.steps + 1)
    values, later = (np.asarray(law.evaluate({**fixed, followed.name: at + shift})) for shift in (0.0, turn))
    size = np.ptp(values)
    if not abs(values[-1] - values[0]) <= CLOSED * size:
        return law
    if np.abs(later - values).max() <= CLOSED * size and not law.corners():
        return law
    return law.repeated(followed.name, first, turn)


def _parts(expression: Expression, description: Description, graph: Graph) -> dict[str, Coordinate]:
    """Coordinates and parameters of an expression by name."""
    parts: dict[str, Coordinate] = {}
    for part in sorted(expression.names):
        own = description.places.get(MEASURED + part) or description.places.get(part)
        if own is not None and (own.in_coupling or own.name.startswith(MEASURED)):
            parts[part] = Coordinate(part, "parameter", "angle" if own.quantity == "angle" else "none")
        else:
            parts[part] = resolve(part, description, graph)
    return parts


def _angle(name: str, body: str, reference: str = GROUND) -> Coordinate:
    return Coordinate(name, "angle", "angle", body=body, reference=reference, turn=TURN)


def winding(spring: Spring) -> Coordinate:
    """The angle by which a torsion spring is wound: of its second link from its first."""
    one, other = spring.between
    return _angle(f"{WOUND}{spring.name}", other, one)


def _expression(name: str, expression: Expression, parts: Mapping[str, Coordinate], turn: float = 0.0) -> Coordinate:
    """An expression of coordinates, its arctangents as coordinates of their own."""
    coordinates, outer = dict(parts), expression
    if not turn:
        outer, arctangents = expression.turning(name)
        for variable, (inner, turns) in arctangents.items():
            coordinates[variable] = _expression(variable, inner, coordinates, turns * TURN)
    own = tuple(coordinates[part] for part in sorted(outer.names))
    quantities = {part.name: part.quantity for part in own if part.kind != "parameter"}
    quantity: Quantity = "angle" if turn or outer.is_angle(quantities) else "none"
    return Coordinate(name, "expression", quantity, expression=outer, parts=own, turn=turn)


def between(name: str, kind: str, items: Sequence[str], graph: Graph) -> Coordinate:
    """The ``angle`` from one link to another, or the distance of two points."""
    first, second = items
    if kind == "angle":
        return _angle(name, second, first)
    links = (first.rpartition(".")[0], second.rpartition(".")[0])
    return Coordinate(name, "distance", "length", node=graph.node(first), other=graph.node(second), links=links)
