"""What pictures of errors show."""

from __future__ import annotations

from functools import cached_property

from mechdesign.motion.rows import Poses
from mechdesign.questions.reliability.tables import DrawnErrors
from mechdesign.report.figures.looks import Sampled, look
from mechdesign.report.figures.pictures import PosesView


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

    def sampled(self, table: str) -> Sampled | None:
        """The samples with the tables of the first sampling method; None without samples or a table of this name."""
        tables, samples = self.result.tables, self.drawn.samples
        if samples is None or table not in tables:
            return None
        method = next(name for name in tables["moments"]["method"].tolist() if look(name).sampled)
        return Sampled(self.study, tables, method, samples, self.poses)
