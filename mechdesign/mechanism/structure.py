"""The structure of a mechanism for given coordinates: groups of unknowns that are solved one after another.

With the drives given the groups are the mechanism's Assur groups; with outputs given, those of the inverse problem.
`mechdesign.mechanism.decomposition` finds them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.graph import Edge, Graph

Form = Literal[
    "place", "coupled", "linear", "two angles", "angle and fixed slide", "angle and turning slide", "two slides",
    "newton",
]  # fmt: skip
# Of a ``value`` the index in `Structure.values`.
Variable = tuple[Literal["angle", "slide", "x", "y", "value"], int]


@dataclass(frozen=True)
class Tie:
    """Class `frame` turns with class `root`: theta = theta_root + sum(sign * value) + sum(sign * body offset).

    The values are those of `Structure.values`.
    """

    root: int
    given: tuple[tuple[int, int], ...] = ()
    offsets: tuple[tuple[int, str], ...] = ()

    def reversed(self, frame: int) -> Tie:
        """The tie of the root to class `frame`, of which this is the tie to the root."""
        return Tie(frame, tuple((-s, k) for s, k in self.given), tuple((-s, body) for s, body in self.offsets))


@dataclass(frozen=True)
class Loop:
    """``X_start + sum(sign * edge) - X_end = 0``."""

    start: int
    end: int
    edges: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Group:
    """Unknowns that are solved together: angles of classes (roots of ties), slides, and places of `bases`.

    Their equations are `loops` between nodes that are already placed, and `conditions`: indices of values
    that are equations of this group. The edges of `tree`, each with its sign, then place the group's nodes in order. A
    base is the first node of a part that no loop but only conditions hold. A ``coupled`` group has no equation to be
    solved: the one condition is the value that follows from others. Of a ``linear`` one the conditions are
    linear in the unknowns.
    """

    form: Form
    angles: tuple[int, ...]
    slides: tuple[int, ...]
    loops: tuple[Loop, ...]
    tree: tuple[tuple[int, int], ...]
    conditions: tuple[int, ...] = ()
    bases: tuple[int, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether it has equations to be solved."""
        return self.form not in ("place", "coupled")

    @property
    def unknowns(self) -> int:
        """Number of its unknowns."""
        return len(self.angles) + len(self.slides) + 2 * len(self.bases)

    @property
    def dyad(self) -> bool:
        """Whether it is one loop with two unknowns."""
        return len(self.loops) == 1 and not self.conditions

    @property
    def edges(self) -> tuple[int, ...]:
        """Edges around the loops, in order."""
        return tuple(k for loop in self.loops for k, _ in loop.edges)


@dataclass(frozen=True)
class Structure:
    """Groups of a graph for given coordinates, in the order in which they are solved.

    Its values are the given coordinates and behind them one of each coupling: the function that gives the coordinate
    which follows, or where that is not known before it is needed the gap between the two, which is zero.
    """

    given: tuple[Coordinate, ...]
    edges: tuple[Edge, ...]  # those of the graph, then the given distances
    ties: tuple[Tie, ...]  # of each class
    groups: tuple[Group, ...]
    # Slides, nodes (x and y) and edges that are given, each with the indices of their coordinates in `given`.
    known_slides: tuple[tuple[int, int], ...] = ()
    known_nodes: tuple[tuple[int, int, int], ...] = ()
    spans: tuple[tuple[int, int], ...] = ()
    owners: Mapping[Variable, int] = field(default_factory=dict)  # group of which each variable is an unknown
    chains: tuple[frozenset[int], ...] = ()  # of each group: itself and all groups whose unknowns its equations contain
    functions: tuple[Coordinate, ...] = ()  # of the couplings

    @cached_property
    def values(self) -> tuple[Coordinate, ...]:
        """Given coordinates, and functions or gaps of couplings."""
        return (*self.given, *self.functions)

    @cached_property
    def coupled(self) -> frozenset[int]:
        """Indices of the values that follow from others in closed form."""
        return frozenset(k for group in self.groups if group.form == "coupled" for k in group.conditions)

    @property
    def numbers(self) -> range:
        """Indices of the couplings' values."""
        return range(len(self.given), len(self.values))

    def counted(self, angle: Coordinate, graph: Graph) -> tuple[Tie, Tie] | None:
        """Ties of the two bodies of an angle that is a sum of values and offsets; None of one that is not."""
        if angle.kind != "angle":
            return None
        one, other = (self.ties[graph.bodies[body][0]] for body in (angle.body, angle.reference))
        return (one, other) if one.root == other.root else None

    @cached_property
    def unknowns(self) -> dict[int, slice]:
        """By group without a closed form, its part of their unknowns: angles, slides, then x and y of bases."""
        slices, end = {}, 0
        for index, group in enumerate(self.groups):
            if group.form == "newton":
                begin, end = end, end + group.unknowns
                slices[index] = slice(begin, end)
        return slices

    @cached_property
    def metrics(self) -> tuple[Floats, ...]:
        """Of each group the metric of its loops, shape (loops, loops), by which their choice does not matter; det 1.

        Which of a group's loops are its equations follows from the order of the links. Loops that share links are no
        right angles of each other: their products are numbers of common ends of unknown links, and of common slides.
        """
        return tuple(self._metric(group) for group in self.groups)

    def _metric(self, group: Group) -> Floats:
        counts = [Counter[tuple[str, int, int]]() for _ in group.loops]
        for count, loop in zip(counts, group.loops, strict=True):
            for k, sign in loop.edges:
                edge = self.edges[k]
                if (root := self.ties[edge.frame].root) in group.angles:
                    count["angle", root, edge.head] += sign
                    count["angle", root, edge.tail] -= sign
                if edge.slide in group.slides:
                    count["slide", k, 0] += sign
            for base in group.bases:
                count["base", base, 0] += (base == loop.start) - (base == loop.end)
        products = [[sum(number * other[key] for key, number in one.items()) for other in counts] for one in counts]
        gram = np.array(products, dtype=float).reshape(len(counts), len(counts))
        return np.asarray(np.linalg.inv(gram) * np.linalg.det(gram) ** (1 / max(len(counts), 1)))

    def behind(self, coordinate: Coordinate, graph: Graph) -> frozenset[int]:
        """Indices of the groups that a coordinate follows from."""
        slides = {slide: k for slide, k in self.known_slides if k >= len(self.given)}
        owners = [self.owners.get(variable) for variable in variables_of(coordinate, graph, self.ties, slides)]
        return frozenset[int]().union(*(self.chains[index] for index in owners if index is not None))


def variables_of(
    coordinate: Coordinate, graph: Graph, ties: Sequence[Tie], slides: Mapping[int, int]
) -> list[Variable]:  # fmt: skip
    """Variables that a coordinate depends on, given ones among them; `slides` have the values of those coupled."""
    if coordinate.kind == "expression":
        return list(dict.fromkeys(v for part in coordinate.parts for v in variables_of(part, graph, ties, slides)))
    if coordinate.kind == "angle":
        frames = [graph.bodies[body][0] for body in (coordinate.body, coordinate.reference)]
        return [variable for frame in frames for variable in turning_with(ties[frame])]
    if coordinate.kind == "distance":
        return [(axis, node) for node in (coordinate.node, coordinate.other) for axis in ("x", "y")]
    if coordinate.kind == "slide":
        return [sliding_by(coordinate.slide, slides)]
    return [] if coordinate.kind == "parameter" else [(coordinate.kind, coordinate.node)]


def turning_with(tie: Tie) -> list[Variable]:
    """Variables that the angle of a class depends on."""
    return [("angle", tie.root), *(("value", k) for _, k in tie.given)]


def sliding_by(slide: int, slides: Mapping[int, int]) -> Variable:
    """Variable of a slide: itself, or the value that it is coupled to."""
    return ("value", slides[slide]) if slide in slides else ("slide", slide)


def whole(graph: Graph, given: Sequence[Coordinate] = ()) -> Structure:
    """All unknowns of a graph as one group, every edge a loop between its ends, given coordinates conditions."""
    loops = tuple(Loop(edge.tail, edge.head, ((k, 1),)) for k, edge in enumerate(graph.edges))
    angles, slides, bases = (
        tuple(range(*ends)) for ends in ((1, graph.classes), (0, len(graph.slides)), (1, len(graph.nodes)))
    )
    group = Group("newton", angles, slides, loops, (), tuple(range(len(given))), bases)
    return Structure(tuple(given), graph.edges, tuple(Tie(k) for k in range(graph.classes)), (group,))
