"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads.

Of one design or of many at once: their poses are one batch, and so are the numbers of the section in which they differ.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import (
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
from mechdesign.analyses.stiffness.compliance import Held, put
from mechdesign.analyses.stiffness.elements import Guide, Hinge, corners_of, spread
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
from mechdesign.analyses.together import Answers, End, Group
from mechdesign.errors import AssemblyError, StudyError
from mechdesign.mechanism import Configuration, Reason
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Scope, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.stiffness import StiffnessSection
from mechdesign.work.chunks import map_chunks
from mechdesign.work.threads import one_thread

# Poses solved together.
CHUNK = 8192
# Tables in the order in which they are shown.
ORDER = ("stiffness", "compliance", "eigen", "springs", "deflections", "forces", "displacements")
# Wrenches (of unit size) nearer to dependence than this get a warning: rounding and tolerances decide the answer.
NEAR_SINGULAR = 1e-4
Pose = tuple[int, Configuration]


@dataclass(frozen=True, eq=False)
class Body:
    """The body, or the pin, whose stiffness is asked, and what carries it; ready for any number of poses.

    Parameters
    ----------
    given : StiffnessSection
        The study's section.
    legs : tuple of Leg or None
        Where the body stands on serial chains, those; None where it does not.
    network : Network
        All that carries, whatever it is.
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        The pin is a point of one link only, or its end on one: the link turns freely under forces at it.
    extent : float
        Size of the mechanism.
    poses, rows : optional
        The poses that it is asked in, and their rows among these, where designs differ in numbers of the section.
    """

    given: StiffnessSection
    legs: tuple[Leg, ...] | None
    network: Network
    size: int
    condensed: bool
    extent: float
    poses: Poses | None = None
    rows: Ints | None = None

    def at(self, poses: Poses, rows: Ints) -> Body:
        """The body in some of the poses."""
        return replace(self, poses=poses, rows=rows)

    def take(self, index: Ints) -> Body:
        """The body in some of its poses, by index."""
        return self if self.rows is None else replace(self, rows=self.rows[index])

    @cached_property
    def section(self) -> StiffnessSection:
        """The section with the numbers of the poses: arrays where designs differ in them."""
        if self.poses is None or self.rows is None:
            return self.given
        return self.poses.section(self.given, self.rows)

    @property
    def loads(self) -> Floats:
        """Forces and moment of each load in each pose, shape (poses, loads, 3); one pose where all have the same."""
        parts = np.broadcast_arrays(*(part for load in self.section.loads for part in load))
        return np.stack(parts, axis=-1).reshape(-1, len(self.given.loads), 3)

    def length(self, configuration: Configuration) -> Floats:
        """What turns rotations into lengths where sizes are compared, shape (n,); no result depends on it.

        It is how far the joints that carry lie apart; whatever else is far away does not count.
        """
        return spread([edge.point for edge in self.network.edges], configuration, self.extent)


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
    """Answer `stiffness` for the poses of several designs, each as if it were asked alone, without pictures.

    A design without a valid pose has an error.
    """
    return Answers([_group(study, ask(study), poses, 1, NULL)])


def _group(study: Study, body: Body, poses: Poses, jobs: int | None, progress: Progress) -> Group:
    solved = solve(study, body, poses, jobs, progress)
    each, designs = poses.count // poses.designs, poses.designs
    cautions, ends = _Cautions(study, poses, body, solved.held), []
    for k, reason in enumerate(solved.reason.reshape(designs, each)):
        counts = {"poses": each, "invalid": int(np.count_nonzero(reason))}
        try:
            warnings, failed = judge_failures(study, poses, reason, k * each)
        except AssemblyError as error:
            ends.append(End(counts=counts, error=error))
            continue
        warnings += cautions.of(slice(k * each, (k + 1) * each))
        ends.append(End(warnings, failed, invalid_in_words(reason), counts))
    made = tables(study, body, poses, solved).values()
    if designs > 1:
        scoped = {table.name: replace(table, scope=Scope(poses_only=True)) for table in made}
        uneven = {"springs": solved.springs.counts(designs, each)}
        return Group(np.arange(designs), Result("stiffness", scoped), ends, uneven)
    (end,) = ends
    result = Result(
        "stiffness", of_poses(made, solved.reason), end.warnings, end.counts, end.failed,
        drawn=_drawn(body, poses, solved),
    )  # fmt: skip
    return Group(np.arange(1), result, ends)


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
            moved = by_forces(body, configuration).displacements if body.given.loads else {}
            twists = {vertex: (each @ body.loads[0, :, : body.size].T)[0] for vertex, each in moved.items()}
            drawn[name] = Drawn(body, row, configuration, solved.springs.take(solved.springs.row == row), twists)
    return drawn


def solve(
    study: Study, body: Body, poses: Poses, jobs: int | None = 1, progress: Progress = NULL, *, effects: bool = True
) -> Solved:
    """Solve all poses; one that cannot be assembled is nan. `effects` are those of the loads, if there are any."""
    held = Held.unknown(poses.count, body.size)
    reason = np.zeros(poses.count, dtype=np.int8)
    springs: list[Springs] = []
    loads = len(body.given.loads) if effects else 0
    moved = Effects.unknown(body.network, poses.count, loads) if loads else None
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
        batches = ((body.at(poses, solved.rows[index]), configuration.take(index)) for index in chunks)
        answers = map_chunks(partial(_evaluate, effects=bool(loads)), batches, jobs)
        for index, (part, found, effect) in zip(chunks, answers, strict=True):
            rows = solved.rows[index]
            put(held, rows, part)
            springs += [replace(s, row=rows[s.row]) for s in found]
            if moved is not None and effect is not None:
                put(moved, rows, effect)
            progress.update(len(index))
        loose = loose or _pose(solved, np.isfinite(held.free[solved.rows, 0]))
    return Solved(held, reason, Springs.sorted(springs), moved, first, loose, keeper.shown)


def _pose(solved: SolvedPoses, wanted: Flags) -> Pose | None:
    """The first of some solved poses that is wanted, and its row."""
    index = np.flatnonzero(wanted)[:1]
    return (int(solved.rows[index[0]]), solved.configuration.take(index)) if len(index) else None


def tables(
    study: Study, body: Body, poses: Poses, solved: Solved, wanted: Collection[str] = ORDER
) -> dict[str, Table]:  # fmt: skip
    """Those of some tables that the study has, with the rows of all designs."""
    soft, effects = solved.held.compliance, solved.effects
    body = body.at(poses, np.arange(poses.count))
    section = body.section
    loads = np.broadcast_to(body.loads, (poses.count, len(section.loads), 3)) if section.loads else None
    method = "serial legs" if body.legs is not None else "force method"
    made: dict[str, Callable[[], Table]] = {
        "stiffness": lambda: stiffness_table(study, poses, solved.held, solved.reason == 0, method, section.direction),
        "compliance": lambda: compliance_table(study, poses, soft),
    }
    length = section.characteristic_length
    if body.size == 3 and length is not None:
        made["eigen"] = lambda: eigen_table(study, poses, soft, length)
    legs = body.legs
    if legs is not None:
        made["springs"] = lambda: springs_table(study, poses, [leg.name for leg in legs], solved.springs)
    if loads is not None:
        made["deflections"] = lambda: deflections_table(study, poses, loads, soft)
    if effects is not None:
        made["forces"] = lambda: forces_table(study, poses, body.network, effects)
        made["displacements"] = lambda: displacements_table(study, poses, body.network, effects)
    return {name: make() for name, make in made.items() if name in wanted}


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
    return Body(section, legs, network, 2 if section.link is None else 3, condensed, mechanism.size or 1.0)


def hold(body: Body, configuration: Configuration) -> tuple[Held, Iterable[Springs]]:
    """Stiffness and springs in a batch of assembled poses of shape (n,).

    By the reciprocal wrenches of its legs where these hold the body in closed form (six times as fast), else by the
    force method.
    """
    if body.legs is None:
        return by_forces(body, configuration).held, []
    length = body.length(configuration)
    held, springs = hold_by_legs(body.legs, body.section, configuration, length, body.size, body.condensed)
    rest = np.flatnonzero(held.rank == 0)
    if len(rest):
        put(held, rest, by_forces(body.take(rest), configuration.take(rest)).held)
    return held, springs


def by_forces(body: Body, configuration: Configuration) -> Loaded:
    """The body in a batch of assembled poses by the force method, and what unit loads do."""
    return load(twists_of(body.network, body.section, configuration, body.length(configuration)), body.size)


def _evaluate(
    batch: tuple[Body, Configuration], *, effects: bool
) -> tuple[Held, Iterable[Springs], Effects | None]:  # fmt: skip
    """As `hold` of a body in its poses, and what the study's loads do."""
    body, configuration = batch
    if not effects:
        return *hold(body, configuration), None
    loaded = by_forces(body, configuration)
    held, springs = (loaded.held, ()) if body.legs is None else hold(body, configuration)
    loads = np.broadcast_to(body.loads, (*configuration.shape, len(body.given.loads), 3))
    return held, springs, effects_of(body.network, loaded, body.given.at, configuration, loads)


class _Cautions:
    """What is doubtful of the poses of designs."""

    def __init__(self, study: Study, poses: Poses, body: Body, held: Held) -> None:
        self.study, self.poses, self.margin = study, poses, held.margin
        known = (held.rank > 0) | np.isfinite(held.stiffness).all(axis=(1, 2))
        self.loose = known & (held.rank < body.size)
        self.near = known & (held.rank == body.size) & (held.margin < NEAR_SINGULAR)
        self.points, self.legs = _without_beam(study, body), _without_joint(body)

    def of(self, rows: slice) -> list[str]:
        """Warnings about the poses of one design."""
        study, poses, count, warnings = self.study, self.poses, rows.stop - rows.start, [*self.points]
        loose, near = (rows.start + np.flatnonzero(where[rows]) for where in (self.loose, self.near))
        if len(loose):
            warnings.append(
                f"{len(loose)} of {count} poses are under-constrained: a twist is free (free_x, free_y, free_phi), "
                f"and the compliance is nan; the first: {pose_in_words(study, poses, int(loose[0]))}"
            )
        if len(near):
            warnings.append(
                f"{len(near)} of {count} poses are nearly under-constrained (wrenches within "
                f"{self.margin[near].min():.1e} of dependence); the first: {pose_in_words(study, poses, int(near[0]))}"
            )
        return [*warnings, *self.legs]


def _without_beam(study: Study, body: Body) -> list[str]:
    links = study.mechanism.description.links
    return [
        f"link '{name}' has a single point, and so no beam: it is rigid, though 'elastic' names it; give it two ends"
        for name in body.given.elastic
        if len(corners_of(links[name])) < 2
    ]


def _without_joint(body: Body) -> list[str]:
    return [
        f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs"
        for leg in body.legs or ()
        if not any(isinstance(element, Hinge | Guide) and element.drive is None for element in leg.elements)
    ]
