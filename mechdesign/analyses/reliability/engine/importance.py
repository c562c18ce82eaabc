"""Importance sampling about the design points, by a mixture of normal densities that learns where failures lie.

[Melchers, Search-based importance sampling, 1990; Kurtz & Song, Cross-entropy-based adaptive importance sampling using
Gaussian mixture, 2013; the part that never changes bounds the weights as in Owen & Zhou, Safe and effective importance
sampling, 2000.]
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import DesignPoints
from mechdesign.analyses.reliability.engine.intervals import weighted
from mechdesign.analyses.reliability.engine.precision import Precision
from mechdesign.analyses.reliability.engine.problem import Estimate, Floats, Problem, failed

# Points farther than the nearest one by this many standard deviations bring nothing.
FAR = 4.0
# Rounds of learning, and their samples a dimension and at least. All rounds' failures are learned from together.
ROUNDS, SAMPLES, LEAST = 5, 150, 1200
# Share of the samples that stay with the design points, and with the least of them.
FIXED, SMALLEST = 0.1, 0.02
# A learned covariance is what it would be if so many samples a dimension of the standard normal law had been seen too.
PRIOR = 0.25
# First samples of the value, by which the rest is planned; so much more than what they ask for.
FIRST, MARGIN = 2000, 1.1
BLOCK = 20_000


@dataclass(frozen=True, eq=False)
class Mixture:
    """Weighted normal densities.

    Parameters
    ----------
    weight : ndarray, shape (parts,)
    centre : ndarray, shape (parts, dimension)
    root : ndarray, shape (parts, dimension, dimension)
        Cholesky factors of the covariances.
    """

    weight: Floats
    centre: Floats
    root: Floats

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Points, shape (dimension, count)."""
        part = rng.choice(len(self.weight), count, p=self.weight)
        normal = rng.standard_normal((len(self.centre[0]), count))
        u = np.empty_like(normal)
        for k in range(len(self.weight)):
            own = part == k
            u[:, own] = self.root[k] @ normal[:, own] + self.centre[k][:, None]
        return u

    def logs(self, u: Floats) -> Floats:
        """Logarithm of each part's weighted density over the standard normal one at 0, shape (parts, n)."""
        from scipy.linalg import solve_triangular

        found = np.empty((len(self.weight), u.shape[1]))
        for k, (weight, centre, root) in enumerate(zip(self.weight, self.centre, self.root, strict=True)):
            z = solve_triangular(root, u - centre[:, None], lower=True, check_finite=False)
            found[k] = np.log(weight) - np.log(np.diagonal(root)).sum() - 0.5 * (z * z).sum(axis=0)
        return found


def importance_sampling(
    problem: Problem,
    points: DesignPoints,
    rng: np.random.Generator,
    samples: int,
    precision: Precision | None = None,
) -> Estimate:
    """Probability of failure.

    Parameters
    ----------
    samples : int
        At most so many for the value, beside those that the mixture learns from.
    precision : Precision, optional
        Where it ends; left out, all samples are drawn.

    Returns
    -------
    Estimate
        With failure 0 and the interval [0, 1] where no failure was seen, or no design point is known.
    """
    if not len(points.u):
        return Estimate(0.0, 0.0, 1.0, problem.evaluations)
    mixture = _learned(problem, _about(points), rng)
    total = squares = 0.0
    done = failures = invalid = 0
    wanted = samples if precision is None else min(FIRST, samples)
    while done < wanted:
        count = min(BLOCK, wanted - done)
        u = mixture.draw(rng, count)
        margins = problem.margins(u)
        broken = failed(margins)
        weights = _weights(mixture, u[:, broken])
        total, squares = total + float(weights.sum()), squares + float((weights * weights).sum())
        done, failures = done + count, failures + int(broken.sum())
        invalid += int(np.isnan(margins).any(axis=0).sum())
        if done == wanted < samples and precision is not None and total > 0:
            mean = total / done
            if not precision.reached(mean, *weighted(total, squares, done)):
                more = MARGIN * precision.needed(mean, squares / done - mean * mean)
                wanted = int(min(samples, max(1.2 * done, more)))
    low, high = weighted(total, squares, done)
    return Estimate(total / done, low, high, problem.evaluations, done, failures, invalid)


def _about(points: DesignPoints) -> Mixture:
    """Standard normal densities moved to the design points, weighted by the tangents' probabilities."""
    from scipy.special import log_ndtr

    near = points.distance <= points.distance.min() + FAR
    centre = points.u[near]
    logs = log_ndtr(-points.distance[near])
    weight = np.exp(logs - logs.max())
    weight = np.maximum(weight / weight.sum(), SMALLEST)
    return Mixture(
        weight / weight.sum(), centre, np.broadcast_to(np.eye(centre.shape[1]), (*centre.shape, centre.shape[1]))
    )


def _weights(mixture: Mixture, u: Floats) -> Floats:
    """Standard normal density over that of the mixture, shape (n,)."""
    logs = mixture.logs(u)
    most = logs.max(axis=0, initial=-np.inf)
    return np.asarray(np.exp(-0.5 * (u * u).sum(axis=0) - most) / np.exp(logs - most).sum(axis=0))


def _learned(problem: Problem, fixed: Mixture, rng: np.random.Generator) -> Mixture:
    """The mixture nearest to the failures, beside the fixed one: one step of expectation and maximisation a round."""
    mixture, parts = fixed, fixed
    count = max(LEAST, SAMPLES * problem.dimension)
    seen, known = [], []
    for _ in range(ROUNDS):
        u = mixture.draw(rng, count)
        u = u[:, failed(problem.margins(u))]
        seen.append(u)
        known.append(_weights(mixture, u))
        learned = _fitted(parts, np.concatenate(seen, axis=1), np.concatenate(known))
        if learned is not None:
            parts = learned
            mixture = Mixture(
                np.concatenate([FIXED * fixed.weight, (1 - FIXED) * parts.weight]),
                np.concatenate([fixed.centre, parts.centre]),
                np.concatenate([fixed.root, parts.root]),
            )
    return mixture


def _fitted(parts: Mixture, u: Floats, weights: Floats) -> Mixture | None:
    """Parts with the means and covariances of the failures that are theirs; None where there are too few."""
    logs = parts.logs(u)
    share = np.exp(logs - logs.max(axis=0, initial=-np.inf))
    share *= weights / share.sum(axis=0)
    d = len(u)
    weight, centres, roots = [], [], []
    for own in share:
        mass = float(own.sum())
        if not mass > SMALLEST * weights.sum():
            continue
        effective = mass**2 / float((own * own).sum())
        centre = u @ own / mass
        apart = u - centre[:, None]
        covariance = (own * apart) @ apart.T / mass
        prior = PRIOR * d
        covariance = (effective * covariance + prior * np.eye(d)) / (effective + prior)
        weight.append(mass)
        centres.append(centre)
        roots.append(np.linalg.cholesky(covariance))
    if not weight:
        return None
    return Mixture(np.array(weight) / sum(weight), np.array(centres), np.array(roots))
