"""What ends the motion or the region of a mechanism: margins, positive within and zero where it ends, and folds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.mechanism.algebra import Value, cross, quiet
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.solve import equations, run, set_unknowns
from mechdesign.mechanism.state import State, Unknowns, start_state
from mechdesign.numerics.arrays import Flags, Floats

DEAD_CENTRE, SINGULARITY, LIMIT, ZERO_LENGTH = "dead centre", "singularity", "limit", "leg at zero length"
# Largest errors at a fold: of its equations (parts of the mechanism's size) and of the determinant (parts of that at
# the last pose).
FOLD_SOLVED = 1e-9
# How far from the last pose a fold may lie along the coordinate (radians, or parts of the size).
FOLD_REACH = 0.1


@dataclass(frozen=True)
class Cause:
    """What ends a motion or a region where its margin reaches zero.

    Parameters
    ----------
    kind : str
        ``dead centre``: a group of links is stretched or folded. ``singularity``: links that are solved together turn
        back, or the motion goes to infinity. ``leg at zero length``. ``limit``: one that the study states.
    name, joint : str
        The links of the group and how they lie, and its joints; for others the leg or the limit.
    group : int
        Index of the group among the plan's, -1 for legs and stated limits.
    role : str
        Which margin it has: ``closure`` of a group; ``across``, of two slides (the motion goes to infinity where the
        sign changes); ``reached``, 1 or -1, of a group without a closed form; ``leg``; ``limit``.
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
        The coordinates that the poses give (radians, lengths); all but `swept` are held at their first value.
    near : mapping of str to ndarray, shape (poses,)
        Angles at the poses (radians), without jumps: between the poses angles continue them.
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

        nan, and not valid, where the pose to start from is not valid.
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


def turning_point(
    plan: Plan, given: Sequence[float], k: int, near: Configuration
) -> tuple[float, Configuration, int] | None:
    """Value of given coordinate `k` at which the motion ends at a fold of a group without a closed form.

    There the determinant of the group's equations F(y, s) = 0 vanishes. F = 0 and det(dF/dy) = 0 together are regular
    there, so that the fold can be solved for to the last digit, where a search for the last pose that converges cannot.

    Parameters
    ----------
    given : sequence of float
        Values of the plan's coordinates at `near` (radians and lengths).
    near : Configuration
        A single valid pose shortly before the end.

    Returns
    -------
    (float, Configuration, int) or None
        The value, the pose there, and the index of the group in the plan; None where no fold is near.
    """
    guess = plan.unknowns(near, given)
    reach = FOLD_REACH * (1.0 if plan.structure.given[k].quantity == "angle" else plan.core.size)
    folds = [(index, _fold(plan, given, k, near, guess, index)) for index in plan.structure.unknowns]
    found = [(abs(fold[0] - given[k]), index, fold) for index, fold in folds if fold is not None]
    distance, index, (value, state) = min(found, key=lambda one: one[:2], default=(np.inf, 0, (0.0, None)))
    if state is None or distance > reach:
        return None
    return value, plan.configuration(state, (), near.places, None), index


@quiet
def _fold(
    plan: Plan, given: Sequence[float], k: int, near: Configuration, guess: Unknowns, index: int
) -> tuple[float, State] | None:
    """The coordinate's value at a fold of group `index`, and the state there."""
    from scipy.optimize import root

    group, size = plan.structure.groups[index], plan.core.size
    own = np.array(guess[plan.structure.unknowns[index]], dtype=float)
    weights = np.where(np.arange(len(own)) < len(group.angles), 1.0, size)

    def at(value: float) -> list[Value]:
        return [np.asarray(value if j == k else v) for j, v in enumerate(given)]

    def state_at(unknowns: Floats) -> State:
        """Everything up to the group, with its unknowns and the coordinate in their own scales."""
        values = at(unknowns[-1])
        state = start_state(plan.core.graph, plan.structure, near.vectors, values)
        state.size = size
        run(state, plan.modes_at(values)[:index], guess)
        set_unknowns(state, group, unknowns[:-1] * weights)
        return state

    def system(unknowns: Floats) -> tuple[Floats, float]:
        """Errors of the group's equations and their determinant, lengths in parts of the mechanism's size."""
        rows, right = equations(state_at(unknowns), group)
        matrix = np.array(rows, dtype=float) * weights / size
        return np.array(right, dtype=float) / size, float(np.linalg.det(matrix))

    def residual(unknowns: Floats) -> Floats:
        errors, determinant = system(unknowns)
        return np.append(errors, determinant / unit)

    begin = np.append(own / weights, given[k])
    unit = abs(system(begin)[1]) or 1.0
    answer: Any = root(residual, begin, method="hybr", options={"xtol": 1e-14, "factor": 0.1})
    if not np.abs(residual(answer.x)).max() < FOLD_SOLVED:
        return None
    value, state = float(answer.x[-1]), state_at(answer.x)
    state.place(group)
    return value, run(state, plan.modes_at(at(value)), guess, begin=index + 1)
