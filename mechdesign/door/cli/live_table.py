"""Progress on the terminal: a row for each question that is computed, failed, or was answered last."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mechdesign.door.cli import terminal
from mechdesign.door.cli.places import RESUMED
from mechdesign.ground.progress import Progress
from mechdesign.ground.work import interrupts
from mechdesign.ground.work.journal import INTERVAL

if TYPE_CHECKING:
    from rich.progress import Progress as Rows
    from rich.progress import TaskID

_GREAT, _MANY = 1_000_000, 10_000  # poses or samples, and designs, from which a stage is announced
# Seconds after which a stage is long, and between two lines about it where no table is shown.
_LONG, _EVERY = 10.0, 30.0
_DESIGNS = "designs"
_OFTEN = 0.1  # seconds between two progress notes, and between two updates of the table
_LAST = 5  # number of questions shown that were answered last
_WIDTH = 16  # of a bar, in characters


@dataclass(frozen=True)
class ProgressNote:
    """Progress of a question: steps done of the total of a stage; total 0 before the first stage."""

    command: str
    stage: str = ""
    done: int = 0
    total: int = 0

    @property
    def announcement(self) -> str:
        """What is said of a long stage when it begins, even without a terminal; else empty."""
        great = self.total >= (_MANY if self.stage == _DESIGNS else _GREAT) and not self.done
        return f"{self.total} {self.stage} to compute; {self.ending}" * great

    @property
    def ending(self) -> str:
        """What ends a long stage, and what is left of it then."""
        kept = f", and --resume goes on: what is finished is kept every {INTERVAL:g} s" * (self.command in RESUMED)
        return f"Ctrl-C ends it{kept}"


class Reported(Progress):
    """Progress that sends a note at most every `_OFTEN` seconds."""

    def __init__(self, command: str, tell: Callable[[ProgressNote], None]) -> None:
        self._command = command
        self._tell = tell
        self._stage = ""
        self._done = self._total = 0
        self._told = 0.0
        self._say()

    def start(self, total: int, stage: str) -> None:
        """Begin a stage; an interrupt is raised here."""
        interrupts.check()
        self._stage, self._done, self._total = stage, 0, total
        self._say()

    def update(self, n: int) -> None:
        """Add `n` finished steps; an interrupt is raised here."""
        interrupts.check()
        self._done += n
        if time.monotonic() - self._told > _OFTEN:
            self._say()

    def _say(self) -> None:
        self._told = time.monotonic()
        self._tell(ProgressNote(self._command, self._stage, self._done, self._total))


class Bar(Reported):
    """Progress of a single question, in a table of its own; a long stage is announced even without one."""

    def __init__(self, label: str, command: str, *, quiet: bool) -> None:
        self._quiet, self._table = quiet, LiveTable(quiet=quiet)
        self._table.start([label])
        super().__init__(command, self._show)

    def __exit__(self, *_: object) -> None:
        self._table.__exit__()

    def _show(self, note: ProgressNote) -> None:
        if note.announcement and not self._quiet:
            self._table.say(f"{note.announcement}\n")
        self._table.advance(0, note)


class LiveTable:
    """The table: of several studies how many have ended, then questions that failed, answered last, and under way.

    It is on stderr, only on a terminal, and appears after a second; messages go above it. Elsewhere, as in a file, a
    long stage has a line every half minute. Use it as a context.
    """

    def __init__(self, *, quiet: bool) -> None:
        # sys.stderr may be redirected later.
        self._stream, self._quiet = sys.stderr, quiet
        self._stages: dict[tuple[int, str, str], tuple[float, float]] = {}  # when they began and are told of next
        self._begun = time.monotonic()
        self._refreshed = 0.0
        self._labels: Sequence[str] = ()
        self._under_way: dict[int, TaskID] = {}
        self._failed: list[TaskID] = []
        self._last: list[TaskID] = []
        self._failures = self._ended = 0
        self._rows = self._opened() if not quiet and terminal.lively() else None

    def _opened(self) -> Rows:
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Rows
        from rich.table import Column

        console = Console(file=self._stream)
        # Long names leave room for the other columns.
        name = Column(no_wrap=True, max_width=console.width // 4)
        words = [TextColumn(f"{{task.fields[{key}]}}") for key in ("question", "state")]
        rest = BarColumn(_WIDTH), TaskProgressColumn(), TimeRemainingColumn(elapsed_when_finished=True)
        return Rows(
            TextColumn("{task.description}", markup=False, table_column=name), *words, *rest, console=console,
            # No thread: processes may be forked meanwhile.
            auto_refresh=False, transient=True, redirect_stdout=False, redirect_stderr=False,
        )  # fmt: skip

    def __enter__(self) -> LiveTable:
        return self

    def __exit__(self, *_: object) -> None:
        if self._rows is not None and self._rows.live.is_started:
            try:
                # What is shown last is the summary, and not these rows above it.
                for row in self._rows.task_ids:
                    self._rows.remove_task(row)
                # What follows, such as the writing of tables, has rows of its own.
                self._under_way.clear()
                self._rows.stop()
            finally:
                self._rows.console.show_cursor()

    def start(self, labels: Sequence[str]) -> None:
        """Start with studies of these names."""
        self._labels = labels
        if self._rows is not None and len(labels) > 1:
            self._rows.add_task("", total=len(labels), question="", state="")
            self._count()

    def advance(self, index: int, how: ProgressNote) -> None:
        """Record the progress of a study's question, and tell of a long stage how far it is."""
        now, key = time.monotonic(), (index, how.command, how.stage)
        begun, due = self._stages.setdefault(key, (now, now + _LONG))
        if how.done < how.total and now >= due and not self._quiet:
            first, once = due == begun + _LONG, self._rows is not None
            self._stages[key] = begun, math.inf if once else now + _EVERY
            words = f"{how.done} of {how.total} {how.stage} after {now - begun:.0f} s{f'; {how.ending}' * first}"
            self.say(f"{self._labels[index]}: {how.command}: {words}\n")
        if self._rows is not None:
            row = self._row(self._rows, index, how.command)
            stage = how.stage.replace("[", r"\[")
            self._rows.update(row, completed=how.done, total=how.total or None, state=stage)
            self.show()

    def done(self, index: int, command: str, word: str, *, failed: bool) -> None:
        """Record the outcome of a study's question in a word."""
        if self._rows is not None:
            row = self._row(self._rows, index, command)
            del self._under_way[index]
            self._rows.update(row, completed=1, total=1, state=f"[{'red' if failed else 'green'}]{word}")
            (self._failed if failed else self._last).append(row)
            self._failures += failed
            if len(self._last) > _LAST:
                self._rows.remove_task(self._last.pop(0))
            self._count()

    def _row(self, rows: Rows, index: int, command: str) -> TaskID:
        """The row of a question under way, which is a new one at the end if there is none; finished ones make room."""
        if index not in self._under_way:
            while len(rows.tasks) >= rows.console.height - 1 and (self._last or self._failed):
                rows.remove_task((self._last or self._failed).pop(0))
            self._under_way[index] = rows.add_task(self._labels[index], total=None, question=command, state="")
        return self._under_way[index]

    def end(self, index: int) -> None:
        """Record the end of a study."""
        self._ended += 1
        if self._rows is not None:
            if index in self._under_way:
                self._rows.remove_task(self._under_way.pop(index))
            self._count()

    def _count(self) -> None:
        if self._rows is not None and len(self._labels) > 1:
            words = f"{self._ended} of {len(self._labels)} studies"
            failed = f"{self._failures} failed" * bool(self._failures)
            self._rows.update(self._rows.task_ids[0], description=words, question=failed, completed=self._ended)
        self.show()

    def say(self, words: str) -> None:
        """Print messages above the table."""
        words = terminal.readable(words, self._stream)
        if self._rows is None or not self._rows.live.is_started:
            print(words, end="", file=self._stream, flush=True)
        elif words:
            from rich.text import Text

            self._rows.console.print(Text.from_ansi(words.rstrip("\n")), soft_wrap=True)

    def show(self) -> None:
        """Update the table on the terminal."""
        now = time.monotonic()
        if self._rows is None or now - max(self._refreshed, self._begun + terminal.DELAY) < _OFTEN:
            return
        self._refreshed = now
        if self._rows.live.is_started:
            self._rows.refresh()
        else:
            self._rows.start()
