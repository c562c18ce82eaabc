"""The poses of a question of a study and of its designs, and those that a picture shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.passage import MAX_SHOWN_POSES, shown_rows
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import POSES_AT_ONCE, solve_rows
from mechdesign.numerics.arrays import Ints
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.expansion import OWN, DesignNumbers, default, expand, number_of_poses
from mechdesign.study.schema.poses import PoseSection


def study_poses(study: Study, section: str, numbers: DesignNumbers = OWN) -> Poses:
    """Poses at which ``kinematics``, ``reliability`` or ``stiffness`` is asked, of the study's own design or of some.

    A section that says none takes those of kinematics, and these are by default a turn of the drive or its limits.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    for owner in _with_poses(study, section):
        if owner.at_nodes:
            # Here, for regions need SciPy, which is slow to import.
            from mechdesign.region.curves import workspace_nodes

            return workspace_nodes(study)
        poses = expand(owner, study.folder, numbers)
        if poses is not None:
            return poses
    return default(study.mechanism.description, numbers)


def _with_poses(study: Study, section: str) -> list[PoseSection]:
    """The sections of a study that may give the poses of one, in their order."""
    own: PoseSection | None = getattr(study, section)
    names = (section, *(own.fallbacks if own is not None else ("kinematics",)))
    return [part for name in dict.fromkeys(names) if (part := getattr(study, name)) is not None]


def alike(designs: Designs, section: str, rows: Ints) -> Iterator[Ints]:
    """Some designs in groups that have as many poses, `POSES_AT_ONCE` at most unless they are of one design."""
    if not len(rows):
        return
    owner = next((part for part in _with_poses(designs.study, section) if part.source is not None), None)
    counts = (
        np.zeros((len(rows), 0))
        if owner is None
        else number_of_poses(owner, designs.study.folder, designs.take(rows).numbers)
    )
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

    `rows` are those of the study's poses: all of them, or evenly spread where there are more than can be shown.
    """

    study: Study
    poses: Poses
    rows: Ints
    configuration: Configuration

    @property
    def solved(self) -> SolvedPoses:
        """The poses as those of their motion."""
        return SolvedPoses(
            self.study.motion(self.poses), self.rows, self.poses.groups[0].names, self.configuration
        )  # fmt: skip

    def take(self, index: Ints) -> Self:
        """Some of the poses."""
        return replace(self, rows=self.rows[index], configuration=self.configuration.take(index))


def shown_of(study: Study, solved: SolvedPoses) -> Shown:
    """Solved poses of a study, as pictures show them."""
    return Shown(study, solved.poses, solved.rows, solved.configuration)


def solve_shown(study: Study, most: int = MAX_SHOWN_POSES) -> Shown:
    """Solve what a picture shows of a motion that no analysis was asked for; raises as `solve_rows`."""
    poses = study_poses(study, "kinematics")
    rows = shown_rows(poses, most)
    return Shown(study, poses, rows, solve_rows(study.motion(poses), rows))
