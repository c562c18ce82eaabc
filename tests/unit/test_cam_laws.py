"""Laws of cams by segments, against the closed forms of textbooks (Norton, *Design of Machinery*; Rothbart, *Cams*)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import mechdesign

PI = np.pi
# Rise, velocity and acceleration of a unit move over a unit way.
FORMS = {
    "constant": (lambda u: u, lambda u: 0 * u + 1, lambda u: 0 * u),
    "harmonic": (
        lambda u: (1 - np.cos(PI * u)) / 2,
        lambda u: PI / 2 * np.sin(PI * u),
        lambda u: PI**2 / 2 * np.cos(PI * u),
    ),
    "double_harmonic": (
        lambda u: (1 - np.cos(PI * u)) / 2 - (1 - np.cos(2 * PI * u)) / 8,
        lambda u: PI / 2 * (np.sin(PI * u) - np.sin(2 * PI * u) / 2),
        lambda u: PI**2 / 2 * (np.cos(PI * u) - np.cos(2 * PI * u)),
    ),
    "cycloidal": (
        lambda u: u - np.sin(2 * PI * u) / (2 * PI),
        lambda u: 1 - np.cos(2 * PI * u),
        lambda u: 2 * PI * np.sin(2 * PI * u),
    ),
    "polynomial345": (
        lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5,
        lambda u: 30 * u**2 - 60 * u**3 + 30 * u**4,
        lambda u: 60 * u - 180 * u**2 + 120 * u**3,
    ),
    "polynomial4567": (
        lambda u: 35 * u**4 - 84 * u**5 + 70 * u**6 - 20 * u**7,
        lambda u: 140 * u**3 - 420 * u**4 + 420 * u**5 - 140 * u**6,
        lambda u: 420 * u**2 - 1680 * u**3 + 2100 * u**4 - 840 * u**5,
    ),
    "modified_sine": (
        lambda u: np.select([u < 1 / 8, u < 7 / 8], [
            PI * u / (4 + PI) - np.sin(4 * PI * u) / (4 * (4 + PI)),
            2 / (4 + PI) + PI * u / (4 + PI) - 9 * np.sin(4 * PI * u / 3 + PI / 3) / (4 * (4 + PI)),
        ], 4 / (4 + PI) + PI * u / (4 + PI) - np.sin(4 * PI * u) / (4 * (4 + PI))),
        lambda u: PI / (4 + PI) * (1 - np.where((u < 1 / 8) | (u >= 7 / 8), np.cos(4 * PI * u),
                                                3 * np.cos(4 * PI * u / 3 + PI / 3))),
        lambda u: 4 * PI**2 / (4 + PI) * np.where((u < 1 / 8) | (u >= 7 / 8), np.sin(4 * PI * u),
                                                  np.sin(4 * PI * u / 3 + PI / 3)),
    ),
    "trapezoidal": (
        lambda u: np.select([u < 1 / 3, u < 2 / 3], [9 / 4 * u**2, 3 / 2 * u - 1 / 4], 1 - 9 / 4 * (1 - u) ** 2),
        lambda u: np.select([u < 1 / 3, u < 2 / 3], [9 / 2 * u, 3 / 2 + 0 * u], 9 / 2 * (1 - u)),
        lambda u: np.select([u < 1 / 3, u < 2 / 3], [9 / 2 + 0 * u, 0 * u], -9 / 2),
    ),
}  # fmt: skip
BASE, H = 40.0, 30.0
# The follower rises over 110 deg, stands for 40, returns over 150 and stands for 60.
ENDS = np.array([0.0, 110.0, 150.0, 300.0, 360.0])
CAM = """
mechanism:
  parameters: {base: 40, h: 30, rise: 110}
  links:
    ground: {O: [0, 0]}
    disc: [O, N, 20]
    stem: {points: {F: [0, 0], T: [60, 0]}, mass: 2 kg}
  joints: {valve: {prismatic: [ground, stem], through: O, direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings:
    lift: {set: valve, of: cam, law: %(law)s%(cam)s}
  sketch: {N: [20, 0], F: [0, 40], T: [0, 100]}
kinematics:
  sweep: {cam: {from: %(begin)s, to: %(end)s, step: %(step)s}}
  rates: {cam: 1 rad/s}
  outputs: [F.y]
"""
SEGMENTS = (
    "[{to: base + h, over: rise, law: %s}, {dwell: 40 deg}, {to: base, over: 150, law: %s}, {dwell: 100 - rise + 70}]"
)


def study_of(law, cam=", cam: {link: disc, roller: F, radius: 8}", begin=0, end=360, step=7.5, more=""):
    return mechdesign.load(text=CAM % {"law": law, "cam": cam, "begin": begin, "end": end, "step": step} + more)


def lift(law, theta):
    """Place, velocity and acceleration of the follower (mm, for each rad) at angles of the cam (degrees)."""
    theta = np.mod(np.asarray(theta, dtype=float), 360.0)
    # The row at the end of a segment has what follows it.
    part = np.searchsorted(ENDS, theta + 1e-9, side="right") - 1
    u = np.clip((theta - ENDS[part]) / np.diff(ENDS)[part], 0.0, 1.0)
    span = np.radians(np.diff(ENDS)[part])
    rows = []
    for order, form in enumerate(FORMS[law]):
        back = form(1 - u) * (-1) ** order if law == "double_harmonic" else (order == 0) - form(u)
        values = np.select([part == 0, part == 1, part == 2], [form(u), (order == 0) + 0 * u, back], 0.0)
        rows.append(H * values / span**order + BASE * (order == 0))
    return rows


@pytest.mark.parametrize("law", FORMS)
def test_every_law_moves_the_follower_as_its_formula_says(law):
    motion = mechdesign.kinematics(study_of(SEGMENTS % (law, law), begin=-360, end=720, step=10)).tables["motion"]
    assert len(motion) == 109
    for name, values in zip(("F.y", "F.y_velocity", "F.y_acceleration"), lift(law, motion["cam"]), strict=True):
        assert motion[name] == pytest.approx(values, abs=1e-9), name


@pytest.mark.slow
@pytest.mark.parametrize("law", FORMS)
def test_extremes_between_the_rows_are_those_of_both_sides_of_a_corner(law):
    table = mechdesign.kinematics(study_of(SEGMENTS % (law, law), step=120)).tables["extremes"]
    rows = {row["output"]: row for row in table}
    fine = np.linspace(0, 1, 100_001)[:-1] + 1e-9
    theta = np.concatenate([a + (b - a) * fine for a, b in pairwise(ENDS)])
    # Just before the end of each segment, too.
    theta = np.concatenate([theta, ENDS[1:] - 1e-6])
    for name, values in zip(("F.y", "F.y_velocity", "F.y_acceleration"), lift(law, theta), strict=True):
        size = max(np.abs(values).max(), 1e-9)
        assert rows[name]["max"] == pytest.approx(values.max(), abs=3e-8 * size)
        assert rows[name]["min"] == pytest.approx(values.min(), abs=3e-8 * size)


@pytest.mark.slow
def test_the_profile_is_the_envelope_of_the_roller_at_a_step_that_is_set():
    answer = mechdesign.kinematics(
        study_of(SEGMENTS % ("cycloidal", "polynomial345"), ", cam: {link: disc, roller: F, radius: 8, step: 0.5}")
    )
    profile = answer.tables["cam"]
    assert profile["cam"] == pytest.approx(np.linspace(0, 360, 721), abs=1e-12)
    rise, fall = lift("cycloidal", profile["cam"]), lift("polynomial345", profile["cam"])
    s, slope, bend = (np.where(profile["cam"] < 150, one, other) for one, other in zip(rise, fall, strict=True))
    assert profile["valve.slide"] == pytest.approx(s, abs=1e-9)
    theta = np.radians(profile["cam"])
    ahead = 1j * np.exp(-1j * theta)
    centre, tangent = s * ahead, (slope - 1j * s) * ahead
    place = centre - 8 * 1j * tangent / np.abs(tangent)
    assert profile["x"] + 1j * profile["y"] == pytest.approx(place, abs=1e-9)
    assert profile["pressure_angle"] == pytest.approx(np.degrees(np.arctan2(slope, s)), abs=1e-9)
    radius = (s**2 + slope**2) ** 1.5 / (s**2 + 2 * slope**2 - s * bend) - 8
    assert profile["curvature_radius"] == pytest.approx(radius, rel=1e-9)


@pytest.mark.slow
def test_the_torque_of_the_cam_is_that_of_the_follower_s_mass_and_load():
    more = "dynamics: {loads: [{at: F, force: [0, -100]}]}\n"
    table = mechdesign.dynamics(study_of(SEGMENTS % ("modified_sine", "harmonic"), more=more)).tables["dynamics"]
    rise, fall = lift("modified_sine", table["cam"]), lift("harmonic", table["cam"])
    _, v, a = (np.where(table["cam"] < 150, one, other) for one, other in zip(rise, fall, strict=True))
    # 2 kg that move with a (mm/s^2) and 100 N, by the rate v (mm for each radian): N*mm.
    assert table["cam_effort"] == pytest.approx((2 * a / 1000 + 100) * v, abs=1e-8)


@pytest.mark.nightly
def test_laws_follow_parameters_as_studies_with_other_numbers_do():
    text = SEGMENTS % ("cycloidal", "polynomial345")
    goals = """
optimize:
  variables: {h: {from: 20, to: 30, step: 10}, rise: {from: 90, to: 110, step: 20}}
  minimize: kinematics.lift_pressure_angle.peak
"""
    designs = mechdesign.optimize(study_of(text, more=goals)).tables["designs"]
    for row in designs:
        study = mechdesign.load(
            text=CAM
            % {"law": text, "cam": ", cam: {link: disc, roller: F, radius: 8}", "begin": 0, "end": 360, "step": 7.5},
            overrides={"mechanism.parameters.h": row["h"], "mechanism.parameters.rise": row["rise"]},
        )
        extremes = {one["output"]: one for one in mechdesign.kinematics(study).tables["extremes"]}[
            "lift_pressure_angle"
        ]
        peak = max(-extremes["min"], extremes["max"])
        assert row["kinematics.lift_pressure_angle.peak"] == pytest.approx(peak, abs=1e-9)


def test_a_late_end_of_the_rise_is_an_error_of_the_lift():
    more = """
reliability:
  poses: [{cam: 50}]
  outputs: [F.y]
  dimensions: {rise: 0.5, h: 0.1}
  methods: [analytic]
"""
    table = mechdesign.reliability(study_of(SEGMENTS % ("polynomial345", "cycloidal"), more=more)).tables["moments"]
    place, slope, _ = FORMS["polynomial345"]
    u = 50 / 110
    late, high = H * slope(u) * u / 110 * 0.5, place(u) * 0.1
    assert table["sigma"][0] == pytest.approx(np.hypot(late, high) / 3, rel=1e-9)


def test_a_wedge_repeats_its_law_over_its_length_and_one_with_a_begin_stands_beyond_it():
    wedge = """
mechanism:
  links: {ground: {O: [0, 0], G: [0, 90]}, wedge: {W: [0, 0], E: [100, 0]}, stem: {F: [0, 0], T: [60, 0]}}
  joints:
    way: {prismatic: [ground, wedge], through: O, point: W}
    valve: {prismatic: [ground, stem], through: G, direction: 90, point: F}
  drives: {x: {slide: way}}
  couplings: {lift: {set: valve, of: x, law: %s}}
  sketch: {W: [0, 0], E: [100, 0], F: [0, -50], T: [0, 10]}
kinematics: {sweep: {x: {from: -50, to: 250, step: 12.5}}, outputs: [F.y]}
"""
    again = "[{to: -40, over: 60, law: harmonic}, {dwell: 20}, {to: -60, over: 20, law: constant}]"
    once = again.replace("[{to", "[{from: -60, to").replace("to: -60, over", "to: -55, over")
    for law, repeats, last in ((again, True, -60), (once, False, -55)):
        motion = mechdesign.kinematics(mechdesign.load(text=wedge % law)).tables["motion"]
        x = np.mod(motion["x"], 100) if repeats else np.clip(motion["x"], 0, 100)
        rise = -60 + 20 * FORMS["harmonic"][0](x / 60)
        values = np.select([x < 60, x < 80], [rise, -40.0], -40 + (last + 40) * (x - 80) / 20)
        assert motion["F.y"] == pytest.approx(90 + values, abs=1e-9)


def refused(law, cam=", cam: {link: disc, roller: F, radius: 8}"):
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(law, cam)
    return str(caught.value)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("[{to: 70, over: 120}, {to: 40, over: 230}]", "sum to 350 deg, and a turn has 360: a dwell of 10 is missing"),
        ("[{to: 70, over: 180}, {to: 40, over: 190}]", "sum to 370 deg, and a turn has 360: 10 are too many"),
        ("[{to: 70, over: 360}]", "without 'from' it is a cycle that begins where it ends, and so needs two moves"),
        ("[{to: 70, over: 180}, {from: 0, to: 40, over: 180}]", "segment 2 begins where the one before it ends"),
        ("[{to: 70}, {to: 40, over: 180}]", "the move to 70 needs an angle or a length: {to: 70, over: 90}"),
        ("[{to: 70, over: 180}, {dwell: 60, law: harmonic}]", "a dwell has no 'law'"),
        ("[{to: 70, over: 180, law: cycloid}, {to: 40, over: 180}]", "did you mean 'cycloidal'"),
        ("[{to: 70, over: -180}, {to: 40, over: 180}]", "must be positive, not -180"),
        ("[{to: 70 deg, over: 180}, {to: 40, over: 180}]", "'70 deg' is an angle"),
        ("[{to: 70, over: 18 mm}, {to: 40, over: 180}]", "'18 mm' is a length"),
        ("[]", "an empty law; give its segments"),
        ("lift.csv", "lift.csv"),
    ],
)
def test_mistakes_in_a_law_are_named(law, words):
    assert words in refused(law)


def test_a_profile_has_steps_or_a_step_and_a_cam_with_two_lobes_is_one():
    lobes = "[{to: 60, over: 90}, {to: 40, over: 90}]"
    assert "'steps' is how many there are, 'step' how long each is: give one" in refused(
        lobes, ", cam: {link: disc, roller: F, radius: 8, step: 1, steps: 90}"
    )
    assert "makes 3 steps of the range; 8 to 100000 are possible" in refused(
        lobes, ", cam: {link: disc, roller: F, radius: 8, step: 120}"
    )
    answer = mechdesign.kinematics(study_of(lobes, ", cam: {link: disc, roller: F, radius: 8, step: 7 deg}"))
    assert answer.tables["cam"]["cam"] == pytest.approx(np.linspace(0, 360, 53))
    assert not [str(warning) for warning in answer.warnings if "does not close" in str(warning)]


def test_a_law_of_no_turn_is_doubted_unless_its_cam_is_a_part_of_one():
    law = "[{to: 70, over: 120}, {to: 40, over: 230}]"
    words = " ".join(map(str, study_of(law, "").warnings))
    assert "sum to 350 deg, and a turn has 360: a dwell of 10 is missing" in words
    for plain in (SEGMENTS % ("cycloidal", "cycloidal"), "[{to: 70, over: 300}, {to: 40, over: 420}]"):
        assert "turn" not in " ".join(map(str, study_of(plain, "").warnings))
    part = ", cam: {link: disc, roller: F, radius: 8, range: [0, 350]}"
    assert "turn" not in " ".join(map(str, study_of(law, part, end=350).warnings))
