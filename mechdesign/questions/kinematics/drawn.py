"""What pictures of a motion need besides its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from mechdesign.questions.kinematics.along import Along
from mechdesign.questions.kinematics.limits import Limit
from mechdesign.questions.kinematics.loops import Toggle
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.special_poses import SpecialPoses, special_poses
from mechdesign.questions.poses import Shown
from mechdesign.results import Drawn


@dataclass(frozen=True, eq=False)
class DrawnMotion(Drawn):
    """The solved poses of a motion, and what makes some of them special.

    Parameters
    ----------
    shown : Shown
        The solved poses; of a long motion some, evenly spread.
    motion : Motion
        The motion with a value of every column at each pose.
    along : Along or None
        The motion between its poses; None of listed poses and grids.
    limits, toggles : sequence of Limit and of Toggle
        Ends of the motion, and poses at which two links come into line.
    modes : mapping of str to Shown
        The same poses in each assembly of the links that has a valid one, by its name; empty unless all were asked for.
    """

    shown: Shown
    motion: Motion
    along: Along | None
    limits: Sequence[Limit]
    toggles: Sequence[Toggle]
    modes: Mapping[str, Shown] = field(default_factory=dict)

    @cached_property
    def special(self) -> SpecialPoses:
        """Limits and toggles, with poses between where these are few; else the listed poses."""
        return special_poses(self.motion, self.shown, self.along, self.limits, self.toggles)
