"""The kinematics section of the study file."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields
from mechdesign.study.text.fields import failure


class Load(fields.Model):
    """A force at a point, or a moment on a link."""

    at: fields.PointName | None = None
    force: tuple[fields.Force, fields.Force] | None = None
    link: fields.LinkName | None = None
    moment: fields.Moment | None = None

    @model_validator(mode="after")
    def _whole(self) -> Load:
        if (self.at is None) != (self.force is None) or (self.moment is not None and self.link is None):
            raise failure("a load is {at: point, force: [fx, fy]} or {link: name, moment: m}")
        if self.force is None and self.moment is None:
            raise failure("a load needs a force or a moment")
        return self


class KinematicsSection(MotionSection):
    """How does it move?"""

    command: ClassVar[str] = "kinematics"
    loads: tuple[Load, ...] = ()
    characteristic_length: fields.PositiveLength | None = None

    def checked(self, checker: Checker) -> Self:
        """Check the outputs as well, and what loads act on."""
        checker.outputs(self.outputs, ("kinematics", "outputs"))
        for index, load in enumerate(self.loads):
            if load.at is not None:
                checker.known(load.at, checker.mechanism.owners, "point", ("kinematics", "loads", index, "at"))
            if load.link is not None:
                checker.known(
                    load.link, checker.mechanism.moving, "moving link", ("kinematics", "loads", index, "link")
                )
        return super().checked(checker)
