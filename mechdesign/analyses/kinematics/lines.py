"""A sweep as a line of poses fine enough to tell what happens between them, from limit of motion to limit of motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.analyses.kinematics.boundaries import Boundary
from mechdesign.analyses.kinematics.rates import drive_velocities
from mechdesign.analyses.kinematics.smoothing import NEAR
from mechdesign.analyses.poses import CHUNK, dimensions, radians, starts
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, quiet, wrap
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, regularity
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.rates import Rates
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# How far a link may turn between neighbouring poses (radians), by their places and by its slope at either.
SURE = 0.3
# How far the rise of a function may be from the mean of its slopes, as a part of its range.
SMOOTH = 0.02
# Halvings of a step of the sweep, at most: a link that turns faster is taken to jump.
ROUNDS = 14
# Where a pose has no slopes (a dead centre, from which functions start as a root does), looks beside it: parts of the
# step to the next pose.
GRADED = np.array([1e-6, 1e-4, 1e-2, 0.1])
# A limit this near to a pose of the sweep, in rows, is that pose.
AT_ROW = 1e-9
# Poses of a design's sweep that a line begins with, about: of a finer sweep some are left out. Where links turn too far
# between those taken, poses come between them again.
ENOUGH = 4096


@dataclass(frozen=True)
class Leaf:
    """A function of the motion whose derivative by the swept coordinate is known.

    Parameters
    ----------
    value : callable
        Of configurations.
    slope : callable
        Of configurations and the velocities at unit speed of the swept coordinate.
    turning : bool
        Whether it is an angle (radians), known but for whole turns.
    """

    value: Callable[[Configuration], Value]
    slope: Callable[[Configuration, Rates], Value]
    turning: bool = False


def leaf_of(coordinate: Coordinate) -> Leaf:
    """A coordinate that is no expression."""
    return Leaf(
        lambda configuration: configuration.value(coordinate),
        lambda configuration, velocity: first(configuration, coordinate, velocity),
        coordinate.quantity == "angle",
    )


def _frames(mechanism: Mechanism) -> list[Leaf]:
    """The angle of every class of bodies that turn together, but the ground's."""

    def frame(k: int) -> Leaf:
        return Leaf(lambda c: np.angle(c.rotations[k]), lambda c, v: v.angles[k], True)

    return [frame(k) for k in range(1, mechanism.graph.classes)]


class Line:
    """Poses along the sweep of one coordinate, of one design or several, and the segments between them.

    Poses are those of the sweep (of a very fine one, some), the limits of motion, and as many between them as the
    turning of the links and the smoothness of the leaves need.

    Parameters
    ----------
    valid : bool array, shape (poses,)
    ends : sequence of Boundary
        Limits of motion, of a single design.

    Attributes
    ----------
    row, position, place : ndarray, shape (n,)
        A valid pose of the sweep beside each pose, place along the sweep in rows, and swept coordinate (core's units).
    values, slopes : ndarray, shape (leaves, n)
        Angles continuous along each piece of the motion; slopes nan where there are none.
    begin, end : ndarray of int, shape (segments,)
        Poses that each segment lies between.
    torn : bool array, shape (designs,)
        Designs whose motion ends between poses where no limit is known.
    limits : list of int
        Poses that are limits of motion.
    followed : bool
        Whether the motion is followed through change points: beside them poses have no slopes, and few digits.
    """

    def __init__(
        self, study: Study, poses: Poses, swept: str, valid: Flags, leaves: Sequence[Leaf],
        ends: Sequence[Boundary] = (),
    ) -> None:  # fmt: skip
        self.study, self.poses = study, poses
        group = poses.groups[0]
        self.plan = study.mechanism.plan(group.names)
        # Limits that count the turns of angles are judged along the motion; here its ends tell of them.
        self._limits = not study.mechanism.counting
        # Where a motion is followed through a change point, what lies beside it has lost digits.
        self.followed = self.plan.change_points is not None
        self._steady = NEAR if self.followed else STALLED
        self.which = group.names.index(swept)
        self.given = [
            np.asarray(radians(study, c, v), dtype=float)
            for c, v in zip(self.plan.structure.given, group.columns(), strict=True)
        ]
        self.each = poses.count // poses.designs
        self.torn = np.zeros(poses.designs, dtype=bool)
        self._own = len(leaves)
        self._leaves = [*leaves, *_frames(study.mechanism)]
        self.turning = np.array([leaf.turning for leaf in self._leaves])
        inside = [end for end in ends if 0 < end.position < poses.count - 1]
        inside = [end for end in inside if abs(end.position - round(end.position)) > AT_ROW]
        some = self._taken(valid, [int(end.position) for end in inside])
        self._start: Configuration | None = None
        if self.plan.iterative and len(some):
            own = [values[some] for values in self.given]
            start = starts(study.mechanism, poses, some)
            self._start = self.plan.solve(own, dimensions(poses, some), start=start, limits=self._limits)
        self._rows, self.limits = some, list[int]()
        self.row, self.position, self.place = some, some.astype(float), self.given[self.which][some]
        parts = [self.sample(some[k : k + CHUNK], self.place[k : k + CHUNK])[:2] for k in range(0, len(some), CHUNK)]
        none = np.zeros((len(self._leaves), 0))
        self.values, self.slopes = (np.concatenate([none, *(part[k] for part in parts)], axis=1) for k in (0, 1))
        self.begin, self.end = self._segments(valid, inside)
        self._refine()
        self._unwrap()

    def sample(self, row: Ints, place: Floats) -> tuple[Floats, Floats, Flags]:
        """Values and slopes of all leaves with the swept coordinate at `place`, everything else as in poses `row`."""
        given = [values[row] for values in self.given]
        given[self.which] = place
        start = None
        if self._start is not None:
            start = self._start.take(np.minimum(np.searchsorted(self._rows, row), len(self._rows) - 1))
        return self._measured(self.plan.solve(given, dimensions(self.poses, row), start=start, limits=self._limits))

    def align(self, leaf: int, known: Floats) -> None:
        """Bring an angle to the branch that it has over the poses of the sweep, shape (poses,)."""
        count = len(self._rows)
        own = self.values[leaf][:count]
        beside = np.clip(np.searchsorted(self._rows, self.row), 0, max(count - 1, 0))
        if count:
            shift = np.round((known[self._rows] - own) / (2 * np.pi))
            self.values[leaf] = self.values[leaf] + 2 * np.pi * np.nan_to_num(shift)[beside]

    def near(self, values: Floats, node: Ints) -> Floats:
        """Values of the leaves with their angles on the branch of poses of the line."""
        turning = self.turning
        values = values.copy()
        values[turning] += 2 * np.pi * np.round((self.values[turning][:, node] - values[turning]) / (2 * np.pi))
        return values

    @quiet
    def _measured(self, configuration: Configuration) -> tuple[Floats, Floats, Flags]:
        mechanism, given = self.study.mechanism, self.plan.structure.given
        linear = mechanism.linearize(configuration)
        unit = [float(k == self.which) for k in range(len(given))]
        velocity = linear.velocity(drive_velocities(mechanism, linear, given, unit))
        shape = configuration.shape
        steady = np.broadcast_to(regularity(linear) >= self._steady, shape)
        values = [np.broadcast_to(leaf.value(configuration), shape) for leaf in self._leaves]
        slopes = [np.broadcast_to(leaf.slope(configuration, velocity), shape) for leaf in self._leaves]
        table = np.stack(values), np.where(steady, np.stack(slopes), np.nan)
        table[1][~np.isfinite(table[1])] = np.nan
        valid = configuration.valid
        return np.where(valid, table[0], np.nan), np.where(valid, table[1], np.nan), valid

    def _add(self, row: Ints, position: Floats, place: Floats, values: Floats, slopes: Floats) -> Ints:
        index = len(self.row) + np.arange(len(row))
        self.row = np.concatenate([self.row, row])
        self.position, self.place = np.concatenate([self.position, position]), np.concatenate([self.place, place])
        self.values = np.concatenate([self.values, values], axis=1)
        self.slopes = np.concatenate([self.slopes, slopes], axis=1)
        return index

    def _taken(self, valid: Flags, steps: Sequence[int]) -> Ints:
        """Valid poses of the sweep that the line begins with: its ends, those beside its limits, and some between."""
        at = np.arange(len(valid)) % self.each
        taken = at % -(-self.each // ENOUGH) == 0
        taken[self.each - 1 :: self.each] = True
        # Beside a pose that fails the motion ends.
        taken[1:] |= ~valid[:-1]
        taken[:-1] |= ~valid[1:]
        for step in steps:
            taken[step : step + 2] = True
        return np.flatnonzero(taken & valid)

    def _segments(self, valid: Flags, inside: Sequence[Boundary]) -> tuple[Ints, Ints]:
        """Pairs of poses between which the motion goes on: of the sweep, and its limits."""
        node = np.full(self.poses.count, -1)
        node[self._rows] = np.arange(len(self._rows))
        one, other = self._rows[:-1], self._rows[1:]
        # Poses that fail before each row: as many before both ends of a pair where all between them are valid.
        failed = np.cumsum(~valid)
        plain = (failed[one] == failed[other]) & (one // self.each == other // self.each)
        if self.poses.designs > 1:
            # Whether one pose fails where its neighbour does not: the limit between them is not known.
            edge = np.flatnonzero(valid[:-1] != valid[1:])
            self.torn[np.unique(edge[(edge + 1) % self.each != 0] // self.each)] = True
        steps = sorted({int(end.position) for end in inside})
        plain &= ~np.isin(one, steps)
        pairs = [np.stack([node[one[plain]], node[other[plain]]])]
        for step in steps:
            pairs += self._divided(step, node, [end for end in inside if int(end.position) == step])
        begin, end = np.concatenate(pairs, axis=1)
        moving = self.place[begin] != self.place[end]
        return begin[moving], end[moving]

    def _divided(self, step: int, node: Ints, ends: Sequence[Boundary]) -> Iterator[Ints]:
        """Pairs of poses within a step that holds limits of motion."""
        at = [int(node[step])]
        for end in ends:
            row = step if node[step] >= 0 or node[step + 1] < 0 else step + 1
            if end.configuration is None:
                # The motion goes to infinity: as near to it as its numbers are good.
                side = [self._beside(row, step, end.place, part) for part in (-1, 1)]
                at += [side[0], -1, side[1]]
                continue
            values, _, _ = self._measured(end.configuration)
            index = self._add(
                np.array([row]), np.array([end.position]), np.array([end.place]), values[:, None],
                np.full((len(self._leaves), 1), np.nan),
            )  # fmt: skip
            at.append(int(index[0]))
            self.limits.append(int(index[0]))
        at.append(int(node[step + 1]))
        for one, other in pairwise(at):
            if one < 0 or other < 0:
                continue
            middle = (self.place[[one]] + self.place[[other]]) / 2
            if self.sample(self.row[[one]], middle)[2].all():
                yield np.array([[one], [other]])

    def _beside(self, row: int, step: int, place: float, side: int) -> int:
        a, b = self.given[self.which][[step, step + 1]]
        at = np.array([place + side * GRADED[0] * (b - a)])
        values, slopes, valid = self.sample(np.array([row]), at)
        if not valid.all():
            return -1
        return int(self._add(np.array([row]), step + (at - a) / (b - a), at, values, slopes)[0])

    def divide(self, segment: Ints, parts: Floats) -> None:
        """Put poses into some segments, at `parts` of their length, shape (segments, parts) or (parts,).

        A segment that holds a pose that is not valid is dropped.
        """
        if not len(segment):
            return
        begin, end = self.begin[segment], self.end[segment]
        parts = np.broadcast_to(parts, (len(segment), np.shape(parts)[-1]))
        count = parts.shape[1]
        row = np.repeat(self.row[begin], count)
        place, position = (
            (at[begin][:, None] + parts * (at[end] - at[begin])[:, None]).ravel() for at in (self.place, self.position)
        )
        found = [self.sample(row[k : k + CHUNK], place[k : k + CHUNK]) for k in range(0, len(row), CHUNK)]
        values, slopes = (np.concatenate([part[k] for part in found], axis=1) for k in (0, 1))
        good = np.concatenate([part[2] for part in found]).reshape(len(segment), count).all(axis=1)
        self.torn[np.unique(row.reshape(-1, count)[~good] // self.each)] = True
        keep = np.repeat(good, count)
        values = self.near(values[:, keep], np.repeat(begin[good], count))
        index = self._add(row[keep], position[keep], place[keep], values, slopes[:, keep])
        chain = np.concatenate([begin[good, None], index.reshape(-1, count), end[good, None]], axis=1)
        others = np.ones(len(self.begin), dtype=bool)
        others[segment] = False
        self.begin = np.concatenate([self.begin[others], chain[:, :-1].ravel()])
        self.end = np.concatenate([self.end[others], chain[:, 1:].ravel()])

    def _refine(self) -> None:
        """Put poses into segments until no link turns far within one and the leaves are smooth there."""
        lost = np.isnan(self.slopes).all(axis=0)
        self.divide(np.flatnonzero(lost[self.begin]), GRADED)
        lost = np.isnan(self.slopes).all(axis=0)
        self.divide(np.flatnonzero(lost[self.end]), 1 - GRADED[::-1])
        scale = self._scales()
        for _ in range(ROUNDS):
            length = self.place[self.end] - self.place[self.begin]
            rise = self.values[:, self.end] - self.values[:, self.begin]
            rise[self.turning] = wrap(rise[self.turning])
            one, other = self.slopes[:, self.begin] * length, self.slopes[:, self.end] * length
            with np.errstate(invalid="ignore"):
                frames = slice(self._own, None)
                far = (np.maximum(np.abs(one), np.abs(other))[frames] > SURE) | (np.abs(rise[frames]) > SURE)
                rough = np.abs(rise - (one + other) / 2) > SMOOTH * scale[:, self.row[self.begin] // self.each]
            # What is this near to a dead centre has been looked at already.
            wide = np.abs(self.position[self.end] - self.position[self.begin]) > GRADED[1]
            split = np.flatnonzero((far.any(axis=0) | rough.any(axis=0)) & wide)
            if not len(split):
                return
            self.divide(split, np.array([0.5]))

    def _scales(self) -> Floats:
        """Range of each leaf over each design, shape (leaves, designs); a radian for angles."""
        span = -self.least(self.values) - self.least(-self.values)
        return np.where(self.turning[:, None], 1.0, np.where(span > 0, span, np.inf))

    def least(self, values: Floats) -> Floats:
        """Smallest value over each design's poses, shape (functions, designs); infinite where it has none."""
        values = np.where(np.isnan(values), np.inf, values)
        found = np.full((len(values), self.poses.designs), np.inf)
        design = self.row // self.each
        order = np.argsort(design, kind="stable")
        some, first = np.unique(design[order], return_index=True)
        if len(some):
            found[:, some] = np.minimum.reduceat(values[:, order], first, axis=1)
        return found

    def _unwrap(self) -> None:
        """Angles without jumps along each design's line, from its first pose on."""
        order = np.lexsort((self.position, self.row // self.each))
        start = np.append(True, np.diff(self.row[order] // self.each) != 0)
        heads = np.maximum.accumulate(np.where(start, np.arange(len(order)), 0))
        for k in np.flatnonzero(self.turning):
            values = self.values[k][order]
            steps = np.append(0.0, np.diff(values))
            turns = np.cumsum(np.where(start, 0.0, np.round(np.nan_to_num(-steps / (2 * np.pi)))))
            self.values[k][order] = values + 2 * np.pi * (turns - turns[heads])
