"""Ask one question of one study: compute, judge, write, show."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import mechdesign
from mechdesign.commands import MERGE, SWEEP
from mechdesign.door.cli import places, process, terminal
from mechdesign.door.cli.annotations import annotate, of_error, of_verdicts, of_warnings
from mechdesign.door.cli.live_table import Bar
from mechdesign.door.cli.options import PDF, Options
from mechdesign.door.cli.outcome import Outcome
from mechdesign.door.cli.places import RESUMED, extras, folder, place
from mechdesign.door.report import manifest, requirements, writer
from mechdesign.door.report.cases import arranged, best_of
from mechdesign.door.report.closing import FAILURES, closing_words
from mechdesign.door.report.manifest import Extras
from mechdesign.door.report.page import pages
from mechdesign.door.report.requirements import Verdict, judged_again, judged_by, on_warnings
from mechdesign.door.report.tables import from_csv
from mechdesign.drawing.before import Before
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import AssemblyError, Interrupted, MechdesignError, StudyError, counted
from mechdesign.ground.files import owned, settle
from mechdesign.ground.long_tables import LongTable
from mechdesign.ground.progress import Progress
from mechdesign.ground.results import Result, Table
from mechdesign.ground.work import ahead, shards
from mechdesign.ground.work.chunks import worker_count
from mechdesign.ground.work.journal import INTERVAL, NAME, Journal
from mechdesign.ground.work.shards import Shard
from mechdesign.ground.work.threads import one_thread
from mechdesign.questions.look import is_long
from mechdesign.study import Study, template_path
from mechdesign.study.loaded import StudySource
from mechdesign.study.loading import load_bytes, read_file
from mechdesign.study.text.document import MAX_BYTES, leaves, read
from mechdesign.study.text.inputs import Folder

STANDARD_INPUT = Path("-")
HERE = Path("study.yaml")  # the study where none is named
PICTURES = "mechdesign.drawing.pictures"  # with it all of Matplotlib that pictures need is imported
_ROWS_AT_ONCE = 20_000  # rows read at a time from the file of a table


def source(path: Path | None, options: Options) -> StudySource:
    """Read the text of a study: ``-`` is standard input; without a path, say which is taken.

    Raises
    ------
    StudyError
        If it cannot be read.
    """
    if path is None:
        path = HERE if HERE.exists() else template_path()
        label = str(HERE) if HERE.exists() else f"the built-in two-link arm (no {HERE} here)"
        terminal.say(f"study: {label}", quiet=options.quiet)
    if path == STANDARD_INPUT:
        return StudySource(None, Folder(anywhere=options.allow_files), sys.stdin.buffer.read(MAX_BYTES + 1))
    return StudySource(path, Folder(path.parent, options.allow_files), read_file(path))


def load_source(source: StudySource, options: Options) -> Study:
    """Load a study with the options' overrides and seed; where they are strict, every warning fails.

    Raises
    ------
    StudyError
        Every mistake of the study or the overrides.
    """
    changes = options.overrides or ()
    values = (text.partition("=")[2].encode(errors="surrogateescape") for text in changes)
    parts = (read(value, "").data for value in values if value.strip())
    given = frozenset(value for part in parts for _, value in leaves(part) if isinstance(value, str))
    # The rule for files is of what a study names, not of what its user does.
    folder = dataclasses.replace(source.folder, given=given)
    study = load_bytes(source.text, source.path, changes, options.seed, folder)
    process.settle()
    return dataclasses.replace(study, strict=True) if options.strict else study


def load_study(path: Path | None, options: Options) -> Study:
    """Load the study of a path; see `source` and `load_source`."""
    return load_source(source(path, options), options)


def answer(study: Study, command: str, directory: Path, options: Options, progress: Progress) -> Outcome:
    """Compute one command's result, judge it by the study's requirements and write it, unless it is there.

    Raises
    ------
    MechdesignError
        Whatever the analysis, the requirements or the files run into.
    """
    places.check(command, directory, options, manifest.read_by(study))
    if options.part is not None:
        return _shard(study, directory, options, options.part, progress)
    begun = time.perf_counter()
    output = extras(command, options)
    before = under = None
    if options.before is not None:
        before = mechdesign.load(options.before, seed=options.seed, allow_files=options.allow_files)
        manifest.check_folder(directory, command, output, manifest.read_by(before))
        output = dataclasses.replace(output, before=manifest.shown_before(before))
    compute, merging = getattr(mechdesign, command), options.command == MERGE
    more: dict[str, Any] = {"jobs": options.jobs, "progress": progress}
    if merging and shards.files_in(directory):
        from mechdesign.experiments.sweep import merged

        compute, more = merged, {"blocks": shards.merge(directory, manifest.computed_from(study, command))}
    elif (options.resume or merging) and (kept := _finished(study, command, directory, output)) is not None:
        return dataclasses.replace(kept, kept=options.resume)
    elif merging:
        # A mistake in the study explains the missing results.
        requirements.foresee(study, [command] if is_long(study, command) else [])
        raise StudyError(
            f"{directory}: there are no shards and no whole results of this study, seed and options; compute them "
            "with --shard 1/N to N/N"
        )
    if is_long(study, command):
        requirements.foresee(study, [command])
    if options.all_modes:
        more["all_modes"] = True
    journal = _journal(study, command, directory, options) if command in RESUMED and not merging else None
    if journal is not None:
        more["journal"] = journal
    try:
        with progress:
            result: Result = compute(study, seed=options.seed, **more)
            if before is not None:
                under = Before.of(study, result, before, _earlier(before, command, options))
    except Interrupted as interrupt:
        writer.write(directory, study, interrupt.result, (), output)
        terminal.say(f"{study.label}: {command}: {interrupt}")
        raise
    except AssemblyError as error:
        if error.result is not None:
            # What comes nearest is shown where the question has pictures of it.
            if error.result.drawn is None:
                output = dataclasses.replace(output, plots=False, animate=False, report=False)
            writer.write(directory, study, error.result, (), output, options.jobs, progress)
        raise
    try:
        with progress:
            verdicts, undrawn = _judged_and_written(directory, study, result, output, options.jobs, progress, under)
    except KeyboardInterrupt:
        if journal is not None:
            journal.save()
        raise
    if journal is not None:
        journal.discard()
    shards.remove(directory)
    warnings = _placed(study, [*study.cautions, *result.warnings, *undrawn])
    code, seconds = exit_code(result.failed, verdicts, result.main), time.perf_counter() - begun
    return Outcome(
        study.label, command, directory, code, len(result.main), warnings, result.failed, verdicts, seconds,
        written=True, table=result.main, reached=result.reached,
        closing=(*result.notes, *closing_words(result.tables.get(FAILURES))),
    )  # fmt: skip


def _shard(study: Study, directory: Path, options: Options, shard: Shard, progress: Progress) -> Outcome:
    """Compute one shard of a sweep and keep it for `merge`."""
    from mechdesign.experiments.sweep import shard_of

    sentence, begun = f"shard {shard} is kept in {directory}", time.perf_counter()
    origin = manifest.computed_from(study, SWEEP.name)
    if options.resume and shards.is_current(directory, origin):
        return Outcome(study.label, SWEEP.name, directory, 0, 0, kept=True, shard=sentence)
    with progress:
        blocks = shard_of(study, shard, seed=options.seed, jobs=options.jobs, progress=progress)
    shards.write(directory, shard, origin, blocks)
    seconds = time.perf_counter() - begun
    return Outcome(study.label, SWEEP.name, directory, 0, 0, seconds=seconds, shard=sentence)


def _earlier(before: Study, command: str, options: Options) -> Result:
    """The result of the `--before` study; its errors begin with its name."""
    try:
        result: Result = getattr(mechdesign, command)(before, seed=options.seed, jobs=options.jobs)
    except MechdesignError as error:
        error.args = (f"--before {before.label}: {error}", *error.args[1:])
        raise
    return result


def _finished(study: Study, command: str, directory: Path, output: Extras) -> Outcome | None:
    """The outcome of an earlier run in the directory, if it is complete and this run would give the same."""
    content = manifest.is_current(directory, study, command, output)
    if content is None:
        return None
    numbers = {"worst": math.nan, "margin": math.nan}
    try:
        judged = [
            Verdict(**entry | {key: value for key, value in numbers.items() if entry.get(key) is None})
            for entry in content["requirements"][: len(judged_by(study, command))]
        ]
        table = _written_table(directory, content)
        failures = _written_table(directory, content, FAILURES) if f"{FAILURES}.csv" in content["tables"] else None
        warnings, failed = [Caution(**warning) for warning in content["warnings"]], str(content["failed"])
    except (ValueError, StopIteration, OSError):
        # The manifest was changed by hand.
        return None
    if len(judged) != len(judged_by(study, command)):
        return None
    verdicts = [*judged, *on_warnings(study, warnings[len(study.warnings) :])]
    settle(directory)
    code = exit_code(failed, verdicts, table)
    return Outcome(
        study.label, command, directory, code, len(table), _placed(study, warnings), failed, verdicts, kept=True,
        written=True, table=table, closing=(*content.get("notes", ()), *closing_words(failures)),
    )  # fmt: skip


def _placed(study: Study, warnings: Sequence[Caution]) -> list[Caution]:
    """Warnings of a result, those of the study with file, line and column."""
    places = study.cautions
    return [dataclasses.replace(warning, message=str(places.get(warning, warning))) for warning in warnings]


def exit_code(failed: str, verdicts: Sequence[Verdict], table: Table) -> int:
    """3 where a pose that was asked for cannot be assembled, 1 where a requirement is not met; of cases the worst."""
    cases = (int(part["exit_code"].max(initial=0)) for part in (table.blocks() if "exit_code" in table else ()))
    return max([3 if failed else 0 if all(verdict.met for verdict in verdicts) else 1, *cases])


def _written_table(directory: Path, content: Mapping[str, Any], name: str = "") -> Table:
    """A table of a folder with this manifest, the main one or that of a name; its rows are read when needed."""
    file, about = next((file, about) for file, about in content["tables"].items() if name in ("", Path(file).stem))

    def blocks() -> Iterator[Table]:
        with (directory / file).open(encoding="utf-8") as stream:
            head = stream.readline()
            lines = list(islice(stream, _ROWS_AT_ONCE))
            while True:
                yield from_csv(head + "".join(lines), Path(file).stem, about["columns"], about["meaning"])
                if not (lines := list(islice(stream, _ROWS_AT_ONCE))):
                    return

    return LongTable(next(blocks()), int(about["rows"]), blocks)


def _judged_and_written(
    directory: Path, study: Study, result: Result, output: Extras, jobs: int | None, progress: Progress,
    before: Before | None,
) -> tuple[Sequence[Verdict], Sequence[Caution]]:  # fmt: skip
    """Judge a result by the study's requirements and write it; the verdicts, and which pictures could not be drawn."""
    try:
        verdicts = requirements.requirements(study, result)
    except StudyError:
        if is_long(study, result.command):
            # A requirement that names a missing row must not lose a long computation.
            writer.write(directory, study, result, (), output)
        raise
    undrawn = writer.write(directory, study, result, verdicts, output, jobs, progress, before)
    return judged_again(study, verdicts, (*result.warnings, *undrawn)), undrawn


def _journal(study: Study, command: str, directory: Path, options: Options) -> Journal:
    """Journal of finished designs or cases; with --resume it begins with those of the earlier run."""
    journal = Journal(directory / NAME, manifest.computed_from(study, command), resume=options.resume)
    if options.resume:
        noun, every = "case" if command == SWEEP.name else "design", f"kept every {INTERVAL:g} s"
        if journal.usable:
            words = f"goes on after {counted(journal.kept, noun)}; what is finished is {every}"
        elif journal.path.exists():
            words = f"{journal.path} is of another study, seed or version; begins anew"
        else:
            words = f"nothing to resume, as what is finished is {every}; begins anew"
        terminal.say(f"{study.label}: {command}: {words}", quiet=options.quiet)
    return journal


def tell(outcome: Outcome, study: Study, options: Options, *, listed: bool = False) -> None:
    """Report an outcome on stderr and to GitHub; with --quiet only failures and requirements that are not met.

    `listed` is whether a table follows that has its rows and its folder.
    """
    who = f"{outcome.study}: {outcome.command}:"
    for warning in outcome.warnings:
        terminal.say(f"{who} warning: {warning} [{warning.kind}]", quiet=options.quiet)
    for verdict in outcome.verdicts:
        terminal.say(f"{who} requirement: {verdict}", quiet=options.quiet and verdict.met)
    if outcome.command == SWEEP.name and outcome.table is not None and (best := best_of(outcome.table)) is not None:
        terminal.say(f"{who} {best}", quiet=options.quiet)
    if outcome.failed:
        from mechdesign.door.cli.docs import look_up

        terminal.say(f"{who} {outcome.failed}\n{look_up(outcome.failed)}".rstrip("\n"))
        annotate("error", of_error(AssemblyError(outcome.failed), "", study))
    annotate("error", of_verdicts(study, outcome.command, outcome.verdicts))
    annotate("warning", of_warnings(study, outcome.command, outcome.warnings))
    if outcome.shard:
        terminal.say(f"{who} {outcome.shard}", quiet=options.quiet)
        return
    kept = "; they are whole, and not computed again" if outcome.kept else ""
    if not listed or kept:
        terminal.say(f"{who} {counted(outcome.rows, 'row')} in {outcome.directory}{kept}", quiet=options.quiet)
    for words in outcome.closing:
        terminal.say(f"{who} {words}", quiet=options.quiet)


def write_report(
    directory: Path, study: Study, outcomes: Sequence[Outcome], options: Options, left: Sequence[str] = ()
) -> list[Mapping[str, str]]:
    """Write a study's report from the files of its questions, and return its key numbers.

    `left` are questions that were not answered.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    from mechdesign.door.report.page import page

    answers = []
    for outcome in outcomes:
        path = outcome.directory / pages.SECTION
        part = json.loads(path.read_text(encoding="utf-8")) if outcome.written and path.exists() else None
        answers.append(
            page.AnsweredQuestion(
                outcome.command, outcome.word, outcome.exit_code, outcome.failed, outcome.verdicts, part
            )
        )
    answers += [page.AnsweredQuestion(command, "not asked", 0, "the run ended before it") for command in left]
    below = any(outcome.directory != directory for outcome in outcomes)
    path = directory / pages.REPORT
    writer.write_file(path, page.report(study, answers, below=below, plots=not options.no_plots))
    printed = ""
    if options.report == PDF:
        from mechdesign.door.report.page import printing

        writer.write_file(directory / pages.PRINTED, printing.pdf(path))
        printed = f", printed in {directory / pages.PRINTED}"
    terminal.say(f"{study.label}: report in {path}{printed}", quiet=options.quiet)
    return [number for answer in answers if answer.section is not None for number in answer.section["headlines"]]


def drawing_ahead(options: Options) -> AbstractContextManager[None]:
    """Context of the answers to one study, in which pictures are drawn by a process that imports Matplotlib at once.

    A report needs Matplotlib in this process.
    """
    if options.no_plots or options.report or options.part is not None:
        return nullcontext()
    return ahead.importing(PICTURES, worker_count(options.jobs))


def question(options: Options) -> int:
    """Answer one question of a study; returns the exit code."""
    return ask(options).exit_code


@one_thread()
def ask(options: Options) -> Outcome:
    """Load a study, answer the question that is the command, write and show the result."""
    command = options.command
    with drawing_ahead(options):
        study = load_study(options.path, options)
        directory = place(folder(study, command, options), options)
        with owned(directory):
            try:
                outcome = answer(study, command, directory, options, Bar(study.label, command, quiet=options.quiet))
            except (Interrupted, AssemblyError) as error:
                if options.report:
                    outcome = Outcome.unanswered(study.label, command, directory, error.exit_code, error, str(error))
                    write_report(directory, study, [outcome], options)
                raise
            if options.report:
                write_report(directory, study, [outcome], options)
    if outcome.shard:
        tell(outcome, study, options)
        return outcome
    assert outcome.table is not None
    terminal.show(
        outcome.table, as_json=options.json, rest=directory / f"{outcome.table.name}.csv", size=study.size,
        arranged=partial(arranged, command),
    )  # fmt: skip
    tell(outcome, study, options)
    best_seen = directory / pages.REPORT if options.report else outcome.picture
    terminal.suggest(best_seen, quiet=options.quiet or options.json)
    return outcome
