"""Four-bars for the ten path problems by other searches: SciPy's differential evolution, and pylinkage."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np
from path_problems import LIMITS, SEED, FourBar, Problem
from scipy.optimize import differential_evolution

from mechdesign.ground.numerics.arrays import Floats

PRECISE = 5  # points: pylinkage's documentation gives three to five
ANGLES = 120  # crank angles of a curve while it is looked for


def evolved(problem: Problem, seconds: float) -> FourBar:
    """A four-bar by differential evolution in so many seconds of the processor, within the usual limits.

    The points may be passed in any order. What keeps the crank from turning, and uneven links, count as distances.
    """
    turn = np.linspace(0, 2 * np.pi, ANGLES, endpoint=False)
    middle, size, ratio = problem.points.mean(), problem.size, 6

    def bar_of(numbers: Floats) -> FourBar:
        x, y, u, v, *links, along, angle, side = numbers
        pivots = [complex(*place) + 0 * x for place in problem.pivots] or [
            middle + size * (a + 1j * b) for a, b in ((x, y), (u, v))
        ]
        point = size * along * np.exp(1j * angle)
        return FourBar(*pivots, *(size * link for link in links), point, np.where(side > 0, 1, -1))

    def errors(numbers: Floats) -> Floats:
        bar = bar_of(numbers[..., None])
        span = np.abs(bar.other - (bar.pivot + bar.crank * np.exp(1j * turn)))
        closes = np.abs((span**2 + bar.coupler**2 - bar.rocker**2) / (2 * span * bar.coupler))
        links = np.concatenate(
            np.broadcast_arrays(np.abs(bar.other - bar.pivot), bar.crank, bar.coupler, bar.rocker), -1
        )
        outside = np.maximum(closes.max(axis=-1) - 1, 0) + np.maximum(links.max(-1) / links.min(-1) / ratio - 1, 0)
        curve = np.nan_to_num(bar.curve(turn), nan=1e3 * size)
        gaps = np.abs(curve[..., None] - problem.points).min(axis=-2)
        return np.asarray(np.sqrt((gaps**2).mean(axis=-1)) + size * outside)

    until = time.process_time() + seconds
    ranges = [(-3, 3)] * 4 + [(0.05, 6)] * 3 + [(0, 6), (-np.pi, np.pi), (-1, 1)]
    optimum = differential_evolution(
        errors, ranges, vectorized=True, updating="deferred", polish=False, tol=0, maxiter=100_000, rng=SEED,
        callback=lambda *_: time.process_time() > until,
    )  # fmt: skip
    return bar_of(optimum.x)


def by_burmester(problem: Problem) -> FourBar | None:
    """The best four-bar that pylinkage finds through these points; None where it finds none."""
    from pylinkage.synthesis import path_generation

    pivots: dict[str, Any] = dict(zip(("ground_pivot_a", "ground_pivot_d"), map(tuple, problem.pivots), strict=False))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = path_generation([(point.real, point.imag) for point in problem.points], **pivots)
    bars = []
    for linkage in result.raw_solutions:
        places = (linkage.ground_pivot_a, linkage.ground_pivot_d, linkage.crank_pivot_b, linkage.coupler_pivot_c,
                  linkage.coupler_point)  # fmt: skip
        pivot, other, pin, end, point = (complex(*place) for place in places)
        side = 1 if ((other - pin).conjugate() * (end - pin)).imag > 0 else -1
        links = abs(pin - pivot), abs(end - pin), abs(end - other)
        bars.append(FourBar(pivot, other, *links, (point - pin) * abs(end - pin) / (end - pin), side))
    return min(bars, key=lambda bar: bar.error(problem.points), default=None)


def errors_of(problem: Problem, seconds: float | None = None, *, pylinkage: bool = False) -> dict[str, float | str]:
    """Errors as parts of the task's size: of our linkage, of the printed one, and of those that others find.

    Differential evolution has the processor time of our search, or so many seconds.
    """
    begin = time.process_time()
    bars: dict[str, FourBar | None] = {"mechdesign": problem.solve(LIMITS["usual limits"])}
    spent = time.process_time() - begin if seconds is None else seconds
    if problem.printed is not None:
        bars["printed"] = problem.printed
    bars["evolution"] = evolved(problem, spent)
    if pylinkage and len(problem.points) <= PRECISE:
        bars["pylinkage"] = by_burmester(problem)
    return {
        name: "none found" if bar is None else float(f"{bar.error(problem.points) / problem.size:.3g}")
        for name, bar in bars.items()
    }
