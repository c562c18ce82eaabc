"""The whole study file: its sections and its JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from mechdesign.study.building.section import MechanismSection, UnitsSection
from mechdesign.study.schema.kinematics import KinematicsSection
from mechdesign.study.schema.optimize import Condition, OptimizeSection
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.stiffness import StiffnessSection
from mechdesign.study.schema.workspace import WorkspaceSection
from mechdesign.study.text import fields


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
