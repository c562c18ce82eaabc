"""The questions of the study file as pydantic models; attributes bear the names of the study format.

Numbers are floats in the study's units. Keys named ``from`` are the attribute ``from_``.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from mechdesign.study.build.section import MechanismSection, Model, UnitsSection
from mechdesign.study.schema.lists import CoordinateNames
from mechdesign.study.schema.optimize import Condition, OptimizeSection
from mechdesign.study.schema.paths import Speed
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.stiffness import StiffnessSection
from mechdesign.study.schema.workspace import WorkspaceSection
from mechdesign.study.text.numbers import (
    CoordinateName,
    Force,
    LinkName,
    Moment,
    Number,
    PointName,
    PositiveLength,
    Whole,
    failure,
)


class Load(Model):
    """A force at a point, or a moment on a link."""

    at: PointName | None = None
    force: tuple[Force, Force] | None = None
    link: LinkName | None = None
    moment: Moment | None = None

    @model_validator(mode="after")
    def _whole(self) -> Load:
        if (self.at is None) != (self.force is None) or (self.moment is not None and self.link is None):
            raise failure("a load is {at: point, force: [fx, fy]} or {link: name, moment: m}")
        if self.force is None and self.moment is None:
            raise failure("a load needs a force or a moment")
        return self


class KinematicsSection(PoseSection):
    """How does it move?"""

    rates: dict[CoordinateName, Number] = Field(default_factory=dict)
    accelerations: dict[CoordinateName, Number] = Field(default_factory=dict)
    speed: Speed | None = None
    outputs: CoordinateNames | None = None
    loads: tuple[Load, ...] = ()
    characteristic_length: PositiveLength | None = None


class Requirement(Condition):
    """A gate: the worst row of a result against its bounds."""


class StudyFile(Model):
    """The whole study file."""

    name: str | None = None
    units: UnitsSection = UnitsSection()
    seed: Annotated[int, Whole(0)] = 0
    mechanism: MechanismSection
    kinematics: KinematicsSection | None = None
    workspace: WorkspaceSection | None = None
    optimize: OptimizeSection | None = None
    reliability: ReliabilitySection | None = None
    stiffness: StiffnessSection | None = None
    requirements: tuple[Requirement, ...] = ()
