"""The files of a report: their names, and a line of the index of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mechdesign.ground.errors import OutputError, printable_lines
from mechdesign.ground.records import remove_recorded

REPORT = "report.html"
PRINTED = "report.pdf"
INDEX = "index.html"
SECTION = "report.json"  # what a page says of a result


@dataclass(frozen=True)
class IndexEntry:
    """A study in an index."""

    name: str
    label: str
    answers: Sequence[tuple[str, str, int]] = ()  # command, outcome in words and exit code
    met: int = 0
    required: int = 0
    warnings: int = 0
    numbers: Sequence[Mapping[str, str]] = ()  # some of its key numbers, see `Headline`
    drawing: str = ""  # an image as a data URI
    link: str = ""  # to its report; empty where there is none
    failed: str = ""  # why there is none
    outcome: str = ""  # the same in a word or two

    @property
    def verdict(self) -> tuple[int, str]:
        """Its place among all verdicts, and the verdict in a word or two."""
        wrong = next((word for _, word, code in self.answers if code > 1), self.outcome)
        if any(code == 1 for _, _, code in self.answers):
            return 0, "NOT MET"
        if wrong:
            return 1, wrong
        return (2, "met") if self.required else (3, "nothing required")


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
