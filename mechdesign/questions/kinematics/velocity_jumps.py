"""Where the velocities of a motion jump: there accelerations and forces of inertia are infinite."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import counted
from mechdesign.ground.numerics.arrays import Floats, distinct
from mechdesign.questions.kinematics.moved import MovedQuestion
from mechdesign.questions.kinematics.rates import moving_at

# Velocities jump that differ by more of the largest one, at so many rows before and behind a corner.
JUMPED, BESIDE = 1e-5, 1e-8


def velocity_jumps(question: MovedQuestion, bodies: Collection[str], design: int = 0) -> Floats:
    """Places of a design's motion, in rows, at which velocities of some bodies jump; its first and last do not count.

    Velocities may jump at the corners of a path that is passed with a speed, of a motion over time, and of couplings.
    """
    study, poses, curve = question.study, question.poses, question.curve
    if curve is None or not question.section.rated:
        return np.empty(0)
    own = curve.pieces.line == design
    ends = curve.pieces.end[own] if curve.corners else np.empty(0)
    timed = question.section.speed is not None or poses.rule.timed
    places = distinct(np.concatenate([ends, poses.rule.corners if timed else ends]))
    places = places[(places > 0) & (places < poses.end)]
    if not len(places):
        return places
    sides = np.concatenate([places - BESIDE, places + BESIDE])
    there = curve.solve(np.full(len(sides), design), sides, judged=False)
    velocity = moving_at(question.section, there, study.mechanism.linearize(there.configuration)).velocity
    if velocity is None:
        return np.empty(0)
    graph, size = study.mechanism.graph, study.mechanism.size
    nodes = {graph.node(point) for body, point in graph.points if body in bodies}
    frames = {graph.bodies[body][0] for body in bodies}
    moves = [*(velocity.nodes[node] for node in nodes), *(size * np.asarray(velocity.angles[k]) for k in frames)]
    table = np.array([np.broadcast_to(move, sides.shape) for move in moves]).reshape(len(moves), 2, len(places))
    largest = np.nanmax(np.abs(table), initial=0.0)
    return np.asarray(places[(np.abs(table[:, 1] - table[:, 0]) > JUMPED * largest).any(axis=0)])


def jumps_in_words(question: MovedQuestion, places: Floats, table: str, design: int = 0) -> Caution:
    """The warning of jumps at some places."""
    poses, line = question.poses, np.array([design])
    first = question.motion.at(poses.along(line, places[:1])).in_words(0)
    row = int(places[0]) + design * poses.line if places[0] % 1 == 0 else None
    if not poses.rule.timed and np.isin(places, poses.rule.corners).all():
        text = (
            f"the path has corners at {counted(len(places), 'pose')}, the first: {first}; velocities there are those "
            "of the segment that begins, and the acceleration that a corner takes is in no row; 'spline: true' has no "
            "corners"
        )
    else:
        text = (
            f"the velocity jumps at {counted(len(places), 'instant')}, the first: {first}; the acceleration that a "
            "jump takes is in no row; of the laws only 'constant' jumps, and what follows by a coupling at its corners"
        )
    return Caution("incomplete", text, table, row, first)
