"""Messages for a mechanism whose drives do not fit: which links and joints are wrong, and what would mend them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechanismError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.graphs import pieces
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.decomposition import Undetermined, compile_structure
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.mechanism.elements.joints import Prismatic
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.rigidity import LoopEquations, null_space, separated
from mechdesign.mechanism.sketch import Sketch

DRIVES = "mechanism.drives"
# Largest number of joints or links that a message names.
MAX_NAMED = 12
# Largest number of motions that a message names.
MAX_MOTIONS = 4


def listed(names: Iterable[str], last: str = "and") -> str:
    """Names in quotes as a phrase, ``'a', 'b' and 'c'``; of more than `MAX_NAMED` the number of the rest."""
    quoted = [f"'{name}'" for name in dict.fromkeys(names)]
    if len(quoted) > MAX_NAMED:
        quoted = [*quoted[:MAX_NAMED], f"{len(quoted) - MAX_NAMED} more"]
    return f" {last} ".join(part for part in (", ".join(quoted[:-1]), quoted[-1] if quoted else "") if part)


def joints_in_words(description: Description, graph: Graph) -> list[str]:
    """A description of every joint with the links that it joins."""
    clamps = [point for _, _, point in graph.clamps.values()]
    pins = {point: graph.links_at(point) for point in graph.holders if ":" not in point}
    pins = {point: links for point, links in pins.items() if len(links) - clamps.count(point) > 1}
    words = [f"revolute {point} ({', '.join(links)})" for point, links in pins.items()]
    words += [f"telescopic {name}" for name, link in description.links.items() if link.telescopic]
    for name, joint in description.joints.items():
        parts = (*joint.links, joint.point)[:2]
        words.append(f"{type(joint).__name__.lower()} {name} ({', '.join(parts)})")
    return words


def near_singular(regularity: float) -> list[Caution]:
    """A warning where the regularity of the sketch is so small that it is singular."""
    if regularity >= STALLED:
        return []
    return [Caution(
        "singular",
        f"the sketch is at a singular position (regularity {regularity:.1g} of 1): its drives hold the links "
        "hardly or not at all there, and rates there mean nothing; draw another pose",
    )]  # fmt: skip


def wrong_count(
    description: Description, equations: LoopEquations, sketch: Sketch, count: int, drives: Sequence[Coordinate]
) -> MechanismError:
    """The error for a number of drives other than the mobility by counting: why, and what mends it."""
    still = _still(description, equations.graph, drives)
    if still is not None:
        return still
    given = len(drives)
    start = f"the mobility is {count} but {given} drive{' is' if given == 1 else 's are'} given"
    x = equations.assemble(sketch)
    if x is not None:
        real, x = equations.mobility(x)
        if real > max(count, 0):
            return over_constrained(description, equations, x, count, real, given)
    words = joints_in_words(description, equations.graph)
    more = f"; and {len(words) - MAX_NAMED} more" if len(words) > MAX_NAMED else ""
    joints = f". Joints found: {'; '.join(words[:MAX_NAMED]) or 'none'}{more}"
    if description.couplings:
        joints += f". Couplings: {', '.join(description.couplings)}"
    # The fault is not in special dimensions. Random ones avoid motions that exist only to first order (dead centres).
    jacobian = equations.generic(drives)
    if given < count:
        mend = _too_free(equations, jacobian, [c.name for c in drives], count - given) + _loose_ends(equations.graph)
    elif count > 0:
        names = _named(equations, jacobian, drives)
        doubles = [name for name in names if name in description.drives]
        couplings = [name for name in names if name in description.couplings]
        by = f" by {_parts(equations, couplings)}" if couplings else ""
        which = (
            f" (one of {listed(doubles, 'or')}: each of them follows from the others{by})" if len(doubles) > 1 else ""
        )
        mend = f"remove {given - count} drive{'s' if given - count > 1 else ''}{which}"
    else:
        mend = f"it is rigid, nothing can move. {_rigid(equations, count, drives)}"
    return MechanismError(f"{start}: {mend}{joints}", DRIVES)


def _still(description: Description, graph: Graph, given: Sequence[Coordinate]) -> MechanismError | None:
    """The error for a given coordinate that cannot change; None where all can."""
    fixed = {graph.node(point) for body, point in graph.points if body == GROUND}
    for coordinate in given:
        why = ""
        if coordinate.kind == "angle":
            (one, _), (other, _) = graph.bodies[coordinate.body], graph.bodies[coordinate.reference]
            if one == other:
                why = f"'{coordinate.body}' and '{coordinate.reference}' are tied by slides or clamps and turn as one"
        elif coordinate.kind in ("x", "y") and coordinate.node in fixed:
            why = f"point '{graph.nodes[coordinate.node]}' is fixed on the ground"
        if why:
            drive = coordinate.name in description.drives
            where = f"{DRIVES}.{coordinate.name}" if drive else "poses"
            cure = f"{'drive' if drive else 'give'} something that moves"
            return MechanismError(f"'{coordinate.name}' never changes: {why}; {cure}", where)
    return None


def _too_free(equations: LoopEquations, jacobian: Floats, drives: Sequence[str], missing: int) -> str:
    """Too few drives: which links still move while the drives are held, and which drives would hold them."""
    graph = equations.graph
    free = [_motion(graph, motion) for motion in _motions(equations, jacobian)]
    add = f"add {missing} drive{'s' if missing > 1 else ''}"
    examples = list(dict.fromkeys(drive for _, _, drive in free if drive))
    more = " ..." if len(examples) > MAX_MOTIONS else ""
    hint = f", for example {', '.join(examples[:MAX_MOTIONS])}{more}" if examples else ""
    if not drives:
        return f"{add}{hint}"
    idle = f"as nothing drives or holds {'it' if len(free) == 1 else 'them'}"
    held = f"with {listed(drives)} held, {motions_in_words(equations, jacobian)}, {idle}"
    link = free[0][1]
    if len(free) == 1 and link is not None:
        mates = [
            f"'{body.removesuffix(':rod')}'"
            for mine, point in graph.points
            for body, shared in graph.points
            if mine == link and shared == point and graph.bodies[body][0] != graph.bodies[link][0]
        ]
        clamp = f", clamp it to {' or '.join(dict.fromkeys(mates))}" if mates else ""
        return f"{held}: {add}{hint}{clamp}, or leave it out"
    return f"{held}: {add}{hint}, or clamp or leave out what need not move"


def _loose_ends(graph: Graph) -> str:
    """A hint at two points, on one link each, whose names differ by a slip so that one pin may be meant."""
    owners = {point: graph.links_at(point) for point in graph.holders}
    on_slides = {graph.nodes[node] for edge in graph.edges if edge.slide is not None for node in (edge.tail, edge.head)}
    lone = [point for point, links in owners.items() if len(links) == 1 and point not in on_slides and ":" not in point]
    for k, point in enumerate(lone):
        near = [other for other in lone[:k] if owners[other] != owners[point] and _alike(other, point)]
        if near:
            pair = f"'{near[0]}' ('{owners[near[0]][0]}') and '{point}' ('{owners[point][0]}')"
            return f". Points {pair} are on one link each: if they are one pin, give them one name"
    return ""


def _alike(a: str, b: str) -> bool:
    """Whether one name may be the other mistyped: in another case, or with a letter added or dropped."""
    a, b = sorted((a.lower(), b.lower()), key=len)
    return a == b or (len(b) == len(a) + 1 and any(b[:k] + b[k + 1 :] == a for k in range(len(b))))


def over_constrained(
    description: Description, equations: LoopEquations, x: Floats, count: int, real: int, given: int
) -> MechanismError:
    """The error for a chain that moves although by counting it cannot: which links or joints are redundant."""
    start = (
        f"the count gives mobility {count}, yet with these dimensions it moves with {real} degree"
        f"{'s' if real > 1 else ''} of freedom: it is over-constrained"
    )
    idle = repeating(description, equations, x, real - count)
    where = DRIVES
    if idle:
        links = [name for name in idle if name in description.links]
        where = f"mechanism.{'links' if idle[0] in description.links else 'joints'}.{idle[0]}"
        noun = "link" if len(links) == len(idle) else "joint" if not links else "part"
        one = len(idle) == 1
        mend = (
            f"{noun}{'' if one else 's'} {listed(idle)} repeat{'s' if one else ''} what the other links impose: leave "
            f"{'it' if one else 'them'} out, the motion stays the same"
        )
        if links:
            mend += " (points that other links need stay with those)"
    else:
        parts = _parts(equations, _named(equations, equations.jacobian(x)))
        mend = f"{parts} hold each other more often than it takes"
    if given != real:
        mend += f"; then give {real} drive{'s' if real > 1 else ''} instead of {given}"
    return MechanismError(f"{start}; {mend}", where)


def undetermined(
    description: Description, equations: LoopEquations, sketch: Sketch, given: Sequence[Coordinate], reason: str
) -> MechanismError:
    """The error for given coordinates that fix some links twice and leave others free; else it has the `reason`."""
    graph = equations.graph
    still = _still(description, graph, given)
    if still is not None:
        return still
    driven = [coordinate.name for coordinate in given] == list(description.drives)
    if driven:
        x = equations.assemble(sketch)
        real, x = (0, x) if x is None else equations.mobility(x)
        if x is not None and real > len(given):
            return over_constrained(description, equations, x, len(given), real, len(given))
    subject = "the drives" if driven else ", ".join(coordinate.name for coordinate in given)
    verb = "does" if len(given) == 1 and not driven else "do"
    why = _twice_and_free(equations, given, driven) or reason
    where = DRIVES if driven else "poses"
    return MechanismError(f"{subject} {verb} not determine the mechanism: {why}", where)


def _twice_and_free(equations: LoopEquations, given: Sequence[Coordinate], driven: bool) -> str:
    graph = equations.graph
    jacobian = equations.generic(given)
    edges, used = doubled(equations, jacobian)
    conditions = [*equations.couplings, *given]
    names = [coordinate.name for coordinate, says in zip(conditions, used, strict=True) if says]
    links = owners_of(graph, edges)
    for coordinate, says in zip(conditions, used, strict=True):
        if says and coordinate.kind == "angle" and coordinate.body not in links:
            links.append(coordinate.body)
    parts = []
    if names:
        parts.append(f"{listed(names)} fix{'es' if len(names) == 1 else ''} {_parts(equations, links)} twice over")
    elif links:
        parts.append(f"{_parts(equations, links)} hold each other more often than it takes")
    free = motions_in_words(equations, jacobian)
    if free:
        parts.append(f"with {'the drives' if driven else 'them' if len(given) > 1 else 'it'} held, {free}")
    return "; ".join(parts)


def _links(names: Sequence[str]) -> str:
    return f"link{'s' if len(names) > 1 else ''} {listed(names)}"


def _named(equations: LoopEquations, jacobian: Floats, held: Sequence[Coordinate] = ()) -> list[str]:
    """Links, joints, couplings and held coordinates whose equations depend on each other."""
    edges, used = doubled(equations, jacobian)
    conditions = zip([*equations.couplings, *held], used, strict=True)
    return [*owners_of(equations.graph, edges), *(condition.name for condition, says in conditions if says)]


def _parts(equations: LoopEquations, names: Sequence[str]) -> str:
    """Names of links, joints and couplings as a phrase: ``links 'a' and 'b' and joint 'c'``."""
    bodies, couplings = equations.graph.bodies, {coupling.name for coupling in equations.couplings}
    kinds = {name: "link" if name in bodies else "coupling" if name in couplings else "joint" for name in names}
    named = []
    for noun in ("link", "joint", "coupling"):
        own = [name for name in names if kinds[name] == noun]
        named += [f"{noun}{'s' if len(own) > 1 else ''} {listed(own)}"] if own else []
    return " and ".join(named) or "the same part"


def _rigid(equations: LoopEquations, count: int, drives: Sequence[Coordinate]) -> str:
    """Which links hold each other in a mechanism that cannot move, and what to leave out."""
    graph = equations.graph
    if count == 0:
        try:
            groups = compile_structure(graph, []).groups
        except Undetermined:
            groups = ()
        for group in groups:
            if group.solved:
                loop = _parts(equations, [GROUND, *owners_of(graph, group.edges)])
                return f"A rigid loop: {loop}; leave one of them out, or divide one by a joint"
    names = _named(equations, equations.generic())
    if not names:
        # Couplings that leave nothing to the drives.
        couplings = {coupling.name for coupling in equations.couplings}
        names = [name for name in _named(equations, equations.generic(drives), drives) if name in couplings]
    if names:
        return (
            f"What holds each other more often than it takes: {_parts(equations, names)}; leave out "
            f"{len(drives) - count} of them, or free a joint"
        )
    return "Free a joint or a link"


def _motions(equations: LoopEquations, jacobian: Floats) -> list[Floats]:
    """Independent motions in the null space of a Jacobian, in the order of the links that move."""
    motions = separated(null_space(jacobian), equations.inner)
    return sorted(motions, key=lambda motion: np.flatnonzero(motion).tolist())


def motions_in_words(equations: LoopEquations, jacobian: Floats) -> str:
    """The motions in the null space of a Jacobian as a phrase; empty where there are none."""
    words = [_motion(equations.graph, motion)[0] for motion in _motions(equations, jacobian)]
    more = [f"and {len(words) - MAX_MOTIONS} more motions"] if len(words) > MAX_MOTIONS else []
    return "; ".join([*words[:MAX_MOTIONS], *more])


def _motion(graph: Graph, motion: Floats) -> tuple[str, str | None, str | None]:
    """A motion in words, the link if only one turns, and a drive that would hold it."""
    angles, inner = graph.classes - 1, graph.classes - 1 + len(graph.slides)
    turning = [
        body
        for body, (frame, _) in graph.bodies.items()
        if frame > 0 and motion[frame - 1] and not body.endswith(":rod")
    ]
    sliding = [name for k, name in enumerate(graph.slides) if motion[angles + k]]
    legs = {graph.slides[k] for k in graph.telescopic}
    moving = np.any(motion[inner:].reshape(-1, 2) != 0, axis=1)
    moves = {graph.nodes[k + 1] for k in np.flatnonzero(moving)}
    frames = {graph.bodies[body][0] for body in turning}
    pivots = [(body, point) for body, point in graph.points if graph.bodies[body][0] in frames and point not in moves]
    drive = f"'{sliding[0]}'" if sliding else None
    if turning:
        carrier = next((body for body, point in pivots if ":" not in body), turning[0])
        drive = f"{{angle: {carrier}}}" if carrier in legs else f"'{carrier}'"
    if len(frames) == 1 and not sliding and pivots:
        text = f"{_links(turning)} turn{'s' if len(turning) == 1 else ''} freely about '{pivots[0][1]}'"
        return text, turning[0] if len(turning) == 1 else None, drive
    if len(sliding) == 1 and not turning:
        noun = "leg" if sliding[0] in legs else "joint"
        return f"{noun} '{sliding[0]}' slides freely", None, drive
    slide = f"{listed(sliding)} slide{'s' if len(sliding) == 1 else ''}" if sliding else ""
    move = f"{_links(turning)} move{'s' if len(turning) == 1 else ''}" if turning else ""
    return " and ".join(part for part in (move, slide) if part) or "points move", None, drive


def doubled(equations: LoopEquations, jacobian: Floats) -> tuple[list[int], list[bool]]:
    """Edges and held coordinates whose equations depend on each other: those in the left null space."""
    stress = null_space(jacobian.T)
    count = len(equations.graph.edges)
    size = np.abs(stress).max(axis=1, initial=0.0) > 1e-6
    edges = [k for k in range(count) if size[2 * k] or size[2 * k + 1]]
    return edges, [bool(used) for used in size[2 * count :]]


def owners_of(graph: Graph, edges: Iterable[int]) -> list[str]:
    """Names of the links and joints of edges, without the ground."""
    names = []
    for k in edges:
        edge = graph.edges[k]
        name = graph.slides[edge.slide] if edge.slide is not None else edge.locals[0][1].removesuffix(":rod")
        if name != GROUND:
            names.append(name)
    return list(dict.fromkeys(names))


def repeating(description: Description, equations: LoopEquations, x: Floats, excess: int) -> list[str]:
    """Redundant links or joints: those that can be left out without changing the motion.

    `x` is a configuration within the motion, `excess` the number of degrees of freedom beyond the mobility by counting.
    """
    graph = equations.graph
    jacobian = equations.jacobian(x)
    free, more = equations.without(jacobian, set(), set())
    stressed, _ = doubled(equations, jacobian)
    driven = {name for drive in description.drives.values() for name in (drive.target, drive.reference)}
    repeated: list[str] = []
    edges: set[int] = set()
    classes: set[int] = set()
    for name in reversed(list(dict.fromkeys(owners_of(graph, stressed)))):
        own = {k for k in range(len(graph.edges)) if name in owners_of(graph, [k])}
        frames = set()
        if name in description.links:
            bodies = [body for body, (frame, _) in graph.bodies.items() if frame == graph.bodies[name][0]]
            if name in driven or bodies != [name] or description.links[name].telescopic:
                continue
            frames = {graph.bodies[name][0]}
            if any(name in joint.links for joint in description.joints.values()):
                continue
        elif name in driven or not _can_go(description, name):
            continue
        freedom, left = equations.without(jacobian, edges | own, classes | frames)
        gain = more - left
        if freedom == free and gain > 0:
            repeated.append(name)
            edges |= own
            classes |= frames
            excess, more = excess - gain, left
            if excess <= 0:
                return repeated
    return []


def _can_go(description: Description, joint: str) -> bool:
    """Whether the links of a joint still turn together if the joint is left out."""
    slide = description.joints[joint]
    if not isinstance(slide, Prismatic):
        return True
    others = (other.links for name, other in description.joints.items() if name != joint)
    return any({*slide.links} <= piece for piece in pieces(others))
