"""From a design to the optimum near it, by SciPy's least squares and sequential quadratic programming.

The worst of several rows has edges where another row becomes the worst. Its rows are smooth: the worst of them is made
small by its epigraph, ``min t`` where no row exceeds ``t``. Rows of conditions, and the margins by which poses
assemble, are conditions of their own. [Nocedal & Wright, Numerical Optimization, 2006, ch. 10 and 18.] Derivatives are
differences over steps, evaluated in one batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from threading import Barrier, BrokenBarrierError
from typing import Any, Literal

import numpy as np

from mechdesign.analyses.optimize.explorer import ASSEMBLY, Explorer
from mechdesign.numerics.arrays import Floats, Ints

# Steps of differences, and half the widths of the boxes in which they are used, in parts of the ranges.
LADDER = ((1e-4, 0.3), (1e-5, 0.03))
# Where values are known to a tolerance, differences over less than this are noise.
ROUGH_LADDER = ((1e-2, 0.3), (1e-3, 0.05))
SQUARES_STEP = 1e-5
# Most steps of least squares, far from their end and near it, and of quadratic programs.
MAX_SQUARES = 60
MAX_FINAL_SQUARES = 150
MAX_STEPS = 60
# Points asked for one after the other, none of which is better than what was known: a stage ends.
MAX_IN_VAIN = 30
ROUGH_MAX_IN_VAIN = 12
# Gains of a step, in parts of what a range changes, below which a quadratic program ends.
SMALLEST_GAIN = 1e-14
ROUGH_SMALLEST_GAIN = 1e-5
# How far conditions are kept, in parts of the ranges: the optimum lies on them, and rounding must not put it beyond.
CONDITION_SLACK = 1e-9
# Added to the objective where a point has no value though it meets all conditions, in parts of what a range changes.
NO_VALUE_COST = 1e3
# Slopes of conditions below this part of their values are none.
FLAT_SLOPE = 1e-6
TINY = float(np.finfo(float).tiny)


# From points to their rows of `Explorer.known`.
Ask = Callable[[Floats], Ints]


class _InVain(Exception):
    """A stage comes no further: an optimiser may halve its steps for a long time where poses end."""


def descend(
    explorer: Explorer, descents: Sequence[tuple[Floats, int]], ladder: Sequence[tuple[float, float]] = LADDER,
    *, final: bool = False,
) -> list[int]:  # fmt: skip
    """Descend from known points, all at once: a batch of designs costs little more than one.

    Parameters
    ----------
    descents : sequence of (ndarray, int)
        Factors of the goals whose sum is made small, and the row of `explorer.known` from which.
    ladder : sequence of (float, float)
        Steps of differences and half the widths of boxes.
    final : bool
        Whether they begin near their ends.

    Returns
    -------
    list of int
        Rows of `explorer.known` where the descents ended.

    Raises
    ------
    Spent
        If the evaluations are used up.
    """
    running = [_Descent(explorer, objective, row, ladder, final) for objective, row in descents]
    side_by_side(explorer, [each.run for each in running])
    return [each.best for each in running]


def side_by_side(explorer: Explorer, tasks: Sequence[Callable[[Ask], None]]) -> None:
    """Run tasks that ask for few points at a time; what all of them ask is evaluated in one batch.

    A batch waits for every task that still runs, and holds their points in the order of the tasks, so that the result
    does not depend on which of them came first. `explorer.known` does not change while a task computes.

    Raises
    ------
    Spent
        If the evaluations are used up; all tasks have ended then.
    """
    none = np.empty((0, explorer.dimensions))
    asked, rows = [none] * len(tasks), [np.empty(0, dtype=np.intp)] * len(tasks)
    over = not tasks
    # All tasks and this thread meet twice a batch: when everything is asked, and when everything is known.
    meeting = Barrier(len(tasks) + 1)

    def run(k: int) -> None:
        def ask(points: Floats) -> Ints:
            asked[k] = points
            meeting.wait()
            meeting.wait()
            return rows[k]

        try:
            # The state of warnings is a thread's own.
            with np.errstate(all="ignore"):
                tasks[k](ask)
            # One that has ended asks for nothing until all have.
            while not over:
                ask(none)
        except BaseException:
            meeting.abort()
            raise

    with ThreadPoolExecutor(max(len(tasks), 1)) as pool:
        running = [pool.submit(run, k) for k in range(len(tasks))]
        try:
            while not over:
                meeting.wait()
                ends = np.cumsum([len(points) for points in asked])
                over = not ends[-1]
                rows[:] = np.split(explorer(np.concatenate(asked)), ends[:-1])
                meeting.wait()
        except BrokenBarrierError:
            pass
        finally:
            meeting.abort()
    for error in [task.exception() for task in running]:
        if error is not None and not isinstance(error, BrokenBarrierError):
            raise error


class _Descent:
    """One descent: the best row so far, and the smooth parts of which its objective consists."""

    def __init__(
        self, explorer: Explorer, objective: Floats, row: int, ladder: Sequence[tuple[float, float]], final: bool
    ) -> None:
        self.explorer, self.objective, self.best, self.ladder, self.final = explorer, objective, row, ladder, final
        self.plain, known = objective.copy(), explorer.known
        goals = len(self.plain)
        self.edged, self.held, self.squares = [], [], []
        self.conditions = np.ones(known.margins.shape[1], dtype=bool)
        for part in explorer.parts:
            if part.column == ASSEMBLY:
                self.held.append(part)
            elif part.column >= goals:
                if np.isnan(known.rows[row, part.place]).any():
                    continue
                self.held.append(part)
                self.conditions[part.column - goals] = False
            elif part.squares:
                self.squares += [part] if self.plain[part.column] > 0 else []
            elif objective[part.column] * part.sign > 0 and np.isfinite(known.rows[row, part.place]).all():
                self.edged.append((part, abs(objective[part.column])))
                self.plain[part.column] = 0.0
        # A root mean square that is the only goal is made small by its square, which is smoother.
        self.curvature = 0.0
        self._last: tuple[Floats, Ints] = np.empty((0, 0)), np.empty(0, dtype=np.intp)
        self._in_vain = 0
        # Whether slopes were asked for at the last point.
        self._taken = True
        self.squared = len(self.squares) == np.count_nonzero(objective) == 1

    def run(self, ask: Ask) -> None:
        """Descend by points that `ask` evaluates."""
        self._evaluate = ask
        if not self.explorer.known.valid[self.best]:
            return
        if self.squared:
            # `trf` is quicker far from the optimum, `dogbox` along a narrow valley that ends on bounds.
            self._stage(self._least_squares, "dogbox" if self.final else "trf")
        for step, width in self.ladder:
            self._stage(self._programming, step, width)

    def _stage(self, optimiser: Callable[..., None], *arguments: Any) -> None:
        """Let an optimiser go on until it ends, or comes no further; its best point is kept."""
        self._in_vain = 0
        with suppress(_InVain):
            optimiser(*arguments)

    def ask(self, points: Floats) -> Ints:
        """Rows of points; the best of them, or of those before, is where the next stage begins."""
        if self._in_vain > (ROUGH_MAX_IN_VAIN if self.explorer.rough else MAX_IN_VAIN):
            raise _InVain
        rows = self._evaluate(points)
        known = self.explorer.known
        among = np.concatenate([[self.best], rows])
        merit = known.merit(self.objective)[among]
        self.best = int(among[np.argmin(merit)])
        self._in_vain = 0 if merit.min() < merit[0] else self._in_vain + 1
        return rows

    def terms(self, rows: Ints) -> tuple[Floats, Floats, Floats]:
        """The smooth sum, shape (m, 1), rows that bound each worst, and what may not be positive; nan where unknown."""
        known = self.explorer.known
        lines = known.rows[rows]
        none = np.empty((len(rows), 0))
        pieces = [part.pieces(lines) * factor for part, factor in self.edged]
        limits = [-known.margins[rows][:, self.conditions], *(part.pieces(lines) for part in self.held)]
        plain = known.values[rows] @ self.plain if self.plain.any() else np.zeros(len(rows))
        plain = plain**2 if self.squared else plain
        return plain[:, None], np.concatenate([none, *pieces], axis=1), np.concatenate(limits, axis=1)

    def _least_squares(self, method: Literal["trf", "dogbox"]) -> None:
        from scipy.optimize import least_squares

        (part,) = self.squares

        def residuals(u: Floats) -> Floats:
            row = self.at(u, SQUARES_STEP)[0]
            return np.asarray(self.explorer.known.rows[row, part.place])

        def slopes(u: Floats) -> Floats:
            points, rows = self._stencil(u, SQUARES_STEP)
            return np.nan_to_num(_differences(points, u, self.explorer.known.rows[rows][:, part.place]))

        begin = self.explorer.known.u[self.best]
        if np.isfinite(residuals(begin)).all():
            most = MAX_FINAL_SQUARES if self.final else MAX_SQUARES
            least_squares(
                residuals, begin, jac=slopes, bounds=(0.0, 1.0), method=method, max_nfev=most,
                xtol=1e-14, ftol=1e-14, gtol=None,
            )  # fmt: skip

    def at(self, u: Floats, step: float) -> Ints:
        """Rows of a point, and of those for its slopes where they cost little more and are likely to be asked for next.

        They are not where the point before was not taken.
        """
        if self.explorer.slow or not self._taken:
            return self.ask(u[None])
        rows = self._stencil(u, step)[1]
        self._taken = False
        return rows

    def _stencil(self, u: Floats, step: float) -> tuple[Floats, Ints]:
        """A point, and those a step from it along each variable, inside the cube."""
        sides = [np.clip(u + sign * step * np.eye(len(u)), 0.0, 1.0) for sign in (-1, 1)]
        points = np.concatenate([u[None], *sides])
        if not np.array_equal(points, self._last[0]):
            # Asked for again, they would wait for the other descents.
            self._last = points, self.ask(points)
        self._taken = True
        return self._last

    def _programming(self, step: float, width: float) -> None:
        """Sequential quadratic programming in a box about the best point."""
        from scipy.optimize import minimize as scipy_minimize

        # Its stubs know no bounds of other than plain numbers.
        minimize: Any = scipy_minimize
        begin = self.explorer.known.u[self.best].copy()
        n, more = len(begin), len(self.edged)
        lines = self.explorer.known.rows[[self.best]]
        owner = np.repeat(np.arange(more), [part.pieces(lines).shape[1] for part, _ in self.edged])
        program = _Program(self, begin, step)
        raised, free = np.eye(more)[owner], np.zeros((len(program.lengths), more))

        def cost(y: Floats) -> float:
            return float(program.terms(y[:n])[0][0] + y[n:].sum())

        def cost_slope(y: Floats) -> Floats:
            return np.concatenate([program.slopes(y[:n])[0][0], np.ones(more)])

        def room(y: Floats) -> Floats:
            _, pieces, limits = program.terms(y[:n])
            return np.concatenate([y[n:][owner] - pieces, -limits - CONDITION_SLACK])

        def room_slope(y: Floats) -> Floats:
            _, pieces, limits = program.slopes(y[:n])
            return np.block([[-pieces, raised], [-limits, free]])

        pieces = program.terms(begin)[1]
        tops = np.array([pieces[owner == k].max() for k in range(more)])
        low, high = np.maximum(begin - width, 0.0), np.minimum(begin + width, 1.0)
        minimize(
            cost, np.concatenate([begin, tops]), jac=cost_slope, method="SLSQP",
            bounds=[*zip(low, high, strict=True), *[(None, None)] * more],
            constraints=[{"type": "ineq", "fun": room, "jac": room_slope}] if len(owner) + len(free) else (),
            options={"maxiter": MAX_STEPS, "ftol": ROUGH_SMALLEST_GAIN if self.explorer.rough else SMALLEST_GAIN},
        )  # fmt: skip

    def linear(self, u: Floats, step: float) -> tuple[list[Floats], list[Floats]]:
        """The terms at a point, and their slopes, each of shape (columns, n)."""
        points, rows = self._stencil(u, step)
        found = self.terms(rows)
        if self.squared:
            # Slopes vanish at the bottom of a valley; there the curvature gives the change over a range.
            n, plain = len(u), found[0][:, 0]
            inside = np.abs(points[n + 1 :] - points[1 : n + 1]).max(axis=1) > 1.5 * step
            bends = np.abs(plain[1 : n + 1] + plain[n + 1 :] - 2 * plain[0])[inside] / step**2
            self.curvature = max(self.curvature, float(np.nan_to_num(bends).max(initial=0.0)))
        return [part[0] for part in found], [np.nan_to_num(_differences(points, u, part)) for part in found]


class _Program:
    """What a descent makes small, in parts of what a range changes of it: its terms and their slopes at any point.

    Where the goals have no value they go on as straight lines from the last point where they had, as long as a
    condition or a clearance tells that nothing is to be had there; else they are too high for a step to be taken.
    """

    def __init__(self, descent: _Descent, begin: Floats, step: float) -> None:
        self._descent, self._step = descent, step
        values, slopes = descent.linear(begin, step)
        scale = max(*(float(np.abs(part).max(initial=0.0)) for part in slopes[:2]), descent.curvature, TINY)
        steepest = np.abs(slopes[2]).max(axis=1, initial=0.0)
        self.lengths = np.maximum(steepest, np.maximum(FLAT_SLOPE * np.abs(np.nan_to_num(values[2])), TINY))
        self._scales = [np.array([scale]), np.full(len(values[1]), scale), self.lengths]
        values, self._slopes = self._in_parts(values, slopes)
        self._at, self._values = begin.copy(), [np.nan_to_num(part) for part in values]
        self._known: dict[bytes, list[Floats]] = {}
        self._known_slopes = {self._at.tobytes(): self._slopes}

    def _in_parts(self, values: list[Floats], slopes: list[Floats]) -> tuple[list[Floats], list[Floats]]:
        return (
            [part / scale for part, scale in zip(values, self._scales, strict=True)],
            [part / scale[:, None] for part, scale in zip(slopes, self._scales, strict=True)],
        )

    def _straight(self, u: Floats) -> list[Floats]:
        return [part + slope @ (u - self._at) for part, slope in zip(self._values, self._slopes, strict=True)]

    def terms(self, u: Floats) -> list[Floats]:
        """The smooth sum, the rows that bound each worst, and what may not be positive."""
        key = u.tobytes()
        if key not in self._known:
            rows = self._descent.at(u, self._step)[:1]
            found = [part[0] / scale for part, scale in zip(self._descent.terms(rows), self._scales, strict=True)]
            impossible = np.isnan(found[0]).any() or np.isnan(found[1]).any()
            told = bool((found[2] > 0).any())
            found = [np.where(np.isnan(new), line, new) for new, line in zip(found, self._straight(u), strict=True)]
            if impossible and not told:
                found[0] = found[0] + NO_VALUE_COST
            self._known = {key: found}
        return self._known[key]

    def slopes(self, u: Floats) -> list[Floats]:
        """Slopes of the terms, each of shape (columns, n)."""
        key = u.tobytes()
        if key not in self._known_slopes:
            values, slopes = self._in_parts(*self._descent.linear(u, self._step))
            known, straight = [np.isfinite(part) for part in values], self._straight(u)
            self._slopes = [
                np.where(good[:, None], new, old) for good, new, old in zip(known, slopes, self._slopes, strict=True)
            ]
            self._values = [np.where(good, new, line) for good, new, line in zip(known, values, straight, strict=True)]
            self._at = u.copy()
            self._known_slopes = {key: self._slopes}
        return self._known_slopes[key]


def _differences(points: Floats, u: Floats, values: Floats) -> Floats:
    """Slopes, shape (columns, n), of values at a point and at those below and above it along each variable.

    Central where both sides are known, else one-sided; nan where neither is.
    """
    n = len(u)
    below, above = values[1 : n + 1], values[n + 1 :]
    down, up = u - np.diagonal(points[1 : n + 1]), np.diagonal(points[n + 1 :]) - u
    with np.errstate(all="ignore"):
        left = (values[0] - below) / down[:, None]
        right = (above - values[0]) / up[:, None]
        # Of unequal sides this is the slope of the parabola through the three points.
        both = (left * up[:, None] + right * down[:, None]) / (up + down)[:, None]
    return np.asarray(np.where(np.isfinite(both), both, np.where(np.isfinite(left), left, right)).T)
