"""Joints in words, and the groups that a mechanism is solved in: dyads by their joints (RRR, RRP, RPR, PRP, RPP)."""

from __future__ import annotations

from dataclasses import dataclass

from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description, Fixed, Prismatic
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.structure import Group, Structure

# What stands for everything that is placed before a group.
BASE = ""


@dataclass(frozen=True)
class Chain:
    """The bodies that a group places, and its joints in order: their letters (R, P), pins and slides."""

    links: tuple[str, ...]
    letters: str
    pins: tuple[str, ...]
    slides: tuple[str, ...]


def joints_in_words(description: Description, graph: Graph) -> list[str]:
    """Every joint with the links it joins."""
    holders: dict[str, list[str]] = {}
    for body, point in graph.points:
        if ":" not in point:
            link = body.removesuffix(":rod")
            if link not in holders.setdefault(point, []):
                holders[point].append(link)
    clamps = [joint.point for joint in description.joints.values() if isinstance(joint, Fixed)]
    found = [
        f"revolute {point} ({', '.join(links)})"
        for point, links in holders.items()
        if len(links) - clamps.count(point) > 1
    ]
    found += [f"telescopic {name}" for name, link in description.links.items() if link.telescopic]
    for name, joint in description.joints.items():
        links = joint.links if isinstance(joint, Fixed) else (joint.line.link, getattr(joint, "slider", joint.point))
        found.append(f"{type(joint).__name__.lower()} {name} ({', '.join(links)})")
    return found


def placed_before(graph: Graph, structure: Structure) -> list[set[str]]:
    """Bodies that lie fast before each group is solved, and last those that do in the end."""
    roots, nodes = {0}, {0} | {node for node, _, _ in structure.known_nodes}
    found = []
    for group in structure.groups:
        found.append(_lying(graph, structure, roots, nodes))
        roots |= set(group.angles)
        for k, _ in group.tree:
            nodes |= {structure.edges[k].tail, structure.edges[k].head}
    return [*found, _lying(graph, structure, roots, nodes)]


def _lying(graph: Graph, structure: Structure, roots: set[int], nodes: set[int]) -> set[str]:
    return {
        body
        for body, point in graph.points
        if structure.ties[graph.bodies[body][0]].root in roots and graph.node(point) in nodes
    } | {GROUND}


def chain_of(description: Description, graph: Graph, structure: Structure, group: Group, placed: set[str]) -> Chain:
    """Walk round a group's only loop."""
    (loop,) = group.loops
    # Round the loop: bodies (str) and between them joints (letter, name); what is placed already is the base.
    walk: list[str | tuple[str, str]] = []
    node = loop.start

    def to(body: str) -> None:
        body = BASE if body in placed else body
        before = walk[-1] if walk else BASE
        if isinstance(before, str) and before != body:
            if not _clamped(description, before, body, graph.nodes[node]):
                walk.append(("R", graph.nodes[node]))
            walk.append(body)
        elif not isinstance(before, str):
            walk.append(body)

    for k, sign in loop.edges:
        edge = structure.edges[k]
        if edge.slide is None or edge.slide not in group.slides:
            # A given distance is no body of the mechanism; it spans like a link.
            to(edge.locals[0][1] if edge.locals else "a given distance")
        else:
            name = graph.slides[edge.slide]
            tail, head = _slide_bodies(description, name)
            ends = [tail, head] if sign > 0 else [head, tail]
            to(ends[0] if ends[0] is not None else f"pin in {name}")
            walk.append(("P", name))
            node = edge.head if sign > 0 else edge.tail
            to(ends[1] if ends[1] is not None else f"pin in {name}")
        node = edge.head if sign > 0 else edge.tail
    if walk and walk[-1] != BASE:
        walk.append(("R", graph.nodes[loop.end]))
    if [step[0] for step in walk if isinstance(step, tuple)] in (["P", "R", "R"], ["P", "P", "R"]):
        # Told from the pin on, as textbooks do.
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
    return Chain(
        tuple(link for link in dict.fromkeys(links) if not link.startswith("pin in ")),
        letters,
        tuple(dict.fromkeys(name for letter, name in joints if letter == "R" and ":" not in name)),
        tuple(dict.fromkeys(name for letter, name in joints if letter == "P")),
    )


def _pinned(
    description: Description, graph: Graph, one: str, other: str, middle: list[str]
) -> tuple[str, str, str] | None:
    """The link beyond one of two slides that is neither driven nor ground, its pin, and that slide."""
    driven = {name for drive in description.drives.values() for name in (drive.target, drive.reference)} | {GROUND}
    for slide in (one, other):
        for body in _slide_bodies(description, slide):
            if body is None or body in driven or body in middle:
                continue
            for owner, point in graph.points:
                if owner == body and any(point == shared and mate != body for mate, shared in graph.points):
                    return body, point, slide
    return None


def _slide_bodies(description: Description, name: str) -> tuple[str, str | None]:
    """Bodies at the tail and head of a slide; None for the pin in a slot, a body of no size."""
    joint = description.joints.get(name)
    if joint is None:
        return name, f"{name}:rod"
    assert not isinstance(joint, Fixed)
    return joint.line.link, joint.slider if isinstance(joint, Prismatic) else None


def _clamped(description: Description, a: str, b: str, point: str) -> bool:
    pair = {a.removesuffix(":rod"), b.removesuffix(":rod")}
    clamps = [joint for joint in description.joints.values() if isinstance(joint, Fixed)]
    return any({*joint.links} == pair and joint.point == point for joint in clamps)


def group_in_words(description: Description, graph: Graph, plan: Plan, index: int, placed: set[str]) -> str:
    """One group with its joints, its unknowns and the side that the sketch chose."""
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
        edges = {edge for loop in group.loops for edge, _ in loop.edges if edge < len(graph.edges)}
        nodes = {node for k in edges for node in (graph.edges[k].tail, graph.edges[k].head)}
        points = ", ".join(graph.nodes[node] for node in sorted(nodes) if ":" not in graph.nodes[node])
        loops = f"{len(group.loops)} loop{'s' if len(group.loops) != 1 else ''}"
        name = f"group of {loops} without a closed form{f' at {points}' if points else ''}, by Newton's method"
        return f"{name}: {', '.join(unknowns)}"
    chain = chain_of(description, graph, structure, group, placed)
    name = f"{chain.letters} {'dyad' if len(chain.letters) == 3 else 'loop'} {'-'.join(chain.links)}"
    name += f" at {', '.join(chain.pins)}" if chain.pins else ""
    name += f" along {', '.join(chain.slides)}" if chain.slides else ""
    return f"{name}: {', '.join(unknowns)}{_side(graph, group, mode, chain)}"


def _displacement(graph: Graph, slide: int) -> str:
    return f"{graph.slides[slide]}.{'length' if slide in graph.telescopic else 'slide'}"


def _side(graph: Graph, group: Group, mode: int, chain: Chain) -> str:
    if mode == 0:
        return ""
    if group.form == "two angles" and len(chain.pins) == 3:
        first, inner, last = chain.pins
        return f" ({inner} {'left' if mode > 0 else 'right'} of {first}-{last})"
    if group.slides:
        return f" ({'larger' if mode > 0 else 'smaller'} {_displacement(graph, group.slides[0])})"
    return f" (assembly {mode:+d})"
