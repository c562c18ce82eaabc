"""Tables of results and their columns, as entries: each is declared in `columns.py` beside what makes it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from mechdesign.commands import COMMANDS, SENSITIVITIES, SWEEP
from mechdesign.door.reference.entries import Entry
from mechdesign.experiments import columns
from mechdesign.ground.columns import PLACE, ColumnKind
from mechdesign.ground.indices import REGIONAL, STATISTICS
from mechdesign.ground.results import TableKind
from mechdesign.questions.columns import tables_of


@cache
def tables() -> tuple[tuple[str, TableKind], ...]:
    """All tables with the command that writes each, a command's together."""
    cases = (("run", columns.SUMMARY), (SWEEP.name, columns.SWEEP), (SENSITIVITIES.name, columns.SENSITIVITIES))
    return (*((name, table) for name in COMMANDS for table in tables_of(name)), *cases)


def entries() -> Iterator[Entry]:
    """An entry for each table, and one for each column that has a name of its own, with the tables that have it."""
    where: dict[tuple[str, ColumnKind], list[str]] = {}
    for command, table in tables():
        words = tuple((kind.name, kind.meaning) for kind in table.kinds)
        yield Entry(f"{table.name}.csv", "table", f"{table.meaning}; mechdesign {command} writes it", words=words)
        for kind in table.kinds:
            for name in kind.names:
                where.setdefault((name, kind), []).append(f"{table.name}.csv")
    for (name, kind), files in where.items():
        word = PLACE.sub("*", name)
        # Results of a workspace have entries of their own.
        if word.strip("*") and word not in REGIONAL and word.removeprefix("*_") not in STATISTICS:
            takes = name if word != name else ""
            unit, formula = kind.unit.replace("_", " "), kind.formula
            yield Entry(word, "column", kind.meaning, takes, unit=unit, formula=formula,
                        where=tuple(dict.fromkeys(files)))  # fmt: skip
