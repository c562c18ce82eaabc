"""What ends the motion or the region of a mechanism: functions that are positive within it, zero where it ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.mechanism.algebra import Value, cross
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Flags, Floats

DEAD_CENTRE, SINGULARITY, LIMIT, ZERO_LENGTH = "dead centre", "singularity", "limit", "leg at zero length"


@dataclass(frozen=True)
class Cause:
    """What ends a motion or a region where its margin reaches zero.

    Parameters
    ----------
    kind : str
        ``dead centre``: a group of links is stretched or folded. ``singularity``: links that are solved together turn
        back, or the motion goes to infinity. ``leg at zero length``. ``limit``: one that the study states.
    name : str
        The links of the group and how they lie, the leg, or the limit.
    joint : str
        The joints of the group, the leg, or the limit.
    group : int
        Index of the group among the plan's, -1 for legs and stated limits.
    role : str
        ``closure``; ``across`` (its sign alone tells: the motion goes to infinity where it changes); ``reached`` (1 or
        -1: a group without a closed form); ``leg``; ``limit``.
    """

    kind: str
    name: str
    joint: str
    group: int
    role: str


def causes(plan: Plan, mechanism: Mechanism, legs: Iterable[str]) -> list[Cause]:
    """What may end it, in the order in which the mechanism is solved: groups, `legs`, stated limits."""
    graph, found = mechanism.graph, list[Cause]()
    for index, group in enumerate(plan.structure.groups):
        joint = " ".join(graph.joined(group.edges))
        links = "-".join(
            dict.fromkeys(b.removesuffix(":rod") for b, (frame, _) in graph.bodies.items() if frame in group.angles)
        )
        leg = next((graph.slides[slide] for slide in group.slides if slide in graph.telescopic), None)
        if group.form == "two angles":
            found += [Cause(DEAD_CENTRE, f"{links} {how}", joint, index, "closure") for how in ("stretched", "folded")]
        elif group.form == "angle and turning slide" and leg is not None:
            found.append(Cause(ZERO_LENGTH, f"{links} at its reach", leg, index, "closure"))
        elif group.form in ("angle and turning slide", "angle and fixed slide"):
            found.append(Cause(DEAD_CENTRE, f"{links} at its reach", joint, index, "closure"))
        elif group.form == "two slides":
            found.append(Cause(SINGULARITY, joint, joint, index, "across"))
        elif group.form == "newton":
            found.append(Cause(SINGULARITY, joint, joint, index, "reached"))
    found += [Cause(ZERO_LENGTH, f"{leg} length", leg, -1, "leg") for leg in legs]
    stated = mechanism.margins(mechanism.sketch_configuration)
    return found + [Cause(LIMIT, name, name, -1, "limit") for name, _ in stated]


class SweepMargins:
    """Margins along a sweep, in the order of `causes`; nan where something before in that order ends the motion.

    Parameters
    ----------
    given : mapping of str to ndarray, shape (poses,)
        The coordinates that the poses give (radians, lengths); but the swept one they are held at their first value.
    swept : str
        The one that moves.
    near : mapping of str to ndarray, shape (poses,)
        Angles at the poses (radians), without jumps: elsewhere they are told on this branch.
    counted : bool
        Whether limits count the turns of angles that are swept or followed.
    """

    def __init__(
        self, mechanism: Mechanism, given: Mapping[str, Floats], swept: str, near: Mapping[str, Floats],
        *, counted: bool = True,
    ) -> None:  # fmt: skip
        self.mechanism, self.counted = mechanism, counted
        names = tuple(given)
        self.plan = mechanism.plan(names)
        self.which = names.index(swept)
        self.coordinate = self.plan.structure.given[self.which]
        self.at: Floats = given[swept]
        self.held = [float(column[0]) for column in given.values()]
        self.near = {name: self._known(values) for name, values in near.items() if name not in names}
        graph = mechanism.graph
        known = {slide for slide, _ in self.plan.structure.known_slides}
        self.legs = sorted(graph.telescopic - (known - {self.coordinate.slide}))
        lengths = [graph.slides[slide] for slide in self.legs]
        if self.coordinate.kind == "distance":
            lengths.append(self.coordinate.name)
        self.causes = tuple(causes(self.plan, mechanism, lengths))

    def solve(self, place: Floats, start: Configuration | None = None, *, limits: bool = True) -> Configuration:
        """The mechanism at values of the swept coordinate (radians or length)."""
        found = self.plan.solve(self._given(place), start=start, limits=False)
        near = {name: np.asarray(np.interp(place, *known)) for name, known in self.near.items()}
        if self.counted:
            found = replace(found, near={**found.near, **near}, counted=found.counted | near.keys())
        else:
            found = replace(found, near={**found.near, **near, **self.mechanism.turns({})}, counted=frozenset())
        if limits:
            self.plan.judge(found)
        return found

    def _given(self, place: Floats) -> list[Value]:
        return [*self.held[: self.which], place, *self.held[self.which + 1 :]]

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
            values = self._of(pose, place)
            self.plan.judge(pose)
            return values, pose.valid
        values, valid = np.full((len(self.causes), len(place)), np.nan), np.zeros(len(place), dtype=bool)
        live = np.flatnonzero(start.valid)
        if len(live):
            values[:, live], valid[live] = self.look(place[live], start.take(live))
        return values, valid

    def _of(self, configuration: Configuration, place: Floats) -> Floats:
        """Margins of poses solved without the limits."""
        good = configuration.reason == Reason.OK
        lost = np.zeros(place.shape, dtype=bool)  # poses that a group without a closed form does not reach
        open_ = np.zeros(place.shape, dtype=bool)  # poses in which an earlier group does not close
        each = {
            "closure": iter(configuration.closures), "leg": iter(self._lengths(configuration, place)),
            "limit": (margin for _, margin in self.mechanism.margins(configuration)),
        }  # fmt: skip
        found = np.empty((len(self.causes), len(place)))
        for row, cause in zip(found, self.causes, strict=True):
            if cause.role == "reached":
                row[:] = np.where(good, 1.0, np.where(open_, np.nan, -1.0))
                lost, open_ = ~good, open_ | ~good
            elif cause.role == "across":
                row[:] = np.where(lost, np.nan, self._across(configuration, cause.group))
            else:
                row[:] = next(each[cause.role])
            if cause.role == "closure":
                row[lost] = np.nan
                open_ = open_ | ~(row >= 0)
        return found

    def _lengths(self, configuration: Configuration, place: Floats) -> list[Value]:
        slides: Sequence[Value] = configuration.slides
        if self.legs and not self.plan.iterative:
            # As they come out of the closed forms: those of a pose that is not valid are hidden.
            given = self._given(place)
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
