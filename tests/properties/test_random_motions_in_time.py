"""Motions in time of random mechanisms with friction, against bodies by Newton and Euler and a balance of energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from helpers.layouts import DUMPER
from helpers.random_friction import Rubbed, rubbed
from helpers.studies import study_of
from hypothesis import assume, event, given, settings

from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.results import Result
from mechdesign.questions.dynamics.analysis import dynamics

DURATION, ROWS = 0.02, 4
# Part of the largest number that takes part within which forces agree, and of the energies.
EXACT, KEPT = 1e-8, 1e-8


def efforts_of(case: Rubbed) -> dict[str, float]:
    """An effort of each drive."""
    return dict.fromkeys(case.layout.drives, 1.0)


def moved(case: Rubbed) -> Result:
    """The motion in time from the first pose with its rates, under constant efforts."""
    study: dict[str, Any] = yaml.safe_load(case.text)
    section = study["dynamics"]
    (start, *_), rates = section.pop("poses"), section.pop("rates")
    del section["accelerations"]
    start |= {f"{name}_velocity": rate for name, rate in rates.items()}
    section["forward"] = {"duration": DURATION, "rows": ROWS, "start": start, "efforts": efforts_of(case)}
    return dynamics(study_of(yaml.dump(study, Dumper=DUMPER)))


def judge(case: Rubbed) -> None:
    """Bodies that move so need the efforts that are given, and the work done is the gain of energy."""
    try:
        result = moved(case)
    except MechdesignError as error:
        event(f"refused: {error}"[:50])
        assume(False)
    table = result.main
    event("ended early" if result.warnings else "whole")
    assume(len(table) == ROWS and result.drawn is not None)
    energy = table["kinetic_energy"] + table["potential_energy"] - table["work"]
    size = max(np.ptp(table["kinetic_energy"]), np.ptp(table["work"]), table["kinetic_energy"].max(), 1e-3)
    assert np.abs(energy - energy[0]).max() <= KEPT * size

    def in_radians(word: str) -> dict[str, Any]:
        units = {name: case.degree if kind == "angle" else 1.0 for name, (kind, *_) in case.layout.drives.items()}
        return {name: unit * table[f"{name}_{word}"] for name, unit in units.items()}

    case.bodies = case.at(result.drawn.shown.configuration, in_radians("velocity"), in_radians("acceleration"))
    power = case.rub()
    event("converged" if power is not None else "diverged")
    assume(power is not None)
    assert case.acting is not None
    np.testing.assert_allclose(table["kinetic_energy"], case.acting.kinetic, atol=EXACT * size, rtol=0)
    held = [np.abs(part).max() for part in case.bodies.multipliers.values()]
    largest = max(*held, np.abs(case.bodies.inertia).max(), 1.0)
    for name, effort in efforts_of(case).items():
        np.testing.assert_allclose(case.bodies.multipliers["drive", name][:, 0], effort, atol=EXACT * largest, rtol=0)


@pytest.mark.nightly
@settings(max_examples=20)
@given(rubbed())
def test_motions_of_twenty_mechanisms(case: Rubbed) -> None:
    judge(case)
