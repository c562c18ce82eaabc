"""Where the follower of a cam lifts off, in the poses or between them."""

from __future__ import annotations

from collections.abc import Iterator

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags
from mechdesign.mechanism.cams import CamFollower
from mechdesign.motion.followed import Followed
from mechdesign.motion.question import PoseValues, Remark
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.along import KinematicAlong

# Part of the forces by which a contact force is rounding.
PRESSED = 1e-9


def contacts(question: ForceQuestion) -> dict[str, str]:
    """By the coupling of each cam whose follower nothing pulls, such as a groove, the column of its contact force."""
    pairs = zip(question.forces, (contact.engaged for contact in question.joints.contacts), strict=True)
    return {
        cam.coupling: f"{name}.normal"
        for name, cam in pairs
        if isinstance(cam, CamFollower) and cam.given.side != "groove"
    }


def lifts(coupling: str, where: str) -> Remark:
    """What is said where the follower of a cam lifts off."""
    cure = "where it would have to be pulled; a spring holds it on the cam"
    return Remark("cam", f"cam {coupling}: the follower lifts off {where}, {cure}", "joint_forces")


def lifted(motion: PoseValues) -> Iterator[tuple[str, Remark, Flags]]:
    """By the coupling of each cam, what is said of poses in which its follower would have to be pulled, and which."""
    question = question_of(motion)
    for coupling, normal in contacts(question).items():
        remark = lifts(coupling, "at {number} of {count} poses")
        yield coupling, remark, motion.valid & (motion.arrays[normal] < -PRESSED * question.size)


def between(question: ForceQuestion, along: KinematicAlong, coupling: str, design: int) -> Iterator[Caution]:
    """The warning that the follower of a cam lifts off between the poses of a design."""
    column = contacts(question)[coupling]
    force, place = (end[design] for end in along.worst(column, -1))
    if force < -PRESSED * question.size:
        most = Followed(along, column, design).shown(float(place))
        yield Caution("cam", f"{lifts(coupling, 'between the poses').words}; by most at {most}", "joint_forces")
