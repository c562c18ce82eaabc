"""How each method is drawn, the same in every picture, and what its rows of a table are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mechdesign.numerics.arrays import Flags
from mechdesign.report.figures import style
from mechdesign.results import Table
from mechdesign.study.methods import METHODS


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
