"""`mechdesign.evaluate` as an optimiser calls it: processor time a design, beside load and ask in a loop."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import mechdesign

FOUR_BAR = """
mechanism:
  parameters: {a: 30, c: 60}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, 90], rocker: [D, B, c]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle]}
"""
SWING = "kinematics.extremes.rocker.angle.range"
DESIGNS, ALONE = 100, 5


def test_extremes_of_a_turn_of_a_four_bar(benchmark: Any) -> None:
    """At most 0.3 ms of processor time a design in calls of 100; a fiftieth of what load and ask cost."""
    study, random = mechdesign.load(text=FOUR_BAR), np.random.default_rng(1)
    entries = ("mechanism.parameters.a", "mechanism.links.ground.D.0")
    spent = []

    def call() -> mechdesign.Table:
        values = dict(zip(entries, random.uniform([[20], [95]], [[30], [105]], (2, DESIGNS)), strict=True))
        begun = time.process_time()
        table = mechdesign.evaluate(study, values, [SWING])
        spent.append((time.process_time() - begun) / DESIGNS)
        assert table["valid"].all()
        return table

    call()
    benchmark.pedantic(call, rounds=10)
    begun = time.process_time()
    for a in random.uniform(20, 30, ALONE).tolist():
        mechdesign.kinematics(mechdesign.load(text=FOUR_BAR, overrides={entries[0]: a}))
    alone = (time.process_time() - begun) / ALONE
    benchmark.extra_info |= {"cpu_ms_a_design": 1e3 * min(spent[1:]), "of_load_and_ask": min(spent[1:]) / alone}
    assert min(spent[1:]) < min(3e-4, alone / 50)
