"""Names of the files that a command may write into the folder of its results, as patterns."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib import import_module

from mechdesign.commands import COMMANDS, QUESTIONS
from mechdesign.files import FORMATS
from mechdesign.indices import INDEX_NAMES
from mechdesign.questions.columns import tables_of

MECHANISM = "mechanism"
ANIMATION = "motion.gif"


def names(command: str, formats: str = "", *, animate: bool = False) -> Iterator[str]:
    """Patterns of the names of a command's tables and studies, and of its pictures in these formats."""
    declared = vars(import_module(QUESTIONS[command].columns))
    pictures = _pictures(command)
    # A table of cases has the name of its command.
    tables = [table.name for table in tables_of(command)] if command in COMMANDS else [command]
    yield from (f"{table}.csv" for table in tables)
    yield from declared.get("STUDIES", "").split()
    yield from (f"{name}.{kind}" for kind in formats.split(",") for name in pictures)
    if animate:
        yield ANIMATION


def most_telling(command: str, files: Collection[str]) -> str:
    """Of the files of a result the picture that is best looked at first; empty where there is none."""
    names = (f"{name}.{kind}" for name in _pictures(command) for kind in FORMATS)
    return next((name for name in names if name in files), "")


def _pictures(command: str) -> tuple[str, ...]:
    """Names of a command's pictures, the most telling first."""
    declared = import_module(QUESTIONS[command].columns).PICTURES
    pictures = declared if command in COMMANDS else declared[command]
    return (*pictures.split(), *(INDEX_NAMES if command == "workspace" else ()), MECHANISM)
