"""The manifest: what a folder of results was computed from, what its columns mean, and its files' hashes."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mechdesign.files import proper
from mechdesign.report.requirements import Verdict
from mechdesign.report.tables import json_text, plain
from mechdesign.results import Result
from mechdesign.study import Study

NAME = "manifest.json"
_INPUTS_IN = "inputs_in"
_MOST_BYTES = 100_000_000  # of a manifest; of a larger one the memory might not hold what it says
_LIBRARIES = ("numpy", "scipy", "matplotlib", "pillow", "jinja2", "pydantic", "pint", "pyyaml", "pymoo")


@dataclass(frozen=True)
class Extras:
    """What else than tables is wanted of a command: pictures, the animation, every assembly mode, an HTML report."""

    plots: bool = True
    formats: str = "png"  # of the pictures, with commas between them
    animate: bool = False
    all_modes: bool = False
    report: bool = False
    style: str = "screen"  # of the pictures
    before: Mapping[str, Any] | None = None  # the study before a change, which pictures show as well


@cache
def _versions() -> dict[str, dict[str, str]]:
    libraries = {name: version(name) for name in _LIBRARIES}
    return {
        "tool": {"name": "mechdesign", "version": version("mechdesign")},
        "libraries": {"python": platform.python_version(), **libraries},
    }


def computed_from(study: Study, command: str) -> dict[str, Any]:
    """Everything that decides the numbers of the results: versions, study, the files it names, overrides, seed."""
    files = {
        Path(os.path.relpath(file, study.folder.path)).as_posix(): hashlib.sha256(text.encode()).hexdigest()
        for _, file, text in study.inputs()
    }
    return {
        **_versions(),
        "command": command,
        "study": {
            "name": study.name,
            "sha256": study.text_sha256,
            "resolved": plain(study.resolved),
            **({"drawn": plain(study.drawn)} if study.drawn else {}),
        },
        **({"inputs": files} if files else {}),
        "overrides": list(study.overrides),
        "seed": study.seed,
    }


def shown_before(study: Study) -> dict[str, Any]:
    """What the manifest says of a study that pictures show as well."""
    about = computed_from(study, "")
    return {key: about[key] for key in ("study", "inputs", "overrides") if key in about}


def _way_to_inputs(study: Study, directory: Path) -> dict[str, str]:
    """The folder of a study that names files, as seen from its results: `inputs_in`, by which they are found again."""
    if not any(True for _ in study.inputs()):
        return {}
    return {_INPUTS_IN: Path(os.path.relpath(study.folder.path, directory)).as_posix()}


def inputs_folder(directory: Path, content: Mapping[str, Any]) -> Path:
    """Where the files lie that a study names: beside the study if it is known where that is, else its results."""
    beside = directory / str(content.get(_INPUTS_IN, "."))
    names = content.get("inputs") or {}
    return beside if all((beside / name).is_file() for name in names) else directory


def compose(
    directory: Path,
    study: Study,
    result: Result,
    verdicts: Sequence[Verdict],
    files: Mapping[str, str],
    asked: Extras,
) -> bytes:
    """The manifest of a result in a folder, whose files have these SHA-256."""
    content = (
        computed_from(study, result.command)
        | _way_to_inputs(study, directory)
        | asdict(asked)
        | {
            "counts": plain(dict(result.counts)),
            "warnings": [*(f"{warning.key}: {warning.message}" for warning in study.warnings), *result.warnings],
            "failed": result.failed,
            **({"interrupted": result.interrupted} if result.interrupted else {}),
            "requirements": [plain(asdict(verdict)) for verdict in verdicts],
            "tables": {
                f"{table.name}.csv": {
                    "meaning": table.meaning,
                    "rows": len(table),
                    "columns": [
                        {"name": column.name, "unit": column.unit, "meaning": column.meaning}
                        for column in table.columns
                    ],
                }
                for table in result.tables.values()
            },
            "files": dict(files),
        }
    )
    return (json_text(content, indent=2) + "\n").encode()


def read(directory: Path) -> dict[str, Any] | None:
    """The manifest in a folder, or None where there is none that can be read."""
    path = directory / NAME
    try:
        if not path.is_file() or path.stat().st_size > _MOST_BYTES:
            return None
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def recorded_files(content: Mapping[str, Any]) -> dict[str, str]:
    """Names and hashes of the files a manifest lists; names that would lead out of its folder are left out."""
    files = content.get("files")
    if not isinstance(files, dict):
        return {}
    return {name: str(digest) for name, digest in files.items() if proper(name)}


def is_current(directory: Path, study: Study, command: str, asked: Extras) -> dict[str, Any] | None:
    """The manifest of a folder if it holds, whole, what this study would give again or more pictures; else None."""
    content = read(directory)
    if content is None:
        return None
    expected = computed_from(study, command) | asdict(asked)
    without = [name for name in ("plots", "animate", "report") if not expected[name]]
    for name in (*without, *(("formats", "style") if not asked.plots else ())):
        expected[name] = content.get(name)
    files = recorded_files(content)
    if not files or "interrupted" in content or any(content.get(key) != value for key, value in expected.items()):
        return None
    return content if all(digest(directory / name) == known for name, known in files.items()) else None


def digest(path: Path) -> str:
    """SHA-256 of a file; empty where it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ""
