"""Reliability at a pose: the chance that first-order normal errors keep the limits of the reliability section."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdesign.analyses.workspace.index import Evaluate, Index, number, of_configurations
from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Floats

if TYPE_CHECKING:
    from mechdesign.analyses.reliability.error_limits import Band
    from mechdesign.study import Study

# Standard deviations beyond which nothing counts, and nodes between there and here.
FAR = 7.0
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
# Below this sqrt(1 - rho^2) the integrand is too steep for the nodes.
DEPENDENT = 0.5


def prepare(study: Study) -> Evaluate:
    """Probability that all limits hold, the drives held [S2, eqs. 10, 11].

    Raises
    ------
    StudyError
        Where nothing is limited, or a velocity whose drives' rates are not known.
    """
    from mechdesign.analyses.reliability.deflection import elasticity
    from mechdesign.analyses.reliability.first_order import Rates, linear_errors
    from mechdesign.analyses.reliability.probability import failure_probability
    from mechdesign.analyses.reliability.question import ask, constant_rates
    from mechdesign.analyses.reliability.sources import find_sources

    assert study.reliability is not None
    mechanism, sources = study.mechanism, find_sources(study)[0]
    question = ask(study, study.reliability)
    if not question.limited:
        message = "the index 'reliability' needs limits, for example {P.x: 0.05, P.y: 0.05}"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    known = constant_rates(study, study.reliability)
    limited = {band.output for band in question.bands} | {part for disc in question.discs for part in (disc.x, disc.y)}
    if known is None and any(question.channels[k].order for k in limited):
        message = "the index 'reliability' of velocities needs rates of the drives: those of a path are not known here"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    # Where only positions are limited, rates do not matter.
    rates = known or Rates((0.0,) * len(mechanism.drives), (0.0,) * len(mechanism.drives))
    bent = elasticity(study)[0]

    def evaluate(configuration: Configuration) -> Floats:
        elastic = None if bent is None else bent.at(configuration, question.channels)
        linear = linear_errors(mechanism, configuration, question.channels, sources, rates, elastic)
        covariance, mean = linear.covariance(), linear.shift()
        if len(question.bands) == 2 and not question.discs and not mean.any():
            return _rectangle(question.bands[0], question.bands[1], covariance)
        return 1 - np.array([
            failure_probability(each, question.bands, question.discs, shift)
            for each, shift in zip(covariance, mean.T, strict=True)
        ])  # fmt: skip

    return of_configurations(evaluate)


def _rectangle(one: Band, two: Band, covariance: Floats) -> Floats:
    """Of two limited errors, for all poses at once, to about 1e-9; nearly dependent errors one by one."""
    from scipy.special import ndtr

    from mechdesign.analyses.reliability.probability import failure_probability

    a, b, both = (covariance[:, i, j] for i, j in ((one.output,) * 2, (two.output,) * 2, (one.output, two.output)))
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = np.sqrt(a), np.sqrt(b)
        rho = both / (s * t)
        rest = np.sqrt(1 - rho * rho)
        low, high = np.clip(one.low / s, -FAR, FAR), np.clip(one.high / s, -FAR, FAR)
        half = 0.5 * (high - low)
        x = low + half * (1 + NODES[:, None])
        inside = ndtr((two.high / t - rho * x) / rest) - ndtr((two.low / t - rho * x) / rest)
        found = half * (WEIGHTS @ (np.exp(-0.5 * x * x) * inside)) / np.sqrt(2 * np.pi)
    for k in np.flatnonzero(~(rest > DEPENDENT) | ~(half > 0)):
        found[k] = 1 - failure_probability(covariance[k], (one, two), ())
    return np.asarray(np.clip(found, 0.0, 1.0))


INDEX = Index(
    "probability that first-order errors keep the limits", prepare, number, bounds=(0.0, 1.0), section="reliability"
)
