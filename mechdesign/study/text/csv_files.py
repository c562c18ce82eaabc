"""Numbers and cells of the CSV files that a study names."""

from __future__ import annotations

import csv
import math

import numpy as np
from pydantic_core import PydanticCustomError

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import MIN_NUMBER, Context, read_number

_PLAIN = Context()


def read_table(folder: Folder, file: str, most: int = 2) -> Floats:
    """Read a CSV file of one to `most` columns of numbers, with or without a line of names.

    Raises
    ------
    StudyError
        Where it cannot be read or holds anything else.
    """
    rows: list[list[float]] = []
    for number, line in _lines(folder, file):
        try:
            row = [float(part) for part in line.replace(";", ",").split(",")]
        except ValueError:
            if rows or number > 1:
                raise StudyError(f"{file}:{number}: the line is not a row of numbers") from None
            continue
        if len(row) > most or (rows and len(row) != len(rows[0])) or not all(map(math.isfinite, row)):
            columns = "one or two" if most == 2 else f"one to {most}"
            raise StudyError(f"{file}:{number}: the line is not a row of the same {columns} finite numbers")
        rows.append([_sized(value, f"{file}:{number}") for value in row])
    if not rows:
        raise StudyError(f"{file} holds no numbers")
    return np.array(rows)


def read_column(folder: Folder, file: str, name: str | None) -> Floats:
    """Read the numbers of a CSV file's column of this name, or of a file with one number a line.

    Raises
    ------
    StudyError
        Where the file cannot be read, there is no such column, or it holds anything but finite numbers.
    """
    rows = read_cells(folder, file)
    first, place = rows[0][1], 0
    if name is not None and name not in first:
        raise StudyError(f"{file} has no column {name!r} among the {len(first)} of its first line")
    if name is not None:
        place = first.index(name)
    elif len(first) > 1:
        raise StudyError(f"{file} has {len(first)} columns: say by 'column' which one, by its name in the first line")
    values = []
    for number, row in rows:
        value = _number(row[place]) if place < len(row) <= len(first) else None
        if value is not None and math.isfinite(value):
            values.append(_sized(value, f"{file}:{number}"))
        elif row is not first or (name is None and value is not None):
            of_column = f" of column {name!r}" if name is not None else ""
            hint = "; a decimal is written with a point" if any("," in cell for cell in row) else ""
            raise StudyError(f"{file}:{number}: the line has no finite number{of_column}{hint}")
    return np.array(values)


def read_cells(folder: Folder, file: str) -> list[tuple[int, list[str]]]:
    """Read the cells of a CSV file, line by line with its number; commas, semicolons or tabs stand between them.

    Raises
    ------
    StudyError
        Where it cannot be read, or is empty.
    """
    lines = _lines(folder, file)
    if not lines:
        raise StudyError(f"{file} holds no numbers")
    separator = next((mark for mark in (";", "\t") if mark in lines[0][1]), ",")
    try:
        return [
            (number, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]) for number, line in lines
        ]
    except csv.Error as error:
        raise StudyError(f"{file} is no CSV file: {error}") from None


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _sized(value: float, line: str) -> float:
    """A finite number of a line, as large as a study may have one; one that is smaller is 0: its inverse may overflow.

    Raises
    ------
    StudyError
        If it is too large.
    """
    try:
        number = float(read_number(value, _PLAIN))
    except PydanticCustomError as error:
        raise StudyError(f"{line}: {error.message()}") from None
    return number if abs(number) >= MIN_NUMBER else 0.0


def _lines(folder: Folder, file: str) -> list[tuple[int, str]]:
    """Lines of a file with their numbers, without empty ones and comments; raises as `Folder.text`."""
    lines = [line.strip() for line in folder.text(file).splitlines()]
    return [(number, line) for number, line in enumerate(lines, start=1) if line and not line.startswith("#")]
