"""The process of a command: its exit code, and output streams whose errors do not end it. Imports nothing heavy."""

from __future__ import annotations

import codecs
import gc
import io
import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable
from typing import Any, TextIO

from mechdesign.ground.numerals import plain_letters, plain_powers
from mechdesign.ground.work.interrupts import Signals

_NOT_WRITTEN = 4  # exit code where results could not be written
_LACKING = "mechdesign.plain"  # how letters are written that a stream lacks
_BY_SIGNAL = 128  # exit code of a process that a signal ended, less the signal's number


def run(command: Callable[[], Any]) -> None:
    """Call a command and exit with its code; a signal's is 128 and its number, that of a table that was lost 4.

    Not in a library's process: signals and streams become the command's.
    """
    if not sys.warnoptions:
        # Libraries warn of what their callers do, with lines of their code; users get the warnings of their study.
        warnings.simplefilter("ignore")
    # Plugins of pydantic, which it would look for in every package that is installed, concern no study.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    output = _open_streams()
    # What it says of its cache and its fonts concerns no study.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
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
    # Of an interrupt in a text that it evaluates, such as those of dataclasses, Python ends by the signal whatever the
    # exit code says, unless it evaluates another one.
    exec("")
    sys.exit(code)


def settle() -> None:
    """Look for garbage from here on, but not among what the command imported (see `mechdesign.__main__`)."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()


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
    codecs.register_error(_LACKING, plain_letters)
    whole = getattr(old, "buffer", None)
    if isinstance(old, io.TextIOWrapper) and not isinstance(getattr(whole, "raw", whole), io.FileIO):
        # The console of Windows takes letters, not the bytes of a file.
        old.reconfigure(errors=_LACKING)
        return old
    buffer = io.BufferedWriter(raw)
    at_once = raw.fileno() == 2 or buffer.isatty()
    kind = io.TextIOWrapper if codecs.lookup(encoding).name.startswith("utf") else _PlainPowers
    # Lines end as in the files, whatever the system.
    return kind(buffer, encoding, errors=_LACKING, newline="\n", line_buffering=at_once)


class _PlainPowers(io.TextIOWrapper):
    """A stream of a code page, which lacks raised digits or has some of them: a power of ten is written with none."""

    def write(self, text: str) -> int:
        super().write(plain_powers(text))
        return len(text)
