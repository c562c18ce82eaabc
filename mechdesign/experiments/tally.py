"""Answers of many cases, kept as rows of numbers, so that millions of cases fit in memory."""

from __future__ import annotations

import json
import time
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechdesign.experiments.answered import IMPOSSIBLE, Answered, Warned, Worst
from mechdesign.numerics.arrays import Floats
from mechdesign.report.cases import changes_in_words
from mechdesign.report.requirements import Verdict, over_cases
from mechdesign.study.variants import Changes
from mechdesign.work.journal import Journal, digest

# Number of cases, or seconds, after which finished cases are written to a journal.
_BLOCK, _SECONDS = 1024, 5.0


class Tally:
    """Answers of the first cases of a design; only the first warning of a kind and the worst verdicts are texts.

    Parameters
    ----------
    cases : sequence of Changes
        All cases.
    results, requirements : int
        Number of wanted numbers of each case, and number of requirements.
    """

    def __init__(self, cases: Sequence[Changes], results: int, requirements: int) -> None:
        self.cases = cases
        self._labels: Sequence[str] = getattr(cases, "labels", ())
        self._results, self._requirements = results, requirements
        self.width = 3 + results + 2 * requirements
        self._rows = array("d")
        self.reasons: dict[str, int] = {"": 0}
        self._units = [""] * (results + requirements)
        self.worst: list[Worst] = []
        self.warned: dict[str, Warned] = {}  # by the kind of warning
        self._sizes: list[int] = []  # of the blocks that the journal has
        self._noted = time.monotonic()

    def __len__(self) -> int:
        return len(self._rows) // self.width

    def add(self, answered: Answered) -> None:
        """Add the answers of the next cases."""
        begin, table = len(self), answered.table.copy()
        numbers = [self.reasons.setdefault(reason, len(self.reasons)) for reason in answered.reasons]
        table[:, 2] = np.array(numbers)[table[:, 2].astype(np.intp)]
        self._rows.frombytes(table.tobytes())
        self._units = [own or unit for own, unit in zip(self._units, answered.units, strict=True)]
        for kind, warned in answered.warned.items():
            before = self.warned.setdefault(kind, replace(warned, case=begin + warned.case, cases=0))
            before.cases += warned.cases
        new = [replace(other, case=begin + other.case, first=begin + other.first) for other in answered.worst]
        for worst, other in zip(self.worst, new, strict=bool(self.worst)):
            if other.margin < worst.margin:
                worst.case, worst.verdict, worst.margin = other.case, other.verdict, other.margin
            worst.first = worst.first if worst.unmet else other.first
            worst.unmet += other.unmet
        self.worst = self.worst or new

    @property
    def table(self) -> Floats:
        """Exit code, warnings, number of the reason, results, and of each requirement the worst value and whether it is
        met; shape (cases, columns).
        """
        return np.frombuffer(self._rows, dtype=float).reshape(-1, self.width)

    def result(self, k: int) -> tuple[Floats, str]:
        """A wanted number of each case, and its unit."""
        return self.table[:, 3 + k], self._units[k]

    def required(self, k: int) -> tuple[Floats, Floats, str]:
        """The worst value of each case that a requirement judges, 1 where it is met, and the unit of the value."""
        at = 3 + self._results + 2 * k
        return self.table[:, at], self.table[:, at + 1], self._units[self._results + k]

    @property
    def failed(self) -> list[int]:
        """Numbers of the cases without an answer."""
        return np.flatnonzero(self.table[:, 0] >= IMPOSSIBLE).tolist()

    def reason(self, k: int) -> str:
        """Why a case failed."""
        return [*self.reasons][int(self.table[k, 2])]

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The worst verdict on each requirement over the cases, and how many do not meet it."""
        return tuple(
            over_cases(worst.verdict, self.named(worst.case), worst.unmet, len(self), worst.first)
            for worst in self.worst
        )

    def named(self, k: int) -> str:
        """A case in words: its number, from 1, its label, if it has one, and its values."""
        label = self._labels[k] if len(self._labels) else ""
        return f"case {k + 1} ({label and f'{label}: '}{changes_in_words(self.cases[k])})"

    def note(self, journal: Journal, *, last: bool = False) -> None:
        """Write new cases to a journal, if they are many, some seconds have passed, or they are the last."""
        begin = sum(self._sizes)
        few = len(self) - begin < _BLOCK and time.monotonic() - self._noted < _SECONDS
        if begin == len(self) or (few and not last):
            return
        self._sizes.append(len(self) - begin)
        journal.add(self._key(begin, len(self)), self.table[begin:].copy(), [json.dumps(self._state())])
        self._noted = time.monotonic()

    def recall(self, journal: Journal) -> None:
        """Read the first cases from a journal."""
        state = json.loads(journal.words[0]) if journal.words else {"sizes": []}
        blocks: dict[bytes, Floats] = {}
        begin = 0
        for size in state["sizes"]:
            key = self._key(begin, begin + size)
            block = journal.recall(key)
            if block is None:
                return
            blocks[key] = block
            begin += size
        if not blocks:
            return
        for key, block in blocks.items():
            self._rows.extend(block.ravel().tolist())
            self._sizes.append(len(block))
            journal.add(key, block, journal.words)
        whole = Answered.read(self.table, state)
        self.reasons = {reason: k for k, reason in enumerate(whole.reasons)}
        self._units, self.warned, self.worst = [*whole.units], dict(whole.warned), [*whole.worst]

    def _state(self) -> Mapping[str, Any]:
        whole = Answered(self.table, tuple(self.reasons), tuple(self._units), self.warned, tuple(self.worst))
        return whole.texts | {"sizes": self._sizes}

    def _key(self, begin: int, end: int) -> bytes:
        return digest([np.array([begin, end], dtype=float)])
