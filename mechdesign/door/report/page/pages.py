"""Names of the files of a report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mechdesign.ground.errors import OutputError, printable_lines
from mechdesign.ground.records import remove_recorded

REPORT = "report.html"
PRINTED = "report.pdf"
INDEX = "index.html"
SECTION = "report.json"  # what a page says of a result


def harmless(value: Any) -> Any:
    """Values for a template: texts without control characters that reverse or hide letters, HTML unchanged."""
    return printable_lines(value) if type(value) is str else value


def remove(path: Path) -> None:
    """Remove a page of an older result, printed or not; a file of that name that is not by mechdesign stays.

    Raises
    ------
    OutputError
        If it cannot be removed.
    """
    try:
        remove_recorded(path)
    except OSError as error:
        raise OutputError(f"{path}: could not be removed: {error.strerror or error}") from error
