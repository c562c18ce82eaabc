"""Torsion springs count the turns by which they are wound: from the sketch, and from the free angle as written."""

from __future__ import annotations

import numpy as np
import pytest

import mechdesign

ARM = """
units: {{length: m}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: {{from: O, to: P, length: 1, mass: 1 kg, center: [0, 0], inertia: 0.5 kg*m^2}}}}
  drives: [arm]
  springs: {{return: {{between: [ground, arm], stiffness: 2 N*m/rad, free_angle: {free}}}}}
dynamics: {{{asked}}}
"""
# A four-bar whose spring is wound up by a turn less for every turn of the crank.
FOUR_BAR = """
units: {{length: m}}
mechanism:
  links: {{ground: {{A: [0, 0], D: [4, 0]}}, crank: [A, B, 1], rod: [B, C, 4], rocker: [C, D, 3]}}
  drives: [crank]
  sketch: {{B: [0, 1], C: [3.2, 2.9]}}
  springs: {{return: {{between: [crank, rod], stiffness: 2 N*m/rad, free_angle: -400}}}}
dynamics: {{{poses}}}
"""


def table_of(text: str, name: str = "dynamics") -> dict[str, np.ndarray]:
    table = mechdesign.dynamics(mechdesign.load(text=text)).tables[name]
    return {column.name: np.asarray(column.values) for column in table.columns}


@pytest.mark.parametrize(
    "poses",
    [
        "sweep: {arm: {from: 0, to: 90, step: 45}}",
        "sweep: {arm: {from: 720, to: 1440, step: 360}}",
        "poses: [{arm: 0}, {arm: 300}, {arm: 700}, {arm: -400}]",
    ],
)
@pytest.mark.parametrize("free", [-250, 20, 1000])
def test_a_spring_is_wound_from_its_free_angle_as_written(free: float, poses: str) -> None:
    rows = table_of(ARM.format(free=free, asked=poses))
    wound = np.deg2rad(rows["arm"] - free)
    assert rows["arm_effort"] == pytest.approx(2 * wound, rel=1e-12)
    assert rows["potential_energy"] == pytest.approx(wound**2, rel=1e-12)


@pytest.mark.parametrize(
    "poses",
    [
        "sweep: {crank: {from: 0, to: 720, step: 60}}",
        "sweep: {crank: {from: 800, to: 1000, step: 50}}",
        "poses: [{crank: 0}, {crank: 300}, {crank: 700}, {crank: -400}]",
    ],
)
def test_turns_between_links_that_are_not_driven_count_from_the_sketch(poses: str) -> None:
    rows = table_of(FOUR_BAR.format(poses=poses))

    def rod(crank: np.ndarray) -> np.ndarray:
        pin = np.exp(1j * crank)
        apart = abs(4 - pin)
        along = (16 - 9 + apart**2) / (2 * apart)
        return np.angle((4 - pin) / apart * (along + 1j * np.sqrt(16 - along**2)))

    efforts = []
    for end in np.deg2rad(rows["crank"]):
        way = np.linspace(np.pi / 2, end, 4001)
        wound = np.unwrap(np.angle(np.exp(1j * (rod(way) - way))))[-1] - np.deg2rad(-400)
        rate = np.angle(np.exp(1j * (rod(end + 1e-5) - rod(end - 1e-5)))) / 2e-5 - 1
        efforts.append(2 * wound * rate)
    assert rows["crank_effort"] == pytest.approx(np.array(efforts), rel=1e-7)


@pytest.mark.parametrize("start", [0, 500, 900])
def test_a_spring_wound_by_turns_swings_about_its_free_angle(start: float) -> None:
    rows = table_of(
        ARM.format(free=1000, asked=f"forward: {{duration: 2 s, start: {{arm: {start}}}, rows: 5}}"), "forward"
    )
    assert rows["arm"] == pytest.approx(1000 + (start - 1000) * np.cos(2 * rows["time"]), abs=1e-7)


def test_efforts_of_made_mechanisms_are_those_of_the_wound_spring() -> None:
    text = (
        ARM.format(free=-250, asked="poses: [{arm: 200}]")
        + """
reliability:
  poses: [{arm: 200}]
  outputs: [arm_effort]
  dimensions: {return.stiffness: {tolerance: 0.1 N*m/rad, distribution: normal}}
  methods: [analytic]
"""
    )
    moments = mechdesign.reliability(mechdesign.load(text=text)).tables["moments"]
    columns = {column.name: np.asarray(column.values) for column in moments.columns}
    assert columns["nominal"] == pytest.approx(2 * np.deg2rad(450), rel=1e-12)
    assert columns["sigma"][0] == pytest.approx(0.1 / 3 * np.deg2rad(450), rel=1e-6)
