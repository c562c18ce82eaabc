"""The compiled core: groups, assembly modes, inverse problems, errors that a designer understands."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: [crank]
  sketch: {A: [0.5, 0.9], B: [3.3, 2.9]}
"""

PLATFORM = """
units: {length: m}
mechanism:
  links:
    ground: {A1: [-0.6, 0], A2: [0.6, 0], A3: [0.3, -0.2]}
    l1: {from: A1, to: B1, telescopic: true}
    l2: {from: A2, to: B2, telescopic: true}
    l3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.2, 0], B2: [0.2, 0], B3: [0.25, 0.15]}
  drives: [l1, l2, l3]
  sketch: {B1: [-0.2, 1], B2: [0.2, 1], B3: [0.25, 1.15]}
"""


def groups(text: str) -> list[str]:
    """What is solved, in its order, without the numbers."""
    return [line.strip().partition(". ")[2] for line in checked(text) if line.startswith("  ")]


def test_four_bar_agrees_with_its_textbook_solution() -> None:
    # Lengths 1, 3.5, 3, 4 (crank, coupler, rocker, ground) at 60 deg, open.
    pose = study_of(FOUR_BAR).mechanism.solve({"crank": 60})
    assert pose["rod.angle"] == pytest.approx(36.022723, abs=5e-7)
    assert pose["rocker.angle"] == pytest.approx(102.890327, abs=5e-7)
    assert pose["B.x"] == pytest.approx(3.330743, abs=5e-7)
    assert pose["B.y"] == pytest.approx(2.924397, abs=5e-7)


def test_the_sketch_chooses_the_assembly_mode() -> None:
    open_, crossed = study_of(FOUR_BAR), study_of(FOUR_BAR.replace("[3.3, 2.9]", "[3.3, -2.0]"))
    assert open_.mechanism.solve({"crank": 60})["B.y"] > 0 > crossed.mechanism.solve({"crank": 60})["B.y"]


def test_each_mechanism_splits_into_the_groups_of_its_question() -> None:
    (dyad,) = groups("""
mechanism:
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    lower_1: [B1, E1, 1]
    upper_1: [E1, C, 2]
    lower_2: [B2, E2, 1]
    upper_2: [E2, C, 2]
  drives: [lower_1, lower_2]
  sketch: {E1: [1.7, 0.7], E2: [-1.7, 0.7], C: [0, 1.7]}
""")
    assert dyad.startswith("RRR dyad")
    (group,) = groups(PLATFORM)
    assert "2 loops without a closed form" in group
    assert "by Newton's method" in group


@pytest.mark.parametrize(
    ("links", "joints", "sketch", "dyad"),
    [
        ("rod: [A, B, 3], slider: {B: [0, 0]}", "g: {prismatic: [ground, slider], through: D}", "B: [3, 0]",
         "RRP"),
        ("rod: [A, B, 3]", "g: {slot: ground, through: D, point: B}", "B: [3, 0]", "RRP"),
        ("arm: {D: [0, 0]}, block: {A: [0, 0]}", "g: {prismatic: [arm, block], through: D}", "D: [4, 0]",
         "RPR"),
        ("arm: {D: [0, 0], Q: [5, 0]}", "g: {slot: arm, through: D, point: A}", "Q: [-1, 0]",
         "RPR"),
        ("yoke: {Y: [0, 0]}", "h: {prismatic: [ground, yoke], through: D, point: Y}, "
         "g: {slot: yoke, through: Y, direction: 90, point: A}", "Y: [1, 0]", "RPP"),
    ],
)  # fmt: skip
def test_every_dyad_has_a_closed_form(links: str, joints: str, sketch: str, dyad: str) -> None:
    text = f"""
mechanism:
  links: {{ground: {{O: [0, 0], D: [4, 0]}}, crank: [O, A, 1], {links}}}
  joints: {{{joints}}}
  drives: [crank]
  sketch: {{A: [0.6, 0.8], {sketch}}}
"""
    (group,) = groups(text)
    assert group.startswith(f"{dyad} dyad")
    pose = study_of(text).mechanism.solve({"crank": np.linspace(0, 350, 36)})
    assert pose.valid.all()
    assert np.hypot(pose["A.x"], pose["A.y"]) == pytest.approx(1, abs=1e-14)


def test_a_scotch_yoke_moves_as_a_cosine() -> None:
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0], D: [0, 0.5]}, crank: [O, A, 2], yoke: {Y: [0, 0]}}
  joints:
    guide: {prismatic: [ground, yoke], through: D, point: Y}
    slot: {slot: yoke, through: Y, direction: 90, point: A}
  drives: [crank]
  sketch: {A: [1, 1], Y: [1, 0.5]}
""").mechanism
    angle = np.arange(0.0, 360.0, 7.0)
    assert mechanism.solve({"crank": angle})["Y.x"] == pytest.approx(2 * np.cos(np.radians(angle)), abs=1e-13)


def test_newton_group_and_inverse_problem_agree_on_a_platform() -> None:
    mechanism = study_of(PLATFORM).mechanism
    rng = np.random.default_rng(5)
    x, y, angle = rng.uniform(-0.3, 0.3, 50), rng.uniform(0.8, 1.3, 50), rng.uniform(-20, 20, 50)
    inverse = mechanism.solve({"P.x": x, "P.y": y, "platform.angle": angle})
    forward = mechanism.solve({name: inverse[name] for name in ("l1", "l2", "l3")})
    assert forward.valid.all()
    for name, value in (("P.x", x), ("P.y", y), ("platform.angle", angle)):
        assert forward[name] == pytest.approx(value, abs=1e-11)


@pytest.mark.slow
def test_what_newton_cannot_reach_is_not_passed_off_as_the_asked_assembly() -> None:
    mechanism = study_of(PLATFORM).mechanism
    pose = mechanism.solve({"l1": [1.0, 0.1], "l2": [1.0, 3.0], "l3": [1.2, 0.1]})
    assert list(pose.valid) == [True, False]
    assert np.isnan(pose["P.x"][1])


def test_a_structure_is_answered_in_every_pose_that_is_listed_of_it() -> None:
    study = study_of(
        "mechanism: {links: {ground: {O: [0, 0], D: [100, 0]}, a: [O, A, 80], b: [D, A, 80]}, sketch: {A: [50, 60]}}\n"
        "kinematics: {poses: [{}, {}], outputs: [A]}\n"
    )
    motion = mechdesign.kinematics(study).main
    assert motion["A.y"] == pytest.approx([np.sqrt(80**2 - 50**2)] * 2)
    assert motion["valid"].all()


def test_relative_drive_turns_with_the_link_it_is_mounted_on() -> None:
    text = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], forearm: [E, P, 8]}
  drives: {shoulder: {angle: upper}, elbow: {angle: forearm, from: upper}}
"""
    pose = study_of(text).mechanism.solve({"shoulder": 30, "elbow": 45})
    expected = 10 * np.exp(1j * np.radians(30)) + 8 * np.exp(1j * np.radians(75))
    assert pose["P.x"] + 1j * pose["P.y"] == pytest.approx(expected, abs=1e-13)


def test_clamped_links_turn_as_one() -> None:
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, a: [O, E, 2], b: [E, P, 1]}
  joints: {weld: {fixed: [a, b], point: E, angle: 90}}
  drives: [a]
  sketch: {E: [2, 0], P: [2, 1]}
""").mechanism
    pose = mechanism.solve({"a": 90})
    assert (pose["P.x"], pose["P.y"]) == pytest.approx((-1.0, 2.0), abs=1e-14)


def test_pin_offsets_move_a_point_in_its_links_frame() -> None:
    mechanism = study_of(FOUR_BAR).mechanism
    pose = mechanism.solve({"crank": 90}, {"crank.A.dx": 0.1, "crank.A.dy": 0.02})
    assert (pose["A.x"], pose["A.y"]) == pytest.approx((-0.02, 1.1), abs=1e-15)
    changed = study_of(FOUR_BAR.replace("A, 1]", "A, 1.1]")).mechanism.solve({"crank": 90})
    moved = mechanism.solve({"crank": 90}, {"crank.A.dx": 0.1})
    assert (moved["B.x"], moved["B.y"]) == pytest.approx((changed["B.x"], changed["B.y"]), abs=1e-14)


def test_a_pose_out_of_reach_raises_alone_and_is_nan_in_a_batch() -> None:
    mechanism = study_of(FOUR_BAR.replace("crank: [O, A, 1]", "crank: [O, A, 3]")).mechanism
    batch = mechanism.solve({"crank": [60.0, 180.0]})
    assert list(batch.valid) == [True, False]
    assert np.isnan(batch["B.x"][1])
    assert batch["A.x"][0] == pytest.approx(1.5)
    with pytest.raises(mechdesign.AssemblyError, match="crank = 180"):
        mechanism.solve({"crank": 180})


def test_limits_keep_the_position_and_say_why() -> None:
    limited = FOUR_BAR + "  limits: [{angle: [rod, rocker], min: 60, max: 90}]\n"
    pose = study_of(limited).mechanism.solve({"crank": np.arange(0, 365, 5)})
    assert np.isfinite(pose["B.x"]).all()
    held = (pose["rocker.angle"] - pose["rod.angle"] - 60) % 360 <= 30
    assert np.array_equal(held, pose.valid)
    (warning,) = mechdesign.kinematics(study_of(limited)).warnings
    assert f"{np.count_nonzero(~held)} of 73 poses are not valid ({np.count_nonzero(~held)} limit)" in str(warning)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("drives: [crank]", "drives: [crank, rocker]"), "mobility is 1 but 2 drives"),
        (("drives: [crank]", "drives: []"), "mobility is 1 but 0 drives"),
        (("A: [0.5, 0.9], ", ""), "'A'"),
        (("B: [3.3, 2.9]", "B: [2.25, 0.45]"), "within 1 %"),
        (("rod: [A, B, 3.5]", "rod: [A, B, 0.1]"), "cannot be assembled"),
    ],
)
def test_mistakes_are_named(change: tuple[str, str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(FOUR_BAR.replace(*change))


def test_given_coordinates_must_determine_the_mechanism() -> None:
    arm = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], forearm: [E, P, 8]}
  drives: {a: {angle: upper}, b: {angle: forearm}}
""").mechanism
    with pytest.raises(mechdesign.MechanismError, match="do not determine"):
        arm.solve({"a": 30, "upper.angle": 30})
    with pytest.raises(mechdesign.MechanismError, match="2 coordinates"):
        arm.solve({"a": 30})
    with pytest.raises(mechdesign.MechanismError, match=r"did you mean 'P\.y'"):
        arm.solve({"P.c": 3, "P.y": 4})


def test_outer_joints_that_coincide_are_no_division_by_zero() -> None:
    # At 0 deg the crank's pin lies on the other pivot: rod and rocker, of unequal lengths, cannot meet there.
    mechanism = study_of(FOUR_BAR.replace("crank: [O, A, 1]", "crank: [O, A, 4]")).mechanism
    with pytest.raises(mechdesign.AssemblyError, match="cannot be assembled"):
        mechanism.solve({"crank": 0})
    assert list(mechanism.solve({"crank": [0.0, 60.0]}).valid) == [False, True]
