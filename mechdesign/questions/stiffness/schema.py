"""The stiffness section of the study file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, model_validator

from mechdesign.ground.expressions import Expression, Number
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.graph import GROUND
from mechdesign.study.schema.checker import NO_MOMENT, Checker
from mechdesign.study.schema.loads import Load, check_loads
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import failure

# Keys of each form of cross-section.
_FORMS = (("width", "height"), ("diameter",), ("diameter", "inner_diameter"), ("area", "inertia"))
_STIFFNESS_KINDS: dict[Quantity, str] = {"length": "stiffness", "angle": "rotational_stiffness"}


class CrossSection(fields.Model):
    """A cross-section: {E, width, height}, {E, diameter}, {E, diameter, inner_diameter} or {E, area, inertia}."""

    E: fields.PositiveStress
    """Young's modulus. Example: 200 GPa"""
    G: fields.PositiveStress | None = None
    """Shear modulus; with ``shear: true``. Example: 80 GPa"""
    width: fields.PositiveLength | None = None
    """Side of a rectangle across the plane of motion. Example: 20 mm"""
    height: fields.PositiveLength | None = None
    """Side of a rectangle in the plane of motion, in which it bends. Example: 40 mm"""
    diameter: fields.PositiveLength | None = None
    """Outer diameter of a round bar or tube. Example: 30 mm"""
    inner_diameter: fields.PositiveLength | None = None
    """Inner diameter of a tube. Left out: a full bar. Example: 26 mm"""
    area: fields.PositiveArea | None = None
    """Area of any other section. Example: 800 mm^2"""
    inertia: fields.PositiveInertia | None = None
    """Second moment of area for bending in the plane. Example: 1e5 mm^4"""
    density: fields.PositiveDensity | None = None
    """Mass per volume: a link that bends and has no ``mass`` has that of its beams in dynamics. Example: 7850 kg/m^3"""
    shear: bool = False
    """Whether shear gives too (Timoshenko's beam)."""
    shear_factor: fields.Positive | None = None
    """Shear factor. Left out: that of the form by Cowper (1966), Poisson's ratio 0: 5/6 of a rectangle, 6/7 of a round
    bar, 1/2 of a thin tube; 5/6 of {area, inertia}. Example: 0.85
    """

    def faults(self) -> Iterator[str]:
        if tuple(self.given(*dict.fromkeys(key for form in _FORMS for key in form))) not in _FORMS:
            yield (
                "a section is {E, width, height}, {E, diameter}, {E, diameter, inner_diameter} or {E, area, inertia}"
            )
        if self.shear and self.G is None:
            yield "'shear: true' needs the shear modulus 'G'"
        if self.shear_factor is not None and not self.shear:
            yield "a 'shear_factor' counts with 'shear: true' only"

    def misfits(self) -> Iterator[fields.Misfit]:
        if self.inner_diameter is not None and self.diameter is not None:
            diameters = (self.inner_diameter, self.diameter)
            solid = self.inner_diameter >= self.diameter
            yield fields.Misfit(solid, "the inner diameter {} is not below the outer one {}", diameters)

    @property
    def extent(self) -> tuple[Number, Number, Number]:
        """Area, second moment of area for bending in the plane, and shear factor; arrays where numbers are."""
        area: Number
        inertia: Number
        factor: Number
        if self.width is not None and self.height is not None:
            area, inertia, factor = self.width * self.height, self.width * self.height**3 / 12, 5 / 6
        elif self.diameter is not None:
            m = 0.0 if self.inner_diameter is None else self.inner_diameter / self.diameter
            area = math.pi / 4 * self.diameter**2 * (1 - m * m)
            inertia = math.pi / 64 * self.diameter**4 * (1 - m**4)
            factor = 6 * (1 + m * m) ** 2 / (7 * (1 + m * m) ** 2 + 20 * m * m)
        else:
            assert self.area is not None
            assert self.inertia is not None
            area, inertia, factor = self.area, self.inertia, 5 / 6
        return area, inertia, factor if self.shear_factor is None else self.shear_factor


class Bearing(fields.Model):
    """Stiffness of a joint itself; what is not given is rigid, and a number alone is ``radial``."""

    bare, short = "radial", (fields.NUMBER_FORM,)
    radial: fields.PositiveNumber | None = None
    """Force per displacement: of a pin in any direction, of a slide across its line. Example: 1e5 N/mm"""
    moment: fields.PositiveNumber | None = None
    """Moment per radian against turning, of a slide. Example: 1e6 N*m/rad"""

    def faults(self) -> Iterator[str]:
        if not self.given("radial", "moment"):
            yield "a bearing has a 'radial' stiffness, and that of a slide a 'moment' stiffness too"


class CouplingStiffness(fields.Model):
    """Stiffness of a coupling; a number alone is ``force``. What is given is in series."""

    bare, short = "force", (fields.NUMBER_FORM,)
    force: fields.PositiveNumber | None = None
    """Force per displacement: of teeth along the pitch circles, of a belt or rack along it, of a `cam` along the normal
    of the contact, else of the slide or length that follows. Example: 2e4 N/mm
    """
    moment: fields.PositiveNumber | None = None
    """Moment per radian of the angle that follows. Example: 1e4 N*m/rad"""

    def faults(self) -> Iterator[str]:
        if not self.given("force", "moment"):
            yield "a coupling that gives has a 'force' stiffness or, where an angle follows, one of 'moment'"


# Stiffnesses in series.
_Series = Annotated[tuple[fields.PositiveNumber, ...], BeforeValidator(fields.as_list), fields.OrShort()]

_SHORT_LOAD: fields.Form = {"type": "array", "items": fields.NUMBER_FORM, "minItems": 2, "maxItems": 3, "title": "load"}


def _load(raw: Any, section: dict[str, Any]) -> Any:
    """A load [fx, fy, mz] on the asked point in the form of all loads."""
    if not isinstance(raw, list):
        return raw
    link = section.get("link")
    if len(raw) not in ((2, 3) if link is None else (3,)):
        raise failure(f"a load is [fx, fy, mz], not {len(raw)} numbers")
    load = {"at": section.get("at"), "force": raw[:2]}
    if link is None and raw[2:] not in ([], [0]):
        raise failure(NO_MOMENT)
    return load if link is None else {**load, "link": link, "moment": raw[2]}


class StiffnessSection(PoseSection):
    """What bends, turns or gives, and the point at which stiffness and deflections are asked."""

    command: ClassVar[str] = "stiffness"
    link: fields.LinkName | None = None
    """Link whose stiffness is asked, as a body. Left out: the pin ``at`` alone, which has dx and dy only. Example:
    platform
    """
    at: fields.EndName
    """The point whose stiffness is asked. Without ``link`` a pin that gives is midway between its links; rod.B is its
    end on link rod. Example: P
    """
    sections: dict[str, CrossSection] = Field(default_factory=dict)
    """Cross-sections by name, for ``elastic``. Example: {beam: {E: 200 GPa, width: 20 mm, height: 40 mm}}"""
    elastic: dict[fields.LinkName, str] = Field(default_factory=dict)
    """Section of each link that bends; other links are rigid. A link is a beam from ``from`` to ``to``, its other
    points brackets, rigid from their foot on it; a link of points alone is beams along them as listed; a telescopic one
    a cantilever from ``from``. Example: {leg_1: beam, leg_2: beam}
    """
    actuators: dict[fields.DriveName, _Series] = Field(default_factory=dict)
    """Stiffness of each drive that gives, or a list of those in series; other drives are rigid. A bare one of an angle
    is moment per radian. Example: {l1: 5e7, theta1: 1e5 N*m/rad} Example: {theta: [3e4 N*m/rad, 1.5e4 N*m/rad]}
    """
    bearings: dict[fields.BearingName, Bearing] = Field(default_factory=dict)
    """Stiffness of pins (by their point) and slides (by their joint or telescopic link); others are rigid. Every link
    at a pin that gives has an end of it, rod.B. Example: {B: 1e5 N/mm, guide: {radial: 2e5 N/mm, moment: 1e6 N*m/rad}}
    """
    couplings: dict[fields.CouplingName, CouplingStiffness] = Field(default_factory=dict)
    """Stiffness of each coupling that gives; others are rigid. Example: {gears: 5e4 N/mm, belt: 300 N/mm} Example:
    {wrist: {moment: 1e4 N*m/rad}}
    """
    direction: fields.Angle | None = None
    """Angle from the world's x axis of the direction whose stiffness is k_direction. Left out: that column is not
    there. Example: 90
    """
    loads: tuple[Annotated[Load, fields.OrShort(_SHORT_LOAD)], ...] = ()
    """Loads, each a case of its own; their deflections are reported. [fx, fy, mz] acts on the asked point; without
    ``link`` [fx, fy] is enough. Others are those of kinematics: at any point, between two, on any link; on a link that
    bends a moment acts at its first point. Example: [[100, 0, 0], [0, 100, 0]] Example: [{at: B, force: [100, 0]},
    {link: crank, moment: 20*sin(theta)}]
    """
    dynamics: bool = False
    """Whether what acts in the section dynamics (weights, inertia, springs and loads) is one more load, the last. Its
    poses are then those of dynamics, unless the drives have constant rates or none. Example: true
    """
    characteristic_length: fields.PositiveLength | None = None
    """Length as which a radian counts; then the eigen-stiffnesses of ``link`` are reported. Example: 0.1"""

    @model_validator(mode="before")
    @classmethod
    def _loads_in_full(cls, raw: Any) -> Any:
        if not isinstance(raw, dict) or not isinstance(raw.get("loads"), list):
            return raw
        # Without a point, which is a mistake of its own, a list of numbers acts nowhere.
        loads = [_load(load, raw) for load in raw["loads"] if "at" in raw or not isinstance(load, list)]
        return {**raw, "loads": loads}

    @property
    def wrenches(self) -> list[tuple[Number, Number, Number] | None]:
        """Of each load fx, fy, mz on the asked point in numbers; None of one elsewhere, or that follows the pose."""
        return [self._on_point(load) for load in self.loads] + [None] * self.dynamics

    def _on_point(self, load: Load) -> tuple[Number, Number, Number] | None:
        here = load.at in (None, self.at) and load.link in (None, self.link) and load.in_ is None
        if not here or load.between is not None:
            return None
        numbers = {keys[-1]: quantity for keys, quantity, _ in load.numbers if not isinstance(quantity, Expression)}
        if len(numbers) < len(list(load.numbers)):
            return None
        return numbers.get(0, 0.0), numbers.get(1, 0.0), numbers.get("moment", 0.0)

    @property
    def fallbacks(self) -> tuple[str, ...]:
        """Sections whose poses it takes without any of its own."""
        return ("dynamics",) * self.dynamics + super().fallbacks

    @property
    def point(self) -> str:
        """The point without its link."""
        return self.at.rpartition(".")[2]

    @property
    def bearer(self) -> str | None:
        """The link of the point; None for a pin."""
        return self.link or self.at.rpartition(".")[0] or None

    def checked(self, checker: Checker) -> Self:
        """Also check names, the units of stiffnesses, and loads."""
        root: KeyPath = ("stiffness",)
        owners, ends = checker.mechanism.owners, checker.mechanism.ends
        right = checker.check_name(self.at, [*owners, *ends], "point", (*root, "at"))
        if right and GROUND in (owners[self.at] if self.bearer is None else [self.bearer]):
            checker.report((*root, "at"), f"point {self.at!r} belongs to the ground and does not move")
        moving = checker.mechanism.moving
        if self.link is not None and checker.check_name(self.link, moving, "moving link", (*root, "link")):
            points = checker.mechanism.points_of(self.link)
            if right and self.at not in points and self.at != f"{self.link}.{self.point}":
                message = f"link {self.link!r} has no point {self.at!r}; it has {', '.join(points)}"
                checker.report((*root, "at"), message)
        for link, profile in self.elastic.items():
            path: KeyPath = (*root, "elastic", link)
            checker.check_name(link, checker.mechanism.moving, "moving link", path, at_key=True)
            checker.check_name(profile, self.sections, "section", path)
        named = [*self.elastic.values(), *checker.choices()]
        for profile in self.sections:
            if profile not in named:
                others = [other for other in self.sections if other != profile]
                checker.reporter.unused((*root, "sections", profile), "section", others)
        for drive, series in self.actuators.items():
            path = (*root, "actuators", drive)
            if not series:
                checker.report(path, "expected a stiffness, or a list of those in series, [1e6, 2e6]")
            if checker.check_name(drive, checker.mechanism.driven_kinds, "drive", path, at_key=True):
                checker.kind(path, _STIFFNESS_KINDS[checker.mechanism.driven_kinds[drive]])
        slides = [*checker.mechanism.slides, *checker.mechanism.legs]
        clamped = [set(other.fixed) for other in checker.mechanism.joints.values() if other.fixed is not None]
        pins = [p for p, owners in checker.mechanism.owners.items() if len(owners) > 1 and set(owners) not in clamped]
        for joint, bearing in self.bearings.items():
            path = (*root, "bearings", joint)
            if not checker.check_name(joint, [*pins, *slides], "pin or slide", path, at_key=True):
                continue
            if bearing.radial is not None:
                checker.kind((*path, "radial"), "stiffness")
            if bearing.moment is not None:
                checker.kind((*path, "moment"), "rotational_stiffness")
                if joint not in slides:
                    checker.report((*path, "moment"), f"pin {joint!r} turns freely: it bears no moment")
        self._check_couplings(checker)
        check_loads(checker, self.loads, (*root, "loads"), moving=False, timed=False)
        if self.dynamics:
            self._check_dynamics(checker)
        return super().checked(checker)

    def _check_couplings(self, checker: Checker) -> None:
        """Check names and units of stiffnesses of couplings, and that those along wheels have wheels."""
        couplings, compiled = checker.mechanism.couplings, checker.compiled
        for name, given in self.couplings.items():
            path: KeyPath = ("stiffness", "couplings", name)
            if not checker.check_name(name, couplings, "coupling", path, at_key=True):
                continue
            sets = checker.mechanism.coordinate_named(couplings[name].set_)
            angle = checker.mechanism.coordinates.get(sets) == "angle"
            if given.force is not None:
                checker.kind((*path, "force"), "stiffness")
                touches = compiled is None or any(pair.coupling == name for pair in compiled.engaged)
                if angle and not touches:
                    message = (
                        "it has no cam, no pitch circles, and a belt no radius: give {moment: stiffness per radian}"
                    )
                    checker.report(path, message)
            if given.moment is not None:
                checker.kind((*path, "moment"), "rotational_stiffness")
                if not angle:
                    checker.report((*path, "moment"), f"no angle follows, but {sets}: give a force per displacement")

    def _check_dynamics(self, checker: Checker) -> None:
        """Check that there is a section of that name, and that its rates are known at the poses."""
        own = checker.parts.get("dynamics")
        checker.needs("dynamics", "'dynamics: true'", ("stiffness", "dynamics"))
        pace = own if own is not None and own.moves else checker.parts.get("kinematics")
        constant = pace is None or (pace.motion is None and not pace.inverse(checker.mechanism.drives))
        if self.source is not None and not constant:
            message = "the rates of dynamics are known at its own poses alone: leave out those of stiffness"
            checker.report(("stiffness", "dynamics"), message)
