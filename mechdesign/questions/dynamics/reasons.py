"""Why a motion in time ends before its time."""

from __future__ import annotations

import numpy as np

from mechdesign.mechanism.outputs import first
from mechdesign.questions.dynamics.corners import Corners
from mechdesign.questions.dynamics.instants import Instants
from mechdesign.questions.dynamics.state_in_time import EndOfRun, MotionInTime

# How far beyond its last instant a motion is looked at, as a part of the duration: with its last velocities.
BEYOND = 1e-6


def cannot_go_on(motion: MotionInTime, corners: Corners) -> EndOfRun:
    """Why the equations give no motion at the last instant of a motion, or just beyond."""
    equations = motion.equations
    x, velocity, _ = motion.parts_of(motion.state[:, None])
    at = np.array([motion.time])
    rates, step = equations.rates(at, x, velocity), BEYOND * motion.end
    if equations.jams:
        words = f"friction in {equations.jams} jams the mechanism, no acceleration agrees with it, at {{time}}"
        return EndOfRun("jams", words, f"friction in {equations.jams} jams it")
    accelerations = np.nan_to_num(rates.acceleration)
    here = Instants(equations, at, x, velocity)
    beyond = Instants(equations, at + step, x + step * velocity, velocity + step * accelerations)
    moves = here.moving.velocity
    assert moves is not None
    for coupling in motion.mechanism.couplings:
        function, configuration = coupling.function, here.configuration
        assert function.expression is not None
        ahead = configuration.user_values(function)
        for part in function.parts:
            unit = function.expression.angle_unit if part.quantity == "angle" else 1.0
            ahead[part.name] = ahead[part.name] + step / unit * first(configuration, part, moves)
        if not np.isfinite(function.expression.evaluate(ahead)).all():
            return EndOfRun("no value", f"coupling {coupling.name} has no value from {{time}} on")
    for acting in corners.acting:
        if acting.coordinate is None:
            now, later = (bool(np.isfinite(acting.value(acting.expression, part)).all()) for part in (here, beyond))
            if not later:
                return EndOfRun("no value", f"{acting.words} has no value from {{time}} on")
            if not now:
                return EndOfRun("no value", f"{acting.words} is not finite at {{time}}")
    return EndOfRun("no value", "the motion cannot go on at {time}")
