"""Designs of a study by their structure: those that differ in numbers alone are designs of one study, compiled once."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.errors import MechdesignError, StudyError
from mechdesign.ground.numerics.arrays import Ints
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import value_at
from mechdesign.study.variants import Changes, with_entries

# Most studies that are kept.
MAX_KEPT = 256

Values = Mapping[str, NDArray[Any]]
"""Values of designs, each of shape (designs,): of parameters and places of the geometry by their names, numbers in the
study's units; of other entries by the names that ``--set`` takes, numbers of type float, or whatever the entry takes.
"""


@dataclass(frozen=True, eq=False)
class Form:
    """A study with a parameter in place of each number that changes; `parameters` are by the names of entries."""

    study: Study
    parameters: Mapping[str, str]

    def designs(self, values: Values) -> Designs:
        """Designs of the study by the values of what changes."""
        return Designs(self.study, {self.parameters.get(name, name): column for name, column in values.items()})


class Structures:
    """The structures of designs of a study, each a study that is kept.

    Words, whole numbers that are read once and the sketch decide the structure. In place of every other number stands a
    parameter.
    """

    def __init__(self, study: Study, defaults: Mapping[str, Any] = MappingProxyType({})) -> None:
        """Those of a study; `defaults` are numbers of entries that it leaves out."""
        self._study, self._defaults = study, dict(defaults)
        # By what decides the structure: the error of values that make no study; None where a number decides it, too.
        self._forms: dict[str, Form | MechdesignError | None] = {}
        self._lifted: dict[str, bool] = {}

    def __getstate__(self) -> dict[str, Any]:
        """State for another process, which compiles studies itself."""
        return self.__dict__ | {"_forms": {}}

    def groups(
        self, values: Values, count: int, numbers: Collection[str] | None = None
    ) -> Iterator[tuple[Ints, Form | MechdesignError, Values]]:
        """`count` designs by their structure: their rows, their study, and the values that differ.

        `numbers` are the entries that do not decide the structure, as far as is known.
        """
        names = self._study.parameters.names()
        if numbers is None:
            numbers = [name for name, own in values.items() if name not in names and own.dtype.kind == "f"]
        deciding = [name for name in values if name not in numbers and self._decides(name, values)]
        for rows, kind in _kinds({name: values[name] for name in deciding}, count):
            own = {name: column[rows] for name, column in values.items() if name not in kind}
            if (whole := self._form(kind, own, numbers)) is not None:
                yield rows, whole, own
                continue
            some = {name: column[rows] for name, column in values.items()}
            fewer = [name for name in numbers if self._lifts(name, some)]
            fewer = fewer if len(fewer) < len(numbers) else []
            for members, form, values_of_form in self.groups(some, len(rows), fewer):
                yield rows[members], form, values_of_form

    def _decides(self, name: str, values: Values) -> bool:
        """Whether values decide the structure: of an entry, no numbers, or a whole number that is read once."""
        parameters = self._study.parameters
        number = name in parameters.names() and values[name].dtype.kind == "f"
        return not number or not parameters.moved([name]).isdisjoint(self._study.fixed)

    def _lifts(self, name: str, values: Values) -> bool:
        """Whether a parameter may stand in place of an entry."""
        if name not in self._lifted:
            self._lifted[name] = self._with_parameters((), [name], values) is not None
        return self._lifted[name]

    def _form(self, kind: Mapping[str, Any], own: Values, numbers: Collection[str]) -> Form | MechdesignError | None:
        """The study of a structure; None where one of the `numbers` decides it."""
        if not kind and not numbers:
            return Form(self._study, {})
        key = json.dumps([kind, [*numbers], [*own]])
        if key not in self._forms:
            while len(self._forms) >= MAX_KEPT:
                self._forms.pop(next(iter(self._forms)))
            parameters = self._study.parameters.nominal
            changes = [(f"mechanism.parameters.{name}" if name in parameters else name, value)
                       for name, value in kind.items()]  # fmt: skip
            try:
                self._forms[key] = (
                    self._with_parameters(changes, numbers, own) if numbers
                    else Form(with_entries(self._study, changes), {})
                )  # fmt: skip
            except MechdesignError as error:
                self._forms[key] = error
        return self._forms[key]

    def _with_parameters(self, changes: Changes, numbers: Collection[str], values: Values) -> Form | None:
        """The study with changed entries, and a parameter in place of each of some numbers.

        A parameter has the study's own number, or a default where the study has none. None where there is no such
        study, or a number decides the structure.
        """
        study, added, lifted = self._study, dict[str, Any](), dict[str, str]()
        for name in numbers:
            try:
                keys = entry(study.resolved, name)
            except StudyError:
                return None
            if keys[:2] == ("mechanism", "sketch"):
                return None
            parameter = f"entry_{len(lifted)}"
            while parameter in study.parameters.nominal:
                parameter += "_"
            raw, lifted[name] = value_at(study.resolved, keys), parameter
            added[parameter] = self._defaults.get(name, values[name][0].item()) if raw is None else raw
        try:
            form = Form(with_entries(study, [*changes, *lifted.items()], added), lifted)
        except MechdesignError:
            return None
        return form if form.designs(dict.fromkeys(lifted, np.zeros(1))).alike else None


def _kinds(deciding: Values, count: int) -> Iterator[tuple[Ints, dict[str, Any]]]:
    """Rows of designs that have the same values of what decides the structure, and these values by their names."""
    if not deciding:
        yield np.arange(count), {}
        return
    rows: dict[str, list[int]] = {}
    designs = [*zip(*(map(_plain, column.tolist()) for column in deciding.values()), strict=True)]
    for k, design in enumerate(designs):
        rows.setdefault(json.dumps(design), []).append(k)
    for members in rows.values():
        yield np.array(members), dict(zip(deciding, designs[members[0]], strict=True))


def _plain(value: Any) -> Any:
    """A value as a study has it: a whole number is an int."""
    return int(value) if isinstance(value, float) and value.is_integer() else value
