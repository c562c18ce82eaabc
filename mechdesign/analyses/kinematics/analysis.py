"""How does it move? Positions, velocities, accelerations, Jacobians, drive efforts, extremes and limits of motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.boundaries import Boundary, motion_limits
from mechdesign.analyses.kinematics.instant_centres import MOTIONS, REST, TRANSLATION
from mechdesign.analyses.kinematics.lines import PoseLine
from mechdesign.analyses.kinematics.loops import functions, loops_table, toggles_table
from mechdesign.analyses.kinematics.motion import (
    Motion,
    MotionQuestion,
    entry,
    motion_question,
    move,
)
from mechdesign.analyses.kinematics.peaks import extremes, needed
from mechdesign.analyses.kinematics.special_poses import special_poses
from mechdesign.analyses.poses import Keeper, Shown, judge_failures, pose_in_words
from mechdesign.errors import Problem, StudyError
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.mechanism.four_bars import four_bars
from mechdesign.numerics.arrays import Flags
from mechdesign.parallel import one_thread
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Below this inverse condition the determinant and what is solved with it have lost about half of their digits.
SINGULAR = 1e-8
# Assembly modes that a picture shows at most.
MAX_DRAWN_MODES = 12
# How far a step of a motion may deviate from the direction of its rates, as a part of it.
ASTRAY = 1e-3


@one_thread()
def kinematics(
    study: Study,
    *,
    seed: int | None = None,
    jobs: int | None = 1,
    progress: Progress = NULL,
    all_modes: bool = False,
) -> Result:
    """Solve every pose of the study's kinematics.

    Parameters, tables and errors are told at `mechdesign.kinematics`, the door to it.
    """
    question = motion_question(study)
    poses = question.poses
    if all_modes and len(poses.groups) > 1:
        message = "the poses give different coordinates, and each set has modes of its own; list one set for all modes"
        raise StudyError((Problem(message, "kinematics.poses", str(study.path or "")),))
    progress.start(poses.count, "poses")
    keeper = Keeper(study, poses)
    motion = move(question, progress, jobs, also=keeper.keep)
    warnings, failed = judge_failures(study, poses, motion.reason)
    warnings += (
        _conditioning(motion)
        + _stalled(motion)
        + _astray(motion)
        + targets.gaps(study, motion.errors, poses, motion.valid)
    )
    tables, swept, ends, resolved = {"motion": motion_table(motion)}, swept_of(poses), list[Boundary](), True
    if swept is not None:
        limits, told, ends, resolved = motion_limits(motion, swept)
        warnings += told
    between, torn = tables_between(motion, ends)
    if torn.any() or not resolved:
        warnings.append(
            f"the steps of {swept} are too long for the motion between the poses: limits, extremes and toggles there "
            "may be missing; sweep in smaller steps, or less far"
        )
    tables["extremes"] = between["extremes"]
    if swept is not None:
        tables["limits"] = limits
    tables |= between
    if motion.errors:
        tables["targets"] = targets_table(motion)
    if question.square:
        tables["jacobian"] = jacobian_table(motion)
    if question.centres:
        tables["instant_centres"] = centres_table(motion)
        warnings += _without_centre(motion)
    counts = {"poses": poses.count, "invalid": int(np.count_nonzero(motion.reason))}
    drawn: dict[str, Any] = {"poses": poses, "motion": keeper.shown}
    drawn["special"] = special_poses(motion, keeper.shown, swept, ends, tables.get("toggles"))
    if all_modes:
        tables["modes"], told, counts["modes"], drawn["modes"] = _modes(question, motion, keeper.shown)
        warnings += told
    return Result("kinematics", tables, warnings, counts, failed, drawn=drawn, absent=question.absent)


def _modes(question: MotionQuestion, drawn: Motion, shown: Shown) -> tuple[Table, list[str], int, dict[str, Shown]]:
    """The motion of every assembly, the sketch's first; warnings, the number of assemblies, and some to draw."""
    study, poses = question.study, question.poses
    found = assemblies(study.mechanism, poses.groups[0].names)
    labels: list[str] = []
    parts: list[Sequence[Column]] = []
    warnings = []
    pictured: dict[str, Shown] = {}
    for assembly in sorted(found, key=lambda assembly: not assembly.drawn):
        motion, seen = drawn, shown
        if not assembly.drawn:
            other = motion_question(dataclasses.replace(study, mechanism=assembly.mechanism))
            keeper = Keeper(other.study, other.poses)
            motion = move(other, also=keeper.keep)
            seen = keeper.shown
        if seen.configuration.valid.any() and len(pictured) < MAX_DRAWN_MODES:
            pictured[f"{assembly.label} (as drawn)" if assembly.drawn else assembly.label] = seen
        labels += [assembly.label] * poses.count
        parts.append(motion.columns())
        bad = int(np.count_nonzero(motion.reason))
        if bad:
            warnings.append(
                f"mode {assembly.label}: no pose is valid in this assembly"
                if bad == poses.count
                else f"mode {assembly.label}: {bad} of {poses.count} poses are not valid in this assembly"
            )
    columns = [Column("mode", np.array(labels), "", "assembly: the joints that choose it and their sides")]
    for same in zip(*parts, strict=True):
        columns.append(dataclasses.replace(same[0], values=np.concatenate([column.values for column in same])))
    return Table("modes", tuple(columns), "the motion of every assembly mode"), warnings, len(parts), pictured


def swept_of(poses: Poses) -> str | None:
    """The one coordinate that moves along a sweep; None of listed poses, and where several do."""
    moving = [name for name in poses.names if np.ptp(poses.values[name]) > 0]
    return moving[0] if not poses.listed and len(moving) == 1 else None


def motion_table(motion: Motion) -> Table:
    """Every pose with all outputs."""
    return Table("motion", tuple(motion.columns()), "positions, velocities and accelerations per pose")


def tables_between(
    motion: Motion, ends: Sequence[Boundary] = (), wanted: Collection[str] = ("extremes", "loops", "toggles"),
    names: Collection[str] | None = None,
) -> tuple[dict[str, Table], Flags]:  # fmt: skip
    """Tables of what happens between the poses of a sweep, too.

    Parameters
    ----------
    ends : sequence of Boundary
        Limits of motion, of a single design.
    names : collection of str, optional
        Outputs and errors whose extremes between the poses are wanted; all where left out.

    Returns
    -------
    (dict of str to Table, bool array of shape (designs,))
        Tables ``extremes``, ``loops`` where there are four-bars and slider-cranks, and of a sweep their ``toggles``;
        and the designs whose motion ends where no limit is known, so that the tables do not answer for them.
    """
    poses, swept, line = motion.question.poses, swept_of(motion.question.poses), None
    loops = four_bars(motion.question.study.mechanism) if {"loops", "toggles"} & set(wanted) else ()
    torn = np.zeros(poses.designs, dtype=bool)
    if swept is not None and (loops or "extremes" in wanted):
        coordinates = needed(motion, names) if "extremes" in wanted else []
        line = PoseLine(motion, swept, coordinates, functions(loops, "toggles" in wanted), ends)
    tables = {}
    if "extremes" in wanted:
        tables["extremes"] = extremes(motion, swept, line, names)
    if loops:
        tables["loops"] = loops_table(motion, loops, line)
    if loops and line is not None and "toggles" in wanted:
        tables["toggles"] = toggles_table(motion, loops, line)
    return tables, torn if line is None else line.torn


def targets_table(motion: Motion) -> Table:
    """Errors against the targets."""
    poses = motion.question.poses
    return targets.table(motion.question.study, motion.errors, poses, swept_of(poses), motion.valid)


def jacobian_table(motion: Motion) -> Table:
    """Every entry of the Jacobian, a row a pose."""
    question = motion.question
    columns = motion.pose_columns()
    for output in question.listed:
        for drive in question.drives:
            name = entry(output, drive)
            meaning = f"derivative of {output.name} by {drive.name}, angles in radians"
            columns.append(Column(name, motion.arrays[name], _per(question.study, output, drive), meaning))
    columns += shared(question.study.units, valid=motion.valid)
    return Table("jacobian", tuple(columns), "derivatives of outputs by the drives, per radian")


def centres_table(motion: Motion) -> Table:
    """Instant centres of pairs of links, a row a pose."""
    length, columns = motion.question.study.units.label("length"), motion.pose_columns()
    for centre in motion.question.centres:
        pair = f"{centre.one} and {centre.other}"
        for axis in "xy":
            meaning = f"place of the instant centre of {pair}; inf where one translates against the other"
            columns.append(Column(f"{centre.name}.{axis}", motion.arrays[f"{centre.name}.{axis}"], length, meaning))
        numbers = np.nan_to_num(motion.arrays[f"{centre.name}.motion"]).round().astype(int)
        meaning = f"how {centre.one} moves against {centre.other}: rotation, translation or rest"
        columns.append(Column(f"{centre.name}.motion", np.array(MOTIONS)[numbers], "", meaning))
    columns += shared(motion.question.study.units, valid=motion.valid)
    return Table("instant_centres", tuple(columns), "instant centres of velocity of pairs of links")


def _without_centre(motion: Motion) -> list[str]:
    """What is to be known of poses in which two links have no instant centre within reach."""
    study, poses, warnings = motion.question.study, motion.question.poses, []
    for centre in motion.question.centres:
        for kind, text in (
            (TRANSLATION, "one translates against the other: their instant centre is at infinity"),
            (REST, "neither moves against the other: they have no instant centre"),
        ):
            rows = np.flatnonzero(motion.valid & (motion.arrays[f"{centre.name}.motion"].round() == kind))
            if len(rows):
                where = f"in {len(rows)} of {poses.count} poses"
                first = pose_in_words(study, poses, int(rows[0]))
                warnings.append(f"{centre.one} and {centre.other}: {where} {text}; the first: {first}")
    return warnings


def _per(study: Study, output: Coordinate, drive: Coordinate) -> str:
    """Unit of a derivative; angles in radians whatever the study's unit."""
    above, below = (
        {"length": study.units.label("length"), "angle": "rad"}.get(c.quantity, "") for c in (output, drive)
    )  # fmt: skip
    if above == below:
        return ""
    return f"{above or '1'}/{below}" if below else above


def _conditioning(motion: Motion) -> list[str]:
    if "inverse_condition" not in motion.arrays:
        return []
    values = motion.arrays["inverse_condition"]
    regular = motion.valid & (motion.arrays["conditioning"] >= STALLED)
    if regular.any() and motion.question.mixed:
        return ["J mixes lengths and angles: inverse_condition is nan; give kinematics.characteristic_length"]
    if len(motion.question.drives) == 1:
        # A Jacobian of one entry has no condition: it is compared with a whole size of the mechanism a radian.
        (output,), (drive,) = motion.question.listed, motion.question.drives
        size = {"length": motion.question.study.mechanism.size}
        still = np.abs(motion.arrays["det_J"]) * size.get(drive.quantity, 1.0) / size.get(output.quantity, 1.0)
        count = np.count_nonzero(regular & (still < SINGULAR))
        poses = "1 pose is" if count == 1 else f"{count} poses are"
        return [f"{poses} at a dead centre: {output.name} stands still there, and det_J is 0"] if count else []
    count = np.count_nonzero(regular & ~(values >= SINGULAR))
    poses = "1 pose is" if count == 1 else f"{count} poses are"
    return [f"{poses} at or near a singularity (inverse condition below {SINGULAR:g})"] if count else []


def _astray(motion: Motion) -> list[str]:
    """A warning where rates that are the same for all poses lead away from the motion that the poses are."""
    study, section, poses = motion.question.study, motion.question.section, motion.question.poses
    if not poses.motion or section.speed is not None or not set(section.rates) & set(poses.names):
        return []
    sizes = {"length": study.mechanism.size, "angle": 1 / study.units.angle_factor}
    unit = [1 / sizes.get(study.mechanism.quantity(name), 1.0) for name in poses.names]
    way = np.array([np.diff(poses.values[name]) * u for name, u in zip(poses.names, unit, strict=True)])
    rates = np.array([section.rates.get(name, 0.0) * u for name, u in zip(poses.names, unit, strict=True)])
    if not rates.any():
        return []
    ahead = rates / np.linalg.norm(rates)
    off = np.linalg.norm(way - ahead[:, None] * (ahead @ way), axis=0) > ASTRAY * np.linalg.norm(way, axis=0)
    if not off.any():
        return []
    return [
        f"{np.count_nonzero(off)} of {len(off)} steps of the motion do not go where the rates of "
        f"{', '.join(poses.names)} lead: velocities and accelerations there are those of the rates, not of the motion "
        "drawn; 'speed' gives those of a point along its path"
    ]


def _stalled(motion: Motion) -> list[str]:
    study, poses = motion.question.study, motion.question.poses
    stalled = motion.valid & ~motion.smooth & ~(motion.arrays["conditioning"] >= STALLED)
    texts = {
        "at a dead centre or change point, where the drives do not move the mechanism in one way (conditioning below "
        f"{STALLED:g}): velocities, accelerations, Jacobian and efforts are nan, as they mean nothing there": stalled
    }
    if motion.question.of_given:
        lost = np.isnan(motion.arrays[f"{study.mechanism.drives[0]}_velocity"])
        text = (
            "where no drive rates give what is asked: the drives cannot move it in every direction; rates are nan there"
        )
        texts[text] = motion.valid & ~stalled & lost
    warnings = []
    for text, where in texts.items():
        rows = np.flatnonzero(where)
        if len(rows):
            lie = f"{len(rows)} poses lie" if len(rows) > 1 else "1 pose lies"
            warnings.append(f"{lie} {text}; the first: {pose_in_words(study, poses, rows[0])}")
    return warnings
