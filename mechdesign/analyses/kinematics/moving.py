"""All poses of a motion, solved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.analyses.kinematics.motion import Asked, Motion
from mechdesign.analyses.kinematics.smoothing import through_change_points
from mechdesign.analyses.kinematics.targets import errors
from mechdesign.analyses.poses import SolvedPoses, solve_poses
from mechdesign.progress import NULL, Progress


def move(question: Asked, progress: Progress = NULL, *, also: Callable[[SolvedPoses], object] | None = None) -> Motion:
    """Solve every pose; one that fails is nan, with its reason.

    Parameters
    ----------
    also : callable, optional
        Called with the solved poses, so that who needs more of them does not solve them again.

    Raises
    ------
    MechanismError
        If a pose's coordinates do not determine the mechanism.
    """
    study, poses = question.study, question.poses
    motion = Motion(question, reason=np.zeros(poses.count, dtype=np.int8))
    for solved in solve_poses(study, poses, question.watched):
        motion.fill(solved)
        if also is not None:
            also(solved)
        progress.update(len(solved.rows))
    through_change_points(motion)
    motion.errors = list(errors(study, poses, motion.arrays, np.arange(poses.count)))
    return motion
