"""Types of arrays, and records of several arrays of the same length."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.intp]
Flags = NDArray[np.bool_]


def firsts(values: NDArray[Any]) -> tuple[NDArray[Any], Ints]:
    """The different values in their order, and the index of the first of each.

    As `numpy.unique`, which imports `numpy.ma` and so costs each command as much as a motion.
    """
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.ones(len(values), dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return ordered[first], order[first]


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """The different values in their order."""
    return firsts(values)[0]


def evenly(count: int, most: int) -> Ints:
    """At most `most` indices below `count`, evenly spaced from the first to the last."""
    return distinct(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


@dataclass(frozen=True, eq=False)
class Lanes:
    """A record of arrays whose last axes are of the same length."""

    def take(self, index: Ints | Flags) -> Self:
        """The record with the lanes `index` of every array."""
        return type(self)(*(values[..., index] for values in vars(self).values()))

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """One record with the lanes of several, one after the other."""
        return cls(*(np.concatenate(group, axis=-1) for group in zip(*(vars(p).values() for p in parts), strict=True)))
