"""Where the follower of a cam lifts off, in the poses or between them."""

from __future__ import annotations

from collections.abc import Iterator

from mechdesign.cautions import Caution
from mechdesign.mechanism.cams import CamFollower
from mechdesign.motion.followed import Followed
from mechdesign.motion.passage import Mark
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.numerics.arrays import Flags
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.poses import pose_in_words
from mechdesign.study import Study

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


def lifted(motion: PoseValues) -> Iterator[tuple[str, Flags]]:
    """By the coupling of each cam, the poses in which its follower would have to be pulled."""
    question = question_of(motion)
    for coupling, normal in contacts(question).items():
        yield coupling, motion.valid & (motion.arrays[normal] < -PRESSED * question.size)


def between(question: ForceQuestion, along: KinematicAlong, coupling: str, design: int) -> Iterator[Caution]:
    """The warning that the follower of a cam lifts off between the poses of a design."""
    column = contacts(question)[coupling]
    force, place = (end[design] for end in along.worst(column, -1))
    if force < -PRESSED * question.size:
        most = Followed(along, column, design).shown(float(place))
        message = (
            f"cam {coupling}: the follower lifts off between the poses, where it would have to be pulled; "
            f"a spring holds it on the cam; by most at {most}"
        )
        yield Caution("cam", message, "joint_forces")


def caution(study: Study, poses: Poses, coupling: str, mark: Mark, design: int = 0) -> Caution:
    """The warning that the follower of a cam lifts off in some poses of a design."""
    count = poses.count // poses.designs
    first = pose_in_words(study, poses, mark.first + design * count)
    message = (
        f"cam {coupling}: the follower lifts off at {mark.number} of {count} poses, where it would have to be pulled; "
        f"a spring holds it on the cam; the first: {first}"
    )
    return Caution("cam", message, "joint_forces", mark.first, first)
