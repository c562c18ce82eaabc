"""The mechanism as a graph of vectors: nodes are points, edges are vectors fixed in links or growing along slides.

Every edge reads ``X_j = X_i + (w + s d) U`` with w and d fixed in the frame of an angle class, s a slide's
displacement (absent for a rigid edge) and U = exp(i theta) the rotation of the class. Links that a prismatic or
fixed joint ties together turn together: they form one angle class and differ by constant offsets. Loops of this
graph are the vector loops of the mechanism; nothing else is needed by the solver or the derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.elements.joints import Fixed, LinkLine, Prismatic, Sliding
from mechdesign.mechanism.model import Description

GROUND = "ground"
# Words behind a link's name that are coordinates of the link, ``rod.angle``, and no points of it.
OF_LINKS = frozenset(("angle", "length"))


def rod_of(leg: str) -> str:
    """Name of the second body of a telescopic leg, the one that carries its far end."""
    return f"{leg}:rod"


def origin_of(link: str) -> str:
    """Name of the node at the origin of a link's frame."""
    return f"{link}:origin"


@dataclass(frozen=True)
class Turn:
    """A signed part of an angle: a place or number, or the direction from one point of a link to another."""

    sign: int
    term: Term = 0.0
    towards: tuple[str, str, str] | None = None


@dataclass(frozen=True)
class Edge:
    """``X_head = X_tail + (w + s d) U``; `w` is a sum of signed local points, `d` a unit vector at a sum of turns.

    A slide runs between places of links, not between the pins there: the offsets of `pins` in their links are therefore
    part of `w`.
    """

    tail: int
    head: int
    frame: int
    locals: tuple[tuple[int, str, str], ...] = ()
    slide: int | None = None
    turns: tuple[Turn, ...] = ()
    pins: tuple[tuple[int, str, str], ...] = ()


@dataclass(frozen=True)
class Graph:
    """Nodes, edges, angle classes and slides of a mechanism."""

    nodes: tuple[str, ...]  # the first is the origin of the ground, at 0
    edges: tuple[Edge, ...]
    classes: int  # number of angle classes; class 0 is the ground's
    bodies: Mapping[str, tuple[int, tuple[Turn, ...]]]  # angle class of each body, and its offset within the class
    points: Mapping[tuple[str, str], tuple[Term, Term]]  # by body and point, the coordinates in the body's frame
    slides: tuple[str, ...]  # joints and telescopic legs whose displacement is a coordinate
    telescopic: frozenset[int]  # indices of the slides that are telescopic legs
    guides: tuple[tuple[str, str], ...]  # of each slide the body with its line, and its slider, "" for a pin in a slot
    clamps: Mapping[str, tuple[str, str, str]]  # by fixed joint, the two bodies and their point
    # Pairs of bodies that turn together, and the turns from the first's x axis to the second's.
    ties: tuple[tuple[str, str, tuple[Turn, ...]], ...]

    @cached_property
    def bases(self) -> dict[str, int]:
        """By body, its base: the node of its first point, from which its edges run."""
        return {body: self.nodes.index(point) for body, point in reversed([*self.points])}

    @cached_property
    def holders(self) -> dict[str, list[str]]:
        """By point, the bodies that have it."""
        holders: dict[str, list[str]] = {}
        for body, point in self.points:
            holders.setdefault(point, []).append(body)
        return holders

    def node(self, name: str) -> int:
        """Index of the node of a point, ``B``; the point of a link, ``rod.B``, has the node of its pin."""
        return self.nodes.index(name.rpartition(".")[2])

    def edge_of(self, slide: int) -> int:
        """Index of the edge of a slide."""
        return next(k for k, edge in enumerate(self.edges) if edge.slide == slide)

    def sliding(self, slide: int) -> str:
        """Name of the point that moves along a slide."""
        return self.nodes[self.edges[self.edge_of(slide)].head]

    def is_point(self, name: str) -> bool:
        """Whether a name is that of a point, ``B``, or of a point of a link, ``rod.B``."""
        link, _, point = name.rpartition(".")
        on_link = point not in OF_LINKS and any((body, point) in self.points for body in (link, rod_of(link)))
        return name in self.nodes or on_link

    def holder(self, link: str, point: str) -> str:
        """The body of a link that has a point; of a telescopic one perhaps its rod."""
        return link if (link, point) in self.points else rod_of(link)

    def links_at(self, point: str) -> list[str]:
        """Names of the links that meet at a point."""
        return list(dict.fromkeys(body.removesuffix(":rod") for body in self.holders.get(point, ())))

    def joined(self, edges: Iterable[int]) -> list[str]:
        """Names of the points at the ends of edges, in their order; given distances, no links, are left out."""
        ends = [node for k in edges if k < len(self.edges) for node in (self.edges[k].tail, self.edges[k].head)]
        return [self.nodes[node] for node in dict.fromkeys(ends) if ":" not in self.nodes[node]]


def turns_of(line: LinkLine) -> tuple[Turn, ...]:
    """From the x axis of a line's link to the line."""
    if line.toward is not None and line.through is not None:
        return (Turn(1, towards=(line.link, line.through, line.toward)),)
    return (Turn(1, line.direction),) if line.direction != 0.0 else ()


def _reverse(turns: Iterable[Turn]) -> tuple[Turn, ...]:
    return tuple(Turn(-turn.sign, turn.term, turn.towards) for turn in turns)


def _classes(
    bodies: list[str], ties: list[tuple[str, str, tuple[Turn, ...]]]
) -> tuple[dict[str, tuple[int, tuple[Turn, ...]]], int]:
    """Walk the ties (a, b, turns from a's to b's x axis) from the ground on; each connected set is a class."""
    neighbours: dict[str, list[tuple[str, tuple[Turn, ...]]]] = {body: [] for body in bodies}
    for a, b, turns in ties:
        neighbours[a].append((b, turns))
        neighbours[b].append((a, _reverse(turns)))
    class_of: dict[str, tuple[int, tuple[Turn, ...]]] = {}
    count = 0
    for root in bodies:
        if root in class_of:
            continue
        class_of[root] = (count, ())
        queue = [root]
        for body in queue:
            for other, turns in neighbours[body]:
                if other not in class_of:
                    class_of[other] = (count, class_of[body][1] + turns)
                    queue.append(other)
        count += 1
    return class_of, count


def build_graph(description: Description) -> Graph:
    """Compile a description into its graph."""
    points: dict[tuple[str, str], tuple[Term, Term]] = {}
    on_body: dict[str, list[str]] = {}
    ties: list[tuple[str, str, tuple[Turn, ...]]] = []

    def put(body: str, point: str, local: tuple[Term, Term]) -> None:
        if (body, point) not in points:
            points[body, point] = local
            on_body[body].append(point)

    bodies = [GROUND, *(name for name in description.links if name != GROUND)]
    for name in list(bodies):
        link = description.links[name]
        on_body[name] = []
        if name == GROUND:
            put(name, origin_of(name), (0.0, 0.0))
        for point, local in link.points.items():
            put(name, point, local)
        if link.telescopic and link.ends is not None:
            rod = rod_of(name)
            bodies.append(rod)
            on_body[rod] = []
            put(rod, link.ends[1], (0.0, 0.0))
            ties.append((name, rod, ()))

    def holder(link: str, point: str) -> str:
        return link if (link, point) in points else rod_of(link)

    clamps: dict[str, tuple[str, str, str]] = {}
    for joint in description.joints.values():
        if isinstance(joint, Fixed):
            (a, b), point = joint.links, joint.point
            ties.append((a, b, (Turn(1, joint.angle),)))
            clamps[joint.name] = holder(a, point), holder(b, point), point
            continue
        line = joint.line
        if line.through is None:
            put(line.link, origin_of(line.link), (0.0, 0.0))
        if isinstance(joint, Prismatic):
            ties.append((line.link, joint.slider, (*turns_of(line), Turn(1, joint.angle))))

    classes, count = _classes(bodies, ties)
    nodes = list(dict.fromkeys(point for body in bodies for point in on_body[body]))
    index = {name: k for k, name in enumerate(nodes)}
    edges: list[Edge] = []
    for body in bodies:
        base, *others = on_body[body] or [""]
        for point in others:
            edges.append(Edge(index[base], index[point], classes[body][0], ((1, body, point), (-1, body, base))))
    guides: dict[str, tuple[str, str]] = {}
    for name, link in description.links.items():
        if link.telescopic and link.ends is not None:
            (tail, head), (frame, offset) = link.ends, classes[name]
            arm = (1, rod_of(name), head), (-1, name, tail)
            edges.append(Edge(index[tail], index[head], frame, arm, len(guides), offset))
            guides[name] = name, rod_of(name)
    legs = len(guides)
    for joint in description.joints.values():
        if not isinstance(joint, Sliding):
            continue
        line, slider = joint.line, ""
        through = line.through if line.through is not None else origin_of(line.link)
        pins = [(-1, line.link, through)] if line.through is not None else []
        if isinstance(joint, Prismatic):
            pins.append((1, joint.slider, joint.point))
            slider = holder(joint.slider, joint.point)
        (frame, offset), ends = classes[line.link], (index[through], index[joint.point])
        edges.append(Edge(*ends, frame, (), len(guides), (*offset, *turns_of(line)), tuple(pins)))
        guides[joint.name] = holder(line.link, through), slider
    return Graph(
        tuple(nodes), tuple(edges), count, classes, points, tuple(guides), frozenset(range(legs)),
        tuple(guides.values()), clamps, tuple(ties),
    )  # fmt: skip
