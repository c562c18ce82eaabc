"""All poses of a motion, solved; those at a change point that it follows from the poses on both sides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechdesign.analyses.kinematics.motion import Motion, MotionQuestion
from mechdesign.analyses.kinematics.targets import errors
from mechdesign.analyses.poses import SolvedPoses, in_study_units, radians, solve_poses
from mechdesign.mechanism.coordinates import angles_of
from mechdesign.progress import NULL, Progress
from mechdesign.study.poses import PoseGroup, Poses

# Poses with a conditioning below this have lost digits.
NEAR = 1e-3
# h: radians, or parts of the mechanism's size. What the formula leaves out is about 1e-12, what accelerations lose of
# their digits this near to a change point about 1e-10.
DISTANCE = 1e-2
STEPS = DISTANCE * np.array([-3, -2, -1, 1, 2, 3])
WEIGHTS = np.array([1, -6, 15, 15, -6, 1]) / 20


def move(
    question: MotionQuestion,
    progress: Progress = NULL,
    jobs: int | None = 1,
    *,
    also: Callable[[SolvedPoses], object] | None = None,
) -> Motion:
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
    for solved in solve_poses(study, poses, question.watched, jobs):
        motion.fill(solved)
        if also is not None:
            also(solved)
        progress.update(len(solved.rows))
    _through_change_points(motion)
    motion.errors = list(errors(study, poses, motion.arrays, np.arange(poses.count)))
    return motion


def _through_change_points(motion: Motion) -> None:
    """Set the columns of a motion at its change points, where the study follows them; note which in `smooth`.

    Where two assemblies meet, the equations of the velocities have no one solution, and those of the positions half of
    the digits; but the motion that is followed is smooth there. With S_k = f(k h) + f(-k h) from both sides

        f(0) = (15 S_1 - 6 S_2 + S_3) / 20  + O(h^6).
    """
    question = motion.question
    study, group = question.study, question.poses.groups[0]
    plan = study.mechanism.plan(group.names)
    motion.smooth = np.zeros(question.poses.count, dtype=bool)
    if plan.change_points is None or len(question.poses.groups) > 1:
        return
    rows = np.flatnonzero(motion.valid & (motion.arrays["conditioning"] < NEAR))
    if not len(rows):
        return
    (name,) = group.names
    coordinate = plan.structure.given[0]
    scale = 1.0 if coordinate.quantity == "angle" else study.mechanism.size
    steps = in_study_units(study, coordinate, scale * STEPS)
    values = (group.values[name][rows][:, None] + steps).ravel()
    beside = Poses((PoseGroup((name,), {name: values}, np.arange(len(values))),), len(values), True, (len(values),))
    around = Motion(replace(question, poses=beside), reason=np.zeros(len(values), dtype=np.int8))
    each = np.repeat(rows, len(STEPS))
    for solved in solve_poses(study, beside):
        near = {angle: radians(study, c, motion.arrays[angle][each[solved.rows]])
                for angle, c in angles_of(question.watched).items() if angle != name}  # fmt: skip
        configuration = replace(solved.configuration, near={**solved.configuration.near, **near})
        around.fill(replace(solved, configuration=configuration))
    good = around.valid.reshape(-1, len(STEPS)).all(axis=1)
    for column, array in motion.arrays.items():
        if column in (name, "conditioning"):
            continue
        table = around.arrays[column].reshape(-1, len(STEPS))
        array[rows[good]] = (table @ WEIGHTS)[good]
    motion.smooth[rows[good]] = True
