"""Exceptions as lines on stderr and exit codes; nobody sees a traceback."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from mechdesign.errors import explain

INTERRUPTED = 130


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
