"""Many studies: `run` answers every question of each, with one summary; `check` says what each says."""

from __future__ import annotations

import glob
import io
import sys
from collections.abc import Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign import shards
from mechdesign.cli import summary, terminal
from mechdesign.cli.annotations import annotate, of_error, of_verdicts, of_warnings
from mechdesign.cli.board import Board, Far, Reported
from mechdesign.cli.crew import Alone, Crew, Tell
from mechdesign.cli.docs import explained
from mechdesign.cli.execution import (
    OUTCOMES,
    RESULTS,
    Outcome,
    Source,
    answer,
    claim,
    extras,
    folder,
    interrupted,
    load_source,
    load_study,
    place,
    source,
    tell,
    write_report,
)  # fmt: skip
from mechdesign.cli.options import Options
from mechdesign.commands import COMMANDS, MERGE, QUESTIONS, SENSITIVITIES, SWEEP
from mechdesign.courier import LostWorkerError
from mechdesign.errors import Interrupted, OutputError, StudyError, counted, printable
from mechdesign.experiments import analysis, sensitivities
from mechdesign.files import owned
from mechdesign.mechanism.describe import describe
from mechdesign.parallel import one_thread, worker_count
from mechdesign.report import manifest
from mechdesign.report.page import pages
from mechdesign.report.requirements import command_of, foresee, judged_by
from mechdesign.report.tables import to_csv
from mechdesign.report.writer import FIGURES, check_writable, write_file, write_sketch
from mechdesign.study import Study
from mechdesign.study.schema.reliability import in_words

if TYPE_CHECKING:
    from mechdesign.report.page.page import Entry

_KILLED = "the process that computed it was killed, as where memory runs out; use fewer --jobs"


@dataclass(frozen=True)
class Task:
    """A study that could be read, for who reads it again and answers its questions."""

    number: int  # in the order of the studies
    source: Source
    label: str
    root: Path  # of the folders of its questions
    questions: tuple[tuple[str, Path], ...]  # commands, and the folders of their results


@dataclass(frozen=True)
class Said:
    """Messages about a study, and the question that they are about where it is answered."""

    words: str
    given: Outcome | None = None


@dataclass(frozen=True)
class End:
    """The end of a study: what an index of the reports says of it, an exit code of the report, an interrupt."""

    entry: Entry | None = None
    exit_code: int = 0
    interrupted: bool = False


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
def run(paths: Sequence[Path] | None, options: Options, only: Sequence[str] = ()) -> int:
    """Answer every question of the studies, or only some; returns the exit code, the highest of them all.

    Every study is read before the first is computed. Several are answered side by side, by as many processes as there
    are jobs; their messages and results come in the order of the studies. One that fails does not stop the others,
    unless `options.fail_fast`. After an interrupt the summary and the JUnit file show what was finished.
    """
    asked = found_studies(paths)
    with Board(quiet=options.quiet) as board:
        ledger = Ledger(options, len(asked), board)
        try:
            tasks = _read(asked, options, ledger, only)
            if not ledger.stopped:
                _answer(tasks, options, ledger)
        except KeyboardInterrupt:
            ledger.interrupted = True
    return ledger.close()


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


def _read(paths: Sequence[Path | None], options: Options, ledger: Ledger, only: Sequence[str]) -> list[Task]:
    """Read the studies, and keep no more of them than it takes to read them again."""
    tasks: list[Task] = []
    owners: dict[str, Path | None] = {}
    for number, path in enumerate(paths):
        label, study = printable(path.stem) if path else "study", None
        try:
            origin = source(path, options)
            study = load_source(origin, options)
            label = study.label
            claim(owners, study)
            root = folder(study, "", options, several=len(paths) > 1)
            tasks.append(Task(number, origin, label, root, _places(only or questions(study), root, options)))
        except Exception as error:
            ledger.missing(number, failure(label, "check", Path(), error, study))
            if ledger.stopped:
                break
    return tasks


def _places(commands: Sequence[str], root: Path, options: Options) -> tuple[tuple[str, Path], ...]:
    """The questions of a study with their folders; of shards that one command computed, that alone."""
    found = tuple((command, place(root / command, options)) for command in commands)
    if options.command != MERGE:
        return found
    if alone := shards.found(root):
        return ((shards.command_of(alone[0]), root),)
    if (done := manifest.read(root)) is not None and done.get("command") in QUESTIONS:
        return ((done["command"], root),)
    begun = tuple((command, directory) for command, directory in found if shards.found(directory))
    given = {shards.command_of(path) for _, directory in begun for path in shards.found(directory)}
    return found if not begun or "run" in given else begun


def _answer(tasks: Sequence[Task], options: Options, ledger: Ledger) -> None:
    """Answer the questions of the studies, side by side if there are several and the system forks processes.

    Raises
    ------
    KeyboardInterrupt
        When what an interrupt has left is told.
    """
    jobs = worker_count(options.jobs)
    # Work that goes elsewhere goes from this process.
    count = min(jobs, len(tasks)) if sys.platform == "linux" and options.executor is None else 1
    if count > 1:
        options = replace(options, jobs=jobs // count)
        if not options.resume:
            _import(tasks, options)
    ledger.begin(tasks)
    work = partial(_study, options, ledger.several)
    crew: Crew[Task, End] | Alone[Task, End]

    def heard(index: int, note: Far | Said) -> None:
        before = ledger.stopped
        ledger.note(index, note)
        if ledger.stopped and not before:
            crew.stop(index)

    def finish() -> None:
        for index, end in crew:
            ledger.end(index, end)
            if ledger.interrupted and not ledger.stopped:
                raise KeyboardInterrupt

    with Crew(work, tasks, count, heard, ledger.board.show) if count > 1 else Alone(work, tasks, heard) as crew:
        try:
            finish()
        except KeyboardInterrupt:
            ledger.stopped = True
            crew.stop()
            finish()
            raise


def _import(tasks: Sequence[Task], options: Options) -> None:
    """Import what answers the questions, once for all processes that are forked."""
    for command in {command for task in tasks for command, _ in task.questions}:
        import_module(QUESTIONS[command].module)
        if not options.no_plots:
            import_module(f"{FIGURES}.{command}")


def _study(options: Options, several: bool, task: Task, hear: Tell) -> End:
    """Answer the questions of a study, and write its page however that ends."""
    words = io.StringIO()
    told: list[Outcome] = []
    ended = End()

    def say(given: Outcome | None = None) -> None:
        hear(Said(words.getvalue(), given))
        words.seek(0)
        words.truncate()

    with redirect_stderr(words):
        try:
            study = load_source(task.source, options)
        except Exception as error:
            say(failure(task.label, "check", Path(), error))
            return ended
        try:
            for command, directory in task.questions:
                given = _question(study, command, directory, options, Reported(command, hear))
                told.append(given)
                say(given)
                if given.exit_code and options.fail_fast:
                    break
        except KeyboardInterrupt as error:
            told.append(interrupted(study, command, directory, error))
            ended = End(interrupted=True)
        try:
            ended = replace(ended, entry=_page(study, task, told, options, several=several))
        except Exception as error:
            code, message = explained(error)
            terminal.say(f"{study.label}: report: {message}")
            ended = replace(ended, exit_code=code)
        say()
    return ended


def _question(study: Study, command: str, directory: Path, options: Options, progress: Reported) -> Outcome:
    """Answer one question and say what came out; what goes wrong is its outcome."""
    try:
        check_writable(directory)
        with owned(directory):
            given = replace(answer(study, command, directory, options, progress), table=None)
        tell(given, options)
        annotate("error", of_verdicts(study, command, given.verdicts))
        annotate("warning", of_warnings(study, command, given.warnings))
    except Exception as error:
        return failure(study.label, command, directory, error, study)
    return given


def _page(study: Study, task: Task, told: Sequence[Outcome], options: Options, *, several: bool) -> Entry | None:
    """Write the page of a study, and give its line of the index of several; without the option an older one goes."""
    if not options.report:
        pages.remove(task.root / pages.REPORT)
        return None
    left = [command for command, _ in task.questions if command not in {given.command for given in told}]
    write_report(task.root, study, told, options, left)
    if not several:
        return None
    from mechdesign.report.page.page import Entry, thumbnail

    verdicts = [verdict for given in told for verdict in given.verdicts]
    return Entry(
        study.name,
        study.label,
        [(given.command, OUTCOMES[given.exit_code], given.exit_code) for given in told],
        met=sum(verdict.met for verdict in verdicts),
        required=sum(len(judged_by(study, command)) for command, _ in task.questions),
        warnings=len({warning for given in told for warning in given.warnings}),
        drawing="" if options.no_plots else thumbnail(study),
        link=f"{study.label}/{pages.REPORT}",
    )


class Ledger:
    """What becomes of studies: told in their order, in whatever order it is heard, and written in the end."""

    def __init__(self, options: Options, count: int, board: Board) -> None:
        self.options = options
        self.board = board
        self.several = count > 1
        self.interrupted = False
        self.stopped = False  # nothing more is begun
        self._answers: list[list[Outcome]] = [[] for _ in range(count)]
        self._entries: dict[int, Entry] = {}
        self._tasks: Sequence[Task] = ()
        self._words: list[list[str]] = []
        self._ended: set[int] = set()  # indices of tasks
        self._first = 0  # task that is not ended
        self._left = count  # studies without an answer
        self._exit_code = 0

    def missing(self, number: int, given: Outcome) -> None:
        """Note a study that could not be read, or was lost."""
        self._answers[number].append(given)
        self._left -= 1
        self.stopped |= self.options.fail_fast
        if self.options.report and self.several:
            from mechdesign.report.page.page import Entry

            self._entries[number] = Entry(given.study, given.study, [], failed=given.failed)

    def begin(self, tasks: Sequence[Task]) -> None:
        """Begin with the questions."""
        self._tasks = tasks
        self._words = [[] for _ in tasks]
        self.board.start([task.label for task in tasks])

    def note(self, index: int, note: Far | Said) -> None:
        """Hear of a task how far it is, or a question's outcome."""
        task = self._tasks[index]
        if isinstance(note, Far):
            self.board.far(index, note)
            great = terminal.announced(note.total, note.stage) if not note.done and not self.options.quiet else ""
            note = Said(f"{task.label}: {note.command}: {great}\n" if great else "")
        self._words[index].append(note.words)
        if note.given is not None:
            self._answers[task.number].append(note.given)
            self.board.done(index, note.given)
            self.stopped |= self.options.fail_fast and note.given.exit_code > 0
        if index == self._first:
            self._say()

    def end(self, index: int, end: End | None) -> None:
        """Note the end of a task; it may be heard once more."""
        if index in self._ended:
            return
        self._ended.add(index)
        self.board.end(index)
        number = self._tasks[index].number
        if end is None:
            if not self.stopped:
                with redirect_stderr(io.StringIO()) as words:
                    given = failure(self._tasks[index].label, "run", Path(), LostWorkerError(_KILLED))
                self._words[index].append(words.getvalue())
                self.missing(number, given)
        else:
            self._exit_code = max(self._exit_code, end.exit_code)
            self._left -= not end.interrupted
            self.interrupted |= end.interrupted and not self.stopped
            if end.entry is not None:
                self._entries[number] = end.entry
        while self._first in self._ended:
            self._say()
            self._first += 1

    def _say(self) -> None:
        for words in self._words[self._first]:
            self.board.say(words)
        self._words[self._first].clear()

    def close(self) -> int:
        """Tell what came out, write the summary, the JUnit file and the index, and give the exit code."""
        options = self.options
        answers = [given for study in self._answers for given in study]
        lost = f"; {self._left} of {len(self._answers)} studies were not answered" if self.several else ""
        if self.interrupted:
            terminal.say(f"interrupted; what was finished is whole{lost}")
            answers.append(Outcome("", "", Path(), Interrupted.exit_code, 0, failed="interrupted"))
        elif self.stopped and self._left:
            terminal.say(f"stopped at the first failure{lost}")
        if options.junit is not None:
            self._file(options.junit, summary.junit(answers).encode())
        table = summary.summary(answers)
        root = options.out or RESULTS
        if self.several and any(given.written for given in answers):
            self._file(root / summary.NAME, to_csv(table).encode())
        terminal.show(table, as_json=options.json)
        if any(entry.link for entry in self._entries.values()):
            from mechdesign.report.page.page import index

            if self._file(root / pages.INDEX, index([entry for _, entry in sorted(self._entries.items())])):
                terminal.say(f"index of the reports in {root / pages.INDEX}", quiet=options.quiet)
        told = [summary.in_brief(given) for given in answers if given.command and given.exit_code]
        if len(table) > 1 and told:
            terminal.say("\n".join([f"failed: {len(told)} of {counted(len(table), 'question')}", *told]))
        return max(self._exit_code, *(given.exit_code for given in answers))

    def _file(self, path: Path, data: bytes) -> bool:
        """Write a file about all studies; whether it is there, for the run goes on without it."""
        try:
            write_file(path, data)
        except OutputError as error:
            terminal.say(str(error))
            self._exit_code = max(self._exit_code, explained(error)[0])
            return False
        return True


def failure(label: str, command: str, directory: Path, error: Exception, study: Study | None = None) -> Outcome:
    """Say why a question has no answer; returns that as its outcome."""
    code, message = explained(error)
    terminal.say(message if code == 2 else f"{label}: {command}: {message}")
    annotate("error", of_error(error, message, study))
    return Outcome(label, command, directory, code, 0, failed=message)
