"""Numbers of a motion in time as goals: when something happens, and the last velocity."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.command_line import ask
from helpers.studies import study_of

import mechdesign

BLOCK = """
units: {length: m, force: N}
mechanism:
  parameters: {mu: 0.1}
  links: {ground: {O: [0, 0]}, block: {points: {B: [0, 0]}, mass: 2}}
  joints: {way: {prismatic: [ground, block], through: O}}
  drives: {s: {slide: way}}
  sketch: {B: [0, 0]}
  friction: {way: {coefficient: mu}}
dynamics: {gravity: [0, -10], forward: {duration: 1, start: {s: 0, s_velocity: 1.5}, rows: 3}}
optimize:
  variables: {mu: {from: 0.1, to: 0.2, step: 0.1}}
  minimize: [dynamics.events.standstill.time]
"""


@pytest.mark.parametrize(("goal", "best"), [
    ("dynamics.events.standstill.time", 0.75),
    ("{result: dynamics.forward.s_velocity, where: {time: {at_least: 1}}}", 0.0),
])  # fmt: skip
def test_a_number_of_a_motion_in_time_is_a_goal(goal: str, best: float) -> None:
    kept = mechdesign.optimize(study_of(BLOCK, f"optimize.minimize=[{goal}]")).main
    assert kept[kept.names[2]][0] == pytest.approx(best, rel=1e-9, abs=1e-12)


def test_a_row_that_extremes_never_have_is_said_before_the_motion_is_computed(tmp_path: Path) -> None:
    late = "{result: dynamics.forward.s_velocity, where: {time: {at_least: 1}}, at_most: 1}"
    wrong = "{result: dynamics.extremes.peak, where: {output: s}, at_most: 1}"
    done = ask("dynamics", "-", "--no-plots", "--out", tmp_path, study=BLOCK + f"requirements: [{wrong}, {late}]\n")
    assert done.exit_code == 2
    assert "no row of extremes has output s; did you mean 's_effort' or 's_power'" in done.stderr
    assert not list(tmp_path.iterdir())
