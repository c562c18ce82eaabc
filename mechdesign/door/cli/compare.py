"""Baselines: `compare` shows what differs between two folders of results, `run --verify` repeats a run and compares."""

from __future__ import annotations

import dataclasses
import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mechdesign
from mechdesign.door.cli import terminal
from mechdesign.door.cli.execution import exit_code
from mechdesign.door.cli.live_table import Bar
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.summary import junit_text
from mechdesign.door.report import comparison, manifest, requirements, writer
from mechdesign.door.report.comparison import Allowance, Comparison, Difference
from mechdesign.door.report.manifest import Extras
from mechdesign.door.report.requirements import Verdict
from mechdesign.ground.errors import StudyError, counted
from mechdesign.ground.files import FORMATS, digest
from mechdesign.ground.records import check_replaceable
from mechdesign.ground.results import Result
from mechdesign.ground.work.threads import one_thread
from mechdesign.study.loading import load_data
from mechdesign.study.text.inputs import Folder

# Changes that are told as messages.
_SAID = ("stale",)
_SHOWN = 12  # digits of a hash
_EXACTLY = Allowance(0.0, 0.0)


def compare(options: Options) -> int:
    """Compare two folders of results; returns 1 where something moved beyond its tolerance, is missing or new, else 0.

    Raises
    ------
    StudyError
        If there is nothing to compare, or a tolerance is none.
    OutputError
        If a file cannot be written.
    """
    rtol, atol = options.rtol, options.atol
    if not (math.isfinite(rtol) and math.isfinite(atol or 0)):
        raise StudyError("--rtol and --atol take numbers from 0 on")
    if options.junit is not None:
        check_replaceable(options.junit)
    return _tell(comparison.compare(options.old, options.new, Allowance(rtol, atol)), "compare", options)


@one_thread()
def verify(options: Options) -> int:
    """Repeat the computations of manifests, compare the tables and judge them; the exit code is 1 if one differs.

    It is that of the run as well, where a requirement is not met or a pose cannot be assembled.

    Raises
    ------
    StudyError
        If there is no manifest, its study cannot be read or its run was interrupted; or options stand beside it that
        would change what is repeated.
    """
    assert options.verify is not None
    path = options.verify
    beside = {name: getattr(options, name) for name in ("command", "jobs", "json", "quiet", "junit", "allow_files")}
    alone = Options(verify=path, **beside)
    if dataclasses.replace(options, paths=options.paths or None, overrides=options.overrides or None) != alone:
        raise StudyError(
            "--verify repeats what a manifest says; beside it stand no studies, and no options but --jobs, --junit, "
            "--json, --quiet and --allow-files"
        )
    if options.junit is not None:
        check_replaceable(options.junit)
    root = path.parent if path.name == manifest.NAME else path
    recorded = comparison.results(path, "--verify")
    if not recorded:
        raise StudyError(f"{path}: there is no {manifest.NAME}, nothing to verify")
    total, code = Comparison(), 0
    for folder, content in recorded.items():
        with tempfile.TemporaryDirectory() as there:
            terminal.say(f"{root / folder}: {content.get('command')} again", quiet=options.quiet)
            result, verdicts = _repeat(Path(there), root / folder / manifest.NAME, content, options)
            for verdict in verdicts:
                terminal.say(f"{root / folder}: requirement: {verdict}", quiet=options.quiet and verdict.met)
            unmet = [verdict for verdict in verdicts if not verdict.met]
            total.differences += [Difference(folder, "", verdict.requirement, "not met") for verdict in unmet]
            code = max(code, exit_code(result.failed, verdicts, result.main))
            _verify(total, folder, root / folder, content, Path(there))
    total.differences += comparison.stale(recorded)
    return max(code, _tell(total, "verify", options))


def _repeat(
    there: Path, where: Path, content: dict[str, Any], options: Options
) -> tuple[Result, Sequence[Verdict]]:  # fmt: skip
    """Repeat the computation that a manifest describes, write its tables and judge them."""
    command = content.get("command")
    if command not in mechdesign.commands.QUESTIONS:
        raise StudyError(f"{where}: of no command that there is: {command!r}")
    if content.get("interrupted"):
        raise StudyError(f"{where}: its run was interrupted, which cannot be repeated; run it again with --resume")
    try:
        inputs = Folder(manifest.inputs_folder(where.parent, content), options.allow_files)
        about = content["study"]
        study = load_data(about["resolved"], (), content["seed"], inputs, about.get("drawn"))
        study = dataclasses.replace(study, strict=content.get("strict", False))
    except (KeyError, TypeError):
        raise StudyError(f"{where}: is not a manifest that mechdesign wrote; run the study again") from None
    except StudyError as error:
        raise StudyError(f"{where}: its study cannot be read here:\n{error}") from None
    more = {"all_modes": True} if content.get("all_modes") else {}
    with Bar(study.label, command, quiet=options.quiet) as bar:
        result = getattr(mechdesign, command)(study, jobs=options.jobs, progress=bar, **more)
    tables = Extras(plots=False, all_modes=bool(more))
    verdicts = requirements.requirements(study, result)
    writer.write(there, study, result, verdicts, tables)
    return result, verdicts


def _verify(total: Comparison, folder: str, kept: Path, content: dict[str, Any], there: Path) -> None:
    """Add the differences between the stored and the repeated tables, and between the bytes of all files."""
    # The repeated study contains its overrides.
    before, after = content | {"overrides": []}, comparison.results(there)["."]
    total.notes += [f"{folder}: {note}" for note in comparison.notes(before, after)]
    total.add(folder, (kept, before), (there, after), _EXACTLY, illegible=True)
    again, listed = after["files"], content["files"]
    tables = {difference.table for difference in total.differences if difference.folder == folder}
    drawn = tuple(f".{kind}" for kind in (*FORMATS, "gif", "json"))
    for name in dict.fromkeys((*listed, *again)):
        table = name.removesuffix(".csv")
        # Other texts and pictures also depend on the study's text, which the manifest does not contain.
        here_alone = (name in again) != (name in listed) and not name.endswith(drawn)
        expected = again.get(name, "") if name in after["tables"] or here_alone else listed.get(name, "")
        digests = {"in the manifest": listed.get(name, ""), "of the file": digest(kept / name)}
        wrong = [f"SHA-256 {other[:_SHOWN] or 'none'} {where}" for where, other in digests.items() if other != expected]
        if wrong and table not in tables:
            total.differences.append(
                Difference(folder, table, "", "bytes", old=", ".join(wrong), new=expected[:_SHOWN])
            )


def _tell(total: Comparison, command: str, options: Options) -> int:
    """Show a comparison and return the exit code."""
    for note in total.notes:
        terminal.say(f"{command}: note: {note}", quiet=options.quiet)
    for difference in total.differences:
        if difference.change in _SAID:
            terminal.say(f"{command}: {difference}")
    tables, columns = total.compared["tables"], total.compared["columns"]
    compared = f"{counted(tables, 'table')} with {counted(columns, 'column')}"
    terminal.say(f"{command}: {counted(len(total.differences), 'difference')} in {compared}", quiet=options.quiet)
    if options.json or not sys.stdout.isatty():
        terminal.show(total.table, as_json=options.json)
    else:
        terminal.show_lines([str(line) for line in total.differences if line.change not in _SAID])
    if options.junit is not None:
        writer.write_file(options.junit, _junit(total, command).encode())
    return 1 if total.differences else 0


def _junit(total: Comparison, command: str) -> str:
    """JUnit XML: a suite for each folder, with a case for each table and one for all other differences."""
    from junitparser import Failure, TestCase

    wrong: dict[tuple[str, str], list[Difference]] = {place: [] for place in total.cases}
    for difference in total.differences:
        wrong.setdefault((difference.folder, difference.table), []).append(difference)
    suites: dict[str, list[TestCase]] = {}
    for (folder, table), differences in wrong.items():
        case = TestCase(table or "result", classname=f"mechdesign.{command}.{folder}", time=0)
        if differences:
            failure = Failure(str(differences[0]), type_="difference")
            failure.text = "\n".join(map(str, differences))
            case.result = [failure]
        suites.setdefault(folder, []).append(case)
    return junit_text(suites)
