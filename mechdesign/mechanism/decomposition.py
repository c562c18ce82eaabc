"""Decompose a graph, for given coordinates, into groups that can be solved one after another.

Structural analysis by bipartite matching (Dulmage and Mendelsohn 1958): every edge gives two equations, every
unknown (the angle of a class, a slide, a node's x and y) a variable. A perfect matching exists if and only if the
given coordinates determine the mechanism structurally; the strongly connected components of the matched graph are
the smallest groups that must be solved together, in the order of their dependence.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

from mechdesign.ground.errors import MechanismError
from mechdesign.ground.numerics.graphs import components, perfect_matching
from mechdesign.mechanism.coordinates import Coordinate, Coupled
from mechdesign.mechanism.graph import Edge, Graph
from mechdesign.mechanism.structure import (
    Form,
    Group,
    Loop,
    Structure,
    Tie,
    Variable,
    sliding_by,
    turning_with,
    variables_of,
)

TWICE_AND_FREE = "the given coordinates fix one part of the mechanism twice and leave another free"

# Edges from one node to another, each with the sign with which it is passed.
Path = tuple[tuple[int, int], ...]


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


def compile_structure(
    graph: Graph, given: Sequence[Coordinate], couplings: Sequence[Coupled] = (), implicit: Collection[int] = ()
) -> Structure:
    """Decompose a graph for given coordinates.

    A coupling whose coordinates do not follow before the one that it sets is an equation among others; so are those of
    the values `implicit`.

    Raises
    ------
    Undetermined
        If the given coordinates do not determine the mechanism.
    """
    edges = list(graph.edges)
    angles = _Ties([Tie(k) for k in range(graph.classes)])
    spans: list[tuple[int, int]] = []
    # Index among the given coordinates of each variable that is given.
    numbers: dict[Variable, int] = {}
    expressions: dict[int, Coordinate] = {}
    followers = set[int]()
    for k, coordinate in enumerate(given):
        if coordinate.kind == "angle":
            frame, reference = graph.bodies[coordinate.body][0], graph.bodies[coordinate.reference][0]
            step = Tie(reference, ((1, k),), ((1, coordinate.reference), (-1, coordinate.body)))
            angles.join(frame, reference, step)
        elif coordinate.kind == "slide":
            numbers["slide", coordinate.slide] = k
        elif coordinate.kind in ("x", "y"):
            numbers[coordinate.kind, coordinate.node] = k
        elif coordinate.kind == "distance":
            # A given distance is a rigid link between the two points, in a class of its own.
            frame = len(angles.parent)
            angles.parent.append(Tie(frame))
            spans.append((len(edges), k))
            edges.append(Edge(coordinate.node, coordinate.other, frame))
        else:
            expressions[k] = coordinate
    functions: list[Coordinate] = []
    slides: dict[int, int] = {}
    for k, coupling in enumerate(couplings, len(given)):
        follower = coupling.follower
        sets = k not in implicit and _sets(graph, follower, angles, numbers, k)
        if sets and follower.kind == "slide":
            numbers["slide", follower.slide] = slides[follower.slide] = k
        functions.append(coupling.function if sets else coupling.gap)
        expressions[k] = functions[-1]
        if sets:
            followers.add(k)
    ties = [angles.find(k) for k in range(len(angles.parent))]
    variables, rows = _equations(graph, edges, ties, numbers, expressions, slides, followers)
    matched = perfect_matching(rows, len(variables))
    if matched is None:
        raise Undetermined(TWICE_AND_FREE)
    arcs = _dependence(rows, matched, variables, len(edges))
    parts = components(arcs, len(rows))
    part_of = {row: k for k, members in enumerate(parts) for row in members}
    row_of = {k: 2 * len(edges) + number for number, k in enumerate(expressions)}
    late = {
        index
        for row, (kind, index) in enumerate(variables[column] for column in matched)
        if kind == "value" and parts[part_of[row]] != [row_of[index]]
    }
    # A link that is rigid with the one that follows, or turns against it by a given angle, is not known before it.
    late |= {k for k in followers if ("value", k) in variables_of(expressions[k], graph, ties, slides)}
    if late:
        return compile_structure(graph, given, couplings, {*implicit, *late})
    groups, chains = [], list[frozenset[int]]()
    for k, members in enumerate(parts):
        own = [k for k, row in row_of.items() if row in members]
        inner = sorted({row // 2 for row in members if row < 2 * len(edges)})
        unknowns = [variables[matched[row]] for row in members]
        if unknowns == [("value", k) for k in own]:
            groups.append(Group("coupled", (), (), (), (), tuple(own)))
        else:
            group = _group(edges, ties, inner, unknowns, numbers, own)
            alone = not inner and not group.bases and group.unknowns == len(own) and own[0] >= len(given)
            linear = alone and _linear(graph, [couplings[k - len(given)].gap for k in own], ties, slides)
            groups.append(replace(group, form="linear") if linear else group)
        before = {part_of[other] for row, other in arcs if part_of[row] == k} - {k}
        chains.append(frozenset([k]).union(*(chains[other] for other in before)))
    return Structure(
        tuple(given), tuple(edges), tuple(ties), tuple(groups),
        tuple((index, k) for (kind, index), k in numbers.items() if kind == "slide"),
        tuple((node, k, numbers["y", node]) for (kind, node), k in numbers.items()
              if kind == "x" and ("y", node) in numbers),
        tuple(spans), {variables[column]: part_of[row] for row, column in enumerate(matched)}, tuple(chains),
        tuple(functions),
    )  # fmt: skip


def _sets(
    graph: Graph, follower: Coordinate, angles: _Ties, numbers: Mapping[Variable, int], k: int
) -> bool:  # fmt: skip
    """Whether value `k` can set the coordinate that follows: an angle, which it then ties, or a slide."""
    if follower.kind == "slide":
        return ("slide", follower.slide) not in numbers
    if follower.kind != "angle":
        return False
    frame, reference = graph.bodies[follower.body][0], graph.bodies[follower.reference][0]
    if angles.find(frame).root == angles.find(reference).root:
        return False
    angles.join(frame, reference, Tie(reference, ((1, k),), ((1, follower.reference), (-1, follower.body))))
    return True


def _linear(graph: Graph, gaps: Sequence[Coordinate], ties: Sequence[Tie], slides: Mapping[int, int]) -> bool:
    """Whether conditions are linear in unknown angles and slides, each angle's turns known from one of its bodies."""
    parts = {part for gap in gaps for part in gap.parts if part.kind == "angle"}
    roots = [
        root for part in parts for kind, root in variables_of(part, graph, ties, slides) if kind == "angle" and root
    ]
    return all(gap.linear for gap in gaps) and len(roots) == len({*roots})


def _equations(
    graph: Graph, edges: Sequence[Edge], ties: Sequence[Tie], given: Mapping[Variable, int],
    expressions: Mapping[int, Coordinate], slides: Mapping[int, int], followers: Collection[int],
) -> tuple[list[Variable], list[list[int]]]:  # fmt: skip
    """The unknown variables, and by equation the numbers of those in it: x and y of each edge, then `expressions`.

    `slides` have the values that they are coupled to; the values of `followers` are unknown.
    """
    variables: list[Variable] = [("angle", root) for root in sorted({tie.root for tie in ties} - {0})]
    variables += [("slide", slide) for slide in range(len(graph.slides))]
    variables += [(axis, node) for node in range(1, len(graph.nodes)) for axis in ("x", "y")]
    variables = [variable for variable in variables if variable not in given]
    variables += [("value", k) for k in sorted(followers)]
    number = {variable: k for k, variable in enumerate(variables)}

    def sliding(edge: Edge) -> list[Variable]:
        return [] if edge.slide is None else [sliding_by(edge.slide, slides)]

    equations: list[list[Hashable]] = [
        [*turning_with(ties[edge.frame]), *sliding(edge), (axis, edge.tail), (axis, edge.head)]
        for edge in edges
        for axis in ("x", "y")
    ]
    equations += [
        [*([("value", k)] if k in followers else []), *variables_of(expression, graph, ties, slides)]
        for k, expression in expressions.items()
    ]
    if len(equations) != len(variables):
        lacking = len(variables) - len(equations)
        few = "few" if lacking > 0 else "many"
        raise Undetermined(f"{abs(lacking)} coordinate{'s' if abs(lacking) > 1 else ''} too {few} given")
    return variables, [[number[v] for v in equation if v in number] for equation in equations]


def _dependence(
    rows: Sequence[Sequence[int]], matched: Sequence[int], variables: Sequence[Variable], edges: int
) -> list[tuple[int, int]]:
    """Arcs from each equation to those that must be solved with it or before it.

    The two equations of an edge stay together, and so do those matched to the two coordinates of a node.
    """
    units: dict[Hashable, list[int]] = defaultdict(list)
    for row, column in enumerate(matched):
        if row < 2 * edges:
            units["edge", row // 2].append(row)
        kind, index = variables[column]
        if kind in ("x", "y"):
            units["node", index].append(row)
    arcs = []
    for first, *others in units.values():
        arcs += [(first, other) for other in others] + [(other, first) for other in others]
    solver = {column: row for row, column in enumerate(matched)}
    return arcs + [(row, solver[c]) for row, columns in enumerate(rows) for c in columns if solver[c] != row]


def _group(
    edges: Sequence[Edge],
    ties: Sequence[Tie],
    members: list[int],
    unknowns: list[Variable],
    given: Mapping[Variable, int],
    expressions: Sequence[int],
) -> Group:
    """The group of some edges and unknowns; `expressions` are the given expressions that it must satisfy."""
    angles = tuple(sorted(index for kind, index in unknowns if kind == "angle"))
    slides = tuple(sorted(index for kind, index in unknowns if kind == "slide"))
    free = {index for kind, index in unknowns if kind in ("x", "y")}
    reached = {node for k in members for node in (edges[k].tail, edges[k].head)} - free
    # The known node from which each node is reached, and the way from there.
    paths: dict[int, tuple[int, Path]] = {node: (node, ()) for node in reached}
    tree: list[tuple[int, int]] = []
    loops: list[Loop] = []
    bases: list[int] = []
    halves = sorted((node, axis) for axis, node in given if axis in ("x", "y") and node in free)
    conditions = (*(given[axis, node] for node, axis in halves), *expressions)
    # Rigid edges first, then slides, so that a loop closes over as few unknowns as it can.
    pending = sorted(members, key=lambda k: (edges[k].slide is not None, k))
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
    form = _form(edges, ties, angles, slides, loops, conditions)
    return Group(form, angles, slides, tuple(loops), tuple(tree), conditions, tuple(bases))


def _loop(paths: Mapping[int, tuple[int, Path]], k: int, tail: int, head: int) -> Loop:
    """The loop that edge `k` closes, without the edges that the ways to both of its ends share."""
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
    ties: Sequence[Tie],
    angles: tuple[int, ...],
    slides: tuple[int, ...],
    loops: Sequence[Loop],
    conditions: Sequence[int],
) -> Form:
    if not angles and not slides and not conditions:
        return "place"
    if len(loops) != 1 or conditions or len(angles) + len(slides) != 2:
        return "newton"
    roots = {edges[k].slide: ties[edges[k].frame].root for k, _ in loops[0].edges}
    turning = {ties[edges[k].frame].root for k, _ in loops[0].edges}
    if not {*angles} <= turning or not {*slides} <= roots.keys():
        raise Undetermined(TWICE_AND_FREE)
    if len(angles) == 2:
        return "two angles"
    if len(slides) == 2:
        return "two slides"
    return "angle and turning slide" if roots[slides[0]] == angles[0] else "angle and fixed slide"
