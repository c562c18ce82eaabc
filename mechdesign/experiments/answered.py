"""Answers of some cases, kept as numbers; only the first warning of a kind and the worst verdicts are kept as texts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mechdesign.cautions import fails
from mechdesign.errors import explain
from mechdesign.experiments.case_numbers import CaseNumber, judged
from mechdesign.motion.group import DesignGroup
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.report import requirements
from mechdesign.report.requirements import Verdict, command_of
from mechdesign.results import Result
from mechdesign.rows import UnknownColumnError
from mechdesign.study import Study
from mechdesign.study.schema.conditions import Requirement
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


@dataclass(frozen=True, eq=False)
class Answered:
    """Answers of some cases, in their order.

    Parameters
    ----------
    table : ndarray, shape (cases, 3 + results + 2 * requirements)
        Exit code (0 done; 1 a requirement is not met; 3 impossible; 4 a numerical failure), number of warnings, number
        of the reason; the wanted numbers, nan where there is none; of each requirement the worst value, and 1 where it
        is met.
    reasons : tuple of str
        Reasons why cases, or parts of them, have no answer; the first is empty, for cases that have one.
    units : tuple of str
        Units of the wanted numbers and of the requirements; empty where there is none.
    warned : mapping of str to Warned
        Warnings by their kind, in the order of their first cases.
    worst : tuple of Worst
        The worst case of each requirement.
    """

    table: Floats
    reasons: tuple[str, ...]
    units: tuple[str, ...]
    warned: Mapping[str, Warned]
    worst: tuple[Worst, ...]

    @classmethod
    def read(cls, table: Floats, texts: Mapping[str, Any]) -> Answered:
        """The answers with a table, and what `texts` has kept of the rest."""
        return cls(
            table, tuple(texts["reasons"]), tuple(texts["units"]),
            {kind: Warned(**warned) for kind, warned in texts["warned"].items()},
            tuple(Worst(**worst | {"verdict": Verdict(**worst["verdict"])}) for worst in texts["worst"]),
        )  # fmt: skip

    @property
    def texts(self) -> dict[str, Any]:
        """All but the table, for JSON."""
        return {
            "reasons": self.reasons, "units": self.units,
            "warned": {kind: asdict(warned) for kind, warned in self.warned.items()},
            "worst": [asdict(worst) for worst in self.worst],
        }  # fmt: skip


class Sheet:
    """Collects the answers of some cases, command by command."""

    def __init__(self, study: Study, results: Sequence[CaseNumber], count: int) -> None:
        self._required, self._results, self._mobility = study.requirements, results, study.mechanism.mobility
        #: by the row: what the case requires, the study's own until it is set
        self.judging = [Judging.of(study)] * count
        self._numbers = np.full((count, len(results)), np.nan)
        self._worst, self._margins = np.full((2, count, len(self._required)), np.nan)
        self._met = np.zeros((count, len(self._required)), dtype=bool)
        self._units = [""] * (len(results) + len(self._required))
        self._reasons: list[dict[str, int]] = [{} for _ in range(count)]
        self._warnings = np.zeros(count, dtype=np.intp)
        # By the kind of warning and the row: the first warning, and the number of warnings.
        self._warned: dict[str, dict[int, tuple[str, int]]] = {}
        # By requirement: the row of the worst case so far, and its verdict.
        self._verdicts: dict[int, tuple[int, Verdict]] = {}

    def failed(self, row: int, command: str, error: Exception) -> None:
        """Note why a command has no answer for a case, or why a case makes no study."""
        code, message = explain(error)
        why = "; ".join(message.splitlines())
        self._reasons[row][f"{command}: {why}" if command else why] = max(code, IMPOSSIBLE)

    def note(self, rows: Ints, group: DesignGroup) -> None:
        """Add the answers of a group of designs, which are the cases `rows`."""
        command = group.result.command
        for row, end in zip(rows.tolist(), group.ends, strict=True):
            if end.error is not None:
                self.failed(row, command, end.error)
            if end.failed:
                self._reasons[row][f"{command}: {end.failed}"] = IMPOSSIBLE
            self._warnings[row] += len(end.warnings)
            for warning in end.warnings:
                message = f"{command}: {warning}"
                rows_of_kind = self._warned.setdefault(warning.kind, {})
                first, number = rows_of_kind.get(row, (message, 0))
                rows_of_kind[row] = first, number + 1
                if fails(warning, self.judging[row].fail_on):
                    self._reasons[row].setdefault(message, NOT_MET)
        self._read(rows, group)

    def _read(self, rows: Ints, group: DesignGroup) -> None:
        """Read the numbers and verdicts of a group, design by design where they cannot be read together."""
        command, good = group.result.command, np.array([end.error is None for end in group.ends])
        try:
            for k, number in enumerate(self._results if good.any() else ()):
                if number.command == command:
                    values, unit = number.find(group)
                    self._numbers[rows[good], k] = values[good]
                    self._units[k] = unit
            for k, requirement in enumerate(self._required):
                if command_of(requirement) == command:
                    self._judge(k, rows, group)
        except UnknownColumnError as error:
            if len(rows) == 1:
                self._reasons[rows[0]][f"{command}: {error}"] = IMPOSSIBLE
                return
            for k in range(len(rows)):
                answer = group.of(k)
                alone = DesignGroup.alone(answer) if isinstance(answer, Result) else DesignGroup.failed(command, answer)
                self._read(rows[k : k + 1], alone)

    def _judge(self, k: int, rows: Ints, group: DesignGroup) -> None:
        """Judge cases by a requirement, each by its own."""
        good = np.array([end.error is None for end in group.ends])
        required = [self.judging[row].requirements[k] for row in rows.tolist()]
        if good.any():
            worst, met, self._units[len(self._results) + k] = judged(group, required)
            for column, values in ((self._worst, worst.values), (self._margins, worst.margins), (self._met, met)):
                column[rows[good], k] = values[good]
        order = self._order(k)
        least = int(order[rows].argmin())
        row, so_far = int(rows[least]), self._verdicts.get(k)
        if so_far is not None and (order[so_far[0]], so_far[0]) <= (order[row], row):
            return
        answer, verdict = group.of(least), _unanswered(required[least])
        if isinstance(answer, Result):
            verdict = requirements.verdict_on(answer, required[least], self._mobility)
        self._verdicts[k] = row, verdict

    def _order(self, k: int) -> Floats:
        """Margins of the cases from a limit; the lowest where one is not known or no margin meets it."""
        margins, met = self._margins[:, k], self._met[:, k]
        return np.where(np.isnan(margins) | (~met & (margins >= 0)), -np.inf, margins)

    def answered(self) -> Answered:
        """The answers of all cases."""
        codes = np.array([max(reason.values(), default=0) for reason in self._reasons], dtype=float)
        codes = np.maximum(codes, ~self._met.all(axis=1))
        reasons: dict[str, int] = {"": 0}
        number = [reasons.setdefault("; ".join(reason), len(reasons)) for reason in self._reasons]
        judged = np.stack([self._worst, self._met], axis=2).reshape(len(codes), -1)
        table = np.column_stack([codes, self._warnings, number, self._numbers, judged])
        return Answered(
            table, tuple(reasons), tuple(self._units), dict(sorted(self._kinds(), key=lambda item: item[1].case)),
            tuple(self._worst_of(k) for k in range(len(self._required))),
        )  # fmt: skip

    def _kinds(self) -> Iterator[tuple[str, Warned]]:
        for kind, rows in self._warned.items():
            row = min(rows)
            message, number = rows[row]
            yield kind, Warned(row, f"{message} (and {number - 1} more)" if number > 1 else message, len(rows))

    def _worst_of(self, k: int) -> Worst:
        order = self._order(k)
        row = int(order.argmin())
        judged_row, verdict = self._verdicts.get(k, (-1, None))
        unmet = np.flatnonzero(~self._met[:, k])
        first = int(unmet[0]) if len(unmet) else 0
        if verdict is None or judged_row != row:
            verdict = _unanswered(self.judging[row].requirements[k])
        return Worst(row, verdict, float(order[row]), len(unmet), first)


def _unanswered(requirement: Requirement) -> Verdict:
    """The verdict on a case without an answer."""
    return Verdict(requirements.in_words(requirement), met=False, worst=float("nan"))
