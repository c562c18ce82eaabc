"""Where motions end, go to infinity, or two assemblies meet: the ends of a curve's pieces, and what causes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism import Reason
from mechdesign.mechanism.change_points import TOUCHING
from mechdesign.mechanism.margins import ZERO_LENGTH, Cause
from mechdesign.motion.curve import BEYOND, Curve

# Distance from the end of a piece at which margins are evaluated, as a part of the piece.
BESIDE = 1e-6
# Slides are parallel within this part of the largest sine between them; a leg has no length within this part of the
# mechanism's size.
PARALLEL, ZERO_LEG = 1e-9, 1e-6


@dataclass(frozen=True, eq=False)
class MotionEnd:
    """Place at which a motion ends, or goes to infinity and comes back.

    Parameters
    ----------
    line : int
    place : float
        Along the line, in rows.
    cause : Cause
    piece : int
        The piece at whose end (`x` 1) or begin (`x` -1) it lies.
    endless : bool
        Whether the motion goes on behind the place, through infinity.
    """

    line: int
    place: float
    cause: Cause
    piece: int
    x: int
    endless: bool = False


class Change(NamedTuple):
    """Place, along a line in rows, at which two assemblies meet and the motion goes on."""

    line: int
    place: float
    cause: Cause


class Ends:
    """Ends of motions and change points, at the ends of the pieces of a curve."""

    def __init__(self, curve: Curve) -> None:
        self._curve, self._pieces, self._causes = curve, curve.pieces, curve.margins.causes
        self._last = float(curve.poses.end)

    @cached_property
    def _sizes(self) -> Floats:
        """Largest absolute value of each margin along each line, shape (causes, lines)."""
        s, line = self._pieces.nodes, self._pieces.line
        table = np.abs(self._curve.margins_at(np.repeat(line, s.shape[1]), s.ravel()))
        table = table.reshape(len(table), *s.shape)
        sizes = np.zeros((len(table), self._curve.lines))
        for row, size in zip(np.where(np.isfinite(table), table, 0.0), sizes, strict=True):
            np.maximum.at(size, line, row.max(axis=1, initial=0.0))
        return np.where(sizes > 0, sizes, 1.0)

    @cached_property
    def ends(self) -> tuple[MotionEnd, ...]:
        """Places at which motions end or go to infinity, in order along the lines."""
        pieces, ends = self._pieces, list[MotionEnd]()
        joined = pieces.joined_to_next
        if not len(pieces.line):
            return ()
        for x, open_ in ((-1, np.append(True, ~joined)), (1, np.append(~joined, True))):
            place, beyond = (pieces.end, BEYOND) if x > 0 else (pieces.begin, -BEYOND)
            piece = np.flatnonzero(open_)
            outer = place[piece] == (self._last if x > 0 else 0.0)
            outside = place[piece] + beyond * self._last
            held = np.zeros(len(piece), dtype=bool)
            if outer.any() and not self._curve.poses.closed:
                # At the first and the last pose the motion ends only if it cannot go on beyond them.
                held[outer] = self._curve.solve(pieces.line[piece[outer]], outside[outer]).configuration.valid
            held |= outer & self._curve.poses.closed
            piece, outside = piece[~held], outside[~held]
            causes = self._causes_at(pieces.line[piece], outside)
            ends += [
                MotionEnd(int(pieces.line[k]), float(place[k]), self._named(k, x, cause), k, x)
                for k, cause in zip(piece.tolist(), causes, strict=True)
            ]
        ends += [
            MotionEnd(int(pieces.line[k]), float(pieces.end[k]), self._causes[number], k, 1, endless=True)
            for k, number in self._at_joints("across", PARALLEL)
        ]
        return tuple(sorted(ends, key=lambda end: (end.line, end.place, end.x)))

    def changes(self) -> list[Change]:
        """Places at which two assemblies meet and motions go on, in order; first and last poses count."""
        pieces = self._pieces
        inner = [
            Change(int(pieces.line[k]), float(pieces.end[k]), self._causes[number])
            for k, number in self._at_joints("closure", TOUCHING)
        ]
        ended = {(end.line, end.place) for end in self.ends}
        outer = (pieces.begin == 0.0) | (pieces.end == self._last)
        line, place = pieces.line[outer], np.where(pieces.begin[outer] == 0.0, 0.0, self._last)
        small = self._small("closure", TOUCHING, line, place, pieces.end[outer] - pieces.begin[outer])
        rims = [
            Change(int(line[k]), float(place[k]), self._causes[number])
            for number, k in np.argwhere(small).tolist()
            if (int(line[k]), float(place[k])) not in ended
        ]
        return sorted(inner + rims, key=lambda change: change[:2])

    def _at_joints(self, role: str, least: float) -> list[tuple[int, int]]:
        """Pieces that go on in the next and at whose end a margin of a role is zero, with the number of its cause."""
        pieces = self._pieces
        piece = np.flatnonzero(pieces.joined_to_next)
        length = pieces.end[piece] - pieces.begin[piece]
        small = self._small(role, least, pieces.line[piece], pieces.end[piece], length)
        return [(int(piece[k]), number) for number, k in np.argwhere(small).tolist()]

    def _small(self, role: str, least: float, line: Ints, s: Floats, length: Floats) -> Flags:
        """Which margins of a role are zero at ends `s` of pieces of some length, shape (causes, n)."""
        own = np.array([cause.role == role for cause in self._causes], dtype=bool)
        if not own.any() or not len(line):
            return np.zeros((len(own), len(line)), dtype=bool)
        # At the place itself rounding may end the motion before later margins are known.
        sides = np.concatenate([s + step * length for step in (-BESIDE, 0.0, BESIDE)])
        smallest = np.fmin.reduce(
            np.abs(self._curve.margins_at(np.tile(line, 3), sides)).reshape(len(own), 3, -1), axis=1
        )
        return np.asarray(own[:, None] & (smallest <= least * self._sizes[:, line]))

    def _causes_at(self, line: Ints, outside: Floats) -> list[Cause]:
        """Causes by which motions end just before some places: the margin that is farthest below zero there."""
        if not len(line):
            return []
        values = self._curve.margins_at(line, outside) / self._sizes[:, line]
        across = np.array([cause.role == "across" for cause in self._causes], dtype=bool)
        values = np.where(np.isnan(values) | across[:, None], np.inf, values)
        return [self._causes[k] for k in values.argmin(axis=0).tolist()]

    def _named(self, piece: int, x: int, cause: Cause) -> Cause:
        """The cause; for a group without a closed form the group that turns back, or the leg without length."""
        if cause.role != "reached":
            return cause
        graph, pieces = self._curve.mechanism.graph, self._pieces.take(np.array([piece]))
        place = pieces.end[0] if x > 0 else pieces.begin[0]
        inside = pieces.places(np.array([x * 0.9]))[0]
        fold = self._curve.turning_point(int(pieces.line[0]), float(inside), 2 * abs(float(place - inside)))
        if fold is not None:
            group = self._curve.plan.structure.groups[fold[2]]
            return replace(cause, joint=" ".join(graph.joined(group.edges)), group=fold[2])
        pose = self._curve.solve(pieces.line, np.array([inside])).configuration
        for slide in self._curve.margins.legs:
            leg = graph.slides[slide]
            if abs(float(np.ravel(pose.slides[slide])[0])) <= ZERO_LEG * self._curve.mechanism.size:
                return Cause(ZERO_LENGTH, leg, leg, -1, "leg")
        return replace(cause, kind=Reason.OTHER_ASSEMBLY.text)
