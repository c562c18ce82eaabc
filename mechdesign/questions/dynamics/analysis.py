"""What drives it, what does it bear? Efforts, joint forces, shaking forces and energies of a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.curve.functions import Functions
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.questions.dynamics.question import Borne, ForceQuestion, bear, force_question
from mechdesign.questions.dynamics.tables import dynamics_table, extremes_table, joint_table
from mechdesign.questions.poses import Keeper, Shown, SolvedPoses, judge_failures, solve_poses, study_poses
from mechdesign.results import Drawn, Result
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.work.threads import one_thread


@one_thread()
def dynamics(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Efforts and forces at every pose of the study's dynamics; see `mechdesign.dynamics`."""
    poses = study_poses(study, "dynamics")
    progress.start(poses.count, "poses")
    question = force_question(study, poses)
    answer = _answered(question, progress, jobs)
    warnings, failed = judge_failures(study, poses, answer.reason, table="dynamics")
    ...
