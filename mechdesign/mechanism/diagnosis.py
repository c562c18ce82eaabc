"""What is wrong with a mechanism whose drives do not fit it, in words: which links and joints, and what mends it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mechdesign.errors import MechanismError
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.describe import joints_in_words
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description, Fixed, Prismatic
from mechdesign.mechanism.rigidity import Equations, Vector, null_space, separated
from mechdesign.mechanism.sketch import Sketch
from mechdesign.mechanism.structure import Structure, Undetermined, compile_structure

DRIVES = "mechanism.drives"
# A message names so many joints and links; nobody reads more.
MANY = 12


def listed(names: Iterable[str], last: str = "and") -> str:
    """Names in quotes as a phrase; of very many only the first."""
    quoted = [f"'{name}'" for name in dict.fromkeys(names)]
    if len(quoted) > MANY:
        quoted = [*quoted[:MANY], f"{len(quoted) - MANY} more"]
    return f" {last} ".join(part for part in (", ".join(quoted[:-1]), quoted[-1] if quoted else "") if part)


def wrong_count(
    description: Description, equations: Equations, sketch: Sketch, count: int, drives: Sequence[Coordinate]
) -> MechanismError:
    """Why the number of drives is not that of the degrees of freedom by counting."""
    given = len(drives)
    start = f"the mobility is {count} but {given} drive{' is' if given == 1 else 's are'} given"
    x = equations.assemble(sketch)
    real = None
    if x is not None:
        real, x = equations.mobility(x)
        if real > max(count, 0):
            return _over_constrained(description, equations, x, count, real, given)
    found = joints_in_words(description, equations.graph)
    more = f"; and {len(found) - MANY} more" if len(found) > MANY else ""
    joints = f". Joints found: {'; '.join(found[:MANY]) or 'none'}{more}"
    jacobian = equations.generic(drives) if x is None else equations.jacobian(x, drives)
    if given < count:
        add = f"add {count - given} drive{'s' if count - given > 1 else ''}"
        free = [_motion(equations.graph, motion) for motion in _motions(equations, jacobian)]
        named = "; ".join(text for text, _ in free[:MANY])
        hint = listed((drive for _, drive in free if drive), "and")
        held = f"with {listed(c.name for c in drives)} held, " if drives else "nothing is driven: "
        mend = f"{held}{named}. {add[0].upper()}{add[1:]}{f', for example {hint}' if hint else ''}"
        if drives:
            mend += ", or clamp or leave out what need not move"
        return MechanismError(f"{start}: {mend}{joints}", DRIVES)
    if count > 0:
        doubled = [c.name for c, used in zip(drives, _doubled(equations, jacobian)[1], strict=True) if used]
        which = f" (one of {listed(doubled, 'or')}: each of them follows from the others)" if len(doubled) > 1 else ""
        change = given - count
        return MechanismError(f"{start}: remove {change} drive{'s' if change > 1 else ''}{which}{joints}", DRIVES)
    rigid = _rigid(equations, x, count)
    return MechanismError(f"{start}: it is rigid, nothing can move. {rigid}{joints}", DRIVES)


def _over_constrained(
    description: Description, equations: Equations, x: Vector, count: int, real: int, given: int
) -> MechanismError:
    """A chain that moves although the count says it cannot: what repeats the work of the rest."""
    start = (
        f"the count gives mobility {count}, yet with these dimensions it moves with {real} degree"
        f"{'s' if real > 1 else ''} of freedom: it is over-constrained"
    )
    idle = repeating(description, equations, x, real - count)
    where = DRIVES
    if idle:
        links = [name for name in idle if name in description.links]
        where = f"mechanism.{'links' if idle[0] in description.links else 'joints'}.{idle[0]}"
        what = "link" if len(links) == len(idle) else "joint" if not links else "part"
        one = len(idle) == 1
        mend = (
            f"{what}{'' if one else 's'} {listed(idle)} repeat{'s' if one else ''} what the other links impose: leave "
            f"{'it' if one else 'them'} out, the motion stays the same"
        )
        if links:
            mend += " (points that other links need stay with those)"
    else:
        edges, _ = _doubled(equations, equations.jacobian(x))
        mend = f"links {listed(_owners(equations.graph, edges))} are joined to each other more often than they need"
    if given != real:
        mend += f"; then give {real} drive{'s' if real > 1 else ''} instead of {given}"
    return MechanismError(f"{start}; {mend}", where)


def repeating(description: Description, equations: Equations, x: Vector, excess: int) -> list[str]:
    """Links, else joints, that can be left out without changing the motion, as many as there is excess; or none.

    Parameters
    ----------
    x : array
        A configuration in the midst of the motion.
    excess : int
        Degrees of freedom beyond the count.
    """
    graph = equations.graph
    jacobian = equations.jacobian(x)
    free = null_space(jacobian).shape[1]
    stressed, _ = _doubled(equations, jacobian)
    driven = {name for drive in description.drives.values() for name in (drive.target, drive.reference)}
    found: list[str] = []
    edges: set[int] = set()
    classes: set[int] = set()
    for name in reversed(list(dict.fromkeys(_owners(graph, stressed)))):
        own = {k for k in range(len(graph.edges)) if name in _owners(graph, [k])}
        frames = set()
        if name in description.links:
            bodies = [body for body, (frame, _) in graph.bodies.items() if frame == graph.bodies[name][0]]
            if name in driven or bodies != [name] or description.links[name].telescopic:
                continue
            frames = {graph.bodies[name][0]}
            if any(name in _line_links(description, joint) for joint in description.joints):
                continue
        elif name in driven or not _can_go(description, name):
            continue
        equal = equations.freedom_without(jacobian, edges | own, classes | frames) == free
        gain = 2 * len(own) - len(frames) - _fewer_unknowns(equations, edges, own)
        if equal and gain > 0:
            found.append(name)
            edges |= own
            classes |= frames
            excess -= gain
            if excess <= 0:
                return found
    return []


def _fewer_unknowns(equations: Equations, before: set[int], own: set[int]) -> int:
    """Unknowns that go with the edges `own`, those `before` being gone: slides, and nodes that only they place."""
    edges = equations.graph.edges
    left = {node for k, e in enumerate(edges) if k not in before | own for node in (e.tail, e.head)}
    lonely = {node for k in own for node in (edges[k].tail, edges[k].head)} - left - {0}
    return 2 * len(lonely) + sum(edges[k].slide is not None for k in own)


def _line_links(description: Description, joint: str) -> tuple[str, ...]:
    found = description.joints[joint]
    if isinstance(found, Fixed):
        return found.links
    return (found.line.link, *([found.slider] if isinstance(found, Prismatic) else ()))


def _can_go(description: Description, joint: str) -> bool:
    """Whether a slide can be left out and its links still turn together as before."""
    found = description.joints[joint]
    if isinstance(found, Fixed) or not isinstance(found, Prismatic):
        return True
    reached = {found.line.link}
    pairs = [
        {*_line_links(description, name)}
        for name, other in description.joints.items()
        if name != joint and isinstance(other, Fixed | Prismatic)
    ]
    for _ in pairs:
        reached.update(*(pair for pair in pairs if pair & reached))
    return found.slider in reached


def check_independent(equations: Equations, structure: Structure) -> None:
    """Check the groups without a closed form for equations that depend on each other whatever the dimensions.

    Raises
    ------
    Undetermined
        If there are any: a part that floats is joined within itself too often, and another is free.
    """
    if any(group.form == "newton" for group in structure.groups):
        jacobian = equations.generic(structure.given)
        if np.isfinite(jacobian).all() and null_space(jacobian).shape[1]:
            raise Undetermined("the given coordinates fix one part of the mechanism twice and leave another free")


def undetermined(equations: Equations, given: Sequence[Coordinate], reason: str) -> str:
    """Which links given coordinates fix twice and which they leave free; `reason` where that cannot be told."""
    graph = equations.graph
    jacobian = equations.generic(given)
    if not np.isfinite(jacobian).all():
        return reason
    edges, used = _doubled(equations, jacobian)
    names = [coordinate.name for coordinate, says in zip(given, used, strict=True) if says]
    links = _owners(graph, edges)
    for coordinate, says in zip(given, used, strict=True):
        if says and coordinate.kind == "angle" and coordinate.body not in links:
            links.append(coordinate.body)
    parts = []
    if names:
        parts.append(f"{listed(names)} fix{'es' if len(names) == 1 else ''} {_links(links)} twice over")
    elif links:
        parts.append(f"{_links(links)} are joined to each other more often than they need")
    free = [_motion(graph, motion)[0] for motion in _motions(equations, jacobian)]
    if free:
        parts.append(f"with {'them' if len(given) > 1 else 'it'} held, {'; '.join(free[:MANY])}")
    return "; ".join(parts) or reason


def _links(names: Sequence[str]) -> str:
    return f"link{'s' if len(names) > 1 else ''} {listed(names)}" if names else "the same part"


def _rigid(equations: Equations, x: Vector | None, count: int) -> str:
    """Which links hold each other, in a mechanism that does not move."""
    graph = equations.graph
    if count == 0:
        try:
            groups = compile_structure(graph, []).groups
        except Undetermined:
            groups = ()
        for group in groups:
            if group.form != "place":
                edges = [k for loop in group.loops for k, _ in loop.edges]
                links = dict.fromkeys([GROUND, *_owners(graph, edges)])
                return f"Links {listed(links)} form a rigid loop: give it one more link or joint, or take one link out"
    edges, _ = _doubled(equations, equations.generic() if x is None else equations.jacobian(x))
    links = _owners(graph, edges)
    if links:
        return f"Links {listed(links)} hold each other more than once: take {1 - count} of such links or joints out"
    return "Free a joint or a link"


def _doubled(equations: Equations, jacobian: Vector) -> tuple[list[int], list[bool]]:
    """Edges and held coordinates whose equations depend on each other: the support of the left null space."""
    stress = null_space(jacobian.T)
    count = len(equations.graph.edges)
    size = np.abs(stress).max(axis=1, initial=0.0) > 1e-6
    edges = [k for k in range(count) if size[2 * k] or size[2 * k + 1]]
    return edges, [bool(used) for used in size[2 * count :]]


def _owners(graph: Graph, edges: Iterable[int]) -> list[str]:
    """Links and joints that edges belong to, the ground left out."""
    found = []
    for k in edges:
        edge = graph.edges[k]
        name = graph.slides[edge.slide] if edge.slide is not None else edge.locals[0][1].removesuffix(":rod")
        if name != GROUND:
            found.append(name)
    return list(dict.fromkeys(found))


def _motions(equations: Equations, jacobian: Vector) -> list[Vector]:
    """Independent motions that the rows of a Jacobian leave, the angles and slides first in each."""
    return separated(null_space(jacobian), equations.inner)


def _motion(graph: Graph, motion: Vector) -> tuple[str, str | None]:
    """A motion in words, and the name of something whose drive would hold it."""
    angles, inner = graph.classes - 1, graph.classes - 1 + len(graph.slides)
    turning = [
        body
        for body, (frame, _) in graph.bodies.items()
        if frame > 0 and motion[frame - 1] and not body.endswith(":rod")
    ]
    sliding = [name for k, name in enumerate(graph.slides) if motion[angles + k]]
    moving = np.any(motion[inner:].reshape(2, -1) != 0, axis=0)
    moves = {graph.nodes[k + 1] for k in np.flatnonzero(moving)}
    frames = {graph.bodies[body][0] for body in turning}
    pivots = [
        point
        for body, point in graph.points
        if graph.bodies[body][0] in frames and point not in moves and ":" not in point
    ]
    carried = {point for body, point in graph.points if graph.bodies[body][0] in frames}
    if len(frames) == 1 and not sliding and moves <= carried and pivots:
        together = f"{_links(turning)} turn{'s' if len(turning) == 1 else ''}"
        return f"{together} freely about '{pivots[0]}', nothing drives or holds it", turning[0]
    if len(sliding) == 1 and not turning:
        return f"'{sliding[0]}' slides freely, nothing drives or holds it", sliding[0]
    grounded = [body for body in turning if any(point in pivots for owner, point in graph.points if owner == body)]
    drive = (grounded or sliding or turning or [None])[0]
    if not turning:
        return f"{listed(sliding)} slide together", drive
    together = f"{_links(turning)} still move{'s' if len(turning) == 1 else ''}"
    return together + (f" and {listed(sliding)} slide{'s' if len(sliding) == 1 else ''}" if sliding else ""), drive
