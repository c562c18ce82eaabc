"""What a plan solves: the compiled graph and geometry of a mechanism, its limits, and where solutions start from.

Limits of motion that a study states are margins: positive inside, zero at the limit, negative outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import coordinates as names
from mechdesign.mechanism.algebra import TURN, Value, Vector, largest, norm2, wrap
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.elements.measures import Limit
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph, build_graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.rigidity import LoopEquations
from mechdesign.mechanism.sketch import Sketch, locate
from mechdesign.mechanism.wheels import Mesh, meshes

# An angle that begins within this distance of half a turn (radians) is half a turn, not minus half a turn.
ON_THE_CUT = 1e-9


@dataclass(frozen=True)
class Bound:
    """A limit with its coordinate."""

    coordinate: Coordinate
    limit: Limit

    @property
    def drive(self) -> bool:
        """Whether it is of a drive, whose turns count."""
        return bool(self.limit.kind == "drive")

    def scale(self, size: float) -> float:
        """Unit of rounding errors in this limit's margins, for a mechanism of a given size."""
        if self.coordinate.kind == "distance":
            return size**2
        return 2 * np.pi if self.coordinate.quantity == "angle" else size

    def margins(
        self, configuration: Configuration, places: Mapping[str, Value], *, smooth: bool = False
    ) -> Iterator[tuple[str, Value]]:  # fmt: skip
        """Margins of this limit, each named; distances and legs as differences of squares, quadratic in positions.

        An angle between bounds is judged modulo a turn: it holds if (value - min) mod turn <= max - min. Where the
        turns of a drive count (it is given, or followed along a motion) its value itself is judged, and so is any angle
        that is followed between bounds a turn apart or more. `smooth` gives functions of the same sign without corners.
        """
        low, high = self.ends(places)
        if self.coordinate.kind == "distance":
            a, b = configuration.nodes[self.coordinate.node], configuration.nodes[self.coordinate.other]
            value = norm2(b - a)
            low, high = _squared(low), _squared(high)
        elif self.coordinate.kind == "slide" and self.coordinate.slide in configuration.graph.telescopic:
            slide = configuration.slides[self.coordinate.slide]
            value, low, high = slide * np.abs(slide), _squared(low), _squared(high)
        else:
            away = self.away(configuration, places)
            if away is not None and low is not None and high is not None:
                half, counted = (high - low) / 2, self.coordinate.name in configuration.counted
                whole = half >= np.pi
                margin = half - np.abs(away)
                if smooth:
                    turns = counted & np.asarray(self.drive | whole)
                    margin = np.where(turns, np.square(half) - np.square(away), np.cos(away) - np.cos(half))
                if not counted:
                    # A full turn leaves nothing out; its margin is a number, for margins are interpolated.
                    margin = np.where(whole, np.pi, margin)
                yield self.limit.name, margin
                return
            value = configuration.value(self.coordinate)
        if low is not None:
            yield f"{self.limit.name} min", value - low
        if high is not None:
            yield f"{self.limit.name} max", high - value

    def away(self, configuration: Configuration, places: Mapping[str, Value]) -> Value | None:
        """How far an angle between two bounds is from their middle (radians); None of other limits."""
        low, high = self.ends(places)
        if not self.of_angle or low is None or high is None:
            return None
        half = (high - low) / 2
        away = configuration.value(self.coordinate) - (low + half)
        # A drive's angle is given, or already in the turn of its limits.
        return away if self.drive else np.where(half >= np.pi, away, wrap(away))

    @property
    def of_angle(self) -> bool:
        """Whether it bounds an angle on both sides, so modulo a turn; an angle from an expression is not meant."""
        return self.coordinate.kind == "angle" and None not in (self.limit.min, self.limit.max)

    def counts(self, places: Mapping[str, Value]) -> bool:
        """Whether whole turns of an angle matter: in an expression, or if the ends are a turn or more apart."""
        low, high = self.ends(places)
        whole = low is not None and high is not None and bool(np.any(high - low >= TURN))
        return self.coordinate.kind == "expression" or (self.of_angle and whole)

    def ends(self, places: Mapping[str, Value]) -> tuple[Value | None, Value | None]:
        """Smallest and largest value for given values of the places; None for a side that is left open."""
        low, high = (places[end] if isinstance(end, str) else end for end in (self.limit.min, self.limit.max))
        return low, high


def _squared(value: Value | None) -> Value | None:
    return None if value is None else value * np.abs(value)


class Core:
    """Graph, geometry and limits of a mechanism; `sketch_configuration` is the assembled sketch."""

    sketch_configuration: Configuration

    def __init__(self, description: Description) -> None:
        self.description = description
        self.graph: Graph = build_graph(description)
        self.geometry = Geometry(self.graph, description.places)
        self.nominal: dict[str, float] = {name: place.nominal for name, place in description.places.items()}
        self.couplings = tuple(names.coupled(c, description, self.graph) for c in description.couplings.values())
        self.sketch: Sketch = locate(description, self.graph, self.geometry)
        #: Distance of the farthest point from the origin, as it is drawn.
        self.reach = max((abs(complex(node)) for node in self.sketch.nodes if node is not None), default=0.0)
        self.bounds = tuple(map(self._bound, description.limits))

    def why(self, number: int) -> str:
        """A reason of poses in words, see `Reason`; of a coupling without a value with its name."""
        reason = Reason.of(number)
        if reason != Reason.NO_VALUE:
            return reason.text
        coupling = self.couplings[number - Reason.NO_VALUE]
        expression, parts = coupling.function.expression, coupling.function.parts
        words = f"coupling '{coupling.name}' has no value"
        if expression is None or expression.table is None:
            return words
        followed = next(part.name for part in parts if part.kind != "parameter")
        first, last = (row[0] for row in (expression.table.rows[0], expression.table.rows[-1]))
        return f"{words}: '{followed}' is outside of its table, {first:g} to {last:g}"

    @cached_property
    def meshes(self) -> list[Mesh]:
        """Wheels that make its couplings."""
        return meshes(self.description, self.graph, self.couplings, self.sketch_configuration)

    @property
    def pressing(self) -> list[Mesh]:
        """Those whose forces are known."""
        return [mesh for mesh in self.meshes if mesh.presses]

    def pitch_radius(self, coupling: str, places: Mapping[str, Value]) -> Value | None:
        """Radius of the pitch circle of the wheel that follows by a coupling, at dimensions that are not all nominal.

        None where the coupling has no pitch circle.
        """
        mesh = next((mesh for mesh in self.pressing if mesh.coupling == coupling), None)
        if mesh is None:
            return None
        # Where the carrier's frame is the world, its axes are where its points are.
        nodes = list(self.sketch_configuration.nodes)
        for axis in mesh.axes:
            if (mesh.carrier, self.graph.nodes[axis]) in self.graph.points:
                nodes[axis] = self.geometry.place(mesh.carrier, self.graph.nodes[axis], places)
        vectors = self.geometry.vectors(places)
        radii = mesh.radii(replace(self.sketch_configuration, vectors=vectors, nodes=nodes))
        return dict(zip(mesh.links, radii, strict=True)).get(self.couplings[mesh.index].follower.body)

    @cached_property
    def size(self) -> float:
        """A characteristic length: the largest rigid vector of the mechanism, for tolerances and steps only.

        Of slides that are drawn at the origin it is the largest of their other lengths, or else a unit.
        """
        return float(self.sizes({}))

    def sizes(self, places: Mapping[str, Value]) -> Floats:
        """The characteristic length at dimensions that are not all nominal."""
        vectors = largest((np.hypot(w.real, w.imag) for w in self.geometry.vectors(places).w), self.reach)
        lengths = largest(
            np.abs(places.get(name, place.nominal))
            for name, place in self.description.places.items() if place.quantity == "length"
        )  # fmt: skip
        return np.where(vectors, vectors, np.where(lengths, lengths, 1.0))

    @cached_property
    def windings(self) -> dict[str, Coordinate]:
        """Angles of torsion springs by name, whose turns count from the sketch."""
        springs = [spring for spring in self.description.springs.values() if spring.turning]
        return {angle.name: angle for angle in map(names.winding, springs)}

    @property
    def drawn_windings(self) -> dict[str, float]:
        """These angles in the sketch (radians), from minus half a turn to half a turn."""
        drawn = {name: float(self.sketch_configuration.value(angle)) for name, angle in self.windings.items()}
        return {name: angle + TURN * (angle < ON_THE_CUT - np.pi) for name, angle in drawn.items()}

    @property
    def equations(self) -> LoopEquations:
        """The equations of all edges, from which diagnosis finds what is wrong with a mechanism."""
        return LoopEquations(self.graph, self.geometry, self.size, tuple(c.gap for c in self.couplings))

    def coordinate(self, name: str) -> Coordinate:
        """Look a coordinate up by name.

        Raises
        ------
        MechanismError
            If there is none of that name.
        """
        return names.resolve(name, self.description, self.graph)

    def frame(self, body: str, configuration: Configuration) -> tuple[Vector, Vector]:
        """Origin and x axis of a body's frame in the world."""
        base, along = self.graph.bases[body], configuration.body_rotation(body)
        local = self.geometry.local(body, self.graph.nodes[base], configuration.places)
        return configuration.nodes[base] - local * along, along

    def margins(self, configuration: Configuration, *, smooth: bool = False) -> list[tuple[str, Value]]:
        """Named margins of all limits: positive inside; see `Bound.margins`."""
        places = {**self.nominal, **configuration.places}
        return [margin for bound in self.bounds for margin in bound.margins(configuration, places, smooth=smooth)]

    def turns(self, places: Mapping[str, Value]) -> dict[str, Value]:
        """By drive with limits of its angle, a value within half a turn of which the angle lies within these limits."""
        sizes = {**self.nominal, **places} if places else self.nominal
        near: dict[str, Value] = {}
        for bound in self.bounds:
            low, high = bound.ends(sizes)
            if bound.drive and bound.of_angle and low is not None and high is not None:
                # Between limits a turn apart or more, the turn nearest to zero.
                middle, room = (low + high) / 2, np.maximum((high - low) / 2 - np.pi, 0.0)
                near[bound.coordinate.name] = np.clip(0.0, middle - room, middle + room)
        return near

    def drawn_angles(self) -> dict[str, float]:
        """Angles of drives, and angles in measures and limits, in the sketch (radians)."""
        named = [self.coordinate(name) for name in (*self.description.drives, *self.description.measures)]
        angles = angles_of([*named, *(bound.coordinate for bound in self.bounds)])
        return {name: float(self.sketch_configuration.value(angle)) for name, angle in angles.items()}

    @cached_property
    def counting(self) -> tuple[Coordinate, ...]:
        """Coordinates of the limits that depend on the turns of angles."""
        return tuple(bound.coordinate for bound in self.bounds if bound.counts(self.nominal))

    def _bound(self, limit: Limit) -> Bound:
        if limit.kind in ("distance", "angle"):
            coordinate = names.between("-".join(limit.items), limit.kind, limit.items, self.graph)
        else:
            coordinate = self.coordinate(limit.items[0])
        return Bound(coordinate, limit)
