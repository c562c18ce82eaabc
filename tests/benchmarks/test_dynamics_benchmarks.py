"""Speed of dynamics: efforts and all joint forces of a Watt six-bar in one thread, the whole question, and its text.

Poses are taken in blocks whose columns fit the cache.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.door.report.tables import csv_blocks
from mechdesign.ground.work.threads import keep_freed_memory
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.forces import Forces, Moving, inertia
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.mechanism.statics import balance, reactions
from mechdesign.questions.dynamics.analysis import dynamics

POSES, BLOCK = 1_000_000, 16_384
SWEEP = 100_000
WATT = f"""
units: {{length: m, angle: rad, force: N}}
mechanism:
  links:
    ground: {{O: [0, 0], D: [4, 0], G: [8, 0]}}
    crank: {{from: O, to: A, length: 1, mass: 1, inertia: 0.1}}
    rod: {{from: A, to: B, length: 3.5, mass: 2, inertia: 0.4}}
    rocker: {{from: D, to: B, length: 3, points: {{C: [3.2, 0.4]}}, mass: 2, inertia: 0.3}}
    link: {{from: C, to: F, length: 4, mass: 2, inertia: 0.5}}
    last: {{from: G, to: F, length: 3, mass: 1.5, inertia: 0.3}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0.5, 0.87], B: [3.3, 2.9], C: [2.9, 3.1], F: [6.7, 2.7]}}
dynamics:
  gravity: [0, -9.81]
  sweep: {{theta: {{from: 0, to: 2*pi, number: {SWEEP}}}}}
  rates: {{theta: 10}}
"""


@pytest.mark.parametrize("solving", [False, True], ids=["from_solved_poses", "with_solving"])
def test_efforts_and_joint_forces_a_second(benchmark: Any, solving: bool) -> None:
    mechanism = study_of(WATT).mechanism
    joints = Joints(mechanism.description, mechanism.graph)
    keep_freed_memory()  # as the package does where poses are many
    theta = np.random.default_rng(0).uniform(-np.pi, np.pi, POSES)
    blocks = [theta[begin : begin + BLOCK] for begin in range(0, POSES, BLOCK)]
    solved = [] if solving else [mechanism.forward.solve([block]) for block in blocks]

    def forces_of(configuration: Configuration) -> None:
        linear = mechanism.linearize(configuration)
        velocity = linear.velocity([10.0])
        moving = Moving(velocity, linear.acceleration(velocity, [0.0]))
        forces = Forces(configuration)
        inertia(forces, mechanism.geometry, mechanism.description.masses, moving, -9.81j, 1.0)
        reactions(joints, balance(linear, forces))

    def whole() -> None:
        for configuration in (mechanism.forward.solve([block]) for block in blocks) if solving else solved:
            forces_of(configuration)

    benchmark.pedantic(whole, rounds=5, warmup_rounds=1)
    benchmark.extra_info["poses_per_second"] = POSES / benchmark.stats.stats.min


def test_the_whole_question(benchmark: Any) -> None:
    study = study_of(WATT)
    result = benchmark.pedantic(dynamics, (study,), {"jobs": 1}, rounds=5, warmup_rounds=1)
    assert result.main["valid"].all()
    assert len(result.tables["joint_forces"]) == 7 * SWEEP
    benchmark.extra_info["poses_per_second"] = SWEEP / benchmark.stats.stats.min


def test_joint_forces_as_text(benchmark: Any) -> None:
    table = dynamics(study_of(WATT)).tables["joint_forces"]
    benchmark.pedantic(lambda: sum(map(len, csv_blocks(table))), rounds=3, warmup_rounds=1)
    benchmark.extra_info["rows_per_second"] = len(table) / benchmark.stats.stats.min
