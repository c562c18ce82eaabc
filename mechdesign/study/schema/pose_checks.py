"""Checks of poses and rates: names, units, and whether what they give determines the mechanism."""

from __future__ import annotations

import pathlib
from collections.abc import Iterable, Mapping
from typing import Any

from mechdesign.commands import COMMANDS
from mechdesign.errors import MechanismError, StudyError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.model import Quantity
from mechdesign.study import poses
from mechdesign.study.schema import targets
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.sections import KinematicsSection
from mechdesign.study.schema.targets import Target
from mechdesign.study.schema.workspace import WorkspaceSection
from mechdesign.study.text.document import Path
from mechdesign.study.text.reporter import Reporter

_RATE_KINDS: dict[Quantity, str] = {"length": "velocity", "angle": "angular_velocity"}
_ACCELERATION_KINDS: dict[Quantity, str] = {"length": "acceleration", "angle": "angular_acceleration"}


def coordinates(checker: Checker, command: str, section: PoseSection) -> None:
    """Check the names and units of the coordinates that poses give."""
    if section.at_nodes and checker.reporter.raw(("workspace",)) is None:
        checker.reporter.report((command, "poses"), "needs the workspace section, whose nodes are meant")
    for index, pose in enumerate(section.poses or ()):
        _given(checker, pose, (command, "poses", index))
    for name in section.sweep or ():
        path: Path = (command, "sweep", name)
        quantity = checker.coordinate(name, path, at_key=True)
        for key in ("from", "to", "step"):
            if quantity in ("length", "angle"):
                checker.kind((*path, key), quantity)
    for name, given in (section.path or {}).items():
        if name in checker.names.owners:
            continue
        place: Path = (command, "path", name)
        if checker.coordinate(name, place, at_key=True) is not None and (given.spline or given.shape is not None):
            what = "spline" if given.spline else f"{given.shape}"
            checker.reporter.report(place, f"{name!r} is no point: a {what} is the path of a point", at_key=True)


def _given(
    checker: Checker, values: Iterable[str], path: Path, kinds: Mapping[Quantity, str] | None = None
) -> None:  # fmt: skip
    for name in values:
        quantity = checker.coordinate(name, (*path, name), at_key=True)
        kind = quantity if kinds is None or quantity is None else kinds.get(quantity)
        if kind is not None and kind != "none":
            checker.kind((*path, name), kind)


def rates(checker: Checker, command: str, section: KinematicsSection | ReliabilitySection) -> None:
    """Check that rates and accelerations are those of drives, or of all coordinates that the poses give.

    Along a motion that other coordinates give, drives have no rates of their own: they follow from the motion.
    """
    _given(checker, section.rates, (command, "rates"), _RATE_KINDS)
    _given(checker, section.accelerations, (command, "accelerations"), _ACCELERATION_KINDS)
    drives = checker.names.drives
    source = _source(checker, section)
    given = _sets(checker, source)
    one = given[0] if len(given) == 1 else set()
    if section.speed is not None:
        _speed(checker, command, section, source)
        return
    parts = (("rates", section.rates), ("accelerations", section.accelerations))
    of_given = any(name in one and name not in drives for _, values in parts for name in values)
    for key, values in parts:
        for name in values:
            if name not in checker.names.coordinates or name in (one if of_given else drives):
                continue
            message = f"{name!r} is not a drive: {key} are those of {', '.join(drives)}"
            if of_given:
                message = f"{name!r} is not among what the poses give: {key} are those of {', '.join(sorted(one))}"
            elif one and not one <= set(drives):
                message += f", or of all that the poses give, {', '.join(sorted(one))}"
            elif len(given) > 1:
                message += " where poses give different coordinates"
            checker.reporter.report((command, key, name), message, at_key=True)
        missing = sorted(one - set(values)) if of_given and values else []
        if missing:
            message = f"{', '.join(missing)} missing: {key} are those of all coordinates that the poses give"
            checker.reporter.report((command, key), message, at_key=True)
        if values and not of_given and len(drives) > 1 and one and not one <= set(drives) and _moves(source):
            others = ", ".join(sorted(one))
            message = (
                f"rates of drives that do not change are not those of this motion, which {others} give: say 'speed', "
                f"of a point along its path, or the {key} of {others}; those of the drives follow from them"
            )
            checker.reporter.report((command, key), message, at_key=True)


def _speed(
    checker: Checker, command: str, section: KinematicsSection | ReliabilitySection, source: PoseSection
) -> None:  # fmt: skip
    for key in ("rates", "accelerations"):
        if getattr(section, key):
            checker.reporter.report(
                (command, key), f"'speed' and {key!r} are both given; a path is passed at one of them", at_key=True
            )
    path = source.path
    if path is None:
        message = "a speed is that of a point along its 'path', and the poses are none; give 'rates' of coordinates"
        checker.reporter.report((command, "speed"), message, at_key=True)
        return
    named = set(path)
    points = [name for name in path if name in checker.names.owners]
    points += [n[:-2] for n in path if n.endswith(".x") and f"{n[:-2]}.y" in named and n[:-2] not in points]
    if len(points) != 1:
        which = " and ".join(points) or "no point"
        message = f"a speed is that of one point along its path, and this path is that of {which}; give 'rates' instead"
        checker.reporter.report((command, "speed"), message, at_key=True)


def _source(checker: Checker, section: PoseSection) -> PoseSection:
    """The section that gives the poses of another: itself, or kinematics."""
    if any(part is not None for part in (section.poses, section.sweep, section.path)):
        return section
    kinematics: PoseSection | None = checker.parts.get("kinematics")
    return section if kinematics is None else kinematics


def _moves(section: PoseSection) -> bool:
    """Whether the poses follow one another: a path, or a sweep of one coordinate."""
    moving = [s for s in (section.sweep or {}).values() if s.number != 1 and s.from_ != s.to]
    return section.path is not None or len(moving) == 1


def _of_nodes(checker: Checker) -> list[str]:
    """What the nodes of the workspace give."""
    section: WorkspaceSection | None = checker.parts.get("workspace")
    return [] if section is None else [f"{section.point}.x", f"{section.point}.y", *section.at]


def _sets(checker: Checker, section: PoseSection) -> list[set[str]]:
    """The different sets of coordinates that the poses of a section give."""
    if section.at_nodes:
        return [set(_of_nodes(checker))]
    if section.poses:
        return [set(names) for names in dict.fromkeys(frozenset(pose) for pose in section.poses)]
    if section.sweep is not None:
        return [set(section.sweep)]
    path = section.path or {}
    found = {
        part for name in path for part in ((f"{name}.x", f"{name}.y") if name in checker.names.owners else (name,))
    }
    return [found] if found else []


def check_poses(
    parts: Mapping[str, Any], mechanism: Mechanism, reporter: Reporter, folder: pathlib.Path, turn: float
) -> None:
    """Check that the coordinates that poses give determine the mechanism, that they are not too many, and that the
    targets fit those of kinematics.

    Parameters
    ----------
    turn : float
        A full turn in the study's unit.
    """
    wanted: Mapping[str, Target] = parts["targets"]
    for command in COMMANDS:
        section = parts.get(command)
        found: poses.Poses | None = None
        key = None
        if isinstance(section, PoseSection):
            key = next((key for key in ("poses", "sweep", "path") if getattr(section, key) is not None), None)
        if key is not None and isinstance(section, PoseSection):
            try:
                found = poses.expand(section, folder, turn)
            except StudyError as error:
                reporter.report((command, key), str(error))
                continue
        for group in found.groups if found is not None else ():
            try:
                mechanism.plan(group.names)
            except MechanismError as error:
                place: Path = (command, key, int(group.rows[0])) if key == "poses" else (command, str(key))
                reporter.report(place, str(error))
        if found is not None and not found.slopes and getattr(section, "speed", None) is not None:
            reporter.report((command, "speed"), "the path's point does not move: it has no direction", at_key=True)
        if command == "kinematics" and wanted:
            try:
                assumed = found or poses.default(mechanism.description, turn)
            except StudyError:
                continue
            targets.check_poses(wanted, mechanism.drives, assumed, reporter)
