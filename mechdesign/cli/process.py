"""The process of a command: its signals, and streams that cannot fail it. Imports nothing heavy."""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, TextIO

# Of interrupts, on systems that have them.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_NOT_WRITTEN = 4  # exit code where results could not be written
_BY_SIGNAL = 128  # exit code of a process that a signal ended, less the signal's number
# Files of Python's that hold locks for an instant, and functions of `threading` that wait without.
_LOCKING = tuple(part.replace("/", os.sep) for part in ("/threading.py", "/queue.py", "/concurrent/futures/"))
_WAITS = ("wait", "_wait_for_tstate_lock")
# A text that Python evaluates. An interrupt inside would end the process by SIGINT at its exit, even if it is handled.
_EVALUATED = ("<string>", "<module>")
_RETRY = 0.02  # seconds until an interrupt that came amiss is tried again


def run(command: Callable[[], Any]) -> None:
    """Call a command and exit with its code; a signal's is 128 and its number, that of a table that was lost 4.

    Not in a library's process: signals and streams become the command's.
    """
    output = _open_streams()
    signals = Signals()
    code: Any = 0
    try:
        try:
            signals.hear()
            command()
        finally:
            signals.ignore()
    except KeyboardInterrupt:
        signals.ignore()
        print("interrupted", file=sys.stderr)
        code = _BY_SIGNAL + signal.SIGINT
    except SystemExit as end:
        code = end.code
    if signals.number is not None and (code or signals.number != signal.SIGINT):
        code = _BY_SIGNAL + signals.number
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    if output.lost and (code is None or isinstance(code, int)):
        code = max(code or 0, _NOT_WRITTEN)
    sys.exit(code)


class Signals:
    """Interrupts, terminations and hang-ups are all a KeyboardInterrupt, at the first place that is fit for one.

    Inside an import or a finaliser it would be lost or become another error, inside `eval` kept for the process's
    end, and what blocks signals is not to be disturbed though another thread lets them in; one that is lost in a
    library is tried again. A signal that was ignored from the start (``nohup``) stays so. The second Ctrl-C
    interrupts again; the second of the others is that of ``timeout``, which sends it to the process and to its
    group.
    """

    def __init__(self) -> None:
        self.number: int | None = None  # of the signal that came first
        self._catcher = sys._getframe(1)  # who made this, and catches what is raised
        self._heard = [each for each in SIGNALS if signal.getsignal(each) is not signal.SIG_IGN]
        for each in self._heard:
            signal.signal(each, self._hear)
        if hasattr(signal, "SIGALRM"):
            signal.signal(signal.SIGALRM, self._interrupt)
            sys.unraisablehook = self._lost
            sys.excepthook = _printed

    def hear(self) -> None:
        """Let through what has waited since the process began."""
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, self._heard)

    def ignore(self) -> None:
        """The command is done: what comes now changes nothing."""
        for each in self._heard:
            signal.signal(each, signal.SIG_IGN)
        if hasattr(signal, "SIGALRM"):
            signal.signal(signal.SIGALRM, signal.SIG_IGN)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self.number is None or number == signal.SIGINT:
            self.number = self.number or number
            self._interrupt(number, frame)

    def _lost(self, error: sys.UnraisableHookArgs) -> None:
        if isinstance(error.exc_value, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _RETRY)
        else:
            sys.__unraisablehook__(error)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if hasattr(signal, "SIGALRM") and (_blocked() or _unfit(frame, self._catcher)):
            signal.setitimer(signal.ITIMER_REAL, _RETRY)
        else:
            raise KeyboardInterrupt


def _printed(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print an error that nobody caught; Cython prints so what it drops, and an interrupt is tried again."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


def _blocked() -> bool:
    return not signal.pthread_sigmask(signal.SIG_BLOCK, ()).isdisjoint(SIGNALS)


def _unfit(frame: FrameType | None, catcher: FrameType) -> bool:
    """Whether an interrupt in a frame would be lost, kept for the end, or leave a lock of threads held for ever."""
    while frame is not None and frame is not catcher:
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        if name in _WAITS and file.endswith("threading.py"):
            return False
        if file.startswith("<frozen importlib") or name == "__del__" or (file, name) == _EVALUATED:
            return True
        if any(part in file for part in _LOCKING):
            return True
        frame = frame.f_back
    return False


class _Unfailing(io.FileIO):
    """A stream whose reader may have gone, or whose disk may be full.

    A reader that goes has read enough. Other errors of standard output are told, and what it should hold is `lost`.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number, "w", closefd=False)
        self._failed = self.lost = False

    def write(self, data: Any) -> int:
        if not self._failed:
            try:
                return super().write(data) or 0
            except OSError as error:
                self._failed = True
                if self.fileno() == 1 and not isinstance(error, BrokenPipeError):
                    self.lost = True
                    print(f"standard output is not whole: {error.strerror}", file=sys.stderr)
        return memoryview(data).nbytes


def _open_streams() -> _Unfailing:
    """Put streams that cannot fail in place of the standard ones, and give that of the output.

    A closed one leads nowhere. A name in a study must not fail either, on a terminal that lacks its letters.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Else the next file that is opened would be this stream.
            os.open(os.devnull, os.O_RDWR)
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115
    output, errors = _Unfailing(1), _Unfailing(2)
    sys.stdout, sys.stderr = _stream(output, sys.stdout), _stream(errors, sys.stderr)
    return output


def _stream(raw: _Unfailing, old: TextIO | None) -> TextIO:
    encoding = old.encoding if old is not None else "utf-8"
    buffer = io.BufferedWriter(raw)
    at_once = raw.fileno() == 2 or buffer.isatty()
    return io.TextIOWrapper(buffer, encoding, errors="replace", line_buffering=at_once)
