"""Checks of the questions against the mechanism: names, kinds of quantities, what belongs together."""

from __future__ import annotations

import pathlib
from collections.abc import Iterable, Mapping
from typing import Any

from mechdesign.mechanism.model import Quantity
from mechdesign.study import pose_checks, reliability_checks, targets
from mechdesign.study.document import Path
from mechdesign.study.names import GROUND, Names
from mechdesign.study.numbers import suggestion
from mechdesign.study.optimize_models import Condition, OptimizeSection
from mechdesign.study.parameters import Parameters
from mechdesign.study.pin_links import split_link
from mechdesign.study.pose_models import PoseSection
from mechdesign.study.reliability_models import ReliabilitySection
from mechdesign.study.reporter import Reporter
from mechdesign.study.sections import COMMANDS, KinematicsSection
from mechdesign.study.stiffness_models import StiffnessSection
from mechdesign.study.units import KINDS, QUANTITY, QuantityError, describe, measure
from mechdesign.study.workspace_models import INDEX_NAMES, NEEDED, Over, WorkspaceSection

INDICES = ("GII", "GRI", "SUI", "area", "box_area")
_STATISTICS = tuple(f"{name}_{kind}" for name in INDEX_NAMES for kind in ("mean", "min", "max", "std"))
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
            checker.outputs(command, section)
        if isinstance(section, KinematicsSection):
            checker.loads(section)
        elif isinstance(section, WorkspaceSection):
            checker.workspace(section)
        elif isinstance(section, OptimizeSection):
            checker.optimize(section)
        elif isinstance(section, ReliabilitySection):
            found[command] = reliability_checks.check(checker, section)
        elif isinstance(section, StiffnessSection):
            found[command] = checker.stiffness(section)
    checker.conditions(("requirements",), parts["requirements"])
    found["targets"] = targets.check(checker, names.section.targets, folder)
    return found


class Checker:
    """Looks names and units up, and notes what is wrong with them."""

    def __init__(self, names: Names, parameters: Parameters, reporter: Reporter, parts: Mapping[str, Any]) -> None:
        self.names = names
        self.parts = parts
        self.parameters = parameters
        self.reporter = reporter

    def known(self, name: str, known: Iterable[str], what: str, path: Path, *, at_key: bool = False) -> bool:
        candidates = list(known)
        if name in candidates:
            return True
        hint = suggestion(name, candidates) or (f"; there are {', '.join(candidates[:12])}" if candidates else "")
        self.reporter.report(path, f"there is no {what} {name!r}{hint}", at_key=at_key)
        return False

    def kind(self, path: Path, kind: str) -> None:
        """Note a quantity whose unit does not fit what its key needs."""
        raw = self.reporter.raw(path)
        if not isinstance(raw, str) or not QUANTITY.fullmatch(raw):
            return
        try:
            powers = measure(raw)[1]
        except QuantityError:
            return
        if powers != KINDS[kind] and not (kind == "rotational_stiffness" and powers == KINDS["moment"]):
            self.reporter.report(path, f"{raw!r} is {describe(powers)}, where {describe(KINDS[kind])} is expected")

    def coordinate(self, name: str, path: Path, *, at_key: bool = False, others: Iterable[str] = ()) -> Quantity | None:
        """Kind of a coordinate; None, and noted, where there is none of that name.

        `others` are names that might have stood there as well.
        """
        quantity = self.names.coordinates.get(name)
        if quantity is None:
            if name in self.names.owners:
                self.reporter.report(
                    path, f"{name!r} is a point; its coordinates are {name}.x and {name}.y", at_key=at_key
                )
            elif name in self.names.moving:
                self.reporter.report(path, f"{name!r} is a link; its coordinate is {name}.angle", at_key=at_key)
            else:
                what = "coordinate or parameter" if others else "coordinate"
                self.known(name, [*self.names.coordinates, *others], what, path, at_key=at_key)
        return quantity

    def outputs(self, command: str, section: KinematicsSection | ReliabilitySection) -> None:
        seen: set[str] = set()
        for index, given in enumerate(section.outputs or ()):
            path: Path = (command, "outputs", index)
            name = split_link(self.names, given)[1] if command == "reliability" else given
            parts = [f"{name}.x", f"{name}.y"] if name in self.names.owners else [name]
            if name not in self.names.owners:
                self.coordinate(name, path)
            if seen.intersection(parts):
                self.reporter.report(path, f"{name!r} is listed twice")
            seen.update(parts)

    def loads(self, section: KinematicsSection) -> None:
        for index, load in enumerate(section.loads):
            path: Path = ("kinematics", "loads", index)
            if load.at is not None:
                self.known(load.at, self.names.owners, "point", (*path, "at"))
            if load.link is not None:
                self.known(load.link, self.names.moving, "moving link", (*path, "link"))

    def workspace(self, section: WorkspaceSection) -> None:
        self.known(section.point, self.names.owners, "point", ("workspace", "point"))
        for name, values in section.at.items():
            path: Path = ("workspace", "at", name)
            quantity = self.coordinate(name, path, at_key=True)
            if isinstance(values, Over):
                self.over(values, path, quantity)
                continue
            if not values:
                self.reporter.report(path, "an empty list of values")
            for index in range(len(values)):
                if quantity in ("length", "angle"):
                    self.kind((*path, index), quantity)
        for index, name in enumerate(section.indices or ()):
            needed = NEEDED.get(name)
            if needed is not None and self.reporter.raw((needed,)) is None:
                message = f"the index {name!r} needs the {needed} section, and the study has none"
                self.reporter.report(("workspace", "indices", index), message)
        scan = section.scan
        if (scan.from_ is None) != (scan.to is None):
            self.reporter.report(("workspace", "scan"), "'from' and 'to' belong together")
        elif scan.from_ is not None and scan.to is not None and scan.to <= scan.from_:
            self.reporter.report(("workspace", "scan", "to"), f"{scan.to:g} is not beyond 'from', {scan.from_:g}")

        ranges = [name for name, values in section.at.items() if isinstance(values, Over)]
        if len(ranges) > 1:
            self.reporter.report(("workspace", "at", ranges[1]), "only one held coordinate can range", at_key=True)

    def over(self, values: Over, path: Path, quantity: str | None) -> None:
        for key in ("from", "to"):
            if quantity in ("length", "angle"):
                self.kind((*path, key), quantity)
        if values.to <= values.from_:
            self.reporter.report((*path, "to"), f"{values.to:g} is not beyond 'from', {values.from_:g}")

    def optimize(self, section: OptimizeSection) -> None:
        root: Path = ("optimize",)
        if not section.variables:
            self.reporter.report((*root, "variables"), "an optimisation needs at least one variable")
        if not section.maximize and not section.minimize:
            self.reporter.report(root, "say what to 'maximize' or 'minimize'", at_key=True)
        above = [name for name in self.parameters.nominal if name not in section.variables]
        for name, variable in section.variables.items():
            path: Path = (*root, "variables", name)
            self.known(name, self.parameters.known(), "parameter or dimension", path, at_key=True)
            if name in self.parameters.formulas:
                message = f"parameter {name!r} follows from others by its expression; vary those, or give it a number"
                self.reporter.report(path, message, at_key=True)
            for key, bound in (("from", variable.from_), ("to", variable.to)):
                for unknown in sorted(bound.names - set(above)):
                    below = " above it" if unknown in section.variables else ""
                    message = f"there is no parameter or variable {unknown!r}{below}{suggestion(unknown, above)}"
                    self.reporter.report((*path, key), message)
            if name in self.parameters.factors:
                quantity: Quantity = "angle" if self.is_angle(name) else "length"
                for key in ("from", "to", "step"):
                    self.kind((*path, key), quantity)
            above.append(name)
            if section.method == "grid" and variable.step is None and variable.number is None:
                self.reporter.report(path, "a variable of a grid needs either 'step' or 'number'")
        if section.method == "pareto" and len(section.maximize + section.minimize) == 1:
            self.reporter.report((*root, "method"), "a Pareto front is between two goals or more; for one use search")
        if section.method == "grid" and section.evaluations is not None:
            self.reporter.report((*root, "evaluations"), "the designs of a grid follow from its steps", at_key=True)
        for key, goals in (("maximize", section.maximize), ("minimize", section.minimize)):
            for index, goal in enumerate(goals):
                self._result(goal.result, (*root, key, index))
        self.conditions((*root, "subject_to"), section.subject_to)

    def is_angle(self, place: str) -> bool:
        owner, _, last = place.rpartition(".")
        if owner.startswith("limits."):
            index = int(owner.split(".")[1])
            limit = self.names.section.limits[index]
            if limit.drive is not None:
                return self.names.drives.get(limit.drive) == "angle"
            return limit.angle is not None or self.names.measures.get(limit.measure or "") == "angle"
        return last in ("direction", "angle")

    def conditions(self, path: Path, conditions: Iterable[Condition]) -> None:
        """Check the results that conditions name."""
        for index, condition in enumerate(conditions):
            self._result(condition.result, (*path, index, "result"), dotted=path[0] == "requirements")

    def _result(self, name: str, path: Path, *, dotted: bool = False) -> None:
        command, _, rest = name.partition(".")
        if not rest:
            known = (*INDICES, *_STATISTICS)
            if dotted or name not in known:
                hint = suggestion(name, known) or f"; a result is one of {', '.join(INDICES)} or <command>.<column>"
                self.reporter.report(path, f"there is no result {name!r}{hint}")
        else:
            self.known(command, COMMANDS, "command", path)
        column = name.rpartition(".")[2]
        needed = command if command in _UNASSUMED else NEEDED.get(column.rpartition("_")[0])
        if not dotted and needed is not None and self.reporter.raw((needed,)) is None:
            self.reporter.report(path, f"{name!r} needs the {needed} section, and the study has none")

    def stiffness(self, section: StiffnessSection) -> StiffnessSection:
        root: Path = ("stiffness",)
        right = self.known(section.at, self.names.owners, "point", (*root, "at"))
        if right and section.link is None and GROUND in self.names.owners[section.at]:
            self.reporter.report((*root, "at"), f"point {section.at!r} belongs to the ground and does not move")
        if section.link is not None and self.known(section.link, self.names.moving, "moving link", (*root, "link")):
            points = self.names.points_of(section.link)
            if right and section.at not in points:
                message = f"link {section.link!r} has no point {section.at!r}; it has {', '.join(points)}"
                self.reporter.report((*root, "at"), message)
        for link, profile in section.elastic.items():
            path: Path = (*root, "elastic", link)
            self.known(link, self.names.moving, "moving link", path, at_key=True)
            self.known(profile, section.sections, "section", path)
        for profile in section.sections:
            if profile not in section.elastic.values():
                others = [other for other in section.sections if other != profile]
                self.reporter.unused((*root, "sections", profile), "section", others)
        for drive in section.actuators:
            path = (*root, "actuators", drive)
            if self.known(drive, self.names.drives, "drive", path, at_key=True):
                raw = self.reporter.raw(path)
                for part in (path, *((*path, k) for k in range(len(raw) if isinstance(raw, list) else 0))):
                    self.kind(part, _STIFFNESS_KINDS[self.names.drives[drive]])
        for joint, bearing in section.bearings.items():
            path = (*root, "bearings", joint)
            slides = [*self.names.slides, *self.names.legs]
            clamped = [set(other.fixed) for other in self.names.section.joints.values() if other.fixed is not None]
            pins = [p for p, owners in self.names.owners.items() if len(owners) > 1 and set(owners) not in clamped]
            if self.known(joint, [*pins, *slides], "pin or slide", path, at_key=True):
                if bearing.radial is not None:
                    self.kind((*path, "radial"), "stiffness")
                if bearing.moment is not None:
                    self.kind((*path, "moment"), "rotational_stiffness")
                if bearing.moment is not None and joint not in slides:
                    self.reporter.report((*path, "moment"), f"pin {joint!r} turns freely: it bears no moment")
        loads = []
        for index, load in enumerate(section.loads):
            path = (*root, "loads", index)
            if len(load) not in ((3,) if section.link is not None else (2, 3)):
                self.reporter.report(path, f"a load is [fx, fy, mz], not {len(load)} numbers")
                continue
            for place, kind in enumerate(("force", "force", "moment")[: len(load)]):
                self.kind((*path, place), kind)
            if section.link is None and len(load) == 3 and load[2] != 0.0:
                self.reporter.report((*path, 2), "a pin carries no moment; name the 'link' that is loaded")
            loads.append((*load, 0.0)[:3])
        return section.model_copy(update={"loads": tuple(loads)})
