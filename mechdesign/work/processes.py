"""Forked processes: executors of them, and a process that does one long task at a time and reports its progress."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from mechdesign.work.interrupts import Signals, undisturbed

# Reports the progress of a task.
Tell = Callable[[Any], None]
# From the number of a task, and the function that reports its progress, to its value.
Work = Callable[[int, Tell], Any]

# Option of Linux's prctl, from prctl.h: the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG = 1


def forked(count: int, settle_in: Callable[[], None]) -> Executor:
    """An executor of forked workers, which end when this process does; signals wait until each has called `settle_in`.

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
        # Where not all could be forked, those that were would wait for work for ever.
        for worker in set(multiprocessing.active_children()).difference(others):
            worker.kill()
        raise
    return pool


def _end_with_parent(parent: int, settle_in: Callable[[], None]) -> None:
    """End this process when its parent ends, however that ends."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    settle_in()


class TaskProcess:
    """A forked process that does one task at a time; one that is killed costs its task alone.

    An interrupt is raised in the task, which returns what it has. Wait for `notes` to be readable, and call `hear`.

    Attributes
    ----------
    notes : Connection
        Connection that receives the reports of the task.
    task : int or None
        Number of the task under way.
    lost : bool
        Whether the process was killed.
    """

    def __init__(self, work: Work) -> None:
        self.task: int | None = None
        self.lost = False
        self.notes, notes = multiprocessing.Pipe(duplex=False)
        # Only the process holds the other end, which closes when the process is killed.
        with notes:
            self._executor = forked(1, partial(_take_tasks, work, notes))
        self._process = self._executor.submit(os.getpid)

    def begin(self, task: int) -> None:
        """Give it a task."""
        self.task = task
        # A process that was killed has closed its end of the notes.
        with suppress(BrokenExecutor):
            self._value = self._executor.submit(_do, task)

    def hear(self) -> Any:
        """A report of the `task` under way, or its value at the end; None where it was not begun, or killed."""
        try:
            if (note := self.notes.recv()) is not None:
                return note
            self.task = None
            return self._value.result()
        except (EOFError, OSError, BrokenExecutor):
            self.task, self.lost = None, True
            return None

    def interrupt(self) -> None:
        """Raise an interrupt in the task under way, if there is one."""
        if self.task is not None:
            self._send(signal.SIGTERM)

    def close(self) -> None:
        """End the process; a task under way is lost."""
        if self.task is not None:
            self._send(signal.SIGKILL)
        self._executor.shutdown()
        self.notes.close()

    def _send(self, number: int) -> None:
        with suppress(ProcessLookupError, BrokenExecutor):
            os.kill(self._process.result(), number)


def _take_tasks(work: Work, notes: Connection) -> None:
    """In the process, when it begins: signals are raised during a task, and after one no further task begins."""
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
        # An interrupt must not leave a report half written.
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
