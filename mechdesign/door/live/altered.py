"""A study as a hand has changed it: numbers of the geometry, and entries of its sketch or its task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.variants import with_entries

SKETCH, TASK = "mechanism.sketch", "synthesis"
POINTS = f"{TASK}.path.points"
_KEPT = 8  # studies with other entries that are kept: a hand changes numbers on one of them


def is_entry(name: str) -> bool:
    """Whether a change is one of an entry, as `--set` names it, and not of a parameter or dimension."""
    return name.startswith((f"{SKETCH}.", f"{TASK}."))


def altered(study: Study, changes: Mapping[str, float]) -> Study:
    """The study with other entries and other numbers, as if its file had been changed; the entries go first.

    Raises
    ------
    StudyError
        If a name is none of the study, or the values make no study.
    MechanismError, AssemblyError
        If the sketch cannot be assembled.
    """
    entries = tuple((name, value) for name, value in changes.items() if is_entry(name))
    base = _with_entries(study, entries) if entries else study
    return variant(base, {name: value for name, value in changes.items() if not is_entry(name)})


@lru_cache(_KEPT)
def _with_entries(study: Study, entries: tuple[tuple[str, float], ...]) -> Study:
    changes: list[tuple[str, Any]] = [*entries]
    if any(name.startswith(f"{POINTS}.") for name, _ in entries):
        # Those of a file become the study's own.
        changes.insert(0, (POINTS, path_points(study)))
    return with_entries(study, changes, without=())


def path_points(study: Study) -> list[list[float]]:
    """The points of a study's path, a row [x, y] each, of its file where they stand in one; none of other tasks."""
    path = None if study.synthesis is None else study.synthesis.path
    if path is None:
        return []
    rows: Sequence[Sequence[float]] = path.points if not isinstance(path.points, str) else []
    if isinstance(path.points, str):
        rows = read_table(study.folder, path.points).tolist()
    return [[*map(float, row)] for row in rows]


def free_numbers(study: Study) -> list[str]:
    """Parameters and dimensions that are numbers of their own: they follow from nothing else in the study."""
    parameters, places = study.parameters, study.mechanism.description.places
    return [
        name for name in parameters.names()
        if name not in parameters.formulas and name not in parameters.dependent
        and (name in parameters.nominal or places[name].path)
    ]  # fmt: skip


def value_of(study: Study, name: str) -> float:
    """A parameter, a dimension or a number of the sketch of a study, in its units."""
    if is_entry(name):
        point, _, axis = name.removeprefix(f"{SKETCH}.").rpartition(".")
        place = study.mechanism.description.sketch[point]
        return place.imag if axis == "1" else place.real
    return study.sizes[name] / study.parameters.factors.get(name, 1.0)
