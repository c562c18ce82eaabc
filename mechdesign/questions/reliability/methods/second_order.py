"""Errors to the second order: the shift of the mean, and the variance with it.

error = f0 + a z + z H z / 2 for deviations z of all that varies; mean and covariance follow from the cumulants of z.
[Mandel, The statistical analysis of experimental data, 1964; McCullagh, Tensor methods in statistics, 1987.]
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.reliability.copula import JointMoments
from mechdesign.questions.reliability.laws import Normal
from mechdesign.questions.reliability.methods import of_moments
from mechdesign.questions.reliability.simulation import Setting, errors_of
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.task import MethodResult, Task

# Longest step of the differences, as a part of the mechanism's size or in radians: the fourth root of the rounding
# error, at which a second derivative has about seven digits.
_LONGEST = 1e-4
# Shortest step, in the same units. With small tolerances the second order is small, and fewer digits suffice.
_SHORTEST = 1e-6
# Step between these limits, in standard deviations.
_PART = 0.3


@dataclass(frozen=True, eq=False)
class Cumulants:
    """Joint cumulants of the components: the scalars, then x and y of each pin's offset.

    `third` and `fourth` list those that are not zero: components, shape (terms, order), and values. Each permutation of
    different components is a term of its own.
    """

    mean: Floats
    covariance: Floats
    third: tuple[Ints, Floats]
    fourth: tuple[Ints, Floats]


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Errors of all channels as quadratic functions of the components; arrays of shape (channels, ...)."""

    value: Floats
    gradient: Floats
    hessian: Floats

    def moments(self, law: Cumulants) -> tuple[Floats, Floats]:
        """Mean, shape (channels,), and covariance, shape (channels, channels); exact for quadratic functions."""
        bent = self.hessian @ law.mean
        slope = self.gradient + bent
        weighted = self.hessian @ law.covariance
        mean = self.value + (self.gradient + 0.5 * bent) @ law.mean + 0.5 * np.trace(weighted, axis1=1, axis2=2)
        covariance = slope @ law.covariance @ slope.T + 0.5 * np.einsum("cij,dji->cd", weighted, weighted)
        (i, j, k), value = law.third[0].T, law.third[1]
        mixed = 0.5 * np.einsum("ct,dt,t->cd", slope[:, i], self.hessian[:, j, k], value)
        (i, j, k, other), value = law.fourth[0].T, law.fourth[1]
        flat = 0.25 * np.einsum("ct,dt,t->cd", self.hessian[:, i, j], self.hessian[:, k, other], value)
        return mean, covariance + mixed + mixed.T + flat


def run(task: Task) -> MethodResult:
    """Normal errors of the quadratic model's mean and covariance at every pose."""
    law = cumulants(task.sources)
    steps = step_sizes(task.sources, np.sqrt(np.diagonal(law.covariance)))
    return of_moments(task, partial(_at_pose, steps, law))


def _at_pose(steps: Floats, law: Cumulants, task: Task, setting: Setting) -> tuple[Floats, Floats]:
    question, count = setting.question, len(task.question.channels)
    # Components of lengths are smooth; their moments are of values, not of errors.
    smooth = replace(question, channels=question.whole)
    elastic = None if task.elastic is None else task.elastic.take([setting.pose]).of(question.whole, smooth.vectors)
    centres = [*setting.centres, *[0.0] * (len(question.whole) - count)]
    whole = replace(setting, question=smooth, centres=centres, elastic=elastic)
    mean, covariance = quadratic(whole, task.sources, steps).moments(law)
    rows = np.array(question.rows)
    mean, covariance = mean[rows], covariance[np.ix_(rows, rows)]
    mean[rows < 0] = covariance[rows < 0] = covariance[:, rows < 0] = 0.0
    # Without a first order there is no second one.
    lost = np.flatnonzero(np.isnan(task.linear.whole.components[:, :, setting.pose]).any(axis=1))
    mean[lost] = covariance[lost] = covariance[:, lost] = np.nan
    return mean, covariance


def quadratic(setting: Setting, sources: Sources, steps: Floats) -> Quadratic:
    """Second differences of the exact errors, of `steps` (components,); nan where a mechanism is not assembled."""
    count = len(steps)
    i, j = np.triu_indices(count, 1)
    single, pairs = np.diag(steps), np.zeros((count, len(i)))
    places = np.arange(len(i))
    pairs[i, places], pairs[j, places] = steps[i], steps[j]
    z = np.concatenate([np.zeros((count, 1)), single, -single, pairs, -pairs], axis=1)
    # Each pin gets a radial clearance of 1, so that its components are its place.
    drawn = np.insert(z, range(len(sources.scalars), count, 2), 1.0, axis=0)
    errors, valid = errors_of(setting, sources.made(drawn), z.shape[1])
    values = np.where(valid, errors, np.nan)
    value, ahead, back, both_ahead, both_back = np.split(values, np.cumsum([1, count, count, len(i)]), axis=1)
    hessian = np.empty((len(values), count, count))
    diagonal = np.arange(count)
    hessian[:, diagonal, diagonal] = (ahead + back - 2.0 * value) / steps**2
    alone = ahead[:, i] + back[:, i] + ahead[:, j] + back[:, j]
    hessian[:, i, j] = (both_ahead + both_back + 2.0 * value - alone) / (2.0 * steps[i] * steps[j])
    hessian[:, j, i] = hessian[:, i, j]
    return Quadratic(value[:, 0], (ahead - back) / (2.0 * steps), hessian)


def step_sizes(sources: Sources, sigma: Floats) -> Floats:
    """Step of each component, from its standard deviation `sigma` and from how far it moves the mechanism."""
    length, places = sources.study.mechanism.size, sources.study.mechanism.description.places
    scale = np.full(len(sigma), length)
    for k, scalar in enumerate(sources.scalars):
        reach = [(1.0 if quantity == "angle" else length) / abs(float(slope))
                 for slope, quantity in scalar.moves.values() if slope]  # fmt: skip
        scale[k] = min(reach, default=1.0)
    for k, pin in enumerate(sources.pins):
        first = len(sources.scalars) + 2 * k
        # The end of a slider moves its offset, and turns it by 1/length; the play of gears turns one of them.
        turns = [abs(float(slope)) for place, slope in pin.directions[0].items()
                 if place in places and places[place].quantity == "angle"]  # fmt: skip
        scale[first : first + 2] = min([length, *(1.0 / turn for turn in turns)])
    steps = np.clip(_PART * sigma, _SHORTEST * scale, _LONGEST * scale)
    # Deflections are linear in the loads, and the longest step leaves the least rounding.
    loads = [k for k, scalar in enumerate(sources.scalars) if scalar.kind == "load"]
    steps[loads] = np.where(sigma[loads] > 0, sigma[loads], 1.0)
    return steps


def cumulants(sources: Sources) -> Cumulants:
    """Cumulants with the pins' laws of the analytic method.

    A clearance's radius R multiplies the place for a unit clearance (x, y) of its pin or slider: E[(R x)^2] =
    E[R^2] E[x^2], E[(R x)^4] = E[R^4] E[x^4], E[R^4 x^2 y^2] = E[R^4] E[x^2 y^2], and all odd moments are zero. Joint
    cumulants of two correlated dimensions that are not normal are included, those of three or four are neglected.
    """
    laws = [[float(moment) for moment in scalar.law.moments] for scalar in sources.scalars]
    count = len(laws)
    size = count + 2 * len(sources.pins)
    mean, covariance = np.zeros(size), np.zeros((size, size))
    third: dict[tuple[int, ...], float] = {}
    fourth: dict[tuple[int, ...], float] = {}
    for k, (middle, second, skew, flat) in enumerate(laws):
        mean[k], covariance[k, k] = middle, second
        third[k, k, k] = skew
        fourth[k, k, k, k] = flat - 3.0 * second**2
    if sources.correlation is not None:
        sigma = np.sqrt(np.diagonal(covariance)[:count])
        covariance[:count, :count] = sources.correlation.coefficients * np.outer(sigma, sigma)
        for places, value in _of_pairs(sources, covariance):
            (third if len(places) == 3 else fourth)[places] = value
    for k, pin in enumerate(sources.pins):
        law, (radius, second, skew, flat) = pin.laws[pin.analytic], map(float, pin.moments)
        squared = law.variance * (radius**2 + second)
        power = radius**4 + 6.0 * radius**2 * second + 4.0 * radius * skew + flat
        x, y = count + 2 * k, count + 2 * k + 1
        covariance[x, x] = covariance[y, y] = squared
        fourth[x, x, x, x] = fourth[y, y, y, y] = law.fourth * power - 3.0 * squared**2
        fourth[x, x, y, y] = law.mixed * power - squared**2
    return Cumulants(mean, covariance, _terms(third, 3), _terms(fourth, 4))


def _of_pairs(sources: Sources, covariance: Floats) -> Iterator[tuple[tuple[int, ...], float]]:
    assert sources.correlation is not None
    behind = sources.correlation.root @ sources.correlation.root.T
    laws = [scalar.law for scalar in sources.scalars]
    for i, j in np.argwhere(np.triu(sources.correlation.coefficients, 1)).tolist():
        if isinstance(laws[i], Normal) and isinstance(laws[j], Normal):
            continue
        moments, rho = JointMoments(laws[i], laws[j], 3), float(behind[i, j])
        a, b, c = covariance[i, i], covariance[j, j], covariance[i, j]
        yield (i, i, j), moments.at(rho, 2, 1)
        yield (i, j, j), moments.at(rho, 1, 2)
        yield (i, i, i, j), moments.at(rho, 3, 1) - 3.0 * a * c
        yield (i, i, j, j), moments.at(rho, 2, 2) - a * b - 2.0 * c * c
        yield (i, j, j, j), moments.at(rho, 1, 3) - 3.0 * b * c


def _terms(coefficients: dict[tuple[int, ...], float], order: int) -> tuple[Ints, Floats]:
    terms = [
        (permutation, value)
        for places, value in coefficients.items()
        if value
        for permutation in sorted(set(permutations(places)))
    ]
    index = np.array([components for components, _ in terms], dtype=np.intp).reshape(-1, order)
    return index, np.array([value for _, value in terms], dtype=float)
