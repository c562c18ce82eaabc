"""Two folders of results: their manifests, notes, verdicts, and the tables of both."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from mechdesign.columns import VARIED
from mechdesign.commands import COMMANDS, QUESTIONS, SWEEP
from mechdesign.errors import Problem, StudyError
from mechdesign.report import manifest
from mechdesign.report.comparison.differences import Comparison, Difference, Tolerance, Tolerances
from mechdesign.report.comparison.tables import compare_tables
from mechdesign.report.tables import from_csv
from mechdesign.results import Table
from mechdesign.rows import UnknownColumnError, in_unit
from mechdesign.study.text.document import leaves, read
from mechdesign.study.text.fields import Context, failure, read_number, shown
from mechdesign.terms import command_of

HELP_PAGE = "howto/batch"

_POSE_KEYS = ("poses", "sweep", "path", "motion")
_MOST_ENTRIES = 4  # of the study, that a note names


def compare(old: Path, new: Path, tolerances: Tolerances) -> Comparison:
    """Compare two folders of results, of one command or of many, whose folders are matched by their paths.

    Raises
    ------
    StudyError
        If they have no result in common, or what a folder holds is not what mechdesign writes; or they are equal
        while a pattern of the tolerances fits nothing, as one that was mistyped.
    """
    before, after = results(old), results(new)
    # A manifest stands for its folder.
    old, new = (path.parent if path.name == manifest.NAME else path for path in (old, new))
    if not before.keys() & after.keys():
        there = [f"{root} has {', '.join(folders) or 'none'}" for root, folders in ((old, before), (new, after))]
        raise StudyError(f"nothing to compare: no result stands in both folders; {'; '.join(there)}")
    comparison, noted = Comparison(), defaultdict[str, list[str]](list)
    unused = set(tolerances.patterns)
    for folder in sorted(before.keys() | after.keys()):
        if folder not in before or folder not in after:
            comparison.differences.append(Difference(folder, "", "", "missing" if folder in before else "new"))
            continue
        for note in notes(before[folder], after[folder]):
            noted[note].append(folder)
        pair = (old / folder, before[folder]), (new / folder, after[folder])
        unused -= compare_results(comparison, folder, *pair, tolerances)
    comparison.differences += stale(after)
    everywhere = len(before.keys() & after.keys())
    comparison.notes += [
        note if len(folders) == everywhere else f"{', '.join(folders)}: {note}" for note, folders in noted.items()
    ]
    unfit = [f"tolerances: {pattern!r} fits no column that was compared" for pattern in sorted(unused)]
    if unfit and not comparison.differences:
        raise StudyError([Problem(note) for note in unfit])
    comparison.notes += unfit
    return comparison


def results(root: Path) -> dict[str, dict[str, Any]]:
    """Manifests in and below a folder by the relative paths of their folders, ``.`` for the folder itself.

    Of a manifest, itself alone.

    Raises
    ------
    StudyError
        If there is no such folder, or a manifest cannot be read.
    """
    if root.name == manifest.NAME and root.is_file():
        return {".": results(root.parent)["."]}
    if not root.is_dir():
        raise StudyError(f"{root}: {'is no folder' if root.exists() else 'there is no such folder'} of results")
    folders = [path.parent for path in sorted(root.rglob(manifest.NAME))]
    return {folder.relative_to(root).as_posix(): manifest.whole(folder) for folder in folders}


def stale(contents: Mapping[str, Mapping[str, Any]]) -> Iterator[Difference]:
    """Results in folders named by their commands, of questions that another text of their study beside them lacks."""
    for folder, content in contents.items():
        command, study = content["command"], content["study"]
        for other, beside in contents.items():
            same = beside["study"]["name"] == study["name"] and Path(other).parent == Path(folder).parent
            if not (same and Path(folder).name == command and Path(other).name == beside["command"]):
                continue
            if beside["study"]["sha256"] != study["sha256"] and not _asks(beside["study"]["resolved"], command):
                yield Difference(folder, "", "", "stale", new=f"the study of {other} does not ask it")
                break


def _asks(resolved: Mapping[str, Any], command: str) -> bool:
    """Whether a study asks a question, by a section or a requirement."""
    required = resolved.get("requirements") or []
    judged = {command_of(str(entry.get("result"))) for entry in required if isinstance(entry, dict)}
    given = {name for name, question in QUESTIONS.items() if resolved.get(question.section or name) is not None}
    return command in judged | given or (command == "kinematics" and not (judged | given) & COMMANDS.keys())


def tolerances_from(path: Path, default: Tolerance) -> Tolerances:
    """Read tolerances in YAML, ``reliability.*.sigma: {rtol: 0.05}``; what a pattern leaves out is the `default`.

    An absolute tolerance may have a unit, ``{atol: 0.1 mm}``.

    Raises
    ------
    StudyError
        With the place of each mistake.
    """
    try:
        document = read(path.read_bytes(), str(path))
    except OSError as error:
        raise StudyError(f"{path}: cannot be read: {error.strerror or error}") from None
    if not isinstance(document.data, dict):
        raise document.values[()].failure("write a tolerance a line: reliability.*.sigma: {rtol: 0.05}")
    patterns, problems = {}, list(document.problems)
    for pattern, entry in document.data.items():
        try:
            if not (isinstance(entry, dict) and entry and entry.keys() <= {"rtol", "atol"}):
                raise failure("a tolerance is {rtol: 0.05}, {atol: 0.001 mm} or both")
            patterns[str(pattern)] = default._replace(**{name: _tolerance(name, raw) for name, raw in entry.items()})
        except PydanticCustomError as error:
            problems.append(document.values[(pattern,)].problem(error.message(), str(pattern)))
    if problems:
        raise StudyError(problems)
    return Tolerances(default, patterns)


def _tolerance(name: str, raw: Any) -> float:
    size = read_number(raw, Context(), "none" if name == "rtol" else None)
    if size < 0:
        raise failure(f"{name} is a number from 0 on, not {shown(raw)}")
    return size


def _in_unit(tolerance: Tolerance, pattern: str, table: Table, column: str) -> Tolerance:
    """A tolerance with its absolute part in the unit of a column of numbers."""
    if tolerance.atol is None or not table.column(column).numeric:
        return tolerance
    try:
        return tolerance._replace(atol=in_unit(tolerance.atol, table, column))
    except UnknownColumnError as error:
        raise StudyError(f"tolerances: {pattern!r}: {error}") from None


def _fits(pattern: str, folder: str, command: str, table: str, column: str) -> bool:
    return any(fnmatchcase(f"{where}.{table}.{column}", pattern) for where in (command, folder))


def notes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Differences in what two results were computed from: versions, inputs, overrides, seed, study."""
    for key in ("tool", "libraries", "inputs"):
        before, after = old.get(key) or {}, new.get(key) or {}
        for name in dict.fromkeys((*before, *after)):
            if before.get(name) != after.get(name):
                words = f"input {name}: another file" if key == "inputs" else None
                yield words or f"{key} {name}: {before.get(name, 'none')} -> {after.get(name, 'none')}"
    for key in ("overrides", "seed"):
        if old.get(key) != new.get(key):
            yield f"{key}: {old.get(key)} -> {new.get(key)}"
    entries = [
        {".".join(map(str, keys)): value for keys, value in leaves(content["study"].get("resolved") or {})}
        for content in (old, new)
    ]
    changed = [name for name in entries[0] | entries[1] if entries[0].get(name) != entries[1].get(name)]
    if changed:
        changes = [f"{name} {entries[0].get(name)} -> {entries[1].get(name)}" for name in changed[:_MOST_ENTRIES]]
        yield f"study: {', '.join(changes)}{', ...' * (len(changed) > _MOST_ENTRIES)}"


def compare_results(
    comparison: Comparison,
    folder: str,
    old: tuple[Path, Mapping[str, Any]],
    new: tuple[Path, Mapping[str, Any]],
    tolerances: Tolerances,
    *,
    illegible: bool = False,
) -> set[str]:
    """Add the differences of two results of a command (folder and manifest each); returns the patterns that matched.

    Raises
    ------
    StudyError
        If a table cannot be read, unless `illegible` ones are left to who compares their bytes.
    """
    (_, before), (_, after) = old, new
    fitted: set[str] = set()
    command = str(after.get("command"))
    for name in dict.fromkeys((*before["tables"], *after["tables"])):
        table = name.removesuffix(".csv")
        if name not in before["tables"] or name not in after["tables"]:
            comparison.differences.append(
                Difference(folder, table, "", "missing" if name in before["tables"] else "new")
            )
            continue
        try:
            pair = _read_table(*old, name), _read_table(*new, name)
        except StudyError:
            if illegible:
                continue
            raise
        poses = [_given(entry, command) for entry in (before, after)]
        chosen = {}
        for column in pair[0].names:
            fitting = [pattern for pattern in tolerances.patterns if _fits(pattern, folder, command, table, column)]
            fitted.update(fitting)
            chosen[column] = tolerances.default
            if fitting:
                chosen[column] = _in_unit(tolerances.patterns[fitting[-1]], fitting[-1], pair[0], column)
        comparison.compared.update(tables=1, columns=len(chosen))
        comparison.cases.append((folder, table))
        same_poses = poses[0] == poses[1]
        comparison.differences += compare_tables(*pair, chosen, poses[1][0], folder=folder, same_poses=same_poses)
    verdicts = [{entry["requirement"]: entry for entry in content["requirements"]} for content in (before, after)]
    for words in verdicts[0] | verdicts[1]:
        outcomes = [_verdict(verdict.get(words)) for verdict in verdicts]
        if outcomes[0].split(",")[0] != outcomes[1].split(",")[0]:
            comparison.differences.append(Difference(folder, "", words, "verdict", old=outcomes[0], new=outcomes[1]))
    ends = [str(content.get("interrupted") or content.get("failed") or "done") for content in (before, after)]
    if ends[0] != ends[1]:
        comparison.differences.append(Difference(folder, "", "", "outcome", old=ends[0], new=ends[1]))
    return fitted


def _verdict(verdict: Mapping[str, Any] | None) -> str:
    if verdict is None:
        return "not required"
    worst = verdict.get("worst")
    return f"{'met' if verdict['met'] else 'not met'}{'' if worst is None else f', worst {worst:.6g}'}"


def _read_table(directory: Path, content: Mapping[str, Any], name: str) -> Table:
    """A table of a folder, as its manifest describes it.

    Raises
    ------
    StudyError
        If it is another, or cannot be read.
    """
    about = content["tables"][name]
    try:
        text = (directory / name).read_text(encoding="utf-8")
        return from_csv(text, name.removesuffix(".csv"), about["columns"])
    except OSError as error:
        raise StudyError(f"{directory / name}: cannot be read: {error.strerror or error}") from None
    except (ValueError, TypeError, KeyError):
        message = f"{directory / name}: is not the table that its manifest describes; run the study again"
        raise StudyError(message) from None


def _given(content: Mapping[str, Any], command: str) -> tuple[frozenset[str], Any]:
    """Coordinates that a study gives for a command's poses, by default those of `kinematics`, and their values.

    Of a sweep the entries that vary.
    """
    resolved = content["study"].get("resolved") or {}
    if command == SWEEP.name:
        columns = [column_data for about in content["tables"].values() for column_data in about["columns"]]
        return frozenset(column["name"] for column in columns if column["meaning"] == VARIED), resolved.get(
            SWEEP.section
        )
    for section in (resolved.get(command), resolved.get("kinematics")):
        poses = {key: section[key] for key in _POSE_KEYS if section.get(key)} if isinstance(section, dict) else {}
        if not poses:
            continue
        listed = [pose for pose in poses.get("poses", ()) if isinstance(pose, dict)]
        names = {f"{point}.{axis}" for point in poses.get("path", ()) for axis in "xy"}
        return frozenset(names.union(poses.get("sweep", ()), poses.get("motion", ()), *listed)), poses
    return frozenset(), None
