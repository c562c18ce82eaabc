"""The stiffness question on mechanisms of many structures: legs from links and joints, and what the tables say."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.beam_model import Frame
from helpers.studies import study_of

import mechdesign
from mechdesign.analyses.legs import Beam, Guide, Hinge, Leg
from mechdesign.analyses.stiffness import ask
from mechdesign.errors import AssemblyError, StudyError
from mechdesign.results import Result

METRES = "units: {length: m, angle: deg, time: s, force: N}\n"
FIVE_BAR = (
    METRES
    + """
mechanism:
  links:
    ground: {O1: [-0.15, 0], O2: [0.15, 0]}
    a1: [O1, E1, 0.25]
    b1: [E1, P, 0.40]
    a2: [O2, E2, 0.25]
    b2: [E2, P, 0.40]
  drives: [a1, a2]
  sketch: {E1: [-0.3, 0.2], E2: [0.3, 0.2], P: [0.05, 0.45]}
stiffness:
  at: P
  actuators: {a1: 1000, a2: 1000}
  poses: [{P.x: 0.05, P.y: 0.45}]
"""
)
ARM = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, E, 0.5]
    lower: [E, P, 0.4]
  drives: {shoulder: {angle: upper}, elbow: {angle: lower, from: upper}}
  sketch: {E: [0.4, 0.3], P: [0.8, 0.2]}
stiffness:
  link: lower
  at: P
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {upper: beam, lower: beam}
  actuators: {shoulder: 1e4, elbow: 5e3}
  poses: [{shoulder: 30, elbow: 50}]
"""
)
SLIDER = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 0.3]
    rod: [A, B, 0.8]
    slider: {B: [0, 0], T: [0.1, 0.05]}
  joints: {guide: {prismatic: [ground, slider], point: B}}
  drives: [crank]
  sketch: {A: [0.2, 0.25], B: [0.95, 0]}
stiffness:
  link: slider
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {crank: beam, rod: beam}
  actuators: {crank: 1000}
  poses: [{crank: 60}]
"""
)
AXIAL, BENDING = 200e9 * 8e-4, 200e9 * 0.02 * 0.04**3 / 12


def ask_stiffness(text: str, *overrides: str) -> Result:
    return mechdesign.stiffness(study_of(text, *overrides))


def matrix(result: Result, letter: str, row: int = 0) -> np.ndarray:
    table = result.tables["stiffness" if letter == "K" else "compliance"]
    size = 3 if f"{letter}33" in table else 2
    return np.array([[table[f"{letter}{min(i, j)}{max(i, j)}"][row] for j in range(1, size + 1)]
                     for i in range(1, size + 1)])  # fmt: skip


def legs_of(text: str, *overrides: str) -> tuple[Leg, ...]:
    return ask(study_of(text, *overrides)).legs


def test_five_bar_with_rigid_links_on_its_motors() -> None:
    result = ask_stiffness(FIVE_BAR)
    expected = np.array([[18769.834, -361.013], [-361.013, 13431.882]])
    assert matrix(result, "K") == pytest.approx(expected, abs=5e-4)
    assert matrix(result, "K") @ matrix(result, "C") == pytest.approx(np.eye(2), abs=1e-12)
    table = result.tables["stiffness"]
    assert "k_phi" not in table
    assert "K33" not in table
    assert table["k_min"][0] <= min(table["k_x"][0], table["k_y"][0])
    assert table["k_max"][0] >= max(table["k_x"][0], table["k_y"][0])


def test_the_same_answer_in_millimetres() -> None:
    """K in N/m and N/mm; the motors in N m/rad and N mm/rad."""
    metres = ask_stiffness(FIVE_BAR)
    text = FIVE_BAR.replace("length: m,", "length: mm,").replace("actuators: {a1: 1000, a2: 1000}",
                            "actuators: {a1: 1000 N*m/rad, a2: 1e6}")  # fmt: skip
    for metre, millimetre in (("0.15", "150"), ("0.25", "250"), ("0.40", "400"), ("0.3,", "300,"), ("0.2]", "200]"),
                              ("0.05", "50"), ("0.45", "450")):  # fmt: skip
        text = text.replace(metre, millimetre)
    assert matrix(ask_stiffness(text), "K") * 1000 == pytest.approx(matrix(metres, "K"), rel=1e-10)


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
    assert any("no equivalent springs" in warning for warning in result.warnings)


def test_pin_of_one_link_is_asked_with_the_link_free_to_turn() -> None:
    whole = ask_stiffness(ARM)
    part = ask_stiffness(ARM.replace("  link: lower\n", ""))
    assert matrix(part, "C") == pytest.approx(matrix(whole, "C")[:2, :2], rel=1e-12)
    assert matrix(part, "K") == pytest.approx(np.linalg.inv(matrix(whole, "C")[:2, :2]), rel=1e-9)


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


def test_leg_elements_in_order_from_the_base() -> None:
    (crank, guide) = legs_of(SLIDER)
    assert crank.name == "crank+rod"
    assert crank.elements == (
        Hinge("O", "crank"), Beam("O", "A", "beam"), Hinge("A"), Beam("A", "B", "beam"), Hinge("B"),
    )  # fmt: skip
    assert [type(element) for element in guide.elements] == [Guide]


def test_rigid_drives_are_no_elements() -> None:
    crank, _ = legs_of(SLIDER, "stiffness.actuators={}")
    assert crank.elements[0] == Beam("O", "A", "beam")


def test_dangling_links_carry_nothing() -> None:
    text = FIVE_BAR.replace("    b2: [E2, P, 0.40]\n", "    b2: [E2, P, 0.40]\n    tool: [P, T, 0.1]\n")
    text = text.replace("drives: [a1, a2]", "drives: [a1, a2, tool]").replace(
        "P: [0.05, 0.45]}", "P: [0.05, 0.45], T: [0.1, 0.5]}"
    )
    text = text.replace("poses: [{P.x: 0.05, P.y: 0.45}]", "poses: [{P.x: 0.05, P.y: 0.45, tool: 40}]")
    assert matrix(ask_stiffness(text), "K") == pytest.approx(matrix(ask_stiffness(FIVE_BAR), "K"), rel=1e-9)


BENT = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], Q: [1, 0]}
    bracket: {O: [0, 0], M: [0.1, 0.4], A: [0.5, 0.5], X: [0.7, 0.9]}
    plate: {A: [0, 0], B: [0.4, 0], T: [0.2, 0.2]}
    prop: [Q, B, 0.45]
  drives: [bracket]
  sketch: {O: [0, 0], A: [0.5, 0.5], M: [0.1, 0.4], B: [0.9, 0.45]}
stiffness:
  link: plate
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {bracket: beam, prop: beam}
  actuators: {bracket: 1e4}
  poses: [{bracket: 2}]
"""
)


def test_link_with_more_points_is_beams_along_them() -> None:
    bracket, prop = legs_of(BENT)
    assert [e for e in bracket.elements if isinstance(e, Beam)] == [Beam("O", "M", "beam"), Beam("M", "A", "beam")]
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
    beams = [e for e in legs_of(text)[0].elements if isinstance(e, Beam)]
    assert beams == [Beam("O1", "M", "beam"), Beam("M", "E1", "beam")]
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


SLOTTED = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], Q: [0.2, -0.5]}
    crank: [O, A, 0.2]
    lever: {from: Q, to: T, length: 1}
  joints: {slit: {slot: lever, through: Q, point: A}}
  drives: [crank]
  sketch: {A: [0.1, 0.17], T: [0.1, 0.5]}
stiffness:
  link: crank
  at: A
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {lever: beam}
  actuators: {crank: 500}
  poses: [{crank: 70}]
"""
)


def test_pin_in_a_slot_of_a_swinging_lever_carries_nothing() -> None:
    """The lever has three free joints (pivot, slide, pin): only the motor holds the crank, and its pivot is rigid."""
    result = ask_stiffness(SLOTTED)
    arm = 0.2j * np.exp(1j * np.radians(70))
    expected = np.outer([arm.real, arm.imag, 1], [arm.real, arm.imag, 1]) / 500
    assert matrix(result, "C") == pytest.approx(expected, rel=1e-9)
    assert len(legs_of(SLOTTED)) == 2
    lever = next(leg for leg in legs_of(SLOTTED) if leg.name == "lever")
    assert [type(e) for e in lever.elements] == [Hinge, Beam, Guide, Hinge]


def test_under_constrained_pose_reports_its_free_twist() -> None:
    """A platform whose three struts meet: it turns about their common point."""
    text = (
        METRES
        + """
mechanism:
  links:
    ground: {A1: [-1, 0], A2: [1, 0], A3: [0, -1]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.5, -0.5], B2: [0.5, -0.5], B3: [0, -0.7]}
  drives: [leg_1, leg_2, leg_3]
  sketch: {P: [0.1, 1], B1: [-0.4, 0.5], B2: [0.6, 0.5], B3: [0.1, 0.3]}
stiffness:
  link: platform
  at: P
  actuators: {leg_1: 1e4, leg_2: 1e4, leg_3: 1e4}
  poses: [{P.x: 0, P.y: 1, platform.angle: 0}, {P.x: 0.1, P.y: 1, platform.angle: 0}]
"""
    )
    result = ask_stiffness(text)
    table = result.tables["stiffness"]
    assert table["rank"].tolist() == [2, 3]
    assert [table[f"free_{axis}"][0] for axis in ("x", "y", "phi")] == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.isnan([table[f"free_{axis}"][1] for axis in ("x", "y", "phi")]).all()
    assert np.isfinite(matrix(result, "K")).all()
    assert np.isnan(matrix(result, "C")).all()
    assert np.isfinite(matrix(result, "C", 1)).all()
    assert any("under-constrained" in warning for warning in result.warnings)
    assert table["valid"].all()


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


def test_deflections_are_compliance_times_loads() -> None:
    result = ask_stiffness(ARM, "stiffness.loads=[[10, -20, 3], [0, 5, 0]]")
    table = result.tables["deflections"]
    assert len(table) == 2
    moved = matrix(result, "C") @ [10, -20, 3]
    assert [table[name][0] for name in ("dx", "dy", "dphi")] == pytest.approx(moved)
    assert table["fy"].tolist() == [-20, 5]


def test_listed_pose_that_fails_is_told_after_the_others() -> None:
    result = ask_stiffness(FIVE_BAR, "stiffness.poses=[{P.x: 0.05, P.y: 0.45}, {P.x: 5, P.y: 5}]")
    assert "P.x = 5" in result.failed
    assert result.tables["stiffness"]["valid"].tolist() == [True, False]
    assert np.isnan(result.tables["stiffness"]["K11"][1])
    assert len(result.tables["springs"]) == 2
    with pytest.raises(AssemblyError, match="no pose"):
        ask_stiffness(FIVE_BAR, "stiffness.poses=[{P.x: 5, P.y: 5}]")


def test_sweep_with_unreachable_poses_is_a_table_with_gaps() -> None:
    text = FIVE_BAR.replace("poses: [{P.x: 0.05, P.y: 0.45}]", "sweep: {P.x: 0, P.y: {from: 0.3, to: 0.9, step: 0.1}}")
    result = ask_stiffness(text)
    assert not result.failed
    assert len(result.tables["stiffness"]) == 7
    assert result.counts["invalid"] == np.isnan(result.tables["stiffness"]["k_x"]).sum() > 0


def test_result_does_not_depend_on_jobs_or_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    text = FIVE_BAR.replace(
        "poses: [{P.x: 0.05, P.y: 0.45}]", "sweep: {P.x: {from: -0.1, to: 0.1, number: 40}, P.y: 0.4}"
    )
    whole = ask_stiffness(text).tables["stiffness"]
    monkeypatch.setattr("mechdesign.analyses.stiffness.CHUNK", 7)
    parts = mechdesign.stiffness(study_of(text), jobs=2).tables["stiffness"]
    for name in whole.names:
        assert whole[name].tobytes() == parts[name].tobytes()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ARM.replace("angle: lower, from: upper", "angle: lower"), "drive 'elbow' holds the angle of link 'lower'"),
        (
            BENT.replace("link: plate\n  at: T", "link: bracket\n  at: M"),
            "links bracket, plate, prop|no serial chain",
        ),
        (FIVE_BAR.split("stiffness:")[0], "stiffness: is missing"),
        (FIVE_BAR.replace("at: P", "at: O1"), "does not move"),
    ],
)
def test_what_is_no_set_of_serial_legs_is_told(text: str, said: str) -> None:
    with pytest.raises(StudyError, match=said):
        ask_stiffness(text)
