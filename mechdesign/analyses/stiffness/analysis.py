"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import (
    Keeper,
    Shown,
    SolvedPoses,
    judge_failures,
    of_poses,
    pose_in_words,
    solve_poses,
    study_poses,
)
from mechdesign.analyses.stiffness.compliance import Held, put
from mechdesign.analyses.stiffness.elements import Guide, Hinge, corners_of
from mechdesign.analyses.stiffness.force_method import Effects, Loaded, effects_of, load, twists_of
from mechdesign.analyses.stiffness.legs import Leg, find_legs, hold_by_legs
from mechdesign.analyses.stiffness.network import Network, build_bodies, build_network
from mechdesign.analyses.stiffness.tables import (
    Springs,
    compliance_table,
    deflections_table,
    displacements_table,
    eigen_table,
    forces_table,
    springs_table,
    stiffness_table,
)
from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.parallel import map_chunks, one_thread
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.stiffness import StiffnessSection

# Poses solved together.
CHUNK = 8192
# Wrenches (of unit size) nearer to dependence than this get a warning: rounding and tolerances decide the answer.
NEAR_SINGULAR = 1e-4
Pose = tuple[int, Configuration]


@dataclass(frozen=True)
class Body:
    """The body, or the pin, whose stiffness is asked, and what carries it; ready for any number of poses.

    Parameters
    ----------
    legs : tuple of Leg or None
        Where the body stands on serial chains, those; None where it does not.
    network : Network
        All that carries, whatever it is.
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        The pin is a point of one link only, or its end on one: the link turns freely under forces at it.
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
    """Stiffness of a body or a pin at every pose of the study [S4]; see `mechdesign.stiffness`."""
    body = ask(study)
    poses = study_poses(study, "stiffness")
    progress.start(poses.count, "poses")
    solved = solve(study, body, poses, jobs, progress)
    warnings, failed = judge_failures(study, poses, solved.reason)
    warnings += _cautions(study, poses, body, solved.held)
    counts = {"poses": poses.count, "invalid": int(np.count_nonzero(solved.reason))}
    drawn = _drawn(body, poses, solved)
    return Result("stiffness", tables(study, body, poses, solved), warnings, counts, failed, drawn=drawn)


@dataclass(frozen=True, eq=False)
class Solved:
    """How the body is held in every pose, why poses fail (`Reason`, shape (poses,)), and the effects of any loads.

    `first` and `loose` are the first valid pose and the first that has a free twist, with their rows; `shown` are the
    poses that pictures can show.
    """

    held: Held
    reason: NDArray[np.int8]
    springs: Springs
    effects: Effects | None
    first: Pose | None
    loose: Pose | None
    shown: Shown


@dataclass(frozen=True, eq=False)
class Drawn:
    """One pose as pictures show it, and the row of it; `twists` by vertex, shape (3, loads), about the asked point."""

    body: Body
    row: int
    configuration: Configuration
    springs: Springs
    twists: dict[str, Floats]


def _drawn(body: Body, poses: Poses, solved: Solved) -> dict[str, Any]:
    """All poses, those that pictures can show; the first valid one, and the first that has a free twist."""
    drawn: dict[str, Any] = {"poses": poses, "shown": solved.shown}
    for name, pose in (("first", solved.first), ("loose", solved.loose)):
        if pose is not None:
            row, configuration = pose
            moved = _loaded(body, configuration).displacements if body.section.loads else {}
            twists = {
                vertex: (each @ np.array(body.section.loads)[:, : body.size].T)[0] for vertex, each in moved.items()
            }
            drawn[name] = Drawn(body, row, configuration, solved.springs.take(solved.springs.row == row), twists)
    return drawn


def solve(study: Study, body: Body, poses: Poses, jobs: int | None = 1, progress: Progress = NULL) -> Solved:
    """Solve all poses; one that cannot be assembled is nan."""
    held = Held.unknown(poses.count, body.size)
    reason = np.zeros(poses.count, dtype=np.int8)
    springs: list[Springs] = []
    loads = body.section.loads
    effects = Effects.unknown(body.network, poses.count, len(loads)) if loads else None
    first: Pose | None = None
    loose: Pose | None = None
    keeper = Keeper(study, poses)
    for solved in solve_poses(study, poses):
        configuration = solved.configuration
        keeper.keep(solved)
        reason[solved.rows] = configuration.reason
        first = first or _pose(solved, configuration.valid)
        assembled = np.flatnonzero(np.isin(configuration.reason, (Reason.OK, Reason.LIMIT)))
        chunks = [assembled[k : k + CHUNK] for k in range(0, len(assembled), CHUNK)]
        answers = map_chunks(partial(evaluate, body), (configuration.take(index) for index in chunks), jobs)
        for index, (part, found, moved) in zip(chunks, answers, strict=True):
            rows = solved.rows[index]
            put(held, rows, part)
            springs += [replace(s, row=rows[s.row]) for s in found]
            if effects is not None and moved is not None:
                put(effects, rows, moved)
            progress.update(len(index))
        loose = loose or _pose(solved, np.isfinite(held.free[solved.rows, 0]))
    return Solved(held, reason, Springs.sorted(springs), effects, first, loose, keeper.shown)


def _pose(solved: SolvedPoses, wanted: Flags) -> Pose | None:
    """The first of some solved poses that is wanted, and its row."""
    index = np.flatnonzero(wanted)[:1]
    return (int(solved.rows[index[0]]), solved.configuration.take(index)) if len(index) else None


def tables(study: Study, body: Body, poses: Poses, solved: Solved) -> dict[str, Table]:
    """Tables ``stiffness``, ``compliance``, ``springs`` and, with loads, ``deflections``."""
    soft = solved.held.compliance
    method = "serial legs" if body.legs is not None else "force method"
    made = [
        stiffness_table(study, poses, solved.held, solved.reason == 0, method, body.section.direction),
        compliance_table(study, poses, soft),
    ]
    if body.size == 3 and body.section.characteristic_length is not None:
        made.append(eigen_table(study, poses, soft, body.section.characteristic_length))
    if body.legs is not None:
        made.append(springs_table(study, poses, [leg.name for leg in body.legs], solved.springs))
    if solved.effects is not None:
        made += [
            deflections_table(study, poses, np.array(body.section.loads), soft),
            forces_table(study, poses, body.network, solved.effects),
            displacements_table(study, poses, body.network, solved.effects),
        ]
    return of_poses(made, solved.reason)


def ask(study: Study) -> Body:
    """Find what carries the asked body; a StudyError where the study has no stiffness section."""
    section = study.stiffness
    if section is None:
        message = "is missing: say which point's stiffness is asked, for example {link: platform, at: P}"
        raise StudyError((study.problem(message, "stiffness"),))
    mechanism, point = study.mechanism, section.point
    link, links = section.bearer, mechanism.graph.links_at(point)
    lone = link is None and len(links) == 1
    standing = build_bodies(mechanism, links[0] if lone else link, point, section)
    pinned = build_bodies(mechanism, None, point, section) if lone else standing
    legs = find_legs(standing, list(mechanism.description.links))
    network = build_network(pinned)
    condensed = section.link is None and (lone or link is not None)
    return Body(section, legs, network, 2 if section.link is None else 3, condensed, _spread(mechanism, network))


def _spread(mechanism: Mechanism, network: Network) -> float:
    """How far the joints that carry lie apart in the sketch; whatever else is far away does not count."""
    places = [complex(mechanism.sketch_configuration.point(edge.point)) for edge in network.edges]
    return max((abs(place - places[0]) for place in places), default=0.0) or mechanism.size or 1.0


def hold(body: Body, configuration: Configuration) -> tuple[Held, Iterable[Springs]]:
    """Stiffness and springs in a batch of assembled poses of shape (n,).

    By the reciprocal wrenches of its legs where these hold the body in closed form (six times as fast), else by the
    force method.
    """
    if body.legs is None:
        return _loaded(body, configuration).held, []
    held, springs = hold_by_legs(body.legs, body.section, configuration, body.length, body.size, body.condensed)
    rest = np.flatnonzero(held.rank == 0)
    if len(rest):
        put(held, rest, _loaded(body, configuration.take(rest)).held)
    return held, springs


def evaluate(body: Body, configuration: Configuration) -> tuple[Held, Iterable[Springs], Effects | None]:
    """As `hold`, and what the study's loads do."""
    section = body.section
    if not section.loads:
        return *hold(body, configuration), None
    loaded = _loaded(body, configuration)
    held, springs = (loaded.held, ()) if body.legs is None else hold(body, configuration)
    return held, springs, effects_of(body.network, loaded, section.at, configuration, section.loads)


def _loaded(body: Body, configuration: Configuration) -> Loaded:
    return load(twists_of(body.network, body.section, configuration, body.length), body.size)


def _cautions(study: Study, poses: Poses, body: Body, held: Held) -> list[str]:
    known = (held.rank > 0) | np.isfinite(held.stiffness).all(axis=(1, 2))
    links = study.mechanism.description.links
    cautions = [
        f"link '{name}' has a single point, and so no beam: it is rigid, though 'elastic' names it; give it two ends"
        for name in body.section.elastic
        if len(corners_of(links[name])) < 2
    ]
    loose = np.flatnonzero(known & (held.rank < body.size))
    if len(loose):
        cautions.append(
            f"{len(loose)} of {poses.count} poses are under-constrained: a twist is free (free_x, free_y, free_phi), "
            f"and the compliance is nan; the first: {pose_in_words(study, poses, int(loose[0]))}"
        )
    near = np.flatnonzero(known & (held.rank == body.size) & (held.margin < NEAR_SINGULAR))
    if len(near):
        cautions.append(
            f"{len(near)} of {poses.count} poses are nearly under-constrained (wrenches within "
            f"{held.margin[near].min():.1e} of dependence); the first: {pose_in_words(study, poses, int(near[0]))}"
        )
    for leg in body.legs or ():
        if not any(isinstance(element, Hinge | Guide) and element.drive is None for element in leg.elements):
            cautions.append(
                f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs"
            )
    return cautions
