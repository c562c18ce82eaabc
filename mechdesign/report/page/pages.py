"""The files of reports, and how they are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mechdesign.errors import OutputError, printable_lines
from mechdesign.files import marked

HELP_PAGE = "howto/report"

REPORT = "report.html"
INDEX = "index.html"
SECTION = "report.json"  # what a page says of a result
# By this a file is known as one of these pages.
GENERATOR = '<meta name="generator" content="mechdesign">'


def harmless(value: Any) -> Any:
    """What a template is given, texts without what turns or hides the letters beside it; HTML as it is."""
    return printable_lines(value) if type(value) is str else value


def remove(path: Path) -> None:
    """Remove a page of an older result; a file of that name that is not by mechdesign stays.

    Raises
    ------
    OutputError
        If it cannot be removed.
    """
    if marked(path, GENERATOR.encode()):
        try:
            path.unlink()
        except OSError as error:
            raise OutputError(f"{path}: could not be removed: {error.strerror or error}") from error
