"""The fields of a manifest as it is written, by which one that is read is checked."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, Field, model_validator

from mechdesign.ground.files import proper


def _named(name: str) -> str:
    if not proper(name):
        raise ValueError(f"{name!r} is no name of a file")
    return name


_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
_Name = Annotated[str, AfterValidator(_named)]


class _Column(BaseModel):
    name: str
    unit: str
    meaning: str


class _Table(BaseModel):
    meaning: str
    rows: int = Field(ge=0)
    columns: list[_Column]


class _Study(BaseModel):
    name: str
    sha256: _Sha256
    resolved: dict[str, Any]


class _Warning(BaseModel):
    kind: str
    message: str
    table: str = ""
    row: int | None = Field(None, ge=0)
    pose: str = ""


class _Verdict(BaseModel):
    requirement: str
    met: bool
    worst: float | None
    place: str
    margin: float | None
    unit: str
    note: str
    limit_unit: str = ""
    reason: str = ""


class WrittenManifest(BaseModel):
    """All fields of a manifest."""

    tool: dict[str, str]
    libraries: dict[str, str]
    command: str
    study: _Study
    inputs: dict[str, _Sha256] = {}
    inputs_in: str = "."
    overrides: list[str]
    seed: int = Field(ge=0)
    plots: bool
    formats: str
    animate: bool
    all_modes: bool
    report: bool
    style: str
    before: dict[str, Any] | None
    counts: dict[str, Any]
    warnings: list[_Warning]
    notes: list[str] = []
    failed: str
    interrupted: str = ""
    strict: bool = False
    requirements: list[_Verdict]
    tables: dict[_Name, _Table]
    files: dict[_Name, _Sha256]

    @model_validator(mode="after")
    def _lists_tables(self) -> WrittenManifest:
        if not self.tables.keys() <= self.files.keys():
            raise ValueError("a table is none of the files")
        return self
