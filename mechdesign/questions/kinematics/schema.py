"""What a study asks of a motion beside its poses: outputs, Jacobian, loads, instant centres, mechanical advantage."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field

from mechdesign.ground.errors import counted
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.plates import CLEARANCE, pairs_of, pins_of
from mechdesign.study.building.section import TwoLinks
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.loads import Load, check_friction, check_loads
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import failure

# Drawn where they are asked for.
PICTURES = {"polygons": "velocity and acceleration polygons of a few poses, or of the listed ones"}


def _every_pair(raw: Any) -> Any:
    """Bring ``true`` to an empty list of pairs, which stands for all, and ``false`` to none."""
    if raw == []:
        raise failure("name pairs of links, [[crank, ground]], or write true for all that may meet")
    return ([] if raw else None) if isinstance(raw, bool) else raw


class KinematicsSection(MotionSection):
    """Poses of the mechanism, its rates, and what is reported of it."""

    command: ClassVar[str] = "kinematics"
    jacobian: fields.CoordinateNames | None = None
    """Outputs that are the rows of the Jacobian, as many as the drives; a point counts twice. Left out: ``outputs``, if
    they are as many. Example: [C]
    """
    loads: tuple[Load, ...] = ()
    """Forces and moments that act on the mechanism; the efforts of the drives (torque of a motor,
    force of a cylinder) that balance them are reported, without weights and inertia (see dynamics). Example:
    [{at: T, force: [0, -20]}, {link: boom, moment: 3}]
    """
    characteristic_length: fields.PositiveLength | None = None
    """Length as which a radian counts where the Jacobian mixes lengths and angles. Left out: that of workspace; without
    one inverse_condition is nan there. Example: 0.1
    """
    instant_centres: tuple[TwoLinks, ...] = ()
    """Pairs of links whose instant centre of velocity is found in every pose; of a telescopic leg the body at its begin
    counts. With more than one drive it depends on their rates. Example: [[rod, ground], [crank, rocker]]
    """
    pictures: tuple[Annotated[str, fields.choice(PICTURES, "picture")], ...] = ()
    """Pictures beside those that are always drawn; they need rates. Example: [polygons]"""
    mechanical_advantage: dict[fields.CoordinateName, fields.CoordinateName] = Field(default_factory=dict)
    """Outputs, each with its input: the force (of an angle the moment) that the output gives over that put in, without
    friction; other drives are held. Example: {T.y: grip}
    """

    collisions: Annotated[
        tuple[TwoLinks, ...] | None, BeforeValidator(_every_pair), fields.OrShort({"type": "boolean"})
    ] = None
    """Pairs of links whose clearance is reported: the distance of their outlines by mechanism.plates, negative where
    they overlap. ``true`` takes all links that no joint joins and whose layers, where both are given, are the same, and
    pins with the links whose layers they pass. Example: true Example: [[crank, ground]]
    """

    def checked(self, checker: Checker) -> Self:
        """Check the outputs as well, what loads act on, pairs of links, and outputs with their inputs."""
        self._check_centres(checker)
        self._check_advantage(checker)
        self._check_collisions(checker)
        if self.pictures and not self.rates and self.speed is None and self.motion is None:
            message = f"{self.pictures[0]} show velocities: give 'rates' of the drives, or a 'speed', or a 'motion'"
            checker.report(("kinematics", "pictures"), message, at_key=True)
        checker.outputs(self.outputs, ("kinematics", "outputs"))
        checker.outputs(self.jacobian, ("kinematics", "jacobian"))
        rows = [part for name in self.jacobian or () for part in checker.mechanism.coordinates_of(name)]
        if self.jacobian is not None and len(rows) != (drives := len(checker.mechanism.drives)):
            text = f"{counted(len(rows), 'output')} ({', '.join(rows)}) for {counted(drives, 'drive')}"
            checker.report(("kinematics", "jacobian"), f"{text}; a Jacobian has as many outputs as drives", at_key=True)
        if self.loads:
            check_friction(checker)
        check_loads(checker, self.loads, ("kinematics", "loads"), moving=self.rated, timed=self.motion is not None)
        return super().checked(checker)

    def _check_centres(self, checker: Checker) -> None:
        self._check_pairs(checker, "instant_centres", "an instant centre")
        drives = len(checker.mechanism.drives)
        moved = any(self.rates.values()) or self.speed is not None or self.motion is not None
        if self.instant_centres and drives > 1 and not moved:
            message = (
                f"with {drives} drives instant centres depend on how fast each moves: give 'rates' or a 'speed', or a "
                "'motion'"
            )
            checker.report(("kinematics", "instant_centres"), message, at_key=True)

    def _check_collisions(self, checker: Checker) -> None:
        if self.collisions is None:
            return
        path: KeyPath = ("kinematics", "collisions")
        if checker.mechanism.plates is None:
            checker.report(
                path, "clearances are those of plates: give mechanism.plates, such as {width: 20}", at_key=True
            )
        if CLEARANCE in checker.mechanism.coordinates:
            message = f"{CLEARANCE!r} is the column of the smallest clearance: give what has this name another"
            checker.report(path, message, at_key=True)
        self._check_pairs(checker, "collisions", "a clearance")
        pins = [] if checker.compiled is None else pins_of(checker.compiled.description)
        compared = checker.compiled is None or bool(self.collisions or pairs_of(checker.compiled.description))
        if checker.mechanism.plates is not None and not compared:
            message = "nothing is left to compare: any two links are joined, or lie in different layers; leave it out"
            checker.report(path, message, at_key=True)
        for index, pair in enumerate(self.collisions):
            at = next((pin.name for pin in pins if {*pair} <= {*pin.links}), None)
            if pair[0] != pair[1] and at is not None:
                message = f"{pair[0]!r} and {pair[1]!r} are joined at {at}: they overlap there, in different layers"
                checker.report((*path, index), message)

    def _check_pairs(self, checker: Checker, key: str, noun: str) -> None:
        """Check pairs of two different links, none twice; each has what the noun says."""
        links, pairs = [*checker.mechanism.moving, GROUND], set[frozenset[str]]()
        for index, pair in enumerate(getattr(self, key)):
            path: KeyPath = ("kinematics", key, index)
            for k, name in enumerate(pair):
                checker.check_name(name, links, "link", (*path, k))
            if pair[0] == pair[1]:
                checker.report(path, f"{pair[0]!r} has {noun} with another link, not with itself")
            elif frozenset(pair) in pairs:
                checker.report(path, f"{' and '.join(pair)} are listed twice")
            pairs.add(frozenset(pair))

    def _check_advantage(self, checker: Checker) -> None:
        drives = checker.mechanism.drives
        for output, input_name in self.mechanical_advantage.items():
            path: KeyPath = ("kinematics", "mechanical_advantage", output)
            quantities = checker.coordinate(output, path, at_key=True), checker.coordinate(input_name, path)
            if output == input_name or (output in drives and input_name in drives):
                checker.report(path, f"{output!r} is not moved by {input_name!r}: give an output, and its input")
            elif "none" in quantities:
                name = output if quantities[0] == "none" else input_name
                checker.report(path, f"{name!r} is neither a length nor an angle: no force or moment acts along it")
            elif input_name not in drives and len(drives) > 1:
                message = f"with {len(drives)} drives the input is one of them, {', '.join(drives)}; others are held"
                checker.report(path, message)
