"""Warnings about poses of a motion: those that stall, miss a target, or lie on a corner."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Flags
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.motion.question import PoseValues, Remark
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import POSES_AT_ONCE
from mechdesign.questions.kinematics import targets
from mechdesign.questions.kinematics.cams import outside
from mechdesign.questions.kinematics.instant_centres import REST, TRANSLATION
from mechdesign.questions.kinematics.moved import THROUGH
from mechdesign.questions.kinematics.question import KinematicQuestion
from mechdesign.questions.kinematics.values import RESTS, SINGULAR

STALLS = Remark(
    "singular", "{lie} at a dead centre or change point, where the drives do not move the mechanism in one way "
    f"(conditioning below {numeral(STALLED)}): velocities, accelerations, Jacobian and efforts are nan, as they mean "
    "nothing there",
)  # fmt: skip
LOST = Remark(
    "singular", "{lie} where no drive rates give what is asked: the drives cannot move it in every direction; rates "
    "are nan there",
)  # fmt: skip
MIXED = Remark(
    "undefined", "J mixes lengths and angles: inverse_condition is nan; give kinematics.characteristic_length",
    first=False,
)  # fmt: skip
# How two links without an instant centre within reach move against each other.
_CENTRELESS = {
    TRANSLATION: "one translates against the other: their instant centre is at infinity",
    REST: "neither moves against the other: they have no instant centre",
}
# How far a step of a motion may deviate from the direction of its rates, as a part of it.
ASTRAY = 1e-3


def unfollowed(poses: Poses) -> list[Caution]:
    """A warning of a motion that cannot be followed between its poses."""
    if not poses.followed:
        return []
    subject = f"the steps of {'the motion' if poses.rule.timed else poses.swept or 'the path'} are"
    return [Caution(
        "incomplete",
        f"{subject} too long for the motion between the poses to be followed, or too many: extremes are of the asked "
        "poses only, and limits of motion, singularities and links in line are not looked for; sweep fewer turns",
    )]  # fmt: skip


def valued(question: KinematicQuestion) -> list[str]:
    """Columns that have a value in every regular pose: outputs, and without friction the efforts."""
    statics = question.statics if question.friction is None else ()
    efforts = [static.name for static in statics if static.name.endswith("_effort")]
    return [*(output.name for output in question.outputs), *efforts]


def without_value(name: str) -> Remark:
    """What is said of valid poses at which an output has no value."""
    return Remark("undefined", f"{name} has no value in {{number}} of {{poses}}")


def marks_of(motion: PoseValues) -> dict[Remark, Flags]:
    """Poses that warnings are about."""
    question, valid, arrays = motion.question, motion.valid, motion.arrays
    steady = arrays["conditioning"] >= STALLED
    stalled = valid & ~arrays[THROUGH] & ~steady
    marks = dict[Remark, Flags]()
    if "inverse_condition" in arrays:
        marks[_singular(question)] = valid & steady & (question.mixed or _near(motion))
    marks[STALLS] = stalled
    if question.inverse:
        marks[LOST] = valid & ~stalled & np.isnan(arrays[f"{question.study.mechanism.drives[0]}_velocity"])
    if question.friction is not None:
        marks |= {remark: valid & where for remark, where in question.friction.marks(arrays).items()}
    marks |= outside(motion)
    for output, where in targets.untargeted(motion).items():
        words = (
            f"{{number}} of {{count}} poses lie where the target of {output} has no value: their {output}_error is nan"
        )
        marks[Remark("undefined", words)] = where
    for name in valued(question):
        marks[without_value(name)] = valid & steady & np.isnan(arrays[name])
    for centre in question.centres:
        for kind, text in _CENTRELESS.items():
            words = f"{centre.one} and {centre.other}: in {{number}} of {{count}} poses {text}"
            marks[Remark("undefined", words)] = valid & (arrays[f"{centre.name}.motion"].round() == kind)
    return marks


def _singular(question: KinematicQuestion) -> Remark:
    """What is said of poses at or near a singularity of the Jacobian."""
    if question.mixed:
        return MIXED
    if len(question.drives) == 1:
        still = f"{question.listed[0].name} stands still there, and det_J is 0"
        return Remark("singular", f"{{are}} at a dead centre: {still}", first=False)
    words = f"{{are}} at or near a singularity (inverse condition below {numeral(SINGULAR)})"
    return Remark("singular", words, first=False)


def _near(motion: PoseValues) -> Flags:
    """Poses at or near a singularity of the Jacobian."""
    question, arrays = motion.question, motion.arrays
    if len(question.drives) > 1:
        return np.asarray(~(arrays["inverse_condition"] >= SINGULAR))
    # A Jacobian of one entry has no condition: it is compared with a whole size of the mechanism a radian.
    (output,), (drive,) = question.listed, question.drives
    size = {"length": question.study.mechanism.size}
    still = np.abs(arrays["det_J"]) * size.get(drive.quantity, 1.0) / size.get(output.quantity, 1.0)
    # What a coupling holds at rest, such as a valve on its cam, is meant to stand still.
    return np.asarray((still < SINGULAR) & (arrays.get(RESTS, 0.0) != 1.0))


def astray(question: KinematicQuestion) -> list[Caution]:
    """A warning where rates that are the same for all poses lead away from the motion that the poses are."""
    study, section, poses = question.study, question.section, question.poses
    if not poses.followed or section.speed is not None or not set(section.rates) & set(poses.names):
        return []
    sizes = {"length": study.mechanism.size, "angle": 1 / study.units.angle_factor}
    unit = [1 / sizes.get(study.mechanism.quantity(name), 1.0) for name in poses.names]
    constant = poses.take(slice(1)).section(section).rates
    rates = np.array([np.sum(constant.get(name, 0.0)) * u for name, u in zip(poses.names, unit, strict=True)])
    if not rates.any():
        return []
    ahead, values, off = rates / np.linalg.norm(rates), poses.values, 0
    for begin in range(0, poses.count - 1, POSES_AT_ONCE):
        some = slice(begin, begin + POSES_AT_ONCE + 1)
        way = np.array([np.diff(values[name][some]) * u for name, u in zip(poses.names, unit, strict=True)])
        aside = np.linalg.norm(way - ahead[:, None] * (ahead @ way), axis=0)
        off += int(np.count_nonzero(aside > ASTRAY * np.linalg.norm(way, axis=0)))
    if not off:
        return []
    return [Caution(
        "suspect",
        f"{off} of {poses.count - 1} steps of the motion do not go where the rates of "
        f"{', '.join(poses.names)} lead: velocities and accelerations there are those of the rates, not of the motion "
        "drawn; 'speed' gives those of a point along its path",
        "motion",
    )]  # fmt: skip
