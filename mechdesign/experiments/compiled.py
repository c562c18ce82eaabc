"""Cases that differ only in numbers, as designs of one study that has a parameter in place of each number."""

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
    """A study with a parameter in place of each number that cases change; `parameters` are by the names of entries."""

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
    """The form of cases that differ from `changes` only in numbers; None where a number decides the structure.

    The form has the study's own numbers, or those of the `first` case where the study has none.
    """
    key = hashlib.sha256(json.dumps([study.resolved, form_of(changes), first, study.seed]).encode()).digest()
    if key not in _FORMS:
        while len(_FORMS) >= _MOST_FORMS:
            _FORMS.pop(next(iter(_FORMS)))
        _FORMS[key] = _compiled(study, changes, dict(first))
    return _FORMS[key]


def _compiled(study: Study, changes: Changes, first: Mapping[str, Any]) -> Form | None:
    names, own, added = set(study.parameters.nominal), dict[str, str](), dict[str, Any]()
    written: list[tuple[str, Any]] = []
    for number, (name, value) in enumerate(changes):
        if not is_number(value):
            written.append((name, value))
            continue
        try:
            keys = entry(study.resolved, name)
        except StudyError:
            return None
        if keys[:2] == ("mechanism", "sketch"):
            return None
        if keys[:2] == ("mechanism", "parameters"):
            own[name] = str(keys[2])
            continue
        parameter = f"entry_{number}"
        while parameter in names:
            parameter += "_"
        own[name] = parameter
        raw = value_at(study.resolved, keys)
        added[parameter] = first[name] if raw is None else raw
        written.append((name, parameter))
    try:
        form = Form(with_entries(study, written, added), own)
    except MechdesignError:
        return None
    moved = Designs(form.study, dict.fromkeys(own.values(), np.zeros(1)))
    return form if own and moved.alike else None


def is_number(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number or (isinstance(value, str) and QUANTITY.fullmatch(value) is not None)


def _number(study: Study, value: Any) -> float:
    return study.units.convert(value) if isinstance(value, str) else float(value)
