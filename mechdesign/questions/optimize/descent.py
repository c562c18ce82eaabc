"""Descents from designs to the optima near them, many at once, by sequential quadratic programming.

A design in a batch costs far less than alone, so that all first and second differences about a point are evaluated
together. They give quadratic models of all smooth terms: the residuals of a root mean square, the rows whose worst is a
goal, the rows of conditions, and the margins of assembly. The worst of rows is minimised by its epigraph, ``min t``
where no row exceeds ``t``. The models are minimised in boxes of several widths, and the designs found are evaluated
together. [Nocedal & Wright, Numerical Optimization, 2006, ch. 4, 10 and 18.]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics import quadratic
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.optimize.explorer import CONDITION_MISSED, UNKNOWN, Explorer, Points
from mechdesign.questions.optimize.models import FAR, Models, Stencil, Terms, square, without_lost

# Half the width of the box in which models are trusted: the first, the largest, and those below which a descent ends.
FIRST_WIDTH, LARGEST_WIDTH, SMALLEST_WIDTH, ROUGH_SMALLEST_WIDTH = 0.1, 0.5, 1e-9, 1e-4
# Parts of that width that are tried together, and the part to which it shrinks where none of them is better.
NARROWER = (1.0, 0.25, 0.0625)
SHRUNK = 1 / 64
# Most steps of a descent. After `RACE` steps a descent ends if it would not catch up with the best in `CATCH_UP` more.
MOST_STEPS, RACE, CATCH_UP = 300, 8, 30
# Most pairs of quadratic programs that minimise the models of one step.
ROUNDS = 5
# The minimum of the models is settled where a pair gains less than this part of the whole gain.
SETTLED = 0.02
# Most rows of each goal, and of all conditions, in a quadratic program, per (variables + 1).
ROWS_HELD = 6
# Descents that come nearer to each other than this, in parts of the ranges, continue as one.
SAME = 1e-3
# Price of violating a condition, in units of the change of the objective over the ranges.
PRICE = 1e3
# Distance kept from conditions, in parts of the ranges: the optimum lies on them, and rounding must not put it beyond.
CONDITION_SLACK = 1e-9
# A descent ends where its models predict a gain of less than this part of the objective.
SMALLEST_GAIN, ROUGH_SMALLEST_GAIN = 1e-12, 1e-6
# Slopes of conditions below this part of their values count as zero.
FLAT_SLOPE = 1e-6
TINY = float(np.finfo(float).tiny)


@dataclass
class _Lane:
    """One descent: the row of its best point, the width of its box, and how wrong the models of its conditions were.

    Where the widest box gave no better point, `ahead` is the row of the point found there and the box's width: along a
    curved valley the way over such points is shorter [Chamberlain et al., The watchdog technique, 1982].
    """

    objective: Floats
    row: int
    width: float = FIRST_WIDTH
    # Violation of conditions whose models were met, over the cube of the box's width.
    model_error: float = 0.0
    steps: int = 0
    ended: bool = False
    value: float = np.inf
    pace: float = np.inf
    ahead: tuple[int, float] | None = None


def descend(explorer: Explorer, descents: Sequence[tuple[Floats, int]], *, width: float = FIRST_WIDTH) -> list[int]:
    """Descend from evaluated points, all at once.

    Parameters
    ----------
    descents : sequence of (ndarray, int)
        Factors of the goals in the sum that is minimised, and the row of `explorer.points` to start from.
    width : float
        Half the first width of the boxes, in parts of the ranges.

    Returns
    -------
    list of int
        Rows of `explorer.points` where the descents ended.

    Raises
    ------
    Spent
        If the evaluations are used up.
    """
    lanes = [_Lane(objective, row, width) for objective, row in descents]
    scouts: list[tuple[_Lane, _Lane]] = []
    while open_ := [lane for lane in lanes if not lane.ended]:
        _step(explorer, [*open_, *(scout for scout, _ in scouts)])
        for scout, lane in scouts:
            if scout.value < lane.value:
                lane.row, lane.width, lane.value, lane.ended = scout.row, scout.width, scout.value, False
        for group in _alike(lanes):
            _race(explorer.points, group)
        scouts = [
            (_Lane(lane.objective, lane.ahead[0], lane.ahead[1], lane.model_error), lane)
            for lane in lanes if lane.ahead is not None and not lane.ended
        ]  # fmt: skip
    return [lane.row for lane in lanes]


def _step(explorer: Explorer, lanes: list[_Lane]) -> None:
    """One step of every lane: a better point, or a narrower box."""
    groups = _alike(lanes)
    stencil = Stencil(explorer, [lane.row for group in groups for lane in group])
    first, programs = 0, []
    for group in groups:
        programs.append(_Programs(explorer, group, stencil, slice(first, first + len(group))))
        first += len(group)
    rows = explorer(np.concatenate([program.points.reshape(-1, explorer.dimensions) for program in programs]))
    for program in programs:
        shape = program.points.shape[:2]
        program.judge(rows[: shape[0] * shape[1]].reshape(shape))
        rows = rows[shape[0] * shape[1] :]


def _alike(lanes: Sequence[_Lane]) -> list[list[_Lane]]:
    """Lanes by their objective."""
    groups: dict[bytes, list[_Lane]] = {}
    for lane in lanes:
        groups.setdefault(lane.objective.tobytes(), []).append(lane)
    return list(groups.values())


def _race(points: Points, lanes: Sequence[_Lane]) -> None:
    """End descents of one objective that come to the place of a better one, or would not catch up with the best."""
    lanes = sorted(lanes, key=lambda lane: lane.value)
    for k, lane in enumerate(lanes):
        behind = lane.value - lane.pace * CATCH_UP > lanes[0].value
        lane.ended |= lane.steps > RACE and behind
        near = (np.abs(points.u[[other.row for other in lanes[:k]]] - points.u[lane.row]) < SAME).all(axis=1)
        lane.ended |= bool(near.any())


class _Programs:
    """Quadratic programs that minimise the models of lanes with one objective, in boxes of several widths.

    Attributes
    ----------
    points : ndarray, shape (lanes, widths, n)
    """

    def __init__(self, explorer: Explorer, lanes: Sequence[_Lane], stencil: Stencil, place: slice) -> None:
        self._explorer, self._lanes, self._at = explorer, lanes, stencil.at[place]
        self._objective = lanes[0].objective
        self._terms = Terms(explorer, lanes[0].objective)
        centre, rows = stencil.centre[place], stencil.rows[place]
        plain, pieces, limits = (stencil.models(part) for part in self._terms(rows))
        owner = self._terms.owner
        steepest = np.abs(limits.slope).max(axis=2, initial=0.0)
        lengths = np.maximum(steepest, FLAT_SLOPE * np.abs(np.nan_to_num(limits.value)))
        self._lengths = np.where(lengths > 0, lengths, 1.0)
        self._rounding = SMALLEST_GAIN if not explorer.rough else ROUGH_SMALLEST_GAIN
        # The models are of all widths of a lane, one after the other.
        wide = np.repeat(np.arange(len(lanes)), len(NARROWER))
        self._widths = np.array([lane.width * part for lane in lanes for part in NARROWER])
        self._begin = (self._at - centre)[wide]
        self._low, self._high = (np.clip(self._at[wide] + side * self._widths[:, None], 0, 1) - centre[wide]
                                 for side in (-1, 1))  # fmt: skip
        self._slack = CONDITION_SLACK + np.array([lane.model_error for lane in lanes])[wide] * self._widths**3
        scale = self._scale(plain, pieces)
        self._plain = plain.take(wide) if self._terms.squared else plain.scaled(scale[:, None]).take(wide)
        widest, most = np.array([lane.width for lane in lanes]), ROWS_HELD * (centre.shape[1] + 1)
        pieces = without_lost(pieces.scaled(np.repeat(scale[:, None], pieces.value.shape[1], 1)))
        chosen = []
        for k in range(self._terms.edges):
            own = np.flatnonzero(owner == k)
            chosen.append(own[pieces.columns(np.broadcast_to(own, (len(lanes), len(own)))).highest(widest, most)])
        self._owner = np.repeat(np.arange(len(chosen)), [part.shape[1] for part in chosen])
        if chosen:
            pieces = pieces.columns(np.concatenate(chosen, axis=1))
        self._pieces = pieces.take(wide)
        limits = without_lost(limits.scaled(self._lengths))
        self._limits = limits.columns(limits.highest(widest, most)).take(wide)
        self._scales = scale[wide]
        best, promised = self._best()
        self.points = np.clip(centre[wide] + best, 0, 1).reshape(len(lanes), len(NARROWER), -1)
        self._promised = (promised * self._scales).reshape(len(lanes), -1).max(axis=1)

    def _scale(self, plain: Models, pieces: Models) -> Floats:
        """Change of the objective over a range, by its slopes or else its curvature; 1 where it does not change."""
        if self._terms.squared:
            _, slope, bend = square(plain, np.zeros_like(plain.slope[:, 0]))
            scale = np.maximum(np.abs(slope).max(axis=1), np.abs(bend).max(axis=(1, 2)))
        else:
            lanes = len(plain.value)
            flat = np.maximum(
                *(np.abs(part.slope).reshape(lanes, -1).max(axis=1, initial=0.0) for part in (plain, pieces))
            )
            bends = np.abs(plain.bend).reshape(lanes, -1).max(axis=1, initial=0.0)
            scale = np.where(flat > 0, flat, bends)
        return np.where(scale > 0, scale, 1.0)

    def _smooth_at(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Value, slope and curvature of the smooth sum at a point of each lane."""
        if self._terms.squared:
            value, slope, bend = square(self._plain, x)
            return value / self._scales, slope / self._scales[:, None], bend / self._scales[:, None, None]
        value, slope = self._plain.at(x)
        return np.nan_to_num(value[:, 0]), slope[:, 0], self._plain.bend[:, 0]

    def _cost(self, x: Floats) -> Floats:
        """The models' objective at points, with the price of violated conditions."""
        cost = self._smooth_at(x)[0]
        pieces, limits = self._pieces.at(x)[0], self._limits.at(x)[0]
        for k in range(self._terms.edges):
            cost = cost + pieces[:, self._owner == k].max(axis=1)
        return np.asarray(cost + PRICE * np.maximum(limits.max(axis=1, initial=FAR) + self._slack, 0.0))

    def _best(self) -> tuple[Floats, Floats]:
        """The best points of the models after some rounds of programs, and the gain that the models predict."""
        begin = self._cost(self._begin)
        x, cost = self._begin, begin
        widths, weights = self._widths.copy(), None
        for _ in range(ROUNDS):
            low, high = (np.clip(x + side * widths[:, None], self._low, self._high) for side in (-1, 1))
            first, weights = self._program(x, weights, low, high, widths)
            # Where rows are curved the first step may violate them, and a second one corrects that.
            second, weights = self._program(first, weights, low, high, widths)
            before = cost
            for new in (first, second):
                costs = self._cost(new)
                less = costs < cost
                x, cost = np.where(less[:, None], new, x), np.where(less, costs, cost)
            widths = np.where(cost < before, np.minimum(2 * widths, self._widths), widths / 4)
            if (cost - begin >= (1 + SETTLED) * (before - begin)).all() and (cost < begin).any():
                break
        return x, begin - cost

    def _program(
        self, x: Floats, weights: tuple[Floats, Floats] | None, low: Floats, high: Floats, width: Floats
    ) -> tuple[Floats, tuple[Floats, Floats]]:  # fmt: skip
        """The solution of the quadratic program at points, and the multipliers of all pieces and limits."""
        lanes, n = x.shape
        edges = self._terms.edges
        _, slope, bend = self._smooth_at(x)
        pieces, limits = self._pieces.at(x), self._limits.at(x)
        if weights is not None:
            bend = bend + self._pieces.summed(weights[0]) + self._limits.summed(weights[1])
        size = n + edges + 1
        matrix = np.zeros((lanes, size, size))
        matrix[:, :n, :n] = _convex(bend * width[:, None, None])
        q = np.concatenate([slope, np.ones((lanes, size - n))], axis=1)
        tops = np.stack([pieces[0][:, self._owner == k].max(axis=1) for k in range(edges)] or [width], axis=1)
        box = np.zeros((lanes, n + 1, size))
        box[:, range(n), range(n)], box[:, n, -1] = 1, -1
        lines = [np.zeros((*part.shape[:2], size)) for part in (pieces[1], limits[1])]
        lines[0][:, range(len(self._owner)), n + self._owner] = -1
        lines[1][:, :, -1] = -1 / PRICE
        for line, part in zip(lines, (pieces[1], limits[1]), strict=True):
            line[:, :, :n] = part
        rooms = [
            tops[:, self._owner] - pieces[0], -limits[0] - self._slack[:, None], high - x, np.zeros((lanes, 1)), x - low
        ]  # fmt: skip
        # Slopes are at most 1: rows with more room than this are never reached within the box.
        bounds = np.minimum(np.concatenate(rooms, axis=1) / width[:, None], 2 * n + 2)
        rows = np.concatenate([*lines, box, -box[:, :n]], axis=1)
        z, multipliers = quadratic.solve(matrix, q, rows, bounds, np.zeros((lanes, size)))
        first, second = len(self._owner), len(self._owner) + limits[0].shape[1]
        new = np.clip(x + width[:, None] * z[:, :n], low, high)
        return new, (multipliers[:, :first], multipliers[:, first:second])

    def judge(self, rows: Ints) -> None:
        """Go to the best of the evaluated points, shape (lanes, widths), and choose the next boxes, or end."""
        among = np.column_stack([[lane.row for lane in self._lanes], rows])
        merits, missed = self._merits(among)
        for k, lane in enumerate(self._lanes):
            lane.steps += 1
            best = int(merits[k].argmin())
            gained = merits[k, 0] - merits[k, best]
            lane.value, lane.pace = float(merits[k, best]), float(gained)
            value = abs(lane.value)
            widths = lane.width * np.array(NARROWER)
            # In narrow boxes smaller violations are rounding errors.
            wrong = missed[k, 1:] > CONDITION_SLACK
            lane.model_error = (
                min(float(2 * (missed[k, 1:] / widths**3)[wrong][0]), 1.0) if wrong.any() else lane.model_error / 2
            )
            lane.ahead = None
            if best != 1 and merits[k, 1] < UNKNOWN:
                lane.ahead = int(among[k, 1]), lane.width
            if best:
                way = np.abs(self._explorer.points.u[among[k, best]] - self._at[k]).max()
                at_edge = best == 1 and way > 0.9 * lane.width
                lane.width = min(3 * lane.width, LARGEST_WIDTH) if at_edge else max(min(2 * way, lane.width), TINY)
                lane.row = int(among[k, best])
            else:
                lane.width *= SHRUNK
            small = self._rounding * (value**2 if self._terms.squared else value)
            # A descent that still violates conditions continues as long as it gains.
            lane.ended = (
                bool(self._promised[k] <= small and gained <= self._rounding * value)
                or lane.width < (ROUGH_SMALLEST_WIDTH if self._explorer.rough else SMALLEST_WIDTH)
                or lane.steps >= MOST_STEPS
            )

    def _merits(self, rows: Ints) -> tuple[Floats, Floats]:
        """The merit of points, shape (lanes, points), and their violation of conditions."""
        points, flat = self._explorer.points, rows.ravel()
        limits = self._terms(rows)[2] / self._lengths[:, None]
        missed = np.nan_to_num(limits, nan=FAR).max(axis=2, initial=FAR)
        values = (points.values[flat] @ self._objective).reshape(rows.shape)
        valid = points.valid[flat].reshape(rows.shape)
        feasible = points.feasible[flat].reshape(rows.shape)
        outside = np.where(valid | (missed > 0), CONDITION_MISSED * (1 + np.maximum(missed, 0.0)), UNKNOWN)
        return np.where(feasible, values, outside), missed


def _convex(matrices: Floats) -> Floats:
    """The nearest positive semidefinite matrices."""
    values, vectors = np.linalg.eigh(np.nan_to_num(matrices))
    return np.asarray((vectors * np.maximum(values, 0.0)[:, None]) @ np.swapaxes(vectors, 1, 2))
