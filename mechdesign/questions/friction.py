"""Friction at solved poses: the equilibrium with it, efficiencies, and what is to be said of poses that jam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value, largest
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.friction import Rubbing, Rubs, efficiency, rubbings
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.mechanism.statics import Balance, Reaction
from mechdesign.motion.question import Remark
from mechdesign.study.schema.loads import EFFICIENCIES

# Columns that no table has: one more than the number of the joint, 0 where there is nothing to be said.
_JAMS, _HOLDS = "jams in", "is held by"
# Another: how far a pose is from jamming, from 0 to 1; forces lose so many digits.
APART = "apart from jamming"
# Efforts without friction, with the drive's name behind it.
SMOOTH = "effort without friction of"
# A slide bears a moment of note from this part of the largest joint force times the size of the mechanism.
NOTABLE_MOMENT = 0.01
# The mechanism is called self-locking where friction holds it in at least this part of the poses: at a dead centre, and
# against inertia, friction holds every mechanism.
OFTEN = 0.5
_MOMENT = "moment without length"
# What is said of poses by these columns of a joint, whose name stands for `JOINT`.
_REMARKS = (
    (_JAMS, Remark("jammed", "in {number} of {count} poses friction in JOINT jams the mechanism: no effort of the "
     "drives moves it on, and efforts and joint forces are nan; a longer guide, a smaller offset or coefficient "
     "frees it")),
    (_HOLDS, Remark("self_locking", "in {number} of {count} poses friction holds what the loads would move, most of it "
     "in JOINT: the mechanism is self-locking there, and the drives must push in either direction", least=OFTEN)),
    (_MOMENT, Remark("incomplete", "in {number} of {count} poses JOINT bears a moment, which presses on both ends of "
     "its guide, and its friction counts the force across alone; give its 'length'")),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Slipping:
    """Poses in equilibrium with friction: `columns` are efficiencies, power, and marks."""

    balance: Balance
    reactions: list[Reaction]
    columns: Mapping[str, Value]

    @property
    def efforts(self) -> list[Value]:
        """Efforts of the drives."""
        return self.balance.efforts


class JointFriction:
    """Friction in the joints of a mechanism, compiled once."""

    def __init__(self, mechanism: Mechanism, joints: Joints) -> None:
        self.mechanism, self.joints = mechanism, joints
        self.contacts: list[Rubbing] = [*rubbings(joints, mechanism.description.friction)]
        #: Joints with friction, by which marks count.
        self.names = list(dict.fromkeys(contact.joint for contact in self.contacts))
        self._number = np.array([self.names.index(contact.joint) + 1 for contact in self.contacts])

    def solve(
        self, linear: Linearization, forces: Forces, velocity: Rates | None, *, back: bool = True,
        given: Floats | None = None,
    ) -> Slipping:  # fmt: skip
        """Equilibrium under forces while the mechanism moves; where it stands still, as if all drives moved up.

        With `back` also what it does on its way back. Friction that is `given`, shape (contacts, poses), is that of a
        motion in time, and no way back is asked.
        """
        mechanism, moves = self.mechanism, velocity is not None
        drives = [mechanism.coordinate(name) for name in mechanism.drives]
        if velocity is None:
            velocity = linear.velocity([1.0 if c.quantity == "angle" else mechanism.size for c in drives])
        rates = [first(linear.configuration, drive, velocity) for drive in drives]
        rubs = Rubs(self.joints, self.contacts, linear, forces, mechanism.engaged, mechanism.size)
        ahead = rubs.solve(velocity) if given is None else rubs.given(given, velocity)
        ways = [ahead, rubs.solve(velocity, back=True)] if back and given is None else [ahead]
        columns: dict[str, Value] = dict.fromkeys(EFFICIENCIES, np.nan)
        if given is None:
            smooth = zip(mechanism.drives, rubs.smooth.efforts, strict=True)
            columns |= {f"{SMOOTH} {name}": effort for name, effort in smooth}
        holds: Value = 0.0
        for name, rubbed, sign in zip(EFFICIENCIES, ways, (1.0, -1.0), strict=False):
            lost = np.sum(rubbed.power, axis=0)
            ratio = efficiency(rubbed.balance.efforts, [sign * rate for rate in rates], lost)
            columns[name] = ratio.value
            holds = np.where(ratio.holds, self._number[np.nan_to_num(-rubbed.power).argmax(axis=0)], holds)
        if moves:
            columns["friction_power"] = np.sum(ahead.power, axis=0)
        columns |= {_JAMS: np.where(ahead.jams < 0, 0, self._number[ahead.jams]), _HOLDS: holds}
        columns[APART] = np.min([np.where(way.jams < 0, way.apart, 1.0) for way in ways], axis=0)
        whole = rubs.reactions(ahead)
        columns[_MOMENT] = self._moments_without_length(whole)
        return Slipping(ahead.balance, whole, columns)

    def _moments_without_length(self, whole: Sequence[Reaction]) -> Value:
        """One more than the number of a slide that bears a moment, which its friction leaves out; else 0."""
        number: Value = 0.0
        force = largest(np.abs(reaction.force) for reaction in whole)
        for contact, own in zip(self.contacts, self._number.tolist(), strict=True):
            joint, reaction = self.joints.contacts[contact.contact], whole[contact.contact]
            if joint.slides and contact.friction.length is None:
                large = np.abs(reaction.moment) > NOTABLE_MOMENT * force * self.mechanism.size
                number = np.where(large, own, number)
        return number

    def marks(self, arrays: Mapping[str, Floats]) -> dict[Remark, Flags]:
        """Poses of which something is to be said."""
        return {
            replace(remark, words=remark.words.replace("JOINT", name)): np.equal(arrays[what], k)
            for k, name in enumerate(self.names, 1)
            for what, remark in _REMARKS
        }

    def jammed(self, arrays: Mapping[str, Floats]) -> Flags:
        """Poses in which the mechanism jams."""
        return np.asarray(arrays[_JAMS] > 0)
