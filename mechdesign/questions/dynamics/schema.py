"""The dynamics section of the study file."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Self

from pydantic import Field

from mechdesign.ground.expressions import Expression
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.study.schema.checker import ORDERS, Checker
from mechdesign.study.schema.loads import (
    EFFICIENCIES,
    VELOCITY,
    Load,
    Quantity,
    check_friction,
    check_loads,
    check_name,
    joints_of,
    read_quantity,
)
from mechdesign.study.schema.motions import Time
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import Amount

ROWS = 201  # of the table, where none are asked for
MAX_ROWS = 100_000
# What the study names when it says nothing of the efforts of its drives.
NOTHING = Amount(0.0)


class Crossing(fields.Model):
    """A coordinate and the value through which it passes."""

    of: fields.CoordinateName
    """Coordinate or measure. Example: C.x"""
    value: fields.Number
    """Value through which it passes, in the coordinate's unit. Example: 30"""


class ForwardSection(fields.Model):
    """The motion of the mechanism under given efforts, from a start."""

    duration: Time
    """How long the motion lasts, unless a limit of motion ends it. Example: 2 s"""
    start: dict[fields.CoordinateName, fields.Number] = Field(default_factory=dict)
    """Values of the drives at the start, and their velocities (``theta_velocity``). Left out: as drawn, at rest.
    Example: {theta: 30, theta_velocity: 10 rad/s}
    """
    efforts: dict[fields.DriveName, Annotated[Quantity, fields.Read(read_quantity, fields.NUMBER_FORM)]] = Field(
        default_factory=dict
    )
    """Torques or forces of the drives, as numbers or as expressions of coordinates, their velocities and ``time``, in
    the study's units. Left out: 0, the drive runs free. Example: {theta: "5 - 0.1*theta_velocity"}
    """
    restitution: Annotated[float, fields.number("none", 0.0)] | None = None
    """Velocity with which limits of motion are left over that with which they are reached, from 0 to 1. Left out: the
    motion ends at a limit. Example: 0.5
    """
    events: dict[fields.CoordinateName, Crossing] = Field(default_factory=dict)
    """Crossings whose times are asked, by a name of yours. Example: {passes: {of: C.x, value: 30}}"""
    rows: Annotated[int, fields.whole(2, MAX_ROWS)] = ROWS
    """Number of instants in the tables, evenly spread over the duration. Left out: |ROWS|. Example: 1001"""

    def faults(self) -> Iterator[str]:
        if self.restitution is not None and self.restitution > 1:
            yield f"a restitution is at most 1, where nothing is lost, not {self.restitution:g}"

    def checked(self, checker: Checker, path: KeyPath) -> None:
        """Check names and units of drives, velocities and events."""
        drives = checker.mechanism.driven_kinds
        names = [*drives, *(f"{drive}{VELOCITY}" for drive in drives)]
        for name in self.start:
            if checker.check_name(name, names, "drive or velocity of a drive", (*path, "start", name), at_key=True):
                order = int(name not in drives)
                quantity = drives[name.removesuffix(VELOCITY) if order else name]
                checker.kind((*path, "start", name), ORDERS[quantity][order])
        for name, effort in self.efforts.items():
            place = (*path, "efforts", name)
            if not checker.check_name(name, drives, "drive", place, at_key=True):
                continue
            if not isinstance(effort, Expression):
                checker.kind(place, "moment" if drives[name] == "angle" else "force")
                continue
            for used in sorted(effort.names - checker.parameters.nominal.keys()):
                check_name(checker, used, place, moving=True, timed=True)
        for name, crossing in self.events.items():
            checker.coordinate(crossing.of, (*path, "events", name, "of"))
            kind = checker.mechanism.coordinates.get(crossing.of)
            if kind in ORDERS:
                checker.kind((*path, "events", name, "value"), ORDERS[kind][0])


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
    """The flywheel that evens out the speed of the drive, which the poses sweep over a cycle at a constant speed.
    Example: {fluctuation: 0.05}
    """
    modes: bool = False
    """Whether natural frequencies of small motion about each pose are asked, of springs and gravity. Example: true"""

    def checked(self, checker: Checker) -> Self:
        """Also check the loads."""
        if self.flywheel is not None and [*checker.mechanism.driven_kinds.values()] != ["angle"]:
            message = "a flywheel sits on the one drive of a mechanism, an angle; this one has others"
            checker.report((self.command, "flywheel"), message, at_key=True)
        for key, use in (
            ("flywheel", "a flywheel is sized for a cycle of poses; ask for it in another study"),
            ("modes", "natural frequencies are those of poses; ask for them in another study"),
        ):
            if self.forward is not None and getattr(self, key):
                checker.report((self.command, key), f"'forward' and {key!r} are both given; {use}", at_key=True)
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
