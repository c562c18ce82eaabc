"""Two folders of results: rows matched by their poses and keys, what moved, what is missing and what is new."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import StudyError, counted
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report import manifest
from mechdesign.report.tables import from_csv
from mechdesign.results import Column, Table
from mechdesign.study.text.document import leaves, read

# Of the largest number of a unit in a table: what rounding leaves of zero there, on one machine or another.
ROUNDING = 1e-12
# Kinds of difference.
MOVED, MISSING, NEW, UNIT, VERDICT, OUTCOME = "moved", "missing", "new", "unit", "verdict", "outcome"
_POSE_KEYS = ("poses", "sweep", "path")
# Columns that name a row, and entries of the study that a note names.
_MOST_COLUMNS = 6
_MOST_ENTRIES = 4

Rows = NDArray[np.intp]


class Tolerance(NamedTuple):
    """A number is as it was within ``atol + rtol * |old|``."""

    rtol: float
    atol: float | None = None  # None: `ROUNDING` of the largest number of its unit in the table


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of columns: of the patterns that fit ``command.table.column`` the last counts.

    A pattern may begin with the folder, ``FOLDER/reliability.*``.
    """

    default: Tolerance
    patterns: Mapping[str, Tolerance] = field(default_factory=dict)


@dataclass(frozen=True)
class Difference:
    """What is otherwise in a column, a table, a folder or a verdict."""

    folder: str
    table: str  # empty where it is the whole folder
    column: str  # empty where it is the whole table, or rows of it
    change: str  # `MOVED`, ...
    rows: int = 0  # how many
    largest: float = math.nan  # absolute difference; inf between a number and none; nan of words
    relative: float = math.nan  # largest difference over the old value, maybe of another row
    old: str = ""  # where it is largest
    new: str = ""
    row: str = ""  # its pose or key
    unit: str = ""

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.folder, ".".join(filter(None, (self.table, self.column)))) if part)
        at = f" at {self.row}" if self.row else ""
        if self.change in (MISSING, NEW):
            whole = "column" if self.column else "table" if self.table else "result"
            what = counted(self.rows, "row") if self.rows else whole
            return f"{place}: {what} {self.change}{f', the first{at}' if at else ''}"
        size = "" if math.isnan(self.largest) else f" by {self.largest:.3g} {self.unit}".rstrip()
        size += "" if math.isnan(self.relative) else f" (relative {self.relative:.2g})"
        rows = f" ({self.rows} rows)" if self.rows > 1 else ""
        return f"{place}: {self.change}{size}{at}: {self.old} -> {self.new}{rows}"


@dataclass(frozen=True, eq=False)
class Moved:
    """A column of numbers that moved, before and after, for the picture."""

    name: str
    unit: str
    old: Floats
    new: Floats
    share: float  # largest difference over the largest old value
    along: Column | None = None  # the pose, where it alone tells the rows apart


@dataclass
class Comparison:
    """Everything that two folders of results differ in; `compared` counts tables and columns of both."""

    differences: list[Difference] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)
    compared: Counter[str] = field(default_factory=Counter)
    cases: list[tuple[str, str]] = field(default_factory=list)  # folder and table of each that was compared

    @property
    def table(self) -> Table:
        """The differences as a table."""
        meanings = {
            "folder": "of the result, below those compared",
            "table": "its table; empty where it is the whole result",
            "column": "its column; empty where it is the whole table or rows of it",
            "change": "moved, missing, new; unit, verdict or outcome: another one",
            "rows": "how many rows",
            "largest": "largest absolute difference, in `unit`; inf between a number and nan; nan of words",
            "relative": "largest difference over the old value",
            "old": "old value where the absolute difference is largest",
            "new": "new value there",
            "row": "pose or key of that row, or of the first that is missing or new",
            "unit": "unit of the column",
        }
        kinds: dict[str, type] = {"rows": int, "largest": float, "relative": float}
        columns = []
        for name, meaning in meanings.items():
            values = [getattr(each, name) for each in self.differences]
            columns.append(Column(name, np.array(values, kinds.get(name, str)), meaning=meaning))
        return Table("differences", tuple(columns), "what moved, is missing or is new")


def compare(old: Path, new: Path, tolerances: Tolerances) -> Comparison:
    """Compare two folders of results, of one command or of many, whose folders are matched by their paths.

    Raises
    ------
    StudyError
        If they have no result in common, or what a folder holds is not what mechdesign writes.
    """
    before, after = results(old), results(new)
    if not before.keys() & after.keys():
        there = [f"{root} has {', '.join(found) or 'none'}" for root, found in ((old, before), (new, after))]
        raise StudyError(f"nothing to compare: no result stands in both folders; {'; '.join(there)}")
    found, noted = Comparison(), defaultdict[str, list[str]](list)
    unused = set(tolerances.patterns)
    for folder in sorted(before.keys() | after.keys()):
        if folder not in before or folder not in after:
            found.differences.append(Difference(folder, "", "", MISSING if folder in before else NEW))
            continue
        for note in notes(before[folder], after[folder]):
            noted[note].append(folder)
        pair = (old / folder, before[folder]), (new / folder, after[folder])
        unused -= compare_results(found, folder, *pair, tolerances)
    everywhere = len(before.keys() & after.keys())
    found.notes += [
        note if len(folders) == everywhere else f"{', '.join(folders)}: {note}" for note, folders in noted.items()
    ]
    found.notes += [f"tolerances: {pattern!r} fits no column that was compared" for pattern in sorted(unused)]
    found.moved.sort(key=lambda each: -each.share)
    return found


def results(root: Path) -> dict[str, dict[str, Any]]:
    """Manifests in and below a folder by the relative paths of their folders, ``.`` for the folder itself.

    Raises
    ------
    StudyError
        If there is no such folder, or a manifest cannot be read.
    """
    if not root.is_dir():
        raise StudyError(f"{root}: {'is no folder' if root.exists() else 'there is no such folder'} of results")
    found = {}
    for path in sorted(root.rglob(manifest.NAME)):
        content = manifest.read(path.parent)
        kinds = {"tables": dict, "study": dict, "requirements": list}
        if content is None or not all(isinstance(content.get(name), kind) for name, kind in kinds.items()):
            raise StudyError(f"{path}: is not a manifest that mechdesign wrote; run the study again")
        found[path.parent.relative_to(root).as_posix()] = content
    return found


def tolerances_from(path: Path, default: Tolerance) -> Tolerances:
    """Read tolerances in YAML, ``reliability.*.sigma: {rtol: 0.05}``; what a pattern leaves out is the `default`.

    Raises
    ------
    StudyError
        With the place of each mistake.
    """
    try:
        document = read(path.read_bytes(), str(path))
    except OSError as error:
        raise StudyError(f"{path}: cannot be read: {error.strerror or error}") from None
    if not isinstance(document.data, dict):
        raise StudyError([document.values[()].problem("write a tolerance a line: reliability.*.sigma: {rtol: 0.05}")])
    patterns, problems = {}, list(document.problems)
    for pattern, given in document.data.items():
        right = isinstance(given, dict) and given and given.keys() <= {"rtol", "atol"}
        if right and all(type(value) in (int, float) and 0 <= value < math.inf for value in given.values()):
            patterns[str(pattern)] = default._replace(**{name: float(value) for name, value in given.items()})
        else:
            message = "a tolerance is {rtol: 0.05}, {atol: 0.001} or both, numbers from 0 on"
            problems.append(document.values[(pattern,)].problem(message, str(pattern)))
    if problems:
        raise StudyError(problems)
    return Tolerances(default, patterns)


def _fits(pattern: str, folder: str, command: str, table: str, column: str) -> bool:
    return any(fnmatchcase(f"{where}.{table}.{column}", pattern) for where in (command, folder))


def notes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """What two results were computed from that is not the same."""
    for what in ("tool", "libraries", "inputs"):
        before, after = old.get(what) or {}, new.get(what) or {}
        for name in dict.fromkeys((*before, *after)):
            if before.get(name) != after.get(name):
                words = f"input {name}: another file" if what == "inputs" else None
                yield words or f"{what} {name}: {before.get(name, 'none')} -> {after.get(name, 'none')}"
    for what in ("overrides", "seed"):
        if old.get(what) != new.get(what):
            yield f"{what}: {old.get(what)} -> {new.get(what)}"
    entries = [
        {".".join(map(str, keys)): value for keys, value in leaves(each["study"].get("resolved") or {})}
        for each in (old, new)
    ]
    changed = [name for name in entries[0] | entries[1] if entries[0].get(name) != entries[1].get(name)]
    if changed:
        told = [f"{name} {entries[0].get(name)} -> {entries[1].get(name)}" for name in changed[:_MOST_ENTRIES]]
        yield f"study: {', '.join(told)}{', ...' * (len(changed) > _MOST_ENTRIES)}"


def compare_results(
    found: Comparison,
    folder: str,
    old: tuple[Path, Mapping[str, Any]],
    new: tuple[Path, Mapping[str, Any]],
    tolerances: Tolerances,
) -> set[str]:
    """Add to what was found how two results of a command, folders and manifests, differ; the patterns that fitted.

    Raises
    ------
    StudyError
        If a table cannot be read.
    """
    (_, before), (_, after) = old, new
    fitted: set[str] = set()
    command = str(after.get("command"))
    for name in dict.fromkeys((*before["tables"], *after["tables"])):
        table = name.removesuffix(".csv")
        if name not in before["tables"] or name not in after["tables"]:
            change = MISSING if name in before["tables"] else NEW
            found.differences.append(Difference(folder, table, "", change))
            continue
        pair = _table(*old, name), _table(*new, name)
        given = [_given(each, command) for each in (before, after)]
        chosen = {}
        for column in pair[0].names:
            fitting = [each for each in tolerances.patterns if _fits(each, folder, command, table, column)]
            fitted.update(fitting)
            chosen[column] = tolerances.patterns[fitting[-1]] if fitting else tolerances.default
        found.compared.update(tables=1, columns=len(chosen))
        found.cases.append((folder, table))
        for difference, moved in compare_tables(*pair, chosen, given[1][0], same_poses=given[0] == given[1]):
            found.differences.append(Difference(folder, table, **difference))
            if moved is not None:
                found.moved.append(moved if folder == "." else replace(moved, name=f"{folder}/{moved.name}"))
    verdicts = [{each["requirement"]: each for each in content["requirements"]} for content in (before, after)]
    for words in verdicts[0] | verdicts[1]:
        told = [_verdict(each.get(words)) for each in verdicts]
        if told[0].split(",")[0] != told[1].split(",")[0]:
            found.differences.append(Difference(folder, "", words, VERDICT, old=told[0], new=told[1]))
    ends = [str(content.get("interrupted") or content.get("failed") or "done") for content in (before, after)]
    if ends[0] != ends[1]:
        found.differences.append(Difference(folder, "", "", OUTCOME, old=ends[0], new=ends[1]))
    return fitted


def _verdict(told: Mapping[str, Any] | None) -> str:
    if told is None:
        return "not required"
    worst = told.get("worst")
    return f"{'met' if told['met'] else 'not met'}{'' if worst is None else f', worst {worst:.6g}'}"


def _table(directory: Path, content: Mapping[str, Any], name: str) -> Table:
    about = content["tables"][name]
    try:
        if Path(name).name != name:
            raise ValueError(name)
        text = (directory / name).read_text(encoding="utf-8")
        return from_csv(text, name.removesuffix(".csv"), about["columns"])
    except OSError as error:
        raise StudyError(f"{directory / name}: cannot be read: {error.strerror or error}") from None
    except (ValueError, TypeError, KeyError):
        message = f"{directory / name}: is not the table that its manifest describes; run the study again"
        raise StudyError(message) from None


def _given(content: Mapping[str, Any], command: str) -> tuple[frozenset[str], Any]:
    """Coordinates that a study gives for a command's poses, by default those of `kinematics`, and their values."""
    resolved = content["study"].get("resolved") or {}
    for section in (resolved.get(command), resolved.get("kinematics")):
        poses = {key: section[key] for key in _POSE_KEYS if section.get(key)} if isinstance(section, dict) else {}
        if not poses:
            continue
        listed = [pose for pose in poses.get("poses", ()) if isinstance(pose, dict)]
        names = {f"{point}.{axis}" for point in poses.get("path", ()) for axis in "xy"}
        return frozenset(names.union(poses.get("sweep", ()), *listed)), poses
    return frozenset(), None


def compare_tables(
    old: Table, new: Table, tolerances: Mapping[str, Tolerance], given: Iterable[str] = (), *, same_poses: bool = True
) -> Iterator[tuple[dict[str, Any], Moved | None]]:
    """Differences of two tables (fields of `Difference`), and the numbers of columns that moved.

    Rows are the same where their keys are: coordinates that are `given`, and then as many of the leading columns as
    tell the rows apart; numbers among them within their tolerance. Where a limit or a boundary lies is found, not
    given: of studies with the `same_poses`, rows that are left over are matched in their order where the words of
    their keys are the same and there are as many in both.
    """
    for name in old.names:
        if name not in new:
            yield {"column": name, "change": MISSING, "unit": old.column(name).unit}, None
    for name in new.names:
        if name not in old:
            yield {"column": name, "change": NEW, "unit": new.column(name).unit}, None
    keys = _keys(old, new, given)
    widths = {name: _width(old, new, name, tolerances[name]) for name in old.names if name in new}
    first, second = _matched(old, new, keys, {name: (tolerances[name].rtol, widths[name]) for name in keys}, same_poses)
    for table, rows, change in ((old, first, MISSING), (new, second, NEW)):
        left = np.setdiff1d(np.arange(len(table)), rows)
        if left.size:
            yield {"column": "", "change": change, "rows": left.size, "row": _words(table, keys, left[0])}, None
    along = old.column(keys[0]) if len(keys) == 1 else None
    if along is not None and along.numeric:
        along = Column(along.name, along.values[first], along.unit)
    for name in widths:
        before, after = old.column(name), new.column(name)
        if before.unit != after.unit:
            yield {"column": name, "change": UNIT, "old": before.unit, "new": after.unit}, None
        if not (before.numeric and after.numeric):
            apart = np.flatnonzero([a != b for a, b in zip(_text(before, first), _text(after, second), strict=True)])
            if apart.size:
                row = apart[0]
                told = {"old": _text(before, first)[row], "new": _text(after, second)[row]}
                place = _words(old, keys, first[row])
                yield {"column": name, "change": MOVED, "rows": apart.size, "row": place, **told}, None
            continue
        a, b = before.values[first].astype(float), after.values[second].astype(float)
        size = _apart(a, b)
        beyond = np.flatnonzero(size > widths[name] + tolerances[name].rtol * np.where(np.isfinite(a), np.abs(a), 0))
        if beyond.size:
            row = beyond[np.argmax(size[beyond])]
            with np.errstate(divide="ignore", invalid="ignore"):
                relative = float(np.max(size[beyond] / np.where(np.isfinite(a[beyond]), np.abs(a[beyond]), 1)))
            largest = np.abs(a[np.isfinite(a)]).max(initial=0.0)
            share = float(size[row] / largest) if largest else math.inf
            told = {"old": f"{a[row]:.12g}", "new": f"{b[row]:.12g}", "unit": before.unit}
            sizes = {"rows": beyond.size, "largest": float(size[row]), "relative": relative}
            yield (
                {"column": name, "change": MOVED, "row": _words(old, keys, first[row]), **told, **sizes},
                Moved(f"{old.name}: {name}", before.unit, a, b, share, along if along and along.numeric else None),
            )


def _apart(old: Floats, new: Floats) -> Floats:
    """How far numbers are apart: none where both are nan or the same infinity, infinitely where one of them is."""
    with np.errstate(invalid="ignore"):
        size = np.abs(new - old)
    same: Flags = (old == new) | (np.isnan(old) & np.isnan(new))
    return np.where(same, 0.0, np.where(np.isfinite(size), size, np.inf))


def _width(old: Table, new: Table, name: str, tolerance: Tolerance) -> float:
    """The absolute tolerance of a column."""
    column = old.column(name)
    if tolerance.atol is not None:
        return tolerance.atol
    if not column.numeric:
        return 0.0
    scale = 0.0
    for table in (old, new):
        for each in table.columns:
            if each.numeric and (each.name == name or (column.unit and each.unit == column.unit)):
                values = np.abs(each.values.astype(float))
                scale = max(scale, float(values[np.isfinite(values)].max(initial=0.0)))
    return ROUNDING * scale


def _text(column: Column, rows: Rows) -> list[str]:
    return [str(value) for value in column.values[rows].tolist()]


def _words(table: Table, keys: Sequence[str], row: int) -> str:
    """A row in words."""
    parts = []
    for name in keys[:_MOST_COLUMNS]:
        column = table.column(name)
        parts.append(f"{name} {column.values[row]:.6g}" if column.numeric else f"{name} {column.values[row]}")
    return ", ".join(parts)


def _keys(old: Table, new: Table, given: Iterable[str]) -> tuple[str, ...]:
    """Columns that tell the rows of both tables apart: given coordinates, then the leading ones, as few as do."""
    known = set(given)
    names = sorted((name for name in old.names if name in new), key=lambda name: name not in known)
    tables = [table for table in (old, new) if len(table) > 1]
    codes = [{name: np.unique(table[name], return_inverse=True)[1] for name in names} for table in tables]

    def apart(chosen: Sequence[str]) -> bool:
        for table, code in zip(tables, codes, strict=True):
            groups = np.zeros(len(table), dtype=np.intp)
            for name in chosen:
                groups = np.unique(groups * len(table) + code[name], return_inverse=True)[1]
            if groups.max() + 1 < len(table):
                return False
        return True

    keys = next((names[:count] for count in range(len(names)) if apart(names[:count])), names)
    # Of results that stand between, such as those at the nodes of rays, none is needed.
    for name in [name for name in keys if name not in known and old.column(name).numeric]:
        if apart([key for key in keys if key != name]):
            keys = [key for key in keys if key != name]
    return tuple(keys)


def _matched(
    old: Table, new: Table, keys: Sequence[str], tolerances: Mapping[str, tuple[float, float]], same_poses: bool
) -> tuple[Rows, Rows]:
    """Rows of both tables that are the same, in the order of the old."""
    # Equal rows are told apart by their order.
    known = {key: row for row, key in enumerate(_numbered(_texts(old, keys)))}
    pairs = [(known[key], row) for row, key in enumerate(_numbered(_texts(new, keys))) if key in known]
    numbers = [name for name in keys if old.column(name).numeric and new.column(name).numeric]
    words = [name for name in keys if name not in numbers]
    left: dict[Any, tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
    for side, table in enumerate((old, new)):
        taken = {pair[side] for pair in pairs}
        for row, key in enumerate(_texts(table, words)):
            if row not in taken:
                left[key][side].append(row)
    for rows in left.values():
        if numbers and all(rows):
            close = _nearest(old, new, rows, numbers, tolerances)
            pairs += close
            for side in (0, 1):
                taken = {pair[side] for pair in close}
                rows[side][:] = [row for row in rows[side] if row not in taken]
        if same_poses and len(rows[0]) == len(rows[1]):
            pairs += zip(*rows, strict=True)
    found = np.array(sorted(pairs), dtype=np.intp).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _texts(table: Table, names: Sequence[str]) -> Iterable[tuple[str, ...]]:
    columns = [_text(Column(name, _plain(table[name])), np.arange(len(table))) for name in names]
    return zip(*columns, strict=True) if columns else [()] * len(table)


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    """Numbers as floats: a column whose numbers are all whole reads as integers."""
    return values.astype(float) if values.dtype.kind in "iub" else values


def _numbered(keys: Iterable[tuple[str, ...]]) -> Iterator[tuple[tuple[str, ...], int]]:
    seen: Counter[tuple[str, ...]] = Counter()
    for key in keys:
        yield key, seen[key]
        seen[key] += 1


def _nearest(
    old: Table,
    new: Table,
    rows: tuple[list[int], list[int]],
    numbers: Sequence[str],
    tolerances: Mapping[str, tuple[float, float]],
) -> list[tuple[int, int]]:
    """Rows whose numbers are the same within their tolerance, the nearest first."""
    from scipy.spatial import cKDTree

    places: list[list[Floats]] = [[], []]
    for name in numbers:
        values = [table[name][chosen].astype(float) for table, chosen in zip((old, new), rows, strict=True)]
        rtol, atol = tolerances[name]
        largest = max(np.abs(each[np.isfinite(each)]).max(initial=0.0) for each in values)
        width = (atol + rtol * largest) or np.finfo(float).tiny ** 0.5
        for side in (0, 1):
            # Nan and infinities stand further away than numbers do from each other.
            far = {"nan": 3 * largest + 1, "posinf": 5 * largest + 2, "neginf": -5 * largest - 2}
            places[side].append(np.nan_to_num(values[side], **far) / width)
    tree = cKDTree(np.stack(places[0], axis=-1))
    distances, nearest = map(np.asarray, tree.query(np.stack(places[1], axis=-1), p=np.inf, distance_upper_bound=1.0))
    pairs: dict[int, int] = {}
    for index in np.argsort(distances, kind="stable"):
        if np.isfinite(distances[index]):
            pairs.setdefault(rows[0][nearest[index]], rows[1][index])
    return list(pairs.items())
