"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import judge_failures, pose_in_words, solve_poses
from mechdesign.analyses.stiffness.chains import chain_of
from mechdesign.analyses.stiffness.compliance import Held, hold
from mechdesign.analyses.stiffness.legs import Beam, Leg, find_legs
from mechdesign.analyses.stiffness.screws import (
    Array,
    constraint_compliance,
    equivalent_springs,
    joint_rank,
    reciprocal_wrenches,
)
from mechdesign.analyses.stiffness.tables import (
    Springs,
    compliance_table,
    deflections_table,
    springs_table,
    stiffness_table,
)
from mechdesign.errors import Problem, StudyError
from mechdesign.mechanism import Configuration
from mechdesign.parallel import map_chunks
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.stiffness_models import StiffnessSection

CHUNK = 8192
# Wrenches (of unit size) nearer to dependence than this are told: the answer hangs on rounding and on tolerances.
NEAR_SINGULAR = 1e-4


@dataclass(frozen=True)
class Asked:
    """What is asked of which mechanism, ready for any number of poses.

    Parameters
    ----------
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        The pin is a point of one link only: the link turns freely under forces at it.
    length : float
        What turns rotations into lengths where sizes are compared; no result depends on it.
    """

    section: StiffnessSection
    legs: tuple[Leg, ...]
    size: int
    condensed: bool
    length: float


def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Stiffness of a body on serial-chain legs at every pose of the study.

    Parameters
    ----------
    study : Study
    seed : ignored
        Nothing is random.
    jobs : int or None
        Threads.

    Returns
    -------
    Result
        Tables ``stiffness``, ``compliance``, ``springs`` and, with loads, ``deflections``  [S4].

    Raises
    ------
    StudyError
        If the study has no stiffness section, or the legs are not serial chains.
    AssemblyError
        If no pose at all can be assembled.
    """
    asked = ask(study)
    poses = study.poses("stiffness")
    progress.start(poses.count, "poses")
    found = solve(study, asked, poses, jobs, progress)
    warnings, failed = judge_failures(study, poses, found.reason)
    known = np.isfinite(found.matrices["K"]).all(axis=(1, 2)) | np.isfinite(found.matrices["C"]).all(axis=(1, 2))
    warnings += _cautions(study, poses, asked, known | (found.rank > 0), found.rank, found.margin)
    counts = {"poses": poses.count, "invalid": int(np.count_nonzero(found.reason))}
    return Result("stiffness", tables(study, asked, poses, found), warnings, counts, failed)


@dataclass(frozen=True, eq=False)
class Found:
    """How the body is held in every pose; see `mechdesign.analyses.stiffness.compliance.Held`.

    Parameters
    ----------
    matrices : dict of str to ndarray, shape (poses, size, size)
        K and C.
    reason : int8 array, shape (poses,)
        See `mechdesign.mechanism.Reason`.
    """

    matrices: dict[str, Array]
    rank: NDArray[np.intp]
    free: Array
    margin: Array
    reason: NDArray[np.int8]
    springs: list[Springs]


def solve(study: Study, asked: Asked, poses: Poses, jobs: int | None = 1, progress: Progress = NULL) -> Found:
    """Solve all poses; one that cannot be assembled is nan."""
    shape = (poses.count, asked.size, asked.size)
    matrices = {name: np.full(shape, np.nan) for name in ("K", "C")}
    rank = np.zeros(poses.count, dtype=np.intp)
    free = np.full(shape[:2], np.nan)
    margin = np.full(poses.count, np.inf)
    reason = np.zeros(poses.count, dtype=np.int8)
    springs: list[Springs] = []
    for solved in solve_poses(study, poses):
        configuration = solved.configuration
        reason[solved.rows] = configuration.reason
        places = [configuration.point(leg.tip) for leg in asked.legs] + [configuration.point(asked.section.at)]
        assembled = np.flatnonzero(np.isfinite(np.sum(places, axis=0)))
        chunks = [assembled[k : k + CHUNK] for k in range(0, len(assembled), CHUNK)]
        batches = (configuration.take(index) for index in chunks)
        answers = map_chunks(partial(evaluate, asked), batches, jobs)
        for index, (held, found) in zip(chunks, answers, strict=True):
            rows = solved.rows[index]
            matrices["K"][rows], matrices["C"][rows] = held.stiffness, held.compliance
            rank[rows], free[rows], margin[rows] = held.rank, held.free, held.margin
            springs += [Springs(rows[s.row], s.leg, s.stiffness, s.place, s.angle) for s in found]
            progress.update(len(index))
    return Found(matrices, rank, free, margin, reason, springs)


def tables(study: Study, asked: Asked, poses: Poses, found: Found) -> dict[str, Table]:
    """Tables ``stiffness``, ``compliance``, ``springs`` and, with loads, ``deflections``."""
    stiff, soft = found.matrices["K"], found.matrices["C"]
    made = [
        stiffness_table(study, poses, stiff, soft, found.rank, found.free, found.reason == 0),
        compliance_table(study, poses, soft),
        springs_table(study, poses, asked.legs, found.springs),
    ]
    if asked.section.loads:
        made.append(deflections_table(study, poses, np.array(asked.section.loads), soft))
    return {table.name: table for table in made}


def ask(study: Study) -> Asked:
    """Find the legs that hold what the study asks.

    Raises
    ------
    StudyError
        If the study has no stiffness section, or the legs are not serial chains.
    """
    section = study.stiffness
    if section is None:
        raise StudyError(
            [
                Problem(
                    "is missing: say which point's stiffness is asked, for example {link: platform, at: P}", "stiffness"
                )
            ]
        )
    mechanism = study.mechanism
    link = section.link
    bearers = [name for name, other in mechanism.description.links.items()
               if section.at in other.points or section.at in (other.ends or ())]  # fmt: skip
    condensed = link is None and len(bearers) == 1
    if condensed:
        link = bearers[0]
    legs = find_legs(mechanism, link, section.at, section.elastic, section.actuators)
    length = section.characteristic_length or mechanism.size or 1.0
    return Asked(section, legs, 2 if section.link is None else 3, condensed, length)


def evaluate(asked: Asked, configuration: Configuration) -> tuple[Held, list[Springs]]:
    """Stiffness and springs in a batch of assembled poses of shape (n,)."""
    n = configuration.shape[0]
    chains = [chain_of(leg, asked.section, configuration) for leg in asked.legs]
    ranks = [np.broadcast_to(joint_rank(chain.passive, asked.length), (n,)) for chain in chains]
    body = 3 if asked.condensed else asked.size
    if not chains:
        return _restrict(hold([np.zeros((3, 0, n))], [np.zeros((0, 0, n))], asked.length, body), asked), []
    springs: list[Springs] = []
    parts: list[tuple[NDArray[np.intp], Held]] = []
    every = np.stack(ranks, axis=1)
    for signature, rows in _signatures(every):
        here = chains if len(rows) == n else [chain.take(rows) for chain in chains]
        wrenches = [
            reciprocal_wrenches(chain.passive, rank, asked.length, len(rows))
            for chain, rank in zip(here, signature, strict=True)
        ]
        blocks = [constraint_compliance(w, chain) for w, chain in zip(wrenches, here, strict=True)]
        parts.append((rows, hold(wrenches, blocks, asked.length, body)))
        at = configuration.point(asked.section.at)[rows]
        for k, (w, chain) in enumerate(zip(wrenches, here, strict=True)):
            for spring in equivalent_springs(w, chain, asked.length):
                springs.append(Springs(rows, np.full(len(rows), k), spring.stiffness, spring.place + at, spring.angle))
    return _restrict(_join(parts, n), asked), springs


def _signatures(ranks: NDArray[np.intp]) -> list[tuple[list[int], NDArray[np.intp]]]:
    """Poses in which all legs have the same ranks together."""
    if (ranks == ranks[:1]).all():
        return [(ranks[0].tolist(), np.arange(len(ranks)))]
    kinds, which = np.unique(ranks, axis=0, return_inverse=True)
    return [(kind.tolist(), np.flatnonzero(which.reshape(-1) == k)) for k, kind in enumerate(kinds)]


def _join(parts: Sequence[tuple[NDArray[np.intp], Held]], n: int) -> Held:
    if len(parts) == 1:
        return parts[0][1]
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    names = ("stiffness", "compliance", "rank", "free", "margin")
    return Held(*(np.concatenate([getattr(held, name) for _, held in parts])[order] for name in names))


def _restrict(held: Held, asked: Asked) -> Held:
    """Only displacements of the point, the link free to turn: the compliance is a part, its inverse the stiffness."""
    if not asked.condensed:
        return held
    compliance = held.compliance[:, :2, :2]
    stiffness = np.full(compliance.shape, np.nan)
    determinant = np.linalg.det(compliance)
    with np.errstate(invalid="ignore"):
        good = determinant > 1e-12 * compliance[:, 0, 0] * compliance[:, 1, 1]
    stiffness[good] = np.linalg.inv(compliance[good])
    rank = np.where(np.isfinite(determinant), 2, np.minimum(held.rank, 1))
    return Held(stiffness, compliance, rank, held.free[:, :2], held.margin)


def _cautions(
    study: Study, poses: Poses, asked: Asked, known: NDArray[np.bool_], rank: NDArray[np.intp], margin: Array
) -> list[str]:
    told = []
    loose = np.flatnonzero(known & (rank < asked.size))
    if len(loose):
        told.append(
            f"{len(loose)} of {poses.count} poses are under-constrained: a twist is free (free_x, free_y, free_phi), "
            f"and the compliance is nan; the first: {pose_in_words(study, poses, int(loose[0]))}"
        )
    near = np.flatnonzero(known & (rank == asked.size) & (margin < NEAR_SINGULAR))
    if len(near):
        told.append(
            f"{len(near)} of {poses.count} poses are nearly under-constrained (wrenches within "
            f"{margin[near].min():.1e} of dependence); the first: {pose_in_words(study, poses, int(near[0]))}"
        )
    for leg in asked.legs:
        if not any(not isinstance(element, Beam) and element.drive is None for element in leg.elements):
            told.append(
                f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs"
            )
    return told
