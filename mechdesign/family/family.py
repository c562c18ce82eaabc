"""A family: designs of a study by the values of its entries; those of one structure are compiled once, as one study."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import MechdesignError
from mechdesign.family.batch import Evaluated, without_numbers
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.forms import form
from mechdesign.family.question import DesignsQuestion, question_of
from mechdesign.study.variants import with_entries

# Designs evaluated together: enough for long arrays, few enough that all workers finish at about the same time.
DESIGNS_AT_ONCE = 384
# Most studies of other structure that are kept.
MAX_OTHERS = 256

Values = Mapping[str, NDArray[Any]]
"""Values of designs, each of shape (designs,): of parameters and places of the geometry by their names, numbers in the
study's units; of other entries by the names that ``--set`` takes, numbers of type float, or whatever the entry takes.
"""


class Compiled(NamedTuple):
    """Designs of one structure: what evaluates them, and the parameters that stand in place of entries."""

    evaluator: Evaluator
    parameters: Mapping[str, str]


class Family:
    """Evaluates designs of a study, those of one structure together.

    Words, whole numbers that are read once and the sketch decide the structure: each is a study of its own, which is
    kept. In place of every other number stands a parameter.
    """

    def __init__(self, question: DesignsQuestion, defaults: Mapping[str, float] = MappingProxyType({})) -> None:
        """Evaluate what a question asks; `defaults` are numbers of entries that its study leaves out."""
        self.question, self.study, self.goals, self.layout = question, question.study, question.goals, question.layout
        self._own, self._defaults = Evaluator(question), dict(defaults)
        # Studies of other structure, by what decides it; None where a number does so, too.
        self._others: dict[str, Compiled | None] = {}
        self._lifted: dict[str, bool] = {}

    def __getstate__(self) -> dict[str, Any]:
        """State for another process, which compiles other studies itself."""
        return self.__dict__ | {"_others": {}}

    def __call__(self, values: Values) -> Evaluated:
        """The results of designs; see `Values`."""
        names = self.study.parameters.names()
        entries = [name for name, own in values.items() if name not in names and own.dtype.kind == "f"]
        return self._evaluated(values, entries)

    def _evaluated(self, values: Values, numbers: Collection[str]) -> Evaluated:
        """The results of designs; `numbers` are the entries that do not decide the structure."""
        deciding = [name for name in values if name not in numbers and self._decides(name, values)]
        if not deciding and not numbers:
            return self._own(values)
        count = len(next(iter(values.values())))
        table, reasons = np.full((count, self.layout.width), np.nan), np.full(count, "", dtype=object)
        for rows, kind in _kinds({name: values[name] for name in deciding}, count):
            own = {name: column[rows] for name, column in values.items() if name not in kind}
            try:
                evaluated = self._of(kind, own, numbers)
            except MechdesignError as error:
                reasons[rows] = without_numbers(error)
                continue
            if evaluated is None:
                some = {name: column[rows] for name, column in values.items()}
                fewer = [name for name in numbers if self._lifts(name, some)]
                evaluated = self._evaluated(some, fewer if len(fewer) < len(numbers) else ())
            # Designs of another structure may have another number of rows behind their goals.
            width = self.layout.width if evaluated.table.shape[1] == self.layout.width else self.layout.head
            table[rows, :width] = evaluated.table[:, :width]
            reasons[rows] = evaluated.reasons if own else evaluated.reasons[0]
        return Evaluated(table, reasons.tolist())

    def _decides(self, name: str, values: Values) -> bool:
        """Whether values decide the structure: of an entry, no numbers, or a whole number that is read once."""
        parameters = self.study.parameters
        number = name in parameters.names() and values[name].dtype.kind == "f"
        return not number or not parameters.moved([name]).isdisjoint(self.study.fixed)

    def _lifts(self, name: str, values: Values) -> bool:
        """Whether a parameter may stand in place of an entry."""
        if name not in self._lifted:
            self._lifted[name] = form(self.study, (), self._numbers([name], values)) is not None
        return self._lifted[name]

    def _numbers(self, names: Collection[str], values: Values) -> dict[str, float]:
        """Numbers that stand for entries which the study leaves to their defaults."""
        return {name: self._defaults.get(name, values[name][0].item()) for name in names}

    def _of(self, kind: Mapping[str, Any], own: Values, numbers: Collection[str]) -> Evaluated | None:
        """The results of designs of one structure; None where one of the `numbers` decides it."""
        key = json.dumps([kind, [*numbers], [*own]])
        if key not in self._others:
            while len(self._others) >= MAX_OTHERS:
                self._others.pop(next(iter(self._others)))
            self._others[key] = self._compiled(kind, own, numbers)
        if (compiled := self._others[key]) is None:
            return None
        evaluated = compiled.evaluator({compiled.parameters.get(name, name): column for name, column in own.items()})
        if not any(evaluated.reasons):
            return evaluated
        # A message names the entry in whose place a parameter stands.
        reasons = evaluated.reasons
        for name, parameter in compiled.parameters.items():
            reasons = [re.sub(rf"\b{parameter}\b", name, reason) for reason in reasons]
        return Evaluated(evaluated.table, reasons)

    def _compiled(self, kind: Mapping[str, Any], own: Values, numbers: Collection[str]) -> Compiled | None:
        """The study of a structure, with parameters for the `numbers`; None where one decides its structure."""
        parameters = self.study.parameters.nominal
        changes = [(f"mechanism.parameters.{name}" if name in parameters else name, value)
                   for name, value in kind.items()]  # fmt: skip
        study, lifted = self.study, dict[str, str]()
        if numbers:
            made = form(study, changes, self._numbers(numbers, own))
            if made is None:
                return None
            study, lifted = made.study, dict(made.parameters)
        else:
            study = with_entries(study, changes)
        names = [lifted.get(name, name) for name in own]
        return Compiled(Evaluator(question_of(study, self.question.places, names, graded=self.question.graded)), lifted)


def _kinds(deciding: Values, count: int) -> Iterator[tuple[NDArray[np.intp], dict[str, Any]]]:
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
