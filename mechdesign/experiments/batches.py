"""Answers of a command for many designs of a study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from mechdesign.errors import MechdesignError
from mechdesign.motion.group import Answers, Group
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics import analysis as dynamics
from mechdesign.questions.kinematics import analysis as kinematics
from mechdesign.questions.look import ask
from mechdesign.questions.optimize.stacked import grouped, shared
from mechdesign.questions.stiffness import analysis as stiffness
from mechdesign.study import Study
from mechdesign.study.designs import Designs

# Functions of the commands that answer many designs at once.
TOGETHER: Mapping[str, Callable[[Study, Poses], Answers]] = {
    "kinematics": kinematics.answers, "stiffness": stiffness.answers, "dynamics": dynamics.answers
}  # fmt: skip


def answers(designs: Designs, command: str) -> Answers:
    """A command's answer for each design, or the error of a design that has none."""
    answered: list[Group] = []
    if designs.count > 1 and command in TOGETHER and shared(designs.study, command, designs.changed):
        # Where a group has an error, its designs are answered one by one.
        for rows, study, poses in grouped(designs, command, np.arange(designs.count), lambda *_: None):
            with suppress(MechdesignError):
                groups = TOGETHER[command](study, poses).groups
                answered += [replace(group, rows=rows[group.rows]) for group in groups]
    left = set(range(designs.count)).difference(*(group.rows.tolist() for group in answered))
    return Answers([*answered, *(_alone(designs, k, command) for k in sorted(left))])


def _alone(designs: Designs, k: int, command: str) -> Group:
    try:
        group = Group.alone(ask(designs.one(k), command))
    except Exception as error:
        group = Group.failed(command, error)
    return replace(group, rows=np.array([k]))
