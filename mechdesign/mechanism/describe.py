"""How a mechanism is understood and solved, in words for `mechdesign check`."""

from __future__ import annotations

from collections.abc import Sequence

from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description, Fixed
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.structure import Form, Group

DYADS: dict[Form, str] = {
    "two angles": "RRR dyad",
    "angle and fixed slide": "RRP dyad",
    "angle and turning slide": "RPR dyad",
    "two slides": "dyad of two slides (PRP or RPP)",
    "newton": "group without a closed form, by Newton's method",
}


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


def groups_in_words(graph: Graph, plan: Plan) -> list[str]:
    """The groups of a plan in the order of their solution; places of points on known links are left out."""
    lines = []
    for group, mode in zip(plan.structure.groups, plan.modes, strict=True):
        if group.form == "place":
            continue
        unknowns = [f"{name}.angle" for name in _links(graph, plan, group.angles)]
        unknowns += [f"{graph.slides[slide]} slide" for slide in group.slides]
        assembly = f", assembly {mode:+d}" if mode else ""
        lines.append(f"{DYADS[group.form]}{_joints(graph, group)}: {', '.join(unknowns)}{assembly}")
    return lines


def _links(graph: Graph, plan: Plan, roots: Sequence[int]) -> list[str]:
    ties = plan.structure.ties
    return [
        body
        for body, (frame, _) in graph.bodies.items()
        if ties[frame].root in roots and body != GROUND and not body.endswith(":rod")
    ]


def _joints(graph: Graph, group: Group) -> str:
    nodes = {node for loop in group.loops for k, _ in loop.edges for node in (graph.edges[k].tail, graph.edges[k].head)}
    names = [graph.nodes[node] for node in sorted(nodes) if ":" not in graph.nodes[node]]
    return f" at {', '.join(names)}" if names else ""


def report(description: Description, graph: Graph, mobility: int, plan: Plan) -> str:
    """Links, joints, mobility, drives and the order of solution."""
    loops = len(graph.edges) - len(graph.nodes) + 1
    lines = [
        f"links: {', '.join(description.links)}",
        *(f"joint: {joint}" for joint in joints_in_words(description, graph)),
        f"mobility: {mobility}, loops: {loops}, drives: {', '.join(description.drives) or 'none'}",
    ]
    groups = groups_in_words(graph, plan)
    if groups:
        lines += ["solved in this order:", *(f"  {k}. {group}" for k, group in enumerate(groups, 1))]
    else:
        lines.append("solved directly: the drives place every link")
    return "\n".join(lines)
