"""Unusual topologies, each checked against what its text says; mistakes that only the whole mechanism shows."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

INVERTED = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    arm: {D: [0, 0], Q: [0.5, 0.3], R: [2, 0.5], T: [3, 0]}
    block: {A: [0, 0], K: [0.2, 0.5]}
  joints: {g: {prismatic: [arm, block], through: [Q, R], point: K, angle: 25}}
  drives: [crank]
  sketch: {A: [0.6, 0.8], T: [1.2, 0.5]}
"""

UNDRAWN = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], arm: {D: [0, 0]}, block: {A: [0, 0]}}
  joints: {g: {prismatic: [arm, block], through: D, point: A}}
  drives: [arm]
  sketch: {A: [0.6, 0.8]}
"""

WEDGE = """
mechanism:
  links: {ground: {O: [0, 0]}, a: {A: [0, 0]}, b: {B: [0, 0]}}
  joints:
    floor: {prismatic: [ground, a], through: O, point: A}
    face: {prismatic: [a, b], through: A, direction: 30, point: B, angle: -30}
    wall: {prismatic: [ground, b], through: O, direction: 90, point: B, angle: -90}
  drives: [floor]
  sketch: {A: [2, 0], B: [0, -1.1]}
"""

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: [crank]
  sketch: {A: [0.5, 0.9], B: [3.3, 2.9]}
  measures: {reach: {distance: [A, D]}, odd: "sqrt(B.x + 9) + rod.angle"}
"""

PARALLELOGRAM = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 4], rocker: [D, B, 1]}
  drives: [crank]
  sketch: {A: [0.5, 0.9], B: [4.5, 0.9]}
kinematics: {sweep: {crank: {from: 10, to: 350, step: 7}}}
"""


def test_a_slide_between_two_moving_links_off_both_their_origins() -> None:
    mechanism = study_of(INVERTED).mechanism
    configuration = mechanism.forward.solve([np.linspace(-3, 3, 61)])
    q, r, k = (configuration.point(name) for name in "QRK")
    along = (r - q) / np.abs(r - q)
    slide = configuration.value(mechanism.coordinate("g.slide"))
    assert configuration.valid.all()
    assert k == pytest.approx(q + slide * along, abs=1e-13)
    assert configuration.rotation("block") / along == pytest.approx(np.full(61, np.exp(1j * np.radians(25))), abs=1e-13)


@pytest.mark.parametrize(("clamped", "at"), [("[leg, plate]", "B"), ("[base, leg]", "A")])
def test_a_telescopic_leg_clamped_at_either_end(clamped: str, at: str) -> None:
    mechanism = study_of(f"""
mechanism:
  links:
    ground: {{O: [0, 0], D: [4, 0]}}
    base: [O, A, 0.5]
    leg: {{from: A, to: B, telescopic: true, points: {{E: [0.4, 0.2]}}}}
    plate: {{B: [0, 0], C: [1, -0.5]}}
    back: [D, C, 3]
  joints: {{clamp: {{fixed: {clamped}, point: {at}, angle: 35}}}}
  drives: {{l: {{length: leg}}, q: {{angle: base}}}}
  sketch: {{A: [0.4, 0.3], B: [1.5, 1.5], C: [2.5, 2.3]}}
""").mechanism
    length = np.linspace(1.7, 2.2, 6)
    configuration = mechanism.forward.solve([length, 0.5])
    a, b, e = (configuration.point(name) for name in "ABE")
    turn = configuration.rotation("leg")
    assert configuration.valid.all()
    assert b - a == pytest.approx(length * turn, abs=1e-13)
    # Extra points go with the body at the leg's beginning.
    assert e - a == pytest.approx((0.4 + 0.2j) * turn, abs=1e-13)
    first, second = clamped.strip("[]").split(", ")
    angle = np.degrees(np.angle(configuration.rotation(second) / configuration.rotation(first)))
    assert angle == pytest.approx(35, abs=1e-10)


def test_a_link_that_only_its_slide_shows_lies_along_it() -> None:
    mechanism = study_of(UNDRAWN).mechanism
    assert complex(mechanism.sketch_configuration.point("A")) == pytest.approx(0.6 + 0.8j, abs=1e-12)


def test_wedges_slide_on_one_another_and_their_angles_must_close() -> None:
    assert study_of(WEDGE).mechanism.solve({"floor": 2})["B.y"] == pytest.approx(-2 * np.tan(np.pi / 6))
    with pytest.raises(mechdesign.StudyError, match="'a' and 'b' are 10 apart"):
        study_of(WEDGE.replace("-90", "-80"))


def test_a_slide_of_length_zero_is_a_pose_like_any_other() -> None:
    mechanism = study_of(UNDRAWN.replace("drives: [arm]", "drives: [g]")).mechanism
    with pytest.raises(mechdesign.AssemblyError, match="g = 0: cannot be assembled"):
        mechanism.solve({"g": 0})


def test_a_distance_that_is_given_is_not_negative() -> None:
    mechanism = study_of(FOUR_BAR).mechanism
    reach = float(mechanism.solve({"crank": 60})["reach"])
    assert list(mechanism.solve({"reach": [reach, -reach]}).valid) == [True, False]


def test_unknown_pin_offsets_are_told() -> None:
    with pytest.raises(mechdesign.MechanismError, match=r"nothing\.dx"):
        study_of(FOUR_BAR).mechanism.solve({"crank": 60}, {"nothing.dx": 1.0})


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_limit_on_an_angle_does_not_depend_on_the_unit_of_length(scale: float) -> None:
    mechanism = study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: [O, P, {scale}]}}
  drives: [arm]
  limits: [{{drive: arm, min: 10, max: 80}}]
""").mechanism
    assert list(mechanism.solve({"arm": [10, 80, 80 + 1e-9, 10 - 1e-9]}).valid) == [True, True, False, False]


@pytest.mark.nightly
def test_acceleration_of_an_expression_does_not_depend_on_poses_that_fail() -> None:
    text = FOUR_BAR.replace("crank: [O, A, 1]", "crank: [O, A, 3]") + (
        "kinematics: {sweep: {crank: {from: 60, to: %d, step: 20}}, rates: {crank: 1 rad/s}, outputs: [odd]}\n"
    )
    some, more = (mechdesign.kinematics(study_of(text % to)).tables["motion"] for to in (120, 180))
    assert not more["valid"].all()
    assert np.isfinite(some["odd_acceleration"]).all()
    assert np.array_equal(more["odd_acceleration"][:4], some["odd_acceleration"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("rocker: [D, B, 3]", "rocker: [D, B, 3], x: [Q, R, 1], y: [R, S, 1]"), "links.x: nothing joins it to the gr"),
        (("drives: [crank]", "joints: {s: {slot: ground, through: [O, O2], point: B}}\n  drives: [crank]"), "'O2'"),
    ],
)
def test_mistakes_of_the_whole_are_named(change: tuple[str, str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(FOUR_BAR.replace(*change))


def test_a_line_through_a_legs_far_end_has_no_fixed_direction() -> None:
    with pytest.raises(mechdesign.StudyError, match="'B' moves along leg 'leg'"):
        study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, leg: {from: O, to: B, telescopic: true}, car: {C: [0, 0]}}
  joints: {g: {prismatic: [leg, car], through: [O, B], point: C}}
  drives: {l: {length: leg}, a: {angle: leg}, s: {slide: g}}
  sketch: {B: [2, 2], C: [1, 1]}
""")


def test_rates_are_those_of_drives() -> None:
    with pytest.raises(mechdesign.StudyError, match=r"'B\.x' is not a drive"):
        study_of(FOUR_BAR + "kinematics: {sweep: {crank: 60}, rates: {B.x: 1}}\n")


@pytest.mark.slow
def test_change_points_are_warned_about_between_poses_and_on_them() -> None:
    def between(text: str) -> list[str]:
        return [
            warning
            for warning in map(str, mechdesign.kinematics(study_of(text)).warnings)
            if "change point at" in warning
        ]

    assert len(between(PARALLELOGRAM)) == 1
    assert "crank = 180 deg (joints" in between(PARALLELOGRAM)[0]
    assert not between(PARALLELOGRAM.replace("[D, B, 1]", "[D, B, 1.1]").replace("rod: [A, B, 4]", "rod: [A, B, 3.95]"))
    on = [*map(str, mechdesign.kinematics(study_of(PARALLELOGRAM, "kinematics.sweep.crank.step=10")).warnings)]
    assert any("mean nothing there; the first: crank = 180 deg" in warning for warning in on)


def test_angles_are_continuous_both_ways_of_a_grid() -> None:
    table = mechdesign.kinematics(
        study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], forearm: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: forearm, from: upper}}
kinematics: {sweep: {t1: {from: 100, to: 400, step: 50}, t2: {from: 0, to: 360, step: 90}}}
""")
    ).tables["motion"]
    assert table["forearm.angle"] == pytest.approx(table["t1"] + table["t2"])
