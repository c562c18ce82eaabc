"""The flywheel that evens out the speed of the one drive over a cycle.

At constant speed the effort less its mean takes up and gives back the energy that a flywheel must bear. Both follow
from the effort as a function along the motion, as in ``extremes.csv``.
"""

from __future__ import annotations

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.results import Table
from mechdesign.ground.statistics import Request, no_value_along
from mechdesign.mechanism.algebra import Vector
from mechdesign.motion.motion import radians
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import GivenRows
from mechdesign.questions.dynamics.columns import FLYWHEEL
from mechdesign.questions.dynamics.schema import Flywheel
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.moved import MovedQuestion

# Work over the next motion that differs by less than this part of the work of the size of the effort is the same; of an
# effort that is rounding alone, this part of the forces that act.
SAME, ROUNDING = 1e-6, 1e-12


def flywheel_table(motion: PoseValues, along: KinematicAlong | None, wheel: Flywheel) -> tuple[Table, list[Caution]]:
    """The table, and a warning where the motion is no cycle or is only taken as one; nan where it is none."""
    question, study, numbers = motion.question, motion.question.study, np.full(5, np.nan)
    (drive,) = question.drives
    rate, warnings = question.section.rates.get(drive.name, 0.0), list[Caution]()
    problem, kind = _no_motion(question, along), "undefined"
    if along is not None and not problem and (problem := _another(question, along)) and _closes(question, along):
        kind = "assumed"
    if problem:
        words = "takes the sweep for its cycle, though" if kind == "assumed" else "is nan:"
        warnings.append(Caution(kind, f"the flywheel of {drive.name} {words} {problem}", "flywheel"))
    if along is not None and (kind == "assumed" or not problem):
        mean, surplus, own = _of_cycle(along, f"{drive.name}_effort", _way(question))
        mass = study.units.inertia_factor * float(radians(study.units, drive, rate)) ** 2
        inertia = 2 * own / mass
        added = max(surplus / (wheel.fluctuation * mass) - inertia, 0.0)
        numbers = np.array([mean, surplus, inertia, np.divide(surplus / mass, inertia), added])
    label = study.units.label
    units = {"speed": label("angular_velocity"), "moment": label("moment"), "inertia": label("moment_of_inertia")}
    names = ("mean_effort", "surplus", "inertia", "fluctuation", "added_inertia")
    columns = [
        FLYWHEEL["drive"].column(np.array([drive.name])),
        FLYWHEEL["mean_speed"].column(np.array([rate]), units["speed"]),
        *FLYWHEEL.columns(study.units.labels, **{name: numbers[k : k + 1] for k, name in enumerate(names)}),
        *FLYWHEEL.columns({}, **{f"{kind}_unit": np.array([unit]) for kind, unit in units.items()}),
    ]
    return FLYWHEEL.table(columns), warnings


def _of_cycle(along: KinematicAlong, effort: str, way: float) -> tuple[float, float, float]:
    """Mean effort, surplus and mean kinetic energy over a way (radians)."""
    end, pieces = along.curve.poses.end, along.functions.pieces
    mean = float(along.mean(effort)[0])
    # Energy is largest and smallest where the effort passes its mean, or jumps over it.
    places = np.concatenate([[0.0, end], along.crossings(effort, mean), pieces.begin, pieces.end])
    surplus = float(np.ptp(along.integral(effort, places) - mean * places)) * way / end
    return mean, surplus, float(along.mean("kinetic_energy")[0])


def _no_motion(question: MovedQuestion, along: KinematicAlong | None) -> str:
    """Why the poses are no motion of the drive at one speed; empty where they are."""
    (drive,) = question.drives
    if not question.section.rates.get(drive.name, 0.0):
        return f"it is that of a constant speed; give rates: {{{drive.name}: ...}}"
    if question.section.accelerations.get(drive.name, 0.0):
        return f"{drive.name} accelerates, and a cycle has a constant mean speed"
    if question.poses.swept != drive.name:
        return f"a cycle is a sweep of {drive.name}"
    if along is None or along.curve.spent[0] or along.functions.unresolved[0]:
        return "the motion cannot be followed between its poses"
    if missing := along.missing(0):
        return missing
    if lost := float(along.lost(f"{drive.name}_effort")[0]):
        return f"the effort of {drive.name} has {no_value_along(lost)}"
    return "" if np.isfinite(along.mean(f"{drive.name}_effort")[0]) else f"the effort of {drive.name} is not finite"


def _another(question: MovedQuestion, along: KinematicAlong) -> str:
    """How the effort over the next motion is another; empty where it is the same, and so the motion a cycle."""
    (drive,), study, way = question.drives, question.study, _way(question)
    effort = f"{drive.name}_effort"
    twice = _twice(question)
    assert twice.curve is not None
    further = KinematicAlong(twice, twice.curve.unlimited(), (), requests=[Request(effort, integral=True)])
    end, pieces = along.curve.poses.end, further.functions.pieces
    nodes = np.concatenate([pieces.nodes.ravel(), pieces.begin, pieces.end])
    places = np.append(np.where(nodes > end, nodes - end, nodes), end)
    work = further.integral(effort, places)
    again = further.integral(effort, places + end) - further.integral(effort, np.array([end]))
    size = next(static.size for static in question.statics if static.name == effort)
    slack = SAME * float(along.mean(effort, absolute=True)[0]) + ROUNDING * size
    gap = np.nan_to_num(np.abs(again - work) / end, nan=np.inf)
    if further.whole[0] and (gap <= slack).all():
        return ""
    if not (further.whole[0] and np.isfinite(gap).all()):
        return f"beyond its {_degrees(question, end)} the mechanism or its loads cannot go on"
    k, unit = int(gap.argmax()), study.units.label("moment")
    first, second = (float(some[k]) * way / end for some in (work, again))
    return (
        f"over the next {_degrees(question, end)} the effort is another, with a work of {numeral(second)} {unit} in "
        f"the first {_degrees(question, places[k])} in place of {numeral(first)}"
    )


def _closes(question: MovedQuestion, along: KinematicAlong) -> bool:
    """Whether positions and effort at the end of the motion are those at its begin."""
    (drive,), line, ends = question.drives, np.zeros(2, dtype=np.intp), np.array([0.0, along.curve.poses.end])
    poses, size = along.curve.solve(line, ends, judged=False).configuration, question.study.mechanism.size
    places = [*poses.rotations, *(place / size for place in (*poses.nodes, *poses.slides))]
    effort = along.at(line, ends)[f"{drive.name}_effort"]
    return all(_apart(place) <= SAME for place in places) and _apart(effort) <= SAME * np.abs(effort).max(initial=0.0)


def _apart(values: Vector) -> float:
    """How far the second of two values is from the first."""
    return float(np.abs(np.diff(np.broadcast_to(values, 2)))[0])


def _degrees(question: MovedQuestion, place: float) -> str:
    """The way of the drive to a place, in the study's unit."""
    (drive,), poses = question.drives, question.poses
    values = poses.values[drive.name]
    return f"{abs(values[-1] - values[0]) * place / poses.end:.6g} {question.study.units.label('angle')}"


def _way(question: MovedQuestion) -> float:
    """How far the drive turns (radians)."""
    (drive,), values = question.drives, question.poses.values
    return float(radians(question.study.units, drive, abs(values[drive.name][-1] - values[drive.name][0])))


def _twice(question: MovedQuestion) -> MovedQuestion:
    """The question for a sweep that goes on as far again."""
    (name,), poses = question.poses.names, question.poses
    values = poses.values[name]
    longer = GivenRows({name: np.append(values, values[1:] + (values[-1] - values[0]))})
    return question.at(Poses(longer, poses.own))
