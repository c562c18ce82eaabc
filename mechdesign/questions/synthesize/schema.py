"""The synthesis section of the study file: a task, what linkages must keep, and how they are ranked."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag

from mechdesign.questions.reliability.schema.clearances import Clearance
from mechdesign.questions.reliability.schema.variation import Dimension
from mechdesign.questions.synthesize.declared import BODIES, FOUR_BAR, FUNCTIONS, PATHS, links, starting
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.loads import Load, check_loads
from mechdesign.study.text import fields
from mechdesign.study.text.reading import failure, shown

_KINDS = {
    "four_bar": "two links hold the coupler",
    "slider_crank": "a link, and a slide of the frame on which a pin of the coupler moves",
    "inverted_slider_crank": "a link, and a slide of the coupler through a pin of the frame",
    "trammel": "two slides of the frame",
    "inverted_trammel": "two slides of the coupler",
    "conchoid": "a slide of the frame and one of the coupler",
    "watt": "Watt's six-bar, P on the second coupler",
    "stephenson": "Stephenson's six-bar of type III, P on the second coupler",
}
_ZEROS = {
    "free": "angles count from any line of a link, places from any point of the slide",
    "fixed": "angles are those of the links, or of their other ends, places count from the crank's pivot",
}
_DEFECTS = {"listed": "behind those without a defect", "dropped": "they are counted, and left out"}
_RANKS = {
    "error": "the smallest error first", "yield": "the largest share of made linkages that keep the limit first",
    "transmission": "the largest of the smallest transmission angles first", "size": "the smallest linkage first",
}  # fmt: skip
_PAIR = fields.pair_of("[x, y]")
_RANGE = fields.pair_of("[least, greatest]")
Range = Annotated[tuple[fields.Length, fields.Length], _RANGE]
Point = Annotated[tuple[fields.Length, fields.Length], _PAIR]
# Most points of a path, and positions of a body or pairs of a function.
MOST_POINTS, MOST_POSITIONS = 10_000, 1000
# Conditions that hold without being written: pivots within so many sizes of the task, and a ratio of lengths.
REACH, RATIO = 3.0, 6.0


class BodyPosition(fields.Model):
    """A position of a body: the place of its origin, and its angle."""

    x: fields.Length
    """Place of the body's origin. Example: 2"""
    y: fields.Length
    """Example: 1"""
    angle: fields.Angle
    """Angle of the body's x axis. Example: 30"""


class FunctionTask(fields.Model):
    """Values of an input and of the output that belongs to each."""

    input: fields.Numbers
    """Angles of the input link. Example: [97, 120, 143]"""
    output: fields.Numbers
    """Angles of the output link, or with ``kind: slider_crank`` places along its slide. Example: [36, 65, 87]"""

    def faults(self) -> Iterator[str]:
        if len(self.input) != len(self.output):
            yield f"{len(self.input)} values of 'input' for {len(self.output)} of 'output'"
        elif not 3 <= len(self.input) <= MOST_POSITIONS:
            yield f"a function has 3 to {MOST_POSITIONS} pairs, not {len(self.input)}"
        elif len({*self.input}) < len(self.input):
            yield "two pairs have the same input"
        elif len({*self.output}) < 2:
            yield "all outputs are one"


def _points(raw: Any) -> Any:
    if isinstance(raw, list) and len(raw) < 2:
        raise failure(f"a path has two points or more, not {len(raw)}")
    if isinstance(raw, list) and len(raw) > MOST_POINTS:
        raise failure(f"at most {MOST_POINTS} points, not {len(raw)}")
    return raw


class PathTask(fields.Model):
    """Points that a point of the linkage shall pass, in their order."""

    points: Annotated[
        Annotated[tuple[Point, ...], Tag("points")] | Annotated[str, Tag("file")],
        Discriminator(lambda raw: "file" if isinstance(raw, str) else "points"), BeforeValidator(_points),
    ]  # fmt: skip
    """The points, or the name of a CSV file with a row [x, y] each. Example: [[55, 60], [45, 75], [25, 75]]"""
    closed: bool = False
    """Whether the path ends where it begins."""
    timing: fields.Numbers | None = None
    """Crank angle at each point, from that at the first. Left out: free. Example: [0, 20, 40, 60]"""
    point: fields.PointName | None = None
    """With ``of``, the point that passes them; left out: the only one among its kinematics' outputs. Example: P"""


class Region(fields.Model):
    """Where points may lie: a box, or a line."""

    x: Range | fields.Length | None = None
    """Range, or the one value. Example: [-4, 4]"""
    y: Range | fields.Length | None = None
    """Range, or the one value. Example: [-3, 0]"""
    through: Point | None = None
    """A point of a line. Example: [0, -2]"""
    direction: fields.Angle = 0.0
    """Angle of this line from the x axis. Example: 30"""

    def along(self, factor: float) -> complex:
        """Unit vector along the line; `factor` is radians in the study's unit of angle."""
        return cmath.exp(1j * factor * self.direction)

    def faults(self) -> Iterator[str]:
        for key in ("x", "y"):
            ends = getattr(self, key)
            if isinstance(ends, tuple) and not ends[0] < ends[1]:
                yield f"{key}: {ends[1]:g} is not beyond {ends[0]:g}"
        if self.through is None and self.x is None and self.y is None:
            yield "a box has x and y, such as {x: [-4, 4], y: [-3, 0]}, and a line has 'through'"
        if self.through is None and "direction" in self.model_fields_set:
            yield "'direction' is that of a line 'through' a point"


class Box(fields.Model):
    """A rectangle with sides along x and y."""

    x: Range
    """Example: [10, 20]"""
    y: Range
    """Example: [0, 30]"""


def _region(raw: Any) -> Any:
    """A list of points, or what `Region` takes."""
    if not isinstance(raw, list | dict) or not raw:
        raise failure(f"expected a box, a line or points, not {shown(raw)}")
    if isinstance(raw, list) and len(raw) == 2 and not any(isinstance(part, list) for part in raw):
        return [raw]
    return raw


Places = Annotated[
    Annotated[tuple[Point, ...], Tag("points")] | Annotated[Region, Tag("region")],
    Discriminator(lambda raw: "points" if isinstance(raw, list | tuple) else "region"), BeforeValidator(_region),
]  # fmt: skip


class Limits(fields.Model):
    """Bounds that every linkage keeps."""

    reach: fields.Positive = REACH
    """Pivots of the frame lie within this many sizes of the task from its middle. Example: 5"""
    ratio: Annotated[float, fields.number("none", 1.0, exclusive=True)] = RATIO
    """Longest length over the shortest, at most. Example: 10"""


class Least(fields.Model):
    """The smallest transmission angle."""

    at_least: Annotated[float, fields.number("angle", 0.0)]
    """Example: 40"""


class JudgeSection(fields.Model):
    """How linkages are judged once they are made, by the reliability of the best of them."""

    tolerance: fields.PositiveLength | None = None
    """Tolerance, plus and minus, of every length and place of the linkage. Example: 0.1 mm"""
    dimensions: dict[str, Dimension] = Field(default_factory=dict)
    """Tolerances of single dimensions, as ``reliability.dimensions`` takes them. Example: {crank.length: 0.05}"""
    clearances: dict[str, Clearance] = Field(default_factory=dict)
    """Clearances of joints, as ``reliability.clearances`` takes them. Example: {A: {radial: 0.02}}"""
    within: Annotated[float, fields.number(None, 0.0, exclusive=True)] | None = None
    """By how much a made linkage may miss the task at each position, counted as ``error`` is: of a path the distance of
    the point from its curve, or with ``timing`` from where it stands then. Example: 0.5 mm
    """
    loads: tuple[Load, ...] = ()
    """Forces and moments under which the peak effort of the drive is told, as ``dynamics.loads`` takes them. Example:
    [{at: P, force: [0, -20 N]}]
    """
    best: Annotated[int, fields.whole(1, 1000)] = 20
    """How many linkages are judged, those with the smallest errors. Example: 40"""
    samples: Annotated[int, fields.whole(2, 10**9)] = 4000
    """Samples of the Monte Carlo simulation of each. Example: 10000"""

    def faults(self) -> Iterator[str]:
        deviates = self.tolerance is not None or self.dimensions or self.clearances
        if self.within is not None and not deviates:
            yield "what deviates? give 'tolerance', 'dimensions' or 'clearances'"
        if self.within is None and (deviates or not self.loads):
            yield "a yield needs 'within', by how much a made linkage may deviate, such as 0.5 mm"


Rank = Annotated[str, fields.choice(_RANKS, "order of solutions")]


def _rank(raw: Any) -> Any:
    return {raw: 1.0} if isinstance(raw, str) else raw


class SynthesisSection(fields.Model):
    """A task, from which linkages are found."""

    one_of = ("a task is one of body, function and path", "body", "function", "path")
    body: tuple[BodyPosition, ...] | None = None
    """Positions of a body: two to five exactly, more by least squares. Example: [{x: 0, y: 0, angle: 0}, {x: 2, y: 1,
    angle: 30}, {x: 3, y: 3, angle: 75}]
    """
    function: FunctionTask | None = None
    """Pairs of an input and an output: three to five exactly, more by least squares. Example: {input: [97, 120, 143],
    output: [36, 65, 87]}
    """
    path: PathTask | None = None
    """Points that a point of the linkage shall pass. Example: {points: [[55, 60], [45, 75], [25, 75]], closed: true}"""
    kinds: Annotated[
        tuple[Annotated[str, fields.choice(_KINDS, "kind of linkage")], ...],
        BeforeValidator(fields.as_list), fields.OrShort(),
    ] = ()  # fmt: skip
    """Kinds of linkages; left out: four-bars of a path, all of a body. Example: [four_bar, slider_crank]"""
    output_kind: Annotated[str, fields.choice({kind: _KINDS[kind] for kind in FUNCTIONS}, "kind of function")] = Field(
        FOUR_BAR, alias="kind"
    )
    """Of a function, what its output is: the angle of a four-bar's rocker, or the place of a slider."""
    of: str | None = None
    """In place of ``kinds`` a study whose mechanism of one drive is varied, in the assembly of its sketch. Example:
    linkage.yaml
    """
    ranges: dict[str, Range] = Field(default_factory=dict)
    """With ``of``, the ranges of its parameters, or of single dimensions. Example: {a: [10, 40], b: [60, 120]}"""
    frame: fields.PositiveLength | None = None
    """Of a function, the distance between the two pivots of a four-bar. Left out: 1. Example: 100"""
    zeros: Annotated[str, fields.choice(_ZEROS, "zeros of a function")] = "fixed"
    """From where the angles, or the places, of a function count."""
    pivots: Places | None = None
    """Where pivots of the frame lie, and slides of the frame run through: a box, a line, or given points, of which each
    linkage has as many as it can. Example: {x: [-4, 4], y: [-3, 0]} Example: [[0, 0], [10, 0]]
    """
    pins: Places | None = None
    """Where pins of the body lie, and slides of the body run through, in its own coordinates: a box, a line or given
    points. Example: {x: [-1, 1], y: [0, 1]}
    """
    slide: bool = False
    """Whether one side of the body must be a slide."""
    lengths: dict[str, Range] = Field(default_factory=dict)
    """Ranges of lengths by the names of the links, ``ground`` the frame's. Example: {crank: [20, 60]}"""
    limits: Limits = Limits()
    """Bounds that hold without being written; both may be raised. With ``of`` its ranges are the bounds, and of these
    only what is written holds.
    """
    grashof: bool = False
    """Whether the shortest link of a four-bar must be able to turn fully."""
    full_turn: bool | None = None
    """Whether the drive must turn fully. Left out: it must where a path is closed."""
    transmission: Least | None = None
    """The smallest transmission angle over the motion through the task. Example: {at_least: 40}"""
    keep_out: Annotated[tuple[Box, ...], BeforeValidator(fields.as_list), fields.OrShort()] = ()
    """Rectangles in which no pivot of the frame may lie. Example: [{x: [10, 20], y: [0, 30]}]"""
    defects: Annotated[str, fields.choice(_DEFECTS, "way of defects")] = "listed"
    """What becomes of linkages with a defect: another assembly at a position (branch), a dead centre between two
    (circuit), or positions out of order.
    """
    judge: JudgeSection | None = None
    """How linkages are judged once they are made. Example: {tolerance: 0.1 mm, within: 0.5 mm}"""
    rank: Annotated[
        dict[Rank, fields.NonNegative], BeforeValidator(_rank), fields.OrShort({"enum": [*_RANKS]})
    ] = Field(default_factory=lambda: {"error": 1.0})  # fmt: skip
    """Order of the solutions, or weights of several: each counts as a part of its range. Example: yield
    Example: {error: 2, transmission: 1}
    """
    solutions: Annotated[int, fields.whole(1, 1000)] = 20
    """How many are kept; by error those that do the task exactly before others. Example: 10"""
    evaluations: Annotated[int, fields.whole(100, 100_000_000)] | None = None
    """How many linkages are sampled. Left out: 30,000 of each kind and assembly for a closed path, 4,000 for
    an open one, 1,500 pairs of dyads of each kind for a body. Example: 100000
    """
    seed: Annotated[int, fields.whole(0)] | None = None
    """Seed of the samples; left out: that of the study. Example: 1"""

    @classmethod
    def starting(cls, raw: Any) -> Mapping[str, Any]:
        """The mechanism of a study that has none: the kind of linkage with which a search would begin."""
        return starting(raw if isinstance(raw, Mapping) else {})

    @property
    def bounds(self) -> Limits:
        """The limits that hold."""
        if self.of is None:
            return self.limits
        return Limits.model_construct(
            **dict.fromkeys(("reach", "ratio"), np.inf) | self.limits.model_dump(exclude_unset=True)
        )

    def least_sine(self, factor: float) -> float:
        """Sine of the transmission angle that is asked over a turn, `factor` radians being its unit; else 0."""
        asked = self.transmission if self.needs_turn else None
        return 0.0 if asked is None else math.sin(asked.at_least * factor)

    @property
    def needs_turn(self) -> bool:
        """Whether the drive must turn fully."""
        closed = self.path is not None and self.path.closed
        return closed if self.full_turn is None else self.full_turn

    def faults(self) -> Iterator[str]:
        if self.body is not None:
            count = len(self.body)
            if not 2 <= count <= MOST_POSITIONS:
                yield f"a body has 2 to {MOST_POSITIONS} positions, not {count}"
        possible = BODIES if self.body is not None else PATHS if self.path is not None else ()
        for kind in self.kinds:
            if kind not in possible:
                task = self.kind_of_task
                yield f"no {kind} is looked for from a {task}" + (f"; {', '.join(possible)} are" if possible else "")
        names = links(self.kind_of_task, self.kinds or possible or (self.output_kind,))
        for name in self.lengths:
            if name not in names and self.of is None:
                yield f"lengths: no link {name!r}; links are {', '.join(names)}"
        for name, (low, high) in (*self.lengths.items(), *self.ranges.items()):
            if not low < high:
                yield f"{name}: {high:g} is not beyond {low:g}"
        keys = {"frame": "function", "pins": "body", "of": "path", "ranges": "path"}
        for key, task in keys.items():
            if getattr(self, key) and task != self.kind_of_task:
                yield f"{key!r} is of a {task}"
        for key, task in (("zeros", "function"), ("output_kind", "function"), ("slide", "body")):
            if key in self.model_fields_set and task != self.kind_of_task:
                yield f"{key.removeprefix('output_')!r} is of a {task}"
        if self.path is not None and self.path.closed and self.full_turn is False:
            yield (
                "between its toggles a drive passes the same way forth and back: a closed path needs one that turns "
                "fully; leave out 'full_turn', or 'closed'"
            )
        if self.of is not None and (self.kinds or not self.ranges):
            yield "'of' takes the 'ranges' of parameters, and no 'kinds'"
        if self.ranges and self.of is None:
            yield "'ranges' are of the parameters of the study that 'of' names"
        if "yield" in self.rank and (self.judge is None or self.judge.within is None):
            yield "a yield needs 'judge', such as {tolerance: 0.1 mm, within: 0.5 mm}"
        if not any(self.rank.values()):
            yield "all weights of 'rank' are zero"

    @property
    def kind_of_task(self) -> str:
        """``body``, ``function`` or ``path``."""
        return self.given("body", "function", "path")[0]

    def checked(self, checker: Checker) -> Self:
        """Check the loads, on the kind of linkage with which a search begins where that stands for the mechanism."""
        turn = 2 * np.pi / checker.units.angle_factor
        places = [(part.x, part.y, round(math.remainder(part.angle, turn), 9)) for part in self.body or ()]
        for number in [k for k, place in enumerate(places) if place in places[:k]][:1]:
            message = f"position {number + 1} of the body is one of those before it"
            checker.report(("synthesis", "body", number), message)
        stands = self.of is None and checker.reporter.document.raw(("mechanism", "links")) is None
        if self.judge is not None and stands:
            check_loads(checker, self.judge.loads, ("synthesis", "judge", "loads"), moving=False, timed=False)
        return self
