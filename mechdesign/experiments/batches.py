"""Answers of a command for many designs of a study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from mechdesign.errors import MechdesignError
from mechdesign.family.stacked import grouped, shared
from mechdesign.motion.answer import MotionQuestion, answer
from mechdesign.motion.group import Answers, Group
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics.analysis import Dynamics
from mechdesign.questions.kinematics.answers import Kinematics
from mechdesign.questions.look import ask
from mechdesign.questions.stiffness.analysis import Stiffness
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.work.threads import one_thread

# Questions that many designs are asked at once.
TOGETHER: Mapping[str, Callable[[Study, Poses], MotionQuestion[Any]]] = {
    "kinematics": Kinematics.of, "stiffness": Stiffness.of, "dynamics": Dynamics.of
}  # fmt: skip


@one_thread()
def at_poses(study: Study, command: str, poses: Poses) -> Answers:
    """Answers for the poses of several designs, each as if it were asked alone, without pictures.

    The poses are solved together: their arrays are held as a whole. A design without a valid pose has an error.
    """
    return Answers(answer(TOGETHER[command](study, poses)))


def answers(designs: Designs, command: str) -> Answers:
    """A command's answer for each design, or the error of a design that has none."""
    answered: list[Group] = []
    if designs.count > 1 and command in TOGETHER and shared(designs.study, command, designs.changed):
        # Where a group has an error, its designs are answered one by one.
        for rows, study, poses in grouped(designs, command, np.arange(designs.count), lambda *_: None):
            with suppress(MechdesignError):
                groups = at_poses(study, command, poses).groups
                answered += [replace(group, rows=rows[group.rows]) for group in groups]
    left = set(range(designs.count)).difference(*(group.rows.tolist() for group in answered))
    return Answers([*answered, *(_alone(designs, k, command) for k in sorted(left))])


def _alone(designs: Designs, k: int, command: str) -> Group:
    try:
        group = Group.alone(ask(designs.one(k), command))
    except Exception as error:
        group = Group.failed(command, error)
    return replace(group, rows=np.array([k]))
