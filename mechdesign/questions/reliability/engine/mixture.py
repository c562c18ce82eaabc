"""Mixtures of densities that points are drawn from: normal ones, and the law itself beyond a distance from the mean.

Directions (`Problem.circles`) have von Mises densities beside them [Mardia & Jupp, Directional Statistics, 2000].
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.problem import LimitStates

# Samples of the law itself, for each dimension, that are added to the samples from which a density is learned.
_PRIOR_SAMPLES = 0.25


@dataclass(frozen=True, eq=False)
class Mixture:
    """Weighted parts, and the law itself where normal variables are farther than `beyond` from their mean.

    Parameters
    ----------
    weight : ndarray, shape (parts,)
        The part beyond has the rest to 1.
    centre : ndarray, shape (parts, normal variables)
    root : ndarray, shape (parts, normal variables, normal variables)
        Cholesky factors of the covariances.
    heading : ndarray, shape (parts, directions, 2)
        Mean directions, with the concentration about them as their length.
    beyond : float
        Distance in standard deviations.
    """

    problem: LimitStates
    weight: Floats
    centre: Floats
    root: Floats
    heading: Floats
    beyond: float

    @property
    def rest(self) -> float:
        """Weight of the part beyond."""
        return max(1.0 - float(self.weight.sum()), 0.0)

    @cached_property
    def inverse(self) -> Floats:
        """Inverse factors."""
        return np.asarray(np.linalg.inv(self.root), dtype=np.float64)

    @cached_property
    def _outside(self) -> float:
        """Probability of the law beyond the distance."""
        d = len(self.problem.normals)
        return float(scipy.special.gammaincc(0.5 * d, 0.5 * self.beyond**2)) if d and self.beyond > 0 else 1.0

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Points, shape (dimension, count)."""
        chosen = rng.choice(len(self.weight) + 1, count, p=np.append(self.weight, self.rest))
        u = self.problem.draw(rng, count)
        normal = u[self.problem.normals]
        far = chosen == len(self.weight)
        if self._outside < 1.0:
            share = self._outside * (1.0 - rng.random(int(far.sum())))
            length = np.sqrt(2.0 * scipy.special.gammainccinv(0.5 * len(normal), share))
            normal[:, far] *= length / np.linalg.norm(normal[:, far], axis=0)
        for k in np.unique(chosen[~far]).tolist():
            own = chosen == k
            normal[:, own] = self.root[k] @ normal[:, own] + self.centre[k][:, None]
            for pair, heading in zip(self.problem.circles, self.heading[k], strict=True):
                angle = rng.vonmises(np.arctan2(heading[1], heading[0]), np.hypot(*heading), int(own.sum()))
                u[np.ix_(pair, own)] = np.cos(angle), np.sin(angle)
        u[self.problem.normals] = normal
        return u

    def logs(self, u: Floats) -> Floats:
        """Logarithms of the parts' weighted densities over that of the law, (parts + 1, n); the part beyond is last."""
        normal, directions = u[self.problem.normals], u[self.problem.circles.ravel()]
        half = 0.5 * (normal * normal).sum(axis=0)
        logs = np.empty((len(self.weight) + 1, u.shape[1]))
        size = np.linalg.norm(self.heading, axis=2)
        constant = np.log(self.weight) - np.log(np.diagonal(self.root, axis1=1, axis2=2)).sum(axis=1)
        constant -= (np.log(scipy.special.i0e(size)) + size).sum(axis=1)
        for k, (row, one) in enumerate(zip(logs, constant, strict=False)):
            z = self.inverse[k] @ normal
            z -= (self.inverse[k] @ self.centre[k])[:, None]
            row[:] = one + half - 0.5 * np.einsum("dn,dn->n", z, z) + self.heading[k].ravel() @ directions
        logs[-1] = np.where(half >= 0.5 * self.beyond**2, np.log(self.rest / self._outside), -np.inf)
        return logs

    def worth(self, u: Floats) -> Floats:
        """Density of the law over that of the mixture, shape (n,)."""
        logs = self.logs(u)
        most = logs.max(axis=0, initial=-np.inf)
        return np.asarray(np.exp(-most) / np.exp(logs - most).sum(axis=0))

    def joined(self, other: Mixture, share: float) -> Mixture:
        """The mixture of both, in which the other has this share."""
        return replace(
            self, weight=np.concatenate([(1 - share) * self.weight, share * other.weight]),
            centre=np.concatenate([self.centre, other.centre]), root=np.concatenate([self.root, other.root]),
            heading=np.concatenate([self.heading, other.heading]),
        )  # fmt: skip

    @property
    def widened(self) -> Mixture:
        """Parts with covariances halfway to that of the law, with which the variance of weights is finite."""
        covariance = 0.5 * (self.root @ self.root.swapaxes(1, 2) + np.eye(self.root.shape[1]))
        return replace(self, root=np.asarray(np.linalg.cholesky(covariance), dtype=np.float64))

    def about(self, u: Floats) -> Mixture:
        """A single part about the point `u`, shape (dimension,), without a part beyond."""
        return replace(
            self, weight=np.ones(1), centre=u[self.problem.normals][None],
            root=np.eye(len(self.problem.normals))[None], heading=u[self.problem.circles][None],
        )  # fmt: skip

    def fitted(self, u: Floats, worth: Floats, least: float) -> Mixture:
        """Parts with the weighted moments of their own points among `u`, shape (dimension, n).

        Parts with less than the share `least` of the weights `worth` are dropped; with many parts, with less than half
        of an equal share.
        """
        logs = self.logs(u)
        share = np.exp(logs - logs.max(axis=0, initial=-np.inf))
        share *= worth / share.sum(axis=0)
        normal, directions = u[self.problem.normals], u[self.problem.circles]
        d, total = len(normal), float(worth.sum())
        weight, centres, roots, headings = [], [], [], []
        least = min(least, 0.5 / len(self.weight))
        for own in share[:-1]:
            mass = float(own.sum())
            if not mass > least * total:
                continue
            effective = mass**2 / float((own * own).sum())
            centre = normal @ own / mass
            apart = normal - centre[:, None]
            covariance = (own * apart) @ apart.T / mass
            prior = _PRIOR_SAMPLES * self.problem.dimension
            covariance = (effective * covariance + prior * np.eye(d)) / (effective + prior)
            weight.append(mass)
            centres.append(centre)
            roots.append(np.linalg.cholesky(_without_chance(covariance, d / effective)))
            headings.append(_heading(directions @ own / (mass * (1.0 + prior / effective))))
        if not weight:
            return self
        # The part beyond keeps the share of the points that are its own.
        kept = 1.0 - float(share[-1].sum()) / total
        return replace(
            self, weight=kept * np.array(weight) / sum(weight), centre=np.array(centres), root=np.array(roots),
            heading=np.array(headings),
        )  # fmt: skip


def _heading(mean: Floats) -> Floats:
    """Headings of the von Mises laws with these mean cosines and sines, shape (directions, 2) [Mardia & Jupp]."""
    size = np.minimum(np.linalg.norm(mean, axis=-1, keepdims=True), 0.999)
    return np.asarray(mean * (2.0 - size**2) / (1.0 - size**2))


def _without_chance(covariance: Floats, ratio: float) -> Floats:
    """The covariance with principal variances of 1 where they differ from 1 by no more than chance.

    `ratio` is the number of dimensions over the number of samples. [Marchenko & Pastur, 1967: the limits of the
    principal variances of standard normal samples.]
    """
    squares, axes = np.linalg.eigh(covariance)
    chance = (squares > max(0.0, 1 - np.sqrt(ratio)) ** 2) & (squares < (1 + np.sqrt(ratio)) ** 2)
    return np.asarray((axes * np.where(chance, 1.0, squares)) @ axes.T)
