"""How does it move? Positions, velocities, accelerations, Jacobians, drive efforts, extremes and limits of motion."""

from __future__ import annotations

import dataclasses
from functools import partial
from itertools import chain

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import Problem, StudyError
from mechdesign.ground.long_tables import LongTable
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result, Table
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.motion.answer import alone, answer_of
from mechdesign.motion.passage import pass_over
from mechdesign.motion.question import Passage, PoseValues
from mechdesign.questions.kinematics.answers import Kinematics
from mechdesign.questions.kinematics.columns import MODES
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.tables import motion_columns
from mechdesign.questions.poses import Shown, shown_of, study_poses
from mechdesign.study import Study

# Assembly modes that a picture shows at most.
MAX_DRAWN_MODES = 12


@one_thread()
def kinematics(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL, all_modes: bool = False
) -> Result:
    """Solve every pose of the study's kinematics; see `mechdesign.kinematics`."""
    poses = study_poses(study, "kinematics")
    if all_modes and len(poses.groups) > 1:
        message = "the poses give different coordinates, and each set has modes of its own; list one set for all modes"
        raise StudyError((Problem(message, "kinematics.poses", str(study.path or "")),))
    question = Kinematics.of(study, poses)
    if not all_modes:
        return alone(question, progress, jobs)
    passage = pass_over(question, progress, jobs)
    result = answer_of(passage, jobs)[0].of(0)
    if isinstance(result, Exception):
        raise result
    table, warnings, number, shown = _modes(passage, jobs)
    return dataclasses.replace(
        result, tables={**result.tables, "modes": table}, warnings=[*result.warnings, *warnings],
        counts={**result.counts, "modes": number}, drawn=dataclasses.replace(DrawnMotion.of(result), modes=shown),
    )  # fmt: skip


def _modes(
    drawn: Passage, jobs: int | None
) -> tuple[Table, list[Caution], int, dict[str, Shown]]:  # fmt: skip
    """The motion of every assembly, the sketch's first; warnings, the number of assemblies, and some to draw."""
    study, poses = drawn.question.study, drawn.question.poses
    every = assemblies(study.mechanism, poses.groups[0].names)
    passages: dict[str, Passage] = {}
    warnings = []
    pictured: dict[str, Shown] = {}
    for assembly in sorted(every, key=lambda assembly: not assembly.drawn):
        passage = drawn
        if not assembly.drawn:
            other = Kinematics.of(dataclasses.replace(study, mechanism=assembly.mechanism), poses)
            passage = pass_over(other, NULL, jobs)
        if passage.shown.configuration.valid.any() and len(pictured) < MAX_DRAWN_MODES:
            label = f"{assembly.label} (as drawn)" if assembly.drawn else assembly.label
            pictured[label] = shown_of(passage.question.study, passage)
        passages[assembly.label] = passage
        bad = int(np.count_nonzero(passage.reason))
        if bad:
            none = f"mode {assembly.label}: no pose is valid in this assembly"
            some = f"mode {assembly.label}: {bad} of {poses.count} poses are not valid in this assembly"
            warnings.append(Caution("unassembled", none if bad == poses.count else some, "modes"))
    parts = [_mode(label, passage.values) for label, passage in passages.items()]
    columns = [
        dataclasses.replace(same[0], values=np.concatenate([column.values for column in same]))
        for same in zip(*(part.columns for part in parts), strict=True)
    ]
    table = dataclasses.replace(parts[0], columns=tuple(columns))
    if drawn.long:
        pieces = [partial(passage.blocks, partial(_mode, label), jobs) for label, passage in passages.items()]
        table = LongTable(table, len(pieces) * poses.count, lambda: chain.from_iterable(blocks() for blocks in pieces))
    return table, warnings, len(parts), pictured


def _mode(label: str, motion: PoseValues) -> Table:
    """The motion of one assembly."""
    labels = np.full(len(motion.reason), label)
    return MODES.table([*MODES.columns({}, mode=labels), *motion_columns(motion)])
