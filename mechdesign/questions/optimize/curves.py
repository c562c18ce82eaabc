"""Designs with which a search begins where the path of a point shall pass the points of a curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.family.goals import Goal
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.optimize.variables import variables_of
from mechdesign.questions.synthesize.bounds import RangeBounds
from mechdesign.questions.synthesize.own import OwnKind
from mechdesign.questions.synthesize.paths import MOST_EXACT, PathPoints, fits, starts
from mechdesign.study import Study

# Linkages that are sampled, those whose curves are polished, and the best of these with which a search begins.
_SAMPLED, _POLISHED, _BEST = 8000, 250, 16


def near_curves(study: Study, goals: Sequence[Goal], conditions: Sequence[Goal], seed: int) -> Floats:
    """Designs whose paths pass near a curve that a goal is about, as points of the unit cube, shape (n, variables).

    They keep the least transmission angle, or conditioning, of the conditions. There are none unless the mechanism has
    one drive, and all variables are numbers of it in fixed ranges.
    """
    owners = [goal.column.split(".")[1] for goal in goals
              if goal.command == "kinematics" and goal.column.startswith("targets.")]  # fmt: skip
    curves = [study.curves[owner] for owner in owners if owner in study.curves]
    ranges = {name: (float(one.from_.evaluate({})), float(one.to.evaluate({})))
              for name, one in variables_of(study).items()
              if one.from_ is not None and one.to is not None and not one.stepped
              and not one.from_.names | one.to.names and name in study.parameters.names()}  # fmt: skip
    none = np.empty((0, len(variables_of(study))))
    if not curves or len(ranges) < none.shape[1] or len(study.mechanism.drives) != 1:
        return none
    kind, (curve, *_) = OwnKind(study, curves[0].owner, ranges), curves
    assert curve.table is not None
    path = PathPoints(curve.table[:, 0] + 1j * curve.table[:, 1], bool(curve.closed and kind.turns))
    if not path.size > 0 or not kind.course[1] > 0:
        return none
    # Conditioning is the sine of the transmission angle.
    sines = {"conditioning": float, "loops.transmission_min": lambda angle: np.sin(angle * study.units.angle_factor)}
    asked = [sines[one.column](one.bound) for one in conditions
             if one.command == "kinematics" and not one.smallest and one.column in sines]  # fmt: skip
    bound = RangeBounds(kind, turning=kind.turns, least=max([0.0, *asked]) if kind.turns else 0.0)
    samples = kind.samples(np.random.default_rng(seed), _SAMPLED, 1.0, full_turn=path.closed)
    (modes,), whole = kind.modes, len(path.points) <= MOST_EXACT
    begun = starts(kind, modes, path, samples, bound, _POLISHED)
    found = fits(kind, modes, path, begun, bound, whole=whole).values[:_BEST]
    return np.asarray((found - kind.low) / np.where(kind.high > kind.low, kind.high - kind.low, 1.0))
