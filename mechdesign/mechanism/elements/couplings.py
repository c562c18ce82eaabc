"""Couplings: coordinates that follow others by wheels, cams or controllers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any

from mechdesign.ground.expressions import Expression
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element
from mechdesign.mechanism.elements.joints import LinkLine, Points
from mechdesign.mechanism.elements.segments import LawSegment, segments_faults

# Prefix of places that are not dimensions of a part: parameters that measures use, and the play of couplings. No name
# in a study has a colon.
MEASURED = "measures:"

# Of teeth as ISO 53 has them (radians).
PRESSURE_ANGLE = math.radians(20.0)
_WHEELS = {
    "gears": "wheels with teeth, whose force acts where the pitch circles touch; or a pinion and its rack",
    "belt": "pulleys with a belt or chain, or with crossed ones for a negative ratio",
    "none": "a controller or what is not drawn: moments alone act on the links",
}
_SIDES = {
    "outer": "its follower runs around the outside of the cam",
    "inner": "its follower runs inside of the cam, a ring",
    "groove": "its roller runs in a groove, which has both sides and holds it",
}
# Fewest and most steps of a cam's profile.
STEPS = 8, 100_000


def play(coupling: str) -> str:
    """Name of the place by which the coordinate that follows deviates from a coupling's function; nominally 0."""
    return f"{MEASURED}{coupling}.play"


@dataclass(frozen=True)
class Cam(Element):
    """A cam, and how its follower touches it: ``roller`` or ``flat``."""

    one_of = ("the follower of a cam has one of roller: point, flat: point", "roller", "flat")

    link: declared.LinkName
    """Link that is the cam; the ground may be one. Example: cam"""
    roller: declared.PointName | None = None
    """Point of the follower that is the centre of its roller. Example: F"""
    radius: declared.NonNegativeLength | None = None
    """Radius of the roller; 0 is a knife edge. Example: 8 mm"""
    flat: Points | None = None
    """Point of the follower on its flat face; two points [P, R] give the face's direction as well. Example: F"""
    direction: declared.Angle | None = None
    """Angle of the flat face from the follower's x axis. Left out: 0, unless ``flat`` has two points. Example: 90"""
    side: Annotated[str, declared.Choice(_SIDES, "side of a cam")] = "outer"
    """Side of the profile on which the follower runs; the origin of the cam's frame is inside."""
    # Radians, or the study's unit.
    range: Annotated[tuple[float, float], declared.Notation("range")] = (0.0, TURN)
    """First and last value of the coordinate that is followed, of the profile. Left out: the range of the ``table``, of
    an angle a turn from 0. Example: [0, 120]
    """
    steps: Annotated[int, declared.Whole(*STEPS)] = 360
    """Steps of the profile in cam.csv, equal in the coordinate that is followed. Example: 720"""
    step: Annotated[float, declared.Size(None, 0.0, exclusive=True, fixed=True)] | None = None
    """Step of the profile in cam.csv, in place of ``steps``; smaller where it does not divide the range. Example: 0.5
    """
    face: LinkLine = field(kw_only=True)  # of the follower; of a roller only the point counts

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if given.roller is not None and given.radius is None:
            yield "a roller has a 'radius', 0 of a knife edge"
        for foreign in given.given("direction" if given.roller is not None else "radius"):
            yield f"a {given.kind} follower has no {foreign!r}"
        if given.flat is not None and given.side == "groove":
            yield "a flat face runs in no groove; give a 'roller'"
        if given.flat is not None and len(given.flat) == 2 and given.direction is not None:
            yield "'flat' with two points gives the direction; leave 'direction' out"
        if given.range is not None and not given.range[0] < given.range[1]:
            yield "a range rises from its first value to its last"
        if given.step is not None and "steps" in given.model_fields_set:
            yield "'steps' is how many there are, 'step' how long each is: give one"


@dataclass(frozen=True)
class Coupling(Element):
    """A coordinate that follows others, by gears, a rack, a belt, a cam or a controller: ``set`` and one of ``to``,
    ``ratio``, ``table`` and ``law``.
    """

    one_of = (
        "a coupling gives what it sets by one of to: expression, ratio: number, table: file, law: [segments]",
        "to", "ratio", "table", "law",
    )  # fmt: skip

    set_: declared.CoordinateName
    """Coordinate that follows: an angle of a link, a slide or a length; the name of a link, joint or leg stands for it.
    Example: planet.angle
    """
    # From coordinates and parameters in the study's units, whichever key gives it. A name in it is a parameter as in a
    # `Measure`, or a place of the coupling's own.
    to: Annotated[Expression, declared.Notation("Bound")] | None = None
    """Expression of coordinates and parameters, in the study's units; the name of a link, joint or leg stands for its
    coordinate. Example: -2.5*sun + 3.5*arm
    """
    of: declared.CoordinateName | None = None
    """Coordinate that is followed, of a ``ratio``, a ``table`` or a ``law``. Example: sun.angle"""
    ratio: declared.AnySize | None = None
    """What the coordinate that follows changes by for each unit of the other, in the study's units. Example: -2.5"""
    phase: declared.AnySize | None = None
    """Value of the coordinate that follows where the other is 0, with a ``ratio``. Left out: as the sketch shows.
    Example: 30
    """
    table: Annotated[Any, declared.Notation("table")] | None = None
    """Rows of the coordinate that is followed and the one that follows, or a file of two such columns; between them a
    cubic spline. It repeats if it spans a turn and ends as it begins. Example: lift.csv
    """
    law: tuple[Annotated[LawSegment, declared.Notation("part")], ...] | None = None
    """Moves and dwells one after another, from the value 0 of the coordinate that is followed on, again and again over
    their sum. With a ``from`` that is not where they end they are passed once, and what follows stands before and
    behind them. Example: [{to: 30, over: 120, law: cycloidal}, {dwell: 60}, {to: 0, over: 120}, {dwell: 60}]
    """

    wheels: Annotated[str, declared.Choice(_WHEELS, "kind of wheels")] = "gears"
    """What makes the ratio of two angles, or of a slide to an angle, where both turn about pins of one link."""
    radius: Annotated[float, declared.Size("length", 0.0, exclusive=True, fixed=True)] = 0.0
    """Radius of the pulley that follows, of a belt. Left out: moments alone act on the links. Example: 12"""
    module: declared.PositiveLength | None = None
    """Module of the teeth of gears, pitch diameter over number of teeth, for drawings. Left out: not known. Example: 2
    mm
    """
    pressure_angle: Annotated[float, declared.Size("angle", fixed=True)] = PRESSURE_ANGLE
    """Angle of the force between teeth from the tangent of the pitch circles. Left out: 20 degrees. Example: 25"""
    cam: Annotated[Cam, declared.Notation("part")] | None = None
    """The cam that moves what follows, whose profile, pressure angle and contact force are then known. Example:
    {link: cam, roller: F, radius: 8}
    """

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if given.to is not None and given.of is not None:
            yield "'of' belongs to a 'ratio', a 'table' or a 'law'; an expression names its coordinates itself"
        if given.to is None and given.of is None:
            yield "a coupling by 'ratio', 'table' or 'law' needs 'of', the coordinate that is followed"
        if given.law == ():
            yield "an empty law; give its segments, [{to: 30, over: 180}, {to: 0, over: 180}]"
        yield from segments_faults(given.law or (), "{to: 30, over: 180}", "{to: 0, over: 180}")
        if given.radius is not None and given.wheels != "belt":
            yield "the radii of gears follow from the ratio and the distance of their axes; leave 'radius' out"
        if given.phase is not None and given.ratio is None:
            yield "'phase' belongs to a 'ratio'"
        if given.module is not None and given.wheels != "gears":
            yield "a 'module' is that of teeth; leave it out"
        for foreign in given.given("radius", "pressure_angle", "module") if given.cam is not None else ():
            yield f"{foreign!r} belongs to wheels; a cam has its own, in 'cam'"

    @property
    def function(self) -> Expression:
        """What gives the value of the coordinate that follows."""
        assert self.to is not None
        return self.to
