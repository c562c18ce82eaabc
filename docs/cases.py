"""Cases of the verification manual: a study, a question, and numbers that do not come from mechdesign.

Those are printed ones, closed forms, or numbers of a solver of its own in tests/helpers. They are declared in
tests/reference/cases, a source or a subject a file; tests/reference/test_cases.py carries them out, and verification.py
makes pages of them.
"""

from __future__ import annotations

import csv
import importlib
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from gallery import CONFIGS, ROOT, results
from numpy.typing import NDArray

import mechdesign

FOLDER = ROOT / "tests" / "reference" / "cases"
# What a case is compared with, in words.
EVIDENCE = {
    "printed": "numbers that a paper, a book, a standard or a program prints",
    "closed form": "formulas on the case's page, evaluated by NumPy",
    "second solver": "a computation of another kind: finite elements, SciPy's integrations, circles that meet",
    "brute force": "every candidate looked at, or many starts",
}
CLOSED = 1e-9  # closed forms agree to this part of the largest number, where a case says nothing else
# What all cases of a file may share.
SHARED = ("source", "question", "evidence", "helper", "recorded", "night")
# What a check compares with.
TOLD = {"printed", "expected", "at_most"}
# The rest of its keys says of what, and how closely.
OTHERS = ("of", "name", "set", "table", "at", "where", "row", "within", "rel", "size", "between", "misprint", "reads",
          "notes")  # fmt: skip
Array = NDArray[Any]
_NUMBER = re.compile(r"-?\d+(?:\.(\d+))?(?:[eE]([+-]?\d+))?")


@dataclass(frozen=True)
class Row:
    """A number of a case beside ours."""

    label: str
    unit: str
    expected: Any
    ours: Any
    printed: str = ""
    count: int = 1  #: of rows of a table that were compared, of which this differs most
    scale: float = 1.0  #: of which the difference is a part
    agrees: bool = False
    named: bool = False  #: by words, not by its expression
    note: str = ""  #: why the printed number is another one
    right: str = ""  #: what should be printed
    bound: str = ""  #: the interval or limit that ours lies within

    @property
    def difference(self) -> float:
        """Its size."""
        return float(abs(self.ours - self.expected))

    @property
    def part(self) -> float:
        """The difference as a part of the largest number compared, of a misprint from what is right; 0 of intervals."""
        right = float(self.right) if self.right else self.expected
        return 0.0 if self.bound else float(abs(self.ours - right)) / (self.scale or 1.0)


def half_unit(printed: str) -> float:
    """Half a unit of the last printed digit, and rounding.

    Raises
    ------
    ValueError
        If it is no number.
    """
    match = _NUMBER.fullmatch(printed)
    if match is None:
        raise ValueError(f"{printed!r} is no printed number")
    return 0.5 * 10.0 ** (int(match[2] or 0) - len(match[1] or "")) * (1 + 1e-9)


class Names(dict[str, Any]):
    """What expressions of a case may use: definitions, columns, parameters, helpers, and NumPy's functions."""

    def __init__(self, definitions: Mapping[str, Any], columns: Mapping[str, Array], *others: Mapping[str, Any]):
        super().__init__()
        self.definitions, self.columns = definitions, columns
        built = {"column": columns.__getitem__, "point": lambda at: columns[f"{at}.x"] + 1j * columns[f"{at}.y"]}
        self.others = (columns, built, *others, vars(np))
        dotted = sorted((name for name in columns if "." in name), key=len, reverse=True)
        self.dotted = re.compile(rf"(?<![\w.'])({'|'.join(map(re.escape, dotted)) or '(?!)'})(?![\w.]|\()")

    def value(self, expression: Any) -> Any:
        """Of an expression of Python, in which names of columns have their dots; numbers are themselves."""
        if not isinstance(expression, str):
            return expression
        source = self.dotted.sub(lambda name: f"column({name[0]!r})", expression)
        return eval(compile(source.strip(), "case", "eval"), self)

    def __missing__(self, name: str) -> Any:
        if name in self.definitions:
            self[name] = self.value(self.definitions[name])
            return self[name]
        for names in self.others:
            if name in names:
                return names[name]
        # Python looks among its own names, and says if it is none.
        raise KeyError(name)


class Columns(dict[str, Array]):
    """The columns of a table by their names, with the labels of their units."""

    units: Mapping[str, str] = {}

    @classmethod
    def read(cls, path: Path) -> Columns:
        """From a CSV file of results/."""
        with path.open(encoding="utf-8", newline="") as lines:
            head, *rows = csv.reader(lines)
        columns = zip(*rows, strict=True) if rows else [()] * len(head)
        return cls({name: _column(values) for name, values in zip(head, columns, strict=True)})

    def chosen(self, check: Mapping[str, Any]) -> Columns:
        """The rows in which columns have the values `at`, or for which `where` is true, or one by its number.

        Raises
        ------
        ValueError
            If there is none.
        """
        keep = np.ones(len(next(iter(self.values()))), dtype=bool)
        for name, value in check.get("at", {}).items():
            keep &= self[name] == value if isinstance(value, str) else np.abs(self[name] - value) < CLOSED
        if "where" in check:
            keep &= np.asarray(Names({}, self).value(check["where"]), dtype=bool)
        rows = np.flatnonzero(keep)[[check["row"]] if "row" in check else slice(None)]
        if not len(rows):
            raise ValueError(f"no row of {dict(check)}")
        chosen = Columns({name: values[rows] for name, values in self.items()})
        chosen.units = self.units
        return chosen


def _column(texts: Sequence[str]) -> Array:
    try:
        return np.array([float(text) for text in texts])
    except ValueError:
        return np.array(texts)


@dataclass(frozen=True)
class Case:
    """A study, what is asked of it, and numbers from elsewhere."""

    name: str
    title: str
    text: str
    source: str
    question: str
    study: str  #: its text, or its place in configs/ without `.yaml`
    checks: Sequence[Mapping[str, Any]]
    evidence: str
    values: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    vary: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    helper: str = ""
    recorded: bool = False  #: the site shows the tables of results/; the test runs it, and compares them too
    night: bool = False  #: tested at night only

    @property
    def shipped(self) -> Path | None:
        """The file of a shipped study."""
        return None if "\n" in self.study else CONFIGS / f"{self.study}.yaml"

    def variants(self) -> Iterator[dict[str, Any]]:
        """What is set besides, one study after another."""
        for values in zip(*self.vary.values(), strict=True) if self.vary else [()]:
            yield dict(zip(self.vary, values, strict=True))

    def rows(self, *, recorded: bool = False) -> Iterator[Row]:
        """Every number beside ours: of a run, or where the case has them of the tables in results/."""
        helpers = [vars(importlib.import_module(f"helpers.{name}")) for name in (self.helper, "gallery") if name]
        for variant in self.variants():
            given = {name.rpartition(".")[2]: value for name, value in variant.items()}
            for check in self.checks:
                settings = {**self.settings, **variant, **check.get("set", {})}
                tables = self.tables(settings, recorded=recorded and self.recorded)
                others = [{"tables": tables}, parameters(self.study, settings), *helpers]
                label = "".join(f", {name} = {value}" for name, value in given.items())
                try:
                    table = tables[check.get("table", next(iter(tables)))]
                    names = Names({**given, **self.values}, table.chosen(check), *others)
                    row = _compared(check, names, table.units, label)
                except Exception as error:
                    error.add_note(f"case {self.name}, {dict(check)}; columns of the tables:")
                    for name, table in tables.items():
                        error.add_note(f"  {name}: {', '.join(table)}")
                    raise
                yield row

    def tables(self, settings: Mapping[str, Any], *, recorded: bool) -> dict[str, Columns]:
        """The tables of the answer."""
        if recorded:
            assert self.shipped is not None
            folder = results(self.shipped) / self.question
            return {path.stem: Columns.read(path) for path in sorted(folder.glob("*.csv"))}
        return answer(self.study, tuple(f"{name}={setting(value)}" for name, value in settings.items()), self.question)


def setting(value: Any) -> str:
    """A value as `--set` takes it."""
    text = yaml.safe_dump(value, default_flow_style=True, width=10**6).removesuffix("...\n").strip()
    return text.replace("'", '"') if isinstance(value, dict | list) else text


@lru_cache(maxsize=16)
def answer(study: str, overrides: tuple[str, ...], question: str) -> dict[str, Columns]:
    """The tables of a question by their names, the main one first."""
    source = {"text": study} if "\n" in study else {"source": CONFIGS / f"{study}.yaml"}
    tables = {}
    for name, table in getattr(mechdesign, question)(mechdesign.load(**source, overrides=overrides)).tables.items():
        tables[name] = Columns({column.name: np.asarray(column.values) for column in table.columns})
        tables[name].units = {column.name: column.unit for column in table.columns}
    return tables


def parameters(study: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a study that are numbers."""
    begin = "mechanism.parameters."
    given = {name.removeprefix(begin): value for name, value in settings.items() if name.startswith(begin)}
    every = {**_declared(study), **given}
    return {name: value for name, value in every.items() if isinstance(value, int | float)}


@cache
def _declared(study: str) -> dict[str, Any]:
    text = study if "\n" in study else (CONFIGS / f"{study}.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text).get("mechanism", {}).get("parameters", {}))


def _compared(check: Mapping[str, Any], names: Names, units: Mapping[str, str], variant: str) -> Row:
    """A check carried out, with the row that differs most."""
    ours = np.atleast_1d(names.value(check["of"]))
    printed, note, bound = check.get("printed", ""), check.get("misprint", ""), ""
    given = check.get("expected", check.get("at_most", float(printed or "nan")))
    expected = np.broadcast_to(names.value(given), ours.shape)
    scale = float(names.value(check["size"]) if "size" in check else np.abs(expected).max())
    if "between" in check:
        low, high = (np.broadcast_to(names.value(end), ours.shape) for end in check["between"])
        good = (low <= expected) & (expected <= high)
        worst = int(np.argmin(good))
        bound = f"{shown(expected[worst])} in {low[worst]:.6g} to {high[worst]:.6g}"
    elif "at_most" in check:
        good, worst = ours <= expected, int(np.argmax(ours - expected))
        bound = f"at most {shown(expected[worst])}"
    else:
        gaps = np.abs(ours - expected)
        good, worst = gaps <= _allowed(check, names, scale), int(np.argmax(np.where(np.isnan(gaps), np.inf, gaps)))
        if not good.all():
            near = [entry["text"] for entry in check.get("notes", ()) if gaps.max() <= entry["within"] * scale]
            note, good = note or "".join(near[:1]), good | bool(near)
    agrees, right = bool(good.all()), ""
    if "misprint" in check:
        # Ours is what is right, and the printed number is not.
        agrees &= not abs(ours[worst] - float(printed)) <= half_unit(printed)
        right = check.get("reads", shown(expected[worst]))
        expected = np.full(ours.shape, float(printed))
    return Row(_label(check) + variant, units.get(check["of"], ""), expected[worst], ours[worst], printed, len(ours),
               scale, agrees, "name" in check, note, right, bound)  # fmt: skip


def _allowed(check: Mapping[str, Any], names: Names, scale: float) -> Any:
    """How far a number may be from the expected one: half a printed unit, where the case says nothing else."""
    if "within" in check:
        return names.value(check["within"])
    if check.get("printed") and "expected" not in check:
        return half_unit(check["printed"])
    return names.value(check.get("rel", CLOSED)) * scale


def _label(check: Mapping[str, Any]) -> str:
    """What a number is."""
    if "name" in check:
        return str(check["name"])
    at = check.get("at", {}).items()
    where = (f" of {value}" if isinstance(value, str) else f" at {name} = {value:g}" for name, value in at)
    return str(check["of"]) + "".join(where) + (f", row {check['row']}" if "row" in check else "")


def shown(value: Any) -> str:
    """A number in as many digits as say something."""
    if np.iscomplexobj(value):
        return f"{value.real:.10g} {'-' if value.imag < 0 else '+'} {abs(value.imag):.10g}i"
    return f"{float(value) + 0.0:.12g}"


@cache
def cases() -> dict[str, Case]:
    """All cases by their names, source by source.

    Raises
    ------
    ValueError
        If two have the same name.
    """
    if (tests := str(ROOT / "tests")) not in sys.path:
        sys.path.insert(0, tests)
    every: dict[str, Case] = {}
    for path in sorted(FOLDER.glob("*.yaml")):
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        for name, given in data["cases"].items():
            if name in every:
                raise ValueError(f"{path.name}: there are two cases {name}")
            case = {key: data[key] for key in SHARED if key in data} | given
            try:
                every[name] = _case(name, case, data.get("studies", {}))
            except Exception as error:
                error.add_note(f"case {name} in {path.name}")
                raise
    return every


def _case(name: str, case: dict[str, Any], studies: Mapping[str, str]) -> Case:
    if "rows" in case:
        case["checks"] = list(_matrix(*(case.pop(key, ()) for key in ("table", "columns", "rows", "notes"))))
    page = case.pop("page", "")
    case["source"] = case["source"].strip() + (f", {page}" if page else "")
    case["study"] = studies.get(case["study"], case["study"])
    case["settings"] = case.pop("set", {})
    for check in case["checks"]:
        if unknown := check.keys() - TOLD - {*OTHERS}:
            every = ", ".join((*OTHERS, *sorted(TOLD)))
            raise ValueError(f"a check has no {', '.join(sorted(unknown))}; it takes {every}")
        if not check.keys() & TOLD:
            raise ValueError(f"{check} compares with nothing: it needs one of {', '.join(sorted(TOLD))}")
    printed = any("printed" in check for check in case["checks"])
    return Case(name=name, **{"evidence": "printed" if printed else "closed form", **case})


def _matrix(table: str, columns: Any, rows: Sequence[Any], notes: Sequence[Any]) -> Iterator[dict[str, Any]]:
    """The checks of a table that is printed as rows with a number a column; `<` prints a bound, `-` nothing.

    A row `reads` otherwise where numbers of it are misprints.
    """
    every = columns if isinstance(columns, dict) else {name: {"of": name} for name in columns}
    for row in rows:
        prints = zip(row["printed"].split(), row.get("reads", row["printed"]).split(), strict=True)
        for (label, column), (printed, reads) in zip(every.items(), prints, strict=True):
            at = {**row.get("at", {}), **column.get("at", {})}
            check = {"table": table, "name": f"{label}, {row['name']}", **column, "at": at, "set": row.get("set", {})}
            if printed.startswith("<"):
                yield {**check, "at_most": float(printed[1:])}
            elif printed != "-":
                about = [note for note in notes if row["name"] in note.get("rows", [row["name"]])
                         and label in note.get("columns", [label])]  # fmt: skip
                check |= {"printed": printed, "notes": about}
                if reads != printed:
                    check |= {"expected": float(reads), "within": half_unit(reads), "reads": reads}
                    check["misprint"] = row["misprint"]
                yield check
