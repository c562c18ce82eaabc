"""The dynamics section of the study file."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import Field

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.statics import Joints
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.loads import Load, check_friction, check_loads, joints_of
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields

HELP_PAGE = "theory/dynamics"
# Columns of a mechanism with friction, without units.
EFFICIENCIES = ("efficiency", "back_efficiency")


class DynamicsSection(MotionSection):
    """The motion whose drive efforts and joint forces are asked, and what acts on the mechanism."""

    command: ClassVar[str] = "dynamics"
    gravity: Annotated[tuple[fields.Acceleration, fields.Acceleration], fields.pair_of("[gx, gy]")] = (0.0, 0.0)
    """Acceleration of free fall along the world's axes. Left out: none. Example: [0, -9.81 m/s^2]"""
    loads: tuple[Load, ...] = Field(default_factory=tuple)
    """Forces and moments that act on the mechanism beside weights, inertia and springs. Example: [{at: T, force: [0,
    -20]}, {link: rocker, moment: "-0.1*rocker.angle_velocity"}]
    """

    def checked(self, checker: Checker) -> Self:
        """Also check the loads."""
        section = self if self.moves else checker.parts.get("kinematics") or self
        timed = section.motion is not None
        check_loads(checker, self.loads, (self.command, "loads"), moving=section.rated, timed=timed)
        check_friction(checker)
        return super().checked(checker)

    def joints(self, mechanism: Mechanism) -> Joints:
        """The joints of a mechanism, where loads and springs act on some pins."""
        return joints_of(mechanism, self.loads, mechanism.description.springs.values())

    @property
    def moves(self) -> bool:
        """Whether it gives poses or rates of its own; else those of kinematics count."""
        return self.source is not None or self.rated


def column_kinds(mechanism: Mechanism, joints: Joints, *, moving: bool) -> dict[str, str]:
    """Kind of quantity of each number of a pose: efforts, shaking forces, energies, sizes of joint forces."""
    kinds: dict[str, str] = {}
    for drive in mechanism.drives:
        kinds[f"{drive}_effort"] = "moment" if mechanism.quantity(drive) == "angle" else "force"
        kinds |= {f"{drive}_power": "power"} if moving else {}
    kinds |= {"shaking.x": "force", "shaking.y": "force", "shaking": "force", "shaking_moment": "moment"}
    kinds |= {"kinetic_energy": "moment"} if moving else {}
    kinds |= {"potential_energy": "moment"}
    if mechanism.description.friction:
        kinds |= {"friction_power": "power"} if moving else {}
        kinds |= dict.fromkeys(EFFICIENCIES, "none")
    return kinds | dict.fromkeys(joints.names, "force")
