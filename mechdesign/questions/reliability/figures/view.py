"""What pictures of errors show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.drawing.looks import followed_in_words, look
from mechdesign.drawing.panels import Along, along
from mechdesign.drawing.pictures import PosesView
from mechdesign.ground.results import Table
from mechdesign.motion.rows import Poses
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.drawn import FIRST_ORDER, DrawnErrors, Samples


class ErrorsView(PosesView):
    """Errors and failures at poses one by one, along a motion or over a grid of poses."""

    @cached_property
    def drawn(self) -> DrawnErrors:
        """The poses, and the samples of one of them."""
        return DrawnErrors.of(self.result)

    @property
    def poses(self) -> Poses:
        """The poses of the tables."""
        return self.drawn.poses

    def curve(self, table: str, method: str) -> tuple[Along, Table]:
        """What a curve over the motion runs over, and the rows of a method at poses; the first order's lie closer."""
        drawn, tables = self.drawn.finer if method == FIRST_ORDER else (self.drawn, self.result.tables)
        over, whole = along(self.study, drawn.poses), tables[table]
        assert over is not None
        rows = whole.where(method=method) & (whole.where(scope="pose") if "scope" in whole.names else True)
        return over, whole.take(rows)

    def sampled(self, table: str) -> Samples | None:
        """The samples; None without any, or without a table of this name."""
        return self.drawn.samples if table in self.result.tables else None

    @property
    def method(self) -> str:
        """The first method that samples."""
        return next(name for name in map(str, self.result.tables["moments"]["method"]) if look(name).sampled)

    @property
    def where(self) -> str:
        """The pose of the samples in words, and among several why it is shown."""
        samples = self.drawn.samples
        assert samples is not None
        in_words = followed_in_words if samples.limits else pose_in_words
        return f"at {in_words(self.study, self.poses, samples.pose)}"
