"""Designs of experiments: which cases a matrix asks for."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.errors import Problem, StudyError
from mechdesign.experiments.cases import Case, variant
from mechdesign.numerics.arrays import Floats
from mechdesign.study import Study
from mechdesign.study.schema.matrix import GRID, Values
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import dotted, in_yaml
from mechdesign.study.text.units import QUANTITY


def cases_of(study: Study) -> list[Case]:
    """The cases of a study's matrix, in the order of the grid (the last entry fastest), the sequence or the file.

    Raises
    ------
    StudyError
        If a value makes no study by itself: a word that its entry does not know.
    """
    matrix = study.matrix
    assert matrix is not None
    if matrix.vary is None:
        names, rows = matrix.table(study.folder)
    elif matrix.method == GRID:
        names = tuple(matrix.vary)
        rows = tuple(itertools.product(*(values.on_grid() for values in matrix.vary.values())))
    else:
        names = tuple(matrix.vary)
        assert matrix.samples is not None
        rows = _spread(matrix.vary, _cube(matrix.method, len(names), matrix.samples, study.seed))
    for name, column in zip(names, zip(*rows, strict=True), strict=True):
        # Quantities as they are written, for their units must fit.
        written = study.resolved["matrix"]["vary"][name] if matrix.vary is not None else ()
        _try(study, name, [*column, *_parts(written)])
    return [Case(tuple(zip(names, row, strict=True))) for row in rows]


def _parts(written: Any) -> Iterable[Any]:
    """The numbers and texts that values of an entry are written with."""
    if isinstance(written, str):
        return [part.strip() for part in written.split(":")]
    return written.values() if isinstance(written, dict) else written


def _spread(vary: Mapping[str, Values], cube: Floats) -> tuple[tuple[Any, ...], ...]:
    return tuple(
        tuple(values.at(share) for values, share in zip(vary.values(), row, strict=True)) for row in cube.tolist()
    )


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
    place = dotted(entry(study.resolved, name))
    problems: list[Problem] = []
    # Of quantities one of each unit.
    tried = {(QUANTITY.fullmatch(str(value)) or {"unit": in_yaml(value)})["unit"]: value for value in values}
    for value in tried.values():
        if isinstance(value, int | float) and not isinstance(value, bool):
            continue
        text = in_yaml(value)
        try:
            variant(study, Case.of({name: value}))
        except StudyError as error:
            wrong = [each.message for each in error.problems if each.key == place]
            keys = ("matrix", "vary", name) if study.matrix and study.matrix.vary is not None else ("matrix", "cases")
            problems += [study.problem(f"{name}={text}: {message}", *keys) for message in wrong]
    if problems:
        raise StudyError(problems)
