"""Legs from links and joints, checked with beam elements and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.beam_model import Frame
from helpers.stiffness import (
    ARM,
    AXIAL,
    BENDING,
    BENT,
    FIVE_BAR,
    METRES,
    SLIDER,
    SLOTTED,
    ask_stiffness,
    matrix,
)
from helpers.studies import study_of

import mechdesign


def test_two_link_legs_on_a_platform() -> None:
    """3-RRR on the reference platform: driven base joints, elastic links."""
    text = (
        METRES
        + """
mechanism:
  links:
    ground: {A1: [-0.6, 0], A2: [0.6, 0], A3: [0.3, -0.2]}
    crank_1: [A1, E1]
    rod_1: [E1, B1]
    crank_2: [A2, E2]
    rod_2: [E2, B2]
    crank_3: [A3, E3]
    rod_3: [E3, B3]
    platform: {P: [0, 0], B1: [-0.2, 0], B2: [0.2, 0], B3: [0.25, 0.15]}
  drives: [crank_1, crank_2, crank_3]
  sketch: {P: [0, 1], B1: [-0.2, 1], B2: [0.2, 1], B3: [0.25, 1.15], E1: [-0.7, 0.6], E2: [0.55, 0.5], E3: [0.6, 0.5]}
stiffness:
  link: platform
  at: P
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {crank_1: beam, crank_2: beam, crank_3: beam, rod_1: beam, rod_2: beam, rod_3: beam}
  actuators: {crank_1: 1e5, crank_2: 1e5, crank_3: 1e5}
  poses: [{P.x: 0, P.y: 1, platform.angle: 0}]
"""
    )
    result = ask_stiffness(text)
    expected = [2.2547715216e-5, -4.6569382262e-6, 8.8784676655e-5, 4.7862244456e-6, -3.2501037110e-5, 4.2804203758e-4]
    assert matrix(result, "C")[np.triu_indices(3)] == pytest.approx(expected, rel=1e-10)
    assert result.tables["springs"]["leg"].tolist() == ["crank_1+rod_1", "crank_2+rod_2", "crank_3+rod_3"]


def test_serial_arm_is_one_leg_without_springs() -> None:
    result = ask_stiffness(ARM)
    frame = Frame()
    shoulder, elbow, tip = (
        0j,
        0.5 * np.exp(1j * np.pi / 6),
        0.5 * np.exp(1j * np.pi / 6) + 0.4 * np.exp(1j * 8 * np.pi / 18),
    )
    root, end, start, point, wall = (frame.node(p) for p in (shoulder, elbow, elbow, tip, shoulder))
    frame.ground(wall, 0, 1, 2)
    frame.hinge(root, wall)
    frame.turning_spring(root, wall, 1e4)
    frame.beam(root, end, AXIAL, BENDING)
    frame.hinge(end, start)
    frame.turning_spring(end, start, 5e3)
    frame.beam(start, point, AXIAL, BENDING)
    assert matrix(result, "C") == pytest.approx(frame.compliance(point), rel=1e-6)
    assert len(result.tables["springs"]) == 0
    assert any("no equivalent springs" in warning for warning in map(str, result.warnings))


def test_slider_is_held_across_its_guide_rigidly() -> None:
    """Along the guide it gives with the crank's motor and the links; it neither turns nor leaves the guide."""
    result = ask_stiffness(SLIDER)
    compliance = matrix(result, "C")
    assert compliance[1:] == pytest.approx(np.zeros((2, 3)), abs=1e-20)
    crank, rod_end = 0.3 * np.exp(1j * np.pi / 3), 0.15 + np.sqrt(0.64 - 0.0675)
    frame = Frame()
    wall, root, pin, start, end = (frame.node(p) for p in (0, 0, crank, crank, complex(rod_end)))
    frame.ground(wall, 0, 1, 2)
    frame.hinge(wall, root)
    frame.turning_spring(wall, root, 1000)
    frame.beam(root, pin, AXIAL, BENDING)
    frame.hinge(pin, start)
    frame.beam(start, end, AXIAL, BENDING)
    frame.ground(end, 1)
    assert compliance[0, 0] == pytest.approx(frame.compliance(end)[0, 0], rel=1e-6)
    table = result.tables["stiffness"]
    assert np.isnan(table["K11"][0])
    assert np.isinf(table["k_y"][0])
    assert table["k_x"][0] == pytest.approx(1 / compliance[0, 0])
    assert table["rank"][0] == 3


def test_dangling_links_carry_nothing() -> None:
    text = FIVE_BAR.replace("    b2: [E2, P, 0.40]\n", "    b2: [E2, P, 0.40]\n    tool: [P, T, 0.1]\n")
    text = text.replace("drives: [a1, a2]", "drives: [a1, a2, tool]").replace(
        "P: [0.05, 0.45]}", "P: [0.05, 0.45], T: [0.1, 0.5]}"
    )
    text = text.replace("poses: [{P.x: 0.05, P.y: 0.45}]", "poses: [{P.x: 0.05, P.y: 0.45, tool: 40}]")
    assert matrix(ask_stiffness(text), "K") == pytest.approx(matrix(ask_stiffness(FIVE_BAR), "K"), rel=1e-9)


def test_link_with_more_points_is_beams_along_them() -> None:
    study = study_of(BENT)
    pose = study.mechanism.solve({"bracket": 2})
    place = {name: complex(pose[f"{name}.x"], pose[f"{name}.y"]) for name in study.mechanism.points}
    frame = Frame()
    centre = frame.node(place["T"])
    corners = {}
    for name in "AB":
        corners[name] = frame.node(place[name])
        frame.rigid(centre, corners[name])
    wall, root, middle, end = (frame.node(p) for p in (place["O"], place["O"], place["M"], place["A"]))
    frame.ground(wall, 0, 1, 2)
    frame.hinge(wall, root)
    frame.turning_spring(wall, root, 1e4)
    frame.beam(root, middle, AXIAL, BENDING)
    frame.beam(middle, end, AXIAL, BENDING)
    frame.hinge(end, corners["A"])
    foot, top = frame.node(place["Q"]), frame.node(place["B"])
    frame.ground(foot, 0, 1)
    frame.beam(foot, top, AXIAL, BENDING)
    frame.hinge(top, corners["B"])
    result = mechdesign.stiffness(study)
    assert matrix(result, "C") == pytest.approx(frame.compliance(centre), rel=1e-6)


def test_points_on_a_binary_link_lie_along_it() -> None:
    text = FIVE_BAR.replace(
        "a1: [O1, E1, 0.25]", "a1: {from: O1, to: E1, length: 0.25, points: {M: [0.1, 0], N: [0.1, 0.05]}}"
    )
    text += "  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}\n  elastic: {a1: beam}\n"
    plain = FIVE_BAR + "  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}\n  elastic: {a1: beam}\n"
    assert matrix(ask_stiffness(text), "K") == pytest.approx(matrix(ask_stiffness(plain), "K"), rel=1e-9)


def test_shear_adds_to_bending_only() -> None:
    plain = ask_stiffness(SLIDER)
    soft = ask_stiffness(
        SLIDER, "stiffness.sections.beam={E: 200 GPa, G: 80 GPa, width: 0.02, height: 0.04, shear: true}"
    )
    crank_bends = matrix(soft, "C")[0, 0] - matrix(plain, "C")[0, 0]
    # The crank (0.3 m) carries the rod's force F across itself: F L/(5/6 G A), seen along the guide through the rod.
    rod_end = 0.15 + np.sqrt(0.64 - 0.0675)
    rod = (rod_end - 0.3 * np.exp(1j * np.pi / 3)) / 0.8
    across = (rod.conjugate() * 1j * np.exp(1j * np.pi / 3)).real / rod.real
    assert crank_bends == pytest.approx(0.3 / (5 / 6 * 80e9 * 8e-4) * across**2, rel=1e-6)


def test_section_by_area_and_inertia_is_the_same_section() -> None:
    other = ask_stiffness(
        SLIDER, f"stiffness.sections.beam={{E: 200 GPa, area: 8e-4, inertia: {0.02 * 0.04**3 / 12!r}}}"
    )
    assert matrix(other, "C") == pytest.approx(matrix(ask_stiffness(SLIDER), "C"), rel=1e-12)


def test_pin_in_a_slot_of_a_swinging_lever_carries_nothing() -> None:
    """The lever has three free joints (pivot, slide, pin): only the motor holds the crank, and its pivot is rigid."""
    result = ask_stiffness(SLOTTED)
    arm = 0.2j * np.exp(1j * np.radians(70))
    expected = np.outer([arm.real, arm.imag, 1], [arm.real, arm.imag, 1]) / 500
    assert matrix(result, "C") == pytest.approx(expected, rel=1e-9)


def test_elbow_at_full_stretch_has_one_more_wrench() -> None:
    """With a free stretched elbow the strut carries its line again, though counting says it carries nothing."""
    text = (
        METRES
        + """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 0.5]}
    a: [O, A, 0.5]
    b: [A, B, 0.5]
    block: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, block]}}
  drives: {s: {slide: guide}}
  sketch: {A: [0.45, 0.2], B: [0.95, 0]}
stiffness:
  link: block
  at: B
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {a: beam, b: beam}
  actuators: {s: 1e5}
  poses: [{s: 0.9}, {s: 1.0}]
"""
    )
    result = ask_stiffness(text)
    assert matrix(result, "C", 0)[0, 0] == pytest.approx(1e-5)
    assert matrix(result, "C", 1)[0, 0] == pytest.approx(1 / (1e5 + AXIAL / 1.0), rel=1e-6)
    assert result.tables["springs"]["leg"].tolist().count("a+b") == 1
