"""Reliability at a pose: the chance that first-order normal errors keep the limits of the reliability section."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

from mechdesign.analyses.reliability.deflection import Elasticity, elasticity
from mechdesign.analyses.reliability.error_limits import Band
from mechdesign.analyses.reliability.first_order import Rates, linear_errors
from mechdesign.analyses.reliability.probability import failure_probability
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.workspace.indices.assembled import assembled_only
from mechdesign.analyses.workspace.indices.index import Evaluate, Index, number
from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.numerics.arrays import Floats

if TYPE_CHECKING:
    from mechdesign.analyses.reliability.question import Question
    from mechdesign.study import Study

# Standard deviations beyond which nothing counts, and nodes between there and here.
FAR = 7.0
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
# Below this sqrt(1 - rho^2) the integrand is too steep for the nodes.
DEPENDENT = 0.5


def prepare(study: Study) -> Evaluate:
    """Find what varies and what it is limited to."""
    # Here, for the poses of a reliability question may themselves be nodes of a workspace.
    from mechdesign.analyses.reliability.question import ask, constant_rates

    sources = find_sources(study)[0]
    assert study.reliability is not None
    question = ask(study, study.reliability)
    if not question.limited:
        message = "the index 'reliability' needs limits, for example {P.x: 0.05, P.y: 0.05}"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    rates = constant_rates(study, study.reliability)
    limited = {band.output for band in question.bands} | {part for disc in question.discs for part in (disc.x, disc.y)}
    if rates is None and any(question.channels[k].order for k in limited):
        message = "the index 'reliability' of velocities needs rates of the drives: those of a path are not known here"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    # Where only positions are limited, rates do not matter.
    rates = rates or Rates((0.0,) * len(study.mechanism.drives), (0.0,) * len(study.mechanism.drives))
    return assembled_only(partial(evaluate, study.mechanism, question, rates, sources, elasticity(study)[0]))


def evaluate(
    mechanism: Mechanism,
    question: Question,
    rates: Rates,
    sources: Sources,
    bent: Elasticity | None,
    configuration: Configuration,
) -> Floats:
    """Probability that all limits hold, the drives held [S2, eqs. 10, 11]."""
    elastic = None if bent is None else bent.at(configuration, question.channels)
    linear = linear_errors(mechanism, configuration, question.channels, sources, rates, elastic)
    covariance, mean = linear.covariance(), linear.shift()
    if len(question.bands) == 2 and not question.discs and not mean.any():
        return _rectangle(question.bands[0], question.bands[1], covariance)
    return 1 - np.array([
        failure_probability(each, question.bands, question.discs, shift)
        for each, shift in zip(covariance, mean.T, strict=True)
    ])  # fmt: skip


def _rectangle(one: Band, two: Band, covariance: Floats) -> Floats:
    """Of two limited errors, for all poses at once, to about 1e-9; nearly dependent errors one by one."""
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
    "reliability", "probability that first-order errors keep the limits", prepare, number, bounds=(0.0, 1.0),
    section="reliability",
)  # fmt: skip
