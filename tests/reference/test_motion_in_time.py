"""A motion in time through poses at which many loops lose rank together."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.ground.results import Result, Table
from mechdesign.questions.dynamics.analysis import dynamics

UNITS = "units: {length: m, angle: rad, force: N}\n"
BAR = f"mass: 1, center: [0.5, 0], inertia: {1 / 12!r}"


def run(text: str) -> Result:
    return dynamics(study_of(text))


def balance(table: Table) -> np.ndarray:
    """What the energies have gained beyond the work that was put in; 0."""
    energy = table["kinetic_energy"] + table["potential_energy"] - table["work"]
    return np.asarray(energy - energy[0])


@pytest.mark.nightly
def test_forty_four_bars_go_through_the_pose_in_which_all_links_lie_on_a_line() -> None:
    # IFToMM library of computational benchmark problems, N four-bars: links of 1 m and 1 kg, from the upright position
    # with 1 m/s, here 5 s of its 10 s. All links are on a line twice a turn, where the loops lose rank; the mechanism
    # is a pendulum of N + 1 bars that turn with the crank and N that do not, of J = (N + 1)/3 + N and
    # m r = (N + 1)/2 + N.
    count = 40
    points = ", ".join(f"A{k}: [{k}, 0]" for k in range(count + 1))
    cranks = "\n".join(f"    r{k}: {{from: A{k}, to: B{k}, length: 1, {BAR}}}" for k in range(count + 1))
    rods = "\n".join(f"    c{k}: {{from: B{k}, to: B{k + 1}, length: 1, {BAR}}}" for k in range(count))
    pins = ", ".join(f"B{k}: [{k}, 1]" for k in range(count + 1))
    text = f"""{UNITS}
mechanism:
  links:
    ground: {{{points}}}
{cranks}
{rods}
  drives: {{theta: {{angle: r0}}}}
  sketch: {{{pins}}}
dynamics: {{gravity: [0, -9.81], forward: {{duration: 5, start: {{theta: pi/2, theta_velocity: -1}}, rows: 51}}}}
"""
    table = run(text).main
    assert np.abs(balance(table)).max() < 5e-9 * table["kinetic_energy"].max()
    inertia, moment = (count + 1) / 3 + count, (count + 1) / 2 + count
    alone = run(f"""{UNITS}
mechanism:
  links:
    ground: {{O: [0, 0]}}
    arm: {{from: O, to: P, length: 1, mass: {moment}, center: [1, 0], inertia: {inertia + 10 - moment}}}
  drives: {{theta: {{angle: arm}}}}
dynamics:
  gravity: [0, {-9.81 * (inertia + 10) / inertia!r}]
  forward: {{duration: 5, start: {{theta: pi/2, theta_velocity: -1}}, rows: 51}}
""").main
    assert table["theta"] == pytest.approx(alone["theta"], abs=1e-6)
