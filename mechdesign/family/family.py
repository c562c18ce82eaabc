"""A family: designs of a study by the values of its entries, evaluated by goals; those of one structure together."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from mechdesign.family.batch import Evaluated, without_numbers
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.question import DesignsQuestion
from mechdesign.family.structures import MAX_KEPT, Form, Structures, Values
from mechdesign.ground.errors import MechdesignError

# Designs evaluated together: enough for long arrays, few enough that all workers finish at about the same time.
DESIGNS_AT_ONCE = 384


class Family:
    """Evaluates designs of a study, those of one structure together."""

    def __init__(self, question: DesignsQuestion, defaults: Mapping[str, float] = MappingProxyType({})) -> None:
        """Evaluate what a question asks; `defaults` are numbers of entries that its study leaves out."""
        self.question, self.goals, self.layout = question, question.goals, question.layout
        self._structures, self._own = Structures(question.study, defaults), Evaluator(question)
        self._others: dict[Form, Evaluator] = {}

    def __getstate__(self) -> dict[str, Any]:
        """State for another process, which compiles other studies itself."""
        return self.__dict__ | {"_others": {}}

    def __call__(self, values: Values) -> Evaluated:
        """The results of designs; see `Values`."""
        count = len(next(iter(values.values())))
        table, reasons = np.full((count, self.layout.width), np.nan), np.full(count, "", dtype=object)
        for rows, form, own in self._structures.groups(values, count):
            try:
                evaluated = self._evaluated(form, own)
            except MechdesignError as error:
                reasons[rows] = without_numbers(error)
                continue
            # Designs of another structure may have another number of rows behind their goals.
            width = self.layout.width if evaluated.table.shape[1] == self.layout.width else self.layout.head
            table[rows, :width] = evaluated.table[:, :width]
            reasons[rows] = evaluated.reasons if own else evaluated.reasons[0]
        return Evaluated(table, reasons.tolist())

    def _evaluated(self, form: Form | MechdesignError, own: Values) -> Evaluated:
        """The results of designs of one structure; raises the error of one that makes no study."""
        if isinstance(form, MechdesignError):
            raise form
        if form.study is self.question.study:
            return self._own(own)
        if form not in self._others:
            if len(self._others) >= MAX_KEPT:
                self._others.clear()
            names = [form.parameters.get(name, name) for name in own]
            question = DesignsQuestion(form.study, self.question.places, names, graded=self.question.graded)
            self._others[form] = Evaluator(question)
        evaluated = self._others[form](form.designs(own).changed)
        reasons = evaluated.reasons
        # A message names the entry in whose place a parameter stands.
        for name, parameter in form.parameters.items() if any(reasons) else ():
            reasons = [re.sub(rf"\b{parameter}\b", name, reason) for reason in reasons]
        return Evaluated(evaluated.table, reasons)
