"""What pictures of a workspace show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.drawing.pictures import View
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.regions import HeldRegion, regions


class WorkspaceView(View):
    """A region for each value of the held coordinates.

    Of a point with one degree of freedom it is a path, over a range of a held coordinate what ends the region: they
    have pictures of their own, and no `regions`.
    """

    @cached_property
    def regions(self) -> list[HeldRegion]:
        """The regions that have nodes."""
        return regions(self.study, self.result) if "local" in self.result.tables else []

    @cached_property
    def drawn(self) -> DrawnRegion:
        """The poses that are drawn in a region."""
        return DrawnRegion.of(self.result)
