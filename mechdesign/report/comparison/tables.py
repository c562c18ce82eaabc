"""Two tables: rows matched by their poses and keys, and the columns that moved."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.comparison.differences import Difference, Tolerance
from mechdesign.results import Column, Table

# Rounding error of zeros, as a part of the largest number of the same unit in a table.
ROUNDING = 1e-12
_MOST_COLUMNS = 6  # that name a row

Rows = NDArray[np.intp]


def compare_tables(
    old: Table, new: Table, tolerances: Mapping[str, Tolerance], coordinates: Iterable[str] = (), *, folder: str = ".",
    same_poses: bool = True,
) -> Iterator[Difference]:  # fmt: skip
    """Differences of two tables of a folder.

    Rows are the same where their keys are: the `coordinates` of the poses, then as many of the leading columns as
    tell the rows apart; numbers among them within their tolerance. Where a limit or a boundary lies is found, not
    given: of studies with the `same_poses`, rows that are left over are matched in their order where the words of
    their keys are the same and there are as many in both.
    """
    differs = partial(Difference, folder, old.name)
    for table, other in ((old, new), (new, old)):
        for column in table.columns:
            if column.name not in other:
                yield differs(column.name, "missing" if table is old else "new", unit=column.unit)
    keys = _keys(old, new, coordinates)
    widths = {name: _width(old, new, name, tolerances[name]) for name in old.names if name in new}
    first, second = _matched(old, new, keys, {name: (tolerances[name].rtol, widths[name]) for name in keys}, same_poses)
    for table, rows in ((old, first), (new, second)):
        left = np.setdiff1d(np.arange(len(table)), rows)
        if left.size:
            yield differs("", "missing" if table is old else "new", left.size, row=_words(table, keys, left[0]))
    along = old.column(keys[0]) if len(keys) == 1 else None
    if along is not None:
        along = Column(along.name, along.values[first], along.unit) if along.numeric else None
    for name in widths:
        before, after = old.column(name), new.column(name)
        if before.unit != after.unit:
            yield differs(name, "unit", old=before.unit, new=after.unit)
        if not (before.numeric and after.numeric):
            words = list(zip(_text(before.values[first]), _text(after.values[second]), strict=True))
            apart = [row for row, (a, b) in enumerate(words) if a != b]
            if apart:
                a, b = words[apart[0]]
                yield differs(name, "moved", len(apart), old=a, new=b, row=_words(old, keys, first[apart[0]]))
            continue
        x, y = before.values[first].astype(float), after.values[second].astype(float)
        size, scale = _apart(x, y), np.where(np.isfinite(x), np.abs(x), 0)
        beyond = np.flatnonzero(size > widths[name] + tolerances[name].rtol * scale)
        if beyond.size:
            row = beyond[np.argmax(size[beyond])]
            with np.errstate(divide="ignore", invalid="ignore"):
                relative = float(size[row] / (scale[row] if np.isfinite(x[row]) else 1))
            yield differs(name, "moved", beyond.size, float(size[row]), relative, f"{x[row]:.12g}", f"{y[row]:.12g}",
                          _words(old, keys, first[row]), before.unit, (x, y), along)  # fmt: skip


def _apart(old: Floats, new: Floats) -> Floats:
    """Absolute differences: 0 where both are nan or the same infinity, inf where only one of them is."""
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
        for other in table.columns:
            if other.numeric and (other.name == name or (column.unit and other.unit == column.unit)):
                values = np.abs(other.values.astype(float))
                scale = max(scale, float(values[np.isfinite(values)].max(initial=0.0)))
    return ROUNDING * scale


def _text(values: NDArray[Any]) -> list[str]:
    return [str(value) for value in values.tolist()]


def _words(table: Table, keys: Sequence[str], row: int) -> str:
    """A row in words."""
    parts = []
    for name in keys[:_MOST_COLUMNS]:
        column = table.column(name)
        parts.append(f"{name} {column.values[row]:.6g}" if column.numeric else f"{name} {column.values[row]}")
    return ", ".join(parts)


def _keys(old: Table, new: Table, coordinates: Iterable[str]) -> tuple[str, ...]:
    """Columns that identify the rows of both tables: given coordinates, then as few leading columns as needed."""
    named = set(coordinates)
    names = sorted((name for name in old.names if name in new), key=lambda name: name not in named)
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
    # Result columns between them, such as values at the nodes of rays, are not needed.
    for name in [name for name in keys if name not in named and old.column(name).numeric]:
        if apart([key for key in keys if key != name]):
            keys = [key for key in keys if key != name]
    return tuple(keys)


def _matched(
    old: Table, new: Table, keys: Sequence[str], tolerances: Mapping[str, tuple[float, float]], same_poses: bool
) -> tuple[Rows, Rows]:
    """Rows of both tables that are the same, in the order of the old."""
    # Equal rows are matched in their order.
    rows_by_key = {key: row for row, key in enumerate(_numbered(_texts(old, keys)))}
    pairs = [(rows_by_key[key], row) for row, key in enumerate(_numbered(_texts(new, keys))) if key in rows_by_key]
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
    matched = np.array(sorted(pairs), dtype=np.intp).reshape(-1, 2)
    return matched[:, 0], matched[:, 1]


def _texts(table: Table, names: Sequence[str]) -> Iterable[tuple[str, ...]]:
    """Rows of some columns as words; a column whose numbers are all whole reads as integers, but is one of floats."""
    values = [table[name].astype(float) if table[name].dtype.kind in "iub" else table[name] for name in names]
    return zip(*map(_text, values), strict=True) if values else [()] * len(table)


def _numbered(keys: Iterable[tuple[str, ...]]) -> Iterator[tuple[tuple[str, ...], int]]:
    counts: Counter[tuple[str, ...]] = Counter()
    for key in keys:
        yield key, counts[key]
        counts[key] += 1


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
        largest = max(np.abs(value[np.isfinite(value)]).max(initial=0.0) for value in values)
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
