"""Limit states with answers that are known exactly, or by quadrature, in independent standard normal variables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from math import comb, factorial

import numpy as np
from scipy.special import gammaincc, ndtr, ndtri

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.problem import LimitStates
from mechdesign.questions.reliability.laws import MeasuredLaw


@dataclass(frozen=True)
class Case:
    dimension: int
    margins: Callable[[Floats], Floats]
    exact: float

    @property
    def problem(self) -> LimitStates:
        return LimitStates(self.dimension, self.margins)


def over_the_normal(function: Callable[[Floats], Floats], low: float = -12, high: float = 12) -> float:
    """Integral of a function times the standard normal density, by Gauss-Legendre panels."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(low, high, 2001)
    half = 0.5 * np.diff(edges)[:, None]
    x = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    density = (half * weights).ravel() * np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi)
    return float(density @ function(x))


def linear(dimension: int, beta: float) -> Case:
    """A half-space, oblique to all axes."""
    normal = np.arange(1, dimension + 1) ** -0.5
    normal /= np.linalg.norm(normal)
    return Case(dimension, lambda u: (beta - normal @ u)[None], float(ndtr(-beta)))


def band(dimension: int, beta: float) -> Case:
    return Case(dimension, lambda u: np.stack([beta - u[0], beta + u[0]]), 2 * float(ndtr(-beta)))


def four_branches(p: float, *, together: bool = False) -> Case:
    """The series system of Waarts (2000): four limits, or one that is the least of them."""

    def margins(u: Floats) -> Floats:
        half = 3 + 0.1 * (u[0] - u[1]) ** 2
        sides = (u[0] + u[1]) / np.sqrt(2)
        found = np.stack([half - sides, half + sides, u[0] - u[1] + p / np.sqrt(2), u[1] - u[0] + p / np.sqrt(2)])
        return found.min(axis=0)[None] if together else found

    # In axes turned by 45 degrees: outside |b| < p/2, or within it beyond both parabolas.
    within = over_the_normal(lambda b: 2 * ndtr(-(3 + 0.2 * b * b)), -p / 2, p / 2)
    return Case(2, margins, 2 * float(ndtr(-p / 2)) + within)


def parabola(b: float = 5.0, k: float = 0.5, e: float = 0.1) -> Case:
    """Two design points (Der Kiureghian & Dakessian, 1998)."""
    exact = over_the_normal(lambda x: ndtr(-(b - k * (x - e) ** 2)))
    return Case(2, lambda u: (b - u[1] - k * (u[0] - e) ** 2)[None], exact)


def ring(radius: float, dimension: int = 2) -> Case:
    """Outside a circle of the first two variables: every point of it is a design point."""
    return Case(dimension, lambda u: (radius - np.hypot(u[0], u[1]))[None], float(gammaincc(1.0, radius**2 / 2)))


def largest(count: int, beta: float) -> Case:
    """The largest of so many deviations beyond `beta`, to either side: one limit of twice as many design points."""
    exact = -np.expm1(count * np.log1p(-2 * ndtr(-beta)))
    return Case(count, lambda u: (beta - np.abs(u).max(axis=0))[None], float(exact))


def outliers(count: int, share: float, beta: float) -> Case:
    """Two of so many parts are outliers of this share, where nothing has a slope; or one more variable is far out."""
    edge = -ndtri(share)

    def margins(u: Floats) -> Floats:
        two = 1.5 - (u[:count] > edge).sum(axis=0)
        return np.stack([two, beta - u[count]])

    within = (1 - share) ** count + count * share * (1 - share) ** (count - 1)
    return Case(count + 1, margins, float(1 - within * ndtr(beta)))


def ends(beta: float) -> Case:
    """No margins beyond `beta` along one variable, a limit a little farther along another."""

    def margins(u: Floats) -> Floats:
        return np.where(u[0] > beta, np.nan, beta + 1 - u[1])[None]

    one, other = ndtr(-beta), ndtr(-beta - 1)
    return Case(3, margins, float(one + other - one * other))


def measured(count: int, limit: float) -> Case:
    """The sum of dimensions measured at 100 parts, two of them outliers by 0.1, beyond a limit, by convolution."""
    rng, step = np.random.default_rng(0), 1e-4
    laws = [MeasuredLaw.of(np.r_[rng.normal(0, 0.002, 98), rng.normal(0.1, 0.002, 2)], 0.0, 0.0) for _ in range(count)]
    grid = step * np.arange(-2000, 2000)
    # Each law in a cell about every node; sums of cells are as far off as half of them on the average.
    below, ranks = grid - 0.5 * step, (np.arange(100) + 0.5) / 100
    shares = [np.diff(np.interp(below, law.low + law.ordered, ranks, 0, 1)) for law in laws]
    total = reduce(np.convolve, shares)
    exact = float(total[step * np.arange(len(total)) + count * grid[0] > limit].sum())
    return Case(count, lambda u: (limit - sum(law.at(row) for law, row in zip(laws, u, strict=True)))[None], exact)


def uniforms(dimension: int, limit: float) -> Case:
    """The sum of variables uniform within +-1 beyond a limit near its largest (Irwin & Hall)."""
    x = 0.5 * (dimension - limit)
    terms = [(-1) ** k * comb(dimension, k) * max(x - k, 0.0) ** dimension for k in range(dimension + 1)]

    def margins(u: Floats) -> Floats:
        return (limit - dimension + 2 * ndtr(-u).sum(axis=0))[None]

    return Case(dimension, margins, sum(terms) / factorial(dimension))


def _lognormal(mean: float, sigma: float) -> tuple[float, float]:
    shape = np.sqrt(np.log1p((sigma / mean) ** 2))
    return float(np.log(mean) - 0.5 * shape**2), float(shape)


def _density(log_mean: float, shape: float, x: Floats) -> Floats:
    found = np.zeros_like(x)
    found[1:] = np.exp(-0.5 * ((np.log(x[1:]) - log_mean) / shape) ** 2) / (x[1:] * shape * np.sqrt(2 * np.pi))
    return found


def lognormals(dimension: int) -> Case:
    """A hyperplane of lognormal variables (Rackwitz, 2001), whose sum's density is found by a Fourier transform."""
    sigma = 0.2
    limit = dimension + 3 * sigma * np.sqrt(dimension)
    mean, shape = _lognormal(1.0, sigma)
    step, count = 0.004, 2 ** int(np.ceil(np.log2(3 * dimension / 0.004)))
    x = step * np.arange(count)
    spectrum = (np.fft.rfft(_density(mean, shape, x)) * step) ** dimension
    total = np.fft.irfft(spectrum, count) / step
    below = int(limit / step)
    # The trapezoidal rule from the limit on.
    rest = (below + 1) * step - limit
    at = total[below] + (limit / step - below) * (total[below + 1] - total[below])
    exact = step * (total[below + 1 :].sum() - 0.5 * total[below + 1]) + 0.5 * rest * (at + total[below + 1])
    return Case(dimension, lambda u: (limit - np.exp(mean + shape * u).sum(axis=0))[None], float(exact))


def noisy() -> Case:
    """Lognormal variables with a ripple that spoils slopes (Engelund & Rackwitz, 1993); exact without the ripple."""
    laws = [_lognormal(120, 12)] * 4 + [_lognormal(50, 15), _lognormal(40, 12)]
    factors = np.array([1.0, 2.0, 2.0, 1.0, -5.0, -5.0])
    step, count = 0.1, 2**16
    x = step * np.arange(count)

    def total(which: range) -> Floats:
        spectrum = np.ones(count // 2 + 1, dtype=complex)
        for k in which:
            size = abs(factors[k])
            mean, shape = laws[k]
            spectrum *= np.fft.rfft(_density(mean + np.log(size), shape, x)) * step
        return np.asarray(np.fft.irfft(spectrum, count) / step)

    strength, load = total(range(4)), total(range(4, 6))
    below = step * (np.cumsum(strength) - 0.5 * strength)

    def margins(u: Floats) -> Floats:
        values = np.stack([np.exp(mean + shape * row) for (mean, shape), row in zip(laws, u, strict=True)])
        return (factors @ values + 0.001 * np.sin(100 * values).sum(axis=0))[None]

    return Case(6, margins, float(step * (load @ below)))
