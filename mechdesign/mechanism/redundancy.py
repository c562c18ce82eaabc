"""What repeats the work of the rest: equations that depend on each other, links and joints that can be left out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description, Fixed, Prismatic
from mechdesign.mechanism.rigidity import Equations, null_space
from mechdesign.numerics.arrays import Floats


def doubled(equations: Equations, jacobian: Floats) -> tuple[list[int], list[bool]]:
    """Edges and held coordinates whose equations depend on each other: the support of the left null space."""
    stress = null_space(jacobian.T)
    count = len(equations.graph.edges)
    size = np.abs(stress).max(axis=1, initial=0.0) > 1e-6
    edges = [k for k in range(count) if size[2 * k] or size[2 * k + 1]]
    return edges, [bool(used) for used in size[2 * count :]]


def owners_of(graph: Graph, edges: Iterable[int]) -> list[str]:
    """Links and joints that edges belong to, the ground left out."""
    found = []
    for k in edges:
        edge = graph.edges[k]
        name = graph.slides[edge.slide] if edge.slide is not None else edge.locals[0][1].removesuffix(":rod")
        if name != GROUND:
            found.append(name)
    return list(dict.fromkeys(found))


def repeating(description: Description, equations: Equations, x: Floats, excess: int) -> list[str]:
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
    free, more = equations.without(jacobian, set(), set())
    stressed, _ = doubled(equations, jacobian)
    driven = {name for drive in description.drives.values() for name in (drive.target, drive.reference)}
    found: list[str] = []
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
            if any(name in _line_links(description, joint) for joint in description.joints):
                continue
        elif name in driven or not _can_go(description, name):
            continue
        freedom, left = equations.without(jacobian, edges | own, classes | frames)
        gain = more - left
        if freedom == free and gain > 0:
            found.append(name)
            edges |= own
            classes |= frames
            excess, more = excess - gain, left
            if excess <= 0:
                return found
    return []


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
