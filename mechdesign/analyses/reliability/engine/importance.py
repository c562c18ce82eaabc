"""Importance sampling about the design points, by a mixture of normal densities that learns where failures lie.

[Melchers, Search-based importance sampling, 1990; Kurtz & Song, Cross-entropy-based adaptive importance sampling using
Gaussian mixture, 2013; the part that never changes bounds the weights as in Owen & Zhou, Safe and effective importance
sampling, 2000.]
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import EXPLORED, MOST, DesignPoints, explored_weights
from mechdesign.analyses.reliability.engine.intervals import weighted
from mechdesign.analyses.reliability.engine.precision import Precision
from mechdesign.analyses.reliability.engine.problem import Estimate, Floats, Problem, failed

# Points farther than the nearest one by this many standard deviations bring nothing.
FAR = 4.0
# Rounds of learning, and their samples a dimension and at least. All rounds' failures are learned from together.
ROUNDS, SAMPLES, LEAST = 6, 40, 1600
# Learned enough where the relative variance of a round's weights is below this.
GOOD = 2.0
# A part more, of this weight, where a failure adds so much to that variance and lacks so many times its samples; before
# the first round where explored failures are worth so many.
ADDED, LACKING, MANY = 0.05, (0.1, 10.0), 5
# Share of the samples that stay with the design points, and with the least of them.
FIXED, SMALLEST = 0.1, 0.02
# A learned covariance is what it would be if so many samples a dimension of the standard normal law had been seen too.
PRIOR = 0.25
# First samples of the value, by which the rest is planned; so much more than what they ask for.
FIRST, MARGIN = 2000, 1.1
BLOCK = 20_000
# Beyond any density that counts, and the logarithm of such a one.
TINY, MUCH = 1e-200, 600.0


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

    @cached_property
    def inverse(self) -> Floats:
        """Inverse factors."""
        return np.asarray(np.linalg.inv(self.root), dtype=np.float64)

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
        found = np.empty((len(self.weight), u.shape[1]))
        constant = np.log(self.weight) - np.log(np.diagonal(self.root, axis1=1, axis2=2)).sum(axis=1)
        for row, one, inverse, centre in zip(found, constant, self.inverse, self.centre, strict=True):
            z = inverse @ u
            z -= (inverse @ centre)[:, None]
            row[:] = one - 0.5 * np.einsum("dn,dn->n", z, z)
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
    mixture = _learned(problem, points, rng)
    total = squares = most = 0.0
    done = failures = invalid = 0
    wanted = samples if precision is None else min(FIRST, samples)
    while done < wanted:
        count = min(BLOCK, wanted - done)
        u = mixture.draw(rng, count)
        margins = problem.margins(u)
        broken = failed(margins)
        weights = _weights(mixture, u[:, broken])
        total, squares = total + float(weights.sum()), squares + float(weights @ weights)
        most = max(most, float(weights.max(initial=0.0)))
        done, failures = done + count, failures + int(broken.sum())
        invalid += int(np.isnan(margins).any(axis=0).sum())
        if done == wanted < samples and precision is not None and total > 0:
            mean = total / done
            if not precision.reached(mean, *weighted(total, squares, most, done)):
                more = MARGIN * precision.needed(mean, squares / done - mean * mean)
                wanted = int(min(samples, max(1.2 * done, more)))
    low, high = weighted(total, squares, most, done)
    # Weights are 1 on the average only.
    return Estimate(min(total / done, 1.0), low, high, problem.evaluations, done, failures, invalid)


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


def _learned(problem: Problem, points: DesignPoints, rng: np.random.Generator) -> Mixture:
    """The mixture nearest to the failures, beside the fixed one: one step of expectation and maximisation a round."""
    fixed = _about(points)
    parts, explored = fixed, explored_weights(points.seen)
    # Where many of them count, the samples that starts were taken from know of places without a design point.
    if float(explored.sum()) ** 2 > MANY * float(explored @ explored):
        parts = _covering(fixed, parts, points.seen, explored, EXPLORED)
    count = max(LEAST, SAMPLES * problem.dimension)
    seen, known = [], []
    for rounds in range(1, ROUNDS + 1):
        mixture = _beside(fixed, parts)
        u = mixture.draw(rng, count)
        u = u[:, failed(problem.margins(u))]
        weights = _weights(mixture, u)
        seen.append(u)
        known.append(weights)
        failures, worth = np.concatenate(seen, axis=1), np.concatenate(known)
        parts = _covering(fixed, _fitted(parts, failures, worth), failures, worth, rounds * count)
        if count * float(weights @ weights) < (1.0 + GOOD) * float(weights.sum()) ** 2:
            break
    return _beside(fixed, parts)


def _covering(fixed: Mixture, parts: Mixture, u: Floats, worth: Floats, drawn: int) -> Mixture:
    """`parts`, and more of them where failures are that both mixtures have far too few samples of.

    Parameters
    ----------
    u : ndarray, shape (dimension, n)
        Failures that were seen among `drawn` samples.
    worth : ndarray, shape (n,)
        Their weights when they were drawn.
    """
    total = float(worth.sum())
    if not total > 0:
        return parts
    half = 0.5 * (u * u).sum(axis=0)
    held, own = (np.exp(np.minimum(each.logs(u) + half, MUCH)).sum(axis=0) for each in (fixed, parts))
    while len(parts.weight) < MOST:
        # Density of failures over that of the mixture: its mean over failures is 1 and the weights' relative variance.
        lack = drawn / (total * np.maximum(FIXED * held + (1 - FIXED) * own, TINY))
        adds = lack * worth / total
        worst = int(np.argmax(adds))
        if adds[worst] < LACKING[0] or lack[worst] < LACKING[1]:
            break
        part = Mixture(np.array([ADDED]), u[:, worst][None], np.eye(len(u))[None])
        own = (1 - ADDED) * own + np.exp(np.minimum(part.logs(u)[0] + half, MUCH))
        parts = Mixture(
            np.append((1 - ADDED) * parts.weight, part.weight),
            np.concatenate([parts.centre, part.centre]),
            np.concatenate([parts.root, part.root]),
        )
    return parts


def _beside(fixed: Mixture, parts: Mixture) -> Mixture:
    return Mixture(
        np.concatenate([FIXED * fixed.weight, (1 - FIXED) * parts.weight]),
        np.concatenate([fixed.centre, parts.centre]),
        np.concatenate([fixed.root, parts.root]),
    )


def _fitted(parts: Mixture, u: Floats, weights: Floats) -> Mixture:
    """Parts with the means and covariances of the failures that are theirs; as they were where none failed."""
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
        roots.append(np.linalg.cholesky(_without_chance(covariance, d / effective)))
    if not weight:
        return parts
    return Mixture(np.array(weight) / sum(weight), np.array(centres), np.array(roots))


def _without_chance(covariance: Floats, ratio: float) -> Floats:
    """Principal variances 1 where so few samples a dimension (`ratio` is one over it) may show what they do by chance.

    [Marchenko & Pastur, 1967: the limits of the principal variances of standard normal samples.]
    """
    squares, axes = np.linalg.eigh(covariance)
    chance = (squares > max(0.0, 1 - np.sqrt(ratio)) ** 2) & (squares < (1 + np.sqrt(ratio)) ** 2)
    return np.asarray((axes * np.where(chance, 1.0, squares)) @ axes.T)
