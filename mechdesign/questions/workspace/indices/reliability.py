"""Reliability at a pose: the chance that first-order normal errors keep the limits of the reliability section."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Configuration
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
    from mechdesign.questions.reliability.errors import Errors
    from mechdesign.questions.reliability.forces import pace
    from mechdesign.questions.reliability.lengths import model_of
    from mechdesign.questions.reliability.probability import made_failure

    errors = Errors.of(study)
    if not errors.question.limits:
        message = "the index 'reliability' needs limits, for example {P.x: 0.05, P.y: 0.05}"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    # Nothing else needs to be computed.
    question, section = errors.question.narrowed, pace(study)
    if (section.inverse(study.mechanism.drives) or section.motion is not None) and question.moving:
        message = "the index 'reliability' of velocities needs 'rates' of the drives: a path or a motion has none here"
        raise StudyError((study.problem(message, "reliability", "limits"),))
    errors = replace(errors, question=question, forces=errors.forces if question.columns else None)
    rates = constant_rates(study.mechanism, study.units, section, study.mechanism.drives)

    def evaluate(configuration: Configuration) -> Floats:
        nominal, linear, _ = errors.linearized(configuration, rates)
        limits, margins = question.at(nominal).limits, errors.closing(configuration)
        return 1.0 - made_failure(model_of(question, linear, nominal), margins, limits)[0]

    return of_configurations(evaluate)


INDEX = Index(
    "probability that first-order errors keep the limits",
    prepare,
    number,
    bounds=(0.0, 1.0),
    section="reliability",
    source="S2, eqs. 10, 11",
)
