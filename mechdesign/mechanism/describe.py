"""How a mechanism is understood and solved, in words for `mechdesign check`."""

from __future__ import annotations

from mechdesign.errors import MechanismError
from mechdesign.mechanism import assemblies
from mechdesign.mechanism.derivatives import STALLED, regularity
from mechdesign.mechanism.four_bars import describe_loops
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Limit, Measure, Term
from mechdesign.mechanism.naming import group_in_words, joints_in_words, placed_before


def groups_in_words(mechanism: Mechanism) -> list[str]:
    """What the drives place at once, and the groups in the order of their solution."""
    description, graph, plan = mechanism.description, mechanism.graph, mechanism.forward
    placed = placed_before(graph, plan.structure)
    solved = [k for k, group in enumerate(plan.structure.groups) if group.form != "place"]
    at_once = placed[solved[0]] if solved else placed[-1]
    lines = []
    links = [body for body in graph.bodies if body in at_once and body != GROUND and not body.endswith(":rod")]
    if links:
        lines.append(f"placed by the drives: {', '.join(links)}")
    if solved:
        lines.append("solved in this order:")
    for number, k in enumerate(solved, 1):
        lines.append(f"  {number}. {group_in_words(description, graph, plan, k, placed[k])}")
    return lines


def describe(mechanism: Mechanism) -> str:
    """Links, joints, mobility, the order of solution, assembly modes, measures, limits, and what is odd."""
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
        lines += assemblies.in_words(mechanism)
    except MechanismError as error:
        lines.append(f"assembly modes: {error}")
    lines.append(f"branch: {description.branch}")
    lines += [f"measure: {_measure(measure)}" for measure in description.measures.values()]
    lines += [f"limit: {_limit(mechanism, limit)}" for limit in description.limits]
    near = float(regularity(mechanism.linearize(mechanism.sketch_configuration)))
    if near < STALLED:
        lines.append(
            f"warning: the sketch is at a singular position (regularity {near:.1g} of 1): its drives hold the links "
            "hardly or not at all there, and rates there mean nothing"
        )
    return "\n".join(lines)


def _measure(measure: Measure) -> str:
    if measure.expression is not None:
        return f"{measure.name} = {measure.expression.text}"
    first, second = measure.items or ("", "")
    between = f"from {first} to {second}" if measure.kind == "angle" else f"of {first} and {second}"
    return f"{measure.name}, {measure.kind} {between}"


def _limit(mechanism: Mechanism, limit: Limit) -> str:
    def value(term: Term) -> float:
        if not isinstance(term, str):
            return term
        place = mechanism.description.places[term]
        return place.nominal / (mechanism.description.angle_unit if place.quantity == "angle" else 1.0)

    ends = (("from", limit.minimum), ("to", limit.maximum))
    bounds = [f"{word} {value(term):.6g}" for word, term in ends if term is not None]
    return f"{limit.kind} {'-'.join(limit.items)} {' '.join(bounds)}"
