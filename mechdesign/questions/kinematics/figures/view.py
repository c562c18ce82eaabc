"""What pictures of a motion show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.drawing.pictures import View
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.results import Table
from mechdesign.questions.kinematics.drawn import DrawnMotion


class MotionView(View):
    """A motion, or poses one by one: lists of poses have neither curves nor paths, grids only their assemblies."""

    @cached_property
    def drawn(self) -> DrawnMotion:
        """The solved poses and what makes some special."""
        return DrawnMotion.of(self.result)

    def asks_for(self, picture: str) -> bool:
        """Whether the study asks for a picture that is not always drawn."""
        section = self.study.kinematics
        return section is not None and picture in section.pictures

    @cached_property
    def curves(self) -> DrawnMotion:
        """The motion with as many poses as curves need."""
        return self.drawn.finer

    def table(self, name: str) -> Table:
        """A table with a row a pose, at these poses."""
        return self.curves.rows_of(self.result.tables[name], self.drawn)

    @cached_property
    def sweep(self) -> Sweep:
        """The solved poses with the paths of their points."""
        return Sweep.of(self.drawn.shown)
