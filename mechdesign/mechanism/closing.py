"""Why a sketch cannot be assembled at its own drive values: which joints cannot meet, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechdesign.errors import MechanismError
from mechdesign.mechanism.algebra import Value, cross
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.diagnosis import motions_in_words, over_constrained, owners_of
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.rigidity import CLOSED
from mechdesign.mechanism.sketch import KEY
from mechdesign.mechanism.solve import loop_vectors
from mechdesign.mechanism.state import State
from mechdesign.mechanism.structure import Group
from mechdesign.numerics.arrays import Complexes, Floats

# Poses of a sweep for the range in which a mechanism closes, and halvings of its ends.
SWEEP, HALVINGS = 721, 40


def cannot_assemble(core: Core, plan: Plan, state: State, given: Sequence[tuple[Coordinate, float]]) -> MechanismError:
    """Why a mechanism's sketch cannot be assembled at its own drive values, and what would mend it.

    Parameters
    ----------
    plan : Plan
        That of the drives.
    state : State
        What it found.
    given : sequence of (Coordinate, float)
        The drives and their values (radians or lengths).
    """
    unit, equations = core.description.angle_unit, core.equations
    values = ", ".join(f"{c.name} = {v / (unit if c.quantity == 'angle' else 1.0):.6g}" for c, v in given)
    start = f"the sketch cannot be assembled at its own drive values{f' ({values})' if given else ''}"
    x, gap = equations.solve(equations.from_sketch(core.sketch), given)
    if gap < CLOSED:
        told = _closed_otherwise(core, plan, x, start)
        if told is not None:
            return told
    where, mend = open_group(state, equations.gaps(x))
    if not plan.iterative:
        drawn = Plan(core, plan.structure, plan.modes, follows=False)
        for k, (coordinate, _) in enumerate(given):

            def valid(sweep: Floats, k: int = k) -> Value:
                return drawn.solve([sweep if j == k else v for j, (_, v) in enumerate(given)], limits=False).valid

            found = closing_range(valid, coordinate, core.size, unit)
            if found:
                mend = f"{found}; draw it there, or {mend}"
                break
    return MechanismError(f"{start}: {where}; {mend}", KEY)


def check_regular(core: Core, plan: Plan, configuration: Configuration) -> None:
    """Check that the sketch, assembled by Newton's method, is not one of a chain that its drives do not hold at all.

    Raises
    ------
    MechanismError
        If the mechanism is over-constrained and has more freedom than drives.
    """
    if not plan.iterative or regularity(Linearization(plan.structure, core.geometry, configuration)) > STALLED:
        return
    equations, count = core.equations, len(plan.structure.given)
    nodes = np.array([complex(node) for node in configuration.nodes])
    angles = np.array([np.angle(turn) for turn in configuration.rotations])
    slides = np.array([float(slide) for slide in configuration.slides])
    real, middle = equations.mobility(equations.pack(nodes, angles, slides))
    if real > count:
        raise over_constrained(core.description, equations, middle, count, real, count)


def _closed_otherwise(core: Core, plan: Plan, x: Floats, start: str) -> MechanismError | None:
    """A group that closes, but not where Newton's method gets to from the sketch, or not in one place only."""
    equations, graph, drives = core.equations, core.graph, plan.structure.given
    real, middle = equations.mobility(x)
    if real > len(drives):
        return over_constrained(core.description, equations, middle, len(drives), real, len(drives))
    free = motions_in_words(equations, equations.jacobian(x, drives))
    if free:
        return MechanismError(f"the sketch is at a singular position: with its drives held, {free}; draw another", KEY)
    nodes, _, slides = equations.unpack(x)
    if not plan.iterative or any(slides[slide] <= 0 for slide in graph.telescopic):
        return None
    places = nodes * equations.size
    moving = [
        f"{point}: [{place.real:.6g}, {place.imag:.6g}]"
        for point, place in zip(graph.nodes, places, strict=True)
        if ":" not in point and (GROUND, point) not in graph.points
    ]
    return MechanismError(f"{start} from where it is drawn; it closes at {{{', '.join(moving)}}}", KEY)


def open_group(state: State, gaps: Complexes) -> tuple[str, str]:
    """What the first group that does not close lacks, in a designer's words, and what would mend it.

    Parameters
    ----------
    gaps : complex array, shape (edges,)
        What the edges miss at best.
    """
    converged = iter(state.converged)
    for group in state.structure.groups:
        if group.form == "newton":
            if not np.all(next(converged)):
                return _newton(state, group, gaps), "check the lengths"
            continue
        unknown = [state.rotations[root] for root in group.angles] + [state.slides[slide] for slide in group.slides]
        if not all(value is not None and np.isfinite(value) for value in unknown):
            return _dyad(state, group)
    for slide in sorted(state.graph.telescopic):
        if not float(np.real(state.slides[slide])) > 0:
            return f"leg '{state.graph.slides[slide]}' has no positive length", "check the lengths"
    return "a given coordinate cannot have its value", "check the lengths"


class _Walk:
    """The loop of a dyad cut into the parts that move as one: per unknown root its vector, links and end nodes."""

    def __init__(self, state: State, group: Group) -> None:
        (loop,) = group.loops
        structure = state.structure
        self.known, self.vector, self.direction = loop_vectors(state, group)
        self.ends: dict[int, list[int]] = {root: [] for root in group.angles}
        self.links: dict[int, list[str]] = {root: [] for root in group.angles}
        self.slide_ends: dict[int, tuple[int, int]] = {}
        for k, _ in loop.edges:
            edge = structure.edges[k]
            root = structure.ties[edge.frame].root
            slides = edge.slide is not None and edge.slide in group.slides
            if root in self.links and edge.locals:
                self.links[root].append(edge.locals[0][1].removesuffix(":rod"))
            if slides and edge.slide is not None:
                self.slide_ends[edge.slide] = (edge.tail, edge.head)
            elif root in self.ends:
                for node in (edge.tail, edge.head):
                    ends = self.ends[root]
                    ends.remove(node) if node in ends else ends.append(node)
        self.names = state.graph.nodes

    def link(self, root: int) -> str:
        """Links of a root, with the distance of the joints that they hold apart."""
        links = "-".join(dict.fromkeys(self.links[root])) or "a given distance"
        return f"{links} ({abs(self.vector[root]):.5g})"

    def points(self, nodes: Sequence[int]) -> str:
        return " and ".join(self.names[node] for node in nodes if ":" not in self.names[node])


def _dyad(state: State, group: Group) -> tuple[str, str]:
    walk = _Walk(state, group)
    if group.form == "two slides":
        one, two = (f"'{state.graph.slides[slide]}'" for slide in group.slides)
        return f"the slides {one} and {two} are parallel, which holds nothing along them", "change a direction"
    for root, z in walk.vector.items():
        if z == 0 and group.form != "angle and turning slide":
            return f"the joints on link {walk.link(root)} are at one place", "put them apart"
    tell = {"two angles": _two_links, "angle and fixed slide": _link_and_slide}.get(group.form, _turning_slide)
    return tell(state, group, walk), "check the lengths"


def _two_links(state: State, group: Group, walk: _Walk) -> str:
    first, second = group.angles
    inner = [node for node in walk.ends[first] if node in walk.ends[second]]
    outer = [node for root in group.angles for node in walk.ends[root] if node not in inner]
    gap, long, short = abs(walk.known), *sorted((abs(z) for z in walk.vector.values()), reverse=True)
    at = f" at {walk.points(inner)}" if len(inner) == 1 else ""
    apart = f"{walk.points(outer)} are {gap:.5g} apart" if len(outer) == 2 else f"they have to span {gap:.5g}"
    limit = f"reach only {long + short:.5g}" if gap > long else f"span no less than {long - short:.5g}"
    return f"links {walk.link(first)} and {walk.link(second)} cannot meet{at}: {apart}, the links {limit}"


def _link_and_slide(state: State, group: Group, walk: _Walk) -> str:
    (root,), (slide,) = group.angles, group.slides
    off = abs(cross(walk.direction[slide], walk.known))
    pins = [node for node in walk.ends[root] if node not in walk.slide_ends[slide]] or walk.ends[root]
    line = f"the line of '{state.graph.slides[slide]}' passes {walk.points(pins[:1])} at a distance of {off:.5g}"
    return f"link {walk.link(root)} is too short to reach its slide: {line}"


def _turning_slide(state: State, group: Group, walk: _Walk) -> str:
    (root,), (slide,) = group.angles, group.slides
    off = abs(cross(walk.direction[slide], walk.vector[root]))
    joints = walk.points(list(dict.fromkeys((group.loops[0].start, group.loops[0].end))))
    apart = f"its joints{f' {joints}' if joints else ''} are {abs(walk.known):.5g} apart"
    held = f"nearer than the {off:.5g} that its links hold them off the line"
    return f"slide '{state.graph.slides[slide]}' cannot close: {apart}, {held}"


def _newton(state: State, group: Group, gaps: Complexes) -> str:
    graph = state.graph
    used = sorted({k for k in group.edges if k < len(graph.edges)})
    joints = ", ".join(sorted(graph.joined(used)))
    worst = max(used, key=lambda k: abs(gaps[k]))
    at = f"'{owners_of(graph, [worst])[0]}'" if owners_of(graph, [worst]) else "one of them"
    best = f"at best {at} stays {abs(gaps[worst]):.5g} too short or too long"
    return f"links {', '.join(owners_of(graph, used))} do not meet (joints {joints}), {best}"


def closing_range(valid: Callable[[Floats], Value], coordinate: Coordinate, size: float, unit: float) -> str:
    """For which values of one drive, the others held, a mechanism closes; empty where for none.

    Parameters
    ----------
    valid : callable
        Whether it closes, for an array of the drive's values (radians or lengths).
    size : float
        A characteristic length: lengths are tried up to four of it, either way.
    unit : float
        Radians in one of the study's units of angle.
    """
    angle = coordinate.quantity == "angle"
    values = np.linspace(0.0, 2 * np.pi, SWEEP) if angle else np.linspace(-4 * size, 4 * size, SWEEP)
    closed = np.asarray(valid(values), dtype=bool)
    if not closed.any():
        return ""
    changes = np.flatnonzero(closed[1:] != closed[:-1])
    a, b, at_a = values[changes], values[changes + 1], closed[changes]
    for _ in range(HALVINGS):
        middle = (a + b) / 2
        same = np.asarray(valid(middle), dtype=bool) == at_a
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    ends = [float(end) / (unit if angle else 1.0) for end in (a + b) / 2]
    first: list[float | None] = [None] if closed[0] else []
    last: list[float | None] = [None] if closed[-1] else []
    if angle and closed[0] and closed[-1] and ends:
        # An interval across zero goes on from the one before it.
        first, last, ends = [], [], [ends[-1] - 2 * np.pi / unit, *ends[:-1]]
    bounds = [*first, *ends, *last]
    return f"it closes for {coordinate.name} {' and '.join(map(_between, bounds[::2], bounds[1::2]))}"


def _between(low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f"below {high:.5g}" if high is not None else f"above {low:.5g}" if low is not None else "of any value"
    return f"between {low:.5g} and {high:.5g}"
