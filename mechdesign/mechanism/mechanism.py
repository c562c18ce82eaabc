"""The compiled mechanism: plans for any given coordinates, and variants with other dimensions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.errors import AssemblyError, MechanismError
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism import closing, diagnosis
from mechdesign.mechanism import coordinates as names
from mechdesign.mechanism.algebra import Value, rotation
from mechdesign.mechanism.cams import Engagement
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.decomposition import Undetermined, compile_structure
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.followers import cams
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.rigidity import check_independent
from mechdesign.mechanism.sketch import SKETCH

# Angles of slides and clamps around a closed chain may differ by this (radians): they are written with ten digits.
TIE_ROUNDING = 1e-9
# Number of random drive values tried for dimensions that cannot be assembled at the drawn ones.
TRIED_POSES = 512


class Mechanism(Core):
    """A planar mechanism, compiled once; see `mechdesign.mechanism.model.Description` for what it is made from.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... ''')
    >>> study.mechanism.mobility, study.mechanism.drives, study.mechanism.coordinates
    (1, ('arm',), ('arm', 'O.x', 'O.y', 'P.x', 'P.y', 'arm.angle'))

    Raises
    ------
    MechanismError
        If drives and mobility disagree, or the sketch cannot be assembled.
    """

    def __init__(self, description: Description) -> None:
        super().__init__(description)
        self._plans: dict[tuple[str, ...], Plan] = {}
        self._check_ties()
        if len(description.drives) != self.mobility:
            drives = [self.coordinate(name) for name in description.drives]
            raise diagnosis.wrong_count(description, self.equations, self.sketch, self.mobility, drives)
        self.drives: tuple[str, ...] = tuple(description.drives)  #: names of what is given, as many as the mobility
        self.forward = self.plan(self.drives)
        self.sketch_configuration = self._assemble_sketch()
        if self.couplings:
            # What follows from others may be drawn roughly: assembly modes are read from where it really is.
            drawn = self.sketch_configuration
            nodes, rotations, slides = [*drawn.nodes], [*drawn.rotations], [*drawn.slides]
            self.sketch = replace(self.sketch, nodes=nodes, rotations=rotations, slides=slides)
        self.cams = cams(self.couplings, self.forward, self.plan)  #: cams of its couplings

    @property
    def mobility(self) -> int:
        """Degrees of freedom by counting, unknowns of the vector loops less their equations."""
        graph = self.graph
        unknowns = (graph.classes - 1) + len(graph.slides) + 2 * (len(graph.nodes) - 1)
        return unknowns - 2 * len(graph.edges) - len(self.couplings)

    @property
    def engaged(self) -> list[Engagement]:
        """Links that touch as couplings have them move, where the forces between them are known."""
        return [*self.pressing, *self.cams]

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all coordinates, drives first."""
        return names.all_names(self.description, self.graph)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of all points."""
        return tuple(node for node in self.graph.nodes if ":" not in node)

    def quantity(self, name: str) -> Quantity:
        """Kind of a coordinate: ``length``, ``angle`` or ``none``."""
        return self.coordinate(name).quantity

    def contradictions(self, places: Mapping[str, Value]) -> Iterator[tuple[str, str, Floats]]:
        """Pairs of bodies whose relative angle follows in two ways from slides and clamps, and the difference.

        The differences are in radians, of the shape of the dimensions in `places`, and 0 within rounding.
        """
        offsets = self.geometry.vectors(places).offsets
        for a, b, turns in self.graph.ties:
            turned = np.multiply(offsets[a], rotation(self.geometry.angle(turns, places)))
            gap = np.abs(np.angle(turned / offsets[b]))
            yield a, b, np.where(gap > TIE_ROUNDING, gap, 0.0)

    def _check_ties(self) -> None:
        for a, b, gap in self.contradictions({}):
            if gap:
                raise MechanismError(
                    f"the angles of the slides and clamps contradict each other: those between '{a}' and '{b}' are "
                    f"{float(gap) / self.description.angle_unit:.6g} apart on the two ways round; change one, or leave "
                    "a joint out",
                    "mechanism.joints",
                )

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
                structure = compile_structure(self.graph, coordinates, self.couplings)
                check_independent(self.equations, structure)
            except Undetermined as error:
                raise diagnosis.undetermined(
                    self.description, self.equations, self.sketch, coordinates, str(error)
                ) from None
            self._plans[key] = Plan(self, structure, self.sketch.modes(structure))
        return self._plans[key]

    def adopt(self, given: tuple[str, ...], plan: Plan) -> None:
        """Use a plan of another assembly for given coordinates."""
        self._plans = {given: plan}
        if given == self.drives:
            self.forward = plan

    def linearize(self, configuration: Configuration) -> Linearization:
        """Loop equations of the drives' groups at a configuration, for derivatives of any kind."""
        return Linearization(self.forward.structure, self.geometry, configuration)

    def _assemble_sketch(self) -> Configuration:
        plan = self.forward
        given: list[float] = []
        for coordinate in plan.structure.given:
            value = self.sketch.value(coordinate)
            if value is None and (coordinate.kind == "slide" and coordinate.slide in self.graph.telescopic):
                raise MechanismError(
                    f"the ends of leg '{self.graph.slides[coordinate.slide]}' are needed; add them to the sketch",
                    SKETCH,
                )
            given.append(0.0 if value is None else value)
        guess = self.sketch.unknowns(plan.structure) if plan.iterative else None
        values = [np.asarray(g) for g in given]
        state = plan.run(values, self.geometry.nominal, guess, turns=())
        reached = state.solved(()) if plan.iterative else None
        configuration = plan.configuration(state, (), {}, reached)
        if not configuration.valid:
            pose = list(zip(plan.structure.given, given, strict=True))
            raise closing.cannot_assemble(self, plan, state, pose)
        closing.check_regular(self, plan, configuration)
        return configuration

    @np.errstate(all="ignore")
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

        Examples
        --------
        >>> import mechdesign
        >>> study = mechdesign.load(
        ...     text="mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}"
        ... )
        >>> study.mechanism.solve({"arm": [0, 60, 90]})["P.x"].round(6)
        array([100.,  50.,   0.])
        >>> study.mechanism.solve({"arm": 60}, {"arm.length": [100, 120]})["P.x"].round(6)
        array([50., 60.])
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
            if place is None and name not in self.geometry.offsets:
                raise MechanismError(
                    f"'{name}' is not a dimension of this mechanism: a parameter, or a place such as rod.length", name
                )
            angle = place is not None and place.quantity == "angle"
            dims[name] = np.asarray(value, dtype=float) * (unit if angle else 1.0)
        configuration = plan.solve(given, dims, jobs=None)
        if configuration.shape == () and not configuration.valid:
            where = ", ".join(f"{name} = {float(np.asarray(value)):g}" for name, value in pose.items())
            raise AssemblyError(f"pose {where}: {self.why(int(configuration.reason))}")
        return Pose(self, configuration)


class Pose:
    """A solved pose (or batch): ``pose["C.x"]``, ``pose["rocker.angle"]``, in the study's units."""

    def __init__(self, mechanism: Mechanism, configuration: Configuration) -> None:
        self.mechanism = mechanism
        self.configuration = configuration

    @property
    @np.errstate(all="ignore")
    def valid(self) -> Flags:
        """Whether each pose is assembled and within its limits."""
        return self.configuration.valid

    @np.errstate(all="ignore")
    def __getitem__(self, name: str) -> Floats:
        coordinate = self.mechanism.coordinate(name)
        value = np.asarray(self.configuration.value(coordinate), dtype=float)
        if coordinate.quantity == "angle":
            value = value / self.mechanism.description.angle_unit
        return np.broadcast_to(value, self.configuration.shape)[()]


class Variant(Mechanism):
    """A mechanism with other dimensions than its original, whose topology is not compiled again.

    The assembly modes are those of the original. Groups without a closed form start from its sketch, which is continued
    to the new dimensions at the same values of the drives; if that does not close, the start is the sketch itself.

    Raises
    ------
    MechanismError
        If the angles of slides and clamps in a closed chain contradict each other.
    """

    def __init__(self, original: Mechanism, description: Description) -> None:
        self.original = original
        self.description = description
        self.graph = original.graph
        self.geometry = Geometry(self.graph, description.places)
        self.nominal = {name: place.nominal for name, place in description.places.items()}
        self._plans = {}
        self._check_ties()
        self.sketch, self.reach = original.sketch, original.reach
        self.drives = original.drives
        self.bounds = original.bounds
        self.couplings = original.couplings
        self.forward = self.plan(self.drives)
        self.sketch_configuration = self._assemble_sketch()
        self.cams = cams(self.couplings, self.forward, self.plan)

    @property
    def closes(self) -> bool:
        """Whether it can be assembled at the values of the drives at which the original is drawn."""
        return bool(drawn(self.original, self._changed).valid.all())

    @property
    def _changed(self) -> dict[str, float]:
        before = self.original.nominal
        return {name: value for name, value in self.nominal.items() if value != before[name]}

    def plan(self, given: Sequence[str]) -> Plan:
        """Plan for given coordinates, in the assembly of the original's; see `Mechanism.plan`."""
        key = tuple(given)
        if key not in self._plans:
            drawn = self.original.plan(key)
            self._plans[key] = Plan(self, drawn.structure, drawn.modes)
        return self._plans[key]

    def _assemble_sketch(self) -> Configuration:
        before, changed = self.original.nominal, self._changed
        if self.forward.continued:
            pose = begun(self.original, changed)
            return replace(pose, places={name: v for name, v in pose.places.items() if v == before[name]})
        pose = drawn(self.original, changed)
        return replace(pose if pose.valid else elsewhere(self.original, changed), places={})


def elsewhere(mechanism: Mechanism, changed: Mapping[str, Value]) -> Configuration:
    """A pose with other dimensions, and drives as near as possible to the sketch; the sketch if no pose closes."""
    sketch, random = mechanism.sketch_configuration, np.random.default_rng(0)
    given = []
    away = np.zeros(TRIED_POSES)
    for coordinate in mechanism.forward.structure.given:
        part = random.uniform(-1, 1, TRIED_POSES)
        away += part**2
        given.append(sketch.value(coordinate) + part * (np.pi if coordinate.quantity == "angle" else mechanism.size))
    poses = mechanism.forward.solve(given, changed, limits=False)
    if not poses.valid.any():
        return sketch
    return poses.take(int(np.argmin(np.where(poses.valid, away, np.inf))))


def drawn(mechanism: Mechanism, places: Mapping[str, Value]) -> Configuration:
    """The pose with other dimensions and the drives as in the sketch."""
    sketch = mechanism.sketch_configuration
    given = [sketch.value(coordinate) for coordinate in mechanism.forward.structure.given]
    return mechanism.forward.solve(given, places, limits=False)


def begun(mechanism: Mechanism, places: Mapping[str, Value]) -> Configuration:
    """The pose from which groups without a closed form are continued: the sketch with other dimensions, if that closes.

    Otherwise it is the sketch with its own dimensions, which then change on the way to a pose together with the drives.
    """
    sketch = drawn(mechanism, places)
    if sketch.valid.all():
        return sketch
    return drawn(mechanism, {name: np.where(sketch.valid, v, mechanism.nominal[name]) for name, v in places.items()})
