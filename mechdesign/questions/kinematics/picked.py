"""The poses of a long motion that stay in memory."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.numerics.arrays import Ints
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.question import MotionQuestion
from mechdesign.questions.kinematics.targets import Error


@dataclass
class Picked:
    """Those poses of a long motion that stay in memory: the ones shown, and where something changes."""

    question: MotionQuestion
    shown: Ints
    _rows: list[Ints] = field(default_factory=list)
    _motions: list[Motion] = field(default_factory=list)

    def add(self, begin: int, motion: Motion) -> None:
        """Take over the poses of the next piece, which begins with the row `begin`."""
        rows = begin + np.arange(len(motion.reason))
        some = np.isin(rows, self.shown)
        # Changes between two pieces lie between their ends.
        some[[0, -1]] = True
        changes = motion.valid[1:] != motion.valid[:-1]
        some[1:] |= changes
        some[:-1] |= changes
        for values in [*motion.arrays.values(), *(error.values for error in motion.errors)]:
            finite = motion.valid & np.isfinite(values)
            if finite.any():
                low, high = np.where(finite, values, np.inf), np.where(finite, values, -np.inf)
                some[[low.argmin(), high.argmax(), finite.argmax()]] = True
            if (lost := motion.valid & np.isnan(values)).any():
                some[lost.argmax()] = True
        kept = np.flatnonzero(some)
        errors = [Error(error.output, error.quantity, error.values[kept]) for error in motion.errors]
        arrays = {name: values[kept] for name, values in motion.arrays.items()}
        self._rows.append(rows[kept])
        part = Motion(self.question, arrays, motion.reason[kept], errors, motion.sums, motion.smooth[kept])
        self._motions.append(part)

    def motion(self) -> Motion:
        """The motion of all poses that were kept."""
        parts = self._motions
        poses = self.question.poses.take(np.concatenate(self._rows))
        return Motion(
            replace(self.question, poses=poses),
            {name: np.concatenate([part.arrays[name] for part in parts]) for name in parts[0].arrays},
            np.concatenate([part.reason for part in parts]),
            [
                replace(error, values=np.concatenate([part.errors[k].values for part in parts]))
                for k, error in enumerate(parts[0].errors)
            ],
            sum((part.sums for part in parts), np.zeros(())),
            np.concatenate([part.smooth for part in parts]),
        )
