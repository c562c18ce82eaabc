"""Messages for a sketch that cannot be assembled at its own drive values: which joints cannot meet, and by how much."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.mechanism.algebra import cross
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.diagnosis import motions_in_words, over_constrained, owners_of
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.rigidity import CLOSED
from mechdesign.mechanism.sketch import SKETCH
from mechdesign.mechanism.solve import State
from mechdesign.mechanism.structure import Group

# Number of drive values in the search for the range in which a mechanism closes.
SWEEP_POSES = 721
# Bisections between two of these values for an end of the range.
END_HALVINGS = 40
# Advice for a group that does not close.
CHECK_LENGTHS = "check the lengths"
# Loops that stay open by less than this part of the mechanism's size nearly close, as near a singular pose.
NEARLY = 0.01
NEARLY_CLOSED = (
    "the sketch may be drawn in a singular pose, in which the drives do not hold it: draw it in another pose, the "
    "platform turned a little; or check the lengths"
)


def cannot_assemble(core: Core, plan: Plan, state: State, given: Sequence[tuple[Coordinate, float]]) -> MechanismError:
    """Why a sketch cannot be assembled at its own drive values (radians or lengths), and what would mend it.

    `state` is the result of the plan of the drives.
    """
    unit, equations = core.description.angle_unit, core.equations
    values = ", ".join(f"{c.name} = {v / (unit if c.quantity == 'angle' else 1.0):.6g}" for c, v in given)
    start = f"the sketch cannot be assembled at its own drive values{f' ({values})' if given else ''}"
    drawn_at = equations.from_sketch(core.sketch)
    if lost := equations.without_value(drawn_at):
        return MechanismError(
            f"coupling '{lost[0]}' has no value at the sketch{f' ({values})' if given else ''}: draw a pose at which "
            "it has one, or change it",
            f"mechanism.couplings.{lost[0]}",
        )
    x, gap = equations.solve(drawn_at, given)
    if gap < CLOSED:
        reason = _closed_otherwise(core, plan, x, start)
        if reason is not None:
            return reason
    gaps = equations.gaps(x)
    where, mend = open_group(state, gaps)
    if plan.iterative and mend == CHECK_LENGTHS and np.abs(gaps).max() < NEARLY * core.size:
        mend = NEARLY_CLOSED
    if not plan.iterative:
        drawn = Plan(core, plan.structure, plan.modes, follows=False)
        for k, (coordinate, _) in enumerate(given):

            def valid(sweep: Floats, k: int = k) -> Flags:
                return drawn.solve([sweep if j == k else v for j, (_, v) in enumerate(given)], limits=False).valid

            ranges = closing_range(valid, coordinate, core.size, unit)
            if ranges:
                mend = f"{ranges}; draw it there, or {mend}"
                break
    return MechanismError(f"{start}: {where}; {mend}", SKETCH)


def check_regular(core: Core, plan: Plan, configuration: Configuration) -> None:
    """Check that the drives hold the sketch if it was assembled by Newton's method.

    Raises
    ------
    MechanismError
        If the mechanism is over-constrained and has more freedom than drives.
    """
    if not plan.iterative or regularity(Linearization(plan.structure, core.geometry, configuration)) > STALLED:
        return
    equations, count = core.equations, len(plan.structure.given)
    x = equations.pack(configuration.nodes, configuration.rotations, configuration.slides)
    real, middle = equations.mobility(x)
    if real > count:
        raise over_constrained(core.description, equations, middle, count, real, count)


def _closed_otherwise(core: Core, plan: Plan, x: Floats, start: str) -> MechanismError | None:
    """The error for a mechanism that closes at the drive values, but is singular there or far from the sketch."""
    equations, graph, drives = core.equations, core.graph, plan.structure.given
    real, middle = equations.mobility(x)
    if real > len(drives):
        return over_constrained(core.description, equations, middle, len(drives), real, len(drives))
    free = motions_in_words(equations, equations.jacobian(x, drives))
    if free:
        return MechanismError(
            f"the sketch is at a singular position: with its drives held, {free}; draw another", SKETCH
        )
    closed = equations.at(x)
    if not plan.iterative or any(closed.slides[slide] <= 0 for slide in graph.telescopic):
        return None
    moving = [
        f"{point}: [{place.real:.6g}, {place.imag:.6g}]"
        for point, place in zip(graph.nodes, closed.nodes, strict=True)
        if ":" not in point and (GROUND, point) not in graph.points
    ]
    return MechanismError(f"{start} from where it is drawn; it closes at {{{', '.join(moving)}}}", SKETCH)


def open_group(state: State, gaps: Complexes) -> tuple[str, str]:
    """Why the first open group does not close, and what would mend it; `gaps` by which each edge misses its head."""
    converged = iter(state.converged)
    for group in state.structure.groups:
        if group.form == "newton":
            if not np.all(next(converged)):
                return _newton(state, group, gaps), CHECK_LENGTHS
            continue
        unknown = [state.rotations[root] for root in group.angles] + [state.slides[slide] for slide in group.slides]
        if not all(value is not None and np.isfinite(value) for value in unknown):
            return _dyad(state, group)
    for slide in sorted(state.graph.telescopic):
        if not float(np.real(state.slides[slide])) > 0:
            return f"leg '{state.graph.slides[slide]}' has no positive length", CHECK_LENGTHS
    return "a given coordinate cannot have its value", CHECK_LENGTHS


def _dyad(state: State, group: Group) -> tuple[str, str]:
    graph, edges, slides = state.graph, state.structure.edges, [state.graph.slides[slide] for slide in group.slides]
    if group.form == "two slides":
        one, two = slides
        return f"the slides '{one}' and '{two}' are parallel, which holds nothing along them", "change a direction"
    span, vectors, directions = state.dyad(group)
    # By unknown angle: the links that turn with it and the distance between their joints; the nodes of these joints.
    links: dict[int, str] = {}
    ends: dict[int, list[int]] = {}
    for root, z in vectors.items():
        own = [edges[k] for k in group.edges if state.structure.ties[edges[k].frame].root == root]
        names = dict.fromkeys(edge.locals[0][1].removesuffix(":rod") for edge in own if edge.locals)
        links[root] = f"{'-'.join(names) or 'a given distance'} ({abs(z):.5g})"
        nodes = Counter(n for edge in own if edge.slide not in group.slides for n in (edge.tail, edge.head))
        ends[root] = [node for node, count in nodes.items() if count % 2]
        if z == 0 and group.form != "angle and turning slide":
            return f"the joints on link {links[root]} are at one place", "put them apart"

    def points(nodes: Iterable[int]) -> str:
        return " and ".join(graph.nodes[node] for node in nodes if ":" not in graph.nodes[node])

    gap = float(np.abs(span))
    if group.form == "two angles":
        (one, two), (first, second) = links.values(), ends.values()
        inner = [node for node in first if node in second]
        outer = [node for node in (*first, *second) if node not in inner]
        long, short = sorted((float(np.abs(z)) for z in vectors.values()), reverse=True)
        at = f" at {points(inner)}" if len(inner) == 1 else ""
        apart = f"{points(outer)} are {gap:.5g} apart" if len(outer) == 2 else f"they have to span {gap:.5g}"
        limit = f"reach only {long + short:.5g}" if gap > long else f"span no less than {long - short:.5g}"
        return f"links {one} and {two} cannot meet{at}: {apart}, the links {limit}", CHECK_LENGTHS
    (root,), (slide,), (name,) = group.angles, group.slides, slides
    if group.form == "angle and fixed slide":
        on_line = {n for k in group.edges if edges[k].slide == slide for n in (edges[k].tail, edges[k].head)}
        pins = [node for node in ends[root] if node not in on_line] or ends[root]
        off = abs(cross(directions[slide], span))
        line = f"the line of '{name}' passes {points(pins[:1])} at a distance of {off:.5g}"
        return f"link {links[root]} is too short to reach its slide: {line}", CHECK_LENGTHS
    off = abs(cross(directions[slide], vectors[root]))
    joints = points(dict.fromkeys((group.loops[0].start, group.loops[0].end)))
    apart = f"its joints{f' {joints}' if joints else ''} are {gap:.5g} apart"
    return (
        f"slide '{name}' cannot close: {apart}, nearer than the {off:.5g} that its links hold them off the line",
        CHECK_LENGTHS,
    )


def _newton(state: State, group: Group, gaps: Complexes) -> str:
    graph = state.graph
    used = sorted({k for k in group.edges if k < len(graph.edges)})
    joints = ", ".join(sorted(graph.joined(used)))
    worst = max(used, key=lambda k: abs(gaps[k]))
    at = f"'{owners_of(graph, [worst])[0]}'" if owners_of(graph, [worst]) else "one of them"
    best = f"at best {at} stays {abs(gaps[worst]):.5g} too short or too long"
    return f"links {', '.join(owners_of(graph, used))} do not meet (joints {joints}), {best}"


def closing_range(valid: Callable[[Floats], Flags], coordinate: Coordinate, size: float, unit: float) -> str:
    """The values of one drive for which a mechanism closes while the others are held; empty if there are none.

    `valid` tells for an array of values (radians or lengths) where the mechanism closes; lengths are tried from -4 to 4
    times `size`. `unit` is the study's unit of angle in radians.
    """
    angle = coordinate.quantity == "angle"
    values = np.linspace(0.0, 2 * np.pi, SWEEP_POSES) if angle else np.linspace(-4 * size, 4 * size, SWEEP_POSES)
    closed = np.asarray(valid(values), dtype=bool)
    if not closed.any():
        return ""
    changes = np.flatnonzero(closed[1:] != closed[:-1])
    a, b, at_a = values[changes], values[changes + 1], closed[changes]
    for _ in range(END_HALVINGS):
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
