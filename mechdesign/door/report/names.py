"""Names of the files that a command may write into the folder of its results, as patterns."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

from mechdesign.commands import COMMANDS, QUESTIONS
from mechdesign.questions.columns import tables_of

MECHANISM = "mechanism"
ANIMATION = "motion.gif"


def names(command: str, formats: str = "", *, animate: bool = False) -> Iterator[str]:
    """Patterns of the names of a command's tables and studies, and of its pictures in these formats.

    Pictures are declared by the functions that draw them: naming them imports Matplotlib.
    """
    declared = vars(import_module(QUESTIONS[command].columns))
    # A table of cases has the name of its command.
    tables = [table.name for table in tables_of(command)] if command in COMMANDS else [command]
    yield from (f"{table}.csv" for table in tables)
    yield from declared.get("STUDIES", "").split()
    if formats:
        from mechdesign.drawing.pictures import pictures

        shown = [MECHANISM, *(name for picture in pictures(command) for name in picture.names)]
        yield from (f"{name}.{kind}" for kind in formats.split(",") for name in shown)
    if animate:
        yield ANIMATION
