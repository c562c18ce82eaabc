"""The compiled mechanism: plans for any given coordinates, and the batch solution of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdesign.errors import AssemblyError, MechanismError
from mechdesign.mechanism import closing, diagnosis
from mechdesign.mechanism import coordinates as names
from mechdesign.mechanism.algebra import Value, rotation
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.describe import report
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph, build_graph
from mechdesign.mechanism.independence import check_independent
from mechdesign.mechanism.limits import Bound
from mechdesign.mechanism.model import Description, Limit, Quantity
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.rigidity import Equations
from mechdesign.mechanism.sketch import Sketch, assembly_modes, drawn_value, locate, roots_as_drawn
from mechdesign.mechanism.structure import Undetermined, compile_structure
from mechdesign.mechanism.turns import angles_of

# Angles of slides and clamps in a closed chain, written with ten digits or more, agree this well (radians).
TIE_ROUNDING = 1e-9


class Mechanism:
    """A planar mechanism, compiled once; see `mechdesign.mechanism.model.Description` for what it is made from.

    Raises
    ------
    MechanismError
        If drives and mobility disagree, or the sketch cannot be assembled.
    """

    def __init__(self, description: Description) -> None:
        self.description = description
        self.graph: Graph = build_graph(description)
        self.geometry = Geometry(self.graph, description.places)
        self.nominal: dict[str, float] = {name: place.nominal for name, place in description.places.items()}
        self._plans: dict[tuple[str, ...], Plan] = {}
        self._check_ties()
        self.sketch: Sketch = locate(description, self.graph, self.geometry)
        self._check_mobility()
        self.drives: tuple[str, ...] = tuple(description.drives)
        self.bounds = tuple(self._bound(limit, k) for k, limit in enumerate(description.limits))
        self.forward = self.plan(self.drives)
        self.sketch_configuration = self._assemble_sketch()

    @cached_property
    def size(self) -> float:
        """A characteristic length: the largest rigid vector of the mechanism, for tolerances and steps only."""
        return max(
            [abs(complex(w)) for w in self.geometry.nominal.w] + [abs(x) for x in self.sketch.nodes if x] + [0.0]
        )

    @property
    def mobility(self) -> int:
        """Degrees of freedom by counting: unknowns of the vector loops less their equations."""
        graph = self.graph
        return (graph.classes - 1) + len(graph.slides) + 2 * (len(graph.nodes) - 1) - 2 * len(graph.edges)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all coordinates, drives first."""
        return names.all_names(self.description, self.graph)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of all points."""
        return tuple(node for node in self.graph.nodes if ":" not in node)

    def coordinate(self, name: str) -> Coordinate:
        """Look a coordinate up by name.

        Raises
        ------
        MechanismError
            If there is none of that name.
        """
        return names.resolve(name, self.description, self.graph)

    def quantity(self, name: str) -> Quantity:
        """Kind of a coordinate: ``length``, ``angle`` or ``none``."""
        return self.coordinate(name).quantity

    def describe(self) -> str:
        """Links, joints, mobility and the order of solution, in words."""
        return report(self)

    def _check_ties(self) -> None:
        offsets = self.geometry.nominal.offsets
        for a, b, turns in self.graph.ties:
            gap = float(np.angle(offsets[a] * rotation(self.geometry.angle(turns, {})) / offsets[b]))
            if abs(gap) > TIE_ROUNDING:
                raise MechanismError(
                    f"the angles of the slides and clamps contradict each other: those between '{a}' and '{b}' are "
                    f"{abs(gap) / self.description.angle_unit:.6g} apart on the two ways round; change one, or leave a "
                    "joint out",
                    "mechanism.joints",
                )

    def _check_mobility(self) -> None:
        if len(self.description.drives) != self.mobility:
            drives = [self.coordinate(name) for name in self.description.drives]
            raise diagnosis.wrong_count(self.description, self.equations, self.sketch, self.mobility, drives)

    @property
    def equations(self) -> Equations:
        """All equations at once, to tell what is wrong with a mechanism."""
        return Equations(self.graph, self.geometry, self.size or 1.0)

    def plan(self, given: Sequence[str]) -> Plan:
        """Plan for given coordinates, exactly as many as the mobility; compiled once.

        Raises
        ------
        MechanismError
            If they do not determine the mechanism.
        """
        key = tuple(given)
        if key not in self._plans:
            coordinates = [self.coordinate(name) for name in key]
            if len(key) != self.mobility:
                raise MechanismError(
                    f"a pose gives {self.mobility} coordinate{'s' if self.mobility != 1 else ''} (the mobility), "
                    f"not {len(key)}: {', '.join(key) or 'none'}",
                    "poses",
                )
            try:
                structure = compile_structure(self.graph, coordinates)
                check_independent(self.equations, structure)
            except Undetermined as error:
                raise diagnosis.undetermined(
                    self.description, self.equations, self.sketch, coordinates, str(error)
                ) from None
            modes = assembly_modes(self.graph, self.geometry, structure, self.sketch)
            self._plans[key] = Plan(self, structure, modes)
        return self._plans[key]

    def adopt(self, given: tuple[str, ...], plan: Plan) -> None:
        """Use a plan of another assembly for given coordinates."""
        self._plans = {given: plan}
        if given == self.drives:
            self.forward = plan

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
        named = [self.coordinate(name) for name in (*self.drives, *self.description.measures)]
        found = angles_of([*named, *(bound.coordinate for bound in self.bounds)])
        return {name: float(self.sketch_configuration.value(angle)) for name, angle in found.items()}

    @cached_property
    def counting(self) -> tuple[Coordinate, ...]:
        """Coordinates of the limits that depend on the turns of angles."""
        return tuple(bound.coordinate for bound in self.bounds if bound.counts(self.nominal))

    def linearize(self, configuration: Configuration) -> Linearization:
        """Loop equations of the drives' groups at a configuration, for derivatives of any kind."""
        return Linearization(self.forward.structure, self.geometry, configuration)

    def jacobian(self, configuration: Configuration, outputs: Sequence[Coordinate]) -> NDArray[np.float64]:
        """Derivatives of outputs with respect to the drives, per radian; shape (..., outputs, drives)."""
        rates = self.linearize(configuration).drives()
        full = (len(self.drives), *configuration.shape)
        rows = [np.broadcast_to(first(configuration, output, rates), full) for output in outputs]
        return np.moveaxis(np.stack(rows), (0, 1), (-2, -1))

    def _assemble_sketch(self) -> Configuration:
        plan = self.forward
        given: list[float] = []
        for coordinate in plan.structure.given:
            value = drawn_value(self.graph, self.geometry, self.sketch, coordinate)
            if value is None and (coordinate.kind == "slide" and coordinate.slide in self.graph.telescopic):
                raise MechanismError(
                    f"the ends of leg '{self.graph.slides[coordinate.slide]}' are needed; add them to the sketch",
                    "mechanism.sketch",
                )
            given.append(0.0 if value is None else value)
        guess = roots_as_drawn(self.graph, self.geometry, plan.structure, self.sketch) if plan.iterative else None
        values = [np.asarray(g) for g in given]
        state = plan.run(values, self.geometry.nominal, guess)
        reached = None
        if plan.iterative:
            reached = np.asarray(all(bool(np.all(c)) for c in state.converged))
        configuration = plan.configuration(state, (), {}, self.geometry.nominal, reached, limits=False)
        if not configuration.valid:
            pose = list(zip(plan.structure.given, given, strict=True))
            raise closing.cannot_assemble(self, state, pose)
        closing.check_regular(self, configuration)
        return configuration

    def solve(self, pose: Mapping[str, ArrayLike], places: Mapping[str, ArrayLike] | None = None) -> Pose:
        """One pose or a batch, in the study's units: ``mechanism.solve({"theta": 60})["C.x"]``.

        Parameters
        ----------
        pose : mapping of str to array_like
            As many coordinates as the mobility; arrays broadcast.
        places : mapping of str to array_like, optional
            Changed dimensions by place name, in the study's units.

        Raises
        ------
        AssemblyError
            If a single pose cannot be assembled; in a batch it is nan with ``valid`` False.
        MechanismError
            If the coordinates do not determine the mechanism.
        """
        unit = self.description.angle_unit
        plan = self.plan(tuple(pose))
        given = [
            np.asarray(v, dtype=float) * (unit if c.quantity == "angle" else 1.0)
            for v, c in zip(pose.values(), plan.structure.given, strict=True)
        ]
        dims = {}
        for name, value in (places or {}).items():
            place = self.description.places.get(name)
            if place is None and name not in self.geometry.pin_offsets:
                raise MechanismError(f"'{name}' is not a dimension of this mechanism", name)
            angle = place is not None and place.quantity == "angle"
            dims[name] = np.asarray(value, dtype=float) * (unit if angle else 1.0)
        configuration = plan.solve(given, dims, jobs=None)
        if configuration.shape == () and not configuration.valid:
            where = ", ".join(f"{name} = {float(np.asarray(value)):g}" for name, value in pose.items())
            raise AssemblyError(f"pose {where}: {Reason(int(configuration.reason)).text}")
        return Pose(self, configuration)


class Pose:
    """A solved pose (or batch): ``pose["C.x"]``, ``pose["rocker.angle"]``, in the study's units."""

    def __init__(self, mechanism: Mechanism, configuration: Configuration) -> None:
        self.mechanism = mechanism
        self.configuration = configuration

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each pose is assembled and within its limits."""
        return self.configuration.valid

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        coordinate = self.mechanism.coordinate(name)
        value = np.asarray(self.configuration.value(coordinate), dtype=float)
        if coordinate.quantity == "angle":
            value = value / self.mechanism.description.angle_unit
        return np.broadcast_to(value, self.configuration.shape)[()]
