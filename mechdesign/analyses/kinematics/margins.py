"""What keeps a motion going, as functions of the one coordinate that is swept: positive while it goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.poses import radians
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import Value, cross
from mechdesign.mechanism.change_points import closing_groups
from mechdesign.mechanism.structure import Group
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup

DEAD_CENTRE, SINGULARITY, LIMIT, ZERO_LENGTH = "dead centre", "singularity", "limit", "leg at zero length"


@dataclass(frozen=True)
class Cause:
    """What ends a motion where its margin reaches zero.

    Parameters
    ----------
    kind, joint : str
        As in the table of limits.
    group : int
        Index of the group among the plan's, -1 for legs and stated limits.
    role : str
        ``closure``; ``across`` (its sign alone tells: the motion goes to infinity where it changes); ``reached`` (1 or
        -1: a group without a closed form); ``leg``; ``limit``.
    """

    kind: str
    joint: str
    group: int
    role: str


class Margins:
    """Margins of a sweep, in the order in which the mechanism is solved.

    A margin is nan where something before it in that order already ends the motion.

    Parameters
    ----------
    swept : str
        The one coordinate of the group of poses that moves; the others are held at their first value.
    near : mapping of str to ndarray, shape (poses,)
        Angles at the poses (radians), without jumps: elsewhere they are told on this branch.
    counted : bool
        Whether limits count the turns of angles that are swept or followed.
    """

    def __init__(
        self, study: Study, poses: PoseGroup, swept: str, near: Mapping[str, Floats], *, counted: bool = True
    ) -> None:
        self.mechanism: Mechanism = study.mechanism
        self.plan = self.mechanism.plan(poses.names)
        self.which = poses.names.index(swept)
        self.coordinate = self.plan.structure.given[self.which]
        columns = [
            np.asarray(radians(study, c, v), dtype=float)
            for c, v in zip(self.plan.structure.given, poses.columns(), strict=True)
        ]
        self.at: Floats = columns[self.which]
        self.held = [float(column[0]) for column in columns]
        self.near = {name: self._known(values) for name, values in near.items() if name not in poses.names}
        self.counted = counted
        graph, structure = self.mechanism.graph, self.plan.structure
        known = {slide for slide, _ in structure.known_slides}
        closing = closing_groups(structure.groups)
        causes: list[Cause] = []
        for index, group in enumerate(structure.groups):
            joint = joints_of(self.mechanism, group)
            leg = next((graph.slides[slide] for slide in group.slides if slide in graph.telescopic), None)
            if group.form == "angle and turning slide" and leg is not None:
                causes.append(Cause(ZERO_LENGTH, leg, index, "closure"))
            else:
                causes += [Cause(DEAD_CENTRE, joint, index, "closure")] * closing.count(index)
            if group.form == "two slides":
                causes.append(Cause(SINGULARITY, joint, index, "across"))
            if group.form == "newton":
                causes.append(Cause(SINGULARITY, joint, index, "reached"))
        self.legs = sorted(graph.telescopic - (known - {self.coordinate.slide}))
        causes += [Cause(ZERO_LENGTH, graph.slides[slide], -1, "leg") for slide in self.legs]
        if self.coordinate.kind == "distance":
            causes.append(Cause(ZERO_LENGTH, self.coordinate.name, -1, "leg"))
        named = self.mechanism.margins(self.mechanism.sketch_configuration)
        causes += [Cause(LIMIT, name, -1, "limit") for name, _ in named]
        self.causes = tuple(causes)

    def solve(self, place: Floats, start: Configuration | None = None, *, limits: bool = True) -> Configuration:
        """The mechanism at values of the swept coordinate (radians or length)."""
        given: list[Value] = list(self.held)
        given[self.which] = place
        found = self.plan.solve(given, start=start, limits=False)
        near = {name: np.asarray(np.interp(place, *known)) for name, known in self.near.items()}
        if self.counted:
            found = replace(found, near={**found.near, **near}, counted=found.counted | near.keys())
        else:
            found = replace(found, near={**found.near, **near, **self.mechanism.turns({})}, counted=frozenset())
        if limits:
            self.plan.judge(found)
        return found

    def _known(self, values: Floats) -> tuple[Floats, Floats]:
        """Swept coordinate, rising, and the values of poses that have one; nan where none has."""
        known = np.flatnonzero(np.isfinite(values))
        known = known[np.argsort(self.at[known], kind="stable")]
        return (self.at[known], values[known]) if len(known) else (np.zeros(1), np.full(1, np.nan))

    def start(self, place: Floats) -> Configuration | None:
        """Poses that groups without a closed form may be continued from; None where every group has one."""
        return self.solve(place, limits=False) if self.plan.iterative else None

    def look(self, place: Floats, start: Configuration | None = None) -> tuple[Floats, Flags]:
        """Margins at values of the swept coordinate, shape (margins, n), and whether the mechanism is valid there.

        nan, and not valid, where the pose to start from is none.
        """
        if start is None or start.valid.all():
            pose = self.solve(place, start, limits=False)
            values = self.of(pose, place)
            self.plan.judge(pose)
            return values, pose.valid
        values, valid = np.full((len(self.causes), len(place)), np.nan), np.zeros(len(place), dtype=bool)
        live = np.flatnonzero(start.valid)
        if len(live):
            values[:, live], valid[live] = self.look(place[live], start.take(live))
        return values, valid

    def of(self, configuration: Configuration, place: Floats) -> Floats:
        """Margins of poses solved without the limits, shape (margins, n)."""
        good = configuration.reason == Reason.OK
        closures = iter(configuration.closures)
        found: list[Value] = []
        lost = np.zeros(place.shape, dtype=bool)  # poses that a group without a closed form does not reach
        open_ = np.zeros(place.shape, dtype=bool)  # poses in which an earlier group does not close
        for cause in self.causes:
            if cause.role == "closure":
                found.append(np.where(lost, np.nan, next(closures)))
                open_ = open_ | ~(found[-1] >= 0)
            elif cause.role == "across":
                found.append(np.where(lost, np.nan, self._across(configuration, cause.group)))
            elif cause.role == "reached":
                found.append(np.where(good, 1.0, np.where(open_, np.nan, -1.0)))
                lost, open_ = ~good, open_ | ~good
        found += self._lengths(configuration, place)
        found += [m for _, m in self.mechanism.margins(configuration)]
        return np.stack([np.broadcast_to(np.asarray(m, dtype=float), place.shape) for m in found])

    def _lengths(self, configuration: Configuration, place: Floats) -> list[Value]:
        slides = configuration.slides
        if self.legs and not self.plan.iterative:
            # As they come out of the closed forms: those of a pose that is not valid are hidden.
            given: list[Value] = list(self.held)
            given[self.which] = place
            slides = self.plan.run(given, configuration.vectors, None, self.plan.modes_at(given)).slides
        lengths = [slides[slide] for slide in self.legs]
        return [*lengths, place] if self.coordinate.kind == "distance" else lengths

    def _across(self, configuration: Configuration, index: int) -> Value:
        structure = self.plan.structure
        group = structure.groups[index]
        one, two = (
            configuration.vectors.d[k] * configuration.rotations[structure.edges[k].frame]
            for k, _ in group.loops[0].edges
            if structure.edges[k].slide in group.slides
        )
        return cross(np.asarray(one), np.asarray(two))


def joints_of(mechanism: Mechanism, group: Group) -> str:
    """Names of the points at which a group's links meet each other and what was placed before them."""
    graph = mechanism.graph
    edges = [graph.edges[k] for loop in group.loops for k, _ in loop.edges if k < len(graph.edges)]
    return " ".join(dict.fromkeys(graph.nodes[n] for e in edges for n in (e.tail, e.head) if ":" not in graph.nodes[n]))
