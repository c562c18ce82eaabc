"""Where functions along a line of poses turn back or are zero; extremes of outputs and errors between the poses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.lines import STILL, Function, PoseLine
from mechdesign.analyses.kinematics.motion import Motion, statics
from mechdesign.analyses.poses import in_study_units
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Flags, Floats, Ints, Lanes
from mechdesign.numerics.roots import bracketed_roots, lowest
from mechdesign.results import Column, Table

# Which segments are of interest, by a sign, the functions times it at both ends, of shape (functions, 2, segments), and
# how far each may fall below both.
Wanted = Callable[[int, Floats, Floats], Flags]
# Values of functions, shape (functions, n), beside poses of a line with the swept coordinate elsewhere.
Along = Callable[[Ints, Floats], Floats]

# Error of the place of an extreme or a zero, as a part of its segment.
PLACE_PRECISION = 1e-13
# A function that doubles within this part of the way to the poses beside its extreme has a pole there.
POLE = 1e-3


@dataclass(frozen=True, eq=False)
class Places(Lanes):
    """Places on a line: function, the poses of the line on both sides, swept coordinate, and value there.

    `sign` is 1 where the function is smallest beside the place, -1 where it is largest, 0 where it is zero.
    """

    function: Ints
    node: Ints
    other: Ints
    place: Floats
    value: Floats
    sign: Ints

    def position(self, line: PoseLine) -> Floats:
        """Place along the sweep in rows."""
        begin, span = line.place[self.node], line.place[self.other] - line.place[self.node]
        part = np.where(span != 0, (self.place - begin) / np.where(span != 0, span, 1.0), 0.0)
        return np.asarray(line.position[self.node] + part * (line.position[self.other] - line.position[self.node]))


@dataclass(frozen=True, eq=False)
class Peak:
    """The smallest value of each function, times a sign, over each design's line; nan where none is.

    With its place (swept coordinate in the core's units), its position along the sweep in rows, and the line's pose at
    or beside it; all of shape (functions, designs).
    """

    value: Floats
    place: Floats
    position: Floats
    node: Ints


def turns(line: PoseLine, rows: Ints, wanted: Wanted) -> Places:
    """Places between the poses of a line at which slopes of functions (rows of its values) change their sign.

    A segment cannot hold a value below both its ends by more than half its length times its largest slope: links
    hardly turn within it, and functions hardly bend.
    """
    values, slopes = (table[rows][:, np.stack([line.begin, line.end])] for table in (line.values, line.slopes))
    slopes = slopes * (line.place[line.end] - line.place[line.begin])
    drop = np.nan_to_num(np.fmax(np.abs(slopes[:, 0]), np.abs(slopes[:, 1]))) / 2
    which, function, segment = np.nonzero([
        wanted(sign, sign * values, drop) & (sign * slopes[:, 0] < 0) & (sign * slopes[:, 1] > 0) for sign in (1, -1)
    ])  # fmt: skip
    begin, end, sign = line.begin[segment], line.end[segment], 1 - 2 * which
    slopes = line.slopes[rows]
    place = _roots(
        lambda lane, x: line.sample(begin[lane], x)[1][rows[function[lane]], np.arange(len(lane))],
        line.place[begin], slopes[function, begin], line.place[end], slopes[function, end],
    )  # fmt: skip
    value = line.sample(begin, place)[0][rows[function], np.arange(len(place))]
    known = np.isfinite(value)
    return Places(function, begin, end, place, value, sign).take(known)


def _roots(evaluate: Along, low: Floats, at_low: Floats, high: Floats, at_high: Floats) -> Floats:
    """Roots between places with values of opposite signs."""
    none = np.full(len(low), np.nan)
    return bracketed_roots(evaluate, low, at_low, high, at_high, none, none, PLACE_PRECISION * np.abs(high - low))


def zeros(line: PoseLine, rows: Ints, at_pose: float, touching: float) -> Places:
    """Places along a line at which functions are zero.

    They cross zero, are below `at_pose` at a pose, or below `touching` at a limit of motion or where they turn back.
    """
    turned = turns(line, rows, lambda _, values, drop: (values >= 0).all(axis=1) & (values.min(axis=1) <= drop))
    values = line.values[rows]
    within = np.full(len(line.row), at_pose)
    within[line.limits] = touching
    function, node = np.nonzero(np.abs(values) <= within)
    at_nodes = Places(function, node, node, line.place[node], values[function, node], 0 * node)
    touched, beyond = turned.take(np.abs(turned.value) <= touching), turned.take(turned.sign * turned.value < 0)
    # Changes of sign: between the ends of segments, and between where a function turns back beyond zero and both ends.
    one, two = values[:, line.begin], values[:, line.end]
    function, segment = np.nonzero(((one >= 0) != (two >= 0)) & np.isfinite(one) & np.isfinite(two))
    function = np.concatenate([function, beyond.function, beyond.function])
    begin = np.concatenate([line.begin[segment], beyond.node, beyond.node])
    end = np.concatenate([line.end[segment], beyond.other, beyond.other])
    low, high = line.place[begin], line.place[end]
    at_low, at_high = values[function, begin], values[function, end]
    first, second = slice(len(segment), len(segment) + len(beyond.node)), slice(len(function) - len(beyond.node), None)
    low[second] = high[first] = beyond.place
    at_low[second] = at_high[first] = beyond.value

    def value(lane: Ints, x: Floats) -> Floats:
        found: Floats = line.sample(begin[lane], x)[0][rows[function[lane]], np.arange(len(lane))]
        return found

    place = _roots(value, low, at_low, high, at_high)
    found = value(np.arange(len(function)), place)
    crossed = Places(function, begin, end, place, found, 0 * begin)
    # A function that jumps from side to side is not zero between.
    return Places.joined([at_nodes, crossed.take(np.abs(found) <= touching), touched])


def peaks(line: PoseLine, rows: Ints, still: Floats, *, all_poses: bool = False) -> tuple[Peak, Peak]:
    """Smallest values of functions (rows of the line's values), and of them times -1.

    `still` is their rounding, shape (functions, designs); `all_poses` takes in the sweep's own poses, too.
    """

    def likely(sign: int, values: Floats, drop: Floats) -> Flags:
        best = line.least(sign * line.values[rows])[:, line.row[line.begin] // line.each]
        return np.asarray(np.fmin(values[:, 0], values[:, 1]) - drop < best)

    turned = turns(line, rows, likely)
    return tuple(  # type: ignore[return-value]
        _best(line, still, sign, sign * line.values[rows], turned.take(turned.sign == sign), all_poses)
        for sign in (1, -1)
    )


def searched(line: PoseLine, along: Along, table: Floats, still: Floats, *, poles: bool = False) -> Peak:
    """Smallest values of functions without slopes, by golden section beside the poses that are below their neighbours.

    `table` has their values at the poses of the line, shape (functions, n); at `poles` these are minus infinity.
    """
    before, after = np.arange(len(line.row)), np.arange(len(line.row))
    before[line.end], after[line.begin] = line.begin, line.end
    known = np.where(np.isnan(table), np.inf, table)
    best = line.least(known)[:, line.row // line.each]
    with np.errstate(invalid="ignore"):
        around = [np.where(np.isfinite(known[:, side]), known[:, side] - known, 0.0) for side in (before, after)]
        fall = np.maximum(*around)
        function, node = np.nonzero(np.isfinite(known) & (around[0] >= 0) & (around[1] >= 0) & (known - fall <= best))

    def value(x: Floats) -> Floats:
        one = along(node, x)[function, np.arange(len(node))]
        return np.where(np.isnan(one), np.inf, one)

    at = np.stack([line.place[before[node]], line.place[node], line.place[after[node]]])
    for row, side in ((0, before[node]), (2, after[node])) if poles else ():
        # Beyond a zero or a pole the function may fall again.
        lanes = np.flatnonzero(known[function, node] * table[function, side] < 0)

        def beside_pose(lane: Ints, x: Floats, some: Ints = lanes) -> Floats:
            return np.asarray(along(node[some[lane]], x)[function[some[lane]], np.arange(len(lane))])

        ends = table[function[lanes], node[lanes]], table[function[lanes], side[lanes]]
        at[row, lanes] = _roots(beside_pose, at[1, lanes], ends[0], at[row, lanes], ends[1])
    low, high = at.min(axis=0), at.max(axis=0)
    place, least = lowest(value, low, high) if len(node) else (low, low)
    if poles and len(node):
        size = -line.least(-np.abs(table))[function, line.row[node] // line.each]
        beside = [value(place + part * (end - place)) for part in (POLE, 2 * POLE) for end in (low, high)]
        known = np.where(np.isfinite(beside), beside, -np.inf).max(axis=0)
        least = np.where((least < -size) & (least < 2 * known), -np.inf, least)
    # Which of the two segments beside the pose it lies in.
    ahead = (place - line.place[node]) * (line.place[after[node]] - line.place[node]) > 0
    found = Places(function, node, np.where(ahead, after[node], before[node]), place, least, np.ones_like(node))
    return _best(line, still, 1, table, found.take(least < np.inf), False)


def _best(line: PoseLine, still: Floats, sign: int, values: Floats, between: Places, all_poses: bool) -> Peak:
    """Of a line's poses (`values` times the sign) and places between, the first along the sweep of the smallest."""
    candidates = np.isfinite(values)
    if not all_poses:
        candidates &= line.position != np.round(line.position)
    if line.followed:
        sharp = line.sharp()
        sharp[line.limits] = True
        candidates &= sharp
    with np.errstate(invalid="ignore"):
        candidates &= values <= (line.least(values) + still)[:, line.row // line.each]
    function, node = np.nonzero(candidates)
    function, node = np.concatenate([function, between.function]), np.concatenate([node, between.node])
    count = len(node) - len(between.node)
    table = np.stack([
        np.concatenate([values[function[:count], node[:count]], sign * between.value]),
        np.concatenate([line.place[node[:count]], between.place]),
        np.concatenate([line.position[node[:count]], between.position(line)]),
    ])  # fmt: skip
    lane = function * still.shape[1] + line.row[node] // line.each
    least = np.full(still.size, np.inf)
    np.minimum.at(least, lane, table[0])
    tie = np.flatnonzero(table[0] <= (least + still.ravel())[lane])
    tie = tie[np.lexsort((table[2, tie], lane[tie]))]
    lanes, chosen = np.unique(lane[tie], return_index=True)
    found, nodes = np.full((3, still.size), np.nan), np.zeros(still.size, dtype=np.intp)
    found[:, lanes], nodes[lanes] = table[:, tie[chosen]], node[tie[chosen]]
    value, place, position = found.reshape(3, *still.shape)
    return Peak(value, place, position, nodes.reshape(still.shape))


def needed(motion: Motion, names: Collection[str] | None) -> list[Coordinate]:
    """Coordinates that a line must follow for extremes of some outputs and errors, or all."""
    mechanism = motion.question.study.mechanism
    found = [output for output in motion.question.outputs if names is None or output.name in names]
    if any(names is None or error.name in names for error in motion.errors):
        found += [mechanism.coordinate(name) for name in targets.needed(motion.question.study, motion.question.poses)]
    return found


def functions(motion: Motion, names: Collection[str] | None) -> dict[str, Function]:
    """Efforts and mechanical advantages that a line must follow for the extremes of some, or of all."""
    question = motion.question

    def function(name: str) -> Function:
        mechanism = question.study.mechanism
        return Function(lambda configuration: statics(question, mechanism.linearize(configuration))[name], None)

    return {each.name: function(each.name) for each in question.statics if names is None or each.name in names}


def extremes(motion: Motion, swept: str | None, line: PoseLine | None, names: Collection[str] | None = None) -> Table:
    """Smallest and largest value of each output, error and effort over the motion, and the ratio of the times between.

    Where one coordinate is swept they are those of the whole motion, from limit to limit, between its poses too;
    elsewhere those of the valid poses. Efforts and mechanical advantages are infinite at their poles. `time_ratio` is
    the longer over the shorter part of a full turn of the swept angle between the two extremes, for a drive of constant
    speed; nan elsewhere. `min_at` is the swept coordinate, or the row where there is none.

    Between the poses those of `names` are searched, or all, along `line`, the motion along `swept`.
    """
    study, poses, outputs = motion.question.study, motion.question.poses, motion.question.outputs
    mechanism = study.mechanism
    each = poses.count // poses.designs
    curves = {output.name: (output.quantity, motion.arrays[output.name]) for output in outputs}
    curves |= {error.name: (error.quantity, error.values) for error in motion.errors}
    units = [study.units.label(quantity) for quantity, _ in curves.values()]
    for static in motion.question.statics:
        values = motion.arrays[static.name]
        curves[static.name] = ("none", np.where(np.isinf(values), np.nan, values))
        units.append(static.unit)
    at = poses.values[swept] if swept is not None else poses.numbers
    turn = 2 * np.pi / study.units.angle_factor
    sizes = {"length": mechanism.size, "angle": turn}
    # By curve and design; of both ends the pose, and value and place.
    table = np.stack([values for _, values in curves.values()])
    known = (motion.valid & np.isfinite(table)).reshape(len(table), poses.designs, each)
    begin, lane = np.arange(poses.designs) * each, np.arange(len(table))[:, None]
    row = begin + np.stack([
        np.where(known, sign * table.reshape(known.shape), np.inf).argmin(axis=2) for sign in (1, -1)
    ])  # fmt: skip
    low, high = table[lane, row]
    size = np.array([sizes.get(quantity, 0.0) for quantity, _ in curves.values()])[:, None]
    still = STILL * np.fmax(np.fmax(np.abs(low), np.abs(high)), size)
    # A curve that stands still has both extremes at its first pose.
    row = np.where(high - low > still, row, begin + known.argmax(axis=2))
    found = np.where(known.any(axis=2), np.stack([table[lane, row], at[row]], axis=1), np.nan)
    moving = np.asarray(found[1, 0] - found[0, 0] > still)
    if line is not None:
        _between(motion, line, names, found, row, still, moving)
    for k, static in enumerate(motion.question.statics, len(curves) - len(motion.question.statics)):
        infinite = (motion.valid & np.isposinf(motion.arrays[static.name])).reshape(poses.designs, each)
        place = at.reshape(infinite.shape)[np.arange(poses.designs), infinite.argmax(axis=1)]
        found[1, :, k] = np.where(infinite.any(axis=1), [np.full(poses.designs, np.inf), place], found[1, :, k])
    (low, low_at), (high, high_at) = found
    timed = np.zeros(poses.designs, dtype=bool)
    if line is not None and mechanism.quantity(line.swept) == "angle" and np.ptp(at) >= turn * (1 - 1e-9):
        timed = motion.valid.reshape(-1, each).all(axis=1) & ~line.torn & (not line.ends)
    part = np.where(timed & moving & np.isfinite(high - low), (high_at - low_at) % turn, np.nan)
    with np.errstate(divide="ignore"):
        ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
    ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row (from 0)'} at the"
    unit = study.units.label(mechanism.quantity(swept)) if swept is not None else ""
    return Table(
        "extremes",
        (
            Column(
                "output",
                np.tile(np.array(list(curves)), poses.designs),
                "",
                "output, error, effort or mechanical advantage, in its own unit",
            ),
            Column("min", low.T.ravel(), "", "smallest value over the motion, in `unit`"),
            Column("min_at", low_at.T.ravel(), unit, f"{where} smallest value"),
            Column("max", high.T.ravel(), "", "largest value over the motion, in `unit`"),
            Column("max_at", high_at.T.ravel(), unit, f"{where} largest value"),
            Column("range", (high - low).T.ravel(), "", "max - min, in `unit`"),
            Column("time_ratio", ratio.T.ravel(), "", "longer over shorter time between the extremes, constant speed"),
            Column("unit", np.tile(np.array(units, dtype=str), poses.designs), "", "unit of min, max and range"),
        ),
        "extremes of the outputs over the motion",
    )


def _between(
    motion: Motion, line: PoseLine, names: Collection[str] | None, found: Floats, row: Ints, still: Floats,
    moving: Flags,
) -> None:  # fmt: skip
    """Put better extremes than those of the poses into `found`: from between the poses, and at limits of the motion.

    `found` has value and place of the smallest and the largest, shape (2, 2, names, designs), `row` their poses; of
    shape (names, designs) are `still`, rounding, and `moving`, where those found to move are added.
    """
    study, outputs = motion.question.study, motion.question.outputs
    swept = study.mechanism.coordinate(line.swept)

    def take(peak: Peak, end: int, which: Sequence[int], *, exact: bool = False) -> None:
        sign = 1 - 2 * end
        value = np.where(np.isnan(found[end, 0, which]), np.inf, sign * found[end, 0, which])
        away, rounding = _rows_between(line, peak, row[end, which]), still[which]
        with np.errstate(invalid="ignore"):
            # Better, or that pose's own extreme, but beside it.
            beside = (np.abs(peak.value - value) <= rounding) & (away < 1) & (away > 1e-9) & moving[which] & exact
            lower = peak.value < value - rounding
        for part, new in enumerate((sign * peak.value, in_study_units(study, swept, peak.place))):
            found[end, part, which] = np.where(lower | beside, new, found[end, part, which])
        moving[which] |= lower

    mine = [k for k, output in enumerate(outputs) if names is None or output.name in names]
    rows = np.array([line.rows[outputs[k].name] for k in mine], dtype=np.intp)
    for end, peak in enumerate(peaks(line, rows, still[mine])):
        take(peak, end, mine, exact=True)
    wrong = list(range(len(outputs), len(outputs) + len(motion.errors)))
    if any(names is None or error.name in names for error in motion.errors):
        for end, sign in enumerate((1, -1)):
            along = _errors(motion, line, sign)
            every = np.arange(len(line.row))
            take(searched(line, along, along(every, line.place), still[wrong]), end, wrong)
    asked = functions(motion, names)
    held = [
        k for k, static in enumerate(motion.question.statics, len(outputs) + len(motion.errors)) if static.name in asked
    ]
    rows = np.array([line.rows[name] for name in asked], dtype=np.intp)
    for end, sign in enumerate((1, -1) if asked else ()):

        def effort(node: Ints, place: Floats, sign: int = sign) -> Floats:
            return np.asarray(sign * line.at(node, place)[rows])

        take(searched(line, effort, sign * line.values[rows], still[held], poles=True), end, held)


def _rows_between(line: PoseLine, peak: Peak, row: Ints) -> Floats:
    """How many rows of the sweep lie between peaks and poses."""
    poses = line.poses
    if poses.rows is None:
        return np.abs(peak.position - row)
    # Between the poses that stay of a long sweep there are others.
    given = line.given[line.which]
    order = np.argsort(given, kind="stable")
    return np.abs(np.interp(peak.place, given[order], poses.numbers[order]) - poses.numbers[row])


def _errors(motion: Motion, line: PoseLine, sign: int) -> Along:
    """Errors times a sign, beside poses of a line."""
    study, poses = motion.question.study, motion.question.poses
    names, wanted = [error.name for error in motion.errors], targets.needed(study, poses)
    held = {name: values for name, values in poses.groups[0].values.items() if name != line.swept}

    def along(node: Ints, place: Floats) -> Floats:
        row, values = line.row[node], line.at(node, place)
        known = {name: held[name][row] if name in held else values[line.rows[name]] for name in wanted}
        table = np.full((len(names), len(row)), np.nan)
        for error in targets.errors(study, poses, known, row, between=True):
            table[names.index(error.name)] = error.values
        return sign * table

    return along
