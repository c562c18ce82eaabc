"""Many studies: `run` answers every question of each, with one summary; `check` says what each says."""

from __future__ import annotations

import glob
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechdesign import shards
from mechdesign.cli import terminal
from mechdesign.cli.annotations import annotate, of_error, of_verdicts, of_warnings
from mechdesign.cli.docs import explained
from mechdesign.cli.execution import (
    OUTCOMES,
    RESULTS,
    Outcome,
    answer,
    claim,
    extras,
    folder,
    interrupted,
    load_study,
    place,
    tell,
    write_report,
)  # fmt: skip
from mechdesign.cli.options import Options
from mechdesign.commands import COMMANDS, MERGE, QUESTIONS, SENSITIVITIES, SWEEP
from mechdesign.errors import Interrupted, OutputError, StudyError, counted, printable, printable_lines
from mechdesign.experiments import analysis, sensitivities
from mechdesign.files import owned
from mechdesign.mechanism.describe import describe
from mechdesign.parallel import one_thread
from mechdesign.report import manifest
from mechdesign.report.page import pages
from mechdesign.report.requirements import command_of, foresee, judged_by
from mechdesign.report.tables import to_csv
from mechdesign.report.writer import check_writable, write_file, write_sketch
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.schema.reliability import in_words

if TYPE_CHECKING:
    from junitparser import JUnitXml

    from mechdesign.report.page.page import Entry

SUMMARY = "summary.csv"  # of several studies, beside their folders


def questions(study: Study) -> tuple[str, ...]:
    """The commands a study asks for: those with a section or a requirement; how it moves, if it asks for nothing.

    Last what is asked of cases of the whole study.
    """
    judged = {command_of(requirement) for requirement in study.requirements}
    asked = [command for command in COMMANDS if command in study.questions or command in judged]
    cases = [each.name for each in (SWEEP, SENSITIVITIES) if getattr(study, each.section or each.name) is not None]
    return (*(asked or ["kinematics"]), *cases)


def found_studies(paths: Sequence[Path] | None) -> list[Path | None]:
    """Files of studies: those that are named, every ``*.yaml`` of a folder, and those of a pattern, each once.

    Raises
    ------
    StudyError
        If a folder or pattern has none.
    """
    if not paths:
        return [None]
    found: dict[Path | None, None] = {}
    for path in paths:
        here = [path]
        if path.is_dir():
            here = sorted(file for file in path.glob("*.yaml") if file.is_file())
        elif glob.has_magic(str(path)) and not path.exists():
            here = sorted(map(Path, glob.glob(str(path), recursive=True)))
        if not here:
            raise StudyError(f"{path}: there are no studies, which are files *.yaml")
        found |= dict.fromkeys(here)
    return list(found)


@one_thread()
def run(paths: Sequence[Path] | None, options: Options) -> int:
    """Answer every question of the studies; returns the exit code, the highest of them all.

    A study or question that fails does not stop the others, unless `options.fail_fast`. An interrupt ends the run; the
    summary and the JUnit file then show what was finished.
    """
    answers: list[Outcome] = []
    asked = found_studies(paths)
    book = Book(options, several=len(asked) > 1)
    try:
        with closing(_answers(asked, options, book)) as found:
            for given in found:
                answers.append(given)
                if given.exit_code and options.fail_fast:
                    break
    except KeyboardInterrupt:
        terminal.say("interrupted; what was finished is whole")
        answers.append(Outcome("", "", Path(), Interrupted.exit_code, 0, failed="interrupted"))
    if options.junit is not None:
        book.file(options.junit, junit(answers).encode())
    summary = _summary(answers)
    if book.several and any(given.written for given in answers):
        book.file((options.out or RESULTS) / SUMMARY, to_csv(summary).encode())
    terminal.show(summary, as_json=options.json)
    book.close()
    told = [_in_brief(given) for given in answers if given.command and given.exit_code]
    if len(summary) > 1 and told:
        terminal.say("\n".join([f"failed: {len(told)} of {counted(len(summary), 'question')}", *told]))
    return max(book.exit_code, *(given.exit_code for given in answers))


@one_thread()
def check(paths: Sequence[Path] | None, options: Options) -> int:
    """Validate studies, describe their mechanisms on stdout and draw them; returns the highest exit code."""
    worst = 0
    owners: dict[str, Path | None] = {}
    asked = found_studies(paths)
    for path in asked:
        try:
            study = load_study(path, options)
            label = study.label
            if not options.quiet:
                clearances = in_words(study.reliability, study.mechanism.graph)
                head = printable(f"{label}: {study.name}")
                terminal.emit("\n".join([head, describe(study.mechanism), *clearances, ""]))
            for warning in study.warnings:
                terminal.say(f"{label}: warning: {warning}", quiet=options.quiet)
            foresee(study, COMMANDS, goals=True)
            if study.matrix is not None:
                analysis.prepared(study)
            if study.sensitivities is not None:
                sensitivities.prepared(study)
            if not options.no_plots:
                claim(owners, study)
                directory = folder(study, "check", options, several=len(asked) > 1)
                told = write_sketch(directory, study, extras("check", options))
                terminal.say(f"{label}: {told}", quiet=options.quiet)
        except Exception as error:
            code, message = explained(error)
            terminal.say(message)
            worst = max(worst, code)
    return worst


def _answers(paths: Sequence[Path | None], options: Options, book: Book) -> Generator[Outcome, None, None]:
    """Answers of all studies in order, without their results; every study is read before the first is computed.

    However the answers to a study end, its page is written.
    """
    studies: list[Study] = []
    for path in paths:
        try:
            studies.append(load_study(path, options))
        except Exception as error:
            yield book.missing(failure(printable(path.stem) if path else "study", "check", Path(), error))
    owners: dict[str, Path | None] = {}
    for study in studies:
        label = study.label
        root = folder(study, "", options, several=len(paths) > 1)
        try:
            claim(owners, study)
            asked = _places(study, root, options)
        except StudyError as error:
            yield book.missing(failure(label, "check", Path(), error, study))
            continue
        told: list[Outcome] = []
        try:
            for command, directory in asked:
                try:
                    check_writable(directory)
                    with owned(directory):
                        given = replace(answer(study, command, directory, options), result=None)
                    tell(given, options)
                    annotate("error", of_verdicts(study, command, given.verdicts))
                    annotate("warning", of_warnings(study, command, given.warnings))
                except KeyboardInterrupt as error:
                    told.append(interrupted(study, command, directory, error))
                    raise
                except Exception as error:
                    given = failure(label, command, directory, error, study)
                told.append(given)
                yield given
        finally:
            book.add(study, root, told)


def _places(study: Study, root: Path, options: Options) -> list[tuple[str, Path]]:
    """The questions of a study with their folders; of shards that one command computed, that alone."""
    found = [(command, place(root / command, options)) for command in questions(study)]
    if options.command != MERGE:
        return found
    if alone := shards.found(root):
        return [(shards.command_of(alone[0]), root)]
    if (done := manifest.read(root)) is not None and done.get("command") in QUESTIONS:
        return [(done["command"], root)]
    begun = [(command, directory) for command, directory in found if shards.found(directory)]
    given = {shards.command_of(path) for _, directory in begun for path in shards.found(directory)}
    return found if not begun or "run" in given else begun


class Book:
    """The reports of a run, where they are wanted: a page a study, and an index of several."""

    def __init__(self, options: Options, *, several: bool) -> None:
        self.options = options
        self.several = several
        self.exit_code = 0
        self._entries: list[Entry] = []
        self._folder = Path()

    def add(self, study: Study, root: Path, told: Sequence[Outcome]) -> None:
        """Write the page of a study with what was told of its questions; without the option an older one goes."""
        try:
            if not self.options.report:
                pages.remove(root / pages.REPORT)
                return
            left = [command for command in questions(study) if command not in {given.command for given in told}]
            write_report(root, study, told, self.options, left)
            self._folder = root.parent
            if self.several:
                self._entries.append(self._entry(study, told))
        except Exception as error:
            self._fail(f"{study.label}: report: {explained(error)[1]}", error)

    def missing(self, given: Outcome) -> Outcome:
        """Note a study that could not be read in the index; gives it back."""
        if self.options.report and self.several:
            from mechdesign.report.page.page import Entry

            self._entries.append(Entry(given.study, given.study, [], failed=given.failed))
        return given

    def close(self) -> None:
        """Write the index of the studies, where there are pages of several."""
        if not any(entry.link for entry in self._entries):
            return
        from mechdesign.report.page.page import index

        path = self._folder / pages.INDEX
        if self.file(path, index(self._entries)):
            terminal.say(f"index of the reports in {path}", quiet=self.options.quiet)

    def file(self, path: Path, data: bytes) -> bool:
        """Write a file about all studies; whether it is there, for the run goes on without it."""
        try:
            write_file(path, data)
        except OutputError as error:
            self._fail(str(error), error)
            return False
        return True

    def _entry(self, study: Study, told: Sequence[Outcome]) -> Entry:
        from mechdesign.report.page.page import Entry, thumbnail

        verdicts = [verdict for given in told for verdict in given.verdicts]
        return Entry(
            study.name,
            study.label,
            [(given.command, OUTCOMES[given.exit_code], given.exit_code) for given in told],
            met=sum(verdict.met for verdict in verdicts),
            required=sum(len(judged_by(study, command)) for command in questions(study)),
            warnings=len({warning for given in told for warning in given.warnings}),
            drawing="" if self.options.no_plots else thumbnail(study),
            link=f"{study.label}/{pages.REPORT}",
        )

    def _fail(self, message: str, error: Exception) -> None:
        terminal.say(message)
        self.exit_code = max(self.exit_code, explained(error)[0])


def failure(label: str, command: str, directory: Path, error: Exception, study: Study | None = None) -> Outcome:
    """Say why a question has no answer; returns that as its outcome."""
    code, message = explained(error)
    terminal.say(message if code == 2 else f"{label}: {command}: {message}")
    annotate("error", of_error(error, message, study))
    return Outcome(label, command, directory, code, 0, failed=message)


def _in_brief(given: Outcome) -> str:
    """What a question failed by, in a line."""
    why = [given.failed.splitlines()[0]] if given.failed else []
    why += [str(verdict) for verdict in given.verdicts if not verdict.met]
    return f"  {given.study}: {given.command}: {OUTCOMES[given.exit_code]}: {'; '.join(why)}"


def _summary(answers: Sequence[Outcome]) -> Table:
    def met(given: Outcome) -> str:
        return f"{sum(verdict.met for verdict in given.verdicts)}/{len(given.verdicts)}" if given.verdicts else ""

    found: dict[str, tuple[type, Callable[[Outcome], str | int]]] = {
        "study": (str, lambda given: given.study),
        "command": (str, lambda given: given.command),
        "outcome": (str, lambda given: given.shard or OUTCOMES[given.exit_code] + " (kept)" * given.kept),
        "exit_code": (int, lambda given: given.exit_code),
        "requirements": (str, met),
        "rows": (int, lambda given: given.rows),
        "warnings": (int, lambda given: len(given.warnings)),
        "directory": (str, lambda given: str(given.directory) if given.rows else ""),
    }
    columns = (
        Column(name, np.array([tell_of(given) for given in answers if given.command], dtype=kind))
        for name, (kind, tell_of) in found.items()
    )
    return Table("summary", tuple(columns), meaning="what became of each question")


def junit(answers: Sequence[Outcome]) -> str:
    """JUnit XML, which every CI server shows: a suite a study; a case a command, and a case a requirement.

    A requirement that is not met is a failure; whatever kept a command from its result is an error.
    """
    from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

    report = JUnitXml("mechdesign")
    for study, group in groupby(answers, key=lambda given: given.study):
        study = printable(study)
        suite, name = TestSuite(study or "mechdesign"), f"mechdesign.{study}".rstrip(".")
        for given in group:
            case = TestCase(given.command or "run", classname=name, time=round(given.seconds, 3))
            if given.exit_code > 1:
                failed = printable_lines(given.failed)
                error = Error(failed.partition("\n")[0] or "failed", type_=f"exit code {given.exit_code}")
                error.text = failed
                case.result = [error]
            if given.warnings:
                case.system_out = "\n".join(f"warning: {printable(warning)}" for warning in given.warnings)
            suite.add_testcase(case)
            for verdict in given.verdicts:
                case = TestCase(f"{given.command}: {printable(verdict.requirement)}", classname=name, time=0)
                if not verdict.met:
                    case.result = [Failure(printable(str(verdict)), type_="requirement")]
                suite.add_testcase(case)
        report.add_testsuite(suite)
    return junit_text(report)


def junit_text(report: JUnitXml) -> str:
    """The text of a JUnit report, with its counts."""
    report.update_statistics()  # type: ignore[no-untyped-call]
    text = report.tostring()  # type: ignore[no-untyped-call]
    body = text.decode() if isinstance(text, bytes) else str(text)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n'
