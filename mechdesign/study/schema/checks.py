"""Checks of the questions against the mechanism: names, kinds of quantities, what belongs together."""

from __future__ import annotations

import pathlib
from collections.abc import Iterable, Mapping
from typing import Any

from mechdesign.commands import COMMANDS
from mechdesign.indices import index_names, needed_section
from mechdesign.mechanism.model import Quantity
from mechdesign.study.build.names import GROUND, Names
from mechdesign.study.build.parameters import Parameters
from mechdesign.study.schema import pose_checks, reliability_checks, targets
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.optimize import Condition, OptimizeSection
from mechdesign.study.schema.pin_links import split_link
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.sections import KinematicsSection
from mechdesign.study.schema.stiffness import StiffnessSection
from mechdesign.study.schema.workspace import Over, WorkspaceSection
from mechdesign.study.text.document import Path
from mechdesign.study.text.numbers import suggestion
from mechdesign.study.text.reporter import Reporter

INDICES = ("GII", "GRI", "SUI", "area", "box_area")
_STATISTICS = ("mean", "min", "max", "std")
# Commands whose section no default can replace.
_UNASSUMED = ("reliability", "stiffness")
_STIFFNESS_KINDS: dict[Quantity, str] = {"length": "stiffness", "angle": "rotational_stiffness"}


def check(
    parts: Mapping[str, Any], names: Names, parameters: Parameters, reporter: Reporter, folder: pathlib.Path
) -> dict[str, Any]:
    """Check all questions that validated, and the targets; returns them with wildcards and defaults filled in."""
    checker = Checker(names, parameters, reporter, parts)
    found = dict(parts)
    for command in COMMANDS:
        section = parts.get(command)
        if isinstance(section, PoseSection):
            pose_checks.coordinates(checker, command, section)
        if isinstance(section, KinematicsSection | ReliabilitySection):
            pose_checks.rates(checker, command, section)
            _outputs(checker, command, section)
        if isinstance(section, KinematicsSection):
            _loads(checker, section)
        elif isinstance(section, WorkspaceSection):
            _workspace(checker, section)
        elif isinstance(section, OptimizeSection):
            _optimize(checker, section)
        elif isinstance(section, ReliabilitySection):
            found[command] = reliability_checks.check(checker, section)
        elif isinstance(section, StiffnessSection):
            found[command] = _stiffness(checker, section)
    _conditions(checker, ("requirements",), parts["requirements"])
    found["targets"] = targets.check(checker, names.section.targets, folder)
    return found


def _outputs(checker: Checker, command: str, section: KinematicsSection | ReliabilitySection) -> None:
    seen: set[str] = set()
    for index, given in enumerate(section.outputs or ()):
        path: Path = (command, "outputs", index)
        name = split_link(checker.names, given)[1] if command == "reliability" else given
        parts = [f"{name}.x", f"{name}.y"] if name in checker.names.owners else [name]
        if name not in checker.names.owners:
            checker.coordinate(name, path)
        if seen.intersection(parts):
            checker.reporter.report(path, f"{name!r} is listed twice")
        seen.update(parts)


def _loads(checker: Checker, section: KinematicsSection) -> None:
    for index, load in enumerate(section.loads):
        path: Path = ("kinematics", "loads", index)
        if load.at is not None:
            checker.known(load.at, checker.names.owners, "point", (*path, "at"))
        if load.link is not None:
            checker.known(load.link, checker.names.moving, "moving link", (*path, "link"))


def _workspace(checker: Checker, section: WorkspaceSection) -> None:
    checker.known(section.point, checker.names.owners, "point", ("workspace", "point"))
    for name, values in section.at.items():
        path: Path = ("workspace", "at", name)
        quantity = checker.coordinate(name, path, at_key=True)
        if isinstance(values, Over):
            _over(checker, values, path, quantity)
            continue
        if not values:
            checker.reporter.report(path, "an empty list of values")
        for index in range(len(values)):
            if quantity in ("length", "angle"):
                checker.kind((*path, index), quantity)
    for index, name in enumerate(section.indices or ()):
        needed = needed_section(name)
        if needed and checker.reporter.raw((needed,)) is None:
            message = f"the index {name!r} needs the {needed} section, and the study has none"
            checker.reporter.report(("workspace", "indices", index), message)
    scan = section.scan
    if (scan.from_ is None) != (scan.to is None):
        checker.reporter.report(("workspace", "scan"), "'from' and 'to' belong together")
    elif scan.from_ is not None and scan.to is not None and scan.to <= scan.from_:
        checker.reporter.report(("workspace", "scan", "to"), f"{scan.to:g} is not beyond 'from', {scan.from_:g}")

    ranges = [name for name, values in section.at.items() if isinstance(values, Over)]
    if len(ranges) > 1:
        checker.reporter.report(("workspace", "at", ranges[1]), "only one held coordinate can range", at_key=True)


def _over(checker: Checker, values: Over, path: Path, quantity: str | None) -> None:
    for key in ("from", "to"):
        if quantity in ("length", "angle"):
            checker.kind((*path, key), quantity)
    if values.to <= values.from_:
        checker.reporter.report((*path, "to"), f"{values.to:g} is not beyond 'from', {values.from_:g}")


def _optimize(checker: Checker, section: OptimizeSection) -> None:
    root: Path = ("optimize",)
    if not section.variables:
        checker.reporter.report((*root, "variables"), "an optimisation needs at least one variable")
    if not section.maximize and not section.minimize:
        checker.reporter.report(root, "say what to 'maximize' or 'minimize'", at_key=True)
    above = [name for name in checker.parameters.nominal if name not in section.variables]
    for name, variable in section.variables.items():
        path: Path = (*root, "variables", name)
        checker.known(name, checker.parameters.known(), "parameter or dimension", path, at_key=True)
        if name in checker.parameters.formulas:
            message = f"parameter {name!r} follows from others by its expression; vary those, or give it a number"
            checker.reporter.report(path, message, at_key=True)
        for key, bound in (("from", variable.from_), ("to", variable.to)):
            for unknown in sorted(bound.names - set(above)):
                below = " above it" if unknown in section.variables else ""
                message = f"there is no parameter or variable {unknown!r}{below}{suggestion(unknown, above)}"
                checker.reporter.report((*path, key), message)
        if name in checker.parameters.factors:
            quantity: Quantity = "angle" if checker.is_angle(name) else "length"
            for key in ("from", "to", "step"):
                checker.kind((*path, key), quantity)
        above.append(name)
        if section.method == "grid" and variable.step is None and variable.number is None:
            checker.reporter.report(path, "a variable of a grid needs either 'step' or 'number'")
    if section.method == "pareto" and len(section.maximize + section.minimize) == 1:
        checker.reporter.report((*root, "method"), "a Pareto front is between two goals or more; for one use search")
    if section.method == "grid" and section.evaluations is not None:
        checker.reporter.report((*root, "evaluations"), "the designs of a grid follow from its steps", at_key=True)
    for key, goals in (("maximize", section.maximize), ("minimize", section.minimize)):
        for index, goal in enumerate(goals):
            _result(checker, goal.result, (*root, key, index))
    _conditions(checker, (*root, "subject_to"), section.subject_to)


def _conditions(checker: Checker, path: Path, conditions: Iterable[Condition]) -> None:
    """Check the results that conditions name."""
    for index, condition in enumerate(conditions):
        _result(checker, condition.result, (*path, index, "result"), dotted=path[0] == "requirements")


def _result(checker: Checker, name: str, path: Path, *, dotted: bool = False) -> None:
    command, _, rest = name.partition(".")
    if not rest:
        known = (*INDICES, *(f"{index}_{kind}" for index in index_names() for kind in _STATISTICS))
        if dotted or name not in known:
            hint = suggestion(name, known) or f"; a result is one of {', '.join(INDICES)} or <command>.<column>"
            checker.reporter.report(path, f"there is no result {name!r}{hint}")
    else:
        checker.known(command, COMMANDS, "command", path)
    column = name.rpartition(".")[2]
    needed = command if command in _UNASSUMED else needed_section(column.rpartition("_")[0])
    if not dotted and needed and checker.reporter.raw((needed,)) is None:
        checker.reporter.report(path, f"{name!r} needs the {needed} section, and the study has none")


def _stiffness(checker: Checker, section: StiffnessSection) -> StiffnessSection:
    root: Path = ("stiffness",)
    right = checker.known(section.at, checker.names.owners, "point", (*root, "at"))
    if right and section.link is None and GROUND in checker.names.owners[section.at]:
        checker.reporter.report((*root, "at"), f"point {section.at!r} belongs to the ground and does not move")
    if section.link is not None and checker.known(section.link, checker.names.moving, "moving link", (*root, "link")):
        points = checker.names.points_of(section.link)
        if right and section.at not in points:
            message = f"link {section.link!r} has no point {section.at!r}; it has {', '.join(points)}"
            checker.reporter.report((*root, "at"), message)
    for link, profile in section.elastic.items():
        path: Path = (*root, "elastic", link)
        checker.known(link, checker.names.moving, "moving link", path, at_key=True)
        checker.known(profile, section.sections, "section", path)
    for profile in section.sections:
        if profile not in section.elastic.values():
            others = [other for other in section.sections if other != profile]
            checker.reporter.unused((*root, "sections", profile), "section", others)
    for drive in section.actuators:
        path = (*root, "actuators", drive)
        if checker.known(drive, checker.names.drives, "drive", path, at_key=True):
            raw = checker.reporter.raw(path)
            for part in (path, *((*path, k) for k in range(len(raw) if isinstance(raw, list) else 0))):
                checker.kind(part, _STIFFNESS_KINDS[checker.names.drives[drive]])
    for joint, bearing in section.bearings.items():
        path = (*root, "bearings", joint)
        slides = [*checker.names.slides, *checker.names.legs]
        clamped = [set(other.fixed) for other in checker.names.section.joints.values() if other.fixed is not None]
        pins = [p for p, owners in checker.names.owners.items() if len(owners) > 1 and set(owners) not in clamped]
        if checker.known(joint, [*pins, *slides], "pin or slide", path, at_key=True):
            if bearing.radial is not None:
                checker.kind((*path, "radial"), "stiffness")
            if bearing.moment is not None:
                checker.kind((*path, "moment"), "rotational_stiffness")
            if bearing.moment is not None and joint not in slides:
                checker.reporter.report((*path, "moment"), f"pin {joint!r} turns freely: it bears no moment")
    loads = []
    for index, load in enumerate(section.loads):
        path = (*root, "loads", index)
        if len(load) not in ((3,) if section.link is not None else (2, 3)):
            checker.reporter.report(path, f"a load is [fx, fy, mz], not {len(load)} numbers")
            continue
        for place, kind in enumerate(("force", "force", "moment")[: len(load)]):
            checker.kind((*path, place), kind)
        if section.link is None and len(load) == 3 and load[2] != 0.0:
            checker.reporter.report((*path, 2), "a pin carries no moment; name the 'link' that is loaded")
        loads.append((*load, 0.0)[:3])
    return section.model_copy(update={"loads": tuple(loads)})
