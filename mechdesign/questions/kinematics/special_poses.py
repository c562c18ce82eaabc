"""Poses of a motion that a picture shows one by one: its limits, links in line, and a few between."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Ints, distinct
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.derivatives import STALLED, regularity
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.instant_centres import Centre
from mechdesign.questions.kinematics.limits import LimitPlace
from mechdesign.questions.kinematics.loops import Toggle
from mechdesign.questions.kinematics.question import KinematicQuestion
from mechdesign.questions.kinematics.rates import drive_rates
from mechdesign.questions.poses import Shown, pose_in_words

# Poses that are shown at most, and at least along a motion.
MOST = 6
FEW = 4
# Limits and toggles that are compared, to leave out those that a turn of the drive repeats.
COMPARED = 200
# Places nearer than this part of the sweep's range are one place; poses whose points are nearer than this part of the
# mechanism's size are one pose.
SAME = 1e-6
DIGITS = 4
LIMIT = "limit of motion"
PASSED = "passes a singularity"
SINGULAR = "singular: det_J is 0"
CHANGE_POINT = "change point: all links in line"


class PoseEvent(NamedTuple):
    """A place on a motion, in rows, and what happens there."""

    place: float
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SpecialPose:
    """One pose and how its points move: complex velocities and accelerations by point, nan where there are none."""

    row: float  # place along the motion, in rows
    place: float  # what is swept there, in the study's units; else the row
    where: str  # ``crank = 40 deg``
    event: str  # limit, toggle or singularity there; empty of a pose without one
    configuration: Configuration  # a batch, of which it is pose `index`
    index: int
    velocities: Mapping[str, complex]
    accelerations: Mapping[str, complex]
    centres: Mapping[Centre, complex]  # inf + i inf at infinity, nan where there is none


@dataclass(frozen=True, eq=False)
class SpecialPoses:
    """Poses to show; `left_out` are as many more, and `rates` says whether velocities were asked for."""

    shown: Sequence[SpecialPose]
    left_out: int
    rates: bool

    @property
    def special(self) -> bool:
        """Whether limits and toggles of the motion are among them."""
        return any(pose.event for pose in self.shown)


def special_poses(
    motion: PoseValues, kept: Shown, along: KinematicAlong | None, limits: Sequence[LimitPlace],
    toggles: Sequence[Toggle],
) -> SpecialPoses:  # fmt: skip
    """The limits of a motion and its toggles, with evenly spread poses where these are few; else listed poses.

    Of a grid there are none. `kept` are the solved poses that pictures show.
    """
    section, poses = motion.question.section, motion.question.poses
    rates = any(section.rates.values()) or any(section.accelerations.values())
    rates = bool(rates or section.speed is not None or section.motion is not None)
    if not poses.followed and not poses.listed:
        return SpecialPoses((), 0, rates)
    special, more = list[SpecialPose](), 0
    if along is not None:
        events = _events(motion.question, along, limits, toggles)
        special, more = _distinct(motion, _at_events(motion.question, along, events[:COMPARED])), len(events[COMPARED:])
    valid = np.flatnonzero(kept.configuration.valid)
    some, left_out = valid[:MOST], max(len(valid), len(special)) - MOST
    if poses.followed:
        some, left_out = _spread(motion, kept, [pose.row for pose in special]), len(special) + more - MOST
    words = [
        (float(poses.numbers[k]), float(poses.abscissa[k]), pose_in_words(kept.study, poses, k, DIGITS), "")
        for k in kept.rows[some].tolist()
    ]
    special += _moving(motion.question, kept.take(some).solved, words)
    special.sort(key=lambda pose: pose.row)
    return SpecialPoses(special[:MOST], max(left_out, 0), rates)


def _spread(motion: PoseValues, kept: Shown, special: Sequence[float]) -> Ints:
    """Further poses of a motion, up to `FEW` of all: evenly spread, or where the gaps between special ones are widest.

    A motion that goes round has no ends.
    """
    valid, count = np.flatnonzero(kept.configuration.valid), FEW - len(special)
    if count < 1 or not len(valid):
        return np.empty(0, dtype=np.intp)
    poses = motion.question.poses
    first, last = ({p: complex(kept.configuration.point(p)[k]) for p in _points(motion)} for k in valid[[0, -1]])
    round_again = poses.closed or _same(first, last, motion.question.study.mechanism.size)
    parts = ((np.arange(count) + 0.5) / count if round_again else np.linspace(0, 1, count)).tolist()
    if special:
        begin, end = poses.numbers[kept.rows[valid[[0, -1]]]]
        marks = sorted((place - begin) / (end - begin) if end != begin else 0.0 for place in special)
        marks, parts = [*marks, marks[0] + 1] if round_again else [0.0, *marks, 1.0], []
        for _ in range(count):
            k = int(np.diff(marks).argmax())
            marks.insert(k + 1, (marks[k] + marks[k + 1]) / 2)
            parts.append(marks[k + 1] % 1)
    return np.asarray(valid[distinct((np.array(parts) * (len(valid) - 1)).round().astype(int))])


def _events(
    question: KinematicQuestion, along: KinematicAlong, limits: Sequence[LimitPlace], toggles: Sequence[Toggle]
) -> list[PoseEvent]:  # fmt: skip
    """Limits, singularities and toggles in the order of the motion; those at one place are one."""
    events = []
    for limit in limits:
        where = f" at {limit.cause.joint}" if limit.cause.joint else ""
        kind = PASSED if limit.end is None else f"{LIMIT}: {limit.cause.kind}"
        events.append(PoseEvent(limit.place, (f"{kind}{where}",)))
    for toggle in toggles:
        names = toggle.loop.split(" (")[0].split("-")
        pair = next(f"{one} and {two}" for one, two in pairwise(names) if f"{one} {two}" == toggle.links)
        state = toggle.state.replace("perpendicular", "perpendicular to the slide")
        whole = toggle.effect == "change point"
        events.append(PoseEvent(toggle.place, (CHANGE_POINT if whole else f"{pair} {state}: {toggle.effect}",)))
    events += [PoseEvent(place, (SINGULAR,)) for place in _singular(question, along)]
    events.sort(key=lambda event: event.place)
    merged: list[PoseEvent] = []
    for event in events:
        if merged and abs(event.place - merged[-1].place) <= SAME * along.curve.poses.end:
            before = merged.pop()
            event = PoseEvent(before.place, tuple(dict.fromkeys(before.words + event.words)))
        merged.append(event)
    return merged


def _singular(question: KinematicQuestion, along: KinematicAlong) -> list[float]:
    """Where the determinant of a Jacobian of several outputs is zero along a motion, in rows.

    Of one output and one drive that is where the output turns back.
    """
    if not question.square or len(question.drives) < 2:
        return []
    own = KinematicAlong(question, along.curve, ["det_J"])
    return [float(place) for place in own.functions.zeros(["det_J"], 0.0).place]


def _at_events(question: KinematicQuestion, along: KinematicAlong, events: Sequence[PoseEvent]) -> list[SpecialPose]:
    """The poses of events; those that cannot be assembled (at infinity) are left out."""
    if not events:
        return []
    line, s = np.zeros(len(events), dtype=np.intp), np.array([event.place for event in events])
    there = along.curve.solve(line, along.curve.inside(line, s), judged=False)
    at, shown, special = along.curve.motion.at(along.curve.poses.along(line, s)), along.shown(line, s), []
    for k in np.flatnonzero(there.configuration.reason == 0).tolist():
        # Of a pose at a limit the words have the limit.
        where = at.in_words(k, DIGITS)
        words = [(events[k].place, float(shown[k]), where, "; ".join(events[k].words))]
        special += _moving(question, there.take(np.array([k])), words)
    return special


def _distinct(motion: PoseValues, poses: Iterable[SpecialPose]) -> list[SpecialPose]:
    """Poses without those that a full turn of the drive brings back."""
    size, kept = motion.question.study.mechanism.size, list[tuple[dict[str, complex], SpecialPose]]()
    for pose in poses:
        places = {point: complex(pose.configuration.point(point)[pose.index]) for point in _points(motion)}
        if not any(_same(places, other, size) and pose.event == one.event for other, one in kept):
            kept.append((places, pose))
    return [pose for _, pose in kept]


def _same(one: Mapping[str, complex], other: Mapping[str, complex], size: float) -> bool:
    return all(abs(one[point] - other[point]) <= SAME * size for point in one)


def _points(motion: PoseValues) -> Sequence[str]:
    points: Sequence[str] = motion.question.study.mechanism.points
    return points


def _moving(
    question: KinematicQuestion, solved: SolvedPoses, words: Sequence[tuple[float, float, str, str]]
) -> list[SpecialPose]:  # fmt: skip
    """Solved poses with the rates of all points and the instant centres asked; `words` are where and what each is."""
    configuration = solved.configuration
    mechanism, section = question.study.mechanism, question.section
    linear = mechanism.linearize(configuration)
    regular = np.broadcast_to(regularity(linear) >= STALLED, configuration.shape)
    lost = complex(np.nan, np.nan)
    drives = drive_rates(section, solved, linear)
    velocity = linear.velocity(drives.velocities)
    acceleration = linear.acceleration(velocity, drives.accelerations)
    velocities, accelerations = (
        {point: np.where(regular, rates.nodes[mechanism.graph.node(point)], lost) for point in mechanism.points}
        for rates in (velocity, acceleration)
    )
    if len(mechanism.drives) == 1:
        velocity = linear.velocity([1.0])
    centres = {centre: np.where(regular, centre.at(mechanism, configuration, velocity)[0], lost)
               for centre in question.centres}  # fmt: skip
    return [
        SpecialPose(
            *word, configuration, k, {point: complex(value[k]) for point, value in velocities.items()},
            {point: complex(value[k]) for point, value in accelerations.items()},
            {centre: complex(value[k]) for centre, value in centres.items()},
        )
        for k, word in enumerate(words)
    ]  # fmt: skip
