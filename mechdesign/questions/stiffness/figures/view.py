"""What pictures of a stiffness show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.questions.stiffness.analysis import DrawnStiffness
from mechdesign.report.figures.panels import Along, Plane, along, plane
from mechdesign.report.figures.pictures import View
from mechdesign.study.poses import Poses


class StiffnessView(View):
    """A stiffness at one pose, along a motion or over a grid of poses."""

    @cached_property
    def drawn(self) -> DrawnStiffness:
        """The first pose, a loose one and those that are shown."""
        return DrawnStiffness.of(self.result)

    @property
    def poses(self) -> Poses:
        """The poses of the table."""
        return self.drawn.shown.poses

    @cached_property
    def swept(self) -> Along | None:
        """The coordinate along a sweep or path."""
        return along(self.study, self.poses)

    @cached_property
    def over(self) -> Plane | None:
        """The two coordinates of a grid."""
        return plane(self.study, self.poses)
