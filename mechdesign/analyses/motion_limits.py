"""Limits of a motion: the values of the drive at which a mechanism stops moving."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.plan import Plan
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup

# Halvings of a step of the sweep: enough to reach the last bit of any drive's value.
HALVINGS = 60


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
    graph = mechanism.graph
    closures = [float(np.broadcast_to(c, configuration.shape)[row]) for c in configuration.closures]
    position = 0
    for group in plan.structure.groups:
        count = {"two angles": 2, "angle and fixed slide": 1, "angle and turning slide": 1}.get(group.form, 0)
        if count and not min(closures[position : position + count]) >= 0:
            edges = [graph.edges[k] for loop in group.loops for k, _ in loop.edges]
            nodes = dict.fromkeys(graph.nodes[n] for e in edges for n in (e.tail, e.head) if ":" not in graph.nodes[n])
            return "dead centre", " ".join(nodes)
        position += count
    return "dead centre", ""
