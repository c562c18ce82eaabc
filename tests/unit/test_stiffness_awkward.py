"""Stiffness where matrices are singular, infinite or badly scaled: each case is answered."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from helpers.frames import posed
from helpers.stiffness import ARM, AXIAL, BENDING, FIVE_BAR, MEETING_STRUTS, METRES, ask_stiffness, matrix
from helpers.studies import study_of
from numpy.testing import assert_allclose

import mechdesign

BEAM = "sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}"


def by_elements(text: str, *overrides: str, row: int = 0) -> np.ndarray:
    return posed(study_of(text, *overrides), row).compliance()


def method(result: mechdesign.Answer) -> str:
    return str(result.tables["stiffness"]["method"][0])


def free(result: mechdesign.Answer, row: int = 0) -> list[float]:
    return [float(result.tables["stiffness"][f"free_{axis}"][row]) for axis in ("x", "y", "phi")]


TRIPOD = (
    MEETING_STRUTS.replace("B3: [0, -0.7]}", "B3: [0, -0.7], FAR: [3000, 4000]}")
    + """
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {leg_1: beam, leg_2: beam, leg_3: beam}
  poses: [{P.x: 0.1, P.y: 1, platform.angle: 0}]
"""
)


def pushed(text: str, rocker: str, ground: str, sketch: str) -> str:
    """The first leg's foot on a rocker that a prop holds: no serial leg any more."""
    links = f"rocker: {rocker}\n    prop: [Q, R]\n    ground: {{{ground}, "
    foot = text.split("ground: {")[1].split("], A2")[0] + "], "
    text = text.replace("ground: {" + foot, links).replace("sketch: {", f"sketch: {{{sketch}, ")
    return text.replace("elastic: {", "elastic: {prop: beam, ")


PUSHED = pushed(
    TRIPOD,
    "{O: [0, 0], A1: [0.4, 0.3], R: [0.1, 0.6]}",
    "O: [-1.4, -0.3], Q: [-1.8, 0.4]",
    "R: [-1.3, 0.3], A1: [-1, 0]",
)


def test_the_examples_are_held_as_meant() -> None:
    assert method(ask_stiffness(TRIPOD)) == "serial legs"
    assert method(ask_stiffness(PUSHED)) == "force method"


@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
def test_what_is_rigid_altogether_has_no_compliance_at_all(text: str) -> None:
    result = ask_stiffness(text, "stiffness.elastic={}", "stiffness.actuators={}")
    table = result.tables["stiffness"]
    assert not matrix(result, "C").any()
    assert np.isnan(matrix(result, "K")).all()
    assert [table[name][0] for name in ("k_x", "k_y", "k_phi", "k_min", "k_max")] == [np.inf] * 5
    assert table["rank"][0] == 3
    assert np.isnan(free(result)).all()


@pytest.mark.slow
@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
def test_a_point_far_away_moves_as_the_body_turns(text: str) -> None:
    """5 km from a platform of a metre: the matrices are carried there, not made there."""
    here, there = ask_stiffness(text), ask_stiffness(text, "stiffness.at=FAR")
    assert there.tables["stiffness"]["rank"][0] == 3
    assert not there.warnings
    transform = np.array([[1, 0, -4000], [0, 1, 3000], [0, 0, 1]])
    assert_allclose(matrix(there, "C"), transform @ matrix(here, "C") @ transform.T, rtol=1e-11)
    back = np.array([[1, 0, 4000], [0, 1, -3000], [0, 0, 1]])
    assert_allclose(matrix(there, "K"), back.T @ matrix(here, "K") @ back, rtol=1e-9)
    loaded = ask_stiffness(text, "stiffness.at=FAR", "stiffness.loads=[[0.001, 0, 0]]").tables["deflections"]
    assert loaded["dphi"][0] == pytest.approx(0.001 * (matrix(here, "C") @ [1, 0, -4000])[2], rel=1e-10)


UPRIGHT = "stiffness.poses=[{P.x: 0, P.y: 1, platform.angle: 0}]"


@pytest.mark.slow
@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
def test_concurrent_legs_leave_a_turn_about_their_common_point(text: str) -> None:
    """At x = 0 the three legs meet at (0, 1). They hold that point three ways in two directions, and K is finite."""
    result = ask_stiffness(text, UPRIGHT)
    assert result.tables["stiffness"]["rank"][0] == 2
    assert any("under-constrained" in warning for warning in map(str, result.warnings))
    assert free(result) == pytest.approx([0, 0, 1], abs=1e-9)
    stiff = matrix(result, "K")
    assert np.isnan(matrix(result, "C")).all()
    assert_allclose(stiff @ [0, 0, 1], 0, atol=1e-9 * np.abs(stiff).max())
    structure = posed(study_of(text, UPRIGHT))
    moved, loose = structure.frame.respond(structure.asked, np.array([[1.0, 0], [0, 1.0], [0, 0]]))
    assert loose.shape[1] == 1
    assert_allclose((stiff @ moved[3 * structure.asked : 3 * structure.asked + 3])[:2], np.eye(2), atol=1e-6)
    # Request elsewhere on the platform, the free twist goes round the same point.
    assert free(ask_stiffness(text, UPRIGHT, "stiffness.at=FAR")) == pytest.approx([-4000, 3000, 1], rel=1e-9)


@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
def test_loads_on_what_is_free_have_no_effect_that_could_be_told(text: str) -> None:
    result = ask_stiffness(text, UPRIGHT, "stiffness.loads=[[1, 2, 3]]")
    for table, columns in (("deflections", ["dx", "dphi"]), ("forces", ["fx", "mz"]), ("displacements", ["dx"])):
        for column in columns:
            values = result.tables[table][column]
            assert len(values)
            assert np.isnan(values).all()


def test_springs_through_one_point_add_up() -> None:
    stiff = matrix(ask_stiffness(TRIPOD, UPRIGHT), "K")
    expected = np.zeros((2, 2))
    for foot, tip in ((-1, -0.5 + 0.5j), (1, 0.5 + 0.5j), (-1j, 0.3j)):
        along, length = (tip - foot) / abs(tip - foot), abs(tip - foot)
        unit = np.array([along.real, along.imag])
        expected += np.outer(unit, unit) / (1e-4 + length / AXIAL)
    assert_allclose(stiff[:2, :2], expected, rtol=1e-9, atol=1e-9 * expected.max())


@pytest.mark.slow
@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
@pytest.mark.parametrize("actuators", ["{}", "{leg_3: 1e4}"])
def test_rigid_legs_that_meet_hold_their_point_rigidly_and_leave_the_turn(text: str, actuators: str) -> None:
    """Three rigid legs hold two directions: over-constrained, rigid, and free to turn at once."""
    result = ask_stiffness(text, UPRIGHT, "stiffness.elastic={}", f"stiffness.actuators={actuators}")
    assert result.tables["stiffness"]["rank"][0] == 2
    assert free(result) == pytest.approx([0, 0, 1], abs=1e-9)
    assert np.isnan(matrix(result, "K")).all()
    assert np.isnan(matrix(result, "C")).all()


IN_LINE = (
    TRIPOD.replace("A1: [-1, 0], A2: [1, 0], A3: [0, -1]", "A1: [0, 0], A2: [0.1, 0], A3: [-0.3, 0]")
    .replace("B1: [-0.5, -0.5], B2: [0.5, -0.5], B3: [0, -0.7]", "B1: [-1, 0], B2: [-0.8, 0], B3: [-0.5, 0]")
    .replace("P: [0.1, 1], B1: [-0.4, 0.5], B2: [0.6, 0.5], B3: [0.1, 0.3]",
             "P: [1.4, 0.3], B1: [0.47894, -0.08942], B2: [0.66315, -0.01154], B3: [0.93947, 0.10529]")
    .replace("P.x: 0.1, P.y: 1", "P.x: 1.5, P.y: 0")
)  # fmt: skip
IN_LINE_PUSHED = pushed(
    IN_LINE, "{O: [0, 0], A1: [0.3, 0.4], R: [0.1, 0.9]}", "O: [-0.3, -0.4], Q: [-1, 0.2]", "R: [-0.2, 0.5], A1: [0, 0]"
)


@pytest.mark.slow
@pytest.mark.parametrize(("text", "how"), [(IN_LINE, "serial legs"), (IN_LINE_PUSHED, "force method")])
def test_legs_in_one_line_leave_two_twists_free(text: str, how: str) -> None:
    result = ask_stiffness(text)
    assert method(result) == how
    assert result.tables["stiffness"]["rank"][0] == 1
    twist, stiff = free(result), matrix(result, "K")
    # Any of them: across the line or a turn about any of its points.
    assert twist[0] == pytest.approx(0, abs=1e-9)
    assert np.abs(twist).max() > 0.1
    assert_allclose(stiff[1:], 0, atol=1e-9 * stiff[0, 0])
    structure = posed(study_of(text))
    moved, _ = structure.frame.respond(structure.asked, np.array([[1.0], [0], [0]]))
    assert stiff[0, 0] * moved[3 * structure.asked, 0] == pytest.approx(1, rel=1e-6)
    assert np.isnan(matrix(result, "C")).all()


PARALLELOGRAM = (
    METRES
    + """
mechanism:
  links:
    ground: {O1: [0, 0], O2: [0.5, 0], G: [2, -0.2]}
    one: [O1, A1, 0.8]
    two: [O2, A2, 0.8]
    coupler: {A1: [0, 0], A2: [0.5, 0], C: [0.25, 0.3]}
    plate: {C: [0, 0], B: [1, 0], T: [0.4, 0.5]}
    leg: {from: G, to: B, telescopic: true}
  drives: {swing: {angle: one}, lift: {length: leg}}
  sketch: {A1: [0.3, 0.74], A2: [0.8, 0.74], C: [0.55, 1.04], B: [1.5, 0.9], T: [0.9, 1.5]}
stiffness:
  link: plate
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {one: beam, two: beam, coupler: beam, leg: beam}
  actuators: {swing: 1e4, lift: 1e6}
  poses: [{swing: 65, lift: 1.2}]
"""
)


def test_a_parallelogram_for_a_leg() -> None:
    result = ask_stiffness(PARALLELOGRAM)
    assert method(result) == "force method"
    expected = by_elements(PARALLELOGRAM)
    assert_allclose(matrix(result, "C"), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_a_flat_parallelogram_is_free_and_held_twice_at_once() -> None:
    """All four links in one line: they bear one force in two ways, and the coupler turns though the motor holds."""
    flat = PARALLELOGRAM.replace("  drives:", "  branch: follow\n  drives:").replace("swing: 65", "swing: 0")
    result = ask_stiffness(flat)
    assert result.tables["stiffness"]["rank"][0] == 2
    structure = posed(study_of(flat))
    here = slice(3 * structure.asked, 3 * structure.asked + 3)
    _, loose = structure.frame.respond(structure.asked)
    assert loose.shape[1] == 1
    twist = loose[here, 0] / loose[here, 0][2]
    assert free(result) == pytest.approx(twist, rel=1e-6)
    # Loads that do no work on it are borne, and K says how far they move the plate.
    loads = np.linalg.svd(twist[None])[2][1:].T
    moved, _ = structure.frame.respond(structure.asked, loads)
    assert_allclose(matrix(result, "K") @ moved[here], loads, atol=1e-5)


STRETCHED = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 0.5], Q: [0.3, -0.6]}
    a: {O: [0, 0], A: [0.5, 0], M: [0.25, 0]}
    b: [A, B, 0.5]
    c: [Q, N, 0.5]
    d: [N, M, 0.5]
    block: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, block]}}
  drives: {s: {slide: guide}}
  sketch: {A: [0.45, 0.2], B: [0.95, 0], M: [0.23, 0.1], N: [0.6, -0.2]}
stiffness:
  link: block
  at: B
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {a: beam, b: beam, c: beam, d: beam}
  actuators: {s: 1e5}
  poses: [{s: 0.9}, {s: 1.0}]
"""
)


def test_a_stretched_knee_carries_along_its_line() -> None:
    """Three pins in one line bear a force along it beside the motor, whatever length rotations are counted by."""
    result = ask_stiffness(STRETCHED)
    assert method(result) == "force method"
    assert matrix(result, "C", 0)[0, 0] == pytest.approx(1e-5, rel=1e-9)
    assert matrix(result, "C", 1)[0, 0] == pytest.approx(1 / (1e5 + AXIAL), rel=1e-9)


def in_millimetres(text: str) -> str:
    """The same study with every length in mm (forces stay N); its drives are legs."""
    study = yaml.safe_load(text)
    mechanism, asked = study["mechanism"], study["stiffness"]
    for link in mechanism["links"].values():
        for point, place in link.items() if isinstance(link, dict) and "telescopic" not in link else ():
            link[point] = [1000 * x for x in place]
    mechanism["sketch"] = {point: [1000 * x for x in place] for point, place in mechanism["sketch"].items()}
    asked["sections"]["beam"] |= {"width": 20, "height": 40}
    asked["actuators"] = {leg: float(k) / 1000 for leg, k in asked["actuators"].items()}
    asked["poses"] = [{k: v if k.endswith("angle") else 1000 * v for k, v in pose.items()} for pose in asked["poses"]]
    study["units"]["length"] = "mm"
    return yaml.safe_dump(study, sort_keys=False)


@pytest.mark.slow
@pytest.mark.parametrize("text", [TRIPOD, PUSHED])
def test_the_same_answer_in_metres_and_millimetres(text: str) -> None:
    metres, millimetres = ask_stiffness(text), ask_stiffness(in_millimetres(text))
    # Moments in N mm, displacements in mm.
    wrench, twist = np.array([1, 1, 1e3]), np.array([1e3, 1e3, 1])
    assert_allclose(matrix(millimetres, "K"), matrix(metres, "K") * np.outer(wrench, 1 / twist), rtol=1e-10)
    assert_allclose(matrix(millimetres, "C"), matrix(metres, "C") * np.outer(twist, 1 / wrench), rtol=1e-10)


BOOM = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0]}
    boom: {from: O, to: B, telescopic: true}
    hand: {B: [0, 0], P: [0.3, 0.1]}
  joints: {grip: {fixed: [boom, hand], point: B, angle: 0}}
  drives: {turn: {angle: boom}, out: {length: boom}}
  sketch: {B: [1, 0.2], P: [1.3, 0.35]}
stiffness:
  link: hand
  at: P
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {boom: beam}
  actuators: {turn: 1e5, out: 5e7}
  poses: [{turn: 30, out: 1e-12}, {turn: 30, out: 0.05}, {turn: 30, out: 0.5}]
"""
)


# The same with a carriage on an elastic arm, whose displacement may be zero.
CARRIAGE = (
    BOOM.replace("boom: {from: O, to: B, telescopic: true}", "boom: {O: [0, 0], S: [0, -0.2]}")
    .replace("{grip: {fixed: [boom, hand], point: B, angle: 0}}",
             "{rail: {prismatic: [boom, hand], through: O, point: B}}")
    .replace("{length: boom}", "{slide: rail}")
    .replace("sketch: {B", "sketch: {S: [0.04, -0.196], B")
    .replace("out: 1e-12", "out: 0")
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("text", [BOOM, CARRIAGE], ids=["leg", "carriage"])
@pytest.mark.parametrize("at", ["P", "B"])
def test_a_driven_leg_of_no_length_gives_with_its_motors_only(text: str, at: str) -> None:
    result = ask_stiffness(text, f"stiffness.at={at}")
    along = np.exp(1j * np.pi / 6)
    arm = (0.3 + 0.1j) * along if at == "P" else 0j
    slide, turn = np.array([along.real, along.imag, 0]), np.array([-arm.imag, arm.real, 1])
    expected = np.outer(slide, slide) / 5e7 + np.outer(turn, turn) / 1e5
    assert_allclose(matrix(result, "C", 0), expected, rtol=1e-8, atol=1e-15)
    for row in (1, 2):
        elements = by_elements(text, f"stiffness.at={at}", row=row)
        assert_allclose(matrix(result, "C", row), elements, rtol=1e-6, atol=1e-15)
    assert result.tables["stiffness"]["valid"].all()


def test_poses_near_where_the_legs_meet_are_told() -> None:
    """Legs that miss their common point by a hair: full rank, a huge compliance, and a warning, by both methods."""
    near = "stiffness.poses=[{P.x: 0.1, P.y: 1, platform.angle: 0}, {P.x: 1e-5, P.y: 1, platform.angle: 0}]"
    for text in (TRIPOD, PUSHED):
        result = ask_stiffness(text, near)
        assert result.tables["stiffness"]["rank"].tolist() == [3, 3]
        (warning,) = map(str, result.warnings)
        assert warning.startswith("1 of 2 poses are nearly under-constrained")
        assert "P.x = 10⁻⁵" in warning
        assert matrix(result, "C", 1)[2, 2] > 1e6 * matrix(result, "C", 0)[2, 2]


def test_all_poses_get_the_same_answer_alone_or_beside_a_singular_one() -> None:
    poses = "{P.x: 0.1, P.y: 1, platform.angle: 0}, {P.x: 0.2, P.y: 1.1, platform.angle: 5}"
    for text in (TRIPOD, PUSHED):
        plain = ask_stiffness(text, f"stiffness.poses=[{poses}]")
        among = ask_stiffness(text, f"stiffness.poses=[{poses}, {{P.x: 0, P.y: 1, platform.angle: 0}}]")
        for row in range(2):
            assert matrix(plain, "C", row).tobytes() == matrix(among, "C", row).tobytes()


def test_a_tool_that_hangs_on_the_asked_link_goes_along_and_bears_nothing() -> None:
    """A driven tool beyond the loaded pin of a five-bar."""
    text = FIVE_BAR.replace("    b2: [E2, P, 0.40]\n", "    b2: [E2, P, 0.40]\n    tool: [P, T, 0.1]\n")
    text = text.replace(
        "drives: [a1, a2]", "drives: {a1: {angle: a1}, a2: {angle: a2}, wrist: {angle: tool, from: b2}}"
    )
    text = text.replace("P: [0.05, 0.45]}", "P: [0.05, 0.45], T: [0.1, 0.5]}")
    text = text.replace("{P.x: 0.05, P.y: 0.45}", "{P.x: 0.05, P.y: 0.45, wrist: 40}")
    text += "  " + BEAM + "\n  elastic: {tool: beam, a1: beam, b2: beam}\n  loads: [[3, 4]]\n"
    result = ask_stiffness(text)
    assert_allclose(matrix(result, "C"), by_elements(text), rtol=1e-6)
    moved = result.tables["displacements"]
    rows = {(link, point): k for k, (link, point) in enumerate(zip(moved["link"], moved["point"], strict=True))}
    structure = posed(study_of(text))
    shift, _ = structure.frame.respond(structure.asked, np.array([[3.0], [4.0], [0.0]]))
    for link, point in (("tool", "P"), ("tool", "T"), ("b2", "P"), ("b1", "E1")):
        node, row = structure.nodes[link, point], rows[link, point]
        assert [moved["dx"][row], moved["dy"][row]] == pytest.approx(shift[3 * node : 3 * node + 2, 0], rel=1e-6)
    assert "T" not in result.tables["forces"]["joint"]


def test_a_link_alone_on_its_motor() -> None:
    """Nothing but one driven link, asked at its own pivot: it turns there, and nothing else gives."""
    text = (
        METRES
        + """
mechanism:
  links: {ground: {O: [0, 0]}, bar: [O, P, 0.5]}
  drives: [bar]
  sketch: {P: [0.4, 0.3]}
stiffness: {link: bar, at: O, actuators: {bar: 100}, poses: [{bar: 0}], loads: [[1, 2, 3]]}
"""
    )
    result = ask_stiffness(text)
    expected = np.zeros((3, 3))
    expected[2, 2] = 0.01
    assert_allclose(matrix(result, "C"), expected, rtol=1e-14, atol=0)
    forces = result.tables["forces"]
    assert [forces[name].tolist() for name in ("fx", "fy", "mz")] == [[1], [2], [3]]
    tip = ask_stiffness(text, "stiffness.at=P", "stiffness.elastic={bar: b}",
                        "stiffness.sections={b: {E: 200 GPa, width: 0.02, height: 0.04}}")  # fmt: skip
    bend = np.array([[0.5**3 / 3, 0.5**2 / 2], [0.5**2 / 2, 0.5]]) / BENDING
    expected = np.zeros((3, 3))
    expected[0, 0] = 0.5 / AXIAL
    expected[1:, 1:] = bend + np.array([[0.25, 0.5], [0.5, 1]]) / 100
    assert_allclose(matrix(tip, "C"), expected, rtol=1e-12, atol=1e-20)


def test_an_arm_held_rigidly_all_along_is_rigid() -> None:
    result = ask_stiffness(ARM, "stiffness.elastic={}", "stiffness.actuators={}", "stiffness.loads=[[1, 2, 3]]")
    assert not matrix(result, "C").any()
    assert result.tables["deflections"]["dx"].tolist() == [0]
    assert np.isfinite(result.tables["forces"]["fx"]).all()


@pytest.mark.parametrize("name", ["grip", "B"])
def test_a_clamp_has_no_bearing(name: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=f"no pin or slide '{name}'"):
        ask_stiffness(BOOM, f"stiffness.bearings={{{name}: 1e6}}")


def test_a_pivot_on_a_rigid_ground_does_not_move_at_all() -> None:
    """Request at its own foot a leg turns there, and nothing else."""
    text = TRIPOD.replace("link: platform", "link: leg_1").replace("at: P", "at: A1")
    compliance = matrix(ask_stiffness(text), "C")
    assert compliance[2, 2] > 0
    compliance[2, 2] = 0
    assert not compliance.any()
