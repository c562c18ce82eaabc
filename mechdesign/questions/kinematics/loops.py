"""Four-bars and slider-cranks of a mechanism along its motion: transmission angles, and links that come into line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, firsts
from mechdesign.ground.results import Table
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.four_bars import FourBar
from mechdesign.motion.along import of_swept
from mechdesign.motion.functions import Zeros
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.kinematics.along import KinematicAlong, over
from mechdesign.questions.kinematics.columns import LOOPS, TOGGLES
from mechdesign.questions.kinematics.moved import MovedQuestion

# Angles nearer than this are the same (radians).
SAME_ANGLE = 1e-12
# Links are in line where the sine of their angle is below this and turns back, or where the motion ends.
IN_LINE = 1e-6
# Toggles this near to each other are one, in rows of the sweep.
SAME_TOGGLE = 1e-5
ROLES = ("frame", "input", "coupler", "output")


def measured(
    mechanism: Mechanism, loops: Sequence[FourBar], poses: Poses, solved: Iterable[SolvedPoses]
) -> list[Sequence[FourBar]]:  # fmt: skip
    """Loops with the lengths that they have in each design, by a valid pose among those solved; as given without one.

    Of designs without dimensions of their own all are given with those of the sketch.
    """
    if not poses.places:
        return [loops] * poses.designs
    loops_of, missing = [loops] * poses.designs, np.ones(poses.designs, dtype=bool)
    for part in solved:
        valid = np.flatnonzero(part.configuration.valid)
        designs, first = firsts(part.rows[valid] // (poses.count // poses.designs))
        new = missing[designs]
        one = part.configuration.take(valid[first[new]])
        lengths = zip(*(loop.measured(one, mechanism.size) for loop in loops), strict=True)
        for design, own in zip(designs[new].tolist(), lengths, strict=False):
            loops_of[design], missing[design] = own, False
    return loops_of


def loops_table(
    question: MovedQuestion, designs: Sequence[Sequence[FourBar]], loops: Sequence[FourBar],
    along: KinematicAlong | None,
) -> Table:  # fmt: skip
    """Every loop of every design: its links and lengths, and how well it transmits.

    Parameters
    ----------
    designs : sequence of sequence of FourBar
        The loops of each design, as many of each.
    loops : sequence of FourBar
        The same for all designs, whatever their lengths.
    along : KinematicAlong, optional
        The motion with the loops; None of listed poses and grids.
    """
    study, poses = question.study, question.poses
    every = [loop for own in designs for loop in own]
    words = study.units.labels | of_swept(question.motion, None if along is None else poses.swept, "row")
    columns = [
        *LOOPS.columns(words, kind=[loop.kind for loop in every]),
        *(LOOPS["<part>"].column([loop.links[k] for loop in every], part=part) for k, part in enumerate(ROLES)),
        *LOOPS.columns(words, joints=[" ".join(joint.name for joint in loop.joints) for loop in every]),
        *(LOOPS["<part>_length"].column([loop.lengths[k] for loop in every], words["length"], part=part)
          for k, part in enumerate(ROLES)),
        *LOOPS.columns(words, offset=[loop.offset for loop in every], **{"class": [loop.type for loop in every]},
                       excess=[loop.excess for loop in every]),
    ]  # fmt: skip
    both = _at_poses(question.motion, loops) if along is None else _between(along, len(loops))
    # What is the same everywhere has no place.
    moves = both[1][0] - both[0][0] > SAME_ANGLE
    for (values, places), end in zip(both, ("min", "max"), strict=True):
        places = np.where(moves, places, np.nan)
        columns += LOOPS.columns(words, **{f"transmission_{end}": values.T.ravel() / study.units.angle_factor})
        columns += LOOPS.columns(words, **{f"transmission_{end}_at": places.T.ravel()})
    return LOOPS.table(columns, **over(along, ()))


def _at_poses(motion: Motion, loops: Sequence[FourBar]) -> list[tuple[Floats, Floats]]:
    """Smallest and largest transmission angle over the poses, and its row; shape (loops, designs)."""
    poses = motion.poses
    angle = np.full((len(loops), poses.count), np.nan)
    for solved in solve_poses(motion):
        valid = solved.configuration.valid
        for row, loop in zip(angle, loops, strict=True):
            row[solved.rows] = np.where(valid, loop.transmission(solved.configuration), np.nan)
    angles = angle.reshape(len(loops), poses.designs, -1)
    ends = []
    for sign in (1, -1):
        values = np.where(np.isnan(angles), np.inf, sign * angles)
        best = (values <= values.min(axis=2, keepdims=True) + SAME_ANGLE).argmax(axis=2)
        value = np.take_along_axis(angles, best[..., None], axis=2)[..., 0]
        ends.append((value, np.where(np.isnan(value), np.nan, best)))
    return ends


def _between(along: KinematicAlong, count: int) -> list[tuple[Floats, Floats]]:
    """Smallest and largest transmission angle over motions, and their places; shape (loops, designs)."""
    names = [f"{name} {k} 3" for name in ("sine", "cosine") for k in range(count)]
    values, places = (part.reshape(2, count, -1) for part in along.least(names, SAME_ANGLE))
    line = np.broadcast_to(np.arange(along.curve.lines), places.shape)
    shown = along.shown(line.ravel(), places.ravel()).reshape(places.shape)
    angles = np.arcsin(np.clip(values[0], 0.0, 1.0)), np.arccos(np.clip(values[1], 0.0, 1.0))
    return list(zip(angles, shown, strict=True))


@dataclass(frozen=True)
class Toggle:
    """Where the coupler of a loop comes into line with its input or its output: motion, place in rows, and words."""

    line: int
    place: float
    links: str
    state: str
    joints: str
    effect: str
    loop: str


def toggles_of(loops: Sequence[FourBar], along: KinematicAlong) -> list[Toggle]:
    """Every toggle of motions, one after the other, in the order of its places."""
    which = [(k, end) for end in (0, 3) for k in range(len(loops))]
    zeros = along.functions.zeros([f"sine {k} {end}" for k, end in which], IN_LINE)
    zeros = zeros.take(_once(zeros, along.snapped(zeros.place)))
    if not len(zeros.place):
        return []
    configuration = along.curve.solve(
        zeros.line, along.curve.inside(zeros.line, zeros.place), judged=False
    ).configuration
    together = _together(zeros.place, zeros.function % len(loops) + len(loops) * zeros.line)
    cosines = {end: [loop.squareness(configuration, end)[1] for loop in loops] for end in (0, 3)}
    toggles, lanes = [], (zeros.function, zeros.line, along.snapped(zeros.place), together)
    for number, (function, line, place, both) in enumerate(zip(*(lane.tolist() for lane in lanes), strict=True)):
        k, end = which[function]
        toggles.append(Toggle(line, place, *_words(loops[k], end, float(cosines[end][k][number]), both)))
    return toggles


def toggles_table(toggles: Sequence[Toggle], along: KinematicAlong) -> Table:
    """Every place at which the coupler of a loop comes into line with its input or its output."""
    line, place = (np.array([getattr(toggle, name) for toggle in toggles], dtype=kind)
                   for name, kind in (("line", np.intp), ("place", float)))  # fmt: skip
    words = {name: np.array([getattr(toggle, name) for toggle in toggles], dtype=str)
             for name in ("links", "state", "joints", "effect", "loop")}  # fmt: skip
    return TOGGLES.table([*along.place_columns(TOGGLES, line, place), *TOGGLES.columns({}, **words)])


def _once(zeros: Zeros, position: Floats) -> Ints:
    """Toggles in the order of the motions; of those of the same links that are one, the one found first."""
    kind = zeros.function + (zeros.function.max(initial=0) + 1) * zeros.line
    order = np.lexsort((position, kind))
    begins = np.flatnonzero(_apart(position[order], kind[order]))
    first = np.minimum.reduceat(order, begins) if len(order) else order
    return first[np.lexsort((zeros.function[first], position[first], zeros.line[first]))]


def _together(position: Floats, loop: Ints) -> Flags:
    """Whether all three moving links of the loop are in line at a toggle."""
    order = np.lexsort((position, loop))
    apart = np.append(_apart(position[order], loop[order]), True)
    together = np.empty(len(order), dtype=bool)
    together[order] = ~(apart[:-1] & apart[1:])
    return together


def _apart(position: Floats, kind: Ints) -> Flags:
    """Which of some sorted toggles are not one with the toggle before them."""
    near = (np.diff(position) <= SAME_TOGGLE) & (np.diff(kind) == 0)
    return np.append(True, ~near)[: len(position)]


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
