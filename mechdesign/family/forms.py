"""Studies that differ only in numbers, as designs of one study that has a parameter in place of each number."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.errors import MechdesignError, StudyError
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import value_at
from mechdesign.study.text.units import QUANTITY, QuantityError
from mechdesign.study.variants import Changes, with_entries

# Most forms that are kept.
_MOST_FORMS = 64
_FORMS: dict[bytes, Form | None] = {}


def form_of(changes: Changes) -> str:
    """A text that is the same for cases that differ only in numbers."""
    return json.dumps([[name, None if is_number(value) else value] for name, value in changes])


@dataclass(frozen=True, eq=False)
class Form:
    """A study with a parameter in place of each number that changes; `parameters` are by the names of entries."""

    study: Study
    parameters: Mapping[str, str]

    def designs(self, cases: Sequence[Changes]) -> Designs | None:
        """Cases as designs of the study; None where a quantity has another unit than its entry."""
        columns = zip(*([value for _, value in changes] for changes in cases), strict=True)
        by_name = dict(zip((name for name, _ in cases[0]), columns, strict=True))
        try:
            return Designs(self.study, {
                own: np.array([_number(self.study, value) for value in by_name[name]])
                for name, own in self.parameters.items()
            })  # fmt: skip
        except QuantityError:
            return None


def compiled(study: Study, changes: Changes, first: Changes) -> Form | None:
    """The form of cases that differ from `changes` only in numbers, kept for the next of them; see `form`."""
    key = hashlib.sha256(json.dumps([study.resolved, form_of(changes), first, study.seed]).encode()).digest()
    if key not in _FORMS:
        while len(_FORMS) >= _MOST_FORMS:
            _FORMS.pop(next(iter(_FORMS)))
        words = [(name, value) for name, value in changes if not is_number(value)]
        numbers = {name: value for name, value in changes if is_number(value)}
        _FORMS[key] = form(study, words, numbers | {name: value for name, value in first if name in numbers})
    return _FORMS[key]


def form(study: Study, changes: Changes, numbers: Mapping[str, Any]) -> Form | None:
    """The study with changed entries, and a parameter in place of each of these numbers, by the names of their entries.

    A parameter has the study's own number, or that of `numbers` where the study has none. None where there is no such
    study, or a number decides the structure.
    """
    own, added, written = dict[str, str](), dict[str, Any](), [*changes]
    for name, value in numbers.items():
        try:
            keys = entry(study.resolved, name)
        except StudyError:
            return None
        if keys[:2] == ("mechanism", "sketch"):
            return None
        if keys[:2] == ("mechanism", "parameters"):
            own[name] = str(keys[2])
            continue
        parameter = f"entry_{len(own)}"
        while parameter in study.parameters.nominal:
            parameter += "_"
        own[name] = parameter
        raw = value_at(study.resolved, keys)
        added[parameter] = value if raw is None else raw
        written.append((name, parameter))
    try:
        lifted = Form(with_entries(study, written, added), own)
    except MechdesignError:
        return None
    moved = Designs(lifted.study, dict.fromkeys(own.values(), np.zeros(1)))
    return lifted if own and moved.alike else None


def is_number(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number or (isinstance(value, str) and QUANTITY.fullmatch(value) is not None)


def _number(study: Study, value: Any) -> float:
    return study.units.convert(value) if isinstance(value, str) else float(value)
