"""Errors to the second order: the shift of the mean, and the variance with it.

error = f0 + a z + z H z / 2 for deviations z of all that varies; mean and covariance follow from the cumulants of z.
[Mandel, The statistical analysis of experimental data, 1964; McCullagh, Tensor methods in statistics, 1987.]
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.reliability.cumulants import Cumulants, cumulants
from mechdesign.analyses.reliability.methods import normal
from mechdesign.analyses.reliability.simulation import Setting, errors_of
from mechdesign.analyses.reliability.sources import Drawn, Sources
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import map_chunks

# Longest and shortest steps of the differences, as a part of the mechanism's size or in radians, and between them as a
# part of the standard deviation: the longest is the fourth root of rounding, at which a second derivative has about
# seven digits; what is made finely is often small itself, so that a shorter step is needed, and fewer digits count.
_LONGEST, _SHORTEST, _PART = 1e-4, 1e-6, 0.3


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Errors of all channels as quadratic functions of the components that vary.

    Parameters
    ----------
    value : ndarray, shape (channels,)
    gradient : ndarray, shape (channels, components)
    hessian : ndarray, shape (channels, components, components)
    """

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
    mean = np.full(task.nominal.shape, np.nan)
    covariance = np.full((task.poses.count, len(mean), len(mean)), np.nan)

    def work(setting: Setting) -> tuple[Floats, Floats]:
        return quadratic(setting, task.sources, steps).moments(law)

    task.progress.start(len(task.settings), "poses")
    for setting, (middle, spread) in zip(task.settings, map_chunks(work, task.settings, task.jobs), strict=True):
        mean[:, setting.pose], covariance[setting.pose] = middle, spread
        task.progress.update(1)
    return normal("second_order", task, mean, covariance)


def quadratic(setting: Setting, sources: Sources, steps: Floats) -> Quadratic:
    """Second differences of the exact errors of mechanisms made beside the nominal one; nan where one is not assembled.

    Parameters
    ----------
    steps : ndarray, shape (components,)
    """
    count = len(steps)
    i, j = np.triu_indices(count, 1)
    single, pairs = np.diag(steps), np.zeros((count, len(i)))
    places = np.arange(len(i))
    pairs[i, places], pairs[j, places] = steps[i], steps[j]
    z = np.concatenate([np.zeros((count, 1)), single, -single, pairs, -pairs], axis=1)
    errors, valid = errors_of(setting, sources.made(_drawn(sources, z)), z.shape[1])
    found = np.where(valid, errors, np.nan)
    ends = np.cumsum([1, count, count, len(i)])
    value, ahead, back, both_ahead, both_back = np.split(found, ends, axis=1)
    hessian = np.empty((len(found), count, count))
    diagonal = np.arange(count)
    hessian[:, diagonal, diagonal] = (ahead + back - 2.0 * value) / steps**2
    alone = ahead[:, i] + back[:, i] + ahead[:, j] + back[:, j]
    hessian[:, i, j] = (both_ahead + both_back + 2.0 * value - alone) / (2.0 * steps[i] * steps[j])
    hessian[:, j, i] = hessian[:, i, j]
    return Quadratic(value[:, 0], (ahead - back) / (2.0 * steps), hessian)


def step_sizes(sources: Sources, sigma: Floats) -> Floats:
    """Step of each component, from its standard deviation and from how far it moves the mechanism."""
    length = sources.study.mechanism.size or 1.0
    scale = np.full(len(sigma), length)
    for k, scalar in enumerate(sources.scalars):
        reach = [(1.0 if quantity == "angle" else length) / abs(slope)
                 for slope, quantity in scalar.moves.values() if slope]  # fmt: skip
        scale[k] = min(reach, default=1.0)
    steps = np.clip(_PART * sigma, _SHORTEST * scale, _LONGEST * scale)
    # Deflections are linear in the loads, and the longest step leaves the least rounding.
    loads = [k for k, scalar in enumerate(sources.scalars) if scalar.kind == "load"]
    steps[loads] = np.where(sigma[loads] > 0, sigma[loads], 1.0)
    return steps


def _drawn(sources: Sources, z: Floats) -> Drawn:
    count = len(sources.scalars)
    pins = z[count:].reshape(-1, 2, z.shape[1])
    return Drawn(list(z[:count]), [1.0] * len(pins), [(x, y) for x, y in pins])
