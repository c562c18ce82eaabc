"""Reliability at a pose: the chance that first-order normal errors keep the limits of the reliability section."""

from __future__ import annotations

from functools import partial

from mechdesign.analyses.kinematics.rates import DriveRates, constant_rates, of_given
from mechdesign.analyses.reliability.deflection import Elasticity, elasticity
from mechdesign.analyses.reliability.first_order import linear_errors
from mechdesign.analyses.reliability.probability import failure_probability
from mechdesign.analyses.reliability.question import Question, ask
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.workspace.indices.assembled import assembled_only
from mechdesign.analyses.workspace.indices.index import Evaluate, Index, number
from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.numerics.arrays import Floats
from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """Find what varies and what it is limited to."""
    sources = find_sources(study)[0]
    assert study.reliability is not None
    question = ask(study, study.reliability)
    if not question.limited:
        message = "the index 'reliability' needs limits, for example {P.x: 0.05, P.y: 0.05}"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    # Nothing else needs to be computed.
    question, rates = question.narrowed, constant_rates(study, study.reliability, study.mechanism.drives)
    if of_given(study, study.reliability) and any(channel.order for channel in question.channels):
        message = "the index 'reliability' of velocities needs rates of the drives: those of a path are not known here"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    return assembled_only(partial(evaluate, study.mechanism, question, rates, sources, elasticity(study)[0]))


def evaluate(
    mechanism: Mechanism,
    question: Question,
    rates: DriveRates,
    sources: Sources,
    bent: Elasticity | None,
    configuration: Configuration,
) -> Floats:
    """Probability that all limits hold, the drives held [S2, eqs. 10, 11]."""
    elastic = None if bent is None else bent.at(configuration, question.channels)
    linear = linear_errors(mechanism, configuration, question.channels, sources, rates, elastic)
    covariance, mean = linear.covariance(), linear.shift()
    return 1.0 - failure_probability(covariance, question.bands, question.discs, mean.T)


INDEX = Index(
    "reliability", "probability that first-order errors keep the limits", prepare, number, bounds=(0.0, 1.0),
    section="reliability",
)  # fmt: skip
