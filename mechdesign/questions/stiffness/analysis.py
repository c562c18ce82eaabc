"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads.

The poses of several designs are one batch, and so are the numbers of the section in which the designs differ.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechdesign.cautions import Caution
from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration, Reason
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.progress import NULL, Progress
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.poses import (
    Keeper,
    Shown,
    SolvedPoses,
    invalid_in_words,
    judge_failures,
    of_poses,
    pose_in_words,
    solve_poses,
    study_poses,
)
from mechdesign.questions.stiffness.body import Body, ask, hold, pushes, under_loads
from mechdesign.questions.stiffness.compliance import Held, put
from mechdesign.questions.stiffness.effects import Effects, effects_of
from mechdesign.questions.stiffness.elements import Hinge, SlideElement
from mechdesign.questions.stiffness.tables import (
    Springs,
    compliance_table,
    deflections_table,
    displacements_table,
    eigen_table,
    forces_table,
    springs_table,
    stiffness_table,
)
from mechdesign.questions.together import Answers, End, Group
from mechdesign.results import Drawn, Result, Scope, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.work.chunks import map_chunks
from mechdesign.work.threads import one_thread

# Number of poses solved together.
CHUNK = 8192
# Tables in the order in which they are shown.
ORDER = ("stiffness", "compliance", "eigen", "springs", "deflections", "forces", "displacements")
# Smallest singular value of the unit wrenches below which a pose gets a warning: its stiffness depends on rounding and
# tolerances.
NEAR_SINGULAR = 1e-4
# A pose: its row, and the mechanism in it.
Pose = tuple[int, Configuration]


@one_thread()
def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Stiffness of a body or a pin at every pose of the study [S4]; see `mechdesign.stiffness`."""
    body = ask(study)
    poses = study_poses(study, "stiffness")
    progress.start(poses.count, "poses")
    result = _group(study, body, poses, jobs, progress).of(0)
    if isinstance(result, Exception):
        raise result
    return result


@one_thread()
def answers(study: Study, poses: Poses) -> Answers:
    """Stiffness at the poses of several designs, without pictures; each design has the answer that it has alone.

    A design without a valid pose has an error.
    """
    return Answers([_group(study, ask(study), poses, 1, NULL)])


def _group(study: Study, body: Body, poses: Poses, jobs: int | None, progress: Progress) -> Group:
    """The result of all designs, each with its warnings, counts and errors."""
    solved = solve(study, body, poses, solve_poses(study, poses), jobs, progress)
    count, designs = poses.count // poses.designs, poses.designs
    cautions, ends = _Cautions(study, poses, body, solved.held), []
    for k, reason in enumerate(solved.reason.reshape(designs, count)):
        counts = {"poses": count, "invalid": int(np.count_nonzero(reason))}
        try:
            warnings, failed = judge_failures(study, poses, reason, k * count, "stiffness")
        except AssemblyError as error:
            ends.append(End(counts=counts, error=error))
            continue
        warnings += cautions.of(slice(k * count, (k + 1) * count))
        if body.given.dynamics:
            warnings += assumed(study)
        ends.append(End(warnings, failed, invalid_in_words(study, reason), counts))
    all_tables = tables(study, body, poses, solved).values()
    if designs > 1:
        scoped = {table.name: replace(table, scope=Scope(poses_only=True)) for table in all_tables}
        uneven = {"springs": solved.springs.counts(designs, count)}
        return Group(np.arange(designs), Result("stiffness", scoped), ends, uneven)
    (end,) = ends
    first, loose = (_drawn_pose(body, poses, solved, pose) for pose in (solved.first, solved.loose))
    result = Result(
        "stiffness", of_poses(study, all_tables, solved.reason), end.warnings, end.counts, end.failed,
        drawn=DrawnStiffness(solved.shown, first, loose),
    )  # fmt: skip
    return Group(np.arange(1), result, ends)


@dataclass(frozen=True, eq=False)
class Solved:
    """All poses solved.

    Parameters
    ----------
    held : Held
        How the body is held in each pose.
    reason : ndarray of int8, shape (poses,)
        Why a pose fails (`Reason`); 0 where it is valid.
    springs : Springs
        Equivalent springs of the legs.
    effects : Effects or None
        Effects of the study's loads.
    first, loose : Pose or None
        The first valid pose, and the first with a free twist.
    shown : Shown
        The poses that pictures can show.
    """

    held: Held
    reason: NDArray[np.int8]
    springs: Springs
    effects: Effects | None
    first: Pose | None
    loose: Pose | None
    shown: Shown


@dataclass(frozen=True, eq=False)
class DrawnPose:
    """One solved pose as pictures show it.

    Parameters
    ----------
    row : int
        Its number among the poses.
    springs : Springs
        Equivalent springs of the legs in it.
    twists : dict of str to ndarray, shape (3, loads)
        By vertex, its twist about the asked point under each load, in the units of the mechanism.
    pushes : dict
        By the number of each load elsewhere, its places, forces and moments; see `pushes`.
    """

    body: Body
    row: int
    configuration: Configuration
    springs: Springs
    twists: dict[str, Floats]
    pushes: dict[int, list[tuple[complex, complex, float]]]


@dataclass(frozen=True, eq=False)
class DrawnStiffness(Drawn):
    """The poses whose stiffness was asked.

    Parameters
    ----------
    shown : Shown
        The solved poses, evenly spread where they are many.
    first, loose : DrawnPose or None
        The first valid pose, and the first with a free twist; None where there is none.
    """

    shown: Shown
    first: DrawnPose | None
    loose: DrawnPose | None


def _drawn_pose(body: Body, poses: Poses, solved: Solved, pose: Pose | None) -> DrawnPose | None:
    """A pose with its springs, and with the twists that the loads make."""
    if pose is None:
        return None
    row, configuration = pose
    body = body.at(poses, np.array([row]))
    parts = under_loads(body, configuration)[1] if body.given.wrenches else []
    twists = {
        vertex: np.concatenate([(part.displacements[vertex] @ applied)[0] for part, applied in parts], axis=1)
        for vertex in (body.network.paths if parts else ())
    }
    springs = solved.springs.take(solved.springs.row == row)
    return DrawnPose(body, row, configuration, springs, twists, pushes(body, configuration))


def solve(
    study: Study, body: Body, poses: Poses, all_solved: Iterable[SolvedPoses], jobs: int | None = 1,
    progress: Progress = NULL, *, effects: bool = True,
) -> Solved:  # fmt: skip
    """How the body is held in all solved poses; one that cannot be assembled is nan.

    `effects` adds the effects of the study's loads.
    """
    held = Held.unknown(poses.count, body.size)
    reason = np.zeros(poses.count, dtype=np.int8)
    springs: list[Springs] = []
    # Deflections under loads elsewhere, and by the flanks of teeth that a load presses, are effects, too.
    loads = len(body.given.wrenches) if effects or body.uneven else 0
    all_effects = Effects.unknown(body.network, poses.count, loads, body.size) if loads else None
    first: Pose | None = None
    loose: Pose | None = None
    keeper = Keeper(study, poses)
    for solved in all_solved:
        configuration = solved.configuration
        reason[solved.rows] = configuration.reason
        assembled = np.flatnonzero(np.isin(configuration.reason, (Reason.OK, Reason.LIMIT)))
        chunks = [assembled[k : k + CHUNK] for k in range(0, len(assembled), CHUNK)]
        batches = ((body.at(poses, solved.rows[index]), configuration.take(index)) for index in chunks)
        answers = map_chunks(partial(_evaluate, effects=bool(loads)), batches, jobs)
        for index, (held_part, leg_springs, effect) in zip(chunks, answers, strict=True):
            rows = solved.rows[index]
            put(held, rows, held_part)
            springs += [replace(s, row=rows[s.row]) for s in leg_springs]
            if all_effects is not None and effect is not None:
                put(all_effects, rows, effect)
            progress.update(len(index))
        first = first or _pose(solved, configuration.valid)
        loose = loose or _pose(solved, np.isfinite(held.free[solved.rows, 0]))
        keeper.keep(solved)
    return Solved(held, reason, Springs.sorted(springs), all_effects, first, loose, keeper.shown)


def _pose(solved: SolvedPoses, chosen: Flags) -> Pose | None:
    """The first of some solved poses that `chosen` marks, with its row; None where it marks none."""
    index = np.flatnonzero(chosen)[:1]
    return (int(solved.rows[index[0]]), solved.configuration.take(index)) if len(index) else None


def tables(
    study: Study, body: Body, poses: Poses, solved: Solved, names: Collection[str] = ORDER
) -> dict[str, Table]:  # fmt: skip
    """The study's tables, as far as they are among `names`, with the rows of all designs."""
    soft, effects = solved.held.compliance, solved.effects
    body = body.at(poses, np.arange(poses.count))
    section = body.section
    count = len(section.wrenches)
    loads = np.broadcast_to(body.loads, (poses.count, count, 3)) if count else None
    method = "serial legs" if body.legs is not None else "force method"
    makers: dict[str, Callable[[], Table]] = {
        "stiffness": lambda: stiffness_table(study, poses, solved.held, solved.reason == 0, method, section.direction),
        "compliance": lambda: compliance_table(study, poses, soft),
    }
    length = section.characteristic_length
    if body.size == 3 and length is not None:
        makers["eigen"] = lambda: eigen_table(study, poses, soft, length)
    legs = body.legs
    if legs is not None:
        makers["springs"] = lambda: springs_table(study, poses, [leg.name for leg in legs], solved.springs)
    if loads is not None:
        moved = effects.moved if effects is not None and body.uneven else None
        makers["deflections"] = lambda: deflections_table(study, poses, loads, soft, moved)
    if effects is not None:
        makers["forces"] = lambda: forces_table(study, poses, body.network, effects)
        makers["displacements"] = lambda: displacements_table(study, poses, body.network, effects)
    return {name: make() for name, make in makers.items() if name in names}


def _evaluate(
    batch: tuple[Body, Configuration], *, effects: bool
) -> tuple[Held, Iterable[Springs], Effects | None]:  # fmt: skip
    """`hold` of a body in its poses, and the effects of the study's loads; None without `effects`."""
    body, configuration = batch
    if not effects:
        return *hold(body, configuration), None
    loaded, parts = under_loads(body, configuration)
    held, springs = (loaded.held, ()) if body.legs is None else hold(body, configuration)
    soft = loaded.held.compliance
    return (
        held,
        springs,
        Effects.joined(
            [effects_of(body.network, part, body.given.at, configuration, applied, soft) for part, applied in parts]
        ),
    )


class _Cautions:
    """Warnings about under-constrained poses, links without a beam, and legs without a free joint."""

    def __init__(self, study: Study, poses: Poses, body: Body, held: Held) -> None:
        self.study, self.poses, self.margin = study, poses, held.margin
        finite = (held.rank > 0) | np.isfinite(held.stiffness).all(axis=(1, 2))
        self.loose = finite & (held.rank < body.size)
        self.near = finite & (held.rank == body.size) & (held.margin < NEAR_SINGULAR)
        self.points, self.legs = _without_beam(study, body), _without_joint(body)

    def of(self, rows: slice) -> list[Caution]:
        """Warnings about the poses of one design."""
        study, poses, count, warnings = self.study, self.poses, rows.stop - rows.start, [*self.points]
        loose, near = (rows.start + np.flatnonzero(where[rows]) for where in (self.loose, self.near))
        if len(loose):
            first = pose_in_words(study, poses, int(loose[0]))
            warnings.append(Caution(
                "singular",
                f"{len(loose)} of {count} poses are under-constrained: a twist is free (free_x, free_y, free_phi), "
                f"and the compliance is nan; the first: {first}",
                "stiffness", int(loose[0]) - rows.start, first,
            ))  # fmt: skip
        if len(near):
            first = pose_in_words(study, poses, int(near[0]))
            warnings.append(Caution(
                "singular",
                f"{len(near)} of {count} poses are nearly under-constrained (wrenches within "
                f"{self.margin[near].min():.1e} of dependence); the first: {first}",
                "stiffness", int(near[0]) - rows.start, first,
            ))  # fmt: skip
        return [*warnings, *self.legs]


def _without_beam(study: Study, body: Body) -> list[Caution]:
    links = study.mechanism.description.links
    return [
        Caution(
            "ignored",
            f"link '{name}' has a single point, and so no beam: it is rigid, though 'elastic' names it; give it two "
            "ends",
        )
        for name in body.given.elastic
        if len(links[name].corners) < 2
    ]


def _without_joint(body: Body) -> list[Caution]:
    return [
        Caution(
            "incomplete",
            f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs",
            "springs",
        )
        for leg in body.legs or ()
        if not any(isinstance(element, Hinge | SlideElement) and element.drive is None for element in leg.elements)
    ]
