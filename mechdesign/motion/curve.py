"""A motion as a curve: poses of a mechanism over one parameter, from limit to limit, with angles that do not jump.

The parameter is the place s along the motion, in rows of its poses from 0. Sweeps, paths, and lines of a grid along its
last coordinate are such curves, of one design or several; each has a line of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from mechdesign.ground.expressions import Corner
from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, firsts
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import TURN, Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import ON_THE_CUT
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.margins import Margins, turning_point
from mechdesign.motion.anchors import Anchors, inputs, steps_of, units_of
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.pieces import CurvePieces, Search
from mechdesign.motion.rows import DesignNumbers, Poses
from mechdesign.motion.rules import GivenRows
from mechdesign.motion.turns import drive_turns

# Largest number of nodes at which a motion is evaluated.
BUDGET = 1 << 18
# Poses solved at once: their arrays stay within some megabytes.
AT_ONCE = 65536
# A motion ends at its first or last pose if it cannot go on this far beyond, as a part of the motion. The causes of
# other ends are evaluated as far beyond these.
BEYOND = 1e-9
# Number of neighbouring floating-point numbers around a dead centre among which the last valid pose is sought.
STRAIGHT = 128
# Places by which an interval is divided to find the last one at which a coupling has a value.
SECTIONS = 33
# Distance inside a motion at which its ends are evaluated, as a part of the motion.
INSET = 1e-9


class Curve:
    """The motions of some poses that give the same coordinates, a line each.

    Parameters
    ----------
    angles : sequence of Coordinate
        Angles whose turns are counted along the motion, as no pose gives them.
    turning : bool
        Whether limits count the turns of given and followed angles; else an angle and the same with a turn are alike.
    marks : pair of ndarray, shape (n,)
        Lines and places, in rows, at which pieces end besides.
    drawn : bool
        Whether the motions begin in the sketch.

    Attributes
    ----------
    pieces : CurvePieces
        Intervals of the lines, in order, on which the mechanism assembles and lies within its limits.
    spent : bool array, shape (lines,)
        Lines with too many turns to be followed; they have no pieces.
    corners : set of Corner
        Corners of expressions at which the pieces end; see `mechdesign.motion.corners`.
    """

    corners: frozenset[Corner] = frozenset()

    def __init__(
        self, motion: Motion, angles: Sequence[Coordinate] = (), *, turning: bool = True,
        marks: tuple[Ints, Floats] | None = None, drawn: bool = False,
    ) -> None:  # fmt: skip
        self.motion, self.angles, self._turning, self._drawn = motion, tuple(angles), turning, drawn
        self.mechanism: Mechanism = motion.mechanism
        self.poses = poses = motion.poses
        self.plan = self.mechanism.plan(poses.names)
        self.anchors = Anchors(motion, self.plan) if self.plan.continued else None
        self.lines = poses.count // poses.line
        self.spent = np.zeros(self.lines, dtype=bool)
        self.margins = Margins(self.mechanism, self.plan)
        first = self._begin()
        if marks is not None:
            piece = self.piece_at(*marks, first)
            first = first.divided(piece, first.take(piece).within(marks[1]))
        closed = len(self.margins.causes) - self.margins.limited
        crossing = self.plan.change_points is None
        search = Search(self._look, self._fold, self.margins.causes[:closed], BUDGET, crossing, self.spent)
        self._closed, self._seen = search.pieces(first)
        self.pieces = self._closed
        if self.margins.limited:
            search = Search(
                self._look_at_limits, self._fold, self.margins.causes[closed:], BUDGET, crossing, self.spent
            )
            self.pieces, _ = search.pieces(self._closed)

    def unlimited(self) -> Curve:
        """The same motions with the parts that the stated limits forbid."""
        curve = copy(self)
        curve.pieces = self._closed
        return curve

    def grid(self, s: Floats) -> tuple[Ints, Floats]:
        """The same places on every line, line by line, for `solve`."""
        return np.repeat(np.arange(self.lines), len(s)), np.tile(s, self.lines)

    def inputs(self, line: Ints, s: Floats) -> tuple[Poses, list[Floats]]:
        """Poses at places of lines, and what they give (radians, lengths)."""
        return inputs(self.motion, self.plan, line, s)

    def solve(self, line: Ints, s: Floats, *, judged: bool = True, turning: bool = True) -> SolvedPoses:
        """Poses at places of lines, shape (n,); `judged` by the stated limits, `turning` with the turns of angles."""
        poses, values = self.inputs(line, s)
        configuration = self._solved(line, s, poses, values)
        if turning:
            configuration = self.with_turns(line, s, configuration)
        if judged:
            self.plan.judge(configuration)
        return SolvedPoses(self.motion.at(poses), np.arange(len(s)), configuration)

    def with_turns(self, line: Ints, s: Floats, configuration: Configuration) -> Configuration:
        """Solved poses with their angles in the turns that they have along the motion."""
        near: dict[str, Value] = dict(zip((angle.name for angle in self.angles), self.beside(line, s), strict=True))
        if not self._turning:
            near |= self.mechanism.drawn_angles() | self.mechanism.turns({})
            return replace(configuration, near={**configuration.near, **near}, counted=frozenset())
        return replace(configuration, near={**configuration.near, **near}, counted=configuration.counted | near.keys())

    def turned(self, line: Ints, s: Floats) -> Floats:
        """The angles followed at places of lines (radians), shape (angles, n), without jumps."""
        if not len(self._closed.line):
            return np.full((len(self.angles), len(s)), np.nan)
        k, x = self._within(line, s)
        values = [
            chebyshev.value(row[k], x) * (angle.turn / TURN)
            for row, angle in zip(self._turns, self.angles, strict=True)
        ]
        return np.array(values).reshape(len(self.angles), len(s))

    def beside(self, line: Ints, s: Floats) -> Floats:
        """The same angles at the nearest nodes, less than half a turn away: they fix the number of turns."""
        if not len(self._closed.line):
            return np.full((len(self.angles), len(s)), np.nan)
        k, x = self._within(line, s)
        scale = np.array([angle.turn / TURN for angle in self.angles])
        return np.asarray(self._turns_at_nodes[:, k, chebyshev.nearest_node(x)] * scale[:, None])

    def _within(self, line: Ints, s: Floats) -> tuple[Ints, Floats]:
        """The piece of each place of a line on which the mechanism assembles, and the place within it."""
        k = self.piece_at(line, s, self._closed)
        return k, self._closed.take(k).within(s)

    def piece_at(self, line: Ints, s: Floats, pieces: CurvePieces | None = None) -> Ints:
        """The piece that contains each place, else the one before it, else the first of the line."""
        pieces = self.pieces if pieces is None else pieces
        span = self.poses.end + 2.0
        k = np.searchsorted(pieces.line * span + pieces.begin, line * span + s, side="right") - 1
        first = np.searchsorted(pieces.line, line)
        return np.clip(np.maximum(k, first), 0, len(pieces.line) - 1)

    def holds(self, line: Ints, s: Floats, beyond: float = 0.0) -> Flags:
        """Whether places of lines lie in a piece, or at most `beyond` outside."""
        if not len(self.pieces.line):
            return np.zeros(len(s), dtype=bool)
        k = self.piece_at(line, s + beyond)
        begin, end = self.pieces.begin[k] - beyond, self.pieces.end[k] + beyond
        return np.asarray((self.pieces.line[k] == line) & (s >= begin) & (s <= end))

    def inside(self, line: Ints, s: Floats) -> Floats:
        """Places of lines at which poses assemble: places at the end of a motion or beyond are moved inside a little.

        At a dead centre it is the last place at which rounding lets the links assemble. Positions change there as the
        root of the distance, so that a place a little inside would lose half of the digits.
        """
        pieces, k = self.pieces, self.piece_at(line, s)
        after = np.minimum(k + 1, len(pieces.line) - 1)
        later = (pieces.line[after] == line) & (pieces.begin[after] - s < s - pieces.end[k])
        k = np.where((s > pieces.end[k]) & later, after, k)
        begin, end, fold = pieces.begin[k], pieces.end[k], pieces.fold[k]
        inset = np.minimum(INSET * self.poses.end, (end - begin) / 2)
        dead = np.where(fold < 0, begin, end)
        at_dead = (fold != 0) & (np.abs(s - dead) <= inset)
        places = np.where((s < begin) | (s > end), np.clip(s, begin + inset, end - inset), s)
        if at_dead.any():
            places[at_dead] = self._straight(line[at_dead], dead[at_dead], fold[at_dead])
        return places

    def _straight(self, line: Ints, s: Floats, fold: Ints) -> Floats:
        """The outermost places at dead centres of pieces at which poses are valid."""
        steps = (
            np.arange(-STRAIGHT // 2, STRAIGHT // 2) * np.spacing(np.maximum(np.abs(s), 1e-3 * self.poses.end))[:, None]
        )
        places = s[:, None] + fold[:, None] * steps
        valid = self.solve(np.repeat(line, STRAIGHT), places.ravel(), judged=False).configuration.valid.reshape(
            places.shape
        )
        last = STRAIGHT - 1 - valid[:, ::-1].argmax(axis=1)
        inset = s - fold * INSET * self.poses.end
        return np.where(valid.any(axis=1), places[np.arange(len(s)), last], inset)

    def _begin(self) -> CurvePieces:
        """Pieces between the corners of each line, so short that given coordinates change little in each."""
        if not self.poses.end > 0:
            return CurvePieces.of(*(np.empty(0, dtype=kind) for kind in (np.intp, float, float)))
        marks, count = steps_of(self.motion, self.plan)
        self.spent |= count.sum(axis=1) * chebyshev.COUNT > BUDGET
        numbers: Ints = np.where(self.spent[:, None], 0, count).astype(np.intp)
        line, segment = (np.repeat(part.ravel(), numbers.ravel()) for part in np.indices(numbers.shape))
        number = np.arange(len(line)) - np.repeat(np.cumsum(numbers) - numbers.ravel(), numbers.ravel())
        parts = numbers[line, segment]
        low, high = marks[segment], marks[segment + 1]
        begin, stop = (low + (high - low) * (k / parts) for k in (number, number + 1))
        return CurvePieces.of(line, begin, np.where(number + 1 == parts, high, stop))

    def _solved(self, line: Ints, s: Floats, poses: Poses, values: Sequence[Floats]) -> Configuration:
        start = None if self.anchors is None else self.anchors.at(line, s)
        vectors = self._vectors.take(line) if poses.own.places else None
        return self.plan.solve(values, poses.places, vectors=vectors, start=start, limits=False)

    @cached_property
    def _vectors(self) -> Vectors:
        """Edges of the mechanism, of each line."""
        lines = np.arange(self.lines)
        return self.mechanism.geometry.vectors(self.poses.along(lines, lines * 0).places)

    def _look(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        margins, angles = [], []
        for k in range(0, max(len(s), 1), AT_ONCE):
            some = slice(k, k + AT_ONCE)
            poses, values = self.inputs(line[some], s[some])
            configuration = self._solved(line[some], s[some], poses, values)
            margins.append(self.margins.of(configuration, values))
            angles.append(self._angles_of(configuration))
        return np.concatenate(margins, axis=1), np.concatenate(angles, axis=1)

    def _angles_of(self, configuration: Configuration) -> Floats:
        """Followed angles, scaled so that each repeats after 2 pi."""
        values = [
            np.broadcast_to(configuration.value(angle) * (TURN / angle.turn), configuration.shape)
            for angle in self.angles
        ]
        return np.array(values).reshape(len(self.angles), *configuration.shape)

    def _look_at_limits(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        parts = []
        for k in range(0, max(len(s), 1), AT_ONCE):
            some = slice(k, k + AT_ONCE)
            configuration = self.solve(line[some], s[some], judged=False).configuration
            lost = configuration.reason != Reason.OK
            # At the end of a piece rounding may keep a pose from closing.
            parts.append(np.where(lost, np.nan, self.margins.of_limits(configuration)))
        return np.concatenate(parts, axis=1), np.empty((0, len(s)))

    @cached_property
    def _turns(self) -> Floats:
        """Series of the followed angles on the pieces, without jumps between these, shape (angles, pieces, nodes)."""
        pieces, values = self._closed, np.unwrap(self._seen, axis=2)
        jumps = values[:, 1:, 0] - values[:, :-1, -1]
        new = np.append(True, pieces.line[1:] != pieces.line[:-1])
        turns = np.zeros(values.shape[:2])
        turns[:, 1:] = -np.round(jumps / TURN)
        turns = np.cumsum(turns, axis=1)
        turns -= turns[:, np.maximum.accumulate(np.where(new, np.arange(len(new)), 0))]
        coefficients = chebyshev.series(values + TURN * turns[..., None])
        self._begin_turns(pieces, coefficients)
        return coefficients

    @cached_property
    def _turns_at_nodes(self) -> Floats:
        return chebyshev.at_nodes(self._turns)

    def _begin_turns(self, pieces: CurvePieces, coefficients: Floats) -> None:
        """Begin each line's angles in (-180, 180] deg at its first valid pose, a drive's so that its limits hold it.

        Angles of torsion springs have their turns from the sketch on.
        """
        lines, first = firsts(pieces.line)
        rows = np.ceil(pieces.begin)
        inside = np.flatnonzero(rows <= pieces.end)
        some, which = firsts(pieces.line[inside])
        first[np.searchsorted(lines, some)] = inside[which]
        place = np.minimum(rows[first], pieces.end[first])
        x = pieces.take(first).within(place)
        rank = np.searchsorted(lines, pieces.line)
        near: Mapping[str, Value] = self.mechanism.drawn_windings
        if not self._drawn and len(lines) and not near.keys().isdisjoint(angle.name for angle in self.angles):
            poses = self.inputs(lines, place)[0]
            near = from_sketch(self.motion.at(poses))
        for angle, row in zip(self.angles, coefficients, strict=True):
            begin = chebyshev.value(row[first], x)
            turns = -np.ceil((begin - np.pi) / TURN - ON_THE_CUT)
            if angle.name in self.mechanism.drives and len(lines):
                values = chebyshev.at_places(row) + TURN * turns[rank][:, None]
                least, most = (f.reduceat(g(values, axis=1), np.searchsorted(pieces.line, lines))
                               for f, g in ((np.minimum, np.min), (np.maximum, np.max)))  # fmt: skip
                sizes = self.poses.along(lines, lines * 0).places
                turns += drive_turns(self.mechanism, angle.name, begin + TURN * turns, least, most, sizes)
            if angle.name in near:
                turns = np.round((near[angle.name] - begin) / TURN)
            row[:, 0] += TURN * turns[rank]

    def _fold(self, number: int, line: int, good: float, bad: float) -> float | None:
        """Where a group without a closed form turns back, or a coupling its last value, between `good` and `bad`."""
        if self.margins.causes[number].role == "value":
            while abs(bad - good) > np.spacing(max(abs(good), abs(bad))):
                places = np.linspace(good, bad, SECTIONS)
                valued = self._look(np.full(SECTIONS, line), places)[0][number] >= 0
                valued[0], valued[-1] = True, False
                last = int(valued.argmin()) - 1
                good, bad = float(places[last]), float(places[last + 1])
            return good
        fold = self.turning_point(line, good, abs(bad - good))
        return None if fold is None else fold[0]

    def turning_point(self, line: int, place: float, reach: float) -> tuple[float, Configuration, int] | None:
        """Fold of a group without a closed form near a place; see `mechdesign.mechanism.margins.turning_point`."""

        def inputs(s: float) -> list[float]:
            return [float(v[0]) for v in self.inputs(np.array([line]), np.array([s]))[1]]

        at = np.array([line]), np.array([place])
        near = self._solved(*at, *self.inputs(*at)).take(0)
        return turning_point(self.plan, inputs, place, reach, near) if near.valid else None

    def margins_at(self, line: Ints, s: Floats) -> Floats:
        """All margins at places of lines, shape (causes, n)."""
        rows = [self._look(line, s)[0]]
        if self.margins.limited:
            rows.append(self._look_at_limits(line, s)[0])
        return np.concatenate(rows)


def from_sketch(motion: Motion) -> dict[str, Floats]:
    """Angles of torsion springs at poses (radians), with the turns of the straight way there from the sketch."""
    mechanism, units, poses = motion.mechanism, motion.units, motion.poses
    sketch, count = mechanism.sketch_configuration, poses.count
    if not mechanism.windings or not poses.values:
        return {}
    coordinates = mechanism.plan(names := poses.groups[0].names).structure.given
    begin = [float(sketch.value(c)) / unit for c, unit in zip(coordinates, units_of(units, coordinates), strict=True)]
    ways = {name: np.stack([np.full(count, drawn), poses.named[name]], axis=1).ravel()
            for name, drawn in zip(names, begin, strict=True)}  # fmt: skip
    straight = Poses(GivenRows(ways, shape=(2,)), DesignNumbers(count, places=poses.places))
    curve = Curve(motion.at(straight), [*mechanism.windings.values()], drawn=True)
    turned = curve.turned(np.arange(count), np.ones(count))
    return {name: np.where(curve.spent, drawn, angles)
            for (name, drawn), angles in zip(mechanism.drawn_windings.items(), turned, strict=True)}  # fmt: skip
