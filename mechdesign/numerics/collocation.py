"""Differential equations of functions that take many states at once: Picard iteration at Chebyshev points.

A step solves y(t) = y0 + integral of f(t, y) at all its points together: f at the points of the last iteration is
integrated as a Chebyshev series, which gives the next [Bai & Junkins, 2011]. So a step takes a few calls for many
states instead of many calls for one. Its error is that of the series, whose last coefficients show it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from mechdesign.numerics.arrays import Floats

DEGREE = 20
# Places of the points in a step, from -1 to 1; what makes a series of values there, and values of its integral.
POINTS: Floats = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
SERIES: Floats = np.asarray(np.linalg.inv(chebyshev.chebvander(POINTS, DEGREE)), dtype=float)
INTEGRAL: Floats = np.asarray(chebyshev.chebint(SERIES, lbnd=-1), dtype=float)
INTEGRATED: Floats = chebyshev.chebvander(POINTS, DEGREE + 1) @ INTEGRAL
# The last coefficients of a series, whose largest is its error.
LAST = 3
# Most iterations of a step. Changes of the state are parts of the error that is allowed: more than this part of the
# error that shows goes on, unless one is so many times the last.
ITERATIONS, SETTLED, WORSE = 24, 0.1, 2.0
# How much longer the next step is at most, and how much shorter another try at least and at most.
GROW, SHRINK = 4.0, (0.1, 0.6)
# Errors grow with these powers of the length: where f is smooth, and where it has a corner or is steep. The next step
# aims at a part of the error that is allowed.
SMOOTH, STEEP, AIM = 12, 4, 0.5
# The shortest step, in units of the time's rounding.
SHORTEST = 8
# The first step, as a part of the time in which the state changes by the size of its errors' scale.
FIRST = 0.05


class Piece(NamedTuple):
    """States in a step, a Chebyshev series each, shape (n, degree + 1)."""

    begin: float
    end: float
    series: Floats

    def at(self, times: Floats) -> Floats:
        """States at times, shape (n, times)."""
        places = 2 * (times - self.begin) / (self.end - self.begin) - 1
        return np.asarray(chebyshev.chebval(places, self.series.T), dtype=float)


class Solver:
    """Integrates y' = f(t, y) from a time to another, a step at each call.

    Parameters
    ----------
    function : callable
        Derivatives, shape (n, k), at k times and states, shapes (k,) and (n, k).
    time, end : float
    state : Floats, shape (n,)
    scales : Floats, shape (n,)
        Usual sizes of the state's parts.
    relative, absolute : float
        Error of a step, as a part of the state and of `scales`.
    first, longest : float, optional
        Length of the first step, and of the longest.

    Attributes
    ----------
    running : bool
        Whether the end is not reached.
    """

    def __init__(
        self, function: Callable[[Floats, Floats], Floats], time: float, state: Floats, end: float, scales: Floats,
        relative: float, absolute: float, first: float | None = None, longest: float = np.inf,
    ) -> None:  # fmt: skip
        self.function, self.time, self.state, self.end = function, time, state, end
        self.relative, self.absolute, self.longest = relative, absolute * scales, longest
        self.begin, self.derivative = time, function(np.array([time]), state[:, None])[:, 0]
        if first is None:
            pace = np.max(np.abs(self.derivative) / (np.abs(state) + scales))
            first = FIRST / pace if np.isfinite(pace) and pace > 0 else FIRST * (end - time)
        self._length = min(first, longest, end - time)
        self._series: Floats = np.empty(0)

    @property
    def running(self) -> bool:
        """Whether the end is not reached."""
        return self.time < self.end

    def step(self) -> bool:
        """Take a step; whether there is a solution beyond the time reached."""
        if not np.isfinite(self.derivative).all():
            return False
        while True:
            length = min(self._length, self.end - self.time)
            if length < SHORTEST * np.spacing(self.time):
                return False
            if self._step(length):
                return True

    def _step(self, length: float) -> bool:
        """Take a step of a length, or see that it is too long."""
        half, begin = length / 2, self.state[:, None]
        times = self.time + half * (POINTS + 1)
        allowed = self.absolute + self.relative * np.abs(self.state)
        states = begin + self.derivative[:, None] * (times - self.time)
        change, error = np.inf, np.inf
        for _ in range(ITERATIONS):
            inside = self.function(times[1:], states[:, 1:])
            slopes = np.concatenate([self.derivative[:, None], inside], axis=1)
            last, before, states = change, states, begin + half * slopes @ INTEGRATED.T
            change = float(np.max(np.abs(states - before).max(axis=1) / allowed))
            error = float(np.max(half * np.abs(slopes @ SERIES[-LAST:].T).max(axis=1) / allowed))
            if not max(SETTLED * error, 1.0) < change < WORSE * last:
                break
        if not (change <= 1.0 and error <= 1.0):
            wanted = error ** (-1 / STEEP) if error > 1.0 else SHRINK[1]
            self._length = length * float(np.clip(wanted, *SHRINK))
            return False
        self._series = half * slopes @ INTEGRAL.T
        self._series[:, 0] += self.state
        reached = self.end if length == self.end - self.time else self.time + length
        self.begin, self.time, self.state, self.derivative = self.time, reached, states[:, -1], slopes[:, -1]
        longer = min(GROW, (AIM / error) ** (1 / SMOOTH) if error > 0 else GROW)
        self._length = min(length * longer, self.longest)
        return True

    @property
    def piece(self) -> Piece:
        """The states within the last step."""
        return Piece(self.begin, self.time, self._series)
