"""Processes of this machine, started in whatever way the system has, that end when this one does, however it ends."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

from mechdesign.ground.work import interrupts
from mechdesign.ground.work.start import inherit, start_method

# Reports the progress of a task.
Tell = Callable[[Any], None]
# From the number of a task, and the function that reports its progress, to its value.
Work = Callable[[int, Tell], Any]


class Processes(ProcessPoolExecutor):
    """An executor of processes that begin at once, each with `settle_in`; left out, this process handles interrupts.

    Raises
    ------
    OSError
        If the system has no room for them.
    """

    def __init__(self, count: int, settle_in: Callable[..., None] = interrupts.leave_to_parent, *given: Any) -> None:
        super().__init__(count, multiprocessing.get_context(start_method()), _begin, (settle_in, *given))
        others = multiprocessing.active_children()
        try:
            with interrupts.undisturbed(), warnings.catch_warnings(), nullcontext() if inherit() else _without_script():
                # A process may be forked beside threads: what begins there needs none of their locks.
                warnings.simplefilter("ignore", DeprecationWarning)
                # Work that meets no idle process begins one.
                for _ in range(count):
                    self.submit(os.getpid)
        finally:
            self._begun = set(multiprocessing.active_children()).difference(others)
            if len(self._begun) < count:
                # Those that found room would wait for work for ever.
                self.kill()

    def kill(self) -> None:
        """End them at once; work under way is lost."""
        for process in self._begun:
            process.kill()


@contextmanager
def _without_script() -> Iterator[None]:
    """Inside, new processes begin without the script that runs here, which would begin others there in its turn."""
    script, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _begin(settle_in: Callable[..., None], *given: Any) -> None:
    threading.Thread(target=_watch, args=[end for end in given if isinstance(end, Connection)], daemon=True).start()
    if not sys.warnoptions:
        # What libraries warn of is nothing to users.
        warnings.simplefilter("ignore")
    settle_in(*given)


def _watch(*calls: Connection) -> None:
    """End this process when its parent ends, and interrupt its work when the parent calls."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    # The parent's ends close when it ends.
    with suppress(EOFError):
        while parent.sentinel not in (ready := wait([parent.sentinel, *calls])):
            for call in calls:
                if call in ready:
                    call.recv()
                    interrupts.interrupt()
    os._exit(1)


class TaskProcess:
    """A process that does one task at a time; one that is killed costs its task alone.

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
        self.notes, theirs = multiprocessing.Pipe()
        # Only the process holds the other end, which closes when the process is killed.
        with theirs:
            self._executor = Processes(1, _take_tasks, work, theirs)

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
            with suppress(OSError):
                self.notes.send(None)

    def close(self) -> None:
        """End the process; a task under way is lost."""
        if self.task is not None:
            self._executor.kill()
        self._executor.shutdown()
        self.notes.close()


def _take_tasks(work: Work, notes: Connection) -> None:
    """In the process, when it begins: signals are raised during a task, and after one no further task begins."""
    global _duty
    signals = interrupts.Signals()
    signals.raising = False
    _duty = work, notes, signals
    signals.hear()


_duty: tuple[Work, Connection, interrupts.Signals]


def _do(task: int) -> Any:
    """In the process: the value of a task."""
    work, notes, signals = _duty

    def tell(note: Any) -> None:
        # An interrupt must not leave a report half written.
        before, signals.raising = signals.raising, False
        notes.send(note)
        signals.raising = before

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
