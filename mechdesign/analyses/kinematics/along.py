"""Columns of a motion as functions along its curve: what they are between the poses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.motion import Motion, MotionQuestion, rates_of_advantage
from mechdesign.analyses.poses import SolvedPoses
from mechdesign.curve.functions import Functions
from mechdesign.curve.motion import Curve, End
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.derivatives import Jacobian, conditionings
from mechdesign.mechanism.four_bars import FourBar
from mechdesign.mechanism.margins import SINGULARITY, Cause
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import POSES_ONLY, Column

# Names of functions that no column has: products that are zero where the drives hold the mechanism no longer, and where
# they cannot move what the poses give in every direction; and how fast the motion passes its places.
FORWARD, INVERSE, _PACE = "forward singularity", "inverse singularity", "pace"
# Places this near to a pose (in rows) or to zero (as a part of the range of what is swept) are at it; so near to a pose
# a zero that is only touched may be at it.
AT_ROW, AT_GIVEN_PLACE = 1e-9, 1e-12
NEAR_ROW = 1e-5
# A gap shorter than this part of the motion is rounding.
GAP = 1e-11


class Along:
    """Functions along the motions of a question.

    Parameters
    ----------
    names, also : collection of str
        Columns that are followed: those of the table of extremes where the first is left out, and others.
    loops : sequence of FourBar
        Four-bars and slider-cranks of which sines and cosines of transmission angles are followed, and with `toggles`
        of the angles between coupler and input.
    """

    def __init__(
        self, question: MotionQuestion, curve: Curve, names: Collection[str] | None = None,
        loops: Sequence[FourBar] = (), *, also: Collection[str] = (), toggles: bool = False, passages: bool = False,
    ) -> None:  # fmt: skip
        self.question, self.curve, self._loops, self._toggles = question, curve, loops, toggles
        study, mechanism = question.study, question.study.mechanism
        kinds = {"length": mechanism.size, "angle": 2 * np.pi / study.units.angle_factor}
        columns = {output.name: kinds.get(output.quantity, 0.0) for output in question.outputs}
        columns |= {name: kinds.get(quantity, 0.0) for name, quantity in targets.followed(study, question.poses)}
        columns |= {static.name: 0.0 for static in question.statics}
        wanted = dict.fromkeys([*(columns if names is None else names), *also])
        self._others = [name for name in wanted if name not in columns]
        columns = {name: size for name, size in columns.items() if name in wanted}
        columns |= dict.fromkeys(self._others, 0.0)
        self.columns = tuple(columns)
        drives = set(mechanism.drives)
        self._groups = []
        if passages and set(question.poses.names) != drives:
            structure = mechanism.forward.structure
            self._groups = [k for k, group in enumerate(structure.groups) if group.form != "place"]
        # Of the question only what the columns need is computed.
        self._lean = question if self._others else question.lean
        self._advantages = {
            f"{output}_advantage": (output, given) for output, given in question.section.mechanical_advantage.items()
        }
        functions = columns | {FORWARD: 1.0, INVERSE: 1.0, _PACE: 0.0}
        functions |= {f"rate of {name}": 0.0 for name in self._advantages}
        functions |= {f"group {k}": 1.0 for k in self._groups}
        ends = (0, 3) if toggles else (3,)
        lines = [f"{name} {k} {end}" for k in range(len(loops)) for end in ends for name in ("sine", "cosine")]
        functions |= dict.fromkeys(lines, 1.0)
        zeros = [*lines, *(f"group {k}" for k in self._groups), *self._others]
        means = [name for name in columns if name.endswith("_error")]
        self._names = list(functions)
        sizes = list(functions.values())
        self.functions = Functions(
            curve, self._names, self._evaluated, sizes, self._divisors(),
            extremes=[*columns, *lines], means=means, zeros=zeros,
        )  # fmt: skip

    def _divisors(self) -> dict[str, list[tuple[str, int]]]:
        """What functions with poles are divided by, and how often."""
        question = self.question
        rates = INVERSE if question.of_given else FORWARD
        found = {static.name: [(FORWARD, 1)] for static in question.statics}
        found |= {name: [(f"rate of {name}", 1)] for name in self._advantages}
        found |= {name: [(rates, 1)] for name in self._others if name.endswith("_velocity")}
        found |= {name: [(rates, 3)] for name in self._others if name.endswith("_acceleration")}
        found |= {name: [(FORWARD, 1)] for name in self._others if name == "det_J" or "_by_" in name}
        return {name: divisor for name, divisor in found.items() if name in self.columns}

    @quiet
    def _evaluated(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        poses, configuration = self.curve.solve(line, s, judged=False)
        motion = Motion(replace(self._lean, poses=poses), reason=configuration.reason.copy())
        linear = motion.fill(SolvedPoses(np.arange(len(s)), self.question.poses.groups[0].names, configuration))
        arrays: dict[str, Value] = dict(motion.arrays)
        whole = self.question.poses
        for error in targets.errors(self.question.study, whole, motion.arrays, line * whole.line, between=True):
            arrays[error.name] = error.values
        signed = conditionings(linear)
        arrays[_PACE] = whole.pace(line, s)
        arrays[FORWARD] = forward = np.prod(np.broadcast_arrays(np.ones(len(s)), *signed.values()), axis=0)
        arrays |= {f"group {k}": signed[k] for k in self._groups}
        if self.question.of_given and self._others:
            arrays[INVERSE] = self._inverse(linear, configuration) * forward
        for name, (output, given) in self._advantages.items():
            arrays[f"rate of {name}"] = rates_of_advantage(self.question, linear, output, given)[0] * forward
        for k, loop in enumerate(self._loops):
            for end in (0, 3) if self._toggles else (3,):
                arrays[f"sine {k} {end}"], arrays[f"cosine {k} {end}"] = loop.squareness(configuration, end)
        arrays |= {name: column for name, column in poses.values.items() if name not in arrays}
        self._known = arrays.keys()
        table = np.empty((len(self._names), len(s)))
        for row, name in zip(table, self._names, strict=True):
            row[:] = arrays.get(name, 1.0)
        return table, motion.arrays["conditioning"]

    def _inverse(self, linear, configuration: Configuration) -> Value:  # type: ignore[no-untyped-def]
        """Determinant of the derivatives of what the poses give by the drives, without units."""
        mechanism = self.question.study.mechanism
        given = [mechanism.coordinate(name) for name in self.question.poses.groups[0].names]
        size = mechanism.size
        rows = np.array([1 / size if c.quantity == "length" else 1.0 for c in given])
        columns = np.array([size if mechanism.quantity(name) == "length" else 1.0 for name in mechanism.drives])
        matrix = Jacobian.of(linear, given).matrix * rows[:, None] * columns
        return np.linalg.det(np.nan_to_num(matrix))

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

    @property
    def whole(self) -> Flags:
        """Motions without gaps, shape (lines,)."""
        return np.asarray(self.present == 1.0)

    def snapped(self, s: Floats) -> Floats:
        """Places along the motion; those at a pose exactly there."""
        return np.where(np.abs(s - np.round(s)) <= AT_ROW, np.round(s), s)

    def shown(self, line: Ints, s: Floats) -> Floats:
        """Places as tables have them: what is swept (study's unit), else in rows from 0; nan where there is none."""
        swept, poses = self.question.poses.swept, self.question.poses
        known = np.isfinite(s)
        places = self.snapped(np.where(known, s, 0.0))
        if swept is not None:
            given = poses.groups[0].values[swept].reshape(-1, poses.line)
            values = poses.along(line, places).values[swept]
            near = AT_GIVEN_PLACE * np.ptp(given)
            row = given[line, np.clip(np.round(places), 0, poses.line - 1).astype(np.intp)]
            places = np.where(np.abs(values - row) <= near, row, np.where(np.abs(values) <= near, 0.0, values))
        return np.where(known, places, np.nan)

    def place_columns(self, places: Floats, meaning: str) -> list[Column]:
        """Places of a single motion as columns: what is swept, or the row and all coordinates that move."""
        study, poses, line = self.question.study, self.question.poses, np.zeros(len(places), dtype=np.intp)
        if poses.swept is not None:
            unit = study.units.label(study.mechanism.quantity(poses.swept))
            return [Column(poses.swept, self.shown(line, places), unit, meaning)]
        values = poses.along(line, places).values
        moving = [name for name, column in poses.values.items() if np.ptp(column) > 0]
        return [
            Column("row", places, "", f"place along the path in rows from 0: {meaning}"),
            *(Column(c, values[c], study.units.label(study.mechanism.quantity(c)), "given") for c in moving),
        ]

    def at(self, line: Ints, s: Floats) -> dict[str, Floats]:
        """Every function at places of lines."""
        return dict(zip(self._names, self.functions.at(line, s), strict=True))

    def follows(self, name: str) -> bool:
        """Whether a column is a function along the motion."""
        pieces = self.curve.pieces
        if not len(pieces.line):
            return False
        self._evaluated(pieces.line[:1], pieces.nodes[0, :1])
        return name in self.columns and name in self._known

    def worst(self, name: str, sign: int, *, absolute: bool = False, still: float = 0.0) -> tuple[Floats, Floats]:
        """Largest value of a function times a sign over each motion, or of its absolute values times the sign; places.

        The value is that of the function, absolute where that is judged; nan where it has none. Of values within
        `still` the first along the motion counts.
        """
        rounding = np.full((1, self.curve.lines), still)
        peaks = {end: self.functions.extremes([name], end, rounding) for end in (1, -1)}
        high, low = (peaks[end].value[0] * end for end in (1, -1))
        places = {end: peaks[end].place[0] for end in (1, -1)}
        if not absolute:
            return (high, places[1]) if sign > 0 else (low, places[-1])
        if sign > 0:
            larger = high >= -low
            return np.where(larger, high, -low), np.where(larger, places[1], places[-1])
        # The smallest absolute value is zero where the function has both signs.
        zeros = self.functions.zeros([name], still)
        first = np.full(self.curve.lines, np.nan)
        order = np.argsort(-zeros.place, kind="stable")
        first[zeros.line[order]] = zeros.place[order]
        value = np.where(low > 0, low, -high)
        zero = np.isfinite(first)
        # A zero that is only touched is known to the root of rounding: at a pose beside it that is one, it is there.
        lines = np.flatnonzero(zero & (np.abs(first - np.round(first)) <= NEAR_ROW))
        at_row = self.functions.at(lines, np.round(first[lines]))[self._names.index(name)]
        lines = lines[np.abs(at_row) <= still]
        first[lines] = np.round(first[lines])
        return np.where(zero, 0.0, value), np.where(zero, first, np.where(low > 0, places[-1], places[1]))

    def mean(self, name: str, power: int = 1) -> Floats:
        """Mean of a power of a column over each motion, by the way along it, shape (lines,)."""
        return self.functions.means(name, power, _PACE)

    def at_end(self, end: End, name: str) -> float:
        """A function at an end of the motion; nan at infinity."""
        return np.nan if end.endless else self.functions.at_end(name, end.line, end.place, end.x)

    def passages(self) -> list[tuple[int, float, Cause]]:
        """Where motions pass a forward singularity, at which the drives hold the mechanism no longer: line, place."""
        structure, graph = self.question.study.mechanism.forward.structure, self.question.study.mechanism.graph
        zeros = self.functions.zeros([f"group {k}" for k in self._groups], AT_SINGULARITY)
        found = []
        for number, line, place in zip(zeros.function.tolist(), zeros.line.tolist(), zeros.place.tolist(), strict=True):
            joint = " ".join(graph.joined(structure.groups[self._groups[number]].edges))
            found.append((line, place, Cause(SINGULARITY, joint, joint, self._groups[number], "passed")))
        return sorted(found, key=lambda passage: passage[:2])


def over(what: str, along: Along | None, names: Sequence[str]) -> str:
    """The meaning of a table whose rows are numbers of some functions over a motion: what is of the poses only."""
    if along is None or along.curve.spent.any() or along.functions.unresolved.any():
        return f"{what} {POSES_ONLY}"
    poses = [name for name in names if name not in along.functions.names]
    return f"{what} over the motion" + (f"; of {', '.join(poses)} {POSES_ONLY}" if poses else "")


# A group is singular where its conditioning is below this and turns back or ends.
AT_SINGULARITY = 1e-9
