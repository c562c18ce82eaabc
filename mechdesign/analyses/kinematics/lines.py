"""A sweep as a line of poses so fine that functions are smooth between them, from limit to limit of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.kinematics.boundaries import Boundary
from mechdesign.analyses.kinematics.motion import NEAR_SINGULAR, Motion, thinned
from mechdesign.analyses.kinematics.rates import drive_velocities
from mechdesign.analyses.poses import POSES_AT_ONCE, dimensions, in_study_units, radians, starts
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, quiet, wrap
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import STALLED, regularity
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.study import Study

# How far a link may turn between neighbouring poses (radians), by their places and by its slope at either.
MAX_TURN = 0.3
# How far the rise of a function may be from the mean of its slopes, as a part of its range.
MAX_BEND = 0.02
# Halvings of a step of the sweep, at most: a link that turns faster is taken to jump.
MAX_HALVINGS = 14
# Poses of the line, a pose of the sweep, and of a short sweep at least: a motion that needs more is not resolved by the
# steps of its sweep.
POSES_EACH = 64
FEWEST_POSES = 10_000
# Poses added beside one without slopes (a dead centre, from which functions start as a root does), as parts of the step
# to the next pose.
GRADED = np.array([1e-6, 1e-4, 1e-2, 0.1])
# A range below this part of a function's size is rounding.
STILL = 1e-12
# A limit this near to a pose of the sweep, in rows, is that pose.
AT_ROW = 1e-9


@dataclass(frozen=True)
class Function:
    """A function of configurations, and its slope, of configurations and the velocities at unit speed of the sweep.

    Rounding is judged by `size`; `radian` is a radian in its unit, where it is an angle. One without a slope has no
    value either where the drives do not move the mechanism in one way.
    """

    value: Callable[[Configuration], Value]
    slope: Callable[[Configuration, Rates], Value] | None
    size: float = 1.0
    radian: float | None = None


def function_of(study: Study, coordinate: Coordinate) -> Function:
    """A coordinate in the study's units."""
    return Function(
        lambda configuration: in_study_units(study, coordinate, configuration.value(coordinate)),
        lambda configuration, velocity: in_study_units(study, coordinate, first(configuration, coordinate, velocity)),
        study.mechanism.size if coordinate.quantity == "length" else 0.0,
        1 / study.units.angle_factor if coordinate.quantity == "angle" else None,
    )


def _frame(k: int) -> Function:
    """The angle of a class of bodies that turn together."""
    return Function(lambda configuration: np.angle(configuration.rotations[k]), lambda _, v: v.angles[k], radian=1.0)


class PoseLine:
    """Poses along the sweep of one coordinate, of one design or several, and the segments between them.

    Poses are those of the sweep (of a very fine one, some), the limits of motion, and as many between them as the
    turning of the links and the smoothness of the functions need.

    It follows coordinates and `others`, functions by names that no coordinate has; `ends` are limits of motion, known
    for a single design only.

    Attributes
    ----------
    rows : dict of str to int
        Row of each function in `values` and `slopes`.
    row, position, place : ndarray, shape (n,)
        A row of the sweep beside each pose, position along the sweep in rows, and swept coordinate (core's units).
    values, slopes : ndarray, shape (functions, n)
        In the study's units, angles on the branch of the motion; slopes nan where there are none.
    begin, end : ndarray of int, shape (segments,)
        Poses that each segment lies between.
    torn : bool array, shape (designs,)
        Designs whose motion ends between poses where no limit is known.
    limits : list of int
        Poses that are limits of motion.
    resolved : bool
        Whether there are poses enough; not where the steps of the sweep are too long for its motion.
    followed : bool
        Whether the motion is followed through change points: beside them poses have no slopes, and few digits.
    """

    def __init__(
        self, motion: Motion, swept: str, coordinates: Sequence[Coordinate],
        others: Mapping[str, Function], ends: Sequence[Boundary] = (),
    ) -> None:  # fmt: skip
        study, poses = motion.question.study, motion.question.poses
        self.study, self.poses, self.swept, self.ends = study, poses, swept, ends
        (group,) = poses.groups
        self.plan = study.mechanism.plan(group.names)
        # Limits that count the turns of angles are judged along the motion; here its ends tell of them.
        self._limits = not study.mechanism.counting
        self.followed = self.plan.change_points is not None
        self._steady = NEAR_SINGULAR if self.followed else STALLED
        self.which = group.names.index(swept)
        self.given = [
            np.asarray(radians(study, c, v), dtype=float)
            for c, v in zip(self.plan.structure.given, group.columns(), strict=True)
        ]
        self.each = poses.count // poses.designs
        self.torn = np.zeros(poses.designs, dtype=bool)
        # First the angles, which continue from a pose to those beside it.
        self._angles = {name: c for name, c in angles_of(coordinates).items() if name not in group.names}
        functions = {c.name: function_of(study, c) for c in [*self._angles.values(), *coordinates]} | dict(others)
        self.rows = {name: k for k, name in enumerate(functions)}
        self._functions = [*functions.values(), *map(_frame, range(1, study.mechanism.graph.classes))]
        self._radians = np.array([function.radian or np.nan for function in self._functions])
        self._rows = some = np.flatnonzero(thinned(motion, swept) & motion.valid)
        beside = np.searchsorted(some, [round(end.position) for end in ends])
        at_pose = np.isin([round(end.position) for end in ends], some)
        at_pose &= np.array([abs(end.position % 1 - 0.5) >= 0.5 - AT_ROW for end in ends], dtype=bool)
        inside = [end for end, here in zip(ends, at_pose, strict=True) if not here]
        self._start: Configuration | None = None
        if self.plan.iterative and len(some):
            own = [values[some] for values in self.given]
            start = starts(study.mechanism, poses, some)
            self._start = self.plan.solve(own, dimensions(poses, some), start=start, limits=self._limits)
        self.row, self.position, self.place = some, some.astype(float), self.given[self.which][some]
        near = np.array([motion.arrays[name][some] for name in self._angles]).reshape(len(self._angles), len(some))
        self.values, self.slopes, _ = self._in_chunks(self.row, self.place, near)
        self.limits: list[int] = beside[at_pose].tolist()
        for end in inside:
            self._add_end(end, motion.valid)
        self.begin, self.end = self._segments(motion.valid, inside)
        self.resolved = self._refined()
        if not self.resolved:
            self.torn[:] = True

    def sample(self, node: Ints, place: Floats) -> tuple[Floats, Floats, Flags]:
        """Values and slopes of all functions with the swept coordinate at `place`, beside poses of the line."""
        return self._in_chunks(self.row[node], place, self._near(node))

    def at(self, node: Ints, place: Floats) -> Floats:
        """Values of all functions at or beside poses of the line."""
        return np.where(place == self.place[node], self.values[:, node], self.sample(node, place)[0])

    def _near(self, node: Ints) -> Floats:
        return self.values[: len(self._angles), node]

    def _in_chunks(self, row: Ints, place: Floats, near: Floats) -> tuple[Floats, Floats, Flags]:
        if len(row) <= POSES_AT_ONCE:
            return self._sample(row, place, near)
        parts = [slice(k, k + POSES_AT_ONCE) for k in range(0, len(row), POSES_AT_ONCE)]
        values, slopes, valid = zip(*[self._sample(row[p], place[p], near[:, p]) for p in parts], strict=True)
        return np.concatenate(values, axis=1), np.concatenate(slopes, axis=1), np.concatenate(valid)

    def _sample(self, row: Ints, place: Floats, near: Floats) -> tuple[Floats, Floats, Flags]:
        given = [values[row] for values in self.given]
        given[self.which] = place
        start = None
        if self._start is not None:
            start = self._start.take(np.minimum(np.searchsorted(self._rows, row), len(self._rows) - 1))
        pose = self.plan.solve(given, dimensions(self.poses, row), start=start, limits=self._limits)
        told = dict(zip(self._angles, near * self.study.units.angle_factor, strict=True))
        return self._measured(replace(pose, near={**pose.near, **told}))

    @quiet
    def _measured(self, configuration: Configuration) -> tuple[Floats, Floats, Flags]:
        mechanism, given = self.study.mechanism, self.plan.structure.given
        linear = mechanism.linearize(configuration)
        unit = [float(k == self.which) for k in range(len(given))]
        velocity = linear.velocity(drive_velocities(mechanism, linear, given, unit))
        shape, valid = configuration.shape, configuration.valid
        values, slopes = np.full((2, len(self._functions), *shape), np.nan)
        steady = valid & (regularity(linear) >= self._steady)
        for k, function in enumerate(self._functions):
            known = valid if function.slope is not None else steady
            values[k] = np.where(known, function.value(configuration), np.nan)
            if function.slope is not None:
                slopes[k] = np.where(steady, function.slope(configuration, velocity), np.nan)
        values[np.isinf(values)] = np.nan
        slopes[~np.isfinite(slopes)] = np.nan
        return values, slopes, valid

    def _add(self, row: Ints, position: Floats, place: Floats, values: Floats, slopes: Floats) -> Ints:
        index = len(self.row) + np.arange(len(row))
        self.row = np.concatenate([self.row, row])
        self.position, self.place = np.concatenate([self.position, position]), np.concatenate([self.place, place])
        self.values = np.concatenate([self.values, values], axis=1)
        self.slopes = np.concatenate([self.slopes, slopes], axis=1)
        return index

    def _add_end(self, end: Boundary, valid: Flags) -> None:
        """A limit as a pose; where the motion goes to infinity, poses as near to it as its numbers are good."""
        step = int(end.position)
        beside = int(np.searchsorted(self._rows, step if valid[step] else step + 1))
        beside = min(beside, len(self._rows) - 1)
        row = self._rows[[beside]]
        if end.configuration is not None:
            values, slopes, _ = self._measured(end.configuration)
            self.limits += self._add(
                row, np.array([end.position]), np.array([end.place]), values[:, None], np.nan * slopes[:, None]
            ).tolist()  # fmt: skip
            return
        a, b = self.given[self.which][[step, step + 1]]
        for side in (-GRADED[0], GRADED[0]):
            at = np.array([end.place + side * (b - a)])
            values, slopes, good = self.sample(np.array([beside]), at)
            if good.all():
                self._add(row, np.array([end.position + side]), at, values, slopes)

    def _segments(self, valid: Flags, inside: Sequence[Boundary]) -> tuple[Ints, Ints]:
        """Pairs of poses between which the motion goes on."""
        order = np.argsort(self.position, kind="stable")
        one, other = order[:-1], order[1:]
        # Poses that fail up to each: as many up to both of a pair where none between them does.
        failed = np.cumsum(~valid)[self.position.astype(int)]
        same = (failed[one] == failed[other]) & (self.row[one] // self.each == self.row[other] // self.each)
        if self.poses.designs > 1:
            # Whether one pose fails where its neighbour does not: the limit between them is not known.
            edge = np.flatnonzero(valid[:-1] != valid[1:])
            self.torn[np.unique(edge[(edge + 1) % self.each != 0] // self.each)] = True
        for end in inside:
            if end.configuration is None:
                same &= ~((self.position[one] < end.position) & (self.position[other] > end.position))
        one, other = one[same], other[same]
        moving = self.place[one] != self.place[other]
        limit = np.zeros(len(self.row), dtype=bool)
        limit[self.limits] = True
        beside = np.flatnonzero(limit[one] | limit[other])
        if len(beside):
            middle = (self.place[one[beside]] + self.place[other[beside]]) / 2
            moving[beside] &= self.sample(one[beside], middle)[2]
        return one[moving], other[moving]

    def divide(self, segment: Ints, parts: Floats) -> None:
        """Put poses into some segments, at `parts` of their length.

        A segment that holds a pose that is not valid is dropped.
        """
        if not len(segment):
            return
        begin, end = self.begin[segment], self.end[segment]
        node, other, part = np.repeat(begin, len(parts)), np.repeat(end, len(parts)), np.tile(parts, len(segment))
        place, position = (at[node] + part * (at[other] - at[node]) for at in (self.place, self.position))
        near = self._near(node) + part * (self._near(other) - self._near(node))
        values, slopes, valid = self._in_chunks(self.row[node], place, near)
        good = valid.reshape(len(segment), len(parts)).all(axis=1)
        self.torn[self.row[begin[~good]] // self.each] = True
        keep = np.repeat(good, len(parts))
        index = self._add(self.row[node[keep]], position[keep], place[keep], values[:, keep], slopes[:, keep])
        chain = np.concatenate([begin[good, None], index.reshape(-1, len(parts)), end[good, None]], axis=1)
        others = np.ones(len(self.begin), dtype=bool)
        others[segment] = False
        self.begin = np.concatenate([self.begin[others], chain[:, :-1].ravel()])
        self.end = np.concatenate([self.end[others], chain[:, 1:].ravel()])

    def _refined(self) -> bool:
        """Put poses into segments until no link turns far within one and the functions are smooth there.

        Returns whether that could be done without too many of them.
        """
        most = max(FEWEST_POSES, POSES_EACH * self.poses.count)
        self.divide(np.flatnonzero(~self.sharp()[self.begin]), GRADED)
        self.divide(np.flatnonzero(~self.sharp()[self.end]), 1 - GRADED[::-1])
        low, high = self.least(self.values), -self.least(-self.values)
        sizes = np.array([function.size for function in self._functions])[:, None]
        moves = high - low > STILL * np.maximum(sizes, np.maximum(np.abs(low), np.abs(high)))
        scale = np.where(np.isnan(self._radians)[:, None], np.where(moves, high - low, np.inf), self._radians[:, None])
        for _ in range(MAX_HALVINGS):
            length = self.place[self.end] - self.place[self.begin]
            rise = self.values[:, self.end] - self.values[:, self.begin]
            rise[len(self.rows) :] = wrap(rise[len(self.rows) :])
            one, other = self.slopes[:, self.begin] * length, self.slopes[:, self.end] * length
            with np.errstate(invalid="ignore"):
                steep = np.fmax(np.fmax(np.abs(one), np.abs(other)), np.abs(rise))
                rough = np.abs(rise - (one + other) / 2) > MAX_BEND * scale[:, self.row[self.begin] // self.each]
            # What is this near to a dead centre has been looked at already.
            wide = np.abs(self.position[self.end] - self.position[self.begin]) > GRADED[1]
            split = np.flatnonzero(((steep[len(self.rows) :] > MAX_TURN).any(axis=0) | rough.any(axis=0)) & wide)
            if not len(split):
                break
            if len(self.row) + len(split) > most:
                return False
            self.divide(split, np.array([0.5]))
        return True

    def sharp(self) -> Flags:
        """Poses that have slopes."""
        return np.asarray(~np.isnan(self.slopes).all(axis=0))

    def least(self, values: Floats) -> Floats:
        """Smallest value over each design's poses, shape (functions, designs); infinite where it has none."""
        found = np.full((len(values), self.poses.designs), np.inf)
        design = self.row // self.each
        order = np.argsort(design, kind="stable")
        some, first_of = np.unique(design[order], return_index=True)
        if len(some):
            known = np.where(np.isnan(values), np.inf, values)[:, order]
            found[:, some] = np.minimum.reduceat(known, first_of, axis=1)
        return found
