"""What happens at once in a motion in time: bounces at limits, contacts that come to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.charts import Chart, Sides, regularity
from mechdesign.mechanism.outputs import first
from mechdesign.questions.dynamics.corners import Threshold
from mechdesign.questions.dynamics.equations_of_motion import MEETING
from mechdesign.questions.dynamics.state_in_time import EndOfRun, MotionInTime

if TYPE_CHECKING:
    from mechdesign.questions.dynamics.watches import Watch

# A velocity below this part of the usual one is rest at a limit, and that of a contact at rest.
REST, STILL = 1e-6, 1e-8
# Mass matrices that differ by less than this part are the same.
SAME = 1e-9


def bounced(motion: MotionInTime, stop: Watch) -> Floats:
    """The state behind a limit; the same where the motion ends there.

    An impulse along the limit's coordinate g changes velocities by -(1 + e) M^-1 g (g v) / (g M^-1 g).
    """
    equations, positions, restitution = motion.equations, motion.positions, motion.section.restitution
    coordinate = stop.coordinate
    assert coordinate is not None
    if restitution is None:
        words = f"limit {stop.name} is reached at {{time}}"
        motion.ending = EndOfRun("limit", words, f"the limit of {coordinate.name}")
        return motion.state
    x, velocity, works = motion.parts_of(motion.state)
    matrix, linear = equations.matrix(motion.time, x)
    along = np.array([np.ravel(first(linear.configuration, coordinate, part))[0] for part in linear.by_drives])
    velocity = velocity[equations.branch.chart.rows]
    speed = float(along @ velocity)
    scale = positions.size if coordinate.quantity == "length" else 1.0
    if not restitution * abs(speed) > REST * motion.pace * scale:
        words = f"the mechanism rests at limit {stop.name} from {{time}} on"
        motion.ending = EndOfRun("rest", words, f"its rest at the limit of {coordinate.name}")
        return motion.state
    impulse = np.linalg.solve(matrix, along)
    after = velocity - (1 + restitution) * impulse * speed / (along @ impulse)
    lost = 0.5 * (after @ matrix @ after - velocity @ matrix @ velocity)
    exact = positions.of(linear.configuration)[:, 0]
    velocity = equations.slopes(linear) @ after
    equations.branch = equations.branch._replace(signs=np.sign(motion.sliding(velocity)))
    return np.concatenate([exact, velocity, works[:1] + lost, works[1:]])


def rested(motion: MotionInTime, contact: int) -> Floats:
    """The state at which a contact, and perhaps others with it, comes to rest."""
    equations, positions, still = motion.equations, motion.positions, STILL * motion.pace
    x, velocity, works = motion.parts_of(motion.state)
    chart = equations.branch.chart
    linear = chart.solve(x[:, None], equations.branch.last)
    exact = positions.of(linear.configuration)[:, 0]
    velocity = equations.slopes(linear) @ velocity[chart.rows]
    if np.abs(velocity / positions.scales).max() <= still:
        velocity = np.zeros_like(velocity)
    speeds = motion.sliding(velocity)
    speeds[contact] = 0.0
    signs = np.where(np.abs(speeds) > still, np.sign(speeds), 0.0)
    equations.branch = equations.branch._replace(signs=signs)
    rates = equations.rates(np.array([motion.time]), exact[:, None], velocity[:, None])
    # What begins to slide at once does so on the way that it is accelerated.
    begins = motion.sliding(rates.acceleration[:, 0])
    begins = np.where(np.abs(begins) > still * motion.pace, np.sign(begins), 0.0)
    equations.branch = equations.branch._replace(signs=np.where(signs == 0, begins, signs))
    slow = np.abs(rates.acceleration[:, 0] / positions.scales).max() <= still * motion.pace
    if slow and not velocity.any():
        motion.stands_still()
    return np.concatenate([exact, velocity, works])


def turned(motion: MotionInTime, sides: Sides, turning: Sequence[Threshold]) -> Floats:
    """The state behind corners of what acts, from which on it is on other sides.

    Where the law of a coupling has a corner, the mass matrix M of the independent velocities v jumps, and they with it.
    As at a rounded corner, however narrow, the energy stays, and of the momentum what is along the corner: with n the
    gradient of the corner's argument M2 v2 = M1 v1 + a n, where v2 goes through the corner as v1 did.
    """
    equations = motion.equations
    threshold = next((threshold for threshold in turning if threshold.acting.coupling), None)
    if threshold is None:
        equations.branch = equations.branch._replace(sides=sides, chart=_chart(motion, sides))
        return motion.state
    x, velocity, works = motion.parts_of(motion.state)
    _to_common_chart(motion, sides)
    before, linear = equations.matrix(motion.time, x)
    velocity, kept = velocity[equations.branch.chart.rows], dict(equations.branch.sides)
    coordinate = threshold.acting.coordinate
    assert coordinate is not None
    argument = replace(coordinate, expression=threshold.corner.argument.held(kept))
    normal = np.array([np.ravel(first(linear.configuration, argument, part))[0] for part in linear.by_drives])
    equations.branch = equations.branch._replace(sides=sides, chart=_chart(motion, sides))
    after, linear = equations.matrix(motion.time, x)
    if np.abs(after - before).max() > SAME * np.abs(before).max():
        momentum, mobility = before @ velocity, np.linalg.inv(after)
        through, along = normal @ mobility @ normal, normal @ mobility @ momentum
        excess = momentum @ mobility @ momentum - velocity @ momentum
        speed = np.sqrt(max(along**2 - through * excess, 0.0)) * np.sign(normal @ velocity)
        velocity = mobility @ (momentum + (speed - along) / through * normal)
        motion.jumps.append((threshold.acting.words, motion.time))
    exact = motion.positions.of(linear.configuration)[:, 0]
    whole = equations.slopes(linear) @ velocity
    equations.branch = equations.branch._replace(last=linear.configuration.take(0))
    return np.concatenate([exact, whole, works])


def _chart(motion: MotionInTime, sides: Sides) -> Chart:
    """The chart of the same positions on other sides of corners."""
    chart = motion.equations.atlas.chart(motion.equations.branch.chart.rows, sides)
    if chart is None:
        motion.ending = EndOfRun("no value", "nothing determines the mechanism on both sides of a corner at {time}")
        return motion.equations.branch.chart
    return chart


def _to_common_chart(motion: MotionInTime, sides: Sides) -> None:
    """Go to the chart that is regular on both sides of a corner, the present one if it is."""
    equations = motion.equations
    x, branch = motion.parts_of(motion.state)[0][:, None], equations.branch
    some = combinations(range(len(x)), len(branch.chart.rows))
    for rows in [branch.chart.rows, *(np.array(rows, dtype=np.intp) for rows in some)]:
        charts = [equations.atlas.chart(rows, own) for own in (branch.sides, sides)]
        one, other = charts
        if one is not None and other is not None:
            least = min(float(regularity(chart.solve(x, branch.last))[0]) for chart in (one, other))
            if least >= MEETING:
                equations.branch = branch._replace(chart=one)
                return
