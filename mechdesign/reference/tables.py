"""Tables of results and their columns: what `tables.yaml` declares of them, as entries."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import yaml

from mechdesign.indices import REGIONAL, STATISTICS
from mechdesign.reference.entries import Entry

_PLACE = re.compile(r"<([^>]*)>")


@dataclass(frozen=True)
class ColumnText:
    """What is said of a column; ``<names>`` in its name and its meaning stand for those of a study.

    Parameters
    ----------
    unit : str
        A kind of quantity, several with ``or``, or, after ``as``, what has its unit; empty: it has none.
    """

    name: str
    meaning: str
    unit: str = ""
    formula: str = ""

    def says(self, name: str, meaning: str) -> bool:
        """Whether a column of a manifest is this one, with this meaning."""
        for own in self.name.split(", "):
            if found := re.fullmatch(_pattern(own), name):
                told = _PLACE.sub(lambda place: found.groupdict().get(_group(place[1]), place[0]), self.meaning)
                if re.fullmatch(_pattern(told), meaning):
                    return True
        return False


@dataclass(frozen=True)
class TableText:
    """What is said of a table."""

    name: str
    command: str
    meaning: str
    columns: tuple[ColumnText, ...]

    def says(self, meaning: str) -> bool:
        """Whether a table of a manifest with the same name is this one."""
        return re.fullmatch(_pattern(self.meaning), meaning) is not None


def _group(name: str) -> str:
    return re.sub(r"\W", "_", name)


def _pattern(text: str) -> str:
    """The regular expression of a text with ``<names>``."""
    seen: set[str] = set()
    parts = _PLACE.split(text)
    for k in range(1, len(parts), 2):
        group = _group(parts[k])
        parts[k] = f"(?P={group})" if group in seen else f"(?P<{group}>.+)"
        seen.add(group)
    return "".join(part if k % 2 else re.escape(part) for k, part in enumerate(parts))


@cache
def tables() -> tuple[TableText, ...]:
    """All tables, a command's together."""
    told = yaml.safe_load(files(__package__).joinpath("tables.yaml").read_text(encoding="utf-8"))
    return tuple(
        TableText(each["table"], each["command"], each["meaning"], tuple(ColumnText(*row) for row in each["columns"]))
        for each in told
    )


def entries() -> Iterator[Entry]:
    """An entry for each table, and one for each column that has a name of its own, with the tables that have it."""
    where: dict[tuple[str, ColumnText], list[str]] = {}
    for table in tables():
        columns = tuple((column.name, column.meaning) for column in table.columns)
        yield Entry(table.name, "table", f"{table.meaning}; mechdesign {table.command} writes it", words=columns)
        for column in table.columns:
            for name in column.name.split(", "):
                where.setdefault((name, column), []).append(table.name)
    for (name, column), found in where.items():
        word = _PLACE.sub("*", name)
        # Numbers of a workspace are results that have entries of their own.
        if word.strip("*") and word not in REGIONAL and word.removeprefix("*_") not in STATISTICS:
            takes = name if word != name else ""
            unit, formula = column.unit.replace("_", " "), column.formula
            yield Entry(word, "column", column.meaning, takes, unit=unit, formula=formula,
                        where=tuple(dict.fromkeys(found)))  # fmt: skip
