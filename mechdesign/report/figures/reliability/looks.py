"""How each method is drawn, the same in every picture, and what its rows of a table are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mechdesign.analyses.reliability.first_order import ORDERS
from mechdesign.numerics.arrays import Flags
from mechdesign.report.figures import style
from mechdesign.results import Table
from mechdesign.study import Study
from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.reliability import SUFFIXES as ORDER_SUFFIXES

SUFFIXES = dict(zip(ORDERS, ORDER_SUFFIXES, strict=True))


@dataclass(frozen=True)
class Look:
    """A method's name in words, colour, marker, and dashes; what is simulated is drawn as dots, without a line."""

    words: str
    color: str
    marker: str
    dashes: Literal["-", "--", ":", "-.", ""]

    @property
    def simulated(self) -> bool:
        """Whether the method samples made mechanisms."""
        return self.dashes == ""


class _Looks(Mapping[str, Look]):
    """By the names of methods, in the order in which they are drawn: what is computed below what is sampled."""

    def __getitem__(self, name: str) -> Look:
        method = METHODS[name]
        return Look(method.words, getattr(style, method.color), method.marker, "" if method.sampled else method.dashes)

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(METHODS, key=lambda name: METHODS[name].sampled))

    def __len__(self) -> int:
        return len(METHODS)


LOOKS = _Looks()


def methods(table: Table) -> list[str]:
    """Methods of a table, in the order in which they are drawn."""
    present = set(table["method"].tolist())
    return [method for method in LOOKS if method in present]


def best_probability(table: Table) -> str:
    """The method whose probabilities stand where there is room for one only."""
    return max(methods(table), key=lambda name: METHODS[name].accuracy)


def best_moments(table: Table) -> str:
    """The method whose moments stand where there is room for one only; those that end early have fewer samples."""

    def rank(name: str) -> tuple[bool, bool, int]:
        method = METHODS[name]
        return method.errors, not method.precise, method.accuracy

    return max(methods(table), key=rank)


def select(table: Table, **chosen: str) -> Flags:
    """Rows in which columns have these values."""
    rows = np.ones(len(table), dtype=bool)
    for name, value in chosen.items():
        rows &= table[name] == value
    return rows


def channels(table: Table) -> list[tuple[str, str, str]]:
    """Output, order and unit of each quantity of a table, positions first."""
    found = dict.fromkeys(zip(table["output"].tolist(), table["order"].tolist(), table["unit"].tolist(), strict=True))
    return sorted(found, key=lambda channel: list(SUFFIXES).index(channel[1]))


def error_limits(study: Study, output: str, order: str) -> tuple[float, float] | None:
    """Lowest and highest error allowed, in study units, of a coordinate or by the circle about its point."""
    section = study.reliability
    assert section is not None
    band = section.limits.get(f"{output}{SUFFIXES[order]}")
    if band is not None:
        return (-np.inf if band.min is None else band.min, np.inf if band.max is None else band.max)
    circle = section.limits.get(f"{output.rpartition('.')[0]}{SUFFIXES[order]}")
    return None if circle is None or circle.radius is None else (-circle.radius, circle.radius)
