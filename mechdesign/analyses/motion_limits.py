"""Limits of a motion: the values of the drive at which a mechanism stops moving."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import CHUNK, in_study_units, radians
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.structure import Group
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup

# Halvings of a step of the sweep: enough to reach the last bit of any drive's value.
HALVINGS = 60
GOLDEN = (math.sqrt(5) - 1) / 2
# A closure (a difference of squared lengths) that falls below this part of its largest value touches zero.
TOUCHING = 1e-10


def limits_of_motion(study: Study, group: PoseGroup, swept: str, reason: NDArray[np.int8]) -> Table:
    """Values of the swept coordinate where the mechanism ceases to be valid, by bisection between poses.

    `kind` is ``dead centre`` (a group of links is stretched or folded), ``limit`` (one that the study states) or
    ``other assembly``; `joint` names the joints of the group, or the limit.
    """
    mechanism = study.mechanism
    plan = mechanism.plan(group.names)
    coordinates = plan.structure.given
    columns = [radians(study, c, v) for c, v in zip(coordinates, group.columns(), strict=True)]
    k = group.names.index(swept)
    valid = reason[group.rows] == Reason.OK
    steps = np.flatnonzero(valid[1:] != valid[:-1])
    inner = np.where(valid[steps], steps, steps + 1)
    outer = np.where(valid[steps], steps + 1, steps)
    good, bad = columns[k][inner].astype(float), columns[k][outer].astype(float)
    configuration: Configuration | None = None
    for _ in range(HALVINGS if len(steps) else 0):
        middle = (good + bad) / 2
        given = [c[inner] for c in columns]
        given[k] = middle
        configuration = plan.solve(given)
        inside = configuration.valid
        good, bad = np.where(inside, middle, good), np.where(inside, bad, middle)
    kinds, joints = [], []
    if configuration is not None:
        given = [c[inner] for c in columns]
        given[k] = bad
        configuration = plan.solve(given)
        for row in range(len(steps)):
            kind, joint = _why(mechanism, plan, configuration, row)
            kinds.append(kind)
            joints.append(joint)
    unit = study.units.label(mechanism.quantity(swept))
    return Table(
        "limits",
        (
            Column(
                swept, np.asarray(in_study_units(study, coordinates[k], good)), unit, "value at the limit of motion"
            ),
            Column("kind", np.array(kinds, dtype=str), "", "what ends the motion"),
            Column("joint", np.array(joints, dtype=str), "", "where"),
        ),
        "limits of motion found along the sweep",
    )


def _why(mechanism: Mechanism, plan: Plan, configuration: Configuration, row: int) -> tuple[str, str]:
    reason = Reason(int(configuration.reason[row]))
    if reason == Reason.LIMIT:
        margins = [
            (float(np.broadcast_to(m, configuration.shape)[row]), name) for name, m in mechanism.margins(configuration)
        ]
        return "limit", min(margins)[1]
    if reason == Reason.OTHER_ASSEMBLY:
        return "other assembly", ""
    for group, closure in zip(_closing_groups(plan), configuration.closures, strict=True):
        if not np.broadcast_to(closure, configuration.shape)[row] >= 0:
            return "dead centre", _joints(mechanism, group)
    return "dead centre", ""


def _closing_groups(plan: Plan) -> list[Group]:
    """The group of each closure of a configuration."""
    counts = {"two angles": 2, "angle and fixed slide": 1, "angle and turning slide": 1}
    return [group for group in plan.structure.groups for _ in range(counts.get(group.form, 0))]


def _joints(mechanism: Mechanism, group: Group) -> str:
    graph = mechanism.graph
    edges = [graph.edges[k] for loop in group.loops for k, _ in loop.edges if k < len(graph.edges)]
    return " ".join(dict.fromkeys(graph.nodes[n] for e in edges for n in (e.tail, e.head) if ":" not in graph.nodes[n]))


def change_points(study: Study, group: PoseGroup, swept: str, reason: NDArray[np.int8]) -> list[str]:
    """Warnings for values of the swept coordinate at which a group's two assemblies meet and the motion goes on.

    There a closure touches zero without crossing it; its smallest values between poses are found by golden section.
    """
    mechanism = study.mechanism
    plan = mechanism.plan(group.names)
    coordinates = plan.structure.given
    columns = [radians(study, c, v) for c, v in zip(coordinates, group.columns(), strict=True)]
    k = group.names.index(swept)
    closing = _closing_groups(plan)
    valid = reason[group.rows] == Reason.OK
    lanes: list[tuple[int, int, float]] = []
    for first in range(0, len(valid) - 2 if closing else 0, CHUNK):
        some = slice(first, first + CHUNK + 2)
        held = valid[some]
        closures = plan.solve([c[some] for c in columns]).closures
        margins = np.stack([np.broadcast_to(c, held.shape) for c in closures])
        low = held[:-2] & held[1:-1] & held[2:]
        low = low & (margins[:, 1:-1] <= margins[:, :-2]) & (margins[:, 1:-1] < margins[:, 2:])
        lanes += [(j, first + i, margins[j].max()) for j, i in np.argwhere(low).tolist()]
    if not lanes:
        return []
    which, row, scale = (np.array(part) for part in zip(*lanes, strict=True))
    begin, end = columns[k][row], columns[k][row + 2]

    def closure(place: NDArray[np.float64]) -> NDArray[np.float64]:
        given = [c[row] for c in columns]
        given[k] = place
        closures = plan.solve(given).closures
        every = np.stack([np.broadcast_to(c, row.shape) for c in closures])
        own: NDArray[np.float64] = every[which, np.arange(len(row))]
        return own

    for _ in range(HALVINGS):
        left, right = end - GOLDEN * (end - begin), begin + GOLDEN * (end - begin)
        lower = closure(left) < closure(right)
        begin, end = np.where(lower, begin, left), np.where(lower, right, end)
    unit = study.units.label(mechanism.quantity(swept))
    found: dict[tuple[str, str], None] = {}
    for lane in np.flatnonzero(np.abs(closure(begin)) <= TOUCHING * scale).tolist():
        place = f"{in_study_units(study, coordinates[k], begin[lane]):.6g} {unit}".rstrip()
        found[place, _joints(mechanism, closing[which[lane]])] = None
    return [
        f"change point at {swept} = {place} (joints {joints}): two assemblies meet there, and branch 'side' keeps each "
        "joint on its side of the line, where a made mechanism may cross it"
        for place, joints in found
    ]
