"""Sources of the entries: one function for each kind of word, which reads the declarations in the code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from inspect import getdoc
from itertools import chain

from mechdesign.door.reference import keys, synonyms, tables
from mechdesign.door.reference.entries import Entry
from mechdesign.ground.docstrings import quoted
from mechdesign.ground.errors import EXIT_CODES
from mechdesign.ground.functions import CONSTANTS, FUNCTIONS, meanings
from mechdesign.ground.indices import FOLDER, INDEX_NAMES, REGIONAL, STATISTICS
from mechdesign.ground.statistics import STATISTICS as WORDS
from mechdesign.ground.unit_table import listed
from mechdesign.mechanism.configuration import REASONS
from mechdesign.study.text.forms import TERMS


def terms() -> Iterator[Entry]:
    """Terms for the values of keys."""
    for word, meaning in TERMS.items():
        yield Entry(word, "what may stand", meaning)


def indices() -> Iterator[Entry]:
    """Local indices, with their formulas, units and sources."""
    for name, index in INDEX_NAMES.items():
        text = quoted(" ".join((getdoc(import_module(f"{FOLDER}.{name}")) or "").partition("\n\n")[0].split()))
        formula = f"{index.formula}: {index.meaning}" if index.formula else index.meaning
        needs = f" It needs the section {index.section}." if index.section else ""
        unit = (getdoc(index.unit) or "").partition("\n")[0].removesuffix(".")
        yield Entry(name, "local index", text + needs, unit=unit, formula=formula, source=index.source,
                    where=("workspace.indices",))  # fmt: skip


def results() -> Iterator[Entry]:
    """Numbers of a workspace: those of every one, and the statistics of the local indices."""
    where = ("optimize.maximize", "optimize.minimize", "optimize.subject_to.result")
    for name, regional in REGIONAL.items():
        yield Entry(name, "result of workspace", f"{regional.name}: {regional.meaning}", source=regional.source,
                    where=where)  # fmt: skip
    for name, meaning in STATISTICS.items():
        text = f"{meaning} of a local index over the region, after the index's name: sigma_min_{name}"
        if name == "min":
            text += "; 0 wherever the region ends at a singularity, of an index that is 0 there, as inverse_condition"
        yield Entry(f"*_{name}", "result of workspace", text, where=where)
    for name, statistic in WORDS.items():
        text = (
            f"{statistic.meaning} of a column, after its name: kinematics.C.x.{name}; along a motion between the rows"
        )
        yield Entry(name, "statistic", text, where=where)


def expressions() -> Iterator[Entry]:
    """Functions, operators and constants of expressions."""
    for name, (written, meaning) in meanings().items():
        kind = "function" if name in FUNCTIONS else "constant" if name in CONSTANTS else "operator"
        yield Entry(name, kind, meaning, takes=written if written != name else "")


def units() -> Iterator[Entry]:
    """Units of numbers in a study, and the prefixes that they may have."""
    for name, (meaning, others) in listed().items():
        kind = "prefix of units" if name.endswith("-") else "unit"
        for written in (name, *others):
            also = [spelling for spelling in (name, *others) if spelling != written]
            text = f"{meaning.strip('[]')}; also written {', '.join(also)}" if also else meaning
            yield Entry(written, kind, text, where=("units",) if meaning.startswith("[") else ())


def reasons() -> Iterator[Entry]:
    """Reasons why a pose fails, with what helps."""
    for reason, cure in REASONS.items():
        yield Entry(reason, "why a pose fails", cure)


def exit_codes() -> Iterator[Entry]:
    """Exit codes of the command."""
    for code, meaning in EXIT_CODES.items():
        yield Entry(str(code), "exit code", meaning)


# One function for each kind of word.
SOURCES: tuple[Callable[[], Iterable[Entry]], ...] = (
    keys.entries, terms, indices, results, tables.entries, expressions, units, reasons, exit_codes, synonyms.entries,
)  # fmt: skip


def entries(*more: Iterable[Entry]) -> tuple[Entry, ...]:
    """All entries, and `more` that others declare."""
    return tuple(chain(*(source() for source in SOURCES), *more))
