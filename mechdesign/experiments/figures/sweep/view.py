"""What pictures of the cases of a matrix show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.door.report.requirements import DrawnCases
from mechdesign.drawing.pictures import View
from mechdesign.experiments.figures.sweep.quantities import CaseAxis
from mechdesign.ground.results import Table


class CasesView(View):
    """Cases with the entries of the matrix that vary and the results; without either there is nothing to draw."""

    @property
    def table(self) -> Table:
        """A row a case."""
        return self.result.main

    @cached_property
    def drawn(self) -> DrawnCases:
        """Names of entries, results and goals."""
        return DrawnCases.of(self.result)

    @cached_property
    def entries(self) -> list[CaseAxis]:
        """The entries of the matrix that vary."""
        entries = [CaseAxis.of(self.table.column(name)) for name in self.drawn.entries]
        return [entry for entry in entries if len(entry.distinct) > 1]

    @cached_property
    def results(self) -> list[CaseAxis]:
        """The results with their limits."""
        return [
            CaseAxis.of(self.table.column(name), *limits, varied=False) for name, limits in self.drawn.results.items()
        ]

    @property
    def empty(self) -> bool:
        """Whether no entry varies, or there is no result."""
        return not self.entries or not self.results
