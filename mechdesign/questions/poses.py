"""The poses of a question of a study and of its designs, and those that a picture shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from mechdesign.ground.numerics.arrays import Ints
from mechdesign.mechanism import Configuration
from mechdesign.motion.curve import Curve
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.passage import MAX_SHOWN_POSES, shown_rows
from mechdesign.motion.question import Passage
from mechdesign.motion.rows import OWN, DesignNumbers, Poses
from mechdesign.motion.solving import POSES_AT_ONCE, curve_with, solve_rows
from mechdesign.study import Study
from mechdesign.study.designs import Designs


def study_poses(study: Study, section: str, numbers: DesignNumbers = OWN) -> Poses:
    """Poses at which ``kinematics``, ``reliability`` or ``stiffness`` is asked, of the study's own design or of some.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    owner = study.motions.owner(section)
    if owner is not None and study.sections[owner].at_nodes:
        # Here, for regions need SciPy, which is slow to import.
        from mechdesign.region.curves import workspace_nodes

        return workspace_nodes(study)
    return study.motions[section] if numbers is OWN else study.motions.of(section, numbers)


def alike(designs: Designs, section: str, rows: Ints) -> Iterator[Ints]:
    """Some designs in groups that have as many poses, `POSES_AT_ONCE` at most unless they are of one design."""
    if not len(rows):
        return
    counts = designs.study.motions.counts(section, designs.take(rows).numbers)
    kinds, which = np.unique(counts, axis=0, return_inverse=True)
    for kind in range(len(kinds)):
        members = rows[which.ravel() == kind]
        if (kinds[kind] < 0).any():
            yield members
            continue
        count = study_poses(designs.study, section, designs.take(members[:1]).numbers).count
        size = max(1, POSES_AT_ONCE // count)
        yield from (members[begin : begin + size] for begin in range(0, len(members), size))


def pose_in_words(study: Study, poses: Poses, row: int, digits: int = 6) -> str:
    """The pose of a row in words; see `Motion.in_words`."""
    return study.motion(poses).in_words(row, digits)


@dataclass(frozen=True, eq=False)
class Shown:
    """Poses of a study's kinematics in their order: those that give the same coordinates as the first.

    `rows` are those of the study's poses: all of them, or evenly spread where there are more than can be shown. `curve`
    is the motion between them; None of poses one by one, and where it cannot be followed.
    """

    study: Study
    poses: Poses
    rows: Ints
    configuration: Configuration
    curve: Curve | None = None

    @property
    def solved(self) -> SolvedPoses:
        """The poses as those of their motion."""
        return SolvedPoses(self.study.motion(self.poses.take(self.rows)), self.rows, self.configuration)

    def take(self, index: Ints) -> Self:
        """Some of the poses."""
        return replace(self, rows=self.rows[index], configuration=self.configuration.take(index))


def shown_of(study: Study, passage: Passage) -> Shown:
    """What pictures show of a pass over the poses of a study."""
    curve, poses = passage.question.curve, passage.values.question.poses
    return Shown(study, poses, passage.shown.rows, passage.shown.configuration, curve)


def solve_shown(study: Study, most: int = MAX_SHOWN_POSES) -> Shown:
    """Solve what a picture shows of a motion that no analysis was asked for; raises as `solve_rows`."""
    poses = study_poses(study, "kinematics")
    rows, motion = shown_rows(poses, most), study.motion(poses)
    return Shown(study, poses, rows, solve_rows(motion, rows), curve_with(motion, ()) if poses.followed else None)
