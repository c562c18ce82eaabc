"""Warnings about poses of a motion: those that stall, miss a target, or lie on a corner."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.motion.passage import Mark
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import POSES_AT_ONCE
from mechdesign.numerics.arrays import Flags
from mechdesign.questions.kinematics import targets
from mechdesign.questions.kinematics.cams import beyond_profile, outside
from mechdesign.questions.kinematics.instant_centres import REST, TRANSLATION
from mechdesign.questions.kinematics.moved import THROUGH
from mechdesign.questions.kinematics.question import KinematicQuestion
from mechdesign.questions.kinematics.values import RESTS, SINGULAR
from mechdesign.questions.poses import pose_in_words
from mechdesign.statistics import no_value, no_value_along

_TABLE = "motion"  # whose rows are the poses
# Poses that warnings are about.
_STALLED = "stalled"
_LOST = "without drive rates"
_REGULAR = "regular"
_NEAR = "nearly singular"
_WITHOUT_TARGET = " without target"
_WITHOUT_VALUE = " without value"
# How two links without an instant centre within reach move against each other.
_CENTRELESS = {
    TRANSLATION: "one translates against the other: their instant centre is at infinity",
    REST: "neither moves against the other: they have no instant centre",
}
# How far a step of a motion may deviate from the direction of its rates, as a part of it.
ASTRAY = 1e-3


def remarks(question: KinematicQuestion, marks: Mapping[str, Mark]) -> list[Caution]:
    """Warnings about the poses of one design, and about its rates."""
    cautions = _conditioning(question, marks) + _stalled(question, marks) + _astray(question)
    if question.friction is not None:
        cautions += question.friction.cautions(question.study, question.poses, marks, _TABLE)
    cautions += beyond_profile(question.study, question.poses, marks, _TABLE)
    return cautions + _untargeted(question, marks)


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


def without_centre(question: KinematicQuestion, marks: Mapping[str, Mark]) -> list[Caution]:
    """What is to be known of poses in which two links have no instant centre within reach."""
    study, poses, warnings = question.study, question.poses, []
    for centre in question.centres:
        for kind, text in _CENTRELESS.items():
            rows, row = marks[f"{centre.name} {kind}"]
            if rows:
                where = f"in {rows} of {poses.count} poses"
                first = pose_in_words(study, poses, row)
                words = f"{centre.one} and {centre.other}: {where} {text}; the first: {first}"
                warnings.append(Caution("undefined", words, _TABLE, row, first))
    return warnings


def valued(question: KinematicQuestion) -> list[str]:
    """Columns that have a value in every regular pose: outputs, and without friction the efforts."""
    statics = question.statics if question.friction is None else ()
    efforts = [static.name for static in statics if static.name.endswith("_effort")]
    return [*(output.name for output in question.outputs), *efforts]


def without_value(
    question: KinematicQuestion, marks: Mapping[str, Mark], between: Mapping[str, float]
) -> list[Caution]:
    """Warnings of outputs that have no value at valid poses, or on parts of the motion `between` them."""
    study, poses, warnings = question.study, question.poses, []
    for name in valued(question):
        count, row = marks.get(f"{name}{_WITHOUT_VALUE}", (0, 0))
        if count:
            first = pose_in_words(study, poses, row)
            words = f"{name} has {no_value(count, poses.count)}; the first: {first}"
            warnings.append(Caution("undefined", words, _TABLE, row, first))
        elif part := between.get(name, 0.0):
            warnings.append(Caution("undefined", f"{name} has {no_value_along(part)}, between its poses", _TABLE))
    return warnings


def _untargeted(question: KinematicQuestion, marks: Mapping[str, Mark]) -> list[Caution]:
    """A warning where a valid pose has no target."""
    study, poses, warnings = question.study, question.poses, []
    for mark, (count, row) in marks.items():
        output = mark.removesuffix(_WITHOUT_TARGET)
        if output != mark and count:
            name, first = f"{output}_error", pose_in_words(study, poses, row)
            warnings.append(Caution(
                "undefined",
                f"{count} of {poses.count} poses lie where the target of {output} has no value: their "
                f"{name} is nan; the first: {first}",
                _TABLE, row, first,
            ))  # fmt: skip
    return warnings


def marks_of(motion: PoseValues) -> dict[str, Flags]:
    """Poses that warnings are about."""
    question, valid, arrays = motion.question, motion.valid, motion.arrays
    steady = arrays["conditioning"] >= STALLED
    stalled = valid & ~arrays[THROUGH] & ~steady
    marks = {_STALLED: stalled}
    if question.inverse:
        marks[_LOST] = valid & ~stalled & np.isnan(arrays[f"{question.study.mechanism.drives[0]}_velocity"])
    if "inverse_condition" in arrays:
        marks[_REGULAR] = valid & steady
        marks[_NEAR] = valid & steady & _near(motion)
    if question.friction is not None:
        marks |= {name: valid & where for name, where in question.friction.marks(arrays).items()}
    marks |= outside(motion)
    for output, where in targets.untargeted(motion).items():
        marks[f"{output}{_WITHOUT_TARGET}"] = where
    for name in valued(question):
        if (lost := valid & steady & np.isnan(arrays[name])).any():
            marks[f"{name}{_WITHOUT_VALUE}"] = lost
    for centre in question.centres:
        for kind in _CENTRELESS:
            marks[f"{centre.name} {kind}"] = valid & (arrays[f"{centre.name}.motion"].round() == kind)
    return marks


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


def _conditioning(question: KinematicQuestion, marks: Mapping[str, Mark]) -> list[Caution]:
    if _REGULAR not in marks:
        return []
    if marks[_REGULAR].number and question.mixed:
        mixed = "J mixes lengths and angles: inverse_condition is nan; give kinematics.characteristic_length"
        return [Caution("undefined", mixed, _TABLE)]
    count, row = marks[_NEAR]
    if not count:
        return []
    poses = "1 pose is" if count == 1 else f"{count} poses are"
    place = _TABLE, row, pose_in_words(question.study, question.poses, row)
    if len(question.drives) == 1:
        (output,) = question.listed
        still = f"{poses} at a dead centre: {output.name} stands still there, and det_J is 0"
        return [Caution("singular", still, *place)]
    near = f"{poses} at or near a singularity (inverse condition below {SINGULAR:g})"
    return [Caution("singular", near, *place)]


def _astray(question: KinematicQuestion) -> list[Caution]:
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
        _TABLE,
    )]  # fmt: skip


def _stalled(question: KinematicQuestion, marks: Mapping[str, Mark]) -> list[Caution]:
    texts = {
        _STALLED: "at a dead centre or change point, where the drives do not move the mechanism in one way "
        f"(conditioning below {STALLED:g}): velocities, accelerations, Jacobian and efforts are nan, as they mean "
        "nothing there",
        _LOST: "where no drive rates give what is asked: the drives cannot move it in every direction; rates are nan "
        "there",
    }
    warnings = []
    for name, text in texts.items():
        count, row = marks.get(name, Mark(0, 0))
        if count:
            lie = f"{count} poses lie" if count > 1 else "1 pose lies"
            first = pose_in_words(question.study, question.poses, row)
            warnings.append(Caution("singular", f"{lie} {text}; the first: {first}", _TABLE, row, first))
    return warnings
