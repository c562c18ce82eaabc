"""Designs of experiments: the cases of a matrix, each made when it is needed."""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import StudyError
from mechdesign.experiments.schema.matrix import GRID, Values
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study import Study
from mechdesign.study.text.document import in_yaml
from mechdesign.study.text.units import QUANTITY
from mechdesign.study.variants import Changes, faults, is_judged

_DECIMAL = re.compile(r"-?[0-9.]+(e[-+]?[0-9]+)?")
# Cases among which those with a value are looked for, and those that are tried where the value alone is wrong.
_MOST_SEARCHED, _MOST_TRIED = 10_000, 16


class Design(Sequence[Changes]):
    """The cases of a matrix in their order; each gives every varied entry (`names`) a value."""

    names: tuple[str, ...]
    labels: Sequence[str] = ()  # of the cases; empty where they have none
    written: Mapping[str, Callable[[Any], Any]] = {}  # entries with quantities that are judged: a value as written

    @abstractmethod
    def value(self, k: int, place: int) -> Any:
        """The value of an entry in case `k`."""

    @abstractmethod
    def distinct(self, place: int) -> Iterable[Any]:
        """The values of an entry over all cases, each at least once."""

    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        """The values of an entry in the first `count` cases, as the array that `convert` makes of them."""
        return convert([self.value(k, place) for k in range(count)])

    @overload
    def __getitem__(self, k: int) -> Changes: ...
    @overload
    def __getitem__(self, k: slice) -> list[Changes]: ...
    def __getitem__(self, k: int | slice) -> Changes | list[Changes]:
        if isinstance(k, slice):
            return [self[case] for case in range(*k.indices(len(self)))]
        if not 0 <= k < len(self):
            raise IndexError(k)
        return tuple(
            (name, self.written.get(name, lambda value: value)(self.value(k, place)))
            for place, name in enumerate(self.names)
        )


@dataclass(frozen=True, eq=False)
class Grid(Design):
    """Every combination of values, the last entry fastest."""

    names: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    written: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)

    def __len__(self) -> int:
        return math.prod(map(len, self.values))

    def value(self, k: int, place: int) -> Any:
        return self.values[place][self._index(k, place)]

    def distinct(self, place: int) -> Iterable[Any]:
        return self.values[place]

    def column(self, place: int, count: int, convert: Callable[[Sequence[Any]], NDArray[Any]]) -> NDArray[Any]:
        index: Ints = self._index(np.arange(count), place)
        return convert(self.values[place])[index]

    def _index(self, k: Any, place: int) -> Any:
        """Which of the entry's values case `k` has, a number or an array of them."""
        return k // math.prod(map(len, self.values[place + 1 :])) % len(self.values[place])


@dataclass(frozen=True, eq=False)
class SpreadDesign(Design):
    """Values at points of the unit cube, shape (cases, entries)."""

    names: tuple[str, ...]
    values: tuple[Values, ...]
    cube: Floats
    written: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.cube)

    def value(self, k: int, place: int) -> Any:
        return self.values[place].at(float(self.cube[k, place]))

    def distinct(self, place: int) -> Iterable[Any]:
        values = self.values[place]
        return values.values if values.values is not None else (values.from_, values.to)


@dataclass(frozen=True, eq=False)
class Listed(Design):
    """The rows of a file."""

    names: tuple[str, ...]
    rows: Sequence[tuple[Any, ...]]
    labels: Sequence[str] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def value(self, k: int, place: int) -> Any:
        return self.rows[k][place]

    def distinct(self, place: int) -> Iterable[Any]:
        return (row[place] for row in self.rows)


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
    else:
        written = {name: partial(_as_written, study, name) for name in matrix.vary if is_judged(name)}
        if matrix.method == GRID:
            design = Grid(tuple(matrix.vary), tuple(values.on_grid() for values in matrix.vary.values()), written)
        else:
            assert matrix.samples is not None
            cube = _cube(matrix.method, len(matrix.vary), matrix.samples, study.seed)
            design = SpreadDesign(tuple(matrix.vary), tuple(matrix.vary.values()), cube, written)
    keys = ("matrix", "vary") if matrix.vary is not None else ("matrix", "cases")
    problems = [
        study.problem(f"{name}={in_yaml(value)}: {message}", *keys, *([name] if matrix.vary is not None else []))
        for name, value in tried(study, design)
        for message in _wrong(study, design, name, value)
    ]
    if problems:
        raise StudyError(problems)
    return design


def _as_written(study: Study, name: str, value: Any) -> Any:
    """A value of an entry that is judged, as a quantity where it is written as one, since columns have own units."""
    varied = study.resolved["matrix"]["vary"][name]
    for part in _parts(varied):
        if isinstance(part, str) and QUANTITY.fullmatch(part) and isinstance(value, int | float):
            if not isinstance(varied, list):
                return study.units.as_written(value, part)
            if study.units.convert(part) == value:
                return part
    return value


def tried(study: Study, design: Design) -> Iterator[tuple[str, Any]]:
    """Entries with each word or structure that one takes in some case, and one quantity of each unit as written."""
    for place, name in enumerate(design.names):
        written = study.resolved["matrix"]["vary"][name] if not isinstance(design, Listed) else ()
        values = [*design.distinct(place), *_parts(written)]
        words = [value for value in values if isinstance(value, bool) or not _DECIMAL.fullmatch(str(value))]
        units = {(QUANTITY.fullmatch(str(value)) or {"unit": in_yaml(value)})["unit"]: value for value in words}
        yield from ((name, value) for value in units.values())


def _wrong(study: Study, design: Design, name: str, value: Any) -> list[str]:
    """Why an entry cannot have a value: neither with the others as they are, nor as the first cases have them."""
    messages = [*faults(study, [(name, value)], name)]
    place = design.names.index(name)
    same = (design[k] for k in range(min(len(design), _MOST_SEARCHED)) if design.value(k, place) == value)
    right = messages and any(not [*faults(study, case, name)] for case in islice(same, _MOST_TRIED))
    return [] if right else messages


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
    # The sequence is even over powers of two: the next larger one is drawn, and its first points are used.
    sobol = qmc.Sobol(dimensions, scramble=True, rng=random)
    return np.asarray(sobol.random_base2((samples - 1).bit_length()))[:samples]
