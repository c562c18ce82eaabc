"""A mechanism and the order of its solution in words, for `mechdesign check`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechanismError
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.coordinates import winding
from mechdesign.mechanism.derivatives import regularity
from mechdesign.mechanism.diagnosis import joints_in_words, near_singular
from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.elements.measures import Limit, Measure
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.four_bars import describe_loops
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.sketch import deciding_joints
from mechdesign.mechanism.structure import Group, Structure

# In a chain: any body that is placed before the group.
BASE = ""
# Prefix of the name of a pin that slides in a slot.
PIN_IN = "pin in "


@dataclass(frozen=True)
class GroupChain:
    """The bodies that a group places, and its joints in order: their letters (R, P), pins and slides."""

    links: tuple[str, ...]
    letters: str
    pins: tuple[str, ...]
    slides: tuple[str, ...]


class LinkWords(NamedTuple):
    """A link, its points, and its length; None where it has none or its length varies."""

    name: str
    points: tuple[str, ...]
    length: float | None
    telescopic: bool


def groups_in_words(mechanism: Mechanism) -> Iterator[str]:
    """The links that the drives place directly, and the groups in the order of their solution."""
    description, graph, plan = mechanism.description, mechanism.graph, mechanism.forward
    placed = placed_before(graph, plan.structure)
    solved = [k for k, group in enumerate(plan.structure.groups) if group.solved]
    at_once = placed[solved[0]] if solved else placed[-1]
    links = [body for body in graph.bodies if body in at_once and body != GROUND and not body.endswith(":rod")]
    if links:
        yield f"placed by the drives: {', '.join(links)}"
    if solved:
        yield "solved in this order:"
    for number, k in enumerate(solved, 1):
        yield f"  {number}. {group_in_words(description, graph, plan, k, placed[k])}"


def sketch_doubts(mechanism: Mechanism) -> list[Caution]:
    """A warning where the sketch is at a singular position."""
    return near_singular(float(regularity(mechanism.linearize(mechanism.sketch_configuration))))


def describe(mechanism: Mechanism) -> str:
    """Links, joints, mobility, the order of solution, assembly modes, measures, limits, and a warning if singular."""
    description, graph = mechanism.description, mechanism.graph
    loops = len(graph.edges) - len(graph.nodes) + 1
    lines = [
        f"links: {', '.join(description.links)}",
        *(f"joint: {joint}" for joint in joints_in_words(description, graph)),
        f"mobility: {mechanism.mobility}, loops: {loops}, drives: {', '.join(description.drives) or 'none'}",
        *groups_in_words(mechanism),
        *describe_loops(mechanism),
    ]
    try:
        lines += assemblies_in_words(mechanism)
    except MechanismError as error:
        lines.append(f"assembly modes: {error}")
    lines.append(f"branch: {description.branch}")
    lines += [f"measure: {_measure(measure)}" for measure in description.measures.values()]
    lines += [f"limit: {_limit(mechanism, limit)}" for limit in description.limits]
    lines += [
        f"coupling: {name} ({coupling.set_} = {coupling.function.text})"
        for name, coupling in description.couplings.items()
    ]
    lines += [f"spring: {name} ({', '.join(spring.between)}){_wound(mechanism, spring)}"
              for name, spring in description.springs.items()]  # fmt: skip
    return "\n".join([*lines, *(f"warning: {doubt}" for doubt in sketch_doubts(mechanism))])


def links_in_words(description: Description) -> Iterator[LinkWords]:
    """Every link with its points, and its length where it has two ends."""
    for name, link in description.links.items():
        points = (*link.points, *(end for end in link.ends or () if end not in link.points))
        length = link.points[link.ends[1]][0] if link.ends is not None and not link.telescopic else None
        number = description.places[length].nominal if isinstance(length, str) else length
        yield LinkWords(name, points, number, link.telescopic)


def drives_in_words(description: Description) -> list[str]:
    """Every drive with its coordinate: ``elbow (angle of lower from upper)``."""
    return [
        f"{drive.name} ({drive.kind} of {drive.target}"
        f"{f' from {drive.reference}' if drive.kind == 'angle' and drive.reference != GROUND else ''})"
        for drive in description.drives.values()
    ]


def _measure(measure: Measure) -> str:
    if measure.expression is not None:
        return f"{measure.name} = {measure.expression.text}"
    first, second = measure.items or ("", "")
    between = f"from {first} to {second}" if measure.kind == "angle" else f"of {first} and {second}"
    return f"{measure.name}, {measure.kind} {between}"


def _wound(mechanism: Mechanism, spring: Spring) -> str:
    """How far a torsion spring is wound where the mechanism is drawn."""
    if not spring.turning:
        return ""
    angle = mechanism.drawn_windings[winding(spring).name] - mechanism.geometry.term(spring.free_angle, {})
    return f", wound by {float(angle) / mechanism.description.angle_unit:.6g} in the sketch"


def _limit(mechanism: Mechanism, limit: Limit) -> str:
    def value(term: Term) -> float:
        if not isinstance(term, str):
            return term
        place = mechanism.description.places[term]
        return place.nominal / (mechanism.description.angle_unit if place.quantity == "angle" else 1.0)

    ends = (("from", limit.min), ("to", limit.max))
    bounds = [f"{word} {value(term):.6g}" for word, term in ends if term is not None]
    return f"{limit.kind} {'-'.join(limit.items)} {' '.join(bounds)}"


def assemblies_in_words(mechanism: Mechanism) -> list[str]:
    """The number of assembly modes for given drives, and the joints that choose them."""
    plan = mechanism.forward
    choosing = [group for group, mode in zip(plan.structure.groups, plan.modes, strict=True) if mode]
    joints = [" or ".join(deciding_joints(mechanism.graph, group)[:1]) for group in choosing]
    if not plan.iterative:
        if not joints:
            return ["assembly modes: 1"]
        return [f"assembly modes: {2 ** len(joints)}, chosen by {', '.join(joints)} (2 each)"]
    free = [j for g in plan.structure.groups if g.form == "newton" for j in deciding_joints(mechanism.graph, g)]
    count = len(assemblies(mechanism, mechanism.drives))
    also = f"; {', '.join(joints)} have 2 each" if joints else ""
    return [f"assembly modes: {count} found at the sketch's drive values, for {', '.join(dict.fromkeys(free))}{also}"]


def placed_before(graph: Graph, structure: Structure) -> list[set[str]]:
    """Bodies that are placed before each group is solved, and as last entry after all of them."""
    roots, nodes = {0}, {0} | {node for node, _, _ in structure.known_nodes}
    placed = []
    for group in structure.groups:
        placed.append(_lying(graph, structure, roots, nodes))
        roots |= set(group.angles)
        for k, _ in group.tree:
            nodes |= {structure.edges[k].tail, structure.edges[k].head}
    return [*placed, _lying(graph, structure, roots, nodes)]


def _lying(graph: Graph, structure: Structure, roots: set[int], nodes: set[int]) -> set[str]:
    return {
        body
        for body, point in graph.points
        if structure.ties[graph.bodies[body][0]].root in roots and graph.node(point) in nodes
    } | {GROUND}


def chain_of(
    description: Description, graph: Graph, structure: Structure, group: Group, placed: set[str]
) -> GroupChain:
    """The bodies and joints around the only loop of a group."""
    (loop,), clamps = group.loops, graph.clamps.values()
    # Round the loop: bodies (str) and between them joints (letter, name); bodies placed already are the base.
    walk: list[str | tuple[str, str]] = []
    node = loop.start

    def to(body: str) -> None:
        body = BASE if body in placed else body
        before = walk[-1] if walk else BASE
        if body == before:
            return
        pin = graph.nodes[node]
        if isinstance(before, str) and not any(pin == at and {*pair} == {before, body} for *pair, at in clamps):
            walk.append(("R", pin))
        walk.append(body)

    for k, sign in loop.edges:
        edge = structure.edges[k]
        if edge.slide is None or edge.slide not in group.slides:
            to(edge.locals[0][1])
        else:
            name = graph.slides[edge.slide]
            first, last = _slide_bodies(graph, name)[::sign]
            to(first)
            walk.append(("P", name))
            to(last)
        node = edge.head if sign > 0 else edge.tail
    if walk and walk[-1] != BASE:
        walk.append(("R", graph.nodes[loop.end]))
    if [step[0] for step in walk if isinstance(step, tuple)] in (["P", "R", "R"], ["P", "P", "R"]):
        # Read from the pin, as textbooks do.
        walk.reverse()
    joints = [step for step in walk if isinstance(step, tuple)]
    links = [step.removesuffix(":rod") for step in walk if isinstance(step, str) and step != BASE]
    letters = "".join(letter for letter, _ in joints)
    if letters == "PP":
        # The third joint is the pin at which a link, turned by the slides alone, was placed before.
        letters = "RPP"
        outer = _pinned(description, graph, joints[0][1], joints[1][1], links)
        if outer is not None:
            links.insert(0, outer[0])
            joints.insert(0, ("R", outer[1]))
            if outer[2] == joints[2][1]:
                joints[1:] = joints[:0:-1]
    return GroupChain(
        tuple(link for link in dict.fromkeys(links) if not link.startswith(PIN_IN)),
        letters,
        tuple(dict.fromkeys(name for letter, name in joints if letter == "R" and ":" not in name)),
        tuple(dict.fromkeys(name for letter, name in joints if letter == "P")),
    )


def _pinned(
    description: Description, graph: Graph, one: str, other: str, middle: list[str]
) -> tuple[str, str, str] | None:
    """A link at one of two slides that is neither driven nor ground and has a pin; the pin, and the slide."""
    driven = {name for drive in description.drives.values() for name in (drive.target, drive.reference)} | {GROUND}
    for slide in (one, other):
        for body in _slide_bodies(graph, slide):
            for owner, point in graph.points if body not in driven and body not in middle else ():
                if owner == body and any(point == shared and mate != body for mate, shared in graph.points):
                    return body, point, slide
    return None


def _slide_bodies(graph: Graph, name: str) -> tuple[str, str]:
    """Bodies at the tail and at the head of a slide; the pin in a slot counts as a body."""
    guide, slider = graph.guides[graph.slides.index(name)]
    return guide, slider or f"{PIN_IN}{name}"


def group_in_words(description: Description, graph: Graph, plan: Plan, index: int, placed: set[str]) -> str:
    """A group with its joints, its unknowns and the assembly that the sketch chose."""
    structure = plan.structure
    group, mode = structure.groups[index], plan.modes[index]
    bodies = [
        body
        for body, (frame, _) in graph.bodies.items()
        if structure.ties[frame].root in group.angles and body != GROUND and not body.endswith(":rod")
    ]
    unknowns = [f"{body}.angle" for body in bodies]
    unknowns += [_displacement(graph, slide) for slide in group.slides]
    if group.form == "newton":
        points = ", ".join(sorted(graph.joined(group.edges), key=graph.node))
        loops = f"{len(group.loops)} loop{'s' if len(group.loops) != 1 else ''}"
        name = f"group of {loops} without a closed form{f' at {points}' if points else ''}, by Newton's method"
        return f"{name}: {', '.join(unknowns)}"
    if group.form == "linear":
        names = [structure.values[k].name for k in group.conditions]
        return f"coupling{'s' if len(names) > 1 else ''} {', '.join(names)}: {', '.join(unknowns)}"
    chain = chain_of(description, graph, structure, group, placed)
    name = f"{chain.letters} {'dyad' if len(chain.letters) == 3 else 'loop'} {'-'.join(chain.links)}"
    name += f" at {', '.join(chain.pins)}" if chain.pins else ""
    name += f" along {', '.join(chain.slides)}" if chain.slides else ""
    return f"{name}: {', '.join(unknowns)}{_side(graph, group, mode, chain)}"


def _displacement(graph: Graph, slide: int) -> str:
    return f"{graph.slides[slide]}.{'length' if slide in graph.telescopic else 'slide'}"


def _side(graph: Graph, group: Group, mode: int, chain: GroupChain) -> str:
    if mode == 0:
        return ""
    if group.form == "two angles" and len(chain.pins) == 3:
        first, inner, last = chain.pins
        return f" ({inner} {'left' if mode > 0 else 'right'} of {first}-{last})"
    if group.slides:
        return f" ({'larger' if mode > 0 else 'smaller'} {_displacement(graph, group.slides[0])})"
    return f" (assembly {mode:+d})"
