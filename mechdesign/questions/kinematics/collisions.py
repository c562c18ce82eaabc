"""Where plates come nearest to each other along a motion, or overlap most."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import counted
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.plates import Pair
from mechdesign.motion.question import PoseValues
from mechdesign.motion.solving import solve_rows
from mechdesign.questions.kinematics.along import KinematicAlong

_DIGITS = 4


class Meeting(NamedTuple):
    """Two items in the pose in which they are nearest: their clearance, the pose in words, and its place in rows."""

    pair: Pair
    clearance: float
    where: str
    place: float

    @property
    def names(self) -> str:
        """Both items."""
        return f"{self.pair.one} and {self.pair.other}"


def meetings(values: PoseValues, along: KinematicAlong | None, design: int = 0) -> list[Meeting]:
    """The items whose clearances are asked, each two in their nearest pose of a design's motion; the nearest first."""
    question = values.question
    motion, count = question.motion, len(values.reason) // question.poses.designs
    own, nearest = slice(design * count, (design + 1) * count), list[Meeting]()
    for name, pair in question.pairs.items():
        rows = np.where(values.valid[own], values.arrays[name][own], np.nan)
        if not np.isfinite(rows).any():
            continue
        row = int(np.nanargmin(rows))
        meeting = Meeting(pair, float(rows[row]), motion.in_words(design * count + row, _DIGITS), float(row))
        if along is not None and name in along.columns and not along.curve.spent[design]:
            value, place = (float(ends[design]) for ends in along.worst(name, -1))
            if np.isfinite(place):
                there = along.curve.motion.at(along.curve.poses.along(np.array([design]), np.array([place])))
                meeting = Meeting(pair, value, there.in_words(0, _DIGITS), place)
        nearest.append(meeting)
    return sorted(nearest, key=lambda meeting: meeting.clearance)


def posed(meeting: Meeting, values: PoseValues, along: KinematicAlong | None) -> Configuration:
    """The mechanism of the first design in the pose of a meeting, a batch of one."""
    if along is None:
        return solve_rows(values.question.motion, np.array([round(meeting.place)]))
    line, s = np.zeros(1, dtype=np.intp), np.array([meeting.place])
    return along.curve.solve(line, along.curve.inside(line, s), judged=False).configuration


def collision(values: PoseValues, along: KinematicAlong | None, design: int, unit: str) -> list[Caution]:
    """A warning of plates that overlap along the motion of a design: which most, how deep and in which pose."""
    overlaps = [meeting for meeting in meetings(values, along, design) if meeting.clearance < 0]
    if not overlaps:
        return []
    worst = overlaps[0]
    words = f"{worst.names} overlap by {-worst.clearance:.4g} {unit} at {worst.where}"
    if len(overlaps) > 1:
        words = f"{counted(len(overlaps), 'pair')} of plates overlap, most of all {words.replace(' overlap ', ' ', 1)}"
    return [Caution("collision", words, "motion", pose=worst.where)]
