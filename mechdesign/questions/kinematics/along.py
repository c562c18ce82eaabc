"""Columns of a motion as functions along its curve, so between the poses as well."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from mechdesign.curve.ends import End, Ends
from mechdesign.curve.functions import Functions
from mechdesign.curve.motion import Curve
from mechdesign.curve.parts import within
from mechdesign.curve.series import Evaluate
from mechdesign.curve.through import Through
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.coordinates import angles_of
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.four_bars import FourBar
from mechdesign.mechanism.margins import SINGULARITY, Cause
from mechdesign.mechanism.outputs import first
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.rounding import STILL, cleared, larger
from mechdesign.questions.columns import GIVEN
from mechdesign.questions.dynamics.schema import EFFICIENCIES
from mechdesign.questions.friction import APART
from mechdesign.questions.kinematics import corners, targets
from mechdesign.questions.kinematics.columns import OVER
from mechdesign.questions.kinematics.motion import Motion, pole
from mechdesign.questions.kinematics.question import MotionQuestion
from mechdesign.questions.kinematics.rates import moving_at, unitless
from mechdesign.questions.poses import SolvedPoses, in_study_units, unit_of
from mechdesign.results import POSES_ONLY, Column, TableKind
from mechdesign.statistics import Part, Request
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Names of functions that no column has: products that are zero where the drives hold the mechanism no longer, and where
# they cannot move what the poses give in every direction; and how fast the motion passes its places.
FORWARD, INVERSE, _PACE = "forward singularity", "inverse singularity", "pace"
# Columns that have a corner where the mechanism is singular.
_CONDITIONS = ("conditioning", "inverse_condition")
# Prefix of the quotient of a function with poles, from which its mean is taken.
_MEAN_OF = "mean of "
# A place within this many rows of a pose is that pose.
AT_ROW = 1e-9
# A swept value within this part of its range from a pose's value, or from zero, is that value.
AT_GIVEN_PLACE = 1e-12
# A zero that a column only touches is at a pose within this many rows.
NEAR_ROW = 1e-5
# A gap shorter than this part of the motion is rounding.
GAP = 1e-11


class Along:
    """Functions along the motions of a question.

    Parameters
    ----------
    names, also : collection of str
        Columns that are followed: those of the table of extremes where the first is left out, and others.
    requests : collection of Request
        Columns that are followed over the motion or parts of it, whether their means are asked, and which extremes.
    loops : sequence of FourBar
        Four-bars and slider-cranks of which sines and cosines of transmission angles are followed, and with `toggles`
        of the angles between coupler and input.
    """

    def __init__(
        self, question: MotionQuestion, curve: Curve, names: Collection[str] | None = None,
        loops: Sequence[FourBar] = (), *, also: Collection[str] = (), requests: Collection[Request] = (),
        toggles: bool = False, passages: bool = False,
    ) -> None:  # fmt: skip
        self.question = question
        self._loops, self._toggles = loops, toggles
        mechanism, sizes = question.study.mechanism, question.sizes
        columns = {output.name: sizes.get(output.quantity, 0.0) for output in question.outputs}
        columns |= {name: sizes.get(quantity, 0.0) for name, quantity in question.errors.items()}
        # Efficiencies lose all digits where no power flows: they are those of the poses.
        columns |= {s.name: s.size for s in question.statics if s.name not in EFFICIENCIES}
        columns |= dict.fromkeys(question.clearances, sizes["length"])
        self._requests, self._within = requests, dict[Part, Along]()
        self._worst = dict[tuple[str, int, bool, float], tuple[Floats, Floats]]()
        whole = [request for request in requests if not request.part]
        shown = {*((*columns, *question.rates) if names is None else names), *also}
        judged = dict.fromkeys([*also, *(request.column for request in whole)])
        followed = dict.fromkeys([*((*columns, *question.rates) if names is None else names), *judged])
        columns |= {name: size for name, size in question.parts.items() if name in followed}
        self._others = [name for name in followed if name not in columns]
        columns = {name: size for name, size in columns.items() if name in followed}
        columns |= dict.fromkeys(self._others, 0.0) | {
            name: sizes.get(quantity, 0.0) * question.tempo**order
            for name, (quantity, order) in question.orders.items()
            if name in followed
        }
        self.columns = tuple(columns)
        ends = {
            name: {request.end for request in whole if request.column == name} for name in columns if name not in shown
        }
        drives = set(mechanism.drives)
        self._groups = []
        if passages and set(question.poses.names) != drives:
            structure = mechanism.forward.structure
            self._groups = [k for k, group in enumerate(structure.groups) if group.solved]
        needed = {*columns, *(name for request in requests for name in request.columns)}
        self._errors = any(name.endswith("_error") for name in needed)
        self._poles = [name for name in question.poled if name in columns]
        self._chains: dict[str, tuple[int, ...]] = {}
        divisors = self._divisors()
        # The part of the question that the columns need.
        self._lean = question.lean(needed)
        self.curve = curve = corners.divided(self._lean, curve, errors=self._errors)
        angles = {angle.name for angle in curve.angles}
        self._turning = not angles.isdisjoint(angles_of(corners.evaluated(self._lean)))
        below = {name for name, _ in divisors.values()}
        integrals = {request.column for request in whole if request.integral}
        functions = columns | {name: 1.0 for name in (FORWARD, INVERSE, *self._chains) if name in below}
        functions |= {_PACE: 0.0} if self._errors or integrals else {}
        functions |= {f"rate of {name}": 0.0 for name in self._poles}
        functions |= {f"group {k}": 1.0 for k in self._groups}
        arms = (0, 3) if toggles else (3,)
        lines = [f"{name} {k} {end}" for k in range(len(loops)) for end in arms for name in ("sine", "cosine")]
        functions |= dict.fromkeys(lines, 1.0)
        zeros = [*lines, *(f"group {k}" for k in self._groups), *(name for name in self._others if name in judged)]
        # Means are of the quotient itself where a function has poles.
        self._means = {name: f"{_MEAN_OF}{name}" if name in divisors else name for name in columns if name in integrals}
        functions |= {f"{_MEAN_OF}{name}": columns[name] for name in self._means if name in divisors}
        means = [*(name for name in columns if name.endswith("_error")), *self._means.values()]
        self._names = list(functions)
        magnitudes = [static.name for static in question.statics if static.magnitude]
        self._evaluate: Evaluate = self._evaluated
        if curve.plan.change_points is not None:
            smooth = [name not in _CONDITIONS for name in self._names]
            self._evaluate = Through(curve, self._evaluated, corners.determinant(question.study, curve), smooth)
        self._follow = partial(
            Functions, curve, self._names, self._evaluate, list(functions.values()), divisors,
            extremes=[*columns, *lines], means=means, zeros=zeros,
            magnitudes=[name for name in (*magnitudes, *_CONDITIONS) if name in columns],
            ends={name: next(iter(sides)) for name, sides in ends.items() if len(sides) == 1},
        )  # fmt: skip

    @cached_property
    def ends(self) -> Ends:
        """Where the motions end."""
        return Ends(self.curve)

    @cached_property
    def functions(self) -> Functions:
        """The functions, followed where they matter."""
        return self._follow()

    def _divisors(self) -> dict[str, tuple[str, int]]:
        """What functions with poles are divided by, and how often."""
        question = self.question
        rates = INVERSE if question.inverse else FORWARD
        divisors = dict.fromkeys((*(static.name for static in question.statics), *question.parts), (FORWARD, 1))
        divisors |= {name: (f"rate of {name}", 1) for name in self._poles}
        for name in self._others:
            output, _, order = name.rpartition("_")
            if output in question.study.mechanism.drives and not question.inverse:
                continue  # of their own rates, which have no poles
            if order in (powers := {"velocity": 1, "acceleration": 3}):
                divisors[name] = (rates if question.inverse else self._chain(output), powers[order])
        divisors |= {name: (FORWARD, 1) for name in self._others if name == "det_J" or "_by_" in name}
        return {name: divisor for name, divisor in divisors.items() if name in self.columns}

    def _chain(self, output: str) -> str:
        """The product of the conditionings of the groups that an output follows from, by name: its rates end there."""
        mechanism = self.question.study.mechanism
        structure = mechanism.forward.structure
        behind = sorted(structure.behind(mechanism.coordinate(output), mechanism.graph))
        groups = tuple(k for k in behind if structure.groups[k].solved)
        name = " ".join([FORWARD, *(str(k) for k in groups)])
        self._chains[name] = groups
        return name

    @quiet
    def _evaluated(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        poses, configuration = self.curve.solve(line, s, judged=False, turning=self._turning)
        motion = Motion(replace(self._lean, poses=poses), reason=configuration.reason.copy())
        linear = motion.fill(SolvedPoses(np.arange(len(s)), self.question.poses.groups[0].names, configuration))
        arrays: dict[str, Value] = dict(motion.arrays)
        whole = self.question.poses
        if _PACE in self._names:
            arrays[_PACE] = self._pace(line, s, poses, linear)
        if self._errors:
            rows = line * whole.line
            for error in targets.errors(self.question.study, whole, motion.arrays, rows, between=True):
                arrays[error.name] = error.values
        signed = linear.conditionings
        forward = np.prod(np.broadcast_arrays(np.ones(len(s)), *signed.values()), axis=0)
        arrays[FORWARD] = np.abs(forward) if corners.passes_singularities(self._lean) else forward
        arrays |= {f"group {k}": signed[k] for k in self._groups}
        for chain, groups in self._chains.items():
            arrays[chain] = np.prod(np.broadcast_arrays(np.ones(len(s)), *(signed[k] for k in groups)), axis=0)
        if INVERSE in self._names:
            # Determinant of the derivatives of what the poses give by the drives.
            mechanism = self.question.study.mechanism
            outputs = [mechanism.coordinate(name) for name in whole.groups[0].names]
            matrix = unitless(mechanism, linear, outputs)[1]
            arrays[INVERSE] = np.asarray(np.linalg.det(np.nan_to_num(matrix))) * forward
        for name in self._poles:
            arrays[f"rate of {name}"] = pole(motion, linear, name) * forward
        for k, loop in enumerate(self._loops):
            for end in (0, 3) if self._toggles else (3,):
                arrays[f"sine {k} {end}"], arrays[f"cosine {k} {end}"] = loop.squareness(configuration, end)
        arrays |= {name: column for name, column in poses.named.items() if name not in arrays}
        self._evaluated_names = frozenset(arrays)
        table = np.empty((len(self._names), len(s)))
        for row, name in zip(table, self._names, strict=True):
            row[:] = arrays.get(name.removeprefix(_MEAN_OF), 1.0)
        return table, np.minimum(motion.arrays["conditioning"], motion.arrays.get(APART, 1.0))

    def _pace(self, line: Ints, s: Floats, poses: Poses, linear: Linearization) -> Value:
        """What means are over, by row: time where the study says so, else that of `Poses.pace`."""
        question, study, whole = self.question, self.question.study, self.question.poses
        if question.section.means is None or question.section.clocked(whole.swept):
            return whole.pace(line, s)
        solved = SolvedPoses(np.arange(poses.count), whole.groups[0].names, linear.configuration)
        velocity = moving_at(study, question.section, poses, solved, linear).velocity
        assert velocity is not None
        if whole.path is not None:
            return whole.pace(line, s) / np.abs(velocity.nodes[study.mechanism.graph.node(whole.path)])
        coordinate = study.mechanism.coordinate(whole.swept or whole.moving[0])
        speed = in_study_units(study, coordinate, first(linear.configuration, coordinate, velocity))
        return whole.pace(line, s, coordinate.name) / np.abs(speed)

    @property
    def means_over(self) -> str:
        """What means are over, in words, where it is not what changes evenly with time though velocities are given."""
        section, poses = self.question.section, self.question.poses
        if not section.rated or section.means is not None or section.clocked(poses.swept):
            return ""
        return f"the length of the path of {poses.path}" if poses.path is not None else poses.swept or "the poses"

    @cached_property
    def present(self) -> Floats:
        """Part of each motion on which the mechanism assembles within its limits, shape (lines,)."""
        pieces, end = self.curve.pieces, self.curve.poses.end
        lengths = np.bincount(pieces.line, pieces.end - pieces.begin, self.curve.lines)
        gaps = np.zeros(self.curve.lines, dtype=np.intp)
        ends = np.flatnonzero(np.append(~pieces.joined_to_next, True)[: len(pieces.line)])
        # Between the pieces of a motion that is whole nothing lies but rounding.
        for k in ends.tolist():
            begin = pieces.begin[k + 1] if k + 1 < len(pieces.line) and pieces.line[k + 1] == pieces.line[k] else end
            gaps[pieces.line[k]] += begin - pieces.end[k] > GAP * end
        first = np.flatnonzero(np.append(True, pieces.line[1:] != pieces.line[:-1])[: len(pieces.line)])
        gaps[pieces.line[first]] += pieces.begin[first] > GAP * end
        part = np.minimum(lengths / end, np.nextafter(1.0, 0.0))
        return np.where(self.curve.spent, np.nan, np.where((gaps == 0) & (lengths > 0), 1.0, part))

    def missing(self, design: int) -> str:
        """How much of the motion of a design is missing, in words; empty of a motion without gaps."""
        return "" if self.whole[design] else f"{100 * (1 - self.present[design]):.3g} % of the motion is missing"

    @property
    def whole(self) -> Flags:
        """Motions without gaps, shape (lines,)."""
        return np.asarray(self.present == 1.0)

    def snapped(self, s: Floats) -> Floats:
        """Places along the motion; those at a pose exactly there."""
        return np.where(np.abs(s - np.round(s)) <= AT_ROW, np.round(s), s)

    def shown(self, line: Ints, s: Floats) -> Floats:
        """Places as tables have them: what is swept (study's unit), else in rows from 0; nan where there is none."""
        poses = self.question.poses
        finite = np.isfinite(s)
        places = self.snapped(np.where(finite, s, 0.0))
        if poses.swept is not None:
            swept_values = poses.abscissa.reshape(-1, poses.line)
            values = poses.along(line, places).named[poses.swept]
            near = AT_GIVEN_PLACE * np.ptp(swept_values)
            row = swept_values[line, np.clip(np.round(places), 0, poses.line - 1).astype(np.intp)]
            places = np.where(np.abs(values - row) <= near, row, np.where(np.abs(values) <= near, 0.0, values))
        return np.where(finite, places, np.nan)

    def place_columns(self, table: TableKind, line: Ints, places: Floats) -> list[Column]:
        """Places of motions as columns of a table: what is swept, or the row, and all other coordinates that move."""
        study, poses = self.question.study, self.question.poses
        if poses.swept is not None:
            columns = table.columns(of_swept(study, poses.swept, ""), **{"<swept>": self.shown(line, places)})
        else:
            columns = table.columns({}, row=places)
        values = poses.along(line, places).values
        others = [name for name in poses.moving if name != poses.swept]
        return columns + [GIVEN.column(values[name], unit_of(study, name), coordinate=name) for name in others]

    def at(self, line: Ints, s: Floats) -> dict[str, Floats]:
        """Every function at places of lines."""
        return dict(zip(self._names, self.functions.at(line, s), strict=True))

    def worst(self, name: str, sign: int, *, absolute: bool = False, still: float = 0.0) -> tuple[Floats, Floats]:
        """Largest value of a function times a sign over each motion, or of its absolute values times the sign; places.

        The value is that of the function, absolute where that is judged; nan where it has none. Of values within
        `still` the first along the motion counts.
        """
        key = name, sign, absolute, still
        if key not in self._worst:
            self._worst[key] = self._worst_of(*key)
        return self._worst[key]

    def _worst_of(self, name: str, sign: int, absolute: bool, still: float) -> tuple[Floats, Floats]:
        if absolute and sign < 0:
            values, places = self.least([name], still)
            return values[0], places[0]
        peaks = self.functions.extremes([name], np.full((1, self.curve.lines), still))
        low, high = cleared(peaks.value[:, 0], STILL * self.functions.size(name))
        # What is rounding everywhere has no place.
        low_at, high_at = np.where((low == 0) & (high == 0), np.nan, peaks.place[:, 0])
        if not absolute:
            return (high, high_at) if sign > 0 else (low, low_at)
        upper = larger(low, high, low_at, high_at, STILL * np.maximum(high, -low))
        return np.where(upper, high, -low), np.where(upper, high_at, low_at)

    def least(self, names: Sequence[str], still: float) -> tuple[Floats, Floats]:
        """Smallest absolute values of functions over each motion, and their places; shape (names, lines).

        They are zero where the function has both signs, or comes within `still` of zero and turns back.
        """
        shape = len(names), self.curve.lines
        peaks = self.functions.extremes(names, np.full(shape, still))
        (low, high), (low_at, high_at) = peaks.value, peaks.place
        zeros = self.functions.zeros(names, still)
        first = np.full(shape, np.nan)
        order = np.argsort(-zeros.place, kind="stable")
        first[zeros.function[order], zeros.line[order]] = zeros.place[order]
        value, place = np.where(low > 0, low, -high), np.where(low > 0, low_at, high_at)
        zero = np.isfinite(first)
        # It jumps over zero at a corner or a gap: the square has no sign.
        jumps = ~zero & (low <= 0) & (high >= 0)
        for k in np.flatnonzero(jumps.any(axis=1)).tolist():
            own = partial(self._squared, names[k])
            squared = Functions(self.curve, [names[k]], own, [0.0], extremes=[names[k]])
            smallest = squared.extremes(names[k : k + 1], np.full((1, shape[1]), still**2))
            value[k] = np.where(jumps[k], np.sqrt(np.maximum(smallest.value[0, 0], 0.0)), value[k])
            place[k] = np.where(jumps[k], smallest.place[0, 0], place[k])
        # A zero that is only touched is known to the root of rounding: at a pose beside it that is one, it is there.
        lanes, lines = np.nonzero(zero & (np.abs(first - np.round(first)) <= NEAR_ROW))
        if len(lanes):
            rows = np.array([self._names.index(name) for name in names])[lanes]
            at_row = self.functions.at(lines, np.round(first[lanes, lines]))[rows, np.arange(len(lanes))]
            good = np.abs(at_row) <= still
            first[lanes[good], lines[good]] = np.round(first[lanes[good], lines[good]])
        return np.where(zero, 0.0, value), np.where(zero, first, place)

    def _squared(self, name: str, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        table, conditioning = self._evaluate(line, s)
        return table[[self._names.index(name)]] ** 2, conditioning

    def lost(self, name: str) -> Floats:
        """Part of each motion on which a column has no value, shape (lines,)."""
        return self.functions.lost(name)

    def mean(self, name: str, power: int = 1, *, absolute: bool = False) -> Floats:
        """Mean of a power of a column, or of its absolute value, over each motion, by the way along it."""
        return self.functions.means(self._means.get(name, name), power, _PACE, absolute=absolute)

    def integral(self, name: str, s: Floats) -> Floats:
        """Integral over rows of a column whose mean is asked, from the begin of the first motion to places in it."""
        return self.functions.integral(self._means.get(name, name), np.zeros(len(s), dtype=np.intp), s)[0]

    def crossings(self, name: str, level: float) -> Floats:
        """Places of the first motion at which such a column passes a level."""
        line, place = self.functions.crossings(self._means.get(name, name), [level], 0.0)
        return np.asarray(place[line == 0])

    def knows(self, names: Collection[str]) -> bool:
        """Whether some columns have values along the motions."""
        pieces = self.curve.pieces
        if not len(pieces.line):
            return False
        self._evaluated(pieces.line[:1], pieces.nodes[0, :1])
        return self._evaluated_names >= {*names}

    def part(self, part: Part) -> Along:
        """The same over the part of the motion in which columns lie in intervals, whose ends are found on the curve."""
        if part not in self._within:
            places = Along(self.question, self.curve, (), also=[name for name, _ in part])
            rows = [places._names.index(name) for name, _ in part]

            def values(line: Ints, s: Floats) -> tuple[Floats, Floats]:
                table, conditioning = places._evaluate(line, s)
                return table[rows], conditioning

            curve = within(places.curve, [interval for _, interval in part], values)
            requests = [request._replace(part=()) for request in self._requests if request.part == part]
            self._within[part] = Along(self.question, curve, (), requests=requests)
        return self._within[part]

    def at_ends(self, ends: Sequence[End], names: Sequence[str]) -> Floats:
        """Functions at ends of the motions, shape (names, ends); nan at infinity."""
        line, x = (np.array([getattr(end, name) for end in ends], dtype=np.intp) for name in ("line", "x"))
        values = self.functions.at_ends(names, line, np.array([end.place for end in ends]), x)
        values[:, [end.endless for end in ends]] = np.nan
        return values

    def passages(self) -> list[tuple[int, float, Cause]]:
        """Where motions pass a forward singularity, at which the drives hold the mechanism no longer: line, place."""
        structure, graph = self.question.study.mechanism.forward.structure, self.question.study.mechanism.graph
        zeros = self.functions.zeros([f"group {k}" for k in self._groups], AT_SINGULARITY)
        passages = []
        joints = [" ".join(graph.joined(structure.groups[k].edges)) for k in self._groups]
        for number, line, place in zip(zeros.function.tolist(), zeros.line.tolist(), zeros.place.tolist(), strict=True):
            joint = joints[number]
            passages.append((line, place, Cause(SINGULARITY, joint, joint, self._groups[number], "passed")))
        return sorted(passages, key=lambda passage: passage[:2])


def along_of(
    question: MotionQuestion, names: Collection[str] | None = None, loops: Sequence[FourBar] = (), *,
    also: Collection[str] = (), requests: Collection[Request] = (), toggles: bool = False, passages: bool = False,
) -> Along | None:  # fmt: skip
    """The motions of a question between their poses; None of listed poses and grids, and where none can be followed."""
    curve = question.curve
    if curve is None or curve.spent.all():
        return None
    return Along(question, curve, names, loops, also=also, requests=requests, toggles=toggles, passages=passages)


def over(along: Along | None, names: Sequence[str]) -> dict[str, str]:
    """For the meaning of a table of numbers of some functions over a motion: which of them are of the poses only."""
    if along is None or along.curve.spent.any() or along.functions.unresolved.any():
        return {OVER: POSES_ONLY}
    poses = [name for name in names if name not in along.functions.names]
    means = f", means over {along.means_over} and not time" if along.means_over else ""
    return {OVER: "over the motion" + means + (f"; of {', '.join(poses)} {POSES_ONLY}" if poses else "")}


def of_swept(study: Study, swept: str | None, otherwise: str) -> dict[str, str]:
    """For columns that hold what is swept: its name and unit; where nothing is, what they hold otherwise."""
    unit = "" if swept is None else unit_of(study, swept)
    return {"swept": swept or otherwise, "as what is swept": unit}


# A group is singular where its conditioning is below this and turns back or ends.
AT_SINGULARITY = 1e-9
