"""The dynamics section of the study file."""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar, Self

from pydantic import Field

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.statics import Joints
from mechdesign.questions.dynamics.forward_schema import ForwardSection
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.loads import Load, check_loads
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields

HELP_PAGE = "theory/dynamics"


class Flywheel(fields.Model):
    """A flywheel on the one drive, an angle that turns at a constant speed through a cycle."""

    fluctuation: fields.Positive
    """Coefficient of fluctuation that is asked: largest less smallest speed, over the mean. Example: 0.05"""


class DynamicsSection(MotionSection):
    """The motion whose drive efforts and joint forces are asked, and what acts on the mechanism."""

    command: ClassVar[str] = "dynamics"
    gravity: Annotated[tuple[fields.Acceleration, fields.Acceleration], fields.pair_of("[gx, gy]")] = (0.0, 0.0)
    """Acceleration of free fall along the world's axes. Left out: none. Example: [0, -9.81 m/s^2]"""
    loads: tuple[Load, ...] = Field(default_factory=tuple)
    """Forces and moments that act on the mechanism beside weights, inertia and springs. Example: [{at: T, force: [0,
    -20]}, {link: rocker, moment: "-0.1*rocker.angle_velocity"}]
    """
    forward: ForwardSection | None = None
    """The motion that given efforts of the drives bring about, in place of poses and rates. Example: {duration: 2 s,
    start: {theta: 0}, efforts: {theta: "5 - 0.1*theta_velocity"}}
    """
    flywheel: Flywheel | None = None
    """The flywheel that evens out the speed of the drive over the poses, a cycle at constant speed. Example:
    {fluctuation: 0.05}
    """
    modes: bool = False
    """Whether natural frequencies of small motion about each pose are asked, of springs and gravity. Example: true"""

    def checked(self, checker: Checker) -> Self:
        """Also check the loads."""
        if self.flywheel is not None and [*checker.mechanism.driven_kinds.values()] != ["angle"]:
            message = "a flywheel sits on the one drive of a mechanism, an angle; this one has others"
            checker.report((self.command, "flywheel"), message, at_key=True)
        for key in ("flywheel", "modes") if self.forward is not None else ():
            if getattr(self, key):
                message = (
                    f"'forward' and {key!r} are both given; {key} are those of poses: ask for them in another study"
                )
                checker.report((self.command, key), message, at_key=True)
        section = self if self.moves else checker.parts.get("kinematics") or self
        timed, moving = section.motion is not None, section.rated
        if self.forward is not None:
            timed = moving = True
            self.forward.checked(checker, (self.command, "forward"))
            for key in filter(partial(getattr, self), (*self.sources, "rates", "accelerations", "speed")):
                message = (
                    f"'forward' and {key!r} are both given; what efforts bring about has poses and rates of its own"
                )
                checker.report((self.command, key), message, at_key=True)
        check_loads(checker, self.loads, (self.command, "loads"), moving=moving, timed=timed)
        return super().checked(checker)

    def joints(self, mechanism: Mechanism) -> Joints:
        """The joints of a mechanism, where loads and springs act on some pins."""
        springs = [spring for spring in mechanism.description.springs.values() if not spring.turning]
        points = [load.at for load in self.loads if load.at is not None]
        points += [point for load in self.loads for point in load.between or ()]
        points += [point for spring in springs for point in spring.between]
        graph = mechanism.graph
        loaded = frozenset(graph.node(point) for point in points if "." not in point and graph.is_point(point))
        return Joints(mechanism.description, graph, loaded, mechanism.pressing)

    @property
    def moves(self) -> bool:
        """Whether it gives poses or rates of its own; else those of kinematics count."""
        return self.source is not None or self.rated


def column_kinds(mechanism: Mechanism, joints: Joints, *, moving: bool) -> dict[str, str]:
    """Kind of quantity of each number of a pose: efforts, shaking forces, energies, and the size of joint forces."""
    kinds: dict[str, str] = {}
    for drive in mechanism.drives:
        kinds[f"{drive}_effort"] = "moment" if mechanism.quantity(drive) == "angle" else "force"
        kinds |= {f"{drive}_power": "power"} if moving else {}
    kinds |= {"shaking.x": "force", "shaking.y": "force", "shaking": "force", "shaking_moment": "moment"}
    kinds |= {"kinetic_energy": "moment"} if moving else {}
    return kinds | {"potential_energy": "moment"} | dict.fromkeys(joints.names, "force")
