"""Poses that a result carries for its pictures: a bounded number of those of a motion, as the analysis solved them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mechdesign.analyses.poses import SolvedPoses, radians, study_poses
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.configuration import joined
from mechdesign.numerics.arrays import Ints
from mechdesign.study import Poses, Study

# Poses of a motion that a picture can show.
MOST_POSES = 2001


@dataclass(frozen=True, eq=False)
class Shown:
    """Poses of a study's kinematics in their order: those that give the same coordinates as the first.

    Parameters
    ----------
    rows : ndarray of int
        Row of each pose among the study's; all of them, or evenly spread where there are more than can be shown.
    """

    study: Study
    poses: Poses
    rows: Ints
    configuration: Configuration


@dataclass(eq=False)
class Keeper:
    """Keeps what pictures show of the poses that an analysis solves, chunk by chunk."""

    study: Study
    poses: Poses
    _parts: list[Configuration] = field(default_factory=list)

    def keep(self, solved: SolvedPoses) -> None:
        """Take over the shown ones of some solved poses."""
        index = np.flatnonzero(np.isin(solved.rows, _rows(self.poses, MOST_POSES)))
        if len(index):
            self._parts.append(solved.configuration.take(index))

    @property
    def shown(self) -> Shown:
        """All that was kept."""
        rows, whole = _rows(self.poses, MOST_POSES), self._parts[0]
        if len(self._parts) > 1:
            whole = joined(self._parts, rows.shape, whole.take(0).vectors, {})
        return Shown(self.study, self.poses, rows, whole)


def solve_shown(study: Study, most: int = MOST_POSES) -> Shown:
    """Solve what a picture shows of a motion that no analysis was asked for.

    Raises
    ------
    MechdesignError
        Where the coordinates given do not determine the mechanism.
    """
    poses = study_poses(study, "kinematics")
    rows, names = _rows(poses, most), poses.groups[0].names
    plan = study.mechanism.plan(names)
    given = [radians(study, c, poses.values[name][rows]) for c, name in zip(plan.structure.given, names, strict=True)]
    return Shown(study, poses, rows, plan.solve(given))


def _rows(poses: Poses, most: int) -> Ints:
    rows = poses.groups[0].rows
    return rows[np.unique(np.linspace(0, len(rows) - 1, most).round().astype(np.intp))]
