"""Limits of a motion along a sweep, and the places on it where two assemblies meet: also between its poses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.kinematics.motion import Motion, as_given, thinned
from mechdesign.analyses.poses import POSES_AT_ONCE, in_study_units, radians
from mechdesign.mechanism import Configuration, Reason
from mechdesign.mechanism.change_points import TOUCHING
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.margins import DEAD_CENTRE, ZERO_LENGTH, Cause, SweepMargins, turning_point
from mechdesign.numerics.arrays import Flags, Floats, Ints, Lanes
from mechdesign.numerics.roots import bracketed_roots, lowest
from mechdesign.results import Column, Table
from mechdesign.study import Study

# Step of the differences that are the slopes of margins, as a part of the step between two poses.
SLOPE_STEP = 1e-4
# Steps in which the motion may end are divided into so many parts,
PARTS = 8
# so often: until each end is alone in one, and a margin that falls to zero without crossing it is below `TOUCHING`.
DIVISIONS = 6
# Parts that are suspected of an end, a step of the sweep, and of a short sweep at least: steps with more of them do not
# resolve the motion.
SUSPECTS = 16
FEWEST_SUSPECTS = 256
# Halvings of a step that reach the last bit of any drive's value.
HALVINGS = 45
# Precision of roots, as a part of a step.
ROOT_PRECISION = 1e-13
# A limit this near to the first or the last value of the sweep lies at it (as a part of the value, or of 1).
AT_END = 1e-9
# Ends within this part of the sweep's size are one.
SAME_END = 1e-11
# The motion has no gap at a single place if it is valid this far to both sides, as a part of the step.
GAP_PROBE = 1e-5
# A change point this near to zero, as a part of the sweep, is there.
CHANGE_AT_ZERO = 1e-7
# A value of the swept coordinate at which two assemblies of a group meet and the motion goes on.
ChangePoint = tuple[float, Cause]


@dataclass(frozen=True, eq=False)
class Boundary:
    """An end of the motion: where it is along the sweep in rows, and the pose there (None at infinity).

    `place` is the last value of the swept coordinate (radians or length) at which the mechanism is valid.
    """

    position: float
    place: float
    cause: Cause
    configuration: Configuration | None


@dataclass(frozen=True, eq=False)
class _Parts(Lanes):
    """Parts of the steps of a sweep; `step` is the step of each, shape (n,).

    Of both ends the place, whether it is valid, shape (2, n), the margins, and their slopes times the length of the
    part, shape (margins, 2, n).
    """

    step: Ints
    x: Floats
    valid: Flags
    values: Floats
    rises: Floats


def boundaries(margins: SweepMargins, valid: Flags) -> tuple[list[Boundary], list[ChangePoint], bool]:
    """All ends of the motion in the order of the sweep, and all change points; `valid` for each pose, shape (poses,).

    Between two poses a margin is looked for that changes its sign, or whose slopes at the poses admit that it does so
    twice; a step of the sweep must therefore resolve the motion, but not the gaps in it. Whether it does is the last
    that is returned: where not, there are ends between a valid pose and one that is not, and no change points.
    """
    if len(margins.at) < 2 or not margins.causes:
        return [], [], True
    return _Search(margins, valid).found()


class _Search:
    """The steps of a sweep, one before its first pose and one after its last, where the motion may end at those."""

    def __init__(self, margins: SweepMargins, valid: Flags) -> None:
        self.margins = margins
        at, ends = margins.at, margins.at[[0, -1]]
        beyond = ends + AT_END * np.maximum(1.0, np.abs(ends)) * np.sign([at[0] - at[1], at[-1] - at[-2]])
        self.at = np.concatenate([beyond[:1], at, beyond[1:]])
        self.length = np.abs(np.diff(self.at))
        self.length[[0, -1]] = self.length[[1, -2]]
        # The pose that each step is continued from: one of its ends that is valid.
        first = np.append(False, valid)
        self.start = margins.start(np.where(first, self.at[:-1], np.append(at, at[-1])))
        self.scale = np.zeros(len(margins.causes))

    def role(self, name: str) -> Flags:
        return np.array([cause.role == name for cause in self.margins.causes], dtype=bool)

    def solve(self, step: Ints, x: Floats) -> Configuration:
        return self.margins.solve(x, None if self.start is None else self.start.take(step))

    def evaluate(self, step: Ints, x: Floats) -> Floats:
        return self.margins.look(x, None if self.start is None else self.start.take(step))[0]

    def look(self, step: Ints, low: Floats, high: Floats) -> _Parts:
        found = []
        for first in range(0, len(step), POSES_AT_ONCE):
            here, x = step[first : first + POSES_AT_ONCE], np.stack([low, high])[:, first : first + POSES_AT_ONCE]
            ahead = x + SLOPE_STEP * (x[1] - x[0])
            start = None if self.start is None else self.start.take(np.tile(here, 4))
            values, valid = self.margins.look(np.concatenate([x, ahead]).ravel(), start)
            values, valid = values.reshape(len(values), 4, -1), valid.reshape(4, -1)
            with np.errstate(invalid="ignore"):
                rises = (values[:, 2:] - values[:, :2]) / SLOPE_STEP
            found.append(_Parts(here, x, valid[:2], values[:, :2], rises))
        return _Parts.joined(found)

    def found(self) -> tuple[list[Boundary], list[ChangePoint], bool]:
        """All ends and change points, and whether the steps resolve the motion."""
        step = np.flatnonzero(np.diff(self.at) != 0)
        parts = steps = self.look(step, self.at[step], self.at[step + 1])
        self.scale = np.nanmax(np.where(np.isfinite(parts.values), np.abs(parts.values), 0.0), axis=(1, 2))
        touched, most = [], max(FEWEST_SUSPECTS, SUSPECTS * len(step))
        for _ in range(DIVISIONS):
            suspect, touching = self._suspects(parts)
            if np.count_nonzero(suspect) > most:
                return self._ends(steps), [], False
            touched.append(parts.take(touching))
            parts = parts.take(suspect)
            if not len(parts.step):
                break
            cuts = parts.x[0] + np.linspace(0, 1, PARTS + 1)[:, None] * (parts.x[1] - parts.x[0])
            cuts[-1] = parts.x[1]
            parts = self.look(np.tile(parts.step, PARTS), cuts[:-1].ravel(), cuts[1:].ravel())
        suspect, touching = self._suspects(parts)
        changes = self._changes(_Parts.joined([*touched, parts.take(suspect | touching)]))
        return self._ends(parts), changes, True

    def _ends(self, parts: _Parts) -> list[Boundary]:
        """Ends of the motion in parts of the steps, in the order of the sweep, each once."""
        ends = self._located(parts.take(parts.valid[0] != parts.valid[1])) + self._endless(parts)
        ends.sort(key=lambda end: end.position)
        span = float(np.ptp(self.at))
        kept: list[Boundary] = []
        for end in ends:
            if not kept or abs(end.place - kept[-1].place) > SAME_END * span or end.cause != kept[-1].cause:
                kept.append(end)
        return kept

    def _suspects(self, parts: _Parts) -> tuple[Flags, Flags]:
        """Parts in which a margin changes its sign or may do so twice, and others in which one is as good as zero.

        A convex margin stays above its tangents; twice their slope leaves room for others. Where a slope is not a
        number the motion ends right beside the pose.
        """
        (a, b), (left, right) = np.moveaxis(parts.values, 1, 0), np.moveaxis(parts.rises, 1, 0)
        touch = TOUCHING * self.scale[:, None]
        with np.errstate(invalid="ignore"):
            crossed = ((a >= 0) != (b >= 0)) & (np.isfinite(a) | np.isfinite(b))
            dip = (a >= 0) & (b >= 0) & ~(left > 0) & ~(right < 0) & ~(a + 2 * left > touch) & ~(b - 2 * right > touch)
            hump = (a < 0) & (b < 0) & (left > 0) & (right < 0) & (a + 2 * left >= 0) & (b - 2 * right >= 0)
            flat = dip & (np.maximum(a, b) <= touch) & (np.maximum(-left, right) <= touch)
        suspect = (crossed | hump | (dip & ~flat)).any(axis=0) | (parts.valid[0] != parts.valid[1])
        return suspect, flat.any(axis=0) & ~suspect

    def _position(self, step: Ints, place: Floats) -> Floats:
        part = (place - self.at[step]) / (self.at[step + 1] - self.at[step])
        return np.asarray(np.clip(step - 1 + part, 0, len(self.at) - 3))

    def _located(self, parts: _Parts) -> list[Boundary]:
        """Ends of the motion within parts of which one end is valid and the other is not."""
        last = len(self.at) - 2
        # Where the sweep begins or ends within the motion's allowance for rounding, it does not end there.
        parts = parts.take(~((parts.step == 0) & parts.valid[0]) & ~((parts.step == last) & parts.valid[1]))
        step, lanes = parts.step, np.arange(len(parts.step))
        if not len(step):
            return []
        side = np.where(parts.valid[0], 0, 1)
        good, bad = parts.x[side, lanes], parts.x[1 - side, lanes]
        poses, (_, causes) = self.solve(step, good), self._causes(step, bad)
        turned = [
            self._turned(int(step[k]), float(good[k]), poses.take(k), cause) if cause.role == "reached" else None
            for k, cause in enumerate(causes)
        ]
        rest = np.flatnonzero([end is None for end in turned])
        return [end for end in turned if end is not None] + self._closed_in(step[rest], good[rest], bad[rest])

    def _closed_in(self, step: Ints, inner: Floats, bad: Floats) -> list[Boundary]:
        """Ends between places of which one is valid and the other is not, brought together."""
        good = inner
        for _ in range(HALVINGS if len(step) else 0):
            middle = good + (bad - good) / 2
            inside = self.solve(step, middle).valid
            good, bad = np.where(inside, middle, good), np.where(inside, bad, middle)
        # Right beyond the end, where rounding is still forgiven, lies the pose in which a dead centre is straight.
        last = len(self.at) - 2
        outer = (step == 0) | (step == last)
        good = np.where(outer, np.where(step == 0, self.at[1], self.at[-2]), good)
        poses, (which, causes) = self.solve(step, good), self._causes(step, bad)
        # Where the margin is zero, without that allowance.
        root = self._root(step, which, inner, bad)
        smooth = np.array([cause.role in ("closure", "limit", "leg") for cause in causes], dtype=bool)
        places = np.where(smooth & ~outer & np.isfinite(root), root, good)
        positions = self._position(step, places).tolist()
        return [
            Boundary(positions[k], float(places[k]), self._named(poses.take(k), cause), poses.take(k))
            for k, cause in enumerate(causes)
        ]

    def _root(self, step: Ints, which: Ints, low: Floats, high: Floats) -> Floats:
        """Where margins `which` are zero between two places; nan where they have the same sign at both."""

        def margin(lane: Ints, x: Floats) -> Floats:
            found: Floats = self.evaluate(step[lane], x)[which[lane], np.arange(len(lane))]
            return found

        every, none = np.arange(len(step)), np.full(len(step), np.nan)
        a, b = margin(every, low), margin(every, high)
        place = bracketed_roots(margin, low, a, high, b, none, none, ROOT_PRECISION * np.abs(high - low))
        return np.where((a >= 0) != (b >= 0), place, np.nan)

    def _turned(self, step: int, place: float, pose: Configuration, cause: Cause) -> Boundary | None:
        """The very place at which a group without a closed form turns back; its continuation ends a little before."""
        margins = self.margins
        given = list(margins.held)
        given[margins.which] = place
        exact = turning_point(margins.plan, given, margins.which, pose)
        if exact is None:
            return None
        joint = " ".join(margins.mechanism.graph.joined(margins.plan.structure.groups[exact[2]].edges))
        position = float(self._position(np.array([step]), np.array([exact[0]]))[0])
        return Boundary(position, exact[0], replace(cause, joint=joint, group=exact[2]), exact[1])

    def _named(self, pose: Configuration, cause: Cause) -> Cause:
        """The cause where a group without a closed form is not continued although it does not turn back."""
        if cause.role != "reached":
            return cause
        mechanism = self.margins.mechanism
        for slide in self.margins.legs:
            leg = mechanism.graph.slides[slide]
            if abs(float(pose.slides[slide])) <= AT_END * mechanism.size:
                return Cause(ZERO_LENGTH, leg, leg, -1, "leg")
        return replace(cause, kind=Reason.OTHER_ASSEMBLY.text)

    def _causes(self, step: Ints, bad: Floats) -> tuple[Ints, list[Cause]]:
        """What ends the motion just beyond its end: the margin that is most below zero, and its index."""
        values = self.evaluate(step, bad) / np.where(self.scale > 0, self.scale, 1.0)[:, None]
        values = np.where(np.isnan(values) | self.role("across")[:, None], np.inf, values)
        lowest_of = values.argmin(axis=0)
        texts = [Reason(int(reason)).text for reason in self.solve(step, bad).reason]
        return lowest_of, [
            self.margins.causes[j] if values[j, k] < 0 else Cause(texts[k] or DEAD_CENTRE, "", "", -1, "")
            for k, j in enumerate(lowest_of.tolist())
        ]

    def _goes_on(self, step: Ints, place: Floats) -> Flags:
        """Whether the motion has no gap at single places."""
        side = GAP_PROBE * self.length[step]
        return np.asarray(self.solve(step, place - side).valid & self.solve(step, place + side).valid)

    def _endless(self, parts: _Parts) -> list[Boundary]:
        """Single places at which the motion goes to infinity."""
        a, b = np.moveaxis(parts.values, 1, 0)
        function, lane = np.nonzero(self.role("across")[:, None] & ((a >= 0) != (b >= 0)) & np.isfinite(a + b))
        step = parts.step[lane]
        place = self._root(step, function, *parts.x[:, lane])
        positions = self._position(step, place).tolist()
        return [
            Boundary(positions[k], float(place[k]), self.margins.causes[function[k]], None)
            for k in np.flatnonzero(self._goes_on(step, place)).tolist()
        ]

    def _changes(self, parts: _Parts) -> list[ChangePoint]:
        """Places at which a closure falls to zero and rises again."""
        (a, b), touch = np.moveaxis(parts.values, 1, 0), TOUCHING * self.scale[:, None]
        falls = self.role("closure")[:, None] & (np.minimum(a, b) <= touch)
        function, lane = np.nonzero(falls & parts.valid.all(axis=0))
        if not len(lane):
            return []
        step, (low, high) = parts.step[lane], parts.x[:, lane].copy()
        low, high = np.minimum(low, high), np.maximum(low, high)

        def closure(x: Floats) -> Floats:
            values = self.evaluate(step, x)[function, np.arange(len(x))]
            return np.where(np.isnan(values), np.inf, values)

        place, value = lowest(closure, low, high)
        side = GAP_PROBE * self.length[step]
        some = (value <= touch[function, 0]) & (closure(place - side) > value) & (closure(place + side) > value)
        gone_through = np.flatnonzero(some & self._goes_on(step, place)).tolist()
        return [(float(place[k]), self.margins.causes[function[k]]) for k in gone_through]


def motion_limits(motion: Motion, swept: str) -> tuple[Table, list[str], list[Boundary], bool]:
    """Table of the values of the swept coordinate at which the motion ends, warnings, these ends, whether they are all.

    `kind` and `joint` are those of `mechdesign.mechanism.margins.Cause`; change points are among the warnings.
    """
    study, outputs = motion.question.study, motion.question.outputs
    (group,) = motion.question.poses.groups
    mechanism = study.mechanism
    angles = angles_of([*outputs, *mechanism.counting])
    rows = np.flatnonzero(thinned(motion, swept))
    near = {name: radians(study, c, motion.arrays[name][rows]) for name, c in angles.items()}
    given = {name: radians(study, mechanism.coordinate(name), group.values[name][rows]) for name in group.names}
    margins = SweepMargins(mechanism, given, swept, near)
    found, changes, resolved = boundaries(margins, motion.valid[rows])
    ends = [replace(end, position=float(np.interp(end.position, np.arange(len(rows)), rows))) for end in found]
    unit = study.units.label(mechanism.quantity(swept))
    places = as_given(motion, swept, np.array([e.place for e in ends]), np.array([e.position for e in ends]))
    columns = [
        Column(swept, places, unit, "value at the limit of motion"),
        Column("kind", np.array([end.cause.kind for end in ends], dtype=str), "",
               "what ends the motion, such as a dead centre, a singularity or a limit"),
        Column("joint", np.array([end.cause.joint for end in ends], dtype=str), "", "where"),
    ]  # fmt: skip
    columns += [
        Column(
            output.name, _values(study, output, ends), study.units.label(output.quantity), f"{output.name} at the limit"
        )
        for output in outputs
        if output.name != swept
    ]
    table = Table("limits", tuple(columns), "limits of motion found along the sweep")
    warnings = _hidden(swept, unit, places, ends, motion.valid)
    if mechanism.description.branch != "follow":
        warnings += _warnings(study, margins, swept, changes)
    return table, warnings, ends, resolved


def _values(study: Study, output: Coordinate, ends: list[Boundary]) -> Floats:
    """An output at the limits."""
    poses = [end.configuration for end in ends]
    found = [np.nan if pose is None else float(in_study_units(study, output, pose.value(output))) for pose in poses]
    return np.array(found, dtype=float)


def _hidden(swept: str, unit: str, places: Floats, ends: list[Boundary], valid: Flags) -> list[str]:
    """A warning where the motion ends between neighbouring poses that are both valid: the motion table hides it."""
    hidden = [
        f"{swept} = {place:.6g} {unit}".rstrip()
        for place, end in zip(places.tolist(), ends, strict=True)
        if end.position % 1 > 0 and valid[int(end.position)] and valid[int(end.position) + 1]
    ]
    if not hidden:
        return []
    more = f" and {len(hidden) - 4} more" if len(hidden) > 4 else ""
    return [f"the motion ends between poses that are both valid, at {', '.join(hidden[:4])}{more}: see the limits"]


def _warnings(study: Study, margins: SweepMargins, swept: str, changes: list[ChangePoint]) -> list[str]:
    unit = study.units.label(study.mechanism.quantity(swept))
    places: dict[str, dict[str, None]] = {}
    for at, cause in sorted(changes, key=lambda change: change[0]):
        # The smallest value of a smooth function is found to the root of rounding.
        near = at if abs(at) > CHANGE_AT_ZERO * np.ptp(margins.at) else 0.0
        place = f"{in_study_units(study, margins.coordinate, near):.6g} {unit}".rstrip()
        places.setdefault(place, {})[cause.joint] = None
    return [
        f"change point at {swept} = {place} (joints {'; '.join(joints)}): two assemblies meet there, and branch 'side' "
        "keeps each joint on its side of the line, where a made mechanism may cross it"
        for place, joints in places.items()
    ]
