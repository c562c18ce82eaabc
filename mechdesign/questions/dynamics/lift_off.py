"""Where the follower of a cam lifts off."""

from __future__ import annotations

from collections.abc import Iterator

from mechdesign.cautions import Caution
from mechdesign.mechanism.cams import Cam
from mechdesign.numerics.arrays import Flags
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.passage import Mark
from mechdesign.questions.poses import pose_in_words
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Part of the forces by which a contact force is rounding.
PRESSED = 1e-9


def lifted(motion: Motion) -> Iterator[tuple[str, Flags]]:
    """By the coupling of each cam, the poses in which its follower would have to be pulled; a groove pulls it."""
    question = question_of(motion)
    for name, contact in zip(question.forces, question.joints.contacts, strict=True):
        cam = contact.engaged
        if isinstance(cam, Cam) and cam.given.side != "groove":
            pulled = motion.arrays[f"{name}.normal"] < -PRESSED * question.size
            yield cam.coupling, motion.valid & pulled


def caution(study: Study, poses: Poses, coupling: str, mark: Mark, design: int = 0) -> Caution:
    """The warning that the follower of a cam lifts off in some poses of a design."""
    count = poses.count // poses.designs
    first = pose_in_words(study, poses, mark.first + design * count)
    message = (
        f"cam {coupling}: the follower lifts off at {mark.number} of {count} poses, where it would have to be pulled; "
        f"a spring holds it on the cam; the first: {first}"
    )
    return Caution("cam", message, "joint_forces", mark.first, first)
