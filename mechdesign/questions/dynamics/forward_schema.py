"""Motion in time under given efforts, as the dynamics section of the study file gives it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from mechdesign.expressions import Expression
from mechdesign.study.schema.checker import ORDERS, Checker
from mechdesign.study.schema.loads import VELOCITY, Quantity, check_name, read_quantity
from mechdesign.study.schema.motions import Time
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import failure
from mechdesign.study.text.units import Amount

HELP_PAGE = "howto/motion_in_time"

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

    @model_validator(mode="after")
    def _bounces(self) -> ForwardSection:
        if self.restitution is not None and self.restitution > 1:
            raise failure(f"a restitution is at most 1, where nothing is lost, not {self.restitution:g}")
        return self

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
