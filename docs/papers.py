"""The four papers that mechdesign began with: their references, and their printed numbers beside those in results/."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

ROOT = Path(__file__).parents[1]
DATA = Path(__file__).parent / "papers.yaml"
OPENING = """# The four papers

mechdesign began with four papers; the code and these pages call them S1 to S4. Here are their references
as far as they are known, and the numbers that they print beside ours. Ours are read from `results/` when the site is
built, and rounded as the paper's numbers are. Where a printed digit is another one, a letter leads to the reason.
"""


def rows_of(file: str, where: dict[str, Any]) -> list[dict[str, str]]:
    """The rows of a table in results/ whose columns have these values."""
    with (ROOT / "results" / file).open(encoding="utf-8", newline="") as lines:
        return [row for row in csv.DictReader(lines) if all(_same(row[key], value) for key, value in where.items())]


def _same(text: str, value: float | str) -> bool:
    return text == value if isinstance(value, str) else float(text) == value


def ours(table: dict[str, Any], row: dict[str, Any], name: str) -> float:
    """Our number for a column of a printed row."""
    column = table["columns"][name]
    file = column.get("file") or row.get("file") or table["file"]
    found = rows_of(table.get("folder", "") + file, row["where"] | column.get("where", {}))
    if "percent" in column:
        analytic, simulated = (
            np.array([float(each["sigma"]) for each in found if each["method"] == method])
            for method in ("analytic", "monte_carlo")
        )
        return float(getattr(np, column["percent"])(100 * np.abs(analytic / simulated - 1)))
    (only,) = found
    return float(only[column.get("column", name)])


def agrees(number: float, printed: str) -> bool:
    """Whether a number is the printed one to its last digit; `<` prints a bound, `-` nothing."""
    if printed == "-":
        return True
    if printed.startswith("<"):
        return number < float(printed[1:])
    return abs(number - float(printed)) <= 0.5 * 10.0 ** -_decimals(printed) * (1 + 1e-9)


def _decimals(printed: str) -> int:
    return len(printed.partition(".")[2])


def _noted(table: dict[str, Any], row: str, column: str, number: float, printed: str) -> int:
    """The note about a number that is not the printed one.

    Raises
    ------
    ValueError
        If there is none.
    """
    for place, note in enumerate(table.get("notes", ())):
        near = abs(number - float(printed)) <= note.get("within", math.inf) * abs(float(printed))
        if row in note.get("rows", [row]) and column in note.get("columns", [column]) and near:
            return place
    message = f"{table['title']}: {column} of {row} is {number:.6g} in results/ and {printed} in the paper: why?"
    raise ValueError(message)


def section(table: dict[str, Any]) -> str:
    """A printed table with our numbers below each row, and why some differ.

    Raises
    ------
    ValueError
        If a number differs without a note, or a note is about none.
    """
    columns, texts = table["columns"], [note["text"] for note in table.get("notes", ())]
    told = [row["printed"].split() for row in table["rows"] if "printed" in row]
    decimals = [max(map(_decimals, column)) for column in zip(*told, strict=True)]
    letters: dict[str, str] = {}
    used, lines = set(), []
    for row in table["rows"]:
        numbers = [ours(table, row, name) for name in columns]
        if "printed" not in row:
            lines.append([row["name"], "ours", *(f"{number:.10g}" for number in numbers)])
            continue
        printed, shown = row["printed"].split(), []
        for name, number, text, digits in zip(columns, numbers, printed, decimals, strict=True):
            shown.append(f"{number:.{digits or 2}f}")
            if not agrees(number, text):
                note = _noted(table, row["name"], name, number, text)
                used.add(note)
                letter = letters.setdefault(texts[note], chr(ord("a") + len(letters)))
                shown[-1] += f"{{sup}}`{letter}`"
        lines += [[row["name"], "printed", *printed], ["", "ours", *shown]]
    if idle := [text for place, text in enumerate(texts) if place not in used]:
        raise ValueError(f"{table['title']}: these notes are about no number: {idle}")
    head = [table["label"], "", *(name.replace("_", r"\_") if "$" not in name else name for name in columns)]
    parts = [f"### {table['title']}", "\n".join(_line(line) for line in [head, ["---"] * len(head), *lines])]
    parts += [f"{{sup}}`{letter}` {text}" for text, letter in letters.items()]
    return "\n\n".join(parts)


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def pages() -> dict[str, str]:
    """The text of the page, by its path in the folder of the site."""
    parts = [OPENING.rstrip()]
    for paper in yaml.safe_load(DATA.read_text(encoding="utf-8")).values():
        parts += [f"## {paper['title']}", paper["reference"], paper["text"].rstrip()]
        parts += [section(table) for table in paper["tables"]]
        parts.append("Checked by\n" + "\n".join(f"- `{name}`" for name in paper["tests"]))
    return {"theory/papers.md": "\n\n".join(parts) + "\n"}
