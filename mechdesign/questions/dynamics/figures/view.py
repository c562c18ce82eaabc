"""What pictures of dynamics show."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mechdesign.drawing.joints import NOTHING, JointLoad, loaded, peak
from mechdesign.drawing.pictures import PosesView
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.numerics.rounding import STILL
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics.analysis import DrawnForces
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.state_in_time import STANDSTILL
from mechdesign.questions.dynamics.tables import question_of


class DynamicsView(PosesView):
    """The forces of a motion, or of poses one by one."""

    @cached_property
    def drawn(self) -> DrawnForces:
        """The solved poses and the columns of the motion, with as many poses as curves need."""
        return DrawnForces.of(self.result).finer

    @property
    def question(self) -> ForceQuestion:
        """The question about the forces."""
        return question_of(self.drawn.motion)

    @property
    def poses(self) -> Poses:
        """The poses of the columns."""
        return self.drawn.shown.poses

    @cached_property
    def singular(self) -> bool:
        """Whether forces grow without bound somewhere along the motion."""
        extremes = self.result.tables["extremes"]
        return not np.isfinite(extremes["peak"]).all()

    def column(self, name: str) -> Floats:
        """A column at every pose, nan where it has no value."""
        values = self.drawn.motion.arrays[name]
        return np.where(self.drawn.motion.valid & np.isfinite(values), values, np.nan)

    def moves(self, name: str) -> bool:
        """Whether a column is more than rounding, and not the same everywhere."""
        values = self.column(name)
        finite = values[np.isfinite(values)]
        return len(finite) > 0 and float(np.ptp(finite)) > STILL * float(np.abs(finite).max())

    def broken(self, values: Floats) -> tuple[Floats, Floats]:
        """Times and values of a motion in time, with a gap where it bounces off a limit."""
        times, events = self.result.tables["forward"]["time"], self.result.tables["events"]
        others = [*self.question.section.forward.events, STANDSTILL] if self.question.section.forward else []
        bounces = events["time"][np.isfinite(events["time"]) & ~np.isin(events["event"], others)]
        places = np.searchsorted(times, bounces)
        return np.insert(times, places, bounces), np.insert(values, places, np.nan)

    def force(self, name: str) -> Complexes:
        """A joint's force at every pose, by its name, or the shaking force."""
        return np.asarray(self.column(f"{name}x") + 1j * self.column(f"{name}y"))

    @cached_property
    def joints(self) -> tuple[list[JointLoad], list[JointLoad]]:
        """Joints that bear a force, and joints that bear a moment, the most loaded first."""
        forces, moments = [], []
        for name, contact in zip(self.question.forces, self.question.joints.contacts, strict=True):
            words = f"on {contact.on} by {contact.by}"
            called = name.replace("_force", "", 1).replace("_on_", " on ")
            forces.append(JointLoad(called, words, self.force(f"{name}.f")[:, None]))
            if not contact.turns:
                moments.append(JointLoad(called, words, self.column(f"{name}.moment")[:, None]))
        largest = peak(forces)
        least = NOTHING * max(largest * self.study.mechanism.size, peak(moments))
        return loaded(forces, NOTHING * largest), loaded(moments, least)
