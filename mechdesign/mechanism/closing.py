"""Why a sketch cannot be assembled at its own drive values: which joints cannot meet, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism.algebra import Value, cross, quiet
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.rigidity import Equations
from mechdesign.mechanism.sketch import Sketch
from mechdesign.mechanism.state import State
from mechdesign.mechanism.structure import Group

if TYPE_CHECKING:
    from mechdesign.mechanism.mechanism import Mechanism

# Slides whose directions differ by less (radians) are parallel.
PARALLEL = 1e-9
# Poses of a sweep for the range in which a mechanism closes, and halvings of its ends.
SWEEP, HALVINGS = 721, 40


def cannot_assemble(mechanism: Mechanism, state: State, given: Sequence[tuple[Coordinate, float]]) -> str:
    """Why a mechanism's sketch cannot be assembled at its own drive values, and what would mend it.

    Parameters
    ----------
    state : State
        What the forward plan found.
    given : sequence of (Coordinate, float)
        The drives and their values (radians or lengths).
    """
    plan, unit = mechanism.forward, mechanism.description.angle_unit
    values = ", ".join(f"{c.name} = {v / (unit if c.quantity == 'angle' else 1.0):.6g}" for c, v in given)
    where = open_group(state, mechanism.equations, mechanism.sketch, given)
    elsewhere = []
    for k, (coordinate, _) in enumerate(given if not plan.iterative else ()):

        def valid(sweep: NDArray[np.float64], k: int = k) -> Value:
            return plan.solve([sweep if j == k else v for j, (_, v) in enumerate(given)], limits=False).valid

        found = closing_range(valid, coordinate, mechanism.size, unit)
        if found:
            elsewhere.append(found)
    mend = f"{elsewhere[0]}; draw it there, or check" if elsewhere else "check"
    at = f" ({values})" if given else ""
    return f"the sketch cannot be assembled at its own drive values{at}: {where}; {mend} the lengths"


def open_group(state: State, equations: Equations, sketch: Sketch, given: Sequence[tuple[Coordinate, float]]) -> str:
    """What the first group that does not close lacks, in a designer's words."""
    for group in state.structure.groups:
        unknown = [state.rotations[root] for root in group.angles] + [state.slides[slide] for slide in group.slides]
        if group.form == "newton":
            return _newton(equations, sketch, given, group, state)
        if not all(value is not None and np.isfinite(value) for value in unknown):
            return _dyad(state, group)
    for slide in sorted(state.graph.telescopic):
        if not float(np.real(state.slides[slide])) > 0:
            return f"leg '{state.graph.slides[slide]}' has no positive length"
    return "a given coordinate cannot have its value"


class _Walk:
    """The loop of a dyad cut into the parts that move as one: per unknown root its vector, links and end nodes."""

    @quiet
    def __init__(self, state: State, group: Group) -> None:
        (loop,) = group.loops
        structure, graph = state.structure, state.graph
        self.known: complex = 0j if loop.start == loop.end else state.nodes[loop.start] - state.nodes[loop.end]
        self.vector: dict[int, complex] = dict.fromkeys(group.angles, 0j)
        self.ends: dict[int, list[int]] = {root: [] for root in group.angles}
        self.links: dict[int, list[str]] = {root: [] for root in group.angles}
        self.direction: dict[int, complex] = {}
        self.slide_ends: dict[int, tuple[int, int]] = {}
        for k, sign in loop.edges:
            edge = structure.edges[k]
            root = structure.ties[edge.frame].root
            slides = edge.slide is not None and edge.slide in group.slides
            arm = state.w[k] if slides else state.arm(k)
            if root in self.vector:
                self.vector[root] += sign * complex(arm * state.ties[edge.frame])
                turn = complex(state.ties[edge.frame])
                if edge.locals:
                    self.links[root].append(edge.locals[0][1].removesuffix(":rod"))
            else:
                self.known += sign * complex(state.turned(arm, edge.frame))
                turn = complex(state.rotations[edge.frame])
            if slides and edge.slide is not None:
                self.direction[edge.slide] = sign * turn * complex(state.vectors.d[k])
                self.slide_ends[edge.slide] = (edge.tail, edge.head)
            elif root in self.ends:
                for node in (edge.tail, edge.head):
                    ends = self.ends[root]
                    ends.remove(node) if node in ends else ends.append(node)
        self.names = [graph.nodes[node] for node in range(len(graph.nodes))]

    def link(self, root: int) -> str:
        """Links of a root, with the distance of the joints that they hold apart."""
        links = "-".join(dict.fromkeys(self.links[root])) or "a given distance"
        return f"{links} ({abs(self.vector[root]):.5g})"

    def points(self, nodes: Sequence[int]) -> str:
        return " and ".join(self.names[node] for node in nodes if ":" not in self.names[node])


def _dyad(state: State, group: Group) -> str:
    walk = _Walk(state, group)
    gap = abs(walk.known)
    if group.form == "two angles":
        first, second = group.angles
        inner = [node for node in walk.ends[first] if node in walk.ends[second]]
        outer = [node for root in group.angles for node in walk.ends[root] if node not in inner]
        reach, least = (abs(abs(walk.vector[first]) + s * abs(walk.vector[second])) for s in (1, -1))
        at = f" at {walk.points(inner)}" if len(inner) == 1 else ""
        apart = f"{walk.points(outer)} are {gap:.5g} apart" if len(outer) == 2 else f"they have to span {gap:.5g}"
        limit = f"reach only {reach:.5g}" if gap > reach else f"span no less than {least:.5g}"
        if min(abs(z) for z in walk.vector.values()) == 0.0:
            short = next(root for root, z in walk.vector.items() if z == 0)
            return f"the joints on link {'-'.join(dict.fromkeys(walk.links[short]))} are at one place"
        return f"links {walk.link(first)} and {walk.link(second)} cannot meet{at}: {apart}, the links {limit}"
    slides = [state.graph.slides[slide] for slide in group.slides]
    if group.form == "two slides":
        one, two = (walk.direction[slide] for slide in group.slides)
        if abs(cross(one, two)) < PARALLEL:
            return f"the slides '{slides[0]}' and '{slides[1]}' are parallel: their displacements are not determined"
        return f"the slides '{slides[0]}' and '{slides[1]}' do not meet"
    (root,), (slide,) = group.angles, group.slides
    direction = walk.direction[slide]
    if group.form == "angle and fixed slide":
        off = abs(cross(direction, walk.known))
        pins = [node for node in walk.ends[root] if node not in walk.slide_ends[slide]] or walk.ends[root]
        from_ = f"of '{slides[0]}' passes {walk.points(pins[:1])} at a distance of {off:.5g}"
        return f"link {walk.link(root)} is too short to reach its slide: the line {from_}"
    off = abs(cross(direction, walk.vector[root]))
    joints = walk.points(list(dict.fromkeys((group.loops[0].start, group.loops[0].end))))
    return (
        f"slide '{slides[0]}' cannot close: its joints{f' {joints}' if joints else ''} are {gap:.5g} apart, nearer "
        f"than the {off:.5g} that its links hold them off the line"
    )


def _newton(
    equations: Equations, sketch: Sketch, given: Sequence[tuple[Coordinate, float]], group: Group, state: State
) -> str:
    graph, edges = state.graph, state.structure.edges
    used = {k for loop in group.loops for k, _ in loop.edges if k < len(graph.edges)}
    bodies = [edges[k].locals[0][1].removesuffix(":rod") for k in sorted(used) if edges[k].locals]
    nodes = {node for k in used for node in (edges[k].tail, edges[k].head)}
    joints = ", ".join(sorted(graph.nodes[node] for node in nodes if ":" not in graph.nodes[node]))
    x, _ = equations.solve(equations.from_sketch(sketch), given)
    gaps = np.abs(equations.gaps(x))
    missing = f"; at best a gap of {gaps.max():.5g} stays" if gaps.size else ""
    return f"links {', '.join(dict.fromkeys(bodies))} do not meet (joints {joints}){missing}"


def closing_range(
    valid: Callable[[NDArray[np.float64]], Value], coordinate: Coordinate, size: float, unit: float
) -> str:
    """For which values of one drive, the others held, a mechanism closes; empty where for none.

    Parameters
    ----------
    valid : callable
        Whether it closes, for an array of the drive's values (radians or lengths).
    size : float
        A characteristic length: lengths are tried up to four of it.
    unit : float
        Radians in one of the study's units of angle.
    """
    angle = coordinate.quantity == "angle"
    low, high = (0.0, 2 * np.pi) if angle else (0.0, 4 * size)
    values = np.linspace(low, high, SWEEP)
    closed = np.asarray(valid(values), dtype=bool)
    if not closed.any():
        return ""
    edges = np.flatnonzero(closed[1:] != closed[:-1])
    a, b, at_a = values[edges], values[edges + 1], closed[edges]
    for _ in range(HALVINGS):
        middle = (a + b) / 2
        same = np.asarray(valid(middle), dtype=bool) == at_a
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    ends = list((a + b) / 2 / (unit if angle else 1.0))
    full = 2 * np.pi / unit
    if closed[0]:
        # An interval across zero goes on from the one before it.
        ends = [ends[-1] - full, *ends[:-1]] if angle and len(ends) > 1 else [low, *ends]
    if len(ends) % 2:
        ends.append(high)
    pairs = [f"between {a:.5g} and {b:.5g}" for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return f"it closes for {coordinate.name} {' and '.join(pairs)}"
