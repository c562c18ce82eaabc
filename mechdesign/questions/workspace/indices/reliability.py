"""Reliability at a pose: the chance that first-order normal errors keep the limits of the reliability section."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Floats
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.workspace.index import Evaluate, Index, number, of_configurations

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """Probability that all limits hold, the drives held [S2, eqs. 10, 11].

    Raises
    ------
    StudyError
        Where nothing is limited, or a velocity whose drives' rates are not known.
    """
    from mechdesign.questions.kinematics.rates import constant_rates
    from mechdesign.questions.reliability.deflection import elasticity
    from mechdesign.questions.reliability.first_order import linear_errors, linear_margins, nominal_values
    from mechdesign.questions.reliability.forces import force_model, pace
    from mechdesign.questions.reliability.lengths import model_of
    from mechdesign.questions.reliability.probability import made_failure
    from mechdesign.questions.reliability.question import ask
    from mechdesign.questions.reliability.study_sources import find_sources

    mechanism, sources = study.mechanism, find_sources(study)[0]
    question = ask(study, ReliabilitySection.of(study))
    if not question.limited:
        message = "the index 'reliability' needs limits, for example {P.x: 0.05, P.y: 0.05}"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    # Nothing else needs to be computed.
    question, section = question.narrowed, pace(study)
    rates = constant_rates(mechanism, study.units, section, mechanism.drives)
    forces = force_model(study) if question.columns else None
    if (section.inverse(study.mechanism.drives) or section.motion is not None) and question.moving:
        message = "the index 'reliability' of velocities needs 'rates' of the drives: a path or a motion has none here"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    bent = elasticity(study)[0]

    def evaluate(configuration: Configuration) -> Floats:
        elastic = None if bent is None else bent.at(configuration, question.whole)
        linear = linear_errors(mechanism, configuration, question.whole, sources, rates, elastic, forces)
        nominal = np.stack(np.broadcast_arrays(
            *nominal_values(mechanism, configuration, question.whole, rates, forces), linear.offset[0]
        )[:-1])  # fmt: skip
        linear = model_of(question, linear, nominal)
        bands = question.at(nominal).bands
        margins = linear_margins(mechanism, configuration, sources)
        return 1.0 - made_failure(linear, margins, bands, question.discs)[0]

    return of_configurations(evaluate)


INDEX = Index(
    "probability that first-order errors keep the limits",
    prepare,
    number,
    bounds=(0.0, 1.0),
    section="reliability",
    source="S2, eqs. 10, 11",
)
