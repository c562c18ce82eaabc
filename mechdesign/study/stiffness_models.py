"""The stiffness section of the study file."""

from __future__ import annotations

from pydantic import Field, model_validator

from mechdesign.study.models import Model
from mechdesign.study.numbers import (
    AnyName,
    LinkName,
    Number,
    PointName,
    PositiveArea,
    PositiveInertia,
    PositiveLength,
    PositiveNumber,
    PositiveStress,
    failure,
)
from mechdesign.study.pose_models import PoseSection


class Profile(Model):
    """A cross-section: width and height (in the plane), or area and inertia."""

    E: PositiveStress
    G: PositiveStress | None = None
    width: PositiveLength | None = None
    height: PositiveLength | None = None
    area: PositiveArea | None = None
    inertia: PositiveInertia | None = None
    shear: bool = False

    @model_validator(mode="after")
    def _one_form(self) -> Profile:
        rectangle = self.width is not None and self.height is not None
        general = self.area is not None and self.inertia is not None
        given = sum(getattr(self, key) is not None for key in ("width", "height", "area", "inertia"))
        if rectangle == general or given != 2:
            raise failure("a section is {E, width, height} or {E, area, inertia}")
        if self.shear and self.G is None:
            raise failure("'shear: true' needs the shear modulus 'G'")
        return self


class StiffnessSection(PoseSection):
    """How stiff is it?"""

    link: LinkName | None = None
    at: PointName
    sections: dict[str, Profile] = Field(default_factory=dict)
    elastic: dict[LinkName, str] = Field(default_factory=dict)
    actuators: dict[AnyName, PositiveNumber] = Field(default_factory=dict)
    loads: tuple[tuple[Number, ...], ...] = ()
    characteristic_length: PositiveLength | None = None
