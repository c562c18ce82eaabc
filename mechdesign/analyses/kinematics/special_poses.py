"""Poses of a motion that a picture shows one by one: its limits, links that come into line, a few between."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mechdesign.analyses.kinematics.boundaries import Boundary
from mechdesign.analyses.kinematics.instant_centres import Centre
from mechdesign.analyses.kinematics.motion import Motion
from mechdesign.analyses.kinematics.rates import drive_rates
from mechdesign.analyses.poses import Shown, SolvedPoses, in_study_units, pose_in_words, solve_poses
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import quiet
from mechdesign.mechanism.derivatives import STALLED, Jacobian, regularity
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.numerics.roots import bracketed_roots
from mechdesign.results import Table
from mechdesign.study.poses import PoseGroup, Poses

# Poses that are shown at most, and at least along a motion.
MOST = 6
FEW = 4
# Limits and toggles of a motion that are compared, whether a turn of the drive brought them back.
COMPARED = 200
# Places nearer than this part of the sweep's range are one, and so are poses whose points are nearer than this part of
# the mechanism's size.
SAME = 1e-6
DIGITS = 4
LIMIT = "limit of motion"
SINGULAR = "singular: det_J is 0"
# Of the place of a singularity, as a part of a step.
ROOT_PRECISION = 1e-12
AT_ZERO = 1e-10  # part of the sweep's range: a place as near to zero is zero
CHANGE_POINT = "change point: all links in line"


class Event(NamedTuple):
    """A place on a sweep (study's units), what happens there, and the pose where it is known already."""

    place: float
    words: tuple[str, ...]
    configuration: Configuration | None = None


@dataclass(frozen=True, eq=False)
class SpecialPose:
    """One pose and how its points move: complex velocities and accelerations by point, nan where there are none."""

    place: float  # along the sweep, in the study's units
    where: str  # ``crank = 40 deg``
    what: str  # what is special about it; empty of a pose without anything special
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
        return any(each.what for each in self.shown)


def special_poses(
    motion: Motion, kept: Shown, swept: str | None, ends: Sequence[Boundary], toggles: Table | None
) -> SpecialPoses:  # fmt: skip
    """The limits of a sweep and its toggles, with evenly spread poses where these are few; else listed poses.

    Of a grid there are none. `kept` are the solved poses that pictures show.
    """
    section, poses = motion.question.section, motion.question.poses
    rates = bool(any(section.rates.values()) or any(section.accelerations.values()) or section.speed is not None)
    if not poses.motion and not poses.listed:
        return SpecialPoses((), 0, rates)
    found, more = list[SpecialPose](), 0
    if poses.motion and swept is not None:
        events = _events(motion, swept, ends, toggles)
        found, more = _distinct(motion, _at_events(motion, swept, events[:COMPARED])), len(events[COMPARED:])
    valid = np.flatnonzero(kept.configuration.valid)
    some, left_out = valid[:MOST], max(len(valid), len(found)) - MOST
    along = poses.values[swept] if swept is not None else np.arange(poses.count, dtype=float)
    if poses.motion:
        some, left_out = _spread(motion, kept, along, [each.place for each in found]), len(found) + more - MOST
    configuration = kept.configuration.take(some)
    words = [(float(along[row]), pose_in_words(kept.study, poses, int(row), DIGITS), "") for row in kept.rows[some]]
    solved = SolvedPoses(kept.rows[some], poses.groups[0].names, configuration)
    found += _moving(motion, poses, solved, words)
    found.sort(key=lambda each: (each.place - along[0]) * (along[-1] - along[0]))
    return SpecialPoses(found[:MOST], max(left_out, 0), rates)


def _spread(motion: Motion, kept: Shown, along: Floats, special: Sequence[float]) -> Ints:
    """Further poses of a motion, up to `FEW` of all: evenly spread, or where the gaps between special ones are widest.

    A motion that goes round has no ends.
    """
    valid, count = np.flatnonzero(kept.configuration.valid), FEW - len(special)
    if count < 1 or not len(valid):
        return np.empty(0, dtype=np.intp)
    first, last = ({p: complex(kept.configuration.point(p)[k]) for p in _points(motion)} for k in valid[[0, -1]])
    round_again = motion.question.poses.closed or _same(first, last, motion.question.study.mechanism.size)
    parts = ((np.arange(count) + 0.5) / count if round_again else np.linspace(0, 1, count)).tolist()
    if special:
        begin, end = along[kept.rows[valid[[0, -1]]]]
        marks = sorted((place - begin) / (end - begin) if end != begin else 0.0 for place in special)
        marks, parts = [*marks, marks[0] + 1] if round_again else [0.0, *marks, 1.0], []
        for _ in range(count):
            k = int(np.diff(marks).argmax())
            marks.insert(k + 1, (marks[k] + marks[k + 1]) / 2)
            parts.append(marks[k + 1] % 1)
    return np.asarray(valid[np.unique((np.array(parts) * (len(valid) - 1)).round().astype(int))])


def _events(motion: Motion, swept: str, ends: Sequence[Boundary], toggles: Table | None) -> list[Event]:
    """Limits and toggles in the order of the sweep; those at one place are one."""
    study = motion.question.study
    coordinate, values = study.mechanism.coordinate(swept), motion.question.poses.groups[0].values[swept]
    found = []
    for end in ends:
        where = f" at {end.cause.joint}" if end.cause.joint else ""
        place = float(in_study_units(study, coordinate, end.place))
        found.append(Event(place, (f"{LIMIT}: {end.cause.kind}{where}",), end.configuration))
    for row in toggles or ():
        names = row["loop"].split(" (")[0].split("-")
        pair = next(f"{one} and {two}" for one, two in pairwise(names) if f"{one} {two}" == row["links"])
        state = row["state"].replace("perpendicular", "perpendicular to the slide")
        whole = row["effect"] == "change point"
        found.append(Event(row[swept], (CHANGE_POINT if whole else f"{pair} {state}: {row['effect']}",)))
    found += [Event(place, (SINGULAR,)) for place in _singular(motion, swept)]
    found.sort(key=lambda event: (event.place - values[0]) * (values[-1] - values[0]))
    merged: list[Event] = []
    for event in found:
        if merged and abs(event.place - merged[-1].place) <= SAME * float(np.ptp(values)):
            before = merged.pop()
            words = tuple(dict.fromkeys(before.words + event.words))
            event = Event(before.place, words, before.configuration or event.configuration)
        merged.append(event)
    return merged


def _singular(motion: Motion, swept: str) -> list[float]:
    """Where the determinant of a Jacobian of several outputs changes its sign along a sweep, in the study's units.

    Of one output and one drive that is where the output turns back.
    """
    question = motion.question
    if not question.square or len(question.drives) < 2:
        return []
    study, values, det = question.study, question.poses.groups[0].values[swept], motion.arrays["det_J"]
    known = motion.valid & np.isfinite(det)
    rows = np.flatnonzero(known[:-1] & known[1:] & ((det[:-1] > 0) != (det[1:] > 0)))

    def determinant(_: Ints, places: Floats) -> Floats:
        (solved,) = solve_poses(study, _poses_at(motion, swept, places))
        linear = study.mechanism.linearize(solved.configuration)
        value = np.where(solved.configuration.valid, Jacobian.of(linear, question.listed).determinant, np.nan)
        return np.broadcast_to(value, places.shape)

    low, high, none = values[rows], values[rows + 1], np.full(len(rows), np.nan)
    tolerance = ROOT_PRECISION * np.abs(high - low)
    roots = bracketed_roots(determinant, low, det[rows], high, det[rows + 1], none, none, tolerance)
    # A determinant that jumps through infinity has no root.
    size = np.nanmax(np.abs(det[known]), initial=0.0)
    roots = np.where(np.abs(roots) <= AT_ZERO * np.ptp(values), 0.0, roots)
    return roots[np.abs(determinant(rows, roots)) <= SAME * size].tolist() if len(rows) else []


def _poses_at(motion: Motion, swept: str, places: Floats) -> Poses:
    """Places on a sweep as poses that stand for themselves."""
    whole, count = motion.question.poses, len(places)
    (group,) = whole.groups
    along = np.argsort(group.values[swept], kind="stable")

    def there(values: Floats) -> Floats:
        return np.asarray(np.interp(places, group.values[swept][along], values[along]))

    values = {name: places if name == swept else there(group.values[name]) for name in group.names}
    return Poses(
        (PoseGroup(group.names, values, np.arange(count)),), count, True, (count,),
        slopes={name: there(each) for name, each in whole.slopes.items()},
        bends={name: there(each) for name, each in whole.bends.items()},
    )  # fmt: skip


def _at_events(motion: Motion, swept: str, events: Sequence[Event]) -> list[SpecialPose]:
    """The poses of events; those that cannot be assembled (at infinity) are left out."""
    study, count = motion.question.study, len(events)
    poses = _poses_at(motion, swept, np.array([event.place for event in events]))
    (solved,) = solve_poses(study, poses) if count else (None,)
    found = []
    for k, event in enumerate(events):
        assert solved is not None
        configuration, words = solved.configuration.take(np.array([k])), "; ".join(event.words)
        if not configuration.valid[0] and event.configuration is not None:
            # Rounding puts a limit beyond itself.
            reason = event.configuration.reason.reshape(1)
            configuration = replace(event.configuration, shape=(1,), reason=reason)
        if configuration.valid[0]:
            one = SolvedPoses(np.array([k]), solved.given, configuration)
            found += _moving(motion, poses, one, [(event.place, pose_in_words(study, poses, k, DIGITS), words)])
    return found


def _distinct(motion: Motion, found: Iterable[SpecialPose]) -> list[SpecialPose]:
    """Poses without those that a full turn of the drive brings back."""
    size, kept = motion.question.study.mechanism.size, list[tuple[dict[str, complex], SpecialPose]]()
    for each in found:
        places = {point: complex(each.configuration.point(point)[each.index]) for point in _points(motion)}
        if not any(_same(places, other, size) and each.what == one.what for other, one in kept):
            kept.append((places, each))
    return [each for _, each in kept]


def _same(one: Mapping[str, complex], other: Mapping[str, complex], size: float) -> bool:
    return all(abs(one[point] - other[point]) <= SAME * size for point in one)


def _points(motion: Motion) -> Sequence[str]:
    return motion.question.study.mechanism.points


@quiet
def _moving(
    motion: Motion, poses: Poses, solved: SolvedPoses, words: Sequence[tuple[float, str, str]]
) -> list[SpecialPose]:  # fmt: skip
    """Solved poses with the rates of all points and the instant centres asked; `words` are where and what each is."""
    question, configuration = motion.question, solved.configuration
    mechanism, section = question.study.mechanism, question.section
    linear = mechanism.linearize(configuration)
    regular = np.broadcast_to(regularity(linear) >= STALLED, configuration.shape)
    lost = complex(np.nan, np.nan)
    drives = drive_rates(question.study, section, poses, solved, linear)
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
            *each, configuration, k, {point: complex(value[k]) for point, value in velocities.items()},
            {point: complex(value[k]) for point, value in accelerations.items()},
            {centre: complex(value[k]) for centre, value in centres.items()},
        )
        for k, each in enumerate(words)
    ]  # fmt: skip
