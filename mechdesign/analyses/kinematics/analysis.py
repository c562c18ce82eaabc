"""How does it move? Positions, velocities, accelerations, Jacobians, drive efforts, extremes and limits of motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from functools import cache, partial
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.columns import shared
from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.along import Along
from mechdesign.analyses.kinematics.extremes import extremes, targets_table
from mechdesign.analyses.kinematics.instant_centres import MOTIONS, REST, TRANSLATION
from mechdesign.analyses.kinematics.limits import (
    Limit,
    change_points,
    hidden,
    limits_of,
    limits_table,
    passed,
)
from mechdesign.analyses.kinematics.loops import Toggle, loops_table, toggles_of, toggles_table
from mechdesign.analyses.kinematics.motion import Motion, MotionQuestion, entry, motion_question
from mechdesign.analyses.kinematics.passage import Mark, Passage, pass_over
from mechdesign.analyses.kinematics.special_poses import special_poses
from mechdesign.analyses.poses import POSES_AT_ONCE, Shown, invalid_in_words, judge_failures, pose_in_words
from mechdesign.errors import Problem, StudyError, counted
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.numerics.arrays import Flags
from mechdesign.parallel import one_thread
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, LongTable, Result, Scope, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Below this inverse condition the determinant and what is solved with it have lost about half of their digits.
SINGULAR = 1e-8
# Assembly modes that a picture shows at most.
MAX_DRAWN_MODES = 12
# Poses that warnings are about.
_STALLED = "stalled"
_LOST = "without drive rates"
_REGULAR = "regular"
_NEAR = "nearly singular"
_WITHOUT_TARGET = " without target"
# How two links without an instant centre within reach move against each other.
_CENTRELESS = {
    TRANSLATION: "one translates against the other: their instant centre is at infinity",
    REST: "neither moves against the other: they have no instant centre",
}
# How far a step of a motion may deviate from the direction of its rates, as a part of it.
ASTRAY = 1e-3
# A path has a corner where its direction (of length one) differs by more from that so many rows before.
TURNED, BEFORE_CORNER = 1e-6, 1e-9


@one_thread()
def kinematics(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL, all_modes: bool = False
) -> Result:
    """Solve every pose of the study's kinematics; see `mechdesign.kinematics`."""
    question = motion_question(study)
    poses = question.poses
    if all_modes and len(poses.groups) > 1:
        message = "the poses give different coordinates, and each set has modes of its own; list one set for all modes"
        raise StudyError((Problem(message, "kinematics.poses", str(study.path or "")),))
    progress.start(poses.count, "poses")
    passage = pass_over(question, _marks, progress, jobs)
    motion, marks = passage.motion, passage.marks
    warnings, failed = judge_failures(study, poses, passage.reason)
    warnings += _conditioning(question, marks) + _stalled(question, marks) + _astray(question) + _corners(question)
    warnings += _untargeted(question, marks)
    loops = four_bars(study.mechanism)
    along = along_of(question, loops=loops, toggles=True, passages=True)
    tables = {"motion": motion_table(motion), "extremes": extremes(motion, along)}
    limits: list[Limit] = []
    toggles: list[Toggle] = []
    if along is not None:
        limits, toggles = limits_of(along), toggles_of(loops, along)
        tables["limits"] = limits_table(limits, along)
        warnings += hidden(limits, along, np.equal(passage.reason, 0)) + passed(limits, along) + change_points(along)
    if poses.followed and along is None:
        warnings.append(_unfollowed(poses))
    elif along is not None and along.functions.unresolved.any():
        warnings.append(
            "the motion between the poses is too long, or too rough, to be followed closely: its limits are known, but "
            "extremes may lie between the places that were looked at; sweep less of it"
        )
    if loops:
        tables["loops"] = loops_table(question, loops, along)
        if along is not None:
            tables["toggles"] = toggles_table(toggles, along)
    if motion.errors:
        tables["targets"] = targets_table(motion, along, passage.sums)
    if question.square:
        tables["jacobian"] = jacobian_table(motion)
    if question.centres:
        tables["instant_centres"] = centres_table(motion)
        warnings += _without_centre(question, marks)
    whole, own = scopes_of(question, along, passage.reason)
    tables = {
        name: dataclasses.replace(table, scope=own if name in A_ROW_A_POSE else whole) for name, table in tables.items()
    }
    counts = {"poses": poses.count, "invalid": int(np.count_nonzero(passage.reason))}
    drawn: dict[str, Any] = {"poses": motion.question.poses, "motion": passage.shown}
    drawn["special"] = special_poses(motion, passage.shown, along, limits, toggles)
    if all_modes:
        modes, told, counts["modes"], drawn["modes"] = _modes(passage, jobs)
        tables["modes"] = modes
        warnings += told
    result = Result("kinematics", tables, warnings, counts, failed, drawn=drawn, absent=question.absent)
    if not passage.long:
        return result
    long = {name: passage.table(make, jobs, own) for name, make in A_ROW_A_POSE.items() if name in tables}
    return dataclasses.replace(result, tables=tables | long, pictured=result)


def along_of(
    question: MotionQuestion, names: Collection[str] | None = None, loops: Sequence[FourBar] = (), *,
    also: Collection[str] = (), toggles: bool = False, passages: bool = False,
) -> Along | None:  # fmt: skip
    """The motions of a question between their poses; None of listed poses and grids, and where none can be followed."""
    curve = question.curve
    if curve is None or curve.spent.all():
        return None
    return Along(question, curve, names, loops, also=also, toggles=toggles, passages=passages)


def scopes_of(question: MotionQuestion, along: Along | None, reason: NDArray[np.int8]) -> tuple[Scope, Scope]:
    """What tables say of the motion as a whole, and those with a row a pose."""
    missing = [invalid_in_words(reason)]
    if along is not None and not along.whole[0]:
        missing.append(f"{100 * (1 - along.present[0]):.3g} % of the motion is missing")

    @cache
    def followed(name: str) -> Along | None:
        return along_of(question, [name])

    def worst(name: str, sign: int, absolute: bool) -> tuple[float, str] | None:
        own = followed(name)
        if own is None or own.curve.spent[0] or not own.follows(name):
            return None
        value, place = own.worst(name, sign, absolute=absolute)
        given = question.poses.along(np.array([0]), place).values
        moving = [question.poses.swept] if question.poses.swept is not None else given
        return float(value[0]), ", ".join(f"{name} {float(given[name][0]) + 0.0:.6g}" for name in moving)

    closely = along is not None and not along.functions.unresolved.any()
    whole = Scope(not closely, " and ".join(filter(None, missing)))
    return whole, dataclasses.replace(whole, worst=worst)


def _unfollowed(poses: Poses) -> str:
    """A warning of a motion that cannot be followed between its poses."""
    what = f"the steps of {poses.swept} are" if poses.swept is not None else "the steps of the path are"
    return (
        f"{what} too long for the motion between the poses to be followed, or too many: extremes are of the asked "
        "poses only, and limits of motion, singularities and links in line are not looked for; sweep fewer turns"
    )


def _modes(
    drawn: Passage, jobs: int | None
) -> tuple[Table, list[str], int, dict[str, Shown]]:  # fmt: skip
    """The motion of every assembly, the sketch's first; warnings, the number of assemblies, and some to draw."""
    study, poses = drawn.question.study, drawn.question.poses
    found = assemblies(study.mechanism, poses.groups[0].names)
    passages: dict[str, Passage] = {}
    warnings = []
    pictured: dict[str, Shown] = {}
    for assembly in sorted(found, key=lambda assembly: not assembly.drawn):
        passage = drawn
        if not assembly.drawn:
            other = motion_question(dataclasses.replace(study, mechanism=assembly.mechanism))
            passage = pass_over(other, _marks, NULL, jobs)
        if passage.shown.configuration.valid.any() and len(pictured) < MAX_DRAWN_MODES:
            pictured[f"{assembly.label} (as drawn)" if assembly.drawn else assembly.label] = passage.shown
        passages[assembly.label] = passage
        bad = int(np.count_nonzero(passage.reason))
        if bad:
            warnings.append(
                f"mode {assembly.label}: no pose is valid in this assembly"
                if bad == poses.count
                else f"mode {assembly.label}: {bad} of {poses.count} poses are not valid in this assembly"
            )
    parts = [_mode(label, passage.motion) for label, passage in passages.items()]
    columns = [
        dataclasses.replace(same[0], values=np.concatenate([column.values for column in same]))
        for same in zip(*(part.columns for part in parts), strict=True)
    ]
    table = dataclasses.replace(parts[0], columns=tuple(columns))
    if drawn.long:
        each = [partial(passage.blocks, partial(_mode, label), jobs) for label, passage in passages.items()]
        table = LongTable(table, len(each) * poses.count, lambda: chain.from_iterable(blocks() for blocks in each))
    return table, warnings, len(parts), pictured


def _mode(label: str, motion: Motion) -> Table:
    """The motion of one assembly."""
    labels = np.full(len(motion.reason), label)
    column = Column("mode", labels, "", "assembly: the joints that choose it and their sides")
    return Table("modes", (column, *motion.columns()), "the motion of every assembly mode")


def motion_table(motion: Motion) -> Table:
    """Every pose with all outputs."""
    return Table("motion", tuple(motion.columns()), "positions, velocities and accelerations per pose")


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


# Tables with a row a pose.
A_ROW_A_POSE = {"motion": motion_table, "jacobian": jacobian_table, "instant_centres": centres_table}


def _without_centre(question: MotionQuestion, marks: Mapping[str, Mark]) -> list[str]:
    """What is to be known of poses in which two links have no instant centre within reach."""
    study, poses, warnings = question.study, question.poses, []
    for centre in question.centres:
        for kind, text in _CENTRELESS.items():
            rows, row = marks[f"{centre.name} {kind}"]
            if rows:
                where = f"in {rows} of {poses.count} poses"
                first = pose_in_words(study, poses, row)
                warnings.append(f"{centre.one} and {centre.other}: {where} {text}; the first: {first}")
    return warnings


def _untargeted(question: MotionQuestion, marks: Mapping[str, Mark]) -> list[str]:
    """A warning where a valid pose has no target."""
    study, poses, warnings = question.study, question.poses, []
    for mark, (count, row) in marks.items():
        output = mark.removesuffix(_WITHOUT_TARGET)
        if output != mark and count:
            name = f"{output}_error"
            warnings.append(
                f"{count} of {poses.count} poses lie where the target of {output} has no value: their "
                f"{name} is nan; the first: {pose_in_words(study, poses, row)}"
            )
    return warnings


def _marks(motion: Motion) -> dict[str, Flags]:
    """Poses that warnings are about."""
    question, valid, arrays = motion.question, motion.valid, motion.arrays
    steady = arrays["conditioning"] >= STALLED
    stalled = valid & ~motion.smooth & ~steady
    found = {_STALLED: stalled}
    if question.of_given:
        found[_LOST] = valid & ~stalled & np.isnan(arrays[f"{question.study.mechanism.drives[0]}_velocity"])
    if "inverse_condition" in arrays:
        found[_REGULAR] = valid & steady
        found[_NEAR] = valid & steady & _near(motion)
    for output, where in targets.untargeted(question.study, motion.errors, valid).items():
        found[f"{output}{_WITHOUT_TARGET}"] = where
    for centre in question.centres:
        for kind in _CENTRELESS:
            found[f"{centre.name} {kind}"] = valid & (arrays[f"{centre.name}.motion"].round() == kind)
    return found


def _per(study: Study, output: Coordinate, drive: Coordinate) -> str:
    """Unit of a derivative; angles in radians whatever the study's unit."""
    above, below = (
        {"length": study.units.label("length"), "angle": "rad"}.get(c.quantity, "") for c in (output, drive)
    )  # fmt: skip
    if above == below:
        return ""
    return f"{above or '1'}/{below}" if below else above


def _near(motion: Motion) -> Flags:
    """Poses at or near a singularity of the Jacobian."""
    question, arrays = motion.question, motion.arrays
    if len(question.drives) > 1:
        return ~(arrays["inverse_condition"] >= SINGULAR)
    # A Jacobian of one entry has no condition: it is compared with a whole size of the mechanism a radian.
    (output,), (drive,) = question.listed, question.drives
    size = {"length": question.study.mechanism.size}
    still = np.abs(arrays["det_J"]) * size.get(drive.quantity, 1.0) / size.get(output.quantity, 1.0)
    return np.asarray(still < SINGULAR)


def _conditioning(question: MotionQuestion, marks: Mapping[str, Mark]) -> list[str]:
    if _REGULAR not in marks:
        return []
    if marks[_REGULAR].number and question.mixed:
        return ["J mixes lengths and angles: inverse_condition is nan; give kinematics.characteristic_length"]
    count = marks[_NEAR].number
    poses = "1 pose is" if count == 1 else f"{count} poses are"
    if len(question.drives) == 1:
        (output,) = question.listed
        return [f"{poses} at a dead centre: {output.name} stands still there, and det_J is 0"] if count else []
    return [f"{poses} at or near a singularity (inverse condition below {SINGULAR:g})"] if count else []


def _astray(question: MotionQuestion) -> list[str]:
    """A warning where rates that are the same for all poses lead away from the motion that the poses are."""
    study, section, poses = question.study, question.section, question.poses
    if not poses.motion or section.speed is not None or not set(section.rates) & set(poses.names):
        return []
    sizes = {"length": study.mechanism.size, "angle": 1 / study.units.angle_factor}
    unit = [1 / sizes.get(study.mechanism.quantity(name), 1.0) for name in poses.names]
    rates = np.array([section.rates.get(name, 0.0) * u for name, u in zip(poses.names, unit, strict=True)])
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
    return [
        f"{off} of {poses.count - 1} steps of the motion do not go where the rates of "
        f"{', '.join(poses.names)} lead: velocities and accelerations there are those of the rates, not of the motion "
        "drawn; 'speed' gives those of a point along its path"
    ]


def _corners(question: MotionQuestion) -> list[str]:
    """A warning where a path that is passed with a speed has corners: its rates there are those behind them."""
    poses = question.poses
    if question.section.speed is None or not poses.motion:
        return []
    rows = poses.corners[(poses.corners > 0) & (poses.corners < poses.end) & (poses.corners % 1 == 0)]
    turned = np.zeros(len(rows), dtype=bool)
    for path in poses.paths.values():
        behind, before = (path.course(at)[0] for at in (rows, rows - BEFORE_CORNER))
        turned |= np.abs(behind - before) > TURNED
    rows = rows[turned]
    if not len(rows):
        return []
    return [
        f"the path has corners at {counted(len(rows), 'pose')}, the first: "
        f"{pose_in_words(question.study, poses, int(rows[0]))}; velocities there are those of the segment that begins, "
        "and the acceleration that a corner takes is in no row; a spline has no corners"
    ]


def _stalled(question: MotionQuestion, marks: Mapping[str, Mark]) -> list[str]:
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
            warnings.append(f"{lie} {text}; the first: {pose_in_words(question.study, question.poses, row)}")
    return warnings
