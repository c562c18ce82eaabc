"""Two folders of results: the CSV tables that both have, row by row and column by column, within a tolerance.

Tables of drawn samples are left out: other random numbers are other rows.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.commands import COMMANDS, QUESTIONS
from mechdesign.door.report import manifest
from mechdesign.door.report.tables import from_csv
from mechdesign.ground.columns import VARIED, Column
from mechdesign.ground.errors import StudyError, counted
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.ground.terms import command_of
from mechdesign.study.text.document import leaves

DRAWN = ("histogram.csv", "samples.csv")
# Rounding error of zeros, as a part of the largest number of the same unit in a table.
ROUNDING = 1e-12
_DIGITS = 9  # of numbers by which rows are told apart
_MOST_COLUMNS = 6  # that name a row
_MOST_ENTRIES = 4  # of the study, that a note names

# What is otherwise; of `bytes` a file that is to be the same again.
Change = Literal["moved", "missing", "new", "unit", "bytes", "stale", "not met"]


class Allowance(NamedTuple):
    """A number is as it was within ``atol + rtol * |old|``."""

    rtol: float
    atol: float | None = None  # None: `ROUNDING` of the largest number of its unit in the table


@dataclass(frozen=True)
class Difference:
    """A difference in a column, a table or a folder."""

    folder: str
    table: str  # empty where it is the whole folder
    column: str  # empty where it is the whole table, or rows of it
    change: Change
    rows: int = 0  # how many
    largest: float = math.nan  # absolute difference; inf between a number and none; nan of words
    relative: float = math.nan  # that difference over the old value
    old: str = ""  # where it is largest
    new: str = ""
    row: str = ""  # its pose or key
    unit: str = ""

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.folder, ".".join(filter(None, (self.table, self.column)))) if part)
        at = f" at {self.row}" if self.row else ""
        if self.change in ("missing", "new"):
            whole = "column" if self.column else "table" if self.table else "result"
            noun = counted(self.rows, "row") if self.rows else whole
            return f"{place}: {noun} {self.change}{f', the first{at}' if at else ''}"
        if self.change in ("stale", "not met"):
            return f"{place}: {self.change}{': ' * bool(self.new)}{self.new}"
        size = "" if math.isnan(self.largest) else f" by {self.largest:.3g} {self.unit}".rstrip()
        size += "" if math.isnan(self.relative) else f" (relative {self.relative:.2g})"
        rows = f" ({self.rows} rows)" if self.rows > 1 else ""
        return f"{place}: {self.change}{size}{at}: {self.old} -> {self.new}{rows}"


_COLUMNS: dict[str, tuple[str, type]] = {
    "folder": ("of the result, below those compared", str),
    "table": ("its table; empty where it is the whole result", str),
    "column": ("its column; empty where it is the whole table or rows of it", str),
    "change": (
        "moved, missing, new; unit: another one; bytes: of a file; not met: a requirement; stale: of a question that "
        "the study of the results beside it does not ask",
        str,
    ),
    "rows": ("how many rows", int),
    "largest": ("largest absolute difference, in `unit`; inf between a number and nan; nan of words", float),
    "relative": ("that difference over the old value of the same row", float),
    "old": ("old value where the absolute difference is largest", str),
    "new": ("new value there", str),
    "row": ("pose or key of that row, or of the first that is missing or new", str),
    "unit": ("unit of the column", str),
}


@dataclass
class Comparison:
    """All differences of two folders of results; `compared` counts the tables and columns that both have."""

    differences: list[Difference] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    compared: Counter[str] = field(default_factory=Counter)
    cases: list[tuple[str, str]] = field(default_factory=list)  # folder and table of each that was compared

    @property
    def table(self) -> Table:
        """The differences as a table."""
        columns = (
            Column(name, np.array([getattr(difference, name) for difference in self.differences], kind), meaning=words)
            for name, (words, kind) in _COLUMNS.items()
        )
        return Table("differences", tuple(columns), "what moved, is missing or is new")

    def add(
        self, folder: str, old: tuple[Path, Mapping[str, Any]], new: tuple[Path, Mapping[str, Any]],
        tolerance: Allowance, *, illegible: bool = False,
    ) -> None:  # fmt: skip
        """Add the differences of two results of a command, folder and manifest each.

        Raises
        ------
        StudyError
            If a table cannot be read, unless `illegible` ones are left to who compares their bytes.
        """
        before, after = old[1]["tables"], new[1]["tables"]
        for name in dict.fromkeys((*before, *after)):
            table = name.removesuffix(".csv")
            if name not in before or name not in after:
                self.differences.append(Difference(folder, table, "", "missing" if name in before else "new"))
                continue
            if name in DRAWN and not illegible:
                continue
            try:
                pair = _read_table(*old, name), _read_table(*new, name)
            except StudyError:
                if illegible:
                    continue
                raise
            self.compared.update(tables=1, columns=len(pair[0].names))
            self.cases.append((folder, table))
            self.differences += compare_tables(*pair, tolerance, folder)


def compare(old: Path, new: Path, tolerance: Allowance) -> Comparison:
    """Compare two folders of results, of one command or of many, whose folders are matched by their paths.

    Raises
    ------
    StudyError
        If they have no result in common, or what a folder holds is not what mechdesign writes.
    """
    before, after = results(old), results(new)
    # A manifest stands for its folder.
    old, new = (path.parent if path.name == manifest.NAME else path for path in (old, new))
    both = [folder for folder in before if folder in after]
    if not both:
        there = [f"{root} has {', '.join(folders) or 'none'}" for root, folders in ((old, before), (new, after))]
        raise StudyError(f"nothing to compare: no result stands in both folders; {'; '.join(there)}")
    comparison, noted = Comparison(), defaultdict[str, list[str]](list)
    for folder in sorted(before.keys() | after.keys()):
        if folder not in both:
            comparison.differences.append(Difference(folder, "", "", "missing" if folder in before else "new"))
            continue
        for note in notes(before[folder], after[folder]):
            noted[note].append(folder)
        comparison.add(folder, (old / folder, before[folder]), (new / folder, after[folder]), tolerance)
    comparison.differences += stale(after)
    comparison.notes += [
        note if len(folders) == len(both) else f"{', '.join(folders)}: {note}" for note, folders in noted.items()
    ]
    return comparison


def results(root: Path, taker: str = "compare") -> dict[str, dict[str, Any]]:
    """Manifests in and below a folder by the relative paths of their folders, ``.`` for the folder itself.

    Of a manifest, itself alone.

    Raises
    ------
    StudyError
        If there is no such folder, or a manifest cannot be read.
    """
    if root.name == manifest.NAME and root.is_file():
        return {".": results(root.parent)["."]}
    if not root.is_dir():
        if root.exists():
            raise StudyError(f"{root}: is no folder: {taker} takes folders of results")
        raise StudyError(f"{root}: there is no such folder of results")
    folders = [path.parent for path in sorted(root.rglob(manifest.NAME))]
    return {folder.relative_to(root).as_posix(): manifest.whole(folder) for folder in folders}


def stale(contents: Mapping[str, Mapping[str, Any]]) -> Iterator[Difference]:
    """Results in folders named by their commands, of questions that another text of their study beside them lacks."""
    for folder, content in contents.items():
        command, study = content["command"], content["study"]
        for other, beside in contents.items():
            same = beside["study"]["name"] == study["name"] and Path(other).parent == Path(folder).parent
            if not (same and Path(folder).name == command and Path(other).name == beside["command"]):
                continue
            if beside["study"]["sha256"] != study["sha256"] and not _asks(beside["study"]["resolved"], command):
                yield Difference(folder, "", "", "stale", new=f"the study of {other} does not ask it")
                break


def _asks(resolved: Mapping[str, Any], command: str) -> bool:
    """Whether a study asks a question, by a section or a requirement."""
    required = resolved.get("requirements") or []
    judged = {command_of(str(entry.get("result"))) for entry in required if isinstance(entry, dict)}
    given = {name for name, question in QUESTIONS.items() if resolved.get(question.section or name) is not None}
    return command in judged | given or (command == "kinematics" and not (judged | given) & COMMANDS.keys())


def notes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Differences in what two results were computed from: versions, inputs, overrides, seed, study."""
    for key in ("tool", "libraries", "inputs"):
        before, after = old.get(key) or {}, new.get(key) or {}
        for name in dict.fromkeys((*before, *after)):
            if before.get(name) != after.get(name):
                words = f"input {name}: another file" if key == "inputs" else None
                yield words or f"{key} {name}: {before.get(name, 'none')} -> {after.get(name, 'none')}"
    for key in ("overrides", "seed"):
        if old.get(key) != new.get(key):
            yield f"{key}: {old.get(key)} -> {new.get(key)}"
    entries = [
        {".".join(map(str, keys)): value for keys, value in leaves(content["study"].get("resolved") or {})}
        for content in (old, new)
    ]
    changed = [name for name in entries[0] | entries[1] if entries[0].get(name) != entries[1].get(name)]
    if changed:
        changes = [f"{name} {entries[0].get(name)} -> {entries[1].get(name)}" for name in changed[:_MOST_ENTRIES]]
        yield f"study: {', '.join(changes)}{', ...' * (len(changed) > _MOST_ENTRIES)}"


def _read_table(directory: Path, content: Mapping[str, Any], name: str) -> Table:
    about = content["tables"][name]
    try:
        text = (directory / name).read_text(encoding="utf-8")
        return from_csv(text, name.removesuffix(".csv"), about["columns"])
    except OSError as error:
        raise StudyError(f"{directory / name}: cannot be read: {error.strerror or error}") from None
    except (ValueError, TypeError, KeyError):
        message = f"{directory / name}: is not the table that its manifest describes; run the study again"
        raise StudyError(message) from None


def compare_tables(old: Table, new: Table, tolerance: Allowance, folder: str = ".") -> Iterator[Difference]:
    """Differences of two tables of a folder.

    Rows are the same where their keys are: what varies in a sweep, else as many of the leading columns as tell the rows
    apart. Rows that are left over are matched in the order of their keys, where the words of these are the same and
    there are as many in both.
    """
    differs = partial(Difference, folder, old.name)
    for table, other in ((old, new), (new, old)):
        for column in table.columns:
            if column.name not in other:
                yield differs(column.name, "missing" if table is old else "new", unit=column.unit)
    keys = _keys(old, new)
    first, second = _matched(old, new, keys)
    for table, rows in ((old, first), (new, second)):
        left = np.setdiff1d(np.arange(len(table)), rows)
        if left.size:
            yield differs("", "missing" if table is old else "new", left.size, row=_words(table, keys, left[0]))
    for name in (name for name in old.names if name in new):
        before, after = old.column(name), new.column(name)
        if before.unit != after.unit:
            yield differs(name, "unit", old=before.unit, new=after.unit)
        if not (before.numeric and after.numeric):
            words = list(zip(_text(before.values[first]), _text(after.values[second]), strict=True))
            others = [row for row, (a, b) in enumerate(words) if a != b]
            if others:
                a, b = words[others[0]]
                yield differs(name, "moved", len(others), old=a, new=b, row=_words(old, keys, first[others[0]]))
            continue
        x, y = before.values[first].astype(float), after.values[second].astype(float)
        size, scale = _distance(x, y), np.where(np.isfinite(x), np.abs(x), 0)
        atol = _rounding(old, new, before) if tolerance.atol is None else tolerance.atol
        beyond = np.flatnonzero(size > atol + tolerance.rtol * scale)
        if beyond.size:
            row = beyond[np.argmax(size[beyond])]
            relative = float(size[row] / (scale[row] if np.isfinite(x[row]) else 1))
            yield differs(name, "moved", beyond.size, float(size[row]), relative, f"{x[row]:.12g}", f"{y[row]:.12g}",
                          _words(old, keys, first[row]), before.unit)  # fmt: skip


def _distance(old: Floats, new: Floats) -> Floats:
    """Absolute differences: 0 where both are nan or the same infinity, inf where only one of them is."""
    size = np.abs(new - old)
    same: Flags = (old == new) | (np.isnan(old) & np.isnan(new))
    return np.where(same, 0.0, np.where(np.isfinite(size), size, np.inf))


def _rounding(old: Table, new: Table, column: Column) -> float:
    """What rounding leaves of zero in a column, by the largest number of its unit."""
    values = [
        np.abs(other.values.astype(float))
        for table in (old, new)
        for other in table.columns
        if other.numeric and (other.name == column.name or (column.unit and other.unit == column.unit))
    ]
    return ROUNDING * max(float(value[np.isfinite(value)].max(initial=0.0)) for value in values)


def _text(values: NDArray[Any]) -> list[str]:
    return [str(value) for value in values.tolist()]


def _words(table: Table, keys: Sequence[str], row: int) -> str:
    """A row in words."""
    parts = []
    for name in keys[:_MOST_COLUMNS]:
        column = table.column(name)
        parts.append(f"{name} {column.values[row]:.6g}" if column.numeric else f"{name} {column.values[row]}")
    return ", ".join(parts)


def _keys(old: Table, new: Table) -> list[str]:
    """The fewest leading columns that tell the rows of each table apart; those that vary in a sweep come first."""
    names = sorted((name for name in old.names if name in new), key=lambda name: old.column(name).meaning != VARIED)
    needed = 0
    for table in (old, new):
        groups, count = np.zeros(len(table), dtype=np.intp), 0
        while count < len(names) and groups.max(initial=0) + 1 < len(table):
            code = np.unique(table[names[count]], return_inverse=True)[1]
            groups = np.unique(groups * len(table) + code, return_inverse=True)[1]
            count += 1
        needed = max(needed, count)
    return names[:needed]


def _matched(old: Table, new: Table, keys: Sequence[str]) -> tuple[Ints, Ints]:
    """Rows of both tables that are the same, in the order of the old."""
    numbers = [name for name in keys if old.column(name).numeric and new.column(name).numeric]
    words = [name for name in keys if name not in numbers]
    named = [_numbered(_texts(table, [*words, *numbers])) for table in (old, new)]
    pairs = [(named[0][key], row) for key, row in named[1].items() if key in named[0]]
    left: dict[Any, tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
    for side, (table, rows) in enumerate(zip((old, new), named, strict=True)):
        taken, texts = {pair[side] for pair in pairs}, _texts(table, words)
        order = np.lexsort([table[name] for name in reversed(numbers)]) if numbers else np.arange(len(rows))
        for row in order.tolist():
            if row not in taken:
                left[texts[row]][side].append(row)
    for before, after in left.values():
        pairs += zip(before, after, strict=True) if len(before) == len(after) else ()
    matched = np.array(sorted(pairs), dtype=np.intp).reshape(-1, 2)
    return matched[:, 0], matched[:, 1]


def _texts(table: Table, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Rows of some columns as words, numbers to some digits."""
    values = [[f"{value:.{_DIGITS}g}" for value in table[name].astype(float).tolist()]
              if table.column(name).numeric else _text(table[name]) for name in names]  # fmt: skip
    return list(zip(*values, strict=True)) if values else [()] * len(table)


def _numbered(keys: Sequence[tuple[str, ...]]) -> dict[tuple[tuple[str, ...], int], int]:
    """Rows by their keys; equal ones by their number as well."""
    counts: Counter[tuple[str, ...]] = Counter()
    rows = {}
    for row, key in enumerate(keys):
        rows[key, counts[key]] = row
        counts[key] += 1
    return rows
