"""Corners of the expressions of a question along its motions: of measures, loads and targets."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.coordinates import Coordinate, corners_of, expressions_of
from mechdesign.mechanism.forces import Moving
from mechdesign.motion.corners import Variables, divide, switched
from mechdesign.motion.curve import Curve
from mechdesign.motion.series import Evaluate
from mechdesign.questions.kinematics import targets as targeted
from mechdesign.questions.kinematics.moved import MovedQuestion
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.loads import corners_in, variable
from mechdesign.study import Study
from mechdesign.study.schema.loads import VELOCITY
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.schema.targets import Target


def divided(question: MovedQuestion, curve: Curve, *, errors: bool) -> Curve:
    """The curve of a question with pieces on which its measures, its loads and, for errors, its targets are smooth."""
    study, loads = question.study, question.loads
    targets = study.targets.values() if errors else ()
    expressions = expressions_of(question.evaluated)
    corners = [*corners_of(expressions.values()), *corners_in(loads)]
    written = [target.expression for target in targets if target.expression is not None]
    corners += [corner for expression in written for corner in expression.corners()]
    corners += [corner for target in targets for corner in targeted.knots(study, target, question.poses)]

    divided, _, _ = divide(curve, corners, variables_of(study, question.section, curve, expressions))
    for target in targets:
        if targeted.path(target, question.poses):
            divided = switched(divided, partial(_side, question, curve, target))
    return switched(divided, partial(_sign, study, curve)) if question.passes_singularities else divided


def variables_of(
    study: Study, section: MotionSection, curve: Curve, expressions: Mapping[str, Coordinate]
) -> Variables:
    """Variables of these expressions, and of loads, along a curve whose rates a section gives."""

    def variables(names: frozenset[str], line: Ints, s: Floats) -> Mapping[str, ArrayLike]:
        there = curve.solve(line, s, judged=False)
        configuration = there.configuration
        moving = Moving()
        if any(name.endswith(VELOCITY) for name in names):
            moving = moving_at(section, there, study.mechanism.linearize(configuration))
        parts = {name: value for one in expressions.values() for name, value in configuration.user_values(one).items()}
        return {
            name: parts[name] if name in parts else variable(study, name, there.poses, configuration, moving)
            for name in names
        }

    return variables


def _sign(study: Study, curve: Curve, line: Ints, s: Floats) -> Ints:
    """1 where the determinant of the loop equations is positive."""
    return np.asarray(determinant(study, curve)(line, s)[0][0] > 0, dtype=np.intp)


def determinant(study: Study, curve: Curve) -> Evaluate:
    """Determinant of the loop equations along motions, zero where the drives hold the mechanism no longer."""

    def evaluate(line: Ints, s: Floats) -> tuple[Floats, Floats]:
        linear = study.mechanism.linearize(curve.solve(line, s, judged=False, turning=False).configuration)
        signed = np.broadcast_arrays(np.ones(len(s)), *linear.conditionings.values())
        return np.prod(signed, axis=0)[None], np.ones(len(s))

    return evaluate


def _side(question: MovedQuestion, curve: Curve, target: Target, line: Ints, s: Floats) -> Ints:
    """Side or corner of the path that a point should follow that is nearest to it."""
    configuration = curve.solve(line, s, judged=False, turning=False).configuration
    x, y = (configuration.value(question.study.mechanism.coordinate(name)) for name in target.coordinates)
    return targeted.owner(target, question.poses, np.asarray(x + 1j * np.asarray(y)), line)
