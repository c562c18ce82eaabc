"""The stiffness section of the study file."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Quantity
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import Context, failure, read_number

_ELASTIC = (
    "The section of each link that bends; links not named are rigid. A link given by its ends is a beam from the first "
    "to the second, and its other points are brackets: rigid from their foot on the beam, beyond an end from that end. "
    "A link given by its points alone is beams along them in the order listed. A slide on a link rides on its beams at "
    "the foot of its current place. A telescopic leg is a cantilever of its current length from its first end."
)
# Keys of each kind of section.
_FORMS = (("width", "height"), ("diameter",), ("diameter", "inner_diameter"), ("area", "inertia"))
_STIFFNESS_KINDS: dict[Quantity, str] = {"length": "stiffness", "angle": "rotational_stiffness"}


class Profile(fields.Model):
    """A cross-section: a rectangle (its height lies in the plane), a bar or a tube, or its area and inertia.

    ``shear: true`` adds the compliance of shear by Timoshenko's theory, with the factor of the section's form (Cowper
    1966, with Poisson's ratio 0: 5/6 of a rectangle, 6/7 of a round bar, 1/2 of a thin tube), or a given one.
    """

    E: fields.PositiveStress
    G: fields.PositiveStress | None = None
    width: fields.PositiveLength | None = None
    height: fields.PositiveLength | None = None
    diameter: fields.PositiveLength | None = None
    inner_diameter: fields.PositiveLength | None = None
    area: fields.PositiveArea | None = None
    inertia: fields.PositiveInertia | None = None
    shear: bool = False
    shear_factor: fields.Positive | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Profile:
        if tuple(self.given(*dict.fromkeys(key for form in _FORMS for key in form))) not in _FORMS:
            raise failure(
                "a section is {E, width, height}, {E, diameter}, {E, diameter, inner_diameter} or {E, area, inertia}"
            )
        if self.inner_diameter is not None and self.diameter is not None and self.inner_diameter >= self.diameter:
            raise failure(f"the inner diameter {self.inner_diameter:g} is not below the outer one {self.diameter:g}")
        if self.shear and self.G is None:
            raise failure("'shear: true' needs the shear modulus 'G'")
        if self.shear_factor is not None and not self.shear:
            raise failure("a 'shear_factor' counts with 'shear: true' only")
        return self

    @property
    def extent(self) -> tuple[float, float, float]:
        """Area, second moment of area for bending in the plane, and shear factor."""
        if self.width is not None and self.height is not None:
            area, inertia, factor = self.width * self.height, self.width * self.height**3 / 12, 5 / 6
        elif self.diameter is not None:
            m = (self.inner_diameter or 0.0) / self.diameter
            area = math.pi / 4 * self.diameter**2 * (1 - m * m)
            inertia = math.pi / 64 * self.diameter**4 * (1 - m**4)
            factor = 6 * (1 + m * m) ** 2 / (7 * (1 + m * m) ** 2 + 20 * m * m)
        else:
            area, inertia, factor = self.area or 0.0, self.inertia or 0.0, 5 / 6
        return area, inertia, self.shear_factor or factor


class Bearing(fields.Model):
    """Stiffness of a joint itself: across, and of a slide also against turning; what is not given is rigid."""

    bare, short = "radial", (fields.NUMBER_FORM,)
    radial: fields.PositiveNumber | None = None
    moment: fields.PositiveNumber | None = None

    @model_validator(mode="after")
    def _some(self) -> Bearing:
        if not self.given("radial", "moment"):
            raise failure("a bearing has a 'radial' stiffness, and that of a slide a 'moment' stiffness too")
        return self


def _series(raw: Any, context: Context) -> float:
    """A stiffness, or of a list the stiffness of its parts in series, such as motor, gear and belt."""
    parts = [read_number(each, context).nominal for each in fields.as_list(raw)]
    if not parts:
        raise failure("expected a stiffness, or a list of those in series")
    for part in parts:
        if part <= 0:
            raise failure(f"must be positive, not {part:g}")
    return 1.0 / sum(1.0 / part for part in parts)


_SERIES = {
    "anyOf": [fields.NUMBER_FORM, {"type": "array", "items": fields.NUMBER_FORM, "minItems": 1}],
    "description": "a stiffness, or those of what is in series",
}


class StiffnessSection(PoseSection):
    """How stiff is it?"""

    command: ClassVar[str] = "stiffness"
    link: fields.LinkName | None = None
    at: fields.PointName = Field(description="the point whose stiffness is asked")
    sections: dict[str, Profile] = Field(default_factory=dict)
    elastic: dict[fields.LinkName, str] = Field(default_factory=dict, description=_ELASTIC)
    actuators: dict[fields.AnyName, Annotated[float, fields.Read(_series, _SERIES)]] = Field(default_factory=dict)
    bearings: dict[fields.AnyName, Bearing] = Field(default_factory=dict)
    direction: fields.Angle | None = None
    loads: tuple[tuple[fields.Number, ...], ...] = ()
    characteristic_length: fields.PositiveLength | None = None

    def checked(self, checker: Checker) -> Self:
        """Check what is named as well, and the units of stiffnesses; loads get three numbers."""
        root: KeyPath = ("stiffness",)
        right = checker.known(self.at, checker.mechanism.owners, "point", (*root, "at"))
        if right and self.link is None and GROUND in checker.mechanism.owners[self.at]:
            checker.report((*root, "at"), f"point {self.at!r} belongs to the ground and does not move")
        if self.link is not None and checker.known(self.link, checker.mechanism.moving, "moving link", (*root, "link")):
            points = checker.mechanism.points_of(self.link)
            if right and self.at not in points:
                message = f"link {self.link!r} has no point {self.at!r}; it has {', '.join(points)}"
                checker.report((*root, "at"), message)
        for link, profile in self.elastic.items():
            path: KeyPath = (*root, "elastic", link)
            checker.known(link, checker.mechanism.moving, "moving link", path, at_key=True)
            checker.known(profile, self.sections, "section", path)
        for profile in self.sections:
            if profile not in self.elastic.values():
                others = [other for other in self.sections if other != profile]
                checker.reporter.unused((*root, "sections", profile), "section", others)
        for drive in self.actuators:
            path = (*root, "actuators", drive)
            if checker.known(drive, checker.mechanism.driven_kinds, "drive", path, at_key=True):
                checker.kind(path, _STIFFNESS_KINDS[checker.mechanism.driven_kinds[drive]])
        slides = [*checker.mechanism.slides, *checker.mechanism.legs]
        clamped = [set(other.fixed) for other in checker.mechanism.joints.values() if other.fixed is not None]
        pins = [p for p, owners in checker.mechanism.owners.items() if len(owners) > 1 and set(owners) not in clamped]
        for joint, bearing in self.bearings.items():
            path = (*root, "bearings", joint)
            if not checker.known(joint, [*pins, *slides], "pin or slide", path, at_key=True):
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
