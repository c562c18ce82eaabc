"""What the poses of a motion miss: the worst place between them, to the first order.

All methods judge the poses alone, and a cycle is one made mechanism at all of them.
"""

from __future__ import annotations

import numpy as np
import scipy

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Floats, evenly
from mechdesign.mechanism.coordinates import corners_of, expressions_of
from mechdesign.motion.corners import divide
from mechdesign.motion.curve import Curve
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import curve_with
from mechdesign.questions.kinematics.corners import variables_of
from mechdesign.questions.loads import coordinates_in, corners_in
from mechdesign.questions.reliability.forces import pace
from mechdesign.questions.reliability.methods.auto import FACTOR
from mechdesign.questions.reliability.question import ReliabilityQuestion, columns_among
from mechdesign.questions.reliability.task import Task
from mechdesign.study import Study

# Parts of each step, and about half the most places at which a motion is judged.
_PARTS = 16
_MOST_PLACES = 2048
# Probability of failure between the poses that is worth no warning.
_SMALL = 1e-9


def places_between(study: Study, question: ReliabilityQuestion, poses: Poses) -> Poses | None:
    """Places of one motion between its poses; None where none is followed, or it has too many poses.

    They divide each step evenly, and each piece of the motion on which outputs and loads are smooth, so that what is
    narrow is seen between its corners.
    """
    parts = min(_PARTS, _MOST_PLACES // max(poses.count, 1))
    if not poses.followed or poses.designs > 1 or parts < 2:
        return None
    nodes = _smooth(study, question, poses).pieces.nodes.ravel()
    s = np.arange(0.0, poses.end + 0.5 / parts, 1.0 / parts)
    s = np.unique(np.concatenate([s[np.round(s) != s], nodes[evenly(len(nodes), _MOST_PLACES)]]))
    return poses.along(np.zeros(len(s), dtype=np.intp), s)


def _smooth(study: Study, question: ReliabilityQuestion, poses: Poses) -> Curve:
    """The motion with pieces that end at the corners of the limited outputs and of loads."""
    channels = [question.channels[k] for k in question.limited_channels]
    loads = study.dynamics.loads if columns_among(channels) and study.dynamics is not None else ()
    coordinates = [channel.coordinate for channel in channels if channel.coordinate is not None]
    coordinates += coordinates_in(study, loads)
    curve = curve_with(study.motion(poses), coordinates)
    expressions = expressions_of(coordinates)
    corners = [*corners_of(coordinates), *corners_in(loads)]
    return divide(curve, corners, variables_of(study, pace(study), curve, expressions))[0]


def between_poses(task: Task, places: Task) -> list[Caution]:
    """A warning where a limit fails more often between the poses of `task` than at the worst of them."""
    here, there = _worst(task), _worst(places)
    if not len(there) or not len(here) or not np.isfinite(here).any():
        return []
    row, place = int(np.nanargmax(here)), int(np.nanargmax(there))
    if not there[place] > max(FACTOR * here[row], _SMALL):
        return []
    why = "1, as it cannot be assembled there"
    if places.assembled[place]:
        why = f"{numeral(there[place], 3)} to the first order"
    return [Caution(
        "unconverged",
        f"between the poses, at {places.where(place)}, the probability of failure is {why}, and at the worst pose, "
        f"{task.where(row)}, {numeral(here[row], 3)}: pose and cycle are judged at the poses alone, so take a "
        "finer step",
        "reliability", pose=places.where(place),
    )]  # fmt: skip


def _worst(task: Task) -> Floats:
    """Probability of failure by the limit, or the margin of assembly, that is broken most often, shape (poses,)."""
    from mechdesign.questions.reliability.probability import failure_probability

    question, linear = task.question.at(task.nominal), task.linear
    mean, covariance = linear.whole.shift().T, linear.whole.covariance()
    failure = scipy.special.ndtr(-task.closing.distance()).max(axis=0, initial=0.0)
    for rows in linear.alike():
        for limit in question.limits:
            own = failure_probability(covariance[rows], linear.limits([limit], rows), mean[rows])
            failure[rows] = np.fmax(failure[rows], own)
    return np.where(task.assembled, failure, 1.0)
