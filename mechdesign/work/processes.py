"""Forked processes: executors of them, and one that does a great task at a time and takes notes of how far it is."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from mechdesign.work.interrupts import Signals, undisturbed

# Tells the one who waits how far a task is.
Tell = Callable[[Any], None]
# From the number of a task, and who hears of it, to its value.
Work = Callable[[int, Tell], Any]

# Option of Linux's prctl, from prctl.h: the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG = 1


def forked(count: int, settle_in: Callable[[], None]) -> Executor:
    """An executor of forked workers, which end when this process does; signals wait until each has settled in.

    Raises
    ------
    OSError
        If the system has no room for them.
    """
    fork = multiprocessing.get_context("fork")
    others = multiprocessing.active_children()
    try:
        pool = ProcessPoolExecutor(count, fork, initializer=_end_with_parent, initargs=(os.getpid(), settle_in))
        with undisturbed():
            # The first work forks all of them.
            pool.submit(os.getpid)
    except OSError:
        # Where there is no room for all, those that there are would wait for work for ever.
        for worker in set(multiprocessing.active_children()).difference(others):
            worker.kill()
        raise
    return pool


def _end_with_parent(parent: int, settle_in: Callable[[], None]) -> None:
    """However the process that forked this one ends, this one ends with it."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    settle_in()


class TaskProcess:
    """A forked process that does one task at a time; one that is killed costs its task alone.

    An interrupt is raised in the task, which gives what it has. Wait for `notes` to be readable, and call `hear`.

    Attributes
    ----------
    notes : Connection
        Gives what the task tells.
    task : int or None
        Number of the task under way.
    """

    def __init__(self, work: Work) -> None:
        self._work = work
        self.task: int | None = None
        self._start()

    def _start(self) -> None:
        self.notes, notes = multiprocessing.Pipe(duplex=False)
        # In the end nobody else holds the other end: a process that is killed closes it.
        with notes:
            self._executor = forked(1, partial(_take_tasks, self._work, notes))
        self._process = self._executor.submit(os.getpid)

    def begin(self, task: int) -> None:
        """Give it a task."""
        self.task = task
        try:
            self._value: Future[Any] = self._executor.submit(_do, task)
        except BrokenExecutor as error:
            # It was killed while it had none.
            self._value = Future()
            self._value.set_exception(error)

    def hear(self) -> tuple[bool, Any]:
        """Whether the task is done, and its value or else a note; None of one that was not begun or was killed."""
        with suppress(EOFError, OSError):
            if (note := self.notes.recv()) is not None:
                return False, note
        self.task = None
        try:
            return True, self._value.result()
        except BrokenExecutor:
            self.notes.close()
            self._executor.shutdown()
            self._start()
            return True, None

    def interrupt(self) -> None:
        """Raise an interrupt in its task."""
        with suppress(ProcessLookupError, BrokenExecutor):
            os.kill(self._process.result(), signal.SIGTERM)

    def close(self) -> None:
        """End the process; a task under way is lost."""
        if self.task is not None:
            with suppress(ProcessLookupError, BrokenExecutor):
                os.kill(self._process.result(), signal.SIGKILL)
        self._executor.shutdown()
        self.notes.close()


def _take_tasks(work: Work, notes: Connection) -> None:
    """In the process, when it begins: signals count while there is a task, and nothing is begun after one."""
    global _duty
    signals = Signals()
    signals.raising = False
    _duty = work, notes, signals
    signals.hear()


_duty: tuple[Work, Connection, Signals]


def _do(task: int) -> Any:
    """In the process: the value of a task."""
    work, notes, signals = _duty

    def tell(note: Any) -> None:
        # What is half written could not be read.
        with undisturbed():
            notes.send(note)

    value = None
    try:
        signals.raising = True
        if signals.number is None:
            value = work(task, tell)
        signals.raising = False
    except KeyboardInterrupt:
        pass
    finally:
        signals.raising = False
        tell(None)
    return value
