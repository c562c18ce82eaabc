"""The loop equations are stated once; their matrix is the derivative of their errors, whatever they are taken for."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.mechanism.loops import Loops
from mechdesign.mechanism.structure import whole

# A crank, a rod with a point beside its line, a slider on an inclined guide, and a leg to a point of the rod.
STUDY = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, -5], F: [60, 60]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {P: [45, 20]}}
    leg: {from: F, to: P, telescopic: true}
  joints:
    guide: {slot: ground, through: G, direction: 10 deg, point: B}
  drives: [crank]
  sketch: {A: [10, 28], B: [95, 10]}
  measures: {reach: {distance: [F, B]}}
"""


def test_the_matrix_of_all_equations_is_the_derivative_of_their_errors() -> None:
    mechanism = study_of(STUDY).mechanism
    graph = mechanism.graph
    structure = whole(graph, [mechanism.coordinate(name) for name in ("reach", "P.x", "leg.length", "crank")])
    (group,) = structure.groups
    loops = Loops.start(graph, structure, mechanism.geometry.nominal, [0.0] * 4)
    count = len(group.angles) + len(group.slides) + 2 * len(group.bases)
    x = np.random.default_rng(1).uniform(-1, 1, count)

    def errors(unknowns: np.ndarray) -> np.ndarray:
        loops.put(group, unknowns)
        return np.array(loops.equations(group)[1], dtype=float)

    h = 1e-6
    slopes = np.transpose([(errors(x + step) - errors(x - step)) / (2 * h) for step in h * np.eye(count)])
    loops.put(group, x)
    assert np.array(loops.equations(group)[0], dtype=float) == pytest.approx(slopes, abs=1e-6)


def test_a_slide_lies_as_far_along_its_line_as_its_ends_are_apart() -> None:
    mechanism = study_of(STUDY).mechanism
    pose = mechanism.sketch_configuration
    graph = mechanism.graph
    loops = Loops.start(graph, whole(graph), mechanism.geometry.nominal, ())
    loops.nodes, loops.rotations = list(pose.nodes), list(pose.rotations)
    found = {graph.slides[e.slide]: loops.displacement(k) for k, e in enumerate(graph.edges) if e.slide is not None}
    ends = {"leg": ("F", "P"), "guide": ("G", "B")}
    apart = {name: abs(complex(pose.point(b)) - complex(pose.point(a))) for name, (a, b) in ends.items()}
    assert found == pytest.approx(apart)
