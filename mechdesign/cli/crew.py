"""Processes that do great tasks side by side: each hears of an interrupt, and what ends one costs its task alone."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, wait
from types import FrameType
from typing import Any, Generic, TypeVar

from mechdesign.cli.process import Signals
from mechdesign.parallel import end_with, undisturbed

Task = TypeVar("Task")
Value = TypeVar("Value")
# Tells the one who waits how far a task is.
Tell = Callable[[Any], None]
Heard = Callable[[int, Any], None]

_LOOK = 0.2  # seconds between two looks at what takes long
_PATIENCE = 1.0  # seconds that an idle process has to end in


class Alone(Generic[Task, Value]):
    """The same as `Crew` in this process, one task after another."""

    def __init__(self, work: Callable[[Task, Tell], Value], tasks: Sequence[Task], heard: Heard) -> None:
        self._work = work
        self._tasks = tasks
        self._heard = heard
        self._begun = 0

    def __enter__(self) -> Alone[Task, Value]:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def stop(self, last: int | None = None) -> None:
        """Begin no further task."""
        self._begun = len(self._tasks)

    def __iter__(self) -> Iterator[tuple[int, Value | None]]:
        """Numbers of tasks and their values."""
        while (number := self._begun) < len(self._tasks):
            self._begun += 1
            yield number, self._work(self._tasks[number], partial(self._heard, number))


class Crew(Generic[Task, Value]):
    """Forked processes, each of which does one task at a time; iterate over what the tasks give, as it comes.

    Use it as a context, at whose end no process is left. Iterating goes on where an exception broke it off; what was
    given last may then come once more.

    Parameters
    ----------
    work : callable
        From a task, and a function that takes notes of how far it is, to a value; values and notes are pickled. An
        interrupt is raised in it, and it gives what it has.
    tasks : sequence
        They are begun in this order.
    count : int
        Processes, fewer where the system has no room for more.
    heard : callable
        Takes the number of a task and a note.
    waiting : callable
        Called several times a second.
    """

    def __init__(
        self,
        work: Callable[[Task, Tell], Value],
        tasks: Sequence[Task],
        count: int,
        heard: Heard,
        waiting: Callable[[], None],
    ) -> None:
        self._work = work
        self._tasks = tasks
        self._count = min(count, len(tasks))
        self._heard = heard
        self._waiting = waiting
        self._begun = 0
        self._members: list[_Member] = []
        self._values: deque[tuple[int, Value | None]] = deque()

    def __enter__(self) -> Crew[Task, Value]:
        for _ in range(self._count):
            try:
                self._members.append(_Member(self._work, self._tasks))
            except OSError:
                if not self._members:
                    raise
                break
        return self

    def __exit__(self, *_: object) -> None:
        for member in self._members:
            member.end()

    def stop(self, last: int | None = None) -> None:
        """Begin no further task, and interrupt those under way but one; what they give comes as before."""
        self._begun = len(self._tasks)
        for member in self._members:
            if member.task not in (None, last):
                member.interrupt()

    def __iter__(self) -> Iterator[tuple[int, Value | None]]:
        """Numbers of tasks and their values; None of one that was not begun, or whose process was killed."""
        while True:
            while self._values:
                yield self._values[0]
                self._values.popleft()
            with undisturbed():
                self._begin()
            busy = {member.connection: member for member in self._members if member.task is not None}
            if not busy:
                return
            for ready in wait(list(busy), _LOOK):
                self._hear(busy[ready])  # type: ignore[index]
            self._waiting()

    def _begin(self) -> None:
        for member in self._members:
            if member.task is None and self._begun < len(self._tasks):
                member.begin(self._begun)
                self._begun += 1

    def _hear(self, member: _Member) -> None:
        number = member.task
        assert number is not None
        # What is half read could not be read on.
        with undisturbed():
            done, found = member.hear()
            if done:
                self._values.append((number, found))
            if member.lost:
                member.end()
                self._members[self._members.index(member)] = _Member(self._work, self._tasks)
        if not done:
            self._heard(number, found)


class _Member:
    """A process, as the one who forked it sees it; `task` is the number of what it does."""

    def __init__(self, work: Callable[[Any, Tell], Any], tasks: Sequence[Any]) -> None:
        fork = multiprocessing.get_context("fork")
        self.connection, theirs = fork.Pipe()
        self.task: int | None = None
        self.lost = False
        with theirs, undisturbed():
            self._process = fork.Process(target=_serve, args=(work, tasks, theirs, os.getpid()))
            self._process.start()

    def begin(self, task: int) -> None:
        self.task = task
        # One that was killed is found out by the next look.
        with suppress(OSError):
            self.connection.send(task)

    def hear(self) -> tuple[bool, Any]:
        """Whether its task is done, and the value or else a note."""
        try:
            done, found = self.connection.recv()
        except (EOFError, OSError):
            self.lost, done, found = True, True, None
        if done:
            self.task = None
        return done, found

    def interrupt(self) -> None:
        assert self._process.pid is not None
        os.kill(self._process.pid, signal.SIGTERM)

    def end(self) -> None:
        if self.task is None and not self.lost:
            with suppress(OSError):
                self.connection.send(None)
                self._process.join(_PATIENCE)
        self.connection.close()
        self._process.kill()
        self._process.join()
        self._process.close()


class _Interrupts(Signals):
    """Interrupts during a task are raised there; others are kept, and nothing is begun after one."""

    busy = False

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if self.busy:
            super()._interrupt(number, frame)


def _serve(work: Callable[[Any, Tell], Any], tasks: Sequence[Any], connection: Connection, parent: int) -> None:
    """Do the tasks that one is told to do, until it is none."""
    end_with(parent)
    signals = _Interrupts()
    signals.hear()

    def send(*said: Any) -> None:
        with undisturbed():
            connection.send(said)

    # Of a second Ctrl-C.
    with suppress(KeyboardInterrupt):
        while (task := connection.recv()) is not None:
            value = None
            try:
                signals.busy = True
                if signals.number is None:
                    value = work(tasks[task], partial(send, False))
                signals.busy = False
            except KeyboardInterrupt:
                signals.busy = False
            send(True, value)
