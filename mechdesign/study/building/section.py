"""The mechanism's part of the study file as pydantic models.

Every short form of the format (a link as a list, drives as a list, a measure as an expression) is brought to the one
long form before validation, so that no model is a union and every error has one place.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field

from mechdesign.ground.errors import cut
from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import ExpressionError
from mechdesign.mechanism.elements.couplings import Coupling
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.joints import Friction, Joint
from mechdesign.mechanism.elements.links import Link
from mechdesign.mechanism.elements.measures import Limit, Measure
from mechdesign.mechanism.elements.plates import Plates
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND, OF_LINKS
from mechdesign.study.building import notations
from mechdesign.study.building.elements import Written
from mechdesign.study.text import fields
from mechdesign.study.text.inputs import file_of
from mechdesign.study.text.reading import Context, failure, read_expression, read_rows, shown
from mechdesign.study.text.units import QuantityError, check_unit

_BRANCHES = {
    "side": "in every pose each joint lies on the side on which the sketch has it",
    "follow": "a sweep goes on smoothly through change points, where the sides meet",
}
TARGET_FORMS = (
    "an expression, a number, {file: path.csv}, a list of numbers, of [x, y] or of [drive, x, y], or {curve: [[x, y], "
    "...], closed: true}"
)


TwoLinks = Annotated[tuple[fields.LinkName, fields.LinkName], fields.pair_of("a list of two names")]


def _named_limits(raw: Any) -> Any:
    """What is given as {name: [low, high]} is told with the limits that it means."""
    for given in [raw] if isinstance(raw, dict) else raw if isinstance(raw, list) else []:
        name, bounds = next(iter(given.items()), ("gap", None)) if isinstance(given, dict) else ("", None)
        if given is raw or (isinstance(bounds, list) and name not in Limit.one_of):
            low, high = bounds if isinstance(bounds, list) and len(bounds) == 2 else (30, 150)
            written = cut(f"measure: {name}, min: {low}, max: {high}")
            raise failure(f"a limit says what it is of, a measure, drive, distance or angle: [{{{written}}}]")
    return raw


# Most links of a mechanism; to solve it takes time in proportion to their square.
MAX_LINKS = 1000


class WrittenCurve(NamedTuple):
    """Points that the path of a point shall pass at whatever time, or the name of a file; and whether it is closed."""

    points: tuple[tuple[float, ...], ...] | str
    closed: bool


WrittenTarget = Expression | tuple[tuple[float, ...], ...] | str | WrittenCurve
"""A target as it was written: an expression (a number is one without names), rows, the name of a file, or a curve."""


def _target(raw: Any, context: Context) -> WrittenTarget:
    file = file_of(raw)
    if file is not None and (raw is file or len(raw) == 1):
        return file
    if isinstance(raw, dict) and "curve" in raw and not raw.keys() - {"curve", "closed"}:
        points, closed = file_of(raw["curve"]) or raw["curve"], raw.get("closed", False)
        if not isinstance(closed, bool):
            raise failure(f"closed: expected true or false, not {shown(closed)}")
        if not isinstance(points, str):
            if not isinstance(points, list) or not all(isinstance(row, list) for row in points):
                raise failure(f"curve: expected {{file: path.csv}} or a list of [x, y], not {shown(points)}")
            points = read_rows(points, context, 2, "every row is [x, y]", "curve: an empty list: no target")
        return WrittenCurve(points, closed)
    if raw is None or isinstance(raw, dict):
        raise failure(f"expected {TARGET_FORMS}, not {shown(raw)}")
    if isinstance(raw, list):
        rule = "every row holds the same one, two or three numbers"
        return read_rows(raw, context, 3, rule, "an empty list: no target")
    return read_expression(raw, context)


TargetValue = Annotated[
    WrittenTarget, fields.Read(_target, {"type": ["number", "string", "array", "object"], "title": TARGET_FORMS})
]


def _not_too_many(raw: Any) -> Any:
    if isinstance(raw, dict) and len(raw) > MAX_LINKS:
        raise failure(f"{len(raw)} links are too many: at most {MAX_LINKS} are solved in reasonable time")
    return raw


class MechanismSection(fields.Model):
    """What the mechanism is: links and the points they share, other joints, drives, and a sketch of the wanted
    assembly.
    """

    parameters: dict[str, fields.AnyPlace] = Field(default_factory=dict)
    """Numbers with a name for expressions anywhere in the study; each may use those above it. Example: {r: 40, l: 3*r}
    """
    links: Annotated[dict[fields.LinkName, Written[Link]], BeforeValidator(_not_too_many)]
    """Rigid bodies by name. ``ground`` is required; its frame is the world. A point that two links name is a pin
    between them. Example: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
    """
    joints: dict[fields.JointName, Written[Joint]] = Field(default_factory=dict)
    """What is not a pin, by a name of its own: slides, pins in slots, clamps. Example: {guide: {prismatic: [ground,
    slider], through: G}}
    """
    drives: Annotated[
        dict[fields.DriveName, Written[Drive] | None],
        BeforeValidator(notations.names_to_mapping),
        fields.OrShort(fields.NAMES_FORM),
    ] = Field(default_factory=dict)
    """Driven coordinates by name, as many as the mobility. A list names links (their angle), telescopic links (their
    length) or joints (their slide). Example: [crank] Example: {theta: {angle: crank}}
    """
    springs: dict[fields.SpringName, Written[Spring]] = Field(default_factory=dict)
    """Springs and dampers by name. Example: {return: {between: [S, B], stiffness: 2, free_length: 60}}"""
    couplings: dict[fields.CouplingName, Written[Coupling]] = Field(default_factory=dict)
    """Coordinates that follow others, by name; each takes one drive's place. Example: {mesh: {set: planet.angle, of:
    sun.angle, ratio: -2.5}} Example: {cam: {set: follower, to: 12 + 5*(1 - cos(2*crank))}}
    """
    friction: dict[fields.JointName, Written[Friction]] = Field(default_factory=dict)
    """Friction of joints by the name of a point whose pin turns, a slide, a slot or a telescopic link. Example: {A:
    {coefficient: 0.1, radius: 5}, guide: {coefficient: 0.15, length: 40}}
    """
    plates: Written[Plates] | None = None
    """Links as plates: widths and pins, for `mechdesign export` and ``kinematics.collisions``. Example: {width: 20 mm,
    thickness: 5 mm, pin: 6 mm}
    """
    branch: Annotated[str, fields.choice(_BRANCHES, "branch")] = "side"
    """Which way of assembly a pose has."""
    sketch: dict[fields.PointName, notations.Point] = Field(default_factory=dict)
    """Rough places of the joints in the wanted assembly, [x, y]; any pose will do. In a dyad only the side on which
    each joint lies counts; what is left out elsewhere is measured here exactly. Example: {A: [0, 30], B: [75, 55]}
    """
    measures: dict[fields.MeasureName, Written[Measure]] = Field(default_factory=dict)
    """Named quantities, usable like coordinates: reported where ``outputs`` names them, limited, required, optimised.
    Example: {mu: {angle: [rod, rocker]}, lead: B.x - A.x}
    """
    limits: Annotated[tuple[Written[Limit], ...], BeforeValidator(_named_limits)] = ()
    """What the motion keeps. A pose outside has valid 0 but keeps its positions; the nominal mechanism is judged.
    Example: [{distance: [P, Q], min: 10}, {drive: crank, max: 120}]
    """
    targets: dict[fields.CoordinateName, TargetValue] = Field(default_factory=dict)
    """What coordinates, measures or points should be; kinematics then reports their errors. An expression; a file;
    numbers, one a pose; rows [drive, value]; of a point rows [x, y] or [drive, x, y], or a curve that it shall pass
    at whatever time. Example: {rocker.angle: 67 + 0.6*(crank - 40)} Example: {C: {file: path.csv}} Example: {P:
    {curve: [[55, 60], [45, 75], [25, 75]], closed: true}}
    """

    # The properties below hold even if other parts of the section are wrong.

    def points_of(self, link: str) -> list[str]:
        """Names of a link's points, its ends first."""
        section = self.links.get(link)
        if section is None:
            return []
        return [*(end for end in (section.from_, section.to) if end is not None), *section.points]

    @cached_property
    def owners(self) -> Mapping[str, list[str]]:
        """Every point with the links that have it, in the order of the study."""
        owners: dict[str, list[str]] = {}
        for link in self.links:
            for point in self.points_of(link):
                owners.setdefault(point, []).append(link)
        return owners

    @cached_property
    def joined(self) -> frozenset[str]:
        """Points at which links are joined: pins, points that slide, and those that lines of slides go through."""
        pins = [point for point, links in self.owners.items() if len(links) > 1]
        sliding = [joint.point for joint in self.joints.values() if joint.point is not None]
        return frozenset([*pins, *sliding, *(point for joint in self.joints.values() for point in joint.through or ())])

    @cached_property
    def ends(self) -> Mapping[str, tuple[str, str]]:
        """Points of links as ``rod.B``, which at a pin is the end on that link; link and point of each."""
        points = [(link, point) for link in self.links for point in self.points_of(link) if point not in OF_LINKS]
        return {".".join(end): end for end in points}

    def coordinates_of(self, name: str) -> tuple[str, ...]:
        """The coordinates of a point, also of one of a link; of what is no point, its name."""
        return (f"{name}.x", f"{name}.y") if name in self.owners or name in self.ends else (name,)

    @cached_property
    def moving(self) -> list[str]:
        """Links other than the ground."""
        return [name for name in self.links if name != GROUND]

    @cached_property
    def legs(self) -> list[str]:
        """Telescopic links."""
        return [name for name, link in self.links.items() if link.telescopic]

    @cached_property
    def slides(self) -> list[str]:
        """Joints whose displacement is a coordinate."""
        return [name for name, joint in self.joints.items() if joint.kind in ("prismatic", "slot")]

    def driven(self, drive: str) -> tuple[Literal["angle", "length", "slide"], str]:
        """What a drive changes, and of which link, leg or joint."""
        section = self.drives[drive]
        if section is not None:
            return section.kind, getattr(section, section.kind)
        return "slide" if drive in self.slides else "length" if drive in self.legs else "angle", drive

    def coordinate_named(self, name: str) -> str:
        """The coordinate that the name of a link, leg or slide stands for; any other name as it is."""
        if name in self.drives:
            return name
        ending = "slide" if name in self.slides else "length" if name in self.legs else "angle"
        return f"{name}.{ending}" if name in (*self.slides, *self.moving) else name

    @cached_property
    def driven_kinds(self) -> Mapping[str, Quantity]:
        """Drives and the kind of each."""
        return {name: "angle" if self.driven(name)[0] == "angle" else "length" for name in self.drives}

    @cached_property
    def measured_kinds(self) -> Mapping[str, Quantity]:
        """Measures and the kind of each."""
        coordinates, kinds = dict(self._coordinates), dict[str, Quantity]()
        for name, measure in self.measures.items():
            kinds[name] = "angle" if measure.kind == "angle" else "length"
            if measure.expression is not None:
                kinds[name] = "none"
                # A text that is no expression is reported by `description`.
                with suppress(ExpressionError):
                    kinds[name] = "angle" if Expression.parse(measure.expression).is_angle(coordinates) else "none"
            coordinates[name] = kinds[name]
        return kinds

    @cached_property
    def coordinates(self) -> Mapping[str, Quantity]:
        """Every coordinate and its kind, measures and those of a link's points last."""
        ends: dict[str, Quantity] = {f"{end}.{axis}": "length" for end in self.ends for axis in "xy"}
        return {**self._coordinates, **self.measured_kinds, **ends}

    @cached_property
    def _coordinates(self) -> Mapping[str, Quantity]:
        """Every coordinate but measures and those of a link's points."""
        kinds: dict[str, Quantity] = dict(self.driven_kinds)
        for point in self.owners:
            kinds[f"{point}.x"] = kinds[f"{point}.y"] = "length"
        for link in self.moving:
            kinds[f"{link}.angle"] = "angle"
        for leg in self.legs:
            kinds[f"{leg}.length"] = "length"
        for slide in self.slides:
            kinds[f"{slide}.slide"] = "length"
        return kinds


def _unit_of(kind: str) -> fields.Read:
    def read(raw: Any, context: Context) -> str:
        if not isinstance(raw, str):
            raise failure(f"expected a text, not {shown(raw)}")
        try:
            check_unit(kind, raw)
        except QuantityError as error:
            raise failure(str(error)) from None
        return raw

    return fields.Read(read, {**fields.NAME_FORM, "title": f"unit of {kind}"})


class UnitsSection(fields.Model):
    """Units that bare numbers mean and that tables have."""

    length: Annotated[str, _unit_of("length")] = "mm"
    """Unit of lengths; ``dimensionless`` where they are multiples of one of them. Example: m"""
    angle: Annotated[str, _unit_of("angle")] = "deg"
    """Unit of angles, in values, rates and the trigonometry of expressions. Jacobians and stiffnesses are per radian
    all the same. Example: rad
    """
    time: Annotated[str, _unit_of("time")] = "s"
    """Unit of time. Example: min"""
    mass: Annotated[str, _unit_of("mass")] = "kg"
    """Unit of masses; moments of inertia and densities follow from it and the length. Example: g"""
    force: Annotated[str, _unit_of("force")] = "N"
    """Unit of forces; moments and stresses follow from it and the length. Example: kN"""
