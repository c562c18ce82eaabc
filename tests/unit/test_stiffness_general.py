"""Stiffness of mechanisms that do not stand on serial legs, against beam elements and against serial legs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest
from helpers.beam_model import Frame
from helpers.stiffness import ARM, AXIAL, BENDING, BENT, METRES, ask_stiffness, matrix
from helpers.studies import study_of
from numpy.testing import assert_allclose

PRESS = (
    METRES
    + """
mechanism:
  links:
    ground: {O2: [0.136, 0.27], O4: [0, 0]}
    crank: [O2, A, 0.05]
    rod: [A, B, 0.14]
    lower: [O4, B, 0.27]
    upper: [B, S, 0.44]
    ram: {S: [0, 0]}
  joints: {guide: {prismatic: [ground, ram], through: O4, direction: 90, point: S}}
  drives: [crank]
  sketch: {A: [0.186, 0.27], B: [0.048, 0.266], S: [0, 0.704]}
stiffness:
  link: ram
  at: S
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {crank: beam, rod: beam, lower: beam, upper: beam}
  actuators: {crank: 2000}
  poses: [{crank: 40}]
  loads: [[0, -1000, 0]]
"""
)


def points(text: str, names: str, **pose: float) -> dict[str, complex]:
    solved = study_of(text).mechanism.solve(pose)
    return {name: complex(float(solved[f"{name}.x"]), float(solved[f"{name}.y"])) for name in names.split()}


def press(place: Mapping[str, complex], motor: float) -> np.ndarray:
    frame = Frame()
    base = frame.node(place["O2"])
    frame.ground(base, 0, 1, 2)
    ends = {}
    for link, (tail, head) in {
        "crank": ("O2", "A"), "rod": ("A", "B"), "lower": ("O4", "B"), "upper": ("B", "S")
    }.items():  # fmt: skip
        ends[link] = frame.node(place[tail]), frame.node(place[head])
        frame.beam(*ends[link], AXIAL, BENDING)
    frame.hinge(base, ends["crank"][0])
    frame.turning_spring(base, ends["crank"][0], motor)
    frame.hinge(ends["crank"][1], ends["rod"][0])
    frame.hinge(ends["rod"][1], ends["lower"][1])
    frame.hinge(ends["rod"][1], ends["upper"][0])
    frame.ground(ends["lower"][0], 0, 1)
    ram = frame.node(place["S"])
    frame.hinge(ram, ends["upper"][1])
    frame.ground(ram, 0, 2)
    return frame.compliance(ram)


def test_press_under_its_ram() -> None:
    result = ask_stiffness(PRESS)
    assert result.tables["stiffness"]["method"].tolist() == ["force method"]
    expected = press({**points(PRESS, "A B S", crank=40), "O2": 0.136 + 0.27j, "O4": 0j}, 2000)
    found = matrix(result, "C")
    assert found[1, 1] == pytest.approx(expected[1, 1], rel=1e-9)
    # The guide is rigid across and in turning, exactly.
    found[1, 1] = 0.0
    assert not found.any()
    assert np.isnan(matrix(result, "K")).all()
    assert "springs" not in result.tables


def test_forces_in_the_joints_of_the_press_balance() -> None:
    result = ask_stiffness(PRESS)
    table = result.tables["forces"]
    place = {**points(PRESS, "A B S", crank=40), "O2": 0.136 + 0.27j, "O4": 0j}
    at = {"guide": "S"}
    on_ground = table["on"] == "ground"
    force = np.array([table["fx"][on_ground].sum(), table["fy"][on_ground].sum()])
    assert_allclose(force, [0, -1000], atol=1e-9)
    arms = [place[at.get(name, name)] for name in table["joint"][on_ground]]
    moment = sum(
        arm.real * fy - arm.imag * fx + mz
        for arm, fx, fy, mz in zip(
            arms, table["fx"][on_ground], table["fy"][on_ground], table["mz"][on_ground], strict=True
        )
    )
    assert moment == pytest.approx(place["S"].real * -1000, abs=1e-9)
    # Virtual work: the motor's moment against the load, by the velocity of the ram.
    study = study_of(PRESS)
    step = 1e-4
    ahead, back = (float(study.mechanism.solve({"crank": 40 + way * step})["S.y"]) for way in (1, -1))
    ratio = (ahead - back) / (2 * np.radians(step))
    motor = table["mz"][(table["joint"] == "O2")][0]
    assert abs(motor) == pytest.approx(abs(1000 * ratio), rel=1e-6)
    # Pins bear no moment.
    assert np.abs(table["mz"][~np.isin(table["joint"], ["O2", "guide"])]).max() < 1e-9


def test_displacements_of_all_points_are_those_of_the_deflected_mechanism() -> None:
    result = ask_stiffness(PRESS)
    table = result.tables["displacements"]
    rows = {(link, point): k for k, (link, point) in enumerate(zip(table["link"], table["point"], strict=True))}
    deflected = result.tables["deflections"]
    ram = rows["ram", "S"]
    assert table["dy"][ram] == pytest.approx(deflected["dy"][0], rel=1e-12)
    # At a pin all links go along.
    for one, other, point in (
        ("crank", "rod", "A"),
        ("rod", "lower", "B"),
        ("rod", "upper", "B"),
        ("upper", "ram", "S"),
    ):
        for column in ("dx", "dy"):
            assert table[column][rows[one, point]] == pytest.approx(
                table[column][rows[other, point]], rel=1e-9, abs=1e-15
            )
    # Base pins stay.
    for key in (("crank", "O2"), ("lower", "O4")):
        assert abs(table["dx"][rows[key]]) + abs(table["dy"][rows[key]]) < 1e-18
    # With the links rigid only the motor gives: the ram goes as far as its velocity ratio says.
    rigid = ask_stiffness(PRESS, "stiffness.elastic={}").tables
    ratio = rigid["forces"]["mz"][rigid["forces"]["joint"] == "O2"][0] / -1000
    assert rigid["deflections"]["dy"][0] == pytest.approx(-1000 * ratio**2 / 2000, rel=1e-9)


def test_motor_that_holds_a_link_from_the_ground_across_a_joint() -> None:
    """Both motors on the base, the second by a belt: K = J^-T k J^-1 with absolute angles."""
    text = ARM.replace("angle: lower, from: upper", "angle: lower").replace(
        "elastic: {upper: beam, lower: beam}", "elastic: {}"
    )
    result = ask_stiffness(text)
    assert result.tables["stiffness"]["method"].tolist() == ["force method"]
    one, other = np.exp(1j * np.radians([30, 50]))
    jacobian = np.array([[-0.5 * one.imag, -0.4 * other.imag], [0.5 * one.real, 0.4 * other.real], [0, 1]])
    expected = jacobian @ np.diag([1e-4, 1 / 5e3]) @ jacobian.T
    assert_allclose(matrix(result, "C"), expected, rtol=1e-12, atol=1e-20)


def test_a_link_in_the_middle_of_the_mechanism() -> None:
    """The driven bracket of a plate on a prop: the asked link is a part of a loop."""
    text = BENT.replace("link: plate\n  at: T", "link: bracket\n  at: M")
    result = ask_stiffness(text)
    place = points(text, "M A B", bracket=2) | {"O": 0j, "Q": 1 + 0j}
    frame = Frame()
    base = frame.node(place["O"])
    frame.ground(base, 0, 1, 2)
    nodes = [frame.node(place[name]) for name in "OMA"]
    for tail, head in pairwise(nodes):
        frame.beam(tail, head, AXIAL, BENDING)
    frame.hinge(base, nodes[0])
    frame.turning_spring(base, nodes[0], 1e4)
    plate_a, plate_b = frame.node(place["A"]), frame.node(place["B"])
    frame.rigid(plate_a, plate_b)
    frame.hinge(nodes[2], plate_a)
    foot, top = frame.node(place["Q"]), frame.node(place["B"])
    frame.beam(foot, top, AXIAL, BENDING)
    frame.ground(foot, 0, 1)
    frame.hinge(top, plate_b)
    assert_allclose(matrix(result, "C"), frame.compliance(nodes[1]), rtol=1e-8, atol=1e-18)
