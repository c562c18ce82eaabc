"""Four-bars and slider-cranks of a mechanism along its motion: transmission angles, and links that come into line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.analyses.kinematics.lines import Function, PoseLine
from mechdesign.analyses.kinematics.motion import Motion, as_given
from mechdesign.analyses.kinematics.peaks import peaks, zeros
from mechdesign.analyses.poses import solve_poses
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.four_bars import FourBar
from mechdesign.mechanism.outputs import Rates
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Angles nearer than this are the same (radians).
SAME_ANGLE = 1e-12
# Transmission angles this near to 0 or a right angle are that (radians): they have a corner there.
AT_CORNER = 1e-10
# Links are in line where the sine of their angle is below this at a limit of motion,
IN_LINE_AT_LIMIT = 1e-6
# and at other poses.
IN_LINE_AT_POSE = 1e-12
# Toggles this near to each other are one, in rows of the sweep.
SAME_TOGGLE = 1e-5
ROLES = ("frame", "input", "coupler", "output")


def functions(loops: Sequence[FourBar], toggles: bool) -> dict[str, Function]:
    """Functions of a line for each loop: transmission angle, square of its sine, and for `toggles` sines and cosines.

    The square has the same extremes as the angle and is smooth where that is 0 or a right angle.
    """
    found: dict[str, Function] = {}
    for k, loop in enumerate(loops):
        found[f"square {k}"] = _sine(loop, 3, 2)
        found[f"angle {k}"] = Function(loop.transmission, lambda configuration, _: np.nan)
        for end in (0, 3) if toggles else ():
            found[f"sine {k} {end}"] = _sine(loop, end, 1)
            found[f"cosine {k} {end}"] = _cosine(loop, end)
    return found


def _sine(loop: FourBar, end: int, power: int) -> Function:
    """A power of the sine of the angle from the arm of the input (`end` 0) or output (3) to the coupler's action."""

    def slope(configuration: Configuration, velocity: Rates) -> Value:
        sine, cosine = loop.squareness(configuration, end)
        return power * sine ** (power - 1) * cosine * loop.turning(configuration, velocity, end)

    return Function(lambda configuration: loop.squareness(configuration, end)[0] ** power, slope)


def _cosine(loop: FourBar, end: int) -> Function:
    return Function(lambda configuration: loop.squareness(configuration, end)[1], lambda configuration, _: np.nan)


def loops_table(
    motion: Motion, loops: Sequence[FourBar], line: PoseLine | None, every: Poses | None = None
) -> Table:  # fmt: skip
    """Every loop of every design: its links and lengths (of a single design), and how well it transmits.

    `line` is the motion along its sweep, with `functions` of the loops; None where not just one coordinate is swept.
    `every` are all poses, where the motion may have only some of them.
    """
    study, poses = motion.question.study, motion.question.poses
    length, angle = study.units.label("length"), study.units.label("angle")
    columns = [
        Column("kind", np.array([loop.kind for loop in loops]), "", "what the four bodies and their joints are"),
        *(Column(part, np.array([loop.links[k] for loop in loops]), "", f"the {part} link")
          for k, part in enumerate(ROLES)),
        Column("joints", np.array([" ".join(joint.name for joint in loop.joints) for loop in loops]), "",
               "joints from the frame round"),
    ]  # fmt: skip
    if poses.designs == 1:
        columns += [
            *(Column(f"{part}_length", np.array([loop.lengths[k] for loop in loops]), length, f"length of the {part}")
              for k, part in enumerate(ROLES)),
            Column("offset", np.array([loop.offset for loop in loops]), length, "offset of the slide"),
            Column("class", np.array([loop.type for loop in loops]), "",
                   "Grashof's class, or the kind of slider-crank"),
            Column("excess", np.array([loop.excess for loop in loops]), length,
                   "p + q - s - l; rod - crank - offset; |crank - frame| - offset: a link turns fully where positive"),
        ]  # fmt: skip
    columns = [Column(c.name, np.tile(c.values, poses.designs), c.unit, c.meaning) for c in columns]
    at_unit, where = "", "row at the"
    if line is not None:
        at_unit, where = study.units.label(study.mechanism.quantity(line.swept)), f"{line.swept} at the"
    both = _at_poses(study, every or poses, loops) if line is None else _between(motion, line, len(loops))
    for (values, places), end, which in zip(both, ("min", "max"), ("smallest", "largest"), strict=True):
        name = f"transmission_{end}"
        meaning = f"{which} angle between coupler and output, up to 90 deg"
        columns += [
            Column(name, values.T.ravel() / study.units.angle_factor, angle, meaning),
            Column(f"{name}_at", places.T.ravel(), at_unit, f"{where} {which} value"),
        ]
    return Table("loops", tuple(columns), "four-bars and slider-cranks, and how well they transmit")


@quiet
def _at_poses(study: Study, poses: Poses, loops: Sequence[FourBar]) -> list[tuple[Floats, Floats]]:
    """Smallest and largest transmission angle over the poses, and its row; shape (loops, designs)."""
    angle = np.full((len(loops), poses.count), np.nan)
    for solved in solve_poses(study, poses):
        valid = solved.configuration.valid
        for row, loop in zip(angle, loops, strict=True):
            row[solved.rows] = np.where(valid, loop.transmission(solved.configuration), np.nan)
    each = angle.reshape(len(loops), poses.designs, -1)
    found = []
    for sign in (1, -1):
        values = np.where(np.isnan(each), np.inf, sign * each)
        best = (values <= values.min(axis=2, keepdims=True) + SAME_ANGLE).argmax(axis=2)
        value = np.take_along_axis(each, best[..., None], axis=2)[..., 0]
        found.append((value, np.where(np.isnan(value), np.nan, best)))
    return found


def _between(motion: Motion, line: PoseLine, count: int) -> list[tuple[Floats, Floats]]:
    """Smallest and largest transmission angle over a swept motion, and the swept coordinate there."""
    squares = np.array([line.rows[f"square {k}"] for k in range(count)])
    angles = np.array([line.rows[f"angle {k}"] for k in range(count)])
    found = []
    for peak in peaks(line, squares, np.full((count, line.poses.designs), SAME_ANGLE), all_poses=True):
        values = line.at(peak.node.ravel(), peak.place.ravel())[angles].reshape(count, *peak.node.shape)
        value = np.stack([values[k, k] for k in range(count)])
        for whole in (0.0, np.pi / 2):
            value = np.where(np.abs(value - whole) <= AT_CORNER, whole, value)
        place = as_given(motion, line.swept, peak.place, np.nan_to_num(peak.position))
        found.append((np.where(np.isnan(peak.place), np.nan, value), place))
    return found


def toggles_table(motion: Motion, loops: Sequence[FourBar], line: PoseLine) -> Table:
    """Every place at which the coupler of a loop comes into line with its input or its output."""
    study, swept = motion.question.study, line.swept
    which = [(k, end) for end in (0, 3) for k in range(len(loops))]
    sines, cosines = (np.array([line.rows[f"{name} {k} {end}"] for k, end in which]) for name in ("sine", "cosine"))
    found = zeros(line, sines, IN_LINE_AT_POSE, IN_LINE_AT_LIMIT)
    found = found.take(_once(found.position(line), found.function))
    position = found.position(line)
    cosine = line.at(found.node, found.place)[cosines[found.function], np.arange(len(found.node))]
    together = _together(position, found.function % len(loops))
    places = as_given(motion, swept, found.place, position)
    texts = [
        _words(loops[which[function][0]], which[function][1], value, both)
        for function, value, both in zip(found.function.tolist(), cosine.tolist(), together.tolist(), strict=True)
    ]
    links, states, joints, effects, names = zip(*texts, strict=True) if texts else ((), (), (), (), ())
    return Table(
        "toggles",
        (
            Column(swept, places, study.units.label(study.mechanism.quantity(swept)),
                   "value at which the links are in line"),
            Column("links", np.array(links, dtype=str), "", "the two links in line"),
            Column("state", np.array(states, dtype=str), "", "extended, folded, or perpendicular to the slide"),
            Column("joints", np.array(joints, dtype=str), "", "joints of the two links"),
            Column("effect", np.array(effects, dtype=str), "", "what it does"),
            Column("loop", np.array(names, dtype=str), "", "the four-bar or slider-crank"),
        ),
        "links of four-bars and slider-cranks that come into line",
    )  # fmt: skip


def _once(position: Floats, function: Ints) -> Ints:
    """Toggles in the order of the sweep; of those of the same links that are one, the one found first."""
    order = np.lexsort((position, function))
    begins = np.flatnonzero(_apart(position[order], function[order]))
    first = np.minimum.reduceat(order, begins) if len(order) else order
    return first[np.lexsort((function[first], position[first]))]


def _together(position: Floats, loop: Ints) -> Flags:
    """Whether all three moving links of the loop are in line at a toggle."""
    order = np.lexsort((position, loop))
    apart = np.append(_apart(position[order], loop[order]), True)
    found = np.empty(len(order), dtype=bool)
    found[order] = ~(apart[:-1] & apart[1:])
    return found


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
