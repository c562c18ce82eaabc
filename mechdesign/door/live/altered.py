"""A study as a hand has changed it: numbers of the geometry, and entries of its sketch or its task."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial

from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.variants import with_entries

SKETCH, TASK = "mechanism.sketch", "synthesis"
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


_with_entries = lru_cache(_KEPT)(partial(with_entries, without=()))
