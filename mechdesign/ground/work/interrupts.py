"""Interrupts of a command: noted when they come, and raised where the command looks for one. Imports nothing heavy."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# Signals that interrupt, on systems that have them.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
# Whether the system rings after a while.
_ALARMS = hasattr(signal, "SIGALRM") and hasattr(signal, "setitimer")
_ALL = (*SIGNALS, signal.SIGALRM) if _ALARMS else SIGNALS
_PATIENCE = 2.0  # seconds until an interrupt is raised wherever the command is


class Signals:
    """Interrupts, terminations and hang-ups, which all become a KeyboardInterrupt.

    A signal is noted, and raised by the next `check`: between two chunks of work, and wherever progress is reported.
    Raised anywhere, it could leave a module half imported or a lock held. A stretch of 2 s without a check is
    computation, a wait for input or a loop in a library; there it is raised all the same. A signal that was ignored
    from the start (``nohup``) stays so. The second Ctrl-C interrupts again; the second of the others is that of
    ``timeout``, which sends it to the process and to its group.
    """

    def __init__(self) -> None:
        global _signals
        _signals = self
        self.number: int | None = None  # of the signal that came first
        self.raising = True  # whether an interrupt may be raised without a check
        self._pending = False
        self._handled = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        for number in self._handled:
            signal.signal(number, self._note)
        if _ALARMS:
            signal.signal(signal.SIGALRM, self._alarm)
            sys.unraisablehook = self._dropped

    def hear(self) -> None:
        """Unblock signals that have waited since the process began."""
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ALL)

    def ignore(self) -> None:
        """Ignore all signals from now on: the command is done."""
        self._pending = False
        for number in self._handled:
            signal.signal(number, signal.SIG_IGN)
        # Python removes its handlers as it ends, and an alarm would then kill it.
        if _ALARMS:
            signal.setitimer(signal.ITIMER_REAL, 0)

    def check(self) -> None:
        """Raise a noted interrupt."""
        if self._pending:
            self._pending = False
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.number is None or number == signal.SIGINT:
            self.number = self.number or number
            self._pend()

    def _pend(self) -> None:
        self._pending = True
        if _ALARMS:
            signal.setitimer(signal.ITIMER_REAL, _PATIENCE)
        elif self.raising:
            self.check()

    def _alarm(self, number: int, frame: FrameType | None) -> None:
        if self.raising:
            self.check()

    def _dropped(self, error: sys.UnraisableHookArgs) -> None:
        """Note an interrupt again that was raised in a finaliser or a callback, where Python drops it."""
        if isinstance(error.exc_value, KeyboardInterrupt):
            self._pend()
        else:
            sys.__unraisablehook__(error)


_signals: Signals | None = None


def check() -> None:
    """Raise KeyboardInterrupt if the command was interrupted; to be called where nothing is half done.

    Does nothing outside of a command, and in other threads than the main one.
    """
    if _signals is not None and threading.current_thread() is threading.main_thread():
        _signals.check()


def interrupt() -> None:
    """From a thread beside the work: let a termination come to this process, which ends a wait of its main thread."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, signal.SIGTERM)
    else:
        signal.raise_signal(signal.SIGTERM)


def leave_to_parent() -> None:
    """In a process of workers: its parent handles interrupts, and a termination ends it."""
    global _signals
    _signals = None
    for number in _ALL:
        signal.signal(number, signal.SIG_DFL if number == signal.SIGTERM else signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ALL)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Inside, signals wait where the system lets them, also in processes that begin there."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ALL)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
