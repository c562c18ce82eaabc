"""Pieces of motions on which functions are smooth, and the search for them: halved, or cut where a margin is zero."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, Lanes, distinct
from mechdesign.mechanism.change_points import TOUCHING
from mechdesign.mechanism.margins import Cause

# Largest number of halvings of a piece; a function that still has a corner or a jump in it stays as it is.
MOST_HALVINGS = 40
# A margin is resolved if the truncation error of its series is less than this part of its size.
RESOLVED = 1e-12
# Bound of that error at any place, as a part of the margin's size.
UNRESOLVED = 2 * chebyshev.COUNT * RESOLVED
# A margin that falls below zero by less than this part of its size, which is rounding, only touches zero.
ROUNDING = 1e-13
# A zero this near to an end of a piece is at the end: at an ordinary end, and at a dead centre.
AT_END, AT_FOLD = 1e-12, 1e-6
# Distance, in a piece, within which two marks are one.
SAME_MARK = 1e-9
# Largest distance from a dead centre, in a piece, of zeros that only the error of a series makes.
NEAR_FOLD = 1e-2
# Largest distance, in a piece, of zeros that rounding makes from the place where a margin touches zero.
BESIDE = 1e-5
# A closure whose slope over a piece is less than this part of its size touches zero there.
STEEP = 1e-6
# Largest turn of an angle between neighbouring nodes, so that its sense is certain (radians).
SURE_TURN = np.pi / 2


@dataclass(frozen=True, eq=False)
class CurvePieces(Lanes):
    """Intervals of motions, arrays of shape (pieces,).

    A place x in [-1, 1] of a piece is the place s along its line, in rows. At a dead centre positions change as the
    root of the distance from it: there s is quadratic in x, so that they are smooth in x.
    """

    line: Ints
    begin: Floats
    end: Floats
    fold: Ints  # -1: a dead centre at the begin; 1: at the end
    depth: Ints  # how often it has been divided

    @classmethod
    def of(cls, line: Ints, begin: Floats, end: Floats) -> CurvePieces:
        """Pieces without dead centres."""
        none = np.zeros(len(line), dtype=np.intp)
        return cls(line, begin, end, none, none)

    def places(self, x: Floats) -> Floats:
        """Places along the lines of places in each piece, shape (pieces, ...)."""
        begin, end, fold = (part.reshape(-1, *(1,) * (np.ndim(x) - 1)) for part in (self.begin, self.end, self.fold))
        part = (1.0 + x) / 2
        part = np.where(fold == 0, part, np.where(fold < 0, part * part, part * (2.0 - part)))
        return np.asarray(np.where(x == 1.0, end, begin + (end - begin) * part))

    def within(self, s: Floats) -> Floats:
        """The place in [-1, 1] of a place along the line in each piece, shape (pieces,)."""
        part = np.clip((s - self.begin) / (self.end - self.begin), 0.0, 1.0)
        part = np.where(self.fold == 0, part, np.where(self.fold < 0, np.sqrt(part), 1.0 - np.sqrt(1.0 - part)))
        return np.asarray(2.0 * part - 1.0)

    @property
    def nodes(self) -> Floats:
        """Places along the lines of the nodes, shape (pieces, nodes)."""
        return self.places(np.broadcast_to(chebyshev.NODES, (len(self.line), chebyshev.COUNT)))

    @property
    def stretch(self) -> Floats:
        """Way along the line by the place in the piece, ds/dx, at the nodes, shape (pieces, nodes)."""
        return np.asarray((self.end - self.begin)[:, None] / 2 * (1.0 - self.fold[:, None] * chebyshev.NODES))

    @property
    def weights(self) -> Floats:
        """Weights of integrals along the lines at the nodes, shape (pieces, nodes)."""
        return np.asarray(self.stretch * chebyshev.WEIGHTS)

    def halves(self) -> CurvePieces:
        """Both halves of each piece; a dead centre stays in one of them."""
        middle = self.places(np.zeros(len(self.line)))
        first = CurvePieces(self.line, self.begin, middle, np.minimum(self.fold, 0), self.depth + 1)
        return CurvePieces.joined(
            [first, CurvePieces(self.line, middle, self.end, np.maximum(self.fold, 0), self.depth + 1)]
        )

    def divided(self, owner: Ints, marks: Floats) -> CurvePieces:
        """The pieces in order, divided at marks, shape (n,): the number of the piece, and the place in it."""
        order = np.lexsort((marks, owner))
        owner, marks = owner[order], marks[order]
        # Marks that only rounding parts from an end, or from each other, are one.
        apart = (np.abs(marks) < 1.0 - SAME_MARK) & ~np.append(
            False, (owner[1:] == owner[:-1]) & (np.diff(marks) < SAME_MARK)
        )[: len(marks)]
        owner, marks = owner[apart], marks[apart]
        of, low, high = between_marks(owner, marks, np.arange(len(self.line)))
        nowhere = np.zeros(len(of), dtype=bool)
        parts = _parts(self.take(of), low, high, nowhere, nowhere)
        parts = parts.take(np.lexsort((parts.begin, parts.line)))
        # Depth counts halvings.
        return replace(parts, depth=parts.depth - 1)

    @property
    def joined_to_next(self) -> Flags:
        """Whether the motion goes on in the next piece, of pieces in order; shape (pieces - 1,)."""
        return np.asarray((self.line[1:] == self.line[:-1]) & (self.begin[1:] == self.end[:-1]))


def largest(best: Floats, line: Ints, values: Floats) -> None:
    """Update the largest values of lines, shape (n, lines), with those of pieces, shape (n, pieces)."""
    lanes = np.arange(len(best))[:, None] * best.shape[1] + line
    np.maximum.at(best.reshape(-1), lanes.ravel(), values.ravel())


# Margins of shape (causes, n), nan where an earlier one is negative, and angles of shape (angles, n), at places s of
# some lines.
Look = Callable[[Ints, Floats], tuple[Floats, Floats]]
# Place on a line at which a group without a closed form turns back, or a coupling loses its value, by the number of the
# cause, between one where it does not and one where it does.
Fold = Callable[[int, int, float, float], float | None]


@dataclass
class Search:
    """Finds the pieces of lines in which every margin is positive.

    A line that needs more than `budget` nodes is `spent` and gets no pieces. With `crossing`, a closure that touches
    zero divides the motion, as links may move with a corner there.
    """

    look: Look
    fold: Fold
    causes: Sequence[Cause]
    budget: int
    crossing: bool
    spent: Flags  # shape (lines,)

    def pieces(self, begin: CurvePieces) -> tuple[CurvePieces, Floats]:
        """The pieces in order along the lines, and the angles at their nodes, shape (angles, pieces, nodes)."""
        lines, pending = len(self.spent), begin
        nodes, sizes = np.zeros(lines), np.zeros((len(self.causes), lines))
        valid, turned = [begin.take(np.empty(0, dtype=np.intp))], list[Floats]()
        while len(pending.line) or not turned:
            nodes += chebyshev.COUNT * np.bincount(pending.line, minlength=lines)
            self.spent |= nodes > self.budget
            pending = pending.take(~self.spent[pending.line])
            s = pending.nodes
            margins, angles = self.look(np.repeat(pending.line, s.shape[1]), s.ravel())
            margins, angles = (table.reshape(len(table), *s.shape) for table in (margins, angles))
            finite = np.where(np.isfinite(margins), np.abs(margins), 0.0)
            largest(sizes, pending.line, finite.max(axis=2, initial=0.0))
            good, halved, parts = self._judged(pending, margins, sizes)
            turns = np.abs((np.diff(angles, axis=2) + np.pi) % (2 * np.pi) - np.pi)
            far = good & (turns >= SURE_TURN).any(axis=(0, 2)) & (pending.depth < MOST_HALVINGS)
            valid.append(pending.take(good & ~far))
            turned.append(angles[:, good & ~far])
            pending = CurvePieces.joined([*parts, pending.take(halved | far).halves()])
        pieces = CurvePieces.joined(valid)
        order = np.lexsort((pieces.begin, pieces.line))
        order = order[~self.spent[pieces.line[order]]]
        return pieces.take(order), np.concatenate(turned, axis=1)[:, order]

    def _judged(self, pieces: CurvePieces, margins: Floats, sizes: Floats) -> tuple[Flags, Flags, list[CurvePieces]]:
        """Pieces in which all margins are positive, those to be halved, and the positive parts of those with zeros."""
        left, halved = np.ones(len(pieces.line), dtype=bool), np.zeros(len(pieces.line), dtype=bool)
        parts: list[CurvePieces] = []
        for number, (cause, table, size) in enumerate(zip(self.causes, margins, sizes, strict=True)):
            which = np.flatnonzero(left)
            values, scale = table[which], size[pieces.line[which]]
            if cause.role == "limit":
                # A quantity without a value is within its limits.
                values = np.where(np.isnan(values), scale[:, None] + 1.0, values)
            # Slides may cross in either sense.
            positive = (values >= 0) | (cause.role == "across")
            last = pieces.depth[which] >= MOST_HALVINGS
            alike = np.isfinite(values).all(axis=1) & (positive.all(axis=1) | ~positive.any(axis=1))
            if not len(which):
                break
            if cause.role in ("reached", "value"):
                sure = alike
                folded = self._folded(pieces.take(which), positive, alike, number)
                some, divided = np.flatnonzero([part is not None for part in folded]), [p for p in folded if p]
            else:
                coefficients = chebyshev.series(values)
                rest = chebyshev.remainder(coefficients)
                smooth = rest <= RESOLVED * scale
                # A margin that is far from zero need not be resolved.
                sure = smooth | (alike & (np.abs(values).min(axis=1) > 4 * chebyshev.COUNT * rest))
                own = np.flatnonzero(smooth & ~last)
                some, divided = self._cut(pieces.take(which[own]), coefficients[own], number, scale[own])
                some = own[some]
            parts += divided
            left[which[some]] = False
            unsure = ~sure & ~last
            unsure[some] = False
            halved[which[unsure]] = True
            left[which[unsure | ~positive.any(axis=1) | (last & ~positive.all(axis=1))]] = False
        return left, halved, parts

    def _folded(self, pieces: CurvePieces, positive: Flags, alike: Flags, number: int) -> list[CurvePieces | None]:
        """The part of each piece up to the place of a `fold`; None if not found."""
        parts: list[CurvePieces | None] = [None] * len(alike)
        for k in np.flatnonzero(~alike & (np.count_nonzero(np.diff(positive, axis=1), axis=1) == 1)).tolist():
            piece, node = pieces.take(np.array([k])), int(np.flatnonzero(np.diff(positive[k]))[0])
            good, bad = (node, node + 1) if positive[k, node] else (node + 1, node)
            places = piece.nodes[0]
            place = self.fold(number, int(piece.line[0]), float(places[good]), float(places[bad]))
            if place is None or not min(places[good], places[bad]) <= place <= max(places[good], places[bad]):
                continue
            x, before = piece.within(np.array([place])), np.array([bad > good])
            low, high = np.where(before, -1.0, x), np.where(before, x, 1.0)
            parts[k] = _parts(piece, low, high, ~before, before)
        return parts

    def _cut(
        self, pieces: CurvePieces, coefficients: Floats, number: int, scale: Floats
    ) -> tuple[Ints, list[CurvePieces]]:  # fmt: skip
        """Pieces with zeros of a margin inside or a dead centre at an end, and their parts with a positive margin."""
        role = self.causes[number].role
        table = chebyshev.at_places(coefficients)
        suspect = np.flatnonzero(table.min(axis=1) <= np.abs(np.diff(table, axis=1)).max(axis=1) + TOUCHING * scale)
        coefficients, scale, some = coefficients[suspect], scale[suspect], pieces.take(suspect)
        touched, place, value = turning = chebyshev.turning_points(coefficients)
        which, x = chebyshev.zeros(coefficients, turning)
        owner, marks, dead = which, x, np.full(len(x), role == "closure")
        if role != "across":
            steep = np.abs(chebyshev.slopes_at_places(coefficients)[:, [0, -1]].T) > STEEP * scale
            flat, level = np.nonzero(~steep)
            touched, place = np.concatenate([touched, level]), np.concatenate([place, 2.0 * flat - 1.0])
            value = np.concatenate([value, table[suspect][level, -flat]])
            # A limit that is exceeded by rounding is only touched.
            below, reach = (ROUNDING, BESIDE) if role == "closure" else (TOUCHING, NEAR_FOLD)
            near = (value >= -below * scale[touched]) & (value <= TOUCHING * scale[touched])
            touched, place = touched[near], place[near]
            # Where a margin touches zero rounding makes zeros, which are left out.
            apart = ~((which[:, None] == touched) & (np.abs(x[:, None] - place) < reach)).any(axis=1)
            owner, marks, dead = which[apart], x[apart], dead[apart]
        if role == "closure":
            inner = np.abs(place) < 1.0 - BESIDE
            if self.crossing:
                owner, marks = np.concatenate([owner, touched[inner]]), np.concatenate([marks, place[inner]])
                dead = np.concatenate([dead, np.zeros(np.count_nonzero(inner), dtype=bool)])
        rims = np.where(np.stack([some.fold == -1, some.fold == 1]), AT_FOLD, AT_END)
        inside = (marks > -1.0 + rims[0, owner]) & (marks < 1.0 - rims[1, owner])
        # Beside a dead centre a closure is smaller than the error of its series, whose zeros there are left out.
        fold = some.fold[owner]
        between = np.abs(chebyshev.value(coefficients[owner], (marks + fold) / 2))
        inside &= (fold == 0) | (np.abs(marks - fold) > NEAR_FOLD) | (between > UNRESOLVED * scale[owner])
        owner, marks, dead = owner[inside], marks[inside], dead[inside]
        marks = np.where(dead, self._polished(some.take(owner), marks, coefficients[owner], number), marks)
        if role == "closure":
            # A dead centre at an end that has no fold yet.
            bare = (np.abs(table[suspect][:, [0, -1]].T) <= TOUCHING * scale) & (rims == AT_END) & steep
            end, piece = np.nonzero(bare)
            owner, marks = np.concatenate([owner, piece]), np.concatenate([marks, 2.0 * end - 1.0])
            dead = np.concatenate([dead, np.ones(len(piece), dtype=bool)])
        cut = distinct(owner)
        of, low, high = between_marks(owner, marks, cut)
        keep = (chebyshev.value(coefficients[of], (low + high) / 2) >= 0) | (role == "across")
        of, low, high = of[keep], low[keep], high[keep]
        owner, marks = owner[dead], marks[dead]
        ends = [((of[:, None] == owner) & (mark[:, None] == marks)).any(axis=1) for mark in (low, high)]
        return suspect[cut], [_parts(some.take(of), low, high, *ends)] if len(cut) else []

    def _polished(self, pieces: CurvePieces, x: Floats, coefficients: Floats, number: int) -> Floats:
        """Zeros of a margin itself from those of its series, by a step of Newton's method."""
        if not len(x):
            return x
        value = self.look(pieces.line, pieces.places(x))[0][number]
        moved = x - value / chebyshev.slope(coefficients, x)
        return np.where(np.abs(moved - x) < BESIDE, np.clip(moved, -1.0, 1.0), x)


def between_marks(owner: Ints, marks: Floats, some: Ints) -> tuple[Ints, Floats, Floats]:
    """Intervals between the marks in some pieces and their ends -1 and 1: the piece, the lower and the upper end."""
    owners, places = np.concatenate([owner, some, some]), np.concatenate([marks, 0.0 * some - 1.0, 0.0 * some + 1.0])
    order = np.lexsort((places, owners))
    owners, places = owners[order], places[order]
    beside = (owners[1:] == owners[:-1]) & (places[1:] > places[:-1])
    return owners[:-1][beside], places[:-1][beside], places[1:][beside]


def _parts(pieces: CurvePieces, low: Floats, high: Floats, dead_low: Flags, dead_high: Flags) -> CurvePieces:
    """Parts of pieces from `low` to `high`, where dead centres may lie; a part with two dead centres is halved."""
    dead_low, dead_high = (
        dead_low | ((low == -1.0) & (pieces.fold == -1)),
        dead_high | ((high == 1.0) & (pieces.fold == 1)),
    )
    begin, end, middle = pieces.places(low), pieces.places(high), pieces.places((low + high) / 2)
    both, depth = dead_low & dead_high, pieces.depth + 1
    fold = np.where(dead_low, -1, np.where(dead_high, 1, 0)).astype(np.intp)
    first = CurvePieces(pieces.line, begin, np.where(both, middle, end), fold, depth)
    second = CurvePieces(pieces.line, middle, end, np.ones(len(begin), dtype=np.intp), depth).take(both)
    parts = CurvePieces.joined([first, second])
    return parts.take(parts.end > parts.begin)
