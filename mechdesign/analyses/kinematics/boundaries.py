"""Ends of a motion along a sweep, and the places on it where two assemblies meet: also between its poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.kinematics.margins import DEAD_CENTRE, ZERO_LENGTH, Cause, Margins, joints_of
from mechdesign.analyses.kinematics.probing import Found, probe
from mechdesign.analyses.poses import CHUNK
from mechdesign.mechanism import Configuration, Reason
from mechdesign.mechanism.change_points import TOUCHING
from mechdesign.mechanism.turning import turning_point
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# The mechanism within steps `lane` at values of the swept coordinate.
Solve = Callable[[Ints, Floats], Configuration]

# Step, as a part of the sweep's, that tells whether a margin rises or falls at a pose.
SLOPE = 1e-4
# Halvings of a step of the sweep: enough to tell what ends the motion, and to reach the last bit of any drive's value.
SOME, HALVINGS = 6, 60
# Precision of roots as a part of a step: of a function that only says yes or no, and of the others.
COARSE, FINE = 0.02, 1e-13
# A limit this near to the first or the last value of the sweep lies at it (as a part of the value, or of 1).
AT_END = 1e-9
# Ends within this part of the sweep's size are one; a change point within this part of a step of a pose is at it.
SAME = 1e-11
AT_POSE = 1e-6
# How far beside a single place, as a part of the step, the motion must go on for it to have no gap there.
BESIDE = 1e-7


@dataclass(frozen=True, eq=False)
class Boundary:
    """An end of the motion.

    Parameters
    ----------
    position : float
        Where it is along the sweep, in rows.
    row : int
        The pose of the sweep next to it, within the motion if one is.
    place : float
        Value of the swept coordinate (radians or length): the last at which the mechanism is valid.
    configuration : Configuration
        The pose there; None at infinity.
    """

    position: float
    row: int
    place: float
    cause: Cause
    configuration: Configuration | None


@dataclass(frozen=True)
class ChangePoint:
    """A value of the swept coordinate at which two assemblies of a group meet and the motion goes on."""

    place: float
    cause: Cause


@dataclass(frozen=True, eq=False)
class _Sweep:
    margins: Margins
    at: Floats
    valid: Flags
    scale: Floats  # largest absolute value of each margin

    def role(self, name: str) -> Flags:
        return np.array([cause.role == name for cause in self.margins.causes], dtype=bool)


def boundaries(margins: Margins, valid: Flags) -> tuple[list[Boundary], list[ChangePoint]]:
    """All ends of the motion in the order of the sweep, and all change points.

    Between two poses a margin is looked for that changes its sign, or whose slopes at the poses admit that it does so
    twice; a step of the sweep must therefore resolve the motion, but not the gaps in it.

    Parameters
    ----------
    valid : bool array, shape (poses,)
        Whether each pose of the sweep is.
    """
    if len(margins.at) < 2 or not margins.causes:
        return [], []
    sweep = _Sweep(margins, margins.at, valid, np.zeros(len(margins.causes)))
    steps, rows, scale = _suspects(sweep)
    sweep = replace(sweep, scale=scale)
    ends, changes = _at_ends(sweep), _at_poses(sweep, rows)
    for first in range(0, len(steps), CHUNK):
        more_ends, more_changes = _within(sweep, steps[first : first + CHUNK])
        ends += more_ends
        changes += more_changes
    ends.sort(key=lambda end: end.position)
    span = float(np.ptp(sweep.at))
    kept: list[Boundary] = []
    for end in ends:
        if not kept or abs(end.place - kept[-1].place) > SAME * span or end.cause != kept[-1].cause:
            kept.append(end)
    return kept, changes


def _suspects(sweep: _Sweep) -> tuple[Ints, Ints, Floats]:
    """Steps of the sweep that may hold something, poses at which a closure is zero, and the margins' scale."""
    at, valid = sweep.at, sweep.valid
    steps, rows = [np.flatnonzero(valid[1:] != valid[:-1])], [np.zeros(0, dtype=np.intp)]
    scale, closure = sweep.scale, sweep.role("closure")[:, None]
    for first in range(0, len(at) - 1, CHUNK):
        x = at[first : first + CHUNK + 1]
        poses = sweep.margins.solve(x, limits=False)
        start = poses if sweep.margins.plan.iterative else None
        step = np.append(x[1:] - x[:-1], x[-1] - x[-2])
        here = sweep.margins.of(poses, x)
        with np.errstate(invalid="ignore"):
            slope = (sweep.margins.evaluate(x + SLOPE * step, start) - here) / SLOPE
            scale = np.maximum(scale, np.where(np.isfinite(here), np.abs(here), 0.0).max(axis=1))
            touch = TOUCHING * scale[:, None]
            steps.append(first + np.flatnonzero(_suspect(here, slope, touch).any(axis=0)))
            rows.append(first + np.flatnonzero((closure & (np.abs(here) <= touch)).any(axis=0)))
    some = np.unique(np.concatenate(steps))
    return some[at[some + 1] != at[some]], np.unique(np.concatenate(rows)), scale


def _suspect(here: Floats, slope: Floats, touch: Floats) -> Flags:
    """Steps in which a margin changes its sign or, by its values and slopes at both ends, may do so twice.

    A convex margin stays above its tangents; twice their slope leaves room for others. Where a slope is not a number
    the motion ends right beside the pose.
    """
    a, b, left, right = here[:, :-1], here[:, 1:], slope[:, :-1], slope[:, 1:]
    crossed = ((a >= 0) != (b >= 0)) & (np.isfinite(a) | np.isfinite(b))
    dip = (a >= 0) & (b >= 0) & ~(left > 0) & ~(right < 0) & ~(a + 2 * left > touch) & ~(b - 2 * right > touch)
    hump = (a < 0) & (b < 0) & (left > 0) & (right < 0) & (a + 2 * left >= 0) & (b - 2 * right >= 0)
    found: Flags = crossed | dip | hump
    return found


def _within(sweep: _Sweep, steps: Ints) -> tuple[list[Boundary], list[ChangePoint]]:
    """What lies inside some steps of the sweep."""
    margins, valid = sweep.margins, sweep.valid
    begin, end = sweep.at[steps], sweep.at[steps + 1]
    rows = np.where(valid[steps], steps, steps + 1)
    start = margins.start(sweep.at[rows])

    def solve(lane: Ints, x: Floats) -> Configuration:
        return margins.solve(x, None if start is None else start.take(lane))

    def evaluate(lane: Ints, x: Floats) -> Floats:
        return margins.evaluate(x, None if start is None else start.take(lane))

    probes = probe(evaluate, begin, end, np.where(sweep.role("reached"), COARSE, FINE))
    # Each step from its first pose over the probes to its second.
    every = np.arange(len(steps))
    lane = np.concatenate([every, probes.lane, every])
    place = np.concatenate([begin, probes.place, end])
    inside = np.concatenate([valid[steps], solve(probes.lane, probes.place).valid, valid[steps + 1]])
    order = np.lexsort((np.repeat([0, 1, 2], [len(every), len(probes.lane), len(every)]), lane))
    lane, place, inside = lane[order], place[order], inside[order]
    change = np.flatnonzero((lane[1:] == lane[:-1]) & (inside[1:] != inside[:-1]))
    lanes = lane[change]
    good = np.where(inside[change], place[change], place[change + 1])
    bad = np.where(inside[change], place[change + 1], place[change])
    ends = _located(sweep, lanes, good, bad, steps, rows, start)
    shut, changes = _isolated(sweep, probes.roots, probes.lows, steps, solve)
    return ends + shut, changes


def _located(
    sweep: _Sweep, lane: Ints, good: Floats, bad: Floats, steps: Ints, rows: Ints, start: Configuration | None
) -> list[Boundary]:
    """Ends of the motion between places of which one is valid and the other is not."""
    if not len(lane):
        return []
    inner = good
    near = None if start is None else start.take(lane)
    good, bad = _halved(sweep, good, bad, near, SOME)
    which, causes = _causes(sweep, bad, near)
    poses = sweep.margins.solve(good, near)
    found: dict[int, tuple[float, Configuration, Cause]] = {}
    for k in np.flatnonzero(np.array([cause.role == "reached" for cause in causes])).tolist():
        turned = _turned(sweep, float(good[k]), poses.take(k), causes[k])
        if turned is not None:
            found[k] = turned
    rest = np.array([k for k in range(len(lane)) if k not in found], dtype=np.intp)
    if len(rest):
        near = None if near is None else near.take(rest)
        good, bad = _halved(sweep, good[rest], bad[rest], near, HALVINGS)
        # Right beyond the end, where rounding is still forgiven, lies the pose in which a dead centre is straight.
        poses = sweep.margins.solve(good, near)
        which, causes = _causes(sweep, bad, near)
        places = _zeros(sweep, which, causes, inner[rest], good, bad, near)
        for j, k in enumerate(rest.tolist()):
            found[k] = _named(sweep, float(places[j]), poses.take(j), causes[j])
    begin, end = sweep.at[steps[lane]], sweep.at[steps[lane] + 1]
    return [
        Boundary(
            float(steps[lane[k]] + (place - begin[k]) / (end[k] - begin[k])), int(rows[lane[k]]), place, cause, pose
        )
        for k, (place, pose, cause) in found.items()
    ]


def _halved(
    sweep: _Sweep, good: Floats, bad: Floats, start: Configuration | None, halvings: int
) -> tuple[Floats, Floats]:  # fmt: skip
    """Valid and invalid places brought together."""
    for _ in range(halvings):
        middle = good + (bad - good) / 2
        inside = sweep.margins.solve(middle, start).valid
        good, bad = np.where(inside, middle, good), np.where(inside, bad, middle)
    return good, bad


def _zeros(
    sweep: _Sweep, which: Ints, causes: list[Cause], inner: Floats, good: Floats, bad: Floats,
    start: Configuration | None,
) -> Floats:  # fmt: skip
    """Where the margins that end the motion are zero, without the allowance for rounding; `good` for other causes."""
    smooth = np.flatnonzero([cause.role in ("closure", "limit", "leg") for cause in causes])
    found = good.copy()
    if not len(smooth):
        return found

    def margin(left: Ints, x: Floats) -> Floats:
        lane = smooth[left]
        values = sweep.margins.evaluate(x, None if start is None else start.take(lane))
        one: Floats = values[which[lane], np.arange(len(lane))]
        return one

    a, b, every = inner[smooth], bad[smooth], np.arange(len(smooth))
    ends, none = (margin(every, a), margin(every, b)), np.full(len(smooth), np.nan)
    place = bracketed_roots(margin, a, ends[0], b, ends[1], none, none, np.abs(b - a) * 2.0**-HALVINGS)
    found[smooth] = np.where((ends[0] >= 0) & (ends[1] < 0), place, good[smooth])
    return found


def _turned(
    sweep: _Sweep, place: float, pose: Configuration, cause: Cause
) -> tuple[float, Configuration, Cause] | None:  # fmt: skip
    """The very place at which a group without a closed form turns back; its continuation ends a little before."""
    margins = sweep.margins
    given = list(margins.held)
    given[margins.which] = place
    exact = turning_point(margins.plan, given, margins.which, pose)
    if exact is None:
        return None
    group = margins.plan.structure.groups[exact[2]]
    return exact[0], exact[1], replace(cause, joint=joints_of(margins.mechanism, group), group=exact[2])


def _named(
    sweep: _Sweep, place: float, pose: Configuration, cause: Cause
) -> tuple[float, Configuration, Cause]:  # fmt: skip
    """The cause where a group without a closed form is not continued although it does not turn back."""
    if cause.role == "reached":
        mechanism = sweep.margins.mechanism
        for slide in sweep.margins.legs:
            if abs(float(pose.slides[slide])) <= AT_END * mechanism.size:
                return place, pose, Cause(ZERO_LENGTH, mechanism.graph.slides[slide], -1, "leg")
        cause = replace(cause, kind=Reason.OTHER_ASSEMBLY.text)
    return place, pose, cause


def _causes(sweep: _Sweep, bad: Floats, start: Configuration | None) -> tuple[Ints, list[Cause]]:
    """What ends the motion just beyond its end: the margin that is most below zero, and its index."""
    margins = sweep.margins
    values = margins.evaluate(bad, start) / np.where(sweep.scale > 0, sweep.scale, 1.0)[:, None]
    values = np.where(np.isnan(values) | sweep.role("across")[:, None], np.inf, values)
    lowest = values.argmin(axis=0)
    texts = [Reason(int(reason)).text for reason in margins.solve(bad, start).reason]
    return lowest, [
        margins.causes[j] if values[j, k] < 0 else Cause(texts[k] or DEAD_CENTRE, "", -1, "")
        for k, j in enumerate(lowest.tolist())
    ]


def _isolated(
    sweep: _Sweep, roots: Found, lows: Found, steps: Ints, solve: Solve
) -> tuple[list[Boundary], list[ChangePoint]]:
    """Places inside steps at which the motion ends without a gap beside them, or at which two assemblies meet."""
    closure = sweep.role("closure")[lows.function] & (np.abs(lows.value) <= TOUCHING * sweep.scale[lows.function])
    across = sweep.role("across")[roots.function]
    lane = np.concatenate([roots.lane[across], lows.lane[closure]])
    place = np.concatenate([roots.place[across], lows.place[closure]])
    function = np.concatenate([roots.function[across], lows.function[closure]])
    if not len(lane):
        return [], []
    begin, end = sweep.at[steps[lane]], sweep.at[steps[lane] + 1]
    side = BESIDE * (end - begin)
    both = solve(lane, place - side).valid & solve(lane, place + side).valid
    ends: list[Boundary] = []
    changes: list[ChangePoint] = []
    for k in np.flatnonzero(both).tolist():
        step, cause = int(steps[lane[k]]), sweep.margins.causes[function[k]]
        part = (place[k] - begin[k]) / (end[k] - begin[k])
        if cause.kind == DEAD_CENTRE:
            nearest = round(part)
            at_pose = abs(part - nearest) <= AT_POSE
            changes.append(ChangePoint(float(sweep.at[step + nearest] if at_pose else place[k]), cause))
        else:
            ends.append(Boundary(step + float(part), step, float(place[k]), cause, None))
    return ends, changes


def _at_poses(sweep: _Sweep, rows: Ints) -> list[ChangePoint]:
    """Change points that lie at poses of the sweep, also at its first and last."""
    if not len(rows):
        return []
    at = sweep.at
    side = SLOPE * np.abs(at[np.maximum(rows, 1)] - at[np.maximum(rows, 1) - 1])
    start = sweep.margins.start(at[rows])
    here = sweep.margins.evaluate(at[rows], start)
    meet = sweep.role("closure")[:, None] & (np.abs(here) <= TOUCHING * sweep.scale[:, None])
    for x in (at[rows] - side, at[rows] + side):
        meet &= (sweep.margins.evaluate(x, start) > here) & sweep.margins.solve(x, start).valid
    return [ChangePoint(float(at[rows[k]]), sweep.margins.causes[j]) for j, k in np.argwhere(meet).tolist()]


def _at_ends(sweep: _Sweep) -> list[Boundary]:
    """Ends of the motion at the very first and last value of the sweep."""
    at, last = sweep.at, len(sweep.at) - 1
    rows = np.array([0, last])
    outward = np.sign([at[0] - at[1], at[last] - at[last - 1]])
    start = sweep.margins.start(at[rows])
    beyond = at[rows] + outward * AT_END * np.maximum(1.0, np.abs(at[rows]))
    inside = sweep.margins.solve(beyond, start).valid
    found = []
    for k in np.flatnonzero(sweep.valid[rows] & ~inside).tolist():
        cause = _causes(sweep, beyond[[k]], None if start is None else start.take(np.array([k])))[1][0]
        pose = sweep.margins.solve(at[rows[[k]]], None if start is None else start.take(np.array([k]))).take(0)
        found.append(Boundary(float(rows[k]), int(rows[k]), float(at[rows[k]]), cause, pose))
    return found
