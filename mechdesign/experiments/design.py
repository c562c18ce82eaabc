"""Designs of experiments: which cases a matrix asks for, made one by one when they are needed."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import StudyError
from mechdesign.experiments.cases import Case
from mechdesign.numerics.arrays import Floats
from mechdesign.study import Study
from mechdesign.study.schema.matrix import GRID, Values
from mechdesign.study.text.document import in_yaml
from mechdesign.study.text.units import QUANTITY
from mechdesign.study.variants import faults


class Design(Sequence[Case]):
    """The cases of a matrix in their order."""

    names: tuple[str, ...]

    @abstractmethod
    def row(self, k: int) -> tuple[Any, ...]:
        """The values of a case."""

    @abstractmethod
    def distinct(self, place: int) -> Iterable[Any]:
        """The values that an entry takes, each at least once."""

    @abstractmethod
    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        """What an entry is in the first cases, as an array that `convert` makes of values."""

    @overload
    def __getitem__(self, k: int) -> Case: ...
    @overload
    def __getitem__(self, k: slice) -> list[Case]: ...
    def __getitem__(self, k: int | slice) -> Case | list[Case]:
        if isinstance(k, slice):
            return [self[each] for each in range(*k.indices(len(self)))]
        if not 0 <= k < len(self):
            raise IndexError(k)
        return Case(tuple(zip(self.names, self.row(k), strict=True)))


@dataclass(frozen=True, eq=False)
class Grid(Design):
    """Every combination of values, the last entry fastest."""

    names: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]

    def __len__(self) -> int:
        return math.prod(map(len, self.values))

    def row(self, k: int) -> tuple[Any, ...]:
        found = []
        for values in reversed(self.values):
            k, place = divmod(k, len(values))
            found.append(values[place])
        return tuple(reversed(found))

    def distinct(self, place: int) -> Iterable[Any]:
        return self.values[place]

    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        each = math.prod(map(len, self.values[place + 1 :]))
        return convert(self.values[place])[np.arange(count) // each % len(self.values[place])]


@dataclass(frozen=True, eq=False)
class Spread(Design):
    """Values at points of the unit cube, shape (cases, entries)."""

    vary: Mapping[str, Values]
    cube: Floats

    @property
    def names(self) -> tuple[str, ...]:  # type: ignore[override]
        """The entries that vary."""
        return tuple(self.vary)

    def __len__(self) -> int:
        return len(self.cube)

    def row(self, k: int) -> tuple[Any, ...]:
        return tuple(values.at(share) for values, share in zip(self.vary.values(), self.cube[k].tolist(), strict=True))

    def distinct(self, place: int) -> Iterable[Any]:
        values = [*self.vary.values()][place]
        return values.values if values.values is not None else (values.from_, values.to)

    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        values = [*self.vary.values()][place]
        return convert([values.at(share) for share in self.cube[:count, place].tolist()])


@dataclass(frozen=True, eq=False)
class Listed(Design):
    """The rows of a file."""

    names: tuple[str, ...]
    rows: Sequence[tuple[Any, ...]]

    def __len__(self) -> int:
        return len(self.rows)

    def row(self, k: int) -> tuple[Any, ...]:
        return self.rows[k]

    def distinct(self, place: int) -> Iterable[Any]:
        return (row[place] for row in self.rows)

    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        return convert([row[place] for row in self.rows[:count]])


def cases_of(study: Study) -> Design:
    """The cases of a study's matrix, in the order of the grid (the last entry fastest), the sequence or the file.

    Raises
    ------
    StudyError
        If a value makes no study by itself: a word that its entry does not know.
    """
    matrix = study.matrix
    assert matrix is not None
    design: Design
    if matrix.vary is None:
        design = Listed(*matrix.table(study.folder))
    elif matrix.method == GRID:
        design = Grid(tuple(matrix.vary), tuple(values.on_grid() for values in matrix.vary.values()))
    else:
        assert matrix.samples is not None
        design = Spread(matrix.vary, _cube(matrix.method, len(matrix.vary), matrix.samples, study.seed))
    for place, name in enumerate(design.names):
        # Quantities as they are written, for their units must fit.
        written = study.resolved["matrix"]["vary"][name] if matrix.vary is not None else ()
        _try(study, name, [*design.distinct(place), *_parts(written)])
    return design


def _parts(written: Any) -> Iterable[Any]:
    """The numbers and texts that values of an entry are written with."""
    if isinstance(written, str):
        return [part.strip() for part in written.split(":")]
    return written.values() if isinstance(written, dict) else written


def _cube(method: str, dimensions: int, samples: int, seed: int) -> Floats:
    """Points of the unit cube, shape (samples, dimensions).

    [McKay, Beckman & Conover, A comparison of three methods for selecting values of input variables, 1979; Sobol', On
    the distribution of points in a cube, 1967, scrambled as by Matousek, The L2-discrepancy for anchored boxes, 1998]
    """
    from scipy.stats import qmc

    random = np.random.default_rng(seed)
    if method == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=random).random(samples))
    # Any number of points may be drawn of a power of two.
    sobol = qmc.Sobol(dimensions, scramble=True, rng=random)
    return np.asarray(sobol.random_base2((samples - 1).bit_length()))[:samples]


def _try(study: Study, name: str, values: Sequence[Any]) -> None:
    """Load the study with each word or structure that an entry takes in some case, alone.

    Raises
    ------
    StudyError
        Where the entry itself is wrong then; what is wrong only together with others is found in its case.
    """
    words = [value for value in values if not isinstance(value, int | float) or isinstance(value, bool)]
    # Of quantities one of each unit.
    tried = [*{(QUANTITY.fullmatch(str(value)) or {"unit": in_yaml(value)})["unit"]: value for value in words}.values()]
    keys = ("matrix", "vary", name) if study.matrix and study.matrix.vary is not None else ("matrix", "cases")
    problems = [
        study.problem(f"{name}={in_yaml(tried[k])}: {message}", *keys) for k, message in faults(study, name, tried)
    ]  # fmt: skip
    if problems:
        raise StudyError(problems)
