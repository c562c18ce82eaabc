"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import judge_failures, pose_in_words, solve_poses, study_poses
from mechdesign.analyses.stiffness.beams import beams_of
from mechdesign.analyses.stiffness.compliance import Held
from mechdesign.analyses.stiffness.force_method import Loaded, load, twists_of
from mechdesign.analyses.stiffness.legs import Guide, Hinge, Leg, NotSerialError, find_legs
from mechdesign.analyses.stiffness.loads import Effects, displacements_table, effects_of, forces_table
from mechdesign.analyses.stiffness.network import Network, build_network
from mechdesign.analyses.stiffness.serial import hold_by_legs
from mechdesign.analyses.stiffness.tables import (
    Springs,
    compliance_table,
    deflections_table,
    eigen_table,
    springs_table,
    stiffness_table,
)
from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.parallel import map_chunks
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.stiffness_models import StiffnessSection
from mechdesign.threads import one_thread

CHUNK = 8192
# Wrenches (of unit size) nearer to dependence than this are told: the answer hangs on rounding and on tolerances.
NEAR_SINGULAR = 1e-4


@dataclass(frozen=True)
class Asked:
    """What is asked of which mechanism, ready for any number of poses.

    Parameters
    ----------
    legs : tuple of Leg or None
        Where the body stands on serial chains, those; None where it does not.
    network : Network
        All that carries, whatever it is.
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        The pin is a point of one link only: the link turns freely under forces at it.
    length : float
        What turns rotations into lengths where sizes are compared; no result depends on it.
    """

    section: StiffnessSection
    legs: tuple[Leg, ...] | None
    network: Network
    size: int
    condensed: bool
    length: float


@one_thread()
def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Stiffness of a body or a pin at every pose of the study.

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
        If the study has no stiffness section.
    AssemblyError
        If no pose at all can be assembled.
    """
    asked = ask(study)
    poses = study_poses(study, "stiffness")
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
    effects : Effects or None
        What the study's loads do, where it has any.
    """

    matrices: dict[str, Floats]
    rank: Ints
    free: Floats
    margin: Floats
    reason: NDArray[np.int8]
    springs: list[Springs]
    effects: Effects | None


def solve(study: Study, asked: Asked, poses: Poses, jobs: int | None = 1, progress: Progress = NULL) -> Found:
    """Solve all poses; one that cannot be assembled is nan."""
    shape = (poses.count, asked.size, asked.size)
    matrices = {name: np.full(shape, np.nan) for name in ("K", "C")}
    rank = np.zeros(poses.count, dtype=np.intp)
    free = np.full(shape[:2], np.nan)
    margin = np.full(poses.count, np.inf)
    reason = np.zeros(poses.count, dtype=np.int8)
    springs: list[Springs] = []
    loads = asked.section.loads
    effects = Effects.unknown(asked.network, poses.count, len(loads)) if loads else None
    for solved in solve_poses(study, poses):
        configuration = solved.configuration
        reason[solved.rows] = configuration.reason
        assembled = np.flatnonzero(np.isin(configuration.reason, (Reason.OK, Reason.LIMIT)))
        chunks = [assembled[k : k + CHUNK] for k in range(0, len(assembled), CHUNK)]
        batches = (configuration.take(index) for index in chunks)
        answers = map_chunks(partial(evaluate, asked), batches, jobs)
        for index, (held, found, part) in zip(chunks, answers, strict=True):
            rows = solved.rows[index]
            matrices["K"][rows], matrices["C"][rows] = held.stiffness, held.compliance
            rank[rows], free[rows], margin[rows] = held.rank, held.free, held.margin
            springs += [Springs(rows[s.row], s.leg, s.stiffness, s.place, s.angle) for s in found]
            if effects is not None and part is not None:
                effects.put(rows, part)
            progress.update(len(index))
    return Found(matrices, rank, free, margin, reason, springs, effects)


def tables(study: Study, asked: Asked, poses: Poses, found: Found) -> dict[str, Table]:
    """Tables ``stiffness``, ``compliance``, ``springs`` and, with loads, ``deflections``."""
    stiff, soft = found.matrices["K"], found.matrices["C"]
    made = [
        stiffness_table(
            study,
            poses,
            stiff,
            soft,
            found.rank,
            found.free,
            found.reason == 0,
            "serial legs" if asked.legs is not None else "force method",
            None if asked.section.direction is None else asked.section.direction * study.units.angle_factor,
        ),
        compliance_table(study, poses, soft),
    ]
    if asked.size == 3 and asked.section.characteristic_length is not None:
        made.append(eigen_table(study, poses, soft, asked.section.characteristic_length))
    if asked.legs is not None:
        made.append(springs_table(study, poses, asked.legs, found.springs))
    if found.effects is not None:
        made += [
            deflections_table(study, poses, np.array(asked.section.loads), soft),
            forces_table(study, poses, asked.network, found.effects),
            displacements_table(study, poses, asked.network, found.effects),
        ]
    return {table.name: table for table in made}


def ask(study: Study) -> Asked:
    """Find the legs that hold what the study asks.

    Raises
    ------
    StudyError
        If the study has no stiffness section.
    """
    section = study.stiffness
    if section is None:
        message = "is missing: say which point's stiffness is asked, for example {link: platform, at: P}"
        raise StudyError((study.problem(message, "stiffness"),))
    mechanism = study.mechanism
    link = section.link
    bearers = [name for name, other in mechanism.description.links.items()
               if section.at in other.points or section.at in (other.ends or ())]  # fmt: skip
    condensed = link is None and len(bearers) == 1
    if condensed:
        link = bearers[0]
    legs: tuple[Leg, ...] | None = None
    with suppress(NotSerialError):
        legs = find_legs(mechanism, link, section.at, section)
    network = build_network(mechanism, section.link, section.at, section)
    return Asked(section, legs, network, 2 if section.link is None else 3, condensed, _spread(mechanism, network))


def _spread(mechanism: Mechanism, network: Network) -> float:
    """How far the joints that carry lie apart in the sketch; whatever else is far away does not count."""
    places = [complex(mechanism.sketch_configuration.point(edge.point)) for edge in network.edges]
    return max((abs(place - places[0]) for place in places), default=0.0) or mechanism.size or 1.0


def hold(asked: Asked, configuration: Configuration) -> tuple[Held, list[Springs]]:
    """Stiffness and springs in a batch of assembled poses of shape (n,)."""
    section = asked.section
    if asked.legs is not None:
        return hold_by_legs(asked.legs, section, configuration, asked.length, asked.size, asked.condensed)
    return _loaded(asked, configuration).held, []


def evaluate(asked: Asked, configuration: Configuration) -> tuple[Held, list[Springs], Effects | None]:
    """As `hold`, and what the study's loads do."""
    section = asked.section
    if not section.loads:
        return *hold(asked, configuration), None
    loaded = _loaded(asked, configuration)
    held, springs = hold(asked, configuration) if asked.legs is not None else (loaded.held, [])
    return held, springs, effects_of(asked.network, loaded, section.at, configuration, section.loads)


def _loaded(asked: Asked, configuration: Configuration) -> Loaded:
    twists = twists_of(asked.network, asked.section, configuration, asked.length)
    return load(twists, asked.size)


def _cautions(study: Study, poses: Poses, asked: Asked, known: Flags, rank: Ints, margin: Floats) -> list[str]:
    links = study.mechanism.description.links
    told = [
        f"link '{name}' has a single point, and so no beam: it is rigid, though 'elastic' names it; give it two ends"
        for name in asked.section.elastic
        if len(beams_of(links[name]).corners) < 2
    ]
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
    for leg in asked.legs or ():
        if not any(isinstance(element, Hinge | Guide) and element.drive is None for element in leg.elements):
            told.append(
                f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs"
            )
    return told
