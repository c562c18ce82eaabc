"""What pictures of a stiffness show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.drawing.pictures import PosesView
from mechdesign.ground.results import Table
from mechdesign.motion.rows import Poses
from mechdesign.questions.stiffness.analysis import DrawnStiffness


class StiffnessView(PosesView):
    """A stiffness at one pose, along a motion or over a grid of poses."""

    @cached_property
    def drawn(self) -> DrawnStiffness:
        """The first pose, a loose one and those that are shown."""
        return DrawnStiffness.of(self.result)

    @property
    def poses(self) -> Poses:
        """The poses of `table`."""
        poses: Poses = self.drawn.finer.question.poses
        return poses

    def table(self, name: str) -> Table:
        """A table with rows of each pose, along a motion of as many as curves need."""
        values = self.drawn.finer
        if values is self.drawn.values:
            return self.result.tables[name]
        table: Table = values.question.chosen(values, (name,))[name]
        return table
