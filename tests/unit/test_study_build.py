"""From the study's links, joints and drives to the description of the mechanism."""

import math

import numpy as np
import pytest

import mechdesign

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""


@pytest.fixture
def load(tmp_path):
    def load(text, *overrides):
        path = tmp_path / "study.yaml"
        path.write_text(text)
        return mechdesign.load(path, overrides)

    return load


def nominal(description):
    return {name: place.nominal for name, place in description.places.items()}


def test_the_shortest_study(load):
    study = load(FOUR_BAR)
    assert study.name == "study"
    assert (study.units.length, study.units.angle, study.seed, study.questions) == ("mm", "deg", 0, ())
    assert (study.mechanism.drives, study.mechanism.quantity("crank")) == (("crank",), "angle")
    pose = study.mechanism.solve({"crank": 90})
    assert (pose["A.x"], pose["A.y"]) == pytest.approx((0, 30), abs=1e-12)
    assert math.hypot(pose["B.x"], pose["B.y"] - 30) == pytest.approx(90)


@pytest.mark.parametrize(
    "rod",
    [
        "{from: A, to: B, length: 90}",
        "{to: B, from: A, length: 9 cm, points: {}}",
        "[A, B, '3*30']",
    ],
)
def test_forms_of_a_binary_link_agree(load, rod):
    description = load(FOUR_BAR.replace("[A, B, 90]", rod)).mechanism.description
    assert description == load(FOUR_BAR).mechanism.description


def test_own_frame_and_points_key_agree(load):
    frame = FOUR_BAR.replace("[A, B, 90]", "{A: [0, 0], B: [90, 0], P: [40, 20]}")
    points = FOUR_BAR.replace("[A, B, 90]", "{points: {A: [0, 0], B: [90, 0], P: [40, 20]}}")
    assert load(frame).mechanism.description == load(points).mechanism.description
    assert load(frame).mechanism.description.links["rod"].ends is None


@pytest.mark.parametrize("rod", ["{from: A, to: B}", "[A, B]"])
def test_a_length_left_out_is_measured_from_the_sketch(load, rod):
    description = load(FOUR_BAR.replace("[A, B, 90]", rod)).mechanism.description
    assert nominal(description)["rod.length"] == pytest.approx(math.hypot(75, 25))


def test_points_left_out_are_measured_from_the_sketch(load):
    text = FOUR_BAR.replace("[A, B, 90]", "{points: [A, B, P]}").replace("B: [75, 55]", "B: [40, 60], P: [10, 60]")
    text = text.replace("crank: [O, A, 30]", "crank: [O, A]").replace("rocker: [D, B, 60]", "rocker: [D, B]")
    found = nominal(load(text).mechanism.description)
    # The frame has its origin at A and its x axis towards B, at atan2(30, 40) to the world's.
    assert [found[f"rod.{p}"] for p in ("A.x", "A.y", "B.x", "B.y")] == pytest.approx([0, 0, 50, 0])
    assert [found["rod.P.x"], found["rod.P.y"]] == pytest.approx([26, 18])
    assert found["crank.length"] == pytest.approx(30)
    pose = load(text).mechanism.solve({"crank": 90})
    assert (pose["P.x"], pose["P.y"]) == pytest.approx((10, 60))


def test_a_point_left_out_lies_in_the_frame_of_those_given(load):
    text = FOUR_BAR.replace("[A, B, 90]", "{A: [10, 0], B: [60, 0], P: null}").replace(
        "B: [75, 55]", "B: [40, 60], P: [10, 60]"
    )
    found = nominal(load(text.replace("60]}", "60]}").replace("[D, B, 60]", "[D, B]")).mechanism.description)
    assert [found["rod.P.x"], found["rod.P.y"]] == pytest.approx([36, 18])


def test_ground_points_may_be_drawn(load):
    text = FOUR_BAR.replace("ground: {O: [0, 0], D: [100, 0]}", "ground: {points: [O, D]}")
    found = nominal(load(text.replace("A: [0, 30]", "O: [1, 2], D: [101, 2], A: [0, 30]")).mechanism.description)
    assert [found["ground.O.x"], found["ground.O.y"], found["ground.D.x"]] == [1, 2, 101]


SLIDER = """
mechanism:
  parameters: {r: 40, slope: 30, e: "-r/2"}
  links:
    ground: {O: [0, 0], G: [0, e], H: [10, e]}
    crank: [O, A, r]
    rod: [A, B, 120]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
"""


def test_a_slide_is_level_by_default_and_meets_its_body_at_the_point_they_share(load):
    mechanism = load(SLIDER).mechanism
    pose = mechanism.solve({"theta": [0, 50, 130]})
    assert pose["B.y"] == pytest.approx(-20)
    assert pose["slider.angle"] == pytest.approx(0)
    # Its direction and its angle are dimensions.
    turned = mechanism.solve({"theta": [0, 50, 130]}, {"guide.direction": 10, "guide.angle": 5})
    assert turned["B.y"] + 20 == pytest.approx(turned["B.x"] * math.tan(math.radians(10)))
    assert np.abs(turned["slider.angle"] - 10) == pytest.approx(5)


def test_a_line_through_two_points_has_no_direction_of_its_own(load):
    mechanism = load(SLIDER.replace("through: G", "through: [G, H]")).mechanism
    assert "guide.direction" not in mechanism.nominal
    pose = mechanism.solve({"theta": 50}, {"ground.H.y": -18})
    assert pose["B.y"] + 20 == pytest.approx(pose["B.x"] * 0.2)


def test_angles_of_joints_are_places_in_radians(load):
    study = load(SLIDER.replace("through: G", "through: G, direction: slope/2, angle: 0.1 rad"))
    found = nominal(study.mechanism.description)
    assert found["guide.direction"] == pytest.approx(math.radians(15))
    assert found["guide.angle"] == pytest.approx(0.1)
    assert study.parameters.places({"slope": 60.0}) == {"guide.direction": pytest.approx(math.radians(30))}


def test_slot_telescopic_leg_and_drive_kinds(load):
    text = """
mechanism:
  links:
    ground: {O: [0, 0], Q: [0, -30]}
    arm: {from: Q, to: E, length: 80}
    leg: {from: O, to: A, telescopic: true}
    carrier: {O: [0, 0], C: [10, 0]}
  joints:
    groove: {slot: arm, point: A}
    weld: {fixed: [leg, carrier], point: O}
  drives: {q: {angle: arm}, leg: null}
  sketch: {E: [40, 40], A: [20, 10], C: [0, 10]}
"""
    text = text.replace("leg: null", "s: {slide: groove}")
    mechanism = load(text).mechanism
    assert mechanism.drives == ("q", "s")
    assert [mechanism.quantity(name) for name in mechanism.drives] == ["angle", "length"]
    # The arm's line carries A, at any place from its beginning on.
    pose = mechanism.solve({"q": 60, "s": [40, 70]})
    assert pose["A.x"] == pytest.approx(np.array([40, 70]) / 2)
    assert pose["A.y"] + 30 == pytest.approx(np.array([40, 70]) * math.sqrt(3) / 2)
    # The carrier's x axis is drawn upwards, the leg at atan2(10, 20).
    welded = math.degrees(math.pi / 2 - math.atan2(10, 20))
    assert pose["carrier.angle"] - pose["leg.angle"] == pytest.approx(welded)
    by_leg = load(text.replace("s: {slide: groove}", "leg: {length: leg}")).mechanism
    pose = by_leg.solve({"q": 60, "leg": 25})
    assert math.hypot(pose["A.x"], pose["A.y"]) == pytest.approx(25)


def test_a_drive_list_names_links_legs_and_slides(load):
    text = SLIDER.replace("drives: {theta: {angle: crank}}", "drives: [guide]")
    mechanism = load(text).mechanism
    assert (mechanism.drives, mechanism.quantity("guide")) == (("guide",), "length")
    assert mechanism.solve({"guide": 100})["B.x"] == pytest.approx(100)


def test_limits_and_measures(load):
    text = FOUR_BAR + (
        "  measures: {mu: {angle: [rod, rocker]}, gap: {distance: [O, B]}, lead: 'B.x - gap'}\n"
        "  limits: [{distance: [O, B], max: 12 cm}, {drive: crank, min: 0, max: 90},"
        " {measure: mu, min: 0, max: 1 rad}]\n"
    )
    description = load(text).mechanism.description
    assert description.measures["lead"].expression.names == {"B.x", "gap"}
    found = nominal(description)
    assert found["limits.0.max"] == 120.0
    assert found["limits.1.max"] == pytest.approx(math.pi / 2)
    assert found["limits.2.max"] == pytest.approx(1.0)
    assert description.limits[0].min is None


def test_units_of_the_study_apply(load):
    study = load(FOUR_BAR.replace("[O, A, 30]", "[O, A, 30 mm]"), "units.length=cm", "units.angle=rad")
    assert nominal(study.mechanism.description)["crank.length"] == pytest.approx(3.0)
    assert study.mechanism.description.angle_unit == 1.0


def test_a_whole_study_says_what_it_asks(load):
    study = load(FOUR_BAR + "kinematics:\nworkspace: {point: B}\nseed: 7\nname: Mine\n")
    assert (study.name, study.seed, study.questions) == ("Mine", 7, ("kinematics", "workspace"))
    assert study.resolved["units"]["length"] == "mm"


def test_the_seed_of_the_call_wins_even_when_it_is_zero(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text(FOUR_BAR + "seed: 7\n")
    assert mechdesign.load(path, seed=0).seed == 0


def test_a_measure_that_no_pose_can_have_is_a_mistake(load):
    measures = FOUR_BAR.replace("  sketch", "  measures: {m: B.x*(1/0)}\n  sketch")
    with pytest.raises(mechdesign.StudyError, match=r"5:17: mechanism.measures.m: division by zero in"):
        load(measures)
