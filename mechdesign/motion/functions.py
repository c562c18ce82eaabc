"""Functions along motions: their extremes, zeros and means, between the poses as well.

Each function is a Chebyshev series on every piece of a motion, or the quotient of two: at the poles of one it is
infinite.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Floats, Ints, Lanes, firsts
from mechdesign.motion.curve import INSET
from mechdesign.motion.means import Means, rises
from mechdesign.motion.pieces import MOST_HALVINGS, largest
from mechdesign.motion.series import EXACT

# A quotient is infinite where its divisor is zero and its numerator is more than this part of its largest value.
POLE = 1e-9
# Zeros of a divisor that are this near, in their piece, to a place at which it touches zero are that place.
TOUCH = 1e-2
# At the end of a piece a divisor of this part of its largest value or less is zero.
ZERO = 1e-8
# The same at a dead centre, whose place has half the digits.
ZERO_AT_FOLD = 1e-4
# An extreme this near to a pose (in rows) may be at that pose.
BESIDE_ROW = 1e-4
# The same of a motion over time, which is flatter where it comes to rest.
BESIDE_REST = 0.1
# A value of the function counts if it is within this part of the function's size from the series.
TRUE = 1e-7
# A function within this part of its size from a level touches it.
TOUCHED = 1e-14
# Values of a function that differ by less than this part of its size are equal.
ROUNDED = 1e-13
# Levels that are repeated are sought in so many periods at most; a motion with more has no pieces that resolve them.
MOST_PERIODS = 10_000
# Sides of `searchsorted`: to the first of equal values, and behind the last.
_SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")


@dataclass(frozen=True, eq=False)
class Extremes:
    """The smallest and the largest values of functions on each line, arrays of shape (2, functions, lines).

    nan where a function has no values. The places are along the line, in rows. Values within `still`, of shape
    (functions, lines), are equal.
    """

    value: Floats
    place: Floats
    still: Floats


@dataclass(frozen=True, eq=False)
class Zeros(Lanes):
    """Places at which functions are zero, arrays of shape (n,): number of the function, line, and place in rows."""

    function: Ints
    line: Ints
    place: Floats


class Functions(Means):
    """Functions along the motions of a curve; see `Series` for the parameters."""

    def at_ends(self, names: Sequence[str], line: Ints, place: Floats, x: Ints) -> Floats:
        """Values of functions at ends of motions, shape (names, n): of the pieces that end (`x` 1) or begin (-1) there.

        nan where no piece does.
        """
        pieces = self.pieces
        piece = np.full(len(line), -1)
        for j, (one, first, last) in enumerate(
            zip(place.tolist(), *(np.searchsorted(pieces.line, line, side) for side in _SIDES), strict=True)
        ):
            ends = (pieces.end if x[j] > 0 else pieces.begin)[first:last]
            piece[j] = next(iter(first + np.flatnonzero(ends == one)), -1)
        rows, lanes = self._rows(names), np.flatnonzero(piece >= 0)
        values = np.full((len(rows), len(line)), np.nan)
        if not len(lanes):
            return values
        piece, end = piece[lanes], chebyshev.basis(x[lanes].astype(float))
        above, below = (
            np.einsum("fnk,kn->fn", chebyshev.series(table[rows[:, None], piece]), end)
            for table in (self._table, self._divisor)
        )
        limits = above / below ** self._orders[rows, None]
        places = self.curve.inside(line[lanes], place[lanes])
        shape = len(rows), len(lanes)
        own, which = (part.ravel() for part in np.broadcast_arrays(rows[:, None], line[lanes]))
        table = self.at(line[lanes], places)[rows]
        values[:, lanes] = self._true(own, which, table.ravel(), limits.ravel()).reshape(shape)
        return values

    def _rows(self, names: Sequence[str]) -> Ints:
        return np.array([self.names[name] for name in names], dtype=np.intp)

    def interpolated(self, name: str, line: Ints, s: Floats) -> Floats:
        """Values of a function at places of lines, shape (n,), by its series; nan where a line has no piece."""
        return self._by_series(np.full(len(s), self.names[name]), line, s)

    def _by_series(self, rows: Ints, line: Ints, s: Floats) -> Floats:
        piece = self.curve.piece_at(line, s, self.pieces)
        x = self.pieces.take(piece).within(s)
        above, below = (
            chebyshev.value(chebyshev.series(table[rows, piece]), x) for table in (self._table, self._divisor)
        )
        return np.where(self.pieces.line[piece] == line, above / below ** self._orders[rows], np.nan)

    def extremes(self, names: Sequence[str], still: Floats) -> Extremes:
        """Smallest and largest values of some functions; of equal ones the first along the line.

        Parameters
        ----------
        still : ndarray, shape (functions, lines)
            Values are equal within this difference.
        """
        rows, lines = self._rows(names), self.curve.lines
        rounding = np.where(self._poled[rows, None], self._noise[rows], ROUNDED * self._scale[rows])
        still = np.maximum(still, rounding)
        table = np.full((2, 2 * len(rows) * lines), np.nan)
        if len(self.pieces.line) and len(rows):
            rows, sign = np.tile(rows, 2), np.repeat([-1.0, 1.0], len(rows))
            twice = np.tile(still, (2, 1))
            tops, poles = self._tops(rows, sign, twice), self._poles(rows, sign)
            lane, piece, x, value = (np.concatenate(pair) for pair in zip(tops, poles, strict=True))
            line, place = self.pieces.line[piece], self.pieces.take(piece).places(x)
            lane = lane * lines + line
            best = np.full(len(rows) * lines, -np.inf)
            np.maximum.at(best, lane, value)
            equal = np.maximum(twice.ravel(), np.where(np.isfinite(best), ROUNDED * np.abs(best), 0.0))
            tie = np.flatnonzero(value >= (best - equal)[lane])
            tie = tie[np.lexsort((place[tie], lane[tie]))]
            lanes, first = firsts(lane[tie])
            chosen = tie[first]
            own, sign = rows[lanes // lines], sign[lanes // lines]
            line, least = line[chosen], equal[lanes]
            values, places = self._settled(own, sign, line, place[chosen], value[chosen], least)
            # Where a steep function comes to a level that it keeps, it has few digits: its nodes behind have them all.
            for k in np.flatnonzero(np.isfinite(best[lanes]) & (sign * values < best[lanes] - least)).tolist():
                some = np.flatnonzero(self.pieces.line == line[k])
                nodes = np.nan_to_num(sign[k] * self._quotients(own[[k]], some), nan=-np.inf)
                values[k] = sign[k] * max(sign[k] * values[k], min(nodes.max(), best[lanes[k]]))
            table[:, lanes] = values, places
        value, place = table.reshape(2, 2, len(names), lines)
        return Extremes(value, place, still)

    def _settled(
        self, rows: Ints, sign: Floats, line: Ints, place: Floats, value: Floats, still: Floats
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Values and places of extremes from the functions themselves; `value`: of the series, times the sign."""
        place = self.curve.inside(line, place)
        # A function is flat at an extreme: a pose beside it with the same value is the place.
        row = np.round(place)
        near = np.abs(row - place) <= (BESIDE_ROW if not self.curve.poses.rule.timed else BESIDE_REST)
        beside = np.flatnonzero(near & self.curve.holds(line, row, INSET * self.curve.poses.end))
        own = np.concatenate([rows, rows[beside]])
        table = self.at(np.concatenate([line, line[beside]]), np.concatenate([place, row[beside]]))
        table = table[own, np.arange(len(own))]
        exact = self._true(rows, line, table[: len(rows)], sign * value)
        rows, line, row = rows[beside], line[beside], row[beside]
        at_row = self._true(rows, line, table[len(own) - len(beside) :], self._by_series(rows, line, row))
        good = np.isfinite(exact[beside]) & (sign[beside] * (at_row - exact[beside]) >= -still[beside])
        exact[beside[good]], place[beside[good]] = at_row[good], row[good]
        return exact, place

    def _true(self, rows: Ints, line: Ints, values: Floats, series: Floats) -> Floats:
        """Values of the functions themselves, or of their series where the functions have lost digits."""
        # At a corner that lies beyond the outermost node of a piece the series of a magnitude is negative.
        series = np.where(self._magnitudes[rows], np.maximum(series, 0.0), series)
        size = np.maximum(self._scale, self._sizes[:, None])[rows, line]
        near = np.abs(values - series) <= TRUE * np.where(self._poled[rows], np.abs(series), size)
        return np.where(near & np.isfinite(series), values, series)

    def _tops(self, rows: Ints, sign: Floats, still: Floats) -> tuple[Ints, Ints, Floats, Floats]:
        """Local maxima of functions times a sign that may be the largest of a line: lane, piece, place in it, value.

        The lanes are the smallest values of all functions, then their largest values.
        """
        line, poled, half = self.pieces.line, self._poled[rows], len(rows) // 2
        rough = self._rough[rows]
        values = self._quotients(rows[:half])
        # A quotient is judged by its series, but where these are not exact.
        values = np.where(np.isnan(values) | (poled & ~rough.T).T[:half, :, None], -np.inf, values)
        steps = np.nan_to_num(np.abs(np.diff(values, axis=2)), nan=np.inf).max(axis=2)
        nodes = np.concatenate([np.where(np.isinf(values), -np.inf, -values).max(axis=2), values.max(axis=2)])
        best = np.full((len(rows), self.curve.lines), -np.inf)
        largest(best, line, nodes)
        # Between its nodes a function is larger than there by less than it moves from one to the next.
        first = np.append(True, line[1:] != line[:-1])
        high = nodes + 2 * np.tile(steps, (2, 1)) >= best[:, line] - still[:, line]
        lane, piece = np.nonzero((high | poled[:, None] | first) & ~rough)
        owner, quotient = line[piece], poled[lane]
        table = chebyshev.at_places(chebyshev.series(self._table[rows[lane], piece]))
        below = self._divisor[rows[lane[quotient]], piece[quotient]]
        product, divisor = table[quotient], chebyshev.at_places(chebyshev.series(below))
        table[quotient] /= divisor ** self._orders[rows[lane[quotient]], None]
        # Where both are zero the quotient has no meaning, and at a pole it has no sign.
        lost = np.where(quotient[:, None], ~np.isfinite(table), np.isnan(table))
        sizes = (scale[rows[lane], owner][quotient, None] for scale in (self._scale, self._divisor_scale))
        lost[quotient] |= (np.abs(product) > POLE * next(sizes)) & (np.abs(divisor) <= ZERO * next(sizes))
        table = np.where(lost, -np.inf, sign[lane, None] * table)
        np.maximum.at(best.reshape(-1), lane * self.curve.lines + owner, table.max(axis=1))
        top = np.ones(table.shape, dtype=bool)
        top[:, 1:] = table[:, 1:] >= table[:, :-1]
        top[:, :-1] &= table[:, :-1] >= table[:, 1:]
        # A constant function has both extremes at its first place.
        top &= np.tile(best[:half] + best[half:] > still[:half], (2, 1))[lane, owner][:, None]
        bend = np.abs(np.nan_to_num(table[:, 2:] - 2 * table[:, 1:-1] + table[:, :-2], posinf=0, neginf=0))
        bend = np.concatenate([bend[:, :1], bend, bend[:, -1:]], axis=1)
        # The first place of a piece counts if it is as large within rounding.
        top[:, 0] = True
        equal = np.maximum(still, ROUNDED * np.where(np.isfinite(best), np.abs(best), 0.0))
        top &= np.isfinite(table) & (table + bend >= (best - equal)[lane, owner][:, None])
        which, m = np.nonzero(top)
        lane, piece = lane[which], piece[which]
        x, value = self._refined(rows[lane], sign[lane], piece, m, table[which, m])
        corner, where = np.nonzero(rough & (nodes >= best[:, line]) & np.isfinite(nodes))
        corners = self._corners(rows[corner], sign[corner], where)
        return tuple(
            np.concatenate(pair) for pair in zip((lane, piece, x, value), (corner, where, *corners), strict=True)
        )  # type: ignore[return-value]

    def _quotients(self, rows: Ints, piece: Ints | slice = slice(None)) -> Floats:
        """Values of functions at the nodes of pieces; nan where the divisor is zero."""
        divisors = self._divisor[rows, piece]
        orders = self._orders[rows].reshape(-1, *(1,) * (divisors.ndim - 1))
        return np.where(divisors != 0, self._table[rows, piece] / divisors**orders, np.nan)

    def _refined(self, rows: Ints, sign: Floats, piece: Ints, m: Ints, value: Floats) -> tuple[Floats, Floats]:
        """Places in pieces, and values, of local maxima of functions times a sign near to `chebyshev.PLACES[m]`."""
        powers = self._divisor[rows, piece] ** self._orders[rows, None]
        c, d = chebyshev.series(self._table[rows, piece]), chebyshev.series(powers)
        slope, divisor_slope = chebyshev.slope_series(c), chebyshev.slope_series(d)
        bends, divisor_bends = chebyshev.slope_series(slope), chebyshev.slope_series(divisor_slope)

        def rise(some: Ints, at: Floats) -> tuple[Floats, Floats]:
            """A function with the sign of the slope, and its derivative."""
            basis = chebyshev.basis(at)
            first, second = chebyshev.total(slope[some], basis), chebyshev.total(bends[some], basis)
            apart = np.flatnonzero(self._poled[rows[some]])
            if len(apart):
                basis, some = basis[:, apart], some[apart]
                own, by = chebyshev.total(c[some], basis), chebyshev.total(d[some], basis)
                by_first, by_second = (chebyshev.total(part[some], basis) for part in (divisor_slope, divisor_bends))
                first[apart], second[apart] = (
                    first[apart] * by - own * by_first, second[apart] * by - own * by_second
                )  # fmt: skip
            return first, second

        x, every = chebyshev.PLACES[m], np.arange(len(m))
        sides = chebyshev.PLACES[np.maximum(m - 1, 0)], chebyshev.PLACES[np.minimum(m + 1, len(chebyshev.PLACES) - 1)]
        low, high = (rise(every, side)[0] for side in sides)
        turning = np.flatnonzero((sign * low > 0) & (sign * high < 0))
        x[turning] = at = chebyshev.root(
            lambda place: rise(turning, place), sides[0][turning], low[turning], sides[1][turning], high[turning]
        )
        refined = sign[turning] * chebyshev.value(c[turning], at) / chebyshev.value(d[turning], at)
        value[turning] = np.maximum(refined, value[turning])
        return x, value

    def _corners(self, rows: Ints, sign: Floats, piece: Ints) -> tuple[Floats, Floats]:
        """Place and value of the largest node, for functions with a corner in a piece, whose series are not exact."""
        nodes = self._quotients(rows, piece)
        nodes = np.where(np.isnan(nodes), -np.inf, sign[:, None] * nodes)
        k = nodes.argmax(axis=1)
        tops = nodes[np.arange(len(k)), k]
        for j in np.flatnonzero((self.pieces.depth[piece] >= MOST_HALVINGS - 1) & (tops > 0)).tolist():
            if rises(nodes[j, k[j] :]) or rises(nodes[j, k[j] :: -1]):
                tops[j] = np.inf
        return chebyshev.NODES[k], tops

    def _poles(self, rows: Ints, sign: Floats) -> tuple[Ints, Ints, Floats, Floats]:
        """Places at which functions times a sign go to plus infinity: lane, piece, place in it, infinity."""
        poles: list[tuple[Ints, Ints, Floats]] = [(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0))]
        poled = np.flatnonzero(self._poled[rows])
        divisors, scale = self._divisor[rows[poled]], self._divisor_scale[rows[poled]][:, self.pieces.line]
        # A divisor whose constant outweighs all of its other terms comes nowhere near zero.
        terms = np.abs(chebyshev.series(divisors))
        near = (divisors != 1.0).any(axis=2) & ~(2 * terms[..., 0] - terms.sum(axis=2) > 2 * ZERO_AT_FOLD * scale)
        for j in np.flatnonzero(near.any(axis=1)).tolist():
            k, some = poled[j], np.flatnonzero(near[j])
            line, fold = self.pieces.line[some], self.pieces.fold[some]
            product, divisor = (chebyshev.series(table[rows[k], some]) for table in (self._table, self._divisor))
            sizes = self._scale[rows[k], line], self._divisor_scale[rows[k], line]
            turned, place, level = turning = chebyshev.turning_points(divisor)
            piece, x = chebyshev.zeros(divisor, turning)
            flat = np.abs(level) <= ZERO * sizes[1][turned]
            least = np.where(np.stack([fold < 0, fold > 0], axis=1), ZERO_AT_FOLD, ZERO) * sizes[1][:, None]
            end = np.abs(chebyshev.at_places(divisor)[:, [0, -1]]) <= least
            rim, side = np.nonzero(end)
            piece = np.concatenate([piece, turned[flat], rim])
            x = np.concatenate([x, place[flat], 2.0 * side - 1.0])
            height = chebyshev.value(product[piece], x)
            real = np.abs(height) > POLE * sizes[0][piece]
            # From either side the divisor has its sign a little before the place.
            beside = np.stack([x - 1e-4, x + 1e-4])
            by = np.stack([chebyshev.value(divisor[piece], np.clip(at, -1, 1)) for at in beside])
            # A divisor that touches zero has the sign of the whole piece; beside the place rounding may have the other.
            touched = flat & (turned == piece[:, None]) & (np.abs(place - x[:, None]) < TOUCH)
            by = np.where(touched.any(axis=1), divisor[piece, 0], by) ** self._orders[rows[k]]
            up = ((sign[k] * height * by > 0) & (np.abs(beside) <= 1)).any(axis=0) & real
            poles.append((np.full(np.count_nonzero(up), k), some[piece[up]], x[up]))
        lane, piece, x = (np.concatenate(part) for part in zip(*poles, strict=True))
        return lane, piece, x, np.full(len(x), np.inf)

    def crossings(
        self, name: str, levels: Sequence[float] = (0.0,), period: float = 0.0, *, turning: bool = False
    ) -> tuple[Ints, Floats]:  # fmt: skip
        """Places at which a function crosses or touches some levels, repeated with a `period` if it is not 0.

        Lines and places in rows, each of shape (n,). A function that rests at a level does not cross it. With `turning`
        the places at which it turns back are among them.
        """
        table, every = self._table[self.names[name]], np.array(levels)
        finite = table[np.isfinite(table)]
        if period and len(finite):
            first = np.floor((finite.min() - every) / period)
            count = int(min(np.ptp(finite) / period, MOST_PERIODS)) + 2
            every = (every + period * (first + np.arange(count)[:, None])).ravel()
        series = chebyshev.series(table)
        table = chebyshev.at_places(series)
        turned, back, extreme = chebyshev.turning_points(series)
        least, most = table.min(axis=1), table.max(axis=1)
        np.minimum.at(least, turned, extreme)
        np.maximum.at(most, turned, extreme)
        slack = TOUCHED * np.maximum(np.abs(least), np.abs(most))
        moves = most - least > 2 * slack
        met = (every >= (least - slack)[:, None]) & (every <= (most + slack)[:, None])
        piece, level = np.nonzero(met & moves[:, None])
        shifted = series[piece]
        shifted[:, 0] -= every[level]
        grazing, place, extreme = points = chebyshev.turning_points(shifted)
        which, x = chebyshev.zeros(shifted, points)
        touched = np.abs(extreme) <= slack[piece[grazing]]
        rim, side = np.nonzero(np.abs(chebyshev.at_places(shifted)[:, [0, -1]]) <= slack[piece, None])
        which = piece[np.concatenate([which, grazing[touched], rim])]
        x = np.concatenate([x, place[touched], 2.0 * side - 1.0])
        if turning:
            own = moves[turned]
            which, x = np.concatenate([which, turned[own]]), np.concatenate([x, back[own]])
        return self.pieces.line[which], self.pieces.take(which).places(x)

    def zeros(self, names: Sequence[str], touching: float) -> Zeros:
        """Places at which functions cross zero, or turn back or end nearer to zero than `touching`."""
        rows = self._rows(names)
        count = len(self.pieces.line)
        series = chebyshev.series(self._table[rows]).reshape(-1, chebyshev.COUNT)
        table = chebyshev.at_places(series)
        # Where the motion goes on, a function that crosses zero at the very end of a piece is zero there.
        goes_on = self.pieces.joined_to_next
        rims = np.stack([np.append(False, goes_on), np.append(goes_on, False)], axis=1)[:count]
        rims = np.tile(np.where(rims, EXACT, touching), (len(rows), 1))
        rim, side = np.nonzero(np.abs(table[:, [0, -1]]) <= rims)
        # Only a series that comes near to zero at one of its places can cross or touch it.
        near = np.abs(table).min(axis=1, initial=np.inf) <= np.abs(np.diff(table, axis=1)).max(axis=1) + touching
        some = np.flatnonzero(near)
        turned, place, least = turning = chebyshev.turning_points(series[some])
        which, x = chebyshev.zeros(series[some], turning)
        touched = np.abs(least) <= touching
        which = np.concatenate([some[which], some[turned[touched]], rim])
        x = np.concatenate([x, place[touched], 2.0 * side - 1.0])
        if not len(x):
            return Zeros(which, which, x)
        function, piece = which // count, which % count
        places = self.pieces.take(piece).places(x)
        # A function is flat where it touches zero: a pose beside it that is as near to zero is the place.
        flat = np.arange(len(x)) >= len(x) - len(rim) - np.count_nonzero(touched)
        row = np.round(places)
        lanes = np.flatnonzero(flat & (np.abs(row - places) <= BESIDE_ROW))
        if len(lanes):
            line, both = np.tile(self.pieces.line[piece[lanes]], 2), np.concatenate([row[lanes], places[lanes]])
            values = np.abs(self.at(line, both)[np.tile(rows[function[lanes]], 2), np.arange(len(both))])
            one, two = values.reshape(2, -1)
            places[lanes] = np.where(one <= two + EXACT, row[lanes], places[lanes])
        return Zeros(function, self.pieces.line[piece], places)
