"""Limits of the errors of one pose or many: bands, and circles about the nominal place or a target."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.motion.rows import Poses
from mechdesign.questions.reliability.laws import at_rows
from mechdesign.questions.reliability.schema.limits import ErrorLimit
from mechdesign.study import Study


@dataclass(frozen=True)
class ErrorBound:
    """Limits low <= error <= high of a channel, or of two: of the distance of their errors from the middle of a circle
    or ring.

    Either end may be infinite, and it and the middle an array of poses. If `absolute`, they limit the value of the
    channel itself, or the middle is a place. If `free`, the drive of a made mechanism stands where its point comes
    nearest to the middle.
    """

    channels: tuple[int, ...]
    low: Any
    high: Any
    absolute: bool = False
    middle: tuple[Any, Any] = (0.0, 0.0)
    free: bool = False

    @property
    def round(self) -> bool:
        """Whether it is a circle or ring."""
        return len(self.channels) > 1

    @property
    def box(self) -> list[tuple[int, Any, Any]]:
        """Each channel with its lowest and highest error, those of a circle by itself."""
        if not self.round:
            return [(self.output, self.low, self.high)]
        return [(k, part - self.high, part + self.high) for k, part in zip(self.channels, self.middle, strict=True)]

    def distance(self, errors: Floats) -> Floats:
        """Distance of errors, shape (channels, n), from the middle of the circle."""
        x, y = self.away(errors)
        return np.asarray(np.hypot(x, y))

    @property
    def origin(self) -> str:
        """From where a circle counts, in words."""
        return "the target" if np.any(self.middle) else "no error"

    def away(self, errors: Floats) -> tuple[Floats, Floats]:
        """The vector from the middle of the circle to errors, shape (channels, n)."""
        (one, other), (x, y) = self.channels, self.middle
        return errors[one] - x, errors[other] - y

    @property
    def output(self) -> int:
        """The first of its channels."""
        return self.channels[0]

    def at(self, poses: Any) -> ErrorBound:
        """The limit at one pose or some, by an index of the arrays of poses."""
        x, y = (at_rows(part, poses) for part in self.middle)
        return replace(self, low=at_rows(self.low, poses), high=at_rows(self.high, poses), middle=(x, y))


def targets_of(study: Study, name: str, limit: ErrorLimit, poses: Poses) -> Floats:
    """Targets of a limit by its coordinates, shape (1 or 2, poses), in the study's units; nan where there is none.

    One for all has shape (1 or 2,). Of several, one for each pose, places between the poses have none.

    Raises
    ------
    StudyError
        Where they are not as many as poses.
    """
    targets, size = limit.targets or (), 1 if limit.radius is None else 2
    parts = [target if isinstance(target, tuple) else (np.nan if target is None else target,) * size
             for target in targets]  # fmt: skip
    if len(parts) == 1:
        return np.stack(np.broadcast_arrays(*parts[0]))
    count = math.prod(poses.rule.grid)
    if len(parts) != count:
        where = f"{count} poses: give one for all, or one for each" if count else "a region: give one for all"
        message = f"{len(parts)} targets for {where}"
        raise StudyError((study.problem(message, "reliability", "limits", name, "target"),))
    table = np.stack([np.broadcast_arrays(*row, np.empty(poses.count))[:-1] for row in parts])
    row = np.round(poses.numbers).astype(np.intp)
    return np.where(poses.numbers == row, table[row, :, np.arange(poses.count)].T, np.nan)
