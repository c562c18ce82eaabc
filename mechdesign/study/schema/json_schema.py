"""The JSON Schema of study files, with which editors complete and check."""

from __future__ import annotations

from typing import Any

from mechdesign.study.schema.sections import StudyFile


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a study file."""
    found = StudyFile.model_json_schema(by_alias=True, mode="validation")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "mechdesign study"}
    return head | {key: value for key, value in found.items() if key not in head}
