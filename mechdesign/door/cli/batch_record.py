"""The outcomes of many studies: messages in the order of the studies, one summary, the highest exit code."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass
from pathlib import Path

from mechdesign.door.cli import summary, terminal
from mechdesign.door.cli.annotations import annotate, of_error
from mechdesign.door.cli.docs import explained
from mechdesign.door.cli.live_table import LiveTable, ProgressNote
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.outcome import Outcome
from mechdesign.door.cli.places import RESULTS, SUMMARY
from mechdesign.door.report.page import pages
from mechdesign.door.report.tables import to_csv
from mechdesign.door.report.writer import write_file
from mechdesign.ground.errors import Interrupted, MechdesignError, counted
from mechdesign.ground.records import check_replaceable
from mechdesign.ground.work.pool import LostWorkerError
from mechdesign.study import Study
from mechdesign.study.loaded import StudySource, folder_name

_LOST = "run"  # in place of the commands of a study whose process was killed
_LEFT = "the run ended before it"
_KILLED = "the process that computed it was killed, as where memory runs out; use fewer --jobs"


@dataclass(frozen=True)
class StudyTask:
    """A study that was read without mistakes; a worker reads it again and answers its questions."""

    number: int  # index among the studies
    source: StudySource
    label: str
    root: Path  # folder that contains those of its questions
    questions: tuple[tuple[str, Path], ...]  # commands and folders of results
    options: Options


@dataclass(frozen=True)
class Said:
    """Messages about a study, and the outcome of a question if one is finished."""

    words: str
    outcome: Outcome | None = None


@dataclass(frozen=True)
class End:
    """The end of a study: its line of the index, the exit code of its report, whether it was interrupted."""

    entry: pages.IndexEntry | None = None
    exit_code: int = 0
    interrupted: bool = False


class BatchRecord:
    """Collects the outcomes of studies in any order, shows them in that of the studies, and writes the summary."""

    def __init__(
        self, options: Options, studies: Sequence[Path | None], live_table: LiveTable, *, summed: bool
    ) -> None:
        self.options = options
        self.live_table = live_table
        self.several = len(studies) > 1
        self.summed = summed  # whether a summary and an index are written
        self.interrupted = False
        self.stopped = False  # no further question is started
        self._studies = studies
        self._root = options.out or RESULTS
        self.check(())
        self._outcomes: list[list[Outcome]] = [[] for _ in studies]
        self._entries: dict[int, pages.IndexEntry] = {}
        self._tasks: Sequence[StudyTask] = ()
        self._words: list[list[str]] = []
        self._ended: set[int] = set()  # indices of tasks
        self._first = 0  # first task that has not ended
        self._left = len(studies)  # studies without an answer
        self._exit_code = 0

    def check(self, read: Sequence[Path]) -> None:
        """Check that the summary, JUnit and index files replace no others, and none that is `read`."""
        if self.options.junit is not None:
            check_replaceable(self.options.junit, read)
        for name in [SUMMARY, *[pages.INDEX] * bool(self.options.report)] * self.summed:
            check_replaceable(self._root / name, read)

    def missing(self, number: int, outcome: Outcome) -> None:
        """Record a study that could not be read, or whose process was killed."""
        self._outcomes[number].append(outcome)
        self._left -= 1
        self.stopped |= self.options.fail_fast
        if self.options.report and self.summed:
            self._entries[number] = pages.IndexEntry(
                outcome.study, outcome.study, failed=outcome.failed, outcome=outcome.word
            )

    def begin(self, tasks: Sequence[StudyTask]) -> None:
        """Start with the tasks."""
        self._tasks = tasks
        self._words = [[] for _ in tasks]
        self.live_table.start([task.label for task in tasks])

    def note(self, index: int, note: ProgressNote | Said) -> None:
        """Record the progress of a task, or the outcome of one of its questions."""
        task = self._tasks[index]
        if isinstance(note, ProgressNote):
            self.live_table.advance(index, note)
            great = "" if self.options.quiet else note.announcement
            note = Said(f"{task.label}: {note.command}: {great}\n" if great else "")
        self._words[index].append(note.words)
        if note.outcome is not None:
            self._outcomes[task.number].append(note.outcome)
            outcome = note.outcome
            self.live_table.done(index, outcome.command, outcome.word, failed=bool(outcome.exit_code))
            self.stopped |= self.options.fail_fast and note.outcome.exit_code > 0
        if index == self._first:
            self._say()

    def end(self, index: int, end: End | None) -> None:
        """Record the end of a task; a second call changes nothing."""
        if index in self._ended:
            return
        self._ended.add(index)
        self.live_table.end(index)
        number = self._tasks[index].number
        if end is None:
            if not self.stopped:
                with redirect_stderr(io.StringIO()) as words:
                    outcome = failure(self._tasks[index].label, _LOST, Path(), LostWorkerError(_KILLED))
                self._words[index].append(words.getvalue())
                self.missing(number, outcome)
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
            self.live_table.say(words)
        self._words[self._first].clear()

    def close(self) -> int:
        """Show the outcomes, write summary, JUnit file and index, and return the exit code."""
        options = self.options
        ended = [Outcome("", "", Path(), Interrupted.exit_code, 0, failed="interrupted")] if self.interrupted else []
        outcomes = [*(outcome for study in self._outcomes for outcome in study), *ended]
        lost = f"; {self._left} of {len(self._outcomes)} studies were not answered" if self.several else ""
        if self.interrupted:
            terminal.say(f"interrupted; what was finished is whole{lost}")
        elif self.stopped and self._left:
            terminal.say(f"stopped at the first failure{lost}")
        if options.junit is not None:
            self._file(options.junit, summary.junit([*self._with_left(), *ended]).encode())
        table = summary.summary(outcomes)
        if self.summed and any(outcome.written for outcome in outcomes):
            self._file(self._root / SUMMARY, to_csv(table).encode())
        terminal.show(table, as_json=options.json)
        if terminal.is_terminal() and any(outcome.written for outcome in outcomes):
            root = self._root if self.several else self._tasks[0].root
            terminal.say(f"results in {root}", quiet=options.quiet or options.json)
        first = self._first_to_open()
        if any(entry.link for entry in self._entries.values()):
            path = self._root / pages.INDEX
            if self._file(path, self._index()):
                terminal.say(f"index of the reports in {path}", quiet=options.quiet)
                first = path
        failures = [summary.in_brief(outcome) for outcome in outcomes if outcome.command and outcome.exit_code]
        if len(table) > 1 and failures:
            terminal.say("\n".join([f"failed: {len(failures)} of {counted(len(table), 'question')}", *failures]))
        terminal.suggest(first, quiet=options.quiet or options.json)
        return max([self._exit_code, *(outcome.exit_code for outcome in outcomes)])

    def _first_to_open(self) -> Path | None:
        """Of a single study its report, else the most telling picture; None of several."""
        if self.several:
            return None
        # A folder that could not be made may have a name that no file can have.
        paths = [task.root / pages.REPORT for task in self._tasks] if self.options.report else []
        reports = [path for path in paths if os.path.exists(path)]
        pictures = (outcome.picture for study in self._outcomes for outcome in study)
        return next((path for path in (*reports, *pictures) if path is not None), None)

    def _index(self) -> bytes:
        """The page of all studies, also of those that the run did not come to."""
        from mechdesign.door.report.page.page import index

        labels = {number: folder_name(path) for number, path in enumerate(self._studies)}
        labels |= {task.number: task.label for task in self._tasks}
        return index([
            self._entries.get(number) or pages.IndexEntry(label, label, failed=_LEFT, outcome="not answered")
            for number, label in labels.items()
        ])  # fmt: skip

    def _with_left(self) -> Iterator[Outcome]:
        """Outcomes in the order of the studies, with those of questions that were not reached."""
        tasks = {task.number: task for task in self._tasks}
        for number, (path, outcomes) in enumerate(zip(self._studies, self._outcomes, strict=True)):
            yield from outcomes
            answered = {outcome.command for outcome in outcomes}
            if (task := tasks.get(number)) is not None:
                left = [command for command, _ in task.questions if not {command, _LOST} & answered]
            else:
                left = [] if outcomes else ["check"]
            label = folder_name(path) if task is None else task.label
            yield from (Outcome(label, command, Path(), 0, 0, left=True) for command in left)

    def _file(self, path: Path, data: bytes) -> bool:
        """Write a file about all studies; False, after a message, if that fails."""
        try:
            write_file(path, data)
        except MechdesignError as error:
            terminal.say(str(error))
            self._exit_code = max(self._exit_code, explained(error)[0])
            return False
        return True


def failure(label: str, command: str, directory: Path, error: Exception, study: Study | None = None) -> Outcome:
    """Show why a question failed, and return its outcome."""
    code, message = explained(error)
    terminal.say(message if code == 2 else f"{label}: {command}: {message}")
    annotate("error", of_error(error, message, study))
    return Outcome.unanswered(label, command, directory, code, error, message)
