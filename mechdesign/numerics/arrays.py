"""Types of arrays, and records of several of the same length."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Lanes:
    """A record of arrays whose last axes are of the same length."""

    def take(self, index: Ints | Flags) -> Self:
        """Some lanes of each."""
        return type(self)(*(values[..., index] for values in vars(self).values()))

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """All lanes of several, one after the other."""
        return cls(*(np.concatenate(each, axis=-1) for each in zip(*(vars(p).values() for p in parts), strict=True)))
