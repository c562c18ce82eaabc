"""From the numbers of the geometry (places) to the vectors of the graph's edges, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Ints
from mechdesign.mechanism.algebra import Value, Vector, cross, norm2, picked, plus, rotation, vector
from mechdesign.mechanism.elements.couplings import MEASURED
from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.graph import Edge, Graph, Turn
from mechdesign.mechanism.model import Place


def offset_names(body: str, point: str) -> tuple[str, str]:
    """Names of the x and the y offset of a pin from its nominal place in the body's frame (zero unless given)."""
    name = f"{body.removesuffix(':rod')}.{point}"
    return f"{name}.dx", f"{name}.dy"


def slide_offset(joint: str) -> str:
    """Name of a slide's offset from its line, positive to the left of its direction (zero unless given)."""
    return f"{joint}.offset"


@dataclass(frozen=True)
class Vectors:
    """Numbers of a graph for one set of dimensions.

    Vectors w and d of each edge, the offset of each body as a rotation, and the parameters of measures by their names.
    """

    w: Sequence[Vector]
    d: Sequence[Vector]
    offsets: Mapping[str, Vector]
    parameters: Mapping[str, Value]

    def map(self, function: Callable[[Any], Any]) -> Vectors:
        """The same with a function applied to each value."""
        offsets = {body: function(turn) for body, turn in self.offsets.items()}
        parameters = {name: function(value) for name, value in self.parameters.items()}
        return Vectors([function(w) for w in self.w], [function(d) for d in self.d], offsets, parameters)

    def take(self, index: Ints | slice) -> Vectors:
        """The vectors of some sets of dimensions of a flat batch; a value that is the same for all stays a number."""
        return self.map(lambda value: picked(value, index))


class _Recorded(dict[str, Value]):
    """Dimensions that are all nominal; the keys are the names that have been looked for."""

    def get(self, name: str, default: Any = None) -> Any:
        self[name] = 0.0
        return default


@dataclass(frozen=True)
class Geometry:
    """Evaluates the edges of a graph; dimensions that are not given are nominal."""

    graph: Graph
    places: Mapping[str, Place]

    def term(self, term: Term | Value, values: Mapping[str, Value]) -> Value:
        """Value of a place or number."""
        if isinstance(term, str):
            value = values.get(term)
            return self.places[term].nominal if value is None else value
        return term

    def place(self, body: str, point: str, values: Mapping[str, Value]) -> Vector:
        """Coordinates of a point in its body's frame; of a pin that has an offset, those of its hole."""
        return vector(*(self.term(term, values) for term in self.graph.points[body, point]))

    def local(self, body: str, point: str, values: Mapping[str, Value]) -> Vector:
        """Coordinates of the pin at a point in the body's frame."""
        return vector(*self._local(body, point, values))

    def _local(self, body: str, point: str, values: Mapping[str, Value]) -> tuple[Value, Value]:
        x, y = (self.term(term, values) for term in self.graph.points[body, point])
        dx, dy = self._pin(body, point, values)
        return plus(x, 1, dx), plus(y, 1, dy)

    def _pin(self, body: str, point: str, values: Mapping[str, Value]) -> tuple[Value, Value]:
        """The offset of the pin at a point, in its body's frame."""
        dx, dy = (values.get(name, 0.0) for name in offset_names(body, point))
        return dx, dy

    def angle(self, turns: Sequence[Turn], values: Mapping[str, Value]) -> Value:
        """Sum of turns in radians."""
        total: Value = 0.0
        for turn in turns:
            if turn.towards is None:
                total = total + turn.sign * self.term(turn.term, values)
            else:
                link, a, b = turn.towards
                line = np.subtract(self.place(link, b, values), self.place(link, a, values))
                total = total + turn.sign * np.angle(line)
        return total

    def _offset_of(self, edge: Edge) -> tuple[str, ...]:
        """Place of an edge's offset from the line of a slide, where it has one."""
        graph = self.graph
        on_line = edge.slide is not None and edge.slide not in graph.telescopic
        return (slide_offset(graph.slides[edge.slide]),) if on_line and edge.slide is not None else ()

    @cached_property
    def offsets(self) -> frozenset[str]:
        """Names of the places of all offsets, of pins and of slides."""
        pins = (name for body, point in self.graph.points for name in offset_names(body, point))
        return frozenset([*pins, *(name for edge in self.graph.edges for name in self._offset_of(edge))])

    @cached_property
    def measured(self) -> Mapping[str, str]:
        """Names of the parameters in measures and couplings, and the place of each."""
        return {
            name.removeprefix(MEASURED): name
            for name, place in self.places.items()
            if name.startswith(MEASURED) or place.in_coupling
        }

    @cached_property
    def dependencies(self) -> tuple[frozenset[str], ...]:
        """Names of the places that each edge depends on, offsets included: those that its evaluation reads."""
        names = []
        for edge in self.graph.edges:
            values = _Recorded()
            for _, body, _ in (*edge.locals, *edge.pins):
                self.angle(self.graph.bodies[body][1], values)
            self._edge(edge, values, {})
            names.append(frozenset(values))
        return tuple(names)

    @cached_property
    def nominal(self) -> Vectors:
        """Edges at the nominal dimensions."""
        return self._evaluate({}, None)

    def vectors(self, values: Mapping[str, Value] | None = None) -> Vectors:
        """Edges for given dimensions; only what depends on them is evaluated anew."""
        return self._evaluate(values, self.nominal) if values else self.nominal

    def _evaluate(self, values: Mapping[str, Value], base: Vectors | None) -> Vectors:
        bodies = self.graph.bodies.items()
        offsets = {body: rotation(self.angle(turns, values)) if turns else 1.0 for body, (_, turns) in bodies}
        edges = [
            (base.w[k], base.d[k])
            if base is not None and self.dependencies[k].isdisjoint(values.keys())
            else self._edge(edge, values, offsets)
            for k, edge in enumerate(self.graph.edges)
        ]
        parameters = {name: self.term(place, values) for name, place in self.measured.items()}
        return Vectors([w for w, _ in edges], [d for _, d in edges], offsets, parameters)

    def _edge(
        self, edge: Edge, values: Mapping[str, Value], offsets: Mapping[str, Vector]
    ) -> tuple[Vector, Vector]:  # fmt: skip
        """Vectors w and d of an edge; `offsets` are the rotations of the bodies that have one."""
        total: Vector = 0.0
        x: Value = 0.0
        y: Value = 0.0
        for sign, body, arm, _ in self._arms(edge, values):
            offset = offsets.get(body, 1.0)
            if isinstance(offset, float):
                # No complex number is made of each arm: that costs as much as its product.
                x, y = plus(x, sign, arm[0]), plus(y, sign, arm[1])
            else:
                total = plus(total, sign, vector(*arm) * offset)
        total = plus(total, 1, vector(x, y))
        d: Vector = 0.0
        if edge.slide is not None:
            d = rotation(self.angle(edge.turns, values)) if edge.turns else 1.0 + 0.0j
        for name in self._offset_of(edge):
            shift = values.get(name)
            total = total if shift is None else total + 1j * shift * d
        return total, d

    def angle_derivative(self, turns: Sequence[Turn], place: str, values: Mapping[str, Value]) -> Value:
        """Derivative of a sum of turns (radians) with respect to a place."""
        total: Value = 0.0
        for turn in turns:
            if turn.towards is None:
                total = total + turn.sign * (turn.term == place)
            else:
                link, a, b = turn.towards
                span = self.place(link, b, values) - self.place(link, a, values)
                change = _equal(self.graph.points[link, b], place) - _equal(self.graph.points[link, a], place)
                total = total + turn.sign * cross(span, change) / norm2(span)
        return total

    def derivatives(
        self, place: str, values: Mapping[str, Value], vectors: Vectors
    ) -> tuple[list[Vector], list[Vector]]:
        """Derivatives of all edges' w and d with respect to one place, at dimensions `values` with edges `vectors`."""
        w_z: list[Vector] = []
        d_z: list[Vector] = []
        for k, edge in enumerate(self.graph.edges):
            if place not in self.dependencies[k]:
                w_z.append(0j)
                d_z.append(0j)
                continue
            d_z.append(1j * self.angle_derivative(edge.turns, place, values) * vectors.d[k])
            total: Vector = 0j
            for name in self._offset_of(edge):
                total = 1j * ((place == name) * vectors.d[k] + values.get(name, 0.0) * d_z[k])
            for sign, body, arm, change in self._arms(edge, values, place):
                turn = self.angle_derivative(self.graph.bodies[body][1], place, values)
                total = total + sign * (change + 1j * turn * vector(*arm)) * vectors.offsets[body]
            w_z.append(total)
        return w_z, d_z

    def _arms(
        self, edge: Edge, values: Mapping[str, Value], place: str = ""
    ) -> Iterator[tuple[int, str, tuple[Value, Value], complex]]:
        """Terms of an edge's w: sign, body, x and y in the body's frame, and its derivative by a place."""
        for sign, body, point in edge.locals:
            change = _equal(self.graph.points[body, point], place) + _equal(offset_names(body, point), place)
            yield sign, body, self._local(body, point, values), change
        for sign, body, point in edge.pins:
            yield sign, body, self._pin(body, point, values), _equal(offset_names(body, point), place)


def _equal(terms: tuple[Term, Term], place: str) -> complex:
    """Derivative of the vector of two terms, x and y, by a place."""
    return complex(terms[0] == place, terms[1] == place)
