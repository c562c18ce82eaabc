"""Compile the graph, for given coordinates, into groups that can be solved one after another.

Structural analysis by bipartite matching (Dulmage and Mendelsohn 1958): every edge gives two equations, every
unknown (the angle of a class, a slide, a node's x and y) a variable. A perfect matching exists if and only if the
given coordinates determine the mechanism structurally; the strongly connected components of the matched graph are
the smallest groups that must be solved together, in the order of their dependence. With the drives given these are
the mechanism's Assur groups; with outputs given, those of the inverse problem.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from mechdesign.errors import MechanismError
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.graph import Edge, Graph

Form = Literal["place", "two angles", "angle and fixed slide", "angle and turning slide", "two slides", "newton"]
Variable = tuple[Literal["angle", "slide", "x", "y"], int]


@dataclass(frozen=True)
class Tie:
    """Class `frame` turns with class `root`: theta = theta_root + sum(sign * given) + sum(sign * body offset)."""

    root: int
    given: tuple[tuple[int, int], ...] = ()
    offsets: tuple[tuple[int, str], ...] = ()

    def reversed(self, frame: int) -> Tie:
        """How the root turns with class `frame`, whose tie this is."""
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

    Their equations are `loops` between nodes known before and `conditions`, the given coordinates that they determine
    besides. The edges of `tree`, each with its sign, then place the group's nodes in order; each base begins the tree
    of a part that only conditions hold.
    """

    form: Form
    angles: tuple[int, ...]
    slides: tuple[int, ...]
    loops: tuple[Loop, ...]
    tree: tuple[tuple[int, int], ...]
    conditions: tuple[int, ...] = ()
    bases: tuple[int, ...] = ()

    @property
    def edges(self) -> tuple[int, ...]:
        """Edges round its loops, in their order."""
        return tuple(k for loop in self.loops for k, _ in loop.edges)


@dataclass(frozen=True)
class Structure:
    """The solution plan of a graph for given coordinates."""

    given: tuple[Coordinate, ...]
    edges: tuple[Edge, ...]
    ties: tuple[Tie, ...]
    known_slides: tuple[tuple[int, int], ...]
    known_nodes: tuple[tuple[int, int, int], ...]
    spans: tuple[tuple[int, int], ...]
    groups: tuple[Group, ...]

    @cached_property
    def unknowns(self) -> dict[int, slice]:
        """By group without a closed form, its part of all their unknowns: angles, slides, x and y of bases."""
        found, end = {}, 0
        for index, group in enumerate(self.groups):
            if group.form == "newton":
                begin, end = end, end + len(group.angles) + len(group.slides) + 2 * len(group.bases)
                found[index] = slice(begin, end)
        return found

    def behind(self, coordinate: Coordinate, graph: Graph) -> frozenset[int]:
        """Groups that a coordinate follows from, by their indices."""
        if coordinate.parts:
            return frozenset[int]().union(*(self.behind(part, graph) for part in coordinate.parts))
        nodes, roots, slides = self._owners
        if coordinate.kind == "angle":
            frames = [graph.bodies[body][0] for body in (coordinate.body, coordinate.reference)]
            owners = [roots.get(self.ties[frame].root) for frame in frames]
        elif coordinate.kind == "slide":
            owners = [slides.get(coordinate.slide)]
        else:
            owners = [nodes.get(node) for node in (coordinate.node, coordinate.other)]
        return frozenset[int]().union(*(self._chains[k] for k in owners if k is not None))

    @cached_property
    def _owners(self) -> tuple[dict[int, int], dict[int, int], dict[int, int]]:
        """The group that places each node, and of which each angle's root and each slide is an unknown."""
        nodes: dict[int, int] = {}
        for k, group in enumerate(self.groups):
            placed = [self.edges[edge].head if sign > 0 else self.edges[edge].tail for edge, sign in group.tree]
            nodes |= {node: k for node in (*group.bases, *placed) if node not in nodes}
        roots = {root: k for k, group in enumerate(self.groups) for root in group.angles}
        return nodes, roots, {slide: k for k, group in enumerate(self.groups) for slide in group.slides}

    @cached_property
    def _chains(self) -> list[frozenset[int]]:
        """Each group with all those before it that its equations and the places of its nodes take."""
        nodes, roots, slides = self._owners
        chains: list[frozenset[int]] = []
        for k, group in enumerate(self.groups):
            taken = [nodes.get(node) for loop in group.loops for node in (loop.start, loop.end)]
            for edge in (self.edges[number] for number in (*group.edges, *(number for number, _ in group.tree))):
                taken += [nodes.get(edge.tail), nodes.get(edge.head), roots.get(self.ties[edge.frame].root)]
                taken += [] if edge.slide is None else [slides.get(edge.slide)]
            # What conditions take is not followed up.
            before = range(k) if group.conditions else {other for other in taken if other is not None and other < k}
            chains.append(frozenset([k]).union(*(chains[other] for other in before)))
        return chains


class Undetermined(MechanismError):
    """The given coordinates are too many, too few, or contradict each other."""


@dataclass
class _Ties:
    parent: list[Tie]

    def find(self, frame: int) -> Tie:
        tie = self.parent[frame]
        if tie.root == frame:
            return tie
        above = self.find(tie.root)
        return Tie(above.root, above.given + tie.given, above.offsets + tie.offsets)

    def join(self, frame: int, reference: int, step: Tie) -> None:
        """Tie class `frame` to `reference` with theta_frame = theta_reference + step."""
        a, b = self.find(frame), self.find(reference)
        if a.root == b.root:
            raise Undetermined("the given angles contradict each other: two of them fix the same angle; leave one out")
        if a.root == 0:
            # The ground stays the root.
            self.join(reference, frame, step.reversed(frame))
            return
        back = a.reversed(frame)
        self.parent[a.root] = Tie(b.root, b.given + step.given + back.given, b.offsets + step.offsets + back.offsets)


def whole(graph: Graph, given: Sequence[Coordinate] = ()) -> Structure:
    """All unknowns of a graph as one group, every edge a loop between its ends, given coordinates conditions."""
    loops = tuple(Loop(edge.tail, edge.head, ((k, 1),)) for k, edge in enumerate(graph.edges))
    angles, slides, bases = (
        tuple(range(*ends)) for ends in ((1, graph.classes), (0, len(graph.slides)), (1, len(graph.nodes)))
    )
    group = Group("newton", angles, slides, loops, (), tuple(range(len(given))), bases)
    return Structure(tuple(given), graph.edges, tuple(Tie(k) for k in range(graph.classes)), (), (), (), (group,))


def compile_structure(graph: Graph, given: Sequence[Coordinate]) -> Structure:
    """Decompose a graph for given coordinates.

    Raises
    ------
    Undetermined
        If the given coordinates do not determine the mechanism.
    """
    edges = list(graph.edges)
    ties = _Ties([Tie(k) for k in range(graph.classes)])
    known_slides: list[tuple[int, int]] = []
    node_given: dict[tuple[int, str], int] = {}
    spans: list[tuple[int, int]] = []
    expressions: dict[int, Coordinate] = {}
    for k, coordinate in enumerate(given):
        if coordinate.kind == "angle":
            frame, reference = graph.bodies[coordinate.body][0], graph.bodies[coordinate.reference][0]
            step = Tie(reference, ((1, k),), ((1, coordinate.reference), (-1, coordinate.body)))
            ties.join(frame, reference, step)
        elif coordinate.kind == "slide":
            known_slides.append((coordinate.slide, k))
        elif coordinate.kind in ("x", "y"):
            node_given[coordinate.node, coordinate.kind] = k
        elif coordinate.kind == "distance":
            # A given distance is a rigid link between the two points, in a class of its own.
            frame = len(ties.parent)
            ties.parent.append(Tie(frame))
            spans.append((len(edges), k))
            edges.append(Edge(coordinate.node, coordinate.other, frame))
        else:
            expressions[k] = coordinate
    found = [ties.find(k) for k in range(len(ties.parent))]
    known = {slide for slide, _ in known_slides}
    groups = _decompose(graph, edges, [tie.root for tie in found], known, node_given, expressions)
    known_nodes = []
    for node in {node for node, _ in node_given}:
        pair = (node_given.get((node, "x"), -1), node_given.get((node, "y"), -1))
        if min(pair) >= 0:
            known_nodes.append((node, *pair))
    return Structure(
        tuple(given), tuple(edges), tuple(found), tuple(known_slides), tuple(known_nodes), tuple(spans),
        tuple(groups),
    )  # fmt: skip


def _decompose(
    graph: Graph,
    edges: Sequence[Edge],
    roots: Sequence[int],
    known_slides: set[int],
    node_given: dict[tuple[int, str], int],
    expressions: dict[int, Coordinate],
) -> list[Group]:
    known: set[Variable] = {("x", 0), ("y", 0)}
    known.update(("x" if part == "x" else "y", node) for node, part in node_given)
    variables: dict[Variable, int] = {}
    rows: list[list[int]] = []

    def column(variable: Variable) -> int:
        return variables.setdefault(variable, len(variables))

    for root in sorted({root for root in roots if root != 0}):
        column(("angle", root))
    for slide in range(len(graph.slides)):
        if slide not in known_slides:
            column(("slide", slide))
    for node in range(1, len(graph.nodes)):
        for part in ("x", "y"):
            if (part, node) not in known:
                column((part, node))
    for edge in edges:
        shared: list[Variable] = []
        if roots[edge.frame] != 0:
            shared.append(("angle", roots[edge.frame]))
        if edge.slide is not None and edge.slide not in known_slides:
            shared.append(("slide", edge.slide))
        for part in ("x", "y"):
            ends: list[Variable] = [(part, edge.tail), (part, edge.head)]  # type: ignore[list-item]
            rows.append([column(v) for v in [*shared, *ends] if v not in known])
    for coordinate in expressions.values():
        rows.append([variables[v] for v in _variables(graph, roots, coordinate) if v in variables])
    if len(rows) != len(variables):
        lacking = len(variables) - len(rows)
        few = "few" if lacking > 0 else "many"
        raise Undetermined(f"{abs(lacking)} coordinate{'s' if abs(lacking) > 1 else ''} too {few} given")
    matched = _match(rows, len(variables))
    if matched is None:
        raise Undetermined("the given coordinates fix one part of the mechanism twice and leave another free")

    # The two equations of an edge stay together, and so do those matched to the two coordinates of a node.
    units: dict[Hashable, set[int]] = defaultdict(set)
    names = list(variables)
    loose = 2 * len(edges)  # from here on rows are scalar equations
    for row in range(len(rows)):
        units["edge", row // 2 if row < loose else row].add(row)
        kind, index = names[matched[row]]
        if kind in ("x", "y"):
            units["node", index].add(row)
    arcs: list[tuple[int, int]] = []
    for together in units.values():
        first, *others = sorted(together)
        arcs += [(first, other) for other in others] + [(other, first) for other in others]
    solver = {matched[row]: row for row in range(len(rows))}
    for row, columns in enumerate(rows):
        arcs += [(row, solver[c]) for c in columns if solver[c] != row]
    groups = []
    for members in _components(arcs, len(rows)):
        unknowns = [names[matched[row]] for row in members]
        own = [list(expressions)[row - loose] for row in members if row >= loose]
        inner = sorted({row // 2 for row in members if row < loose})
        groups.append(_group(edges, roots, inner, unknowns, node_given, own))
    return groups


def _variables(graph: Graph, roots: Sequence[int], coordinate: Coordinate) -> list[Variable]:
    """What an expression depends on."""
    if coordinate.kind == "expression":
        return list(dict.fromkeys(v for part in coordinate.parts for v in _variables(graph, roots, part)))
    if coordinate.kind == "angle":
        return [("angle", roots[graph.bodies[body][0]]) for body in (coordinate.body, coordinate.reference)]
    if coordinate.kind == "distance":
        return [(axis, node) for node in (coordinate.node, coordinate.other) for axis in ("x", "y")]
    if coordinate.kind == "slide":
        return [("slide", coordinate.slide)]
    return [] if coordinate.kind == "parameter" else [(coordinate.kind, coordinate.node)]


def _match(rows: list[list[int]], columns: int) -> list[int] | None:
    """A column for each row, all different, by augmenting paths; None if there is no perfect matching."""
    owner = [-1] * columns
    matched = [-1] * len(rows)
    for start in range(len(rows)):
        came: dict[int, int] = {}
        queue = [start]
        for row in queue:
            found = None
            for column in rows[row]:
                if column not in came:
                    came[column] = row
                    if owner[column] < 0:
                        found = column
                        break
                    queue.append(owner[column])
            if found is not None:
                while found >= 0:
                    row = came[found]
                    owner[found], matched[row], found = row, found, matched[row]
                break
        else:
            return None
    return matched


def _components(arcs: list[tuple[int, int]], count: int) -> list[list[int]]:
    """Strongly connected components, each after those that its arcs lead to.

    The rows of a component reach the same rows, kept as the bits of a whole number, and strictly more than what they
    lead to does.
    """
    ahead: list[list[int]] = [[] for _ in range(count)]
    for a, b in arcs:
        ahead[a].append(b)
    reached = [1 << row for row in range(count)]
    order, before = list(range(count)), [0] * count
    while reached != before:
        before = [*reached]
        for row in order:
            for other in ahead[row]:
                reached[row] |= reached[other]
        order.reverse()
    found: dict[int, list[int]] = defaultdict(list)
    for row, bits in enumerate(reached):
        found[bits].append(row)
    return [found[bits] for bits in sorted(found, key=lambda bits: (bits.bit_count(), found[bits][0]))]


def _group(
    edges: Sequence[Edge],
    roots: Sequence[int],
    members: list[int],
    unknowns: list[Variable],
    node_given: dict[tuple[int, str], int],
    own: Sequence[int],
) -> Group:
    angles = tuple(sorted(index for kind, index in unknowns if kind == "angle"))
    slides = tuple(sorted(index for kind, index in unknowns if kind == "slide"))
    free = {index for kind, index in unknowns if kind in ("x", "y")}
    reached = {node for k in members for node in (edges[k].tail, edges[k].head)} - free
    paths: dict[int, tuple[int, tuple[tuple[int, int], ...]]] = {node: (node, ()) for node in reached}
    tree: list[tuple[int, int]] = []
    loops: list[Loop] = []
    bases: list[int] = []
    pending = list(members)
    conditions = (*(which for (node, _), which in sorted(node_given.items()) if node in free), *own)
    # Rigid edges first, then slides, so that a loop closes over as few unknowns as it can.
    pending.sort(key=lambda k: (edges[k].slide is not None, k))
    while pending:
        for k in pending:
            tail, head = edges[k].tail, edges[k].head
            if tail in paths and head in paths:
                loops.append(_loop(paths, k, tail, head))
                break
            if tail in paths or head in paths:
                a, b, sign = (tail, head, 1) if tail in paths else (head, tail, -1)
                paths[b] = (paths[a][0], (*paths[a][1], (k, sign)))
                tree.append((k, sign))
                break
        else:
            if not conditions:
                raise Undetermined("a part of the mechanism is not connected to the ground by given coordinates")
            bases.append(edges[pending[0]].tail)
            paths[bases[-1]] = (bases[-1], ())
            continue
        pending.remove(k)
    # Points that conditions place by themselves, before any link that bears them.
    bases += sorted(free - paths.keys())
    form = _form(edges, roots, angles, slides, loops, conditions)
    return Group(form, angles, slides, tuple(loops), tuple(tree), conditions, tuple(bases))


def _loop(paths: dict[int, tuple[int, tuple[tuple[int, int], ...]]], k: int, tail: int, head: int) -> Loop:
    start, out = paths[tail]
    end, back = paths[head]
    common = 0
    while common < min(len(out), len(back)) and out[common] == back[common]:
        common += 1
    if common:
        start = end
    return Loop(start, end, (*out[common:], (k, 1), *((edge, -sign) for edge, sign in reversed(back[common:]))))


def _form(
    edges: Sequence[Edge],
    roots: Sequence[int],
    angles: tuple[int, ...],
    slides: tuple[int, ...],
    loops: Sequence[Loop],
    conditions: Sequence[int],
) -> Form:
    if not angles and not slides and not conditions:
        return "place"
    if len(loops) != 1 or conditions or len(angles) + len(slides) != 2:
        return "newton"
    around = [edges[k] for k, _ in loops[0].edges]
    if not {*angles} <= {roots[edge.frame] for edge in around} or not {*slides} <= {edge.slide for edge in around}:
        raise Undetermined("the given coordinates fix one part of the mechanism twice and leave another free")
    if len(angles) == 2:
        return "two angles"
    if len(slides) == 2:
        return "two slides"
    carrier = next(roots[edges[k].frame] for k, _ in loops[0].edges if edges[k].slide == slides[0])
    return "angle and turning slide" if carrier == angles[0] else "angle and fixed slide"
