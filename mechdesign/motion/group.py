"""Answers of a command for many designs: tables that hold the rows of all of them, and those of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags, Ints
from mechdesign.ground.results import Result, Scope, Table
from mechdesign.ground.statistics import Request
from mechdesign.motion.followed import Followed


@dataclass(frozen=True, eq=False)
class DesignEnd:
    """How a design was answered: `missing` says which poses or parts of its motion are not valid."""

    warnings: Sequence[Caution] = ()
    failed: str = ""
    missing: str = ""
    counts: Mapping[str, int] = field(default_factory=dict)
    error: Exception | None = None  #: why it has no answer


@dataclass(frozen=True, eq=False)
class DesignGroup:
    """Answers of some designs of one kind.

    Parameters
    ----------
    rows : ndarray of int
        Which of all designs they are.
    result : Result
        Its tables have the rows of one design after those of another.
    ends : sequence of DesignEnd
        Of each design.
    uneven : mapping of str to ndarray of int
        Numbers of rows of each design in tables of which one may have more than another.
    """

    rows: Ints
    result: Result
    ends: Sequence[DesignEnd]
    uneven: Mapping[str, Sequence[int] | Ints] = field(default_factory=dict)
    _answers: dict[int, Result] = field(default_factory=dict, init=False)

    @classmethod
    def alone(cls, result: Result) -> DesignGroup:
        """The answer of a single design."""
        scopes = (table.scope for table in result.tables.values())
        missing = next((scope.missing for scope in scopes if scope is not None and scope.missing), "")
        return cls(
            np.zeros(1, dtype=np.intp), result, [DesignEnd(result.warnings, result.failed, missing, result.counts)]
        )

    @classmethod
    def failed(cls, command: str, error: Exception) -> DesignGroup:
        """A single design that has no answer."""
        return cls(np.zeros(1, dtype=np.intp), Result(command, {}), [DesignEnd(error=error)])

    @property
    def missing(self) -> Flags:
        """Designs of which poses or a part of the motion is not valid."""
        return np.array([bool(end.missing) for end in self.ends])

    def of(self, k: int) -> Result | Exception:
        """The answer of one design as if it were asked alone, or why it has none."""
        end = self.ends[k]
        if end.error is not None:
            return end.error
        if len(self.ends) == 1:
            return self.result
        if k not in self._answers:
            tables = {name: self._of(table, k, end) for name, table in self.result.tables.items()}
            self._answers[k] = replace(
                self.result, tables=tables, warnings=list(end.warnings), counts=end.counts, failed=end.failed
            )  # fmt: skip
        return self._answers[k]

    def _of(self, table: Table, k: int, end: DesignEnd) -> Table:
        counts = self.uneven.get(table.name)
        size = len(table) // len(self.ends)
        begin, number = (k * size, size) if counts is None else (int(np.sum(counts[:k], dtype=int)), int(counts[k]))
        own = table.take(np.arange(begin, begin + number))
        scope = table.scope and replace(table.scope, missing=end.missing, follow=_follow_of(table.scope, k))
        return replace(own, scope=scope)


def _follow_of(scope: Scope, design: int) -> Callable[[Sequence[Request]], list[Followed | None]] | None:
    """Columns along the motion of one design of several."""
    together = scope.follow
    if together is None:
        return None

    def own(requests: Sequence[Request]) -> list[Followed | None]:
        return [None if course is None else course.of(design) for course in together(requests)]

    return own
