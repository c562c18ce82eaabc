"""A live table on the terminal: the questions that are computed, failed, or were answered last."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mechdesign.cli import terminal
from mechdesign.cli.execution import Outcome
from mechdesign.progress import Progress
from mechdesign.work import interrupts
from mechdesign.work.processes import Tell

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table as Grid

_OFTEN = 0.1  # seconds between two progress notes, and between two updates of the table
_LAST = 5  # number of questions shown that were answered last
_WIDTH = 24  # of a bar, in characters


@dataclass(frozen=True)
class ProgressNote:
    """Progress of a question: steps done of the total of a stage; total 0 before the first stage."""

    command: str
    stage: str = ""
    done: int = 0
    total: int = 0


class Reported(Progress):
    """Progress that sends a note at most every `_OFTEN` seconds."""

    def __init__(self, command: str, tell: Tell) -> None:
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


class LiveTable:
    """The table: questions that failed and those answered last, and below them those under way.

    It is on stderr, only on a terminal, and appears after a second; messages go above it. Use it as a context.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._wanted = not quiet and terminal.lively()
        # sys.stderr may be redirected later.
        self._stream = sys.stderr
        self._begun = time.monotonic()
        self._live: Live | None = None
        self._labels: Sequence[str] = ()
        self._under_way: dict[int, tuple[float, ProgressNote]] = {}  # start time and progress
        self._failed: list[Outcome] = []
        self._last: deque[Outcome] = deque(maxlen=_LAST)
        self._ended = 0
        self._shown = 0.0

    def __enter__(self) -> LiveTable:
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            try:
                self._live.stop()
            finally:
                self._live.console.show_cursor()

    def start(self, labels: Sequence[str]) -> None:
        """Start with studies of these names."""
        self._labels = labels

    def advance(self, index: int, how: ProgressNote) -> None:
        """Record the progress of a study's question."""
        since, before = self._under_way.get(index, (0.0, None))
        if before is None or before.command != how.command:
            since = time.monotonic()
        self._under_way[index] = since, how
        self.show()

    def done(self, index: int, outcome: Outcome) -> None:
        """Record the outcome of a study's question."""
        self._under_way.pop(index, None)
        (self._failed if outcome.exit_code else self._last).append(outcome)
        self.show()

    def end(self, index: int) -> None:
        """Record the end of a study."""
        self._under_way.pop(index, None)
        self._ended += 1
        self.show()

    def say(self, words: str) -> None:
        """Print messages above the table."""
        words = terminal.readable(words, self._stream)
        if self._live is None:
            print(words, end="", file=self._stream, flush=True)
        elif words:
            from rich.text import Text

            self._live.console.print(Text.from_ansi(words.rstrip("\n")), soft_wrap=True)

    def show(self) -> None:
        """Update the table on the terminal."""
        now = time.monotonic()
        if self._live is not None:
            if now - self._shown > _OFTEN:
                self._shown = now
                self._live.update(self._table(), refresh=True)
        elif self._wanted and now - self._begun > terminal.DELAY:
            from rich.console import Console
            from rich.live import Live

            console = Console(file=self._stream)
            self._live = Live(console=console, auto_refresh=False, transient=True,
                              redirect_stdout=False, redirect_stderr=False)  # fmt: skip
            self._live.start()

    def _table(self) -> Grid:
        from rich.progress_bar import ProgressBar
        from rich.table import Table as Grid
        from rich.text import Text

        assert self._live is not None
        grid = Grid(box=None, pad_edge=False, header_style="bold")
        # Long names leave room for the other columns.
        grid.add_column("study", no_wrap=True, max_width=self._live.console.width // 4)
        grid.add_column("question", no_wrap=True)
        grid.add_column("outcome", no_wrap=True)
        grid.add_column("seconds", justify="right", no_wrap=True)
        # Lines for finished questions: without the head and the two lines below, but at least one.
        room = max(1, self._live.console.height - 3 - len(self._under_way))
        failed = self._failed[-room:]
        last = [*self._last][len(failed) - room :] if room > len(failed) else []
        for outcome in (*failed, *last):
            word = Text(outcome.word, style="red" if outcome.exit_code else "green")
            grid.add_row(Text(outcome.study), outcome.command, word, f"{outcome.seconds:.1f}")
        for index, (since, how) in sorted(self._under_way.items()):
            bar = Grid.grid(padding=(0, 1))
            bar.add_row(how.stage, ProgressBar(how.total, min(how.done, how.total), width=_WIDTH))
            state = bar if how.total else Text("under way", style="dim")
            grid.add_row(Text(self._labels[index]), how.command, state, f"{time.monotonic() - since:.1f}")
        hidden = len(self._failed) - len(failed)
        parts = [f"{self._ended} of {len(self._labels)} studies", f"{time.monotonic() - self._begun:.0f} s"]
        if self._failed:
            parts.insert(1, f"{len(self._failed)} failed" + f", {hidden} of them above" * bool(hidden))
        grid.add_row(Text(parts[0]), Text(parts[1]), Text("; ".join(parts[2:])), "")
        return grid
