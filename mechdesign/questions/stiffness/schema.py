"""The stiffness section of the study file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from mechdesign.expressions import Number
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Quantity
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import Context, failure, read_number
from mechdesign.study.text.units import Amount

HELP_PAGE = "theory/stiffness"

# Keys of each form of cross-section.
_FORMS = (("width", "height"), ("diameter",), ("diameter", "inner_diameter"), ("area", "inertia"))
_STIFFNESS_KINDS: dict[Quantity, str] = {"length": "stiffness", "angle": "rotational_stiffness"}


class Profile(fields.Model):
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

    @model_validator(mode="after")
    def _one_form(self) -> Profile:
        if tuple(self.given(*dict.fromkeys(key for form in _FORMS for key in form))) not in _FORMS:
            raise failure(
                "a section is {E, width, height}, {E, diameter}, {E, diameter, inner_diameter} or {E, area, inertia}"
            )
        if self.shear and self.G is None:
            raise failure("'shear: true' needs the shear modulus 'G'")
        if self.shear_factor is not None and not self.shear:
            raise failure("a 'shear_factor' counts with 'shear: true' only")
        return self

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

    @model_validator(mode="after")
    def _some(self) -> Bearing:
        if not self.given("radial", "moment"):
            raise failure("a bearing has a 'radial' stiffness, and that of a slide a 'moment' stiffness too")
        return self


def _series(raw: Any, context: Context) -> float:
    """A stiffness, or of a list the stiffness of its parts in series, such as motor, gear and belt."""
    parts = {f"k{number}": read_number(each, context) for number, each in enumerate(fields.as_list(raw))}
    if not parts:
        raise failure("expected a stiffness, or a list of those in series, [1e6, 2e6]")
    for part in parts.values():
        if part <= 0:
            raise failure(f"must be positive, not {part:g}")
    return Amount.by(f"1/({' + '.join(f'1/{name}' for name in parts)})", **parts)


_SERIES = {"anyOf": [fields.NUMBER_FORM, {"type": "array", "items": fields.NUMBER_FORM, "minItems": 1}]}


_LOADS: fields.Form = {"type": "array", "items": {"type": "object", "title": "load"}}


def _numbers(load: dict[str, Any], section: dict[str, Any]) -> list[Any]:
    """A load by the names of its point and link as [fx, fy, mz]."""
    force, moment = load.get("force"), load.get("moment")
    if not load.keys() <= {"at", "force", "link", "moment"} or (force is None and moment is None):
        raise failure("a load is [fx, fy, mz], {at: point, force: [fx, fy]} or {link: name, moment: mz}")
    for key, place in (("at", force), ("link", moment)):
        if (place is None) != (load.get(key) is None) or (place is not None and load[key] != section.get(key)):
            what = f"its point, at: {section.get('at')}" if key == "at" else f"its link, link: {section.get('link')}"
            raise failure(f"a force or moment of stiffness acts on {what}; for loads elsewhere ask dynamics")
    if force is not None and (not isinstance(force, list) or len(force) != 2):
        raise failure(f"a force is [fx, fy], not {fields.shown(force)}")
    return [*(force or [0.0, 0.0]), 0.0 if moment is None else moment][: 3 if section.get("link") else 2]


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
    sections: dict[str, Profile] = Field(default_factory=dict)
    """Cross-sections by name, for ``elastic``. Example: {beam: {E: 200 GPa, width: 20 mm, height: 40 mm}}"""
    elastic: dict[fields.LinkName, str] = Field(default_factory=dict)
    """Section of each link that bends; other links are rigid. A link is a beam from ``from`` to ``to``, its other
    points brackets, rigid from their foot on it; a link of points alone is beams along them as listed; a telescopic one
    a cantilever from ``from``. Example: {leg_1: beam, leg_2: beam}
    """
    actuators: dict[fields.DriveName, Annotated[float, fields.Read(_series, _SERIES)]] = Field(default_factory=dict)
    """Stiffness of each drive that gives, or a list of those in series; other drives are rigid. A bare one of an angle
    is moment per radian. Example: {l1: 5e7, theta1: 1e5 N*m/rad} Example: {theta: [3e4 N*m/rad, 1.5e4 N*m/rad]}
    """
    bearings: dict[fields.BearingName, Bearing] = Field(default_factory=dict)
    """Stiffness of pins (by their point) and slides (by their joint or telescopic link); others are rigid. Every link
    at a pin that gives has an end of it, rod.B. Example: {B: 1e5 N/mm, guide: {radial: 2e5 N/mm, moment: 1e6 N*m/rad}}
    """
    direction: fields.Angle | None = None
    """Angle from the world's x axis of the direction whose stiffness is k_direction. Left out: that column is not
    there. Example: 90
    """
    loads: Annotated[tuple[tuple[fields.Number, ...], ...], fields.OrShort(_LOADS)] = ()
    """Loads on the point, each a case of its own, [fx, fy, mz]; their deflections are reported. Without ``link`` [fx,
    fy] is enough; {at: P, force: [fx, fy]} and {link: platform, moment: mz} are the same. Example: [[100, 0, 0], [0,
    100, 0]] Example: [{at: P, force: [100, 0]}]
    """
    characteristic_length: fields.PositiveLength | None = None
    """Length as which a radian counts; then the eigen-stiffnesses of ``link`` are reported. Example: 0.1"""

    @model_validator(mode="before")
    @classmethod
    def _loads_in_numbers(cls, raw: Any) -> Any:
        if not isinstance(raw, dict) or not isinstance(raw.get("loads"), list):
            return raw
        return {**raw, "loads": [_numbers(load, raw) if isinstance(load, dict) else load for load in raw["loads"]]}

    @property
    def point(self) -> str:
        """The point without its link."""
        return self.at.rpartition(".")[2]

    @property
    def bearer(self) -> str | None:
        """The link of the point; None for a pin."""
        return self.link or self.at.rpartition(".")[0] or None

    def checked(self, checker: Checker) -> Self:
        """Also check names and the units of stiffnesses; loads get three numbers."""
        root: KeyPath = ("stiffness",)
        if checker.mechanism.couplings:
            named = ", ".join(checker.mechanism.couplings)
            message = f"a stiffness of a mechanism with couplings ({named}) is not available; leave out 'stiffness'"
            checker.report(root, message, at_key=True)
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
        for drive in self.actuators:
            path = (*root, "actuators", drive)
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
        loads = [
            checker.load(load, (*root, "loads", index), on_pin=self.link is None)
            for index, load in enumerate(self.loads)
        ]
        return super().checked(checker).model_copy(update={"loads": tuple(loads)})
