"""Deflections and joint forces under loads anywhere on a mechanism, and under what acts on it in motion."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import study_of
from numpy.testing import assert_allclose

import mechdesign

G = 9.81
LENGTH, AREA, INERTIA, E, DENSITY = 0.4, 0.02 * 0.01, 0.02 * 0.01**3 / 12, 200e9, 7850.0
BAR = "{E: 200 GPa, width: 0.02, height: 0.01, density: 7850}"

CRANK = f"""
units: {{length: m}}
mechanism:
  links:
    ground: {{O: [0, 0], S: [0.4, 0.3]}}
    crank: {{from: O, to: A, length: 0.4, points: {{P: [0.3, 0.05]}}}}
  drives: {{theta: {{angle: crank}}}}
stiffness:
  at: A
  link: crank
  sections: {{bar: {BAR}}}
  elastic: {{crank: bar}}
"""

PRESS = """
units: {length: m}
mechanism:
  links:
    ground: {O2: [0.136, 0.27], O4: [0, 0]}
    crank: {from: O2, to: A, length: 0.05, mass: 0.4}
    rod: {from: A, to: B, length: 0.14, mass: 1.1, center: [0.05, 0.01], inertia: 0.002}
    lower: {from: O4, to: B, length: 0.27, mass: 2}
    upper: {from: B, to: S, length: 0.44, mass: 3, points: {P: [0.2, 0.03]}}
    ram: {points: {S: [0, 0]}, mass: 5}
  joints: {guide: {prismatic: [ground, ram], through: O4, direction: 90, point: S}}
  springs: {lift: {between: [O4, S], stiffness: 2000, free_length: 0.6}}
  drives: [crank]
  sketch: {A: [0.186, 0.27], B: [0.048, 0.266], S: [0, 0.704]}
"""
ELASTIC = """
stiffness:
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {crank: beam, rod: beam, lower: beam, upper: beam}
  actuators: {crank: 2000}
  bearings: {B: 1e8}
  poses: [{crank: 40}, {crank: 75}]
"""


def deflections(text, *columns):
    table = mechdesign.stiffness(study_of(text)).tables["deflections"]
    return [table[column] for column in columns or ("dx", "dy", "dphi")]


def test_a_turning_cantilever_bends_under_its_own_inertia_and_weight():
    angles = np.radians([0, 30, 90, 200])
    omega, alpha, q = 20.0, 150.0, DENSITY * AREA
    motion = f"""
  dynamics: true
dynamics:
  gravity: [0, -9.81]
  poses: [{{theta: 0}}, {{theta: 30}}, {{theta: 90}}, {{theta: 200}}]
  rates: {{theta: {omega} rad/s}}
  accelerations: {{theta: {alpha} rad/s^2}}
"""
    dx, dy, dphi = deflections(CRANK + motion)
    # Along the crank q omega^2 s outward; across it -q alpha s, a triangle (11/120), and the weight, even (1/8).
    stretch = (q * omega**2 * LENGTH**3 / 3 - q * G * np.sin(angles) * LENGTH**2 / 2) / (E * AREA)
    sag = -(q * G * np.cos(angles) * LENGTH**4 / 8 + 11 * q * alpha * LENGTH**5 / 120) / (E * INERTIA)
    turn = -(q * G * np.cos(angles) * LENGTH**3 / 6 + q * alpha * LENGTH**4 / 8) / (E * INERTIA)
    moved = (stretch + 1j * sag) * np.exp(1j * angles)
    assert_allclose(dx, moved.real, rtol=1e-11, atol=1e-18)
    assert_allclose(dy, moved.imag, rtol=1e-11, atol=1e-18)
    assert_allclose(dphi, turn, rtol=1e-11)


def test_a_mass_on_a_cantilever_hangs_at_its_foot():
    at = 0.15
    text = CRANK.replace("length: 0.4, points", f"length: 0.4, mass: 3, center: [{at}, 0.02], points")
    text += "  dynamics: true\n  poses: [{theta: 0}]\ndynamics: {gravity: [0, -9.81]}"
    (sag,) = deflections(text, "dy")
    assert_allclose(sag, -3 * G * at**2 * (3 * LENGTH - at) / (6 * E * INERTIA), rtol=1e-12)


def test_a_spring_at_the_tip_shares_the_weight_with_the_beam():
    stiffness, q = 5e3, DENSITY * AREA
    text = CRANK.replace(
        "  drives:", f"  springs: {{prop: {{between: [S, A], stiffness: {stiffness}, free_length: 0.3}}}}\n  drives:"
    )
    (sag,) = deflections(text + "  dynamics: true\n  poses: [{theta: 0}]\ndynamics: {gravity: [0, -9.81]}", "dy")
    free = -q * G * LENGTH**4 / (8 * E * INERTIA)
    assert_allclose(sag, free / (1 + stiffness * LENGTH**3 / (3 * E * INERTIA)), rtol=1e-10)


@pytest.mark.parametrize("asked", ["S", "P", "A"])
def test_rigid_links_bear_what_dynamics_says(asked):
    text = (
        PRESS
        + f"""
stiffness: {{at: {asked}, dynamics: true}}
dynamics:
  gravity: [0, -9.81]
  sweep: {{crank: {{from: 0, to: 90, step: 30}}}}
  rates: {{crank: 30 rad/s}}
  loads: [{{at: S, force: [0, -1000 - 50*S.y_velocity]}}, {{link: lower, moment: 3*sin(crank)}}]
"""
    )
    study = study_of(text)
    ours, theirs = mechdesign.stiffness(study).tables["forces"], mechdesign.dynamics(study).tables["joint_forces"]
    compared, largest = 0, theirs["magnitude"].max()
    for joint in ("O2", "O4", "A", "guide"):
        # Nothing acts on these pins, so that each has one force.
        some, others = (table["joint"] == joint for table in (ours, theirs))
        if some.sum() != others.sum():
            continue
        sign = 1 if ours["on"][some][0] == theirs["on"][others][0] else -1
        for axis in ("fx", "fy"):
            assert_allclose(sign * ours[axis][some], theirs[axis][others], rtol=0, atol=1e-12 * largest)
        compared += 1
    assert compared >= 3


def asked_at(point, loads):
    return PRESS + ELASTIC.replace("stiffness:", f"stiffness:\n  at: {point}\n  loads: {loads}")


@pytest.mark.parametrize("loaded", ["A", "B", "P", "upper.P"])
def test_a_load_elsewhere_moves_a_point_as_seen_from_there(loaded):
    there = mechdesign.stiffness(study_of(asked_at(loaded, "[[300, -500]]"))).tables
    here = mechdesign.stiffness(study_of(asked_at("S", f"[{{at: {loaded}, force: [300, -500]}}]"))).tables
    rows = (there["displacements"]["point"] == "S") & (there["displacements"]["link"] == "ram")
    for axis in ("dx", "dy"):
        assert_allclose(here["deflections"][axis], there["displacements"][axis][rows], rtol=1e-9, atol=1e-15)
    ground = [table["forces"]["joint"] == "O4" for table in (there, here)]
    assert_allclose(here["forces"]["fx"][ground[1]], there["forces"]["fx"][ground[0]], rtol=1e-9)
    assert here["deflections"]["load"].tolist() == [1, 1]


def test_a_force_between_two_points_is_two_forces():
    shorter, one, other = (
        np.array(deflections(asked_at("S", f"[{load}]"), "dx", "dy"))
        for load in ("{between: [A, P], force: 40}", "{at: A, force: [1, 0]}, {at: A, force: [0, 1]}",
                     "{at: P, force: [1, 0]}, {at: P, force: [0, 1]}")
    )  # fmt: skip
    study = study_of(PRESS)
    for k, angle in enumerate((40, 75)):
        solved = study.mechanism.solve({"crank": angle})
        way = np.array([float(solved[f"P.{axis}"]) - float(solved[f"A.{axis}"]) for axis in "xy"])
        pull = 40 * way / np.hypot(*way)
        expected = (one - other)[:, 2 * k : 2 * k + 2] @ pull
        assert_allclose(shorter[:, k], expected, rtol=1e-9, atol=1e-16)


def test_a_moment_on_a_link_that_bends_acts_at_its_first_point():
    (turn,) = deflections(CRANK + "  loads: [{link: crank, moment: 7}]\n  poses: [{theta: 0}]", "dphi")
    assert turn == pytest.approx(7 * LENGTH / (E * INERTIA))  # its own link: at the asked point
    text = CRANK.replace("at: A\n  link: crank", "at: A") + "  actuators: {theta: 500}\n"
    (sag,) = deflections(text + "  loads: [{link: crank, moment: 7}]\n  poses: [{theta: 0}]", "dy")
    assert_allclose(sag, 7 / 500 * LENGTH, rtol=1e-12)


def test_loads_follow_the_pose_and_turn_with_a_link():
    poses = "  poses: [{theta: 0}, {theta: 50}]\n"
    following = (
        CRANK
        + poses
        + '  loads: [{at: A, force: [-30*cos(theta), "-30*sin(theta)"]}, {at: A, force: [-30, 0], in: crank}]'
    )
    along = np.array(deflections(following)).reshape(3, 2, 2)
    expected = -30 * LENGTH / (E * AREA) * np.exp(1j * np.radians([0, 50]))
    for case in range(2):
        assert_allclose(along[0, :, case] + 1j * along[1, :, case], expected, atol=1e-16)


@pytest.mark.parametrize(("change", "words"), [
    ("loads: [{at: A, force: [0, theta_velocity]}]", "needs velocities"),
    ("loads: [{at: Q, force: [0, 1]}]", "Q"),
    ("loads: [[1, 2]]", "[fx, fy, mz]"),
    ("dynamics: true", "dynamics"),
    ("dynamics: true\n  poses: [{theta: 0}]\ndynamics: {motion: {theta: [{from: 0, to: 90, time: 1}]}}", "leave out"),
])  # fmt: skip
def test_what_cannot_be_asked_is_said(change, words):
    with pytest.raises(mechdesign.StudyError, match=words.replace("[", r"\[")):
        study_of(CRANK + f"  {change}\n")


@pytest.mark.slow
def test_pictures_name_loads_elsewhere():
    study = study_of(asked_at("S", "[{at: P, force: [300, 0]}, {link: rod, moment: 5*sin(crank)}]"))
    figure = figure_of(study, mechdesign.stiffness(study), "deflections")
    titles = [axes.get_title(loc=side) for axes in figure.axes for side in ("left", "center")]
    for words in ("fx = 300 N at P", "mz = 5*sin(crank) at rod"):
        assert any(words in title for title in titles), titles
