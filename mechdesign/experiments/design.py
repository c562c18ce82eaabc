"""Designs of experiments: the cases of a matrix, each made when it is needed."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import Any, overload

import numpy as np
import scipy
from numpy.typing import NDArray

from mechdesign.door.report.cases import changes_in_words
from mechdesign.experiments.schema.matrix import GRID
from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.study import Study
from mechdesign.study.text.document import in_yaml
from mechdesign.study.text.units import QUANTITY
from mechdesign.study.variants import Changes, faults, is_judged

_DECIMAL = re.compile(r"-?[0-9.]+(e[-+]?[0-9]+)?")
# Cases among which those with a value are looked for, and those that are tried where the value alone is wrong.
_MOST_SEARCHED, _MOST_TRIED = 10_000, 16


@dataclass(frozen=True, eq=False)
class Design(Sequence[Changes]):
    """The cases of a matrix in their order.

    Parameters
    ----------
    columns : mapping of str to ndarray of object, shape (cases,)
        Values of the entries that vary.
    distinct : mapping of str to sequence
        Values that each entry takes, of a range its ends.
    labels : sequence of str
        Names of the cases; empty where they have none.
    written : mapping of str to callable
        Entries with quantities that are judged: a value as written.
    """

    columns: Mapping[str, NDArray[Any]]
    distinct: Mapping[str, Sequence[Any]]
    labels: Sequence[str] = ()
    written: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @overload
    def __getitem__(self, k: int) -> Changes: ...
    @overload
    def __getitem__(self, k: slice) -> list[Changes]: ...
    def __getitem__(self, k: int | slice) -> Changes | list[Changes]:
        if isinstance(k, slice):
            return [self[case] for case in range(*k.indices(len(self)))]
        case = ((name, column[k]) for name, column in self.columns.items())
        return tuple((name, self.written[name](value) if name in self.written else value) for name, value in case)

    def named(self, k: int) -> str:
        """A case in words: its number, from 1, its label, if it has one, and its values."""
        return f"case {k + 1} ({self._label(k) and f'{self._label(k)}: '}{changes_in_words(self[k])})"

    def called(self, k: int) -> str:
        """A case by its number, from 1, and its label, if it has one."""
        return f"case {k + 1} ({self._label(k)})" if self._label(k) else f"case {k + 1}"

    def _label(self, k: int) -> str:
        return self.labels[k] if self.labels else ""


def _objects(values: Sequence[Any]) -> NDArray[Any]:
    return np.fromiter(values, dtype=object, count=len(values))


def cases_of(study: Study) -> Design:
    """The cases of a study's matrix, in the order of the grid (the last entry fastest), the sequence or the file.

    Raises
    ------
    StudyError
        If a value makes no study by itself: a word that its entry does not know.
    """
    matrix = study.matrix
    assert matrix is not None
    if matrix.vary is None:
        table = matrix.table(study.folder)
        lists = dict(zip(table.names, zip(*table.rows, strict=True), strict=True))
        design = Design({name: _objects(values) for name, values in lists.items()}, lists, table.labels)
    else:
        written = {name: partial(_as_written, study, name) for name in matrix.vary if is_judged(name)}
        if matrix.method == GRID:
            distinct = {name: values.on_grid() for name, values in matrix.vary.items()}
            sizes = [*map(len, distinct.values())]
            index = np.unravel_index(np.arange(math.prod(sizes)), sizes)
            columns = {name: _objects(values)[k] for (name, values), k in zip(distinct.items(), index, strict=True)}
        else:
            assert matrix.samples is not None
            cube = _cube(matrix.method, len(matrix.vary), matrix.samples, study.seed)
            columns = {
                name: _objects([values.at(share) for share in shares])
                for (name, values), shares in zip(matrix.vary.items(), cube.T.tolist(), strict=True)
            }
            distinct = {name: values.values or (values.from_, values.to) for name, values in matrix.vary.items()}
        design = Design(columns, distinct, (), written)
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
    written = study.resolved["matrix"].get("vary") or {}
    for name, distinct in design.distinct.items():
        values = [*distinct, *_parts(written.get(name, ()))]
        words = [value for value in values if isinstance(value, bool) or not _DECIMAL.fullmatch(str(value))]
        units = {(QUANTITY.fullmatch(str(value)) or {"unit": in_yaml(value)})["unit"]: value for value in words}
        yield from ((name, value) for value in units.values())


def _wrong(study: Study, design: Design, name: str, value: Any) -> list[str]:
    """Why an entry cannot have a value: neither with the others as they are, nor as the first cases have them."""
    messages = [*faults(study, [(name, value)], name)]
    same = (design[k] for k, own in enumerate(design.columns[name][:_MOST_SEARCHED]) if own == value)
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
    random = np.random.default_rng(seed)
    if method == "latin_hypercube":
        return np.asarray(scipy.stats.qmc.LatinHypercube(dimensions, rng=random).random(samples))
    # The sequence is even over powers of two: the next larger one is drawn, and its first points are used.
    sobol = scipy.stats.qmc.Sobol(dimensions, scramble=True, rng=random)
    return np.asarray(sobol.random_base2((samples - 1).bit_length()))[:samples]
