"""Answers of cases, kept as numbers; only the first warning of a kind and the worst verdicts are kept as texts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from mechdesign.door.report import requirements
from mechdesign.door.report.requirements import Verdict, command_of
from mechdesign.experiments.case_numbers import judged, number_of
from mechdesign.family.goals import Goal
from mechdesign.ground.cautions import fails
from mechdesign.ground.errors import explain
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Result
from mechdesign.ground.rows import UnknownColumnError
from mechdesign.motion.group import DesignGroup
from mechdesign.study import Study
from mechdesign.study.variants import Judging

# Exit code of a case that misses a requirement, or has a warning that the study forbids.
NOT_MET = 1
# Exit code of a case that has no answer.
IMPOSSIBLE = 3


@dataclass
class Worst:
    """The worst verdict on a requirement over cases, its case, and the number and the first of those that miss it.

    `margin` is from the limit in the unit of the result, the lowest where none is known or would meet it.
    """

    case: int
    verdict: Verdict
    margin: float
    unmet: int = 0
    first: int = 0


@dataclass
class Warned:
    """The first case with warnings of a kind, its first warning, and the number of cases with such warnings."""

    case: int
    message: str
    cases: int


@dataclass(eq=False)
class Answered:
    """Answers of cases, in their order: of a batch, or of all batches so far.

    Parameters
    ----------
    parts : list of ndarray, shape (cases, 3 + numbers + requirements)
        One below the other: exit code (0 done; 1 a requirement is not met; 3 impossible; 4 a numerical failure), number
        of warnings, number of the reason; the results, then the worst value of each requirement, nan where there is
        none; 1 where each requirement is met.
    units : list of str
        Units of these numbers; empty where there is none.
    reasons : dict of str to int
        Reasons why cases, or parts of them, have no answer, by their numbers; the first is empty, for cases that have
        one.
    warned : dict of str to Warned
        Warnings by their kind, in the order of their first cases.
    worst : list of Worst
        The worst case of each requirement.
    """

    parts: list[Floats] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    reasons: dict[str, int] = field(default_factory=lambda: {"": 0})
    warned: dict[str, Warned] = field(default_factory=dict)
    worst: list[Worst] = field(default_factory=list)

    @classmethod
    def read(cls, table: Floats, texts: str) -> Answered:
        """The answers with a table, and what `texts` has kept of the rest."""
        kept = json.loads(texts)
        return cls(
            [table], kept["units"], {reason: k for k, reason in enumerate(kept["reasons"])},
            {kind: Warned(**warned) for kind, warned in kept["warned"].items()},
            [Worst(**worst | {"verdict": Verdict(**worst["verdict"])}) for worst in kept["worst"]],
        )  # fmt: skip

    @property
    def texts(self) -> str:
        """All but the table, as JSON."""
        return json.dumps({
            "units": self.units, "reasons": [*self.reasons],
            "warned": {kind: asdict(warned) for kind, warned in self.warned.items()},
            "worst": [asdict(worst) for worst in self.worst],
        })  # fmt: skip

    def __len__(self) -> int:
        return sum(map(len, self.parts))

    @property
    def table(self) -> Floats:
        """The numbers of all cases."""
        if len(self.parts) > 1:
            self.parts = [np.concatenate(self.parts)]
        return self.parts[0]

    def add(self, other: Answered) -> None:
        """Add the answers of the next cases."""
        begin, table = len(self), other.table.copy()
        numbers = [self.reasons.setdefault(reason, len(self.reasons)) for reason in other.reasons]
        table[:, 2] = np.array(numbers)[table[:, 2].astype(np.intp)]
        self.parts.append(table)
        self.units = [own or unit for own, unit in zip(self.units or other.units, other.units, strict=True)]
        for kind, warned in other.warned.items():
            before = self.warned.setdefault(kind, replace(warned, case=begin + warned.case, cases=0))
            before.cases += warned.cases
        new = [replace(worst, case=begin + worst.case, first=begin + worst.first) for worst in other.worst]
        for worst, now in zip(self.worst, new, strict=bool(self.worst)):
            if now.margin < worst.margin:
                worst.case, worst.verdict, worst.margin = now.case, now.verdict, now.margin
            worst.first = worst.first if worst.unmet else now.first
            worst.unmet += now.unmet
        self.worst = self.worst or new

    def number(self, k: int) -> tuple[Floats, str]:
        """A number of each case, and its unit: a result, or after all of them what a requirement judges."""
        return self.table[:, 3 + k], self.units[k]

    def reason(self, k: int) -> str:
        """Why a case failed."""
        return [*self.reasons][int(self.table[k, 2])]


class Sheet:
    """Collects the answers of some cases, command by command."""

    def __init__(self, study: Study, results: Sequence[Goal], count: int) -> None:
        self._results, self._mobility = results, study.mechanism.mobility
        #: by the row: what the case requires, the study's own until it is set
        self.judging = [Judging.of(study)] * count
        self._commands = [command_of(requirement) for requirement in study.requirements]
        self._numbers = np.full((count, len(results) + len(self._commands)), np.nan)
        self._margins = np.full((count, len(self._commands)), np.nan)
        self._met = np.zeros(self._margins.shape, dtype=bool)
        self._units = [""] * self._numbers.shape[1]
        self._reasons: list[dict[str, int]] = [{} for _ in range(count)]
        # Warnings of each row, with their kinds.
        self._warnings: list[list[tuple[str, str]]] = [[] for _ in range(count)]
        # By the command and the row: where its answer is.
        self._answers: dict[tuple[str, int], tuple[DesignGroup, int]] = {}

    def failed(self, row: int, command: str, error: Exception) -> None:
        """Note why a command has no answer for a case, or why a case makes no study."""
        code, message = explain(error)
        why = "; ".join(message.splitlines())
        self._reasons[row][f"{command}: {why}" if command else why] = max(code, IMPOSSIBLE)

    def note(self, rows: Ints, group: DesignGroup) -> None:
        """Add the answers of a group of designs, which are the cases `rows`."""
        command = group.result.command
        for k, (row, end) in enumerate(zip(rows.tolist(), group.ends, strict=True)):
            self._answers[command, row] = group, k
            if end.error is not None:
                self.failed(row, command, end.error)
            if end.failed:
                self._reasons[row][f"{command}: {end.failed}"] = IMPOSSIBLE
            for warning in end.warnings:
                self._warnings[row].append((warning.kind, f"{command}: {warning}"))
                if fails(warning, self.judging[row].fail_on):
                    self._reasons[row].setdefault(f"{command}: {warning}", NOT_MET)
        self._read(rows, group)

    def _read(self, rows: Ints, group: DesignGroup) -> None:
        """Read the numbers of a group, design by design where they cannot be read together."""
        command, good = group.result.command, np.array([end.error is None for end in group.ends])
        if not good.any():
            return
        try:
            for k, goal in enumerate(self._results):
                if goal.command == command:
                    values, self._units[k] = number_of(goal, group)
                    self._numbers[rows[good], k] = values[good]
            for k, judged_command in enumerate(self._commands):
                if judged_command == command:
                    place, required = len(self._results) + k, [self.judging[row].requirements[k] for row in rows]
                    worst, met, self._units[place] = judged(group, required)
                    self._numbers[rows[good], place] = worst.values[good]
                    self._margins[rows[good], k], self._met[rows[good], k] = worst.margins[good], met[good]
        except UnknownColumnError as error:
            if len(rows) == 1:
                self._reasons[rows[0]][f"{command}: {error}"] = IMPOSSIBLE
                del self._answers[command, int(rows[0])]
                return
            for k in range(len(rows)):
                if isinstance(answer := group.of(k), Result):
                    self._read(rows[k : k + 1], DesignGroup.alone(answer))

    def answered(self) -> Answered:
        """The answers of all cases."""
        codes = np.array([max(reason.values(), default=0) for reason in self._reasons], dtype=float)
        codes = np.maximum(codes, ~self._met.all(axis=1))
        reasons: dict[str, int] = {"": 0}
        number = [reasons.setdefault("; ".join(reason), len(reasons)) for reason in self._reasons]
        table = np.column_stack([codes, [*map(len, self._warnings)], number, self._numbers, self._met])
        worst = [self._worst(k) for k in range(len(self._commands))]
        return Answered([table], self._units, reasons, self._warned(), worst)

    def _warned(self) -> dict[str, Warned]:
        warned: dict[str, Warned] = {}
        for row, own in enumerate(self._warnings):
            for kind in dict.fromkeys(kind for kind, _ in own):
                messages = [message for other, message in own if other == kind]
                more = f" (and {len(messages) - 1} more)" if len(messages) > 1 else ""
                warned.setdefault(kind, Warned(row, messages[0] + more, 0)).cases += 1
        return warned

    def _worst(self, k: int) -> Worst:
        """The case that misses a requirement by most; those of which no margin is known, or helps, miss it by more."""
        margins, met = self._margins[:, k], self._met[:, k]
        order = np.where(np.isnan(margins) | (~met & (margins >= 0)), -np.inf, margins)
        row, unmet = int(order.argmin()), np.flatnonzero(~met)
        required = self.judging[row].requirements[k]
        group, number = self._answers.get((self._commands[k], row), (None, 0))
        answer = group and group.of(number)
        verdict = Verdict(requirements.in_words(required), met=False, worst=float("nan"))
        if isinstance(answer, Result):
            verdict = requirements.verdict_on(answer, required, self._mobility)
        return Worst(row, verdict, float(order[row]), len(unmet), int(unmet[0]) if len(unmet) else 0)
