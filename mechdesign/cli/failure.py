"""Exceptions as lines on stderr and exit codes; nobody sees a traceback."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

INTERRUPTED = 130


def explain(error: Exception) -> tuple[int, str]:
    """Exit code and message of an exception; what nobody foresaw asks to be reported."""
    from mechdesign.errors import MechdesignError

    if isinstance(error, MechdesignError):
        return error.exit_code, str(error)
    if isinstance(error, MemoryError):
        return 4, "not enough memory for this; ask for fewer poses or samples at a time, or use --jobs 1"
    place = ""
    frames = [
        frame for frame in traceback.extract_tb(error.__traceback__) if "mechdesign" in Path(frame.filename).parts
    ]
    if frames:
        place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})"
    detail = " ".join(str(error).split())
    return 4, f"internal error: {type(error).__name__}: {detail}{place}; please report it, with the study"


@contextmanager
def guard() -> Iterator[None]:
    """Turn what is raised inside into a message on stderr and an exit code."""
    try:
        yield
    except KeyboardInterrupt:
        print("interrupted; what was finished is whole", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    except typer.Exit:
        raise
    except Exception as error:
        code, message = explain(error)
        print(message, file=sys.stderr)
        raise typer.Exit(code) from None
