"""What a plan solves: the compiled graph and geometry of a mechanism, its limits, and where solutions start from."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from mechdesign.mechanism import coordinates as names
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph, build_graph
from mechdesign.mechanism.limits import Bound
from mechdesign.mechanism.model import Description, Limit
from mechdesign.mechanism.rigidity import Equations
from mechdesign.mechanism.sketch import Sketch, locate
from mechdesign.mechanism.turns import angles_of


class Core:
    """Graph, geometry and limits of a mechanism; `sketch_configuration` is its sketch, once that is assembled."""

    sketch_configuration: Configuration

    def __init__(self, description: Description) -> None:
        self.description = description
        self.graph: Graph = build_graph(description)
        self.geometry = Geometry(self.graph, description.places)
        self.nominal: dict[str, float] = {name: place.nominal for name, place in description.places.items()}
        self.sketch: Sketch = locate(description, self.graph, self.geometry)
        self.bounds = tuple(self._bound(limit, k) for k, limit in enumerate(description.limits))

    @cached_property
    def size(self) -> float:
        """A characteristic length: the largest rigid vector of the mechanism, for tolerances and steps only."""
        return max(
            [abs(complex(w)) for w in self.geometry.nominal.w] + [abs(x) for x in self.sketch.nodes if x] + [0.0]
        )

    @property
    def equations(self) -> Equations:
        """All equations at once, to tell what is wrong with a mechanism."""
        return Equations(self.graph, self.geometry, self.size or 1.0)

    def coordinate(self, name: str) -> Coordinate:
        """Look a coordinate up by name.

        Raises
        ------
        MechanismError
            If there is none of that name.
        """
        return names.resolve(name, self.description, self.graph)

    def margins(self, configuration: Configuration) -> list[tuple[str, Value]]:
        """Named margins of all limits: positive inside (see `mechdesign.mechanism.limits`)."""
        places = {**self.nominal, **configuration.places}
        return [margin for bound in self.bounds for margin in bound.margins(configuration, places)]

    def turns(self, places: Mapping[str, Value]) -> dict[str, Value]:
        """Values that drives' angles lie within half a turn of, so that they lie within their limits."""
        sizes = {**self.nominal, **places} if places else self.nominal
        near: dict[str, Value] = {}
        for bound in self.bounds:
            near |= bound.turn(sizes)
        return near

    def drawn_angles(self) -> dict[str, float]:
        """Angles of drives and in measures and limits as the sketch has them (radians)."""
        named = [self.coordinate(name) for name in (*self.description.drives, *self.description.measures)]
        found = angles_of([*named, *(bound.coordinate for bound in self.bounds)])
        return {name: float(self.sketch_configuration.value(angle)) for name, angle in found.items()}

    @cached_property
    def counting(self) -> tuple[Coordinate, ...]:
        """Coordinates of the limits that depend on the turns of angles."""
        return tuple(bound.coordinate for bound in self.bounds if bound.counts(self.nominal))

    def _bound(self, limit: Limit, index: int) -> Bound:
        if limit.kind == "distance":
            a, b = (self.graph.node(point) for point in limit.items)
            coordinate = Coordinate("-".join(limit.items), "distance", "length", node=a, other=b)
        elif limit.kind == "angle":
            coordinate = Coordinate(
                "-".join(limit.items), "angle", "angle", body=limit.items[1], reference=limit.items[0]
            )
        else:
            coordinate = self.coordinate(limit.items[0])
        label = limit.label or f"limits.{index}"
        return Bound(coordinate, limit.minimum, limit.maximum, label, limit.kind == "drive")
