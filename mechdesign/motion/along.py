"""Columns of a question as functions along a motion, so between its poses as well."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial

import numpy as np

from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.numerics.rounding import STILL, cleared, larger, unchanging
from mechdesign.ground.results import TableKind
from mechdesign.ground.statistics import Part, Request
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.derivatives import regularity
from mechdesign.motion.curve import Curve
from mechdesign.motion.ends import Ends, MotionEnd
from mechdesign.motion.functions import Extremes, Functions
from mechdesign.motion.motion import GIVEN, Motion, SolvedPoses
from mechdesign.motion.parts import within
from mechdesign.motion.series import Evaluate

# Prefix of the quotient of a function with poles, from which its mean is taken; how fast a motion passes its places.
MEAN_OF, PACE = "mean of ", "pace"
# Prefix of what is zero where a column goes to infinity.
BELOW = "below "
# A place within this many rows of a pose is that pose.
AT_ROW = 1e-9
# A swept value within this part of its range from a pose's value, or from zero, is that value.
AT_GIVEN_PLACE = 1e-12
# A zero that a column only touches is at a pose within this many rows.
NEAR_ROW = 1e-5
# A gap shorter than this part of the motion is rounding.
GAP = 1e-11


class AlongMotion:
    """Functions along the motions of a curve.

    A question sets `curve`; `columns`, those that are followed; `_names`, all functions in the order of `_evaluated`;
    `_evaluate`, the same through change points; `_follow`, which makes their series; and `_means`, by the column the
    function whose mean is asked. Columns `of_poses` are never followed.
    """

    curve: Curve
    columns: Sequence[str]
    of_poses: Collection[str] = ()
    _names: list[str]
    _means: Mapping[str, str]
    _evaluate: Evaluate
    _evaluated: Evaluate
    _evaluated_names: frozenset[str] = frozenset()
    _follow: Callable[[], Functions]

    def __init__(self, requests: Collection[Request]) -> None:
        self._requests, self._within = requests, dict[Part, AlongMotion]()
        self._worst = dict[tuple[str, int, bool, float], tuple[Floats, Floats]]()

    def again(self, curve: Curve, requests: Collection[Request], also: Collection[str] = ()) -> AlongMotion:
        """The same along another part of the motion."""
        raise NotImplementedError

    @property
    def means_over(self) -> str:
        """What means are over, in words, where it is not what changes evenly with time though velocities are given."""
        return ""

    @cached_property
    def ends(self) -> Ends:
        """Where the motions end."""
        return Ends(self.curve)

    @cached_property
    def functions(self) -> Functions:
        """The functions, followed where they matter."""
        return self._follow()

    @cached_property
    def peaks(self) -> Extremes:
        """Extremes of all columns, sought together in a part of the time that each takes by itself."""
        return self.functions.extremes(self.columns, np.zeros((len(self.columns), self.curve.lines)))

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
        poses = self.curve.poses
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
        motion, poses = self.curve.motion, self.curve.poses
        if poses.swept is not None:
            columns = table.columns(of_swept(motion, poses.swept, ""), **{"<swept>": self.shown(line, places)})
        else:
            columns = table.columns({}, row=places)
        values = poses.along(line, places).values
        others = [name for name in poses.moving if name != poses.swept]
        return columns + [GIVEN.column(values[name], motion.unit_of(name), coordinate=name) for name in others]

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
        if "peaks" in vars(self) and name in self.columns and not still:
            peaks, k = self.peaks, self.columns.index(name)
        else:
            peaks, k = self.functions.extremes([name], np.full((1, self.curve.lines), still)), 0
        low, high = cleared(peaks.value[:, k], STILL * self.functions.size(name))
        # What is the same everywhere has no place.
        constant = unchanging(low, high, self.functions.size(name))
        if absolute and sign < 0:
            values, places = self.least([name], still)
            return values[0], np.where(constant, np.nan, places[0])
        low_at, high_at = np.where(constant, np.nan, peaks.place[:, k])
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
        return self.functions.means(self._means.get(name, name), power, PACE, absolute=absolute)

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
        if not self._evaluated_names and any(request.part for request in self._requests):
            self._evaluated(pieces.line[:1], pieces.nodes[0, :1])
        elif not self._evaluated_names:
            # Where they are followed, as they will be, they are evaluated.
            _ = self.functions
        return self._evaluated_names >= {*names}

    def _ends(self, names: Collection[str]) -> dict[str, int]:
        """Which extreme of a column is asked, where it is one of them."""
        whole = [request for request in self._requests if not request.part]
        ends = {name: {request.end for request in whole if request.column == name} for name in names}
        return {name: next(iter(sides)) for name, sides in ends.items() if len(sides) == 1}

    def _table(self, arrays: Mapping[str, Value], count: int) -> Floats:
        """The functions at so many places, by their names; those that have no value are 1."""
        self._evaluated_names = frozenset(arrays)
        table = np.empty((len(self._names), count))
        for row, name in zip(table, self._names, strict=True):
            row[:] = arrays.get(name.removeprefix(MEAN_OF), 1.0)
        return table

    def part(self, part: Part) -> AlongMotion:
        """The same over the part of the motion in which columns lie in intervals, whose ends are found on the curve."""
        if part not in self._within:
            places = self.again(self.curve, (), also=[name for name, _ in part])
            rows = [places._names.index(name) for name, _ in part]

            def values(line: Ints, s: Floats) -> tuple[Floats, Floats]:
                table, conditioning = places._evaluate(line, s)
                return table[rows], conditioning

            curve = within(places.curve, [interval for _, interval in part], values)
            requests = [request._replace(part=()) for request in self._requests if request.part == part]
            self._within[part] = self.again(curve, requests)
        return self._within[part]

    def at_ends(self, ends: Sequence[MotionEnd], names: Sequence[str]) -> Floats:
        """Functions at ends of the motions, shape (names, ends); nan at infinity."""
        line, x = (np.array([getattr(end, name) for end in ends], dtype=np.intp) for name in ("line", "x"))
        values = self.functions.at_ends(names, line, np.array([end.place for end in ends]), x)
        values[:, [end.endless for end in ends]] = np.nan
        return values


class PlainAlong(AlongMotion):
    """Columns that `values` gives at solved poses, along a motion.

    With those that are `poled`, which go to infinity at places, it gives functions that are zero there by their names
    after `BELOW`. Rounding is judged by what they are at most places.
    """

    def __init__(
        self, curve: Curve, values: Callable[[SolvedPoses], Mapping[str, Value]], requests: Collection[Request],
        also: Collection[str] = (), poled: Collection[str] = (),
    ) -> None:  # fmt: skip
        super().__init__(requests)
        self.curve, self._values, self._evaluate, self._poled = curve, values, self._evaluated, poled
        whole = [request for request in requests if not request.part]
        self.columns = tuple(dict.fromkeys([*also, *(request.column for request in whole)]))
        integrals = [request.column for request in whole if request.integral]
        self._below = {name: (f"{BELOW}{name}", 1) for name in self.columns if name in poled}
        # Means are of the quotient itself where a function has poles.
        self._means = {name: f"{MEAN_OF}{name}" if name in self._below else name for name in integrals}
        names = [*self.columns, *self._means.values(), *(name for name, _ in self._below.values())]
        self._names = [*dict.fromkeys(names), *([PACE] if integrals else [])]
        self._follow = self._series

    def _series(self) -> Functions:
        pieces = self.curve.pieces
        table = np.abs(self._evaluated(pieces.line, pieces.nodes[:, 0])[0])
        sizes = [float(np.median(row[np.isfinite(row)])) if np.isfinite(row).any() else 0.0 for row in table]
        return Functions(
            self.curve, self._names, self._evaluated, sizes, self._below, extremes=self.columns,
            means=list(self._means.values()), ends=self._ends(self.columns),
        )  # fmt: skip

    def again(self, curve: Curve, requests: Collection[Request], also: Collection[str] = ()) -> PlainAlong:
        return PlainAlong(curve, self._values, requests, also, self._poled)

    def _evaluated(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        there = self.curve.solve(line, s, judged=False)
        arrays = {**there.poses.named, **self._values(there), PACE: self.curve.poses.pace(line, s)}
        linear = self.curve.mechanism.linearize(there.configuration)
        return self._table(arrays, len(s)), np.broadcast_to(regularity(linear), s.shape)


def of_swept(motion: Motion, swept: str | None, otherwise: str) -> dict[str, str]:
    """For columns that hold what is swept: its name and unit; where nothing is, what they hold otherwise."""
    unit = "" if swept is None else motion.unit_of(swept)
    return {"swept": swept or otherwise, "as what is swept": unit}
