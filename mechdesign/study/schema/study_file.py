"""The whole study file: its sections, its JSON Schema, and the checks of all of it against the mechanism."""

from __future__ import annotations

import pathlib
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from mechdesign.commands import COMMANDS
from mechdesign.errors import MechanismError, StudyError
from mechdesign.mechanism import Mechanism
from mechdesign.study import poses
from mechdesign.study.building.section import MechanismSection, UnitsSection
from mechdesign.study.schema import targets
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.kinematics import KinematicsSection
from mechdesign.study.schema.optimize import Condition, OptimizeSection, check_result
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.stiffness import StiffnessSection
from mechdesign.study.schema.workspace import WorkspaceSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reporter import Reporter


class StudyFile(fields.Model):
    """The whole study file."""

    name: str | None = None
    units: UnitsSection = UnitsSection()
    seed: Annotated[int, fields.whole(0)] = 0
    mechanism: MechanismSection
    kinematics: KinematicsSection | None = None
    workspace: WorkspaceSection | None = None
    optimize: OptimizeSection | None = None
    reliability: ReliabilitySection | None = None
    stiffness: StiffnessSection | None = None
    requirements: tuple[Condition, ...] = Field((), description="the gate: the worst row of each result counts")


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a study file, with which editors complete and check."""
    found = StudyFile.model_json_schema(by_alias=True, mode="validation")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "mechdesign study"}
    return head | {key: value for key, value in found.items() if key not in head}


def check(checker: Checker, folder: pathlib.Path) -> dict[str, Any]:
    """Check all questions that validated, and the targets; returns them with wildcards and defaults filled in."""
    found = dict(checker.parts)
    found |= {command: found[command].checked(checker) for command in COMMANDS if command in found}
    for index, requirement in enumerate(found["requirements"]):
        check_result(checker, requirement.result, ("requirements", index, "result"), required=True)
    found["targets"] = targets.check(checker, checker.mechanism.targets, folder)
    return found


def check_poses(parts: Mapping[str, Any], mechanism: Mechanism, reporter: Reporter, folder: pathlib.Path) -> None:
    """Check that the coordinates that poses give determine the mechanism, that they are not too many, and that the
    targets fit those of kinematics.
    """
    for command in COMMANDS:
        section = parts.get(command)
        found: poses.Poses | None = None
        if isinstance(section, PoseSection) and (key := section.source) is not None:
            try:
                found = poses.expand(section, folder)
            except StudyError as error:
                reporter.report((command, key), str(error))
                continue
            for group in found.groups if found is not None else ():
                try:
                    mechanism.plan(group.names)
                except MechanismError as error:
                    place: KeyPath = (command, key, int(group.rows[0])) if key == "poses" else (command, key)
                    reporter.report(place, str(error))
            if found is not None and not found.slopes and getattr(section, "speed", None) is not None:
                reporter.report((command, "speed"), "the path's point does not move: it has no direction", at_key=True)
        if command == "kinematics" and parts["targets"]:
            try:
                assumed = found or poses.default(mechanism.description)
            except StudyError:
                continue
            targets.check_poses(parts["targets"], mechanism.drives, assumed, reporter)
