"""The manifest: what a folder of results was computed from, what its columns mean, and its files' hashes."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mechdesign.door.report.names import names
from mechdesign.door.report.page import pages
from mechdesign.door.report.requirements import Verdict
from mechdesign.door.report.tables import json_text, plain
from mechdesign.ground.errors import StudyError
from mechdesign.ground.files import check_own, check_writable, digest, file_names, proper, unsettled, way
from mechdesign.ground.results import Result
from mechdesign.ground.versions import VERSION, installed
from mechdesign.study import Study

NAME = "manifest.json"
_TOOL = "mechdesign"
_INPUTS_IN = "inputs_in"
_OWN = "sha256"  # of the manifest itself
_MOST_BYTES = 100_000_000  # of a manifest; a larger one might not fit into memory
_LIBRARIES = ("numpy", "scipy", "matplotlib", "pillow", "jinja2", "pydantic", "pyyaml", "moocore")


@dataclass(frozen=True)
class Extras:
    """Options of a command's output: pictures, animation, every assembly mode, an HTML report."""

    plots: bool = True
    formats: str = "png"  # of the pictures, with commas between them
    animate: bool = False
    all_modes: bool = False
    report: bool = False
    style: str = "screen"  # of the pictures
    before: Mapping[str, Any] | None = None  # the study before a change, which pictures show as well


def whole(directory: Path) -> dict[str, Any]:
    """The manifest in a folder.

    Raises
    ------
    StudyError
        If what stands there is none, as it has other fields than mechdesign writes.
    """
    # Its models are built where one is read, not by every command.
    from mechdesign.door.report.written_manifest import WrittenManifest

    content = read(directory)
    try:
        WrittenManifest.model_validate(content, strict=True)
    except ValidationError:
        message = f"{directory / NAME}: is not a manifest that mechdesign wrote; run the study again"
        raise StudyError(message) from None
    assert content is not None
    return content


@cache
def _versions() -> dict[str, dict[str, str]]:
    libraries = {name: installed(name) for name in _LIBRARIES}
    return {
        "tool": {"name": _TOOL, "version": VERSION},
        "libraries": {"python": platform.python_version(), **libraries},
    }


def computed_from(study: Study, command: str) -> dict[str, Any]:
    """Everything that decides the numbers of the results: versions, study, the files it names, overrides, seed."""
    files = {
        way(file, study.folder.path): hashlib.sha256(text.encode()).hexdigest() for _, file, text in study.inputs()
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
    """The entry of the manifest about a study before, which pictures show as well."""
    about = computed_from(study, "")
    return {key: about[key] for key in ("study", "inputs", "overrides") if key in about}


def _way_to_inputs(study: Study, directory: Path) -> dict[str, str]:
    """The folder of a study that names files, as seen from its results: `inputs_in`, by which they are found again."""
    if not any(True for _ in study.inputs()):
        return {}
    return {_INPUTS_IN: way(study.folder.path, directory)}


def inputs_folder(directory: Path, content: Mapping[str, Any]) -> Path:
    """The folder of the files that a study names: that of the study if it is known, else that of its results."""
    beside = directory / str(content.get(_INPUTS_IN, "."))
    names = content.get("inputs") or {}
    return beside if all((beside / name).is_file() for name in names) else directory


def _fields(verdict: Verdict) -> dict[str, Any]:
    """A verdict as data; the unit of a limit that is a bare number, and a reason that there is not, are left out."""
    return {name: value for name, value in asdict(verdict).items() if value or name not in ("limit_unit", "reason")}


def compose(
    directory: Path,
    study: Study,
    result: Result,
    verdicts: Sequence[Verdict],
    files: Mapping[str, str],
    output: Extras,
) -> bytes:
    """The manifest of a result in a folder, whose files have these SHA-256."""
    content = (
        computed_from(study, result.command)
        | _way_to_inputs(study, directory)
        | asdict(output)
        | {
            "counts": plain(dict(result.counts)),
            "warnings": [warning.as_data() for warning in (*study.cautions, *result.warnings)],
            **({"notes": list(result.notes)} if result.notes else {}),
            "failed": result.failed,
            **({"interrupted": result.interrupted} if result.interrupted else {}),
            **({"strict": True} if study.strict else {}),
            "requirements": [plain(_fields(verdict)) for verdict in verdicts],
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
    return (json_text(content | {_OWN: _own_digest(content)}, indent=2) + "\n").encode()


def _own_digest(content: Mapping[str, Any]) -> str:
    """SHA-256 of a manifest without that of its own."""
    text = json_text({key: value for key, value in content.items() if key != _OWN})
    return hashlib.sha256(text.encode()).hexdigest()


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
    """Names and hashes of the files that a manifest of mechdesign's lists, without names of other folders."""
    tool, files = content.get("tool"), content.get("files")
    if not (isinstance(tool, dict) and tool.get("name") == _TOOL and isinstance(files, dict)):
        return {}
    return {name: str(digest) for name, digest in files.items() if proper(name)}


def own(directory: Path) -> set[str]:
    """Names of the files in a folder that mechdesign wrote: those of its manifest, and of a run that was cut off."""
    listed = recorded_files(read(directory) or {}).keys()
    return unsettled(directory).union(listed, [NAME] if listed else [])


def read_by(*studies: Study) -> list[Path]:
    """The files that studies read: themselves, and those that they name."""
    named = [file for study in studies for _, file, _ in study.inputs()]
    return named + [study.path for study in studies if study.path is not None]


def check_folder(directory: Path, command: str, output: Extras, read: Iterable[Path]) -> None:
    """Check before a long computation that its results can be written into a folder; creates nothing.

    Raises
    ------
    StudyError
        If they would replace a file that no manifest there lists, or one that is `read`.
    OutputError
        If the folder takes no files.
    """
    check_writable(directory)
    ours, suffixes = own(directory), tuple(f".{kind}" for kind in output.formats.split(","))
    # Pictures are named only where one of them may replace a file of others: that imports Matplotlib.
    others = output.plots and any(name.lower().endswith(suffixes) for name in file_names(directory) if name not in ours)
    written = [NAME, *names(command, output.formats if others else "", animate=output.animate)]
    check_own(directory, [*written, pages.SECTION] if output.report else written, ours, read)


def is_stale(directory: Path, study: Study, asked: Sequence[str]) -> bool:
    """Whether a folder holds the answer to a question that is not asked, of another study or before a change of it."""
    content = read(directory) or {}
    command = content.get("command")
    if not recorded_files(content) or not isinstance(command, str) or command in asked:
        return False
    return any(content.get(key) != value for key, value in computed_from(study, command).items())


def is_current(directory: Path, study: Study, command: str, output: Extras) -> dict[str, Any] | None:
    """The manifest of a folder that completely holds what this study would give, or more pictures; else None."""
    try:
        content = whole(directory)
    except StudyError:
        return None
    expected = computed_from(study, command) | asdict(output)
    without = [name for name in ("plots", "animate", "report") if not expected[name]]
    for name in (*without, *(("formats", "style") if not output.plots else ())):
        expected[name] = content.get(name)
    # Verdicts and warnings of a manifest that was edited are no longer those of its tables.
    if "interrupted" in content or content.get(_OWN) != _own_digest(content):
        return None
    if any(content.get(key) != value for key, value in expected.items()):
        return None
    return content if all(digest(directory / name) == sha256 for name, sha256 in content["files"].items()) else None
