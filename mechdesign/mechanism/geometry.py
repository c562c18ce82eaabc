"""From the numbers of the geometry (places) to the vectors of the graph's edges, and their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.mechanism.algebra import Value, cross, norm2, plus, rotation, vector
from mechdesign.mechanism.graph import Edge, Graph, Turn
from mechdesign.mechanism.model import MEASURED, Place, Term


def offset_names(link: str, point: str) -> tuple[str, str]:
    """Places of a pin's offset from its nominal place, in the link's frame (zero unless given)."""
    return f"{link}.{point}.dx", f"{link}.{point}.dy"


@dataclass(frozen=True)
class Vectors:
    """Values of all edges for one set of dimensions: w and d of each edge, the offset rotation of each body.

    Also of the parameters that measures take, by their names.
    """

    w: Sequence[Value]
    d: Sequence[Value]
    offsets: Mapping[str, Value]
    parameters: Mapping[str, Value]


@dataclass(frozen=True)
class Geometry:
    """Evaluates the edges of a graph; dimensions left out keep their nominal value."""

    graph: Graph
    places: Mapping[str, Place]

    def term(self, term: Term, values: Mapping[str, Value]) -> Value:
        """Value of a place or number."""
        if isinstance(term, str):
            value = values.get(term)
            return self.places[term].nominal if value is None else value
        return term

    def local(self, body: str, point: str, values: Mapping[str, Value]) -> Value:
        """Coordinates of a point in its body's frame, pin offset included."""
        x_term, y_term = self.graph.points[body, point]
        x, y = self.term(x_term, values), self.term(y_term, values)
        dx, dy = (values.get(name) for name in offset_names(body.removesuffix(":rod"), point))
        if dx is not None:
            x = x + dx
        if dy is not None:
            y = y + dy
        return vector(x, y)

    def angle(self, turns: Sequence[Turn], values: Mapping[str, Value]) -> Value:
        """Sum of turns in radians."""
        total: Value = 0.0
        for turn in turns:
            if turn.towards is None:
                total = total + turn.sign * self.term(turn.term, values)
            else:
                link, a, b = turn.towards
                total = total + turn.sign * np.angle(self.local(link, b, values) - self.local(link, a, values))
        return total

    def _places_of(self, edge: Edge) -> frozenset[str]:
        graph = self.graph
        names: set[str] = set()

        def add_local(body: str, point: str) -> None:
            names.update(term for term in graph.points[body, point] if isinstance(term, str))
            names.update(offset_names(body.removesuffix(":rod"), point))

        def add_turns(turns: Sequence[Turn]) -> None:
            for turn in turns:
                if turn.towards is not None:
                    link, a, b = turn.towards
                    add_local(link, a)
                    add_local(link, b)
                elif isinstance(turn.term, str):
                    names.add(turn.term)

        for _, body, point in edge.locals:
            add_local(body, point)
            add_turns(graph.bodies[body][1])
        add_turns(edge.turns)
        return frozenset(names)

    @cached_property
    def pin_offsets(self) -> frozenset[str]:
        """Names of the places of all pin offsets."""
        return frozenset(
            name for body, point in self.graph.points for name in offset_names(body.removesuffix(":rod"), point)
        )

    @cached_property
    def measured(self) -> Mapping[str, str]:
        """Parameters that measures take, and the place of each."""
        return {name.removeprefix(MEASURED): name for name in self.places if name.startswith(MEASURED)}

    @cached_property
    def dependencies(self) -> tuple[frozenset[str], ...]:
        """Names of the places that each edge depends on, pin offsets included."""
        return tuple(self._places_of(edge) for edge in self.graph.edges)

    @cached_property
    def nominal(self) -> Vectors:
        """Edges at the nominal dimensions."""
        return self._evaluate({}, None)

    def vectors(self, values: Mapping[str, Value] | None = None) -> Vectors:
        """Edges for given dimensions; only what depends on them is evaluated anew."""
        return self._evaluate(values, self.nominal) if values else self.nominal

    def _evaluate(self, values: Mapping[str, Value], base: Vectors | None) -> Vectors:
        graph = self.graph
        changed = values.keys()
        offsets: dict[str, Value] = {}
        for body, (_, turns) in graph.bodies.items():
            offsets[body] = rotation(self.angle(turns, values)) if turns else 1.0
        w: list[Value] = []
        d: list[Value] = []
        for k, edge in enumerate(graph.edges):
            if base is not None and self.dependencies[k].isdisjoint(changed):
                w.append(base.w[k])
                d.append(base.d[k])
                continue
            total: Value = 0.0
            for sign, body, point in edge.locals:
                local = self.local(body, point, values)
                if not isinstance(offsets[body], float):
                    local = local * offsets[body]
                total = plus(total, sign, local)
            w.append(total)
            if edge.slide is None:
                d.append(0.0)
            else:
                d.append(rotation(self.angle(edge.turns, values)) if edge.turns else 1.0 + 0.0j)
        return Vectors(w, d, offsets, {name: self.term(place, values) for name, place in self.measured.items()})

    def angle_derivative(self, turns: Sequence[Turn], place: str, values: Mapping[str, Value]) -> Value:
        """Derivative of a sum of turns (radians) with respect to a place."""
        total: Value = 0.0
        for turn in turns:
            if turn.towards is None:
                total = total + turn.sign * (turn.term == place)
            else:
                link, a, b = turn.towards
                span = self.local(link, b, values) - self.local(link, a, values)
                change = self.local_derivative(link, b, place) - self.local_derivative(link, a, place)
                total = total + turn.sign * cross(span, change) / norm2(span)
        return total

    def local_derivative(self, body: str, point: str, place: str) -> complex:
        """Derivative of a point's local coordinates with respect to a place."""
        x, y = self.graph.points[body, point]
        dx, dy = offset_names(body.removesuffix(":rod"), point)
        return complex((x == place) + (dx == place), (y == place) + (dy == place))

    def derivatives(self, place: str, values: Mapping[str, Value], vectors: Vectors) -> tuple[list[Value], list[Value]]:
        """Derivatives of all edges' w and d with respect to one place, at dimensions `values` with edges `vectors`."""
        w_z: list[Value] = []
        d_z: list[Value] = []
        for k, edge in enumerate(self.graph.edges):
            if place not in self.dependencies[k]:
                w_z.append(0j)
                d_z.append(0j)
                continue
            total: Value = 0j
            for sign, body, point in edge.locals:
                turn = self.angle_derivative(self.graph.bodies[body][1], place, values)
                turned = 1j * turn * self.local(body, point, values)
                total = total + sign * (self.local_derivative(body, point, place) + turned) * vectors.offsets[body]
            w_z.append(total)
            d_z.append(1j * self.angle_derivative(edge.turns, place, values) * vectors.d[k])
        return w_z, d_z
