"""Limits of motions and regions: margins, which are positive inside and zero at the limit, and folds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value, Vector, cross, dot, norm2
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.derivatives import Linearization, inner
from mechdesign.mechanism.loops import Unknowns, rows_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.solve import State, run, solve_linear

DEAD_CENTRE, SINGULARITY, LIMIT, ZERO_LENGTH = "dead centre", "singularity", "limit", "leg at zero length"
NO_VALUE = Reason.NO_VALUE.text
# Largest residuals of a fold: of its equations (parts of the mechanism's size) and of the determinant (parts of the
# determinant at the last pose).
FOLD_SOLVED = 1e-9


@dataclass(frozen=True)
class Cause:
    """The cause by which a motion or a region ends where the cause's margin reaches zero.

    Parameters
    ----------
    kind : str
        ``dead centre``: a group of links is stretched or folded. ``singularity``: a group without a closed form turns
        back, or the motion goes to infinity. ``leg at zero length``. ``coupling without a value``. ``limit``: a limit
        that the study states.
    name, joint : str
        The links of the group and how they lie, and its joints; for legs and limits their names.
    group : int
        Index of the group among the plan's, -1 for legs and stated limits.
    role : str
        Which margin it has: ``closure`` of a group; ``across``, the sine between two slides (the motion goes to
        infinity where its sign changes); ``reached``, 1 or -1, of a group without a closed form; ``value``, the same of
        a coupling; ``leg``; ``limit``.
    """

    kind: str
    name: str
    joint: str
    group: int
    role: str


def causes(plan: Plan, mechanism: Mechanism, legs: Iterable[str]) -> list[Cause]:
    """All that may end a motion, in the order of solution: groups, then `legs`, then stated limits."""
    graph, listed = mechanism.graph, list[Cause]()
    for index, group in enumerate(plan.structure.groups):
        joint = " ".join(graph.joined(group.edges))
        links = "-".join(
            dict.fromkeys(b.removesuffix(":rod") for b, (frame, _) in graph.bodies.items() if frame in group.angles)
        )
        leg = next((graph.slides[slide] for slide in group.slides if slide in graph.telescopic), None)
        if group.form == "two angles":
            listed += [Cause(DEAD_CENTRE, f"{links} {how}", joint, index, "closure") for how in ("stretched", "folded")]
        elif group.form == "angle and turning slide" and leg is not None:
            listed.append(Cause(ZERO_LENGTH, f"{links} at its reach", leg, index, "closure"))
        elif group.form in ("angle and turning slide", "angle and fixed slide"):
            listed.append(Cause(DEAD_CENTRE, f"{links} at its reach", joint, index, "closure"))
        elif group.form == "two slides":
            listed.append(Cause(SINGULARITY, joint, joint, index, "across"))
        elif group.form == "newton":
            listed.append(Cause(SINGULARITY, joint, joint, index, "reached"))
        elif group.form == "coupled":
            name = mechanism.couplings[plan.coupling_of(group)].name
            listed.append(Cause(NO_VALUE, name, name, index, "value"))
    listed += [Cause(ZERO_LENGTH, f"{leg} length", leg, -1, "leg") for leg in legs]
    stated = mechanism.margins(mechanism.sketch_configuration)
    return listed + [Cause(LIMIT, name, name, -1, "limit") for name, _ in stated]


class Margins:
    """Margins of all causes that may end the motion of a plan, as functions of solved poses, shape (causes, n).

    They are in the order of `causes`; the stated limits come last, and `limited` is their number.
    """

    def __init__(self, mechanism: Mechanism, plan: Plan) -> None:
        self.mechanism, self.plan = mechanism, plan
        graph, spans = mechanism.graph, [plan.structure.given[k] for _, k in plan.structure.spans]
        self.legs = sorted(graph.telescopic)
        lengths = [*(graph.slides[slide] for slide in self.legs), *(distance.name for distance in spans)]
        self.causes = tuple(causes(plan, mechanism, lengths))
        self.limited = sum(cause.role == "limit" for cause in self.causes)

    def of(self, configuration: Configuration, given: Sequence[Value]) -> Floats:
        """Margins except the stated limits, of poses solved without limits; nan where an earlier margin is negative.

        `given` are the values of the plan's coordinates (radians, lengths), shape (n,).
        """
        good = configuration.reason == Reason.OK
        lost = np.zeros(configuration.shape, dtype=bool)  # poses that a group without a closed form does not reach
        ended = np.zeros(configuration.shape, dtype=bool)  # poses in which an earlier group does not close
        closures, lengths = iter(configuration.closures), iter(self._lengths(configuration, given))
        margins = np.empty((len(self.causes) - self.limited, *configuration.shape))
        for row, cause in zip(margins, self.causes, strict=False):
            if cause.role == "reached":
                row[:] = np.where(good, 1.0, np.where(ended, np.nan, -1.0))
                lost, ended = ~good, ended | ~good
            elif cause.role == "value":
                number = self.plan.coupling_of(self.plan.structure.groups[cause.group])
                without = configuration.reason == Reason.NO_VALUE + number
                row[:] = np.where(without, -1.0, np.where(ended, np.nan, 1.0))
                ended = ended | without
            elif cause.role == "across":
                row[:] = np.where(lost, np.nan, self._across(configuration, cause.group))
            else:
                row[:] = next(closures if cause.role == "closure" else lengths)
            if cause.role == "closure":
                row[lost] = np.nan
                ended = ended | ~(row >= 0)
        return margins

    def of_limits(self, configuration: Configuration) -> Floats:
        """Margins of the stated limits, smooth along a motion."""
        margins = self.mechanism.margins(configuration, smooth=True)
        return np.stack([np.broadcast_to(margin, configuration.shape) for _, margin in margins])

    def _lengths(self, configuration: Configuration, given: Sequence[Value]) -> list[Value]:
        slides: Sequence[Value] = configuration.slides
        if self.legs and not self.plan.iterative:
            # Solved again, as lengths of poses that are not valid are nan.
            turns = self.plan.near_of(configuration)
            slides = self.plan.run(given, configuration.vectors, None, self.plan.modes_at(given), turns=turns).slides
        return [*(slides[slide] for slide in self.legs), *(given[k] for _, k in self.plan.structure.spans)]

    def _across(self, configuration: Configuration, index: int) -> Value:
        structure = self.plan.structure
        group = structure.groups[index]
        one, two = (
            configuration.direction(k) for k, _ in group.loops[0].edges if structure.edges[k].slide in group.slides
        )
        return cross(np.asarray(one), np.asarray(two))


def closures(linear: Linearization, places: Sequence[str]) -> tuple[Floats, Floats]:
    """Margins of assembly with the drives held, and their derivatives by dimensions; a margin of 0 is a dead centre.

    Two links have three margins, the triangle inequalities of their lengths and of the distance that they span. A link
    with a slide has two: its length less its reach across the slide, to either side. A group without a closed form has
    the square of its conditioning, relative to the square itself: near a fold it is linear in the dimensions. A
    telescopic leg has its length.

    Returns
    -------
    margins, slopes
        Shape (margins, ...) and (margins, places, ...), at the configurations of `linear`.
    """
    position = linear.sensitivity(places)
    shape = linear.configuration.shape
    pairs: list[tuple[Value, Value]] = [(linear.slides[leg], position.slides[leg]) for leg in linear.graph.telescopic]
    for index, group in enumerate(linear.structure.groups):
        if not group.solved or group.form == "two slides" or group.conditions:
            continue
        lines, changes = linear.loop_columns(index, group), linear.column_sensitivity(group, places, position)
        if group.form == "newton":
            rows, changed = rows_of(lines), rows_of(changes)
            logarithmic: Value = 0.0
            for k in range(len(rows)):
                metric = linear.structure.metrics[index]
                column, column_z = ([line[k] for line in part] for part in (lines, changes))
                logarithmic = logarithmic + solve_linear(rows, [row[k] for row in changed])[0][k]
                logarithmic = logarithmic - inner(metric, column, column_z) / inner(metric, column, column)
            pairs.append((1.0, 2.0 * logarithmic))
            continue
        ((a, b),), ((a_z, b_z),) = lines, changes
        if group.form == "two angles":
            sides = [_length(a, a_z), _length(b, b_z), _length(a + b, a_z + b_z)]
            total, total_z = (sum(part) for part in zip(*sides, strict=True))
            pairs += [(total - 2.0 * side, total_z - 2.0 * side_z) for side, side_z in sides]
            continue
        (size, size_z), (unit, unit_z) = _length(a, a_z), _length(b, b_z)
        reach = dot(a, b) / unit
        reach_z = (dot(a_z, b) + dot(a, b_z) - reach * unit_z) / unit
        pairs += [(size - way * reach, size_z - way * reach_z) for way in (1.0, -1.0)]
    margins, slopes = np.empty((len(pairs), *shape)), np.empty((len(pairs), len(places), *shape))
    for k, (margin, slope) in enumerate(pairs):
        margins[k], slopes[k] = margin, slope
    return margins, slopes


def _length(a: Vector, a_z: Vector) -> tuple[Value, Value]:
    """Length of a vector, and its derivatives."""
    length = np.sqrt(norm2(a))
    return length, dot(a, a_z) / length


def turning_point(
    plan: Plan, given: Callable[[float], Sequence[float]], place: float, reach: float, near: Configuration
) -> tuple[float, Configuration, int] | None:
    """Place along a motion at which it ends at a fold of a group without a closed form.

    There the determinant of the group's equations F(y, s) = 0 vanishes. The system F = 0, det(dF/dy) = 0 is regular at
    a fold, so that Newton's method finds it to the last digit.

    Parameters
    ----------
    given : callable
        Values of the plan's coordinates (radians and lengths) at a place.
    place, reach : float
        Where `near` is, and how far from there a fold may lie.
    near : Configuration
        A single valid pose shortly before the end.

    Returns
    -------
    (float, Configuration, int) or None
        The place, the pose there, and the index of the group in the plan; None where no fold is near.
    """
    guess = plan.unknowns(near, given(place))
    folds = [(index, _fold(plan, given, place, reach, near, guess, index)) for index in plan.structure.unknowns]
    candidates = [(abs(fold[0] - place), index, fold) for index, fold in folds if fold is not None]
    distance, index, (end, state) = min(candidates, key=lambda one: one[:2], default=(np.inf, 0, (0.0, None)))
    if state is None or distance > reach:
        return None
    return end, plan.configuration(state, (), near.places, None), index


def _fold(
    plan: Plan, given: Callable[[float], Sequence[float]], place: float, reach: float, near: Configuration,
    guess: Unknowns, index: int,
) -> tuple[float, State] | None:  # fmt: skip
    """The place of a fold of group `index`, and the state there."""
    from scipy.optimize import root

    group, size, turns = plan.structure.groups[index], plan.core.size, plan.near_of(near)
    own = np.array(guess[plan.structure.unknowns[index]], dtype=float)
    weights = np.where(np.arange(len(own)) < len(group.angles), 1.0, size)

    def state_at(unknowns: Floats) -> State:
        """The mechanism up to the group, for the group's unknowns and the place, each in its own scale."""
        values = [np.asarray(value) for value in given(place + reach * unknowns[-1])]
        state = plan.begin(values, near.vectors, turns)
        run(state, plan.modes_at(values)[:index], guess)
        state.put(group, unknowns[:-1] * weights)
        return state

    def system(unknowns: Floats) -> tuple[Floats, float]:
        """Errors of the group's equations and their determinant, lengths in parts of the mechanism's size."""
        rows, right = state_at(unknowns).equations(group)
        matrix = np.array(rows, dtype=float) * weights / size
        return np.array(right, dtype=float) / size, float(np.linalg.det(matrix))

    def residual(unknowns: Floats) -> Floats:
        errors, determinant = system(unknowns)
        return np.append(errors, determinant / unit)

    begin = np.append(own / weights, 0.0)
    unit = abs(system(begin)[1]) or 1.0
    answer: Any = root(residual, begin, method="hybr", options={"xtol": 1e-14, "factor": 0.1})
    if not np.abs(residual(answer.x)).max() < FOLD_SOLVED:
        return None
    end, state = place + reach * float(answer.x[-1]), state_at(answer.x)
    state.place(group)
    values = [np.asarray(value) for value in given(end)]
    return end, run(state, plan.modes_at(values), guess, begin=index + 1)
