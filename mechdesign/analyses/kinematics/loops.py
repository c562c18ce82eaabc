"""Four-bars and slider-cranks of a mechanism along its motion: transmission angles, and links that come into line."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.analyses.kinematics.motion_limits import Limits, as_given
from mechdesign.analyses.kinematics.probing import probe
from mechdesign.analyses.kinematics.transmission import BEYOND, transmission_extremes
from mechdesign.analyses.poses import solve_poses
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import quiet
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Beside a pose in which the sine of the angle between two links is below this they may come into line.
NEAR = 0.3
# In line as far as the pose at a limit of motion tells, and another pose; one place along a sweep, as a part of a step.
IN_LINE = 1e-6
AT_POSE = 1e-12
SAME = 1e-5
# Precision of roots as a part of a step.
FINE = 1e-13


@dataclass(frozen=True, eq=False)
class _Samples:
    """Poses of a motion in its order, with the limits found between them; values of each loop, shape (loops, n).

    `sines` and `cosines`, of shape (2, loops, n), are of the angle from input and from output to the coupler.
    """

    position: Floats  # along the sweep, in rows
    place: Floats  # of the swept coordinate; the row where there is none
    end: Flags  # whether it is a limit rather than a pose
    angle: Floats
    sines: Floats
    cosines: Floats


@dataclass(frozen=True)
class _Toggle:
    """Links in line: where along the sweep, which sine is zero there, and the cosine that goes with it."""

    position: float
    place: float
    function: int
    cosine: float


def loop_tables(
    study: Study, poses: Poses, valid: Flags, limits: Limits | None
) -> dict[str, Table]:  # fmt: skip
    """Tables ``loops`` and, where one coordinate is swept, ``toggles``; none without four-bars and slider-cranks.

    Parameters
    ----------
    valid : bool array, shape (poses,)
    limits : Limits or None
        Of the motion; None where not just one coordinate is swept.
    """
    loops = four_bars(study.mechanism)
    if not loops:
        return {}
    samples = _sample(study, loops, poses, limits)
    tables = {"loops": _loops(study, loops, samples, poses, valid, limits)}
    if limits is not None:
        tables["toggles"] = _toggles(study, loops, samples, poses, limits)
    return tables


@quiet
def _values(loops: tuple[FourBar, ...], configuration: Configuration) -> tuple[Floats, Floats, Floats]:
    """Transmission angle of each loop, sines and cosines; nan in poses that are not valid."""
    shape, lost = configuration.shape, ~configuration.valid
    angle = np.array([np.broadcast_to(loop.transmission(configuration), shape) for loop in loops])
    both = [[loop.squareness(configuration, end) for loop in loops] for end in (0, 3)]
    sines, cosines = (np.array([[np.broadcast_to(pair[k], shape) for pair in row] for row in both]) for k in (0, 1))
    return np.where(lost, np.nan, angle), np.where(lost, np.nan, sines), np.where(lost, np.nan, cosines)


def _sample(study: Study, loops: tuple[FourBar, ...], poses: Poses, limits: Limits | None) -> _Samples:
    rows: list[Ints] = []
    found: list[tuple[Floats, Floats, Floats]] = []
    for solved in solve_poses(study, poses):
        rows.append(solved.rows)
        found.append(_values(loops, solved.configuration))
    where = np.concatenate(rows)
    position = where.astype(float)
    place = position if limits is None else limits.margins.at[where]
    ends = [] if limits is None else [end for end in limits.ends if end.configuration is not None]
    for end in ends:
        assert end.configuration is not None
        angle, sines, cosines = _values(loops, end.configuration)
        found.append((angle[..., None], sines[..., None], cosines[..., None]))
    position = np.concatenate([position, [end.position for end in ends]])
    place = np.concatenate([place, [end.place for end in ends]])
    order = np.argsort(position, kind="stable")
    return _Samples(
        position[order],
        place[order],
        (np.arange(len(position)) >= len(where))[order],
        *(np.concatenate(parts, axis=-1)[..., order] for parts in zip(*found, strict=True)),
    )


def _loops(
    study: Study, loops: tuple[FourBar, ...], samples: _Samples, poses: Poses, valid: Flags,
    limits: Limits | None,
) -> Table:  # fmt: skip
    units = study.units
    length, angle = units.label("length"), units.label("angle")
    if limits is None:
        lowest, highest = (_at_poses(samples, sign) for sign in (1, -1))
    else:
        swept = limits.margins.coordinate.name
        lowest, highest = (
            (value[:, 0], place[:, 0])
            for value, place in transmission_extremes(study, loops, poses, swept, valid, limits.ends)[0]
        )
    if limits is None:
        at_unit, where = "", "row of the"
    else:
        at_unit, where = units.label(limits.margins.coordinate.quantity), f"{limits.margins.coordinate.name} at the"
    joints = [" ".join(joint.name for joint in loop.joints) for loop in loops]
    columns = [
        Column("kind", np.array([loop.kind for loop in loops]), "", "what the four bodies and their joints are"),
        *(
            Column(part, np.array([loop.links[k] for loop in loops]), "", f"the {part} link")
            for k, part in enumerate(("frame", "input", "coupler", "output"))
        ),
        Column("joints", np.array(joints), "", "joints from the frame round"),
        *(
            Column(f"{part}_length", np.array([loop.lengths[k] for loop in loops]), length, f"length of the {part}")
            for k, part in enumerate(("frame", "input", "coupler", "output"))
        ),
        Column("offset", np.array([loop.offset for loop in loops]), length, "offset of the slide"),
        Column("class", np.array([loop.type for loop in loops]), "", "Grashof's class, or the kind of slider-crank"),
        Column(
            "excess", np.array([loop.excess for loop in loops]), length,
            "p + q - s - l; rod - crank - offset; |crank - frame| - offset: a link turns fully where positive",
        ),
    ]  # fmt: skip
    for name, (values, places) in (("transmission_min", lowest), ("transmission_max", highest)):
        which = "smallest" if name.endswith("min") else "largest"
        columns += [
            Column(name, values / units.angle_factor, angle, f"{which} angle between coupler and output, up to 90 deg"),
            Column(f"{name}_at", _given(study, poses, samples, limits, places), at_unit, f"{where} {which} value"),
        ]
    return Table("loops", tuple(columns), "four-bars and slider-cranks, and how well they transmit")


def _given(study: Study, poses: Poses, samples: _Samples, limits: Limits | None, places: Floats) -> Floats:
    """Places in the study's unit, as it gives them where they are poses; rows stay rows."""
    if limits is None:
        return places
    known = np.isfinite(places)
    rows = [int(np.abs(limits.margins.at - place).argmin()) for place in places[known]]
    found = places.copy()
    given = poses.groups[0].values[limits.margins.coordinate.name]
    found[known] = as_given(study, limits.margins, given, places[known].tolist(), rows)
    return found


def _at_poses(samples: _Samples, sign: int) -> tuple[Floats, Floats]:
    """Smallest (`sign` 1) or largest (-1) transmission angle of each loop over the poses, and its place."""
    values = np.where(np.isnan(samples.angle), np.inf, sign * samples.angle)
    best = (values <= values.min(axis=1, keepdims=True) + BEYOND).argmax(axis=1)
    found = values[np.arange(len(values)), best]
    none = ~np.isfinite(found)
    return np.where(none, np.nan, sign * found), np.where(none, np.nan, samples.place[best])


def _toggles(
    study: Study, loops: tuple[FourBar, ...], samples: _Samples, poses: Poses, limits: Limits
) -> Table:  # fmt: skip
    """Every place at which the coupler of a loop comes into line with its input or its output."""
    count = 2 * len(loops)
    sines = samples.sines.reshape(count, -1)
    function, first = _suspects(sines)
    begin, end = samples.place[first], samples.place[first + 1]
    start = limits.margins.start(np.where(samples.end[first], end, begin))

    def values(lane: Ints, x: Floats) -> Floats:
        """Sine and cosine of each lane's function."""
        _, sine, cosine = _values(loops, limits.margins.solve(x, None if start is None else start.take(lane)))
        pick = function[lane], np.arange(len(lane))
        return np.stack([sine.reshape(count, -1)[pick], cosine.reshape(count, -1)[pick]])

    straight, sample = np.nonzero(np.abs(sines) <= np.where(samples.end, IN_LINE, AT_POSE))
    at_samples = zip(
        samples.position[sample], samples.place[sample], straight,
        samples.cosines.reshape(count, -1)[straight, sample], strict=True,
    )  # fmt: skip
    toggles = [_Toggle(float(p), float(x), int(f), float(c)) for p, x, f, c in at_samples]
    if len(first):
        probes = probe(lambda lane, x: values(lane, x)[:1], begin, end, np.array([FINE]))
        for found in (probes.roots, probes.lows):
            sine, cosine = values(found.lane, found.place)
            part = (found.place - begin[found.lane]) / (end - begin)[found.lane]
            at = samples.position[first[found.lane]]
            at = at + part * (samples.position[first[found.lane] + 1] - at)
            # A sine that jumps from side to side is no root of it.
            for k in np.flatnonzero(np.abs(sine) <= IN_LINE).tolist():
                what = int(function[found.lane[k]])
                toggles.append(_Toggle(float(at[k]), float(found.place[k]), what, float(cosine[k])))
    return _toggle_table(study, loops, poses, limits, _once(toggles))


def _once(toggles: list[_Toggle]) -> list[_Toggle]:
    """Toggles in the order of the sweep; of those of one function that are one, the one found first."""
    kept: list[_Toggle] = []
    order = sorted(range(len(toggles)), key=lambda k: (toggles[k].function, toggles[k].position))
    best: int | None = None
    for k in order:
        same = best is not None and toggles[k].function == toggles[best].function
        if same and best is not None and toggles[k].position - toggles[best].position <= SAME:
            if k < best:
                best = k
                kept[-1] = toggles[k]
        else:
            best = k
            kept.append(toggles[k])
    return sorted(kept, key=lambda toggle: (toggle.position, toggle.function))


def _suspects(sines: Floats) -> tuple[Ints, Ints]:
    """Function and first sample of each step in which a sine may be zero."""
    known = np.isfinite(sines)
    size = np.where(known, np.abs(sines), np.inf)
    padded = np.pad(size, ((0, 0), (1, 1)), constant_values=np.inf)
    low = (size <= padded[:, :-2]) & (size <= padded[:, 2:]) & (size < NEAR)
    crossed = (sines[:, 1:] >= 0) != (sines[:, :-1] >= 0)
    function, first = np.nonzero(known[:, 1:] & known[:, :-1] & (crossed | low[:, 1:] | low[:, :-1]))
    return function, first


def _toggle_table(
    study: Study, loops: tuple[FourBar, ...], poses: Poses, limits: Limits, toggles: list[_Toggle]
) -> Table:  # fmt: skip
    name = limits.margins.coordinate.name
    given = poses.groups[0].values[name]
    rows = [int(toggle.position) for toggle in toggles]
    places = as_given(study, limits.margins, given, [toggle.place for toggle in toggles], rows)
    texts = []
    for toggle, both in zip(toggles, _together(toggles, len(loops)), strict=True):
        loop, end = loops[toggle.function % len(loops)], (0, 3)[toggle.function // len(loops)]
        texts.append(_words(loop, end, toggle.cosine, both))
    unit = study.units.label(limits.margins.coordinate.quantity)
    links, states, joints, effects, names = zip(*texts, strict=True) if texts else ((), (), (), (), ())
    return Table(
        "toggles",
        (
            Column(name, np.array(places, dtype=float), unit, "value at which the links are in line"),
            Column("links", np.array(links, dtype=str), "", "the two links in line"),
            Column("state", np.array(states, dtype=str), "", "extended, folded, or perpendicular to the slide"),
            Column("joints", np.array(joints, dtype=str), "", "joints of the two links"),
            Column("effect", np.array(effects, dtype=str), "", "what it does"),
            Column("loop", np.array(names, dtype=str), "", "the four-bar or slider-crank"),
        ),
        "links of four-bars and slider-cranks that come into line",
    )


def _together(toggles: list[_Toggle], count: int) -> list[bool]:
    """Whether all three moving links of the loop are in line at a toggle."""
    found = [False] * len(toggles)
    order = sorted(range(len(toggles)), key=lambda k: (toggles[k].function % count, toggles[k].position))
    for one, other in pairwise(order):
        a, b = toggles[one], toggles[other]
        if a.function % count == b.function % count and b.position - a.position <= SAME:
            found[one] = found[other] = True
    return found


def _words(loop: FourBar, end: int, cosine: float, both: bool) -> tuple[str, str, str, str, str]:
    """Links, state, joints, effect and loop of a toggle."""
    joints = [joint.name for joint in loop.joints]
    if end == 0:
        pair, pins, effect = loop.links[1:3], joints[:3], f"{loop.links[3]} reverses"
    else:
        pair, pins, effect = loop.links[2:4], joints[1:], f"{loop.links[1]} at its limit"
    straight = "extended" if (cosine > 0) == (end == 0) else "folded"
    state = "perpendicular" if loop.slide in (1, 2, end) else straight
    return " ".join(pair), state, " ".join(pins), "change point" if both else effect, loop.name
