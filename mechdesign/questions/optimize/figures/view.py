"""What pictures of an optimisation show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.drawing.pictures import View
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.analysis import DrawnDesigns
from mechdesign.questions.optimize.judge import DesignSet

MIN_MAP_DESIGNS = 9


class DesignsView(View):
    """The designs of an optimisation with their goals, and the best."""

    @cached_property
    def drawn(self) -> DrawnDesigns:
        """The designs and the best."""
        return DrawnDesigns.of(self.result)

    @property
    def designs(self) -> DesignSet:
        """The designs with variables and goals."""
        return self.drawn.designs

    @property
    def mapped(self) -> bool:
        """Whether score and goals are maps over two variables."""
        return len(self.designs.variables) == 2 and len(self.designs) >= MIN_MAP_DESIGNS

    @property
    def front(self) -> Table | None:
        """The front of designs that no other is better than in every goal."""
        return self.result.tables.get("pareto")
