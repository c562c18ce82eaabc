"""Instant centres and mechanical advantages against closed forms."""

import numpy as np
import pytest
from helpers.gallery import result_of
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics:
  sweep: {theta: {from: 7, to: 353, step: 8.65}}
  outputs: [A, B, rod.angle, rocker.angle]
"""
SLIDER = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: [crank]
  sketch: {A: [0, 40], B: [113, 0]}
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 10}}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 3], lower: [E, P, 2]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [2, 2], P: [4, 2]}
kinematics:
  poses: [{q1: 30, q2: 40}, {q1: 80, q2: -60}]
"""


def table_of(text, *overrides):
    return mechdesign.kinematics(study_of(text, *overrides)).tables["instant_centres"]


def centre(table, pair):
    return table[f"{pair}.x"] + 1j * table[f"{pair}.y"]


def crossing(a, b, c, d):
    """Where the line from a to b crosses that from c to d."""
    one, two = b - a, d - c
    return a + one * np.imag(np.conj(c - a) * two) / np.imag(np.conj(one) * two)


def test_the_centres_of_a_four_bar_are_its_pins_and_the_crossings_of_its_links():
    pairs = "[[rod, ground], [crank, rocker], [crank, rod], [rocker, rod], [ground, crank], [rocker, ground]]"
    study = study_of(FOUR_BAR, f"kinematics.instant_centres={pairs}")
    result = mechdesign.kinematics(study)
    table, motion = result.tables["instant_centres"], result.tables["motion"]
    a, b = (motion[f"{p}.x"] + 1j * motion[f"{p}.y"] for p in "AB")
    np.testing.assert_allclose(centre(table, "rod.ground"), crossing(0j, a, 100 + 0j, b), rtol=1e-9)
    np.testing.assert_allclose(centre(table, "crank.rocker"), crossing(0j, 100 + 0j, a, b), rtol=1e-9, atol=1e-7)
    np.testing.assert_array_equal(centre(table, "crank.rod"), a)
    np.testing.assert_array_equal(centre(table, "rocker.rod"), b)
    np.testing.assert_array_equal(centre(table, "ground.crank"), 0 * a)
    assert set(table["rod.ground.motion"]) == {"rotation"}
    # Kennedy: three links have their three centres on one line.
    three = [centre(table, pair) for pair in ("rod.ground", "crank.rod", "ground.crank")]
    flat = np.imag(np.conj(three[1] - three[2]) * (three[0] - three[2])) / np.abs(three[0] - three[2])
    np.testing.assert_allclose(flat, 0, atol=1e-8)


def test_links_that_translate_have_their_centre_at_infinity_and_it_is_told():
    pairs = "[[slider, ground], [rod, ground], [crank, slider]]"
    result = mechdesign.kinematics(study_of(SLIDER, f"kinematics.instant_centres={pairs}"))
    table = result.tables["instant_centres"]
    dead = [0, 18, 36]
    assert np.isinf(np.delete(table["slider.ground.x"], dead)).all()
    assert set(np.delete(table["slider.ground.motion"], dead)) == {"translation"}
    # At a dead centre the slider stands still.
    assert list(table["slider.ground.motion"][dead]) == ["rest"] * 3
    assert np.isnan(table["slider.ground.x"][dead]).all()
    # With the crank upright the rod translates: B moves as A does.
    assert list(table["rod.ground.motion"][[9, 27]]) == ["translation"] * 2
    told = [warning for warning in map(str, result.warnings) if "at infinity" in warning]
    assert [warning.split(":")[1].split(" poses")[0] for warning in told] == [" in 34 of 37", " in 2 of 37"]
    # The crank and a slider along x have theirs on the normal of the guide through the crank's pivot.
    angle = np.radians(table["crank"])
    inclined = np.arcsin(40 * np.sin(angle) / 120)
    height = 40 * np.sin(angle) + 40 * np.cos(angle) * np.tan(inclined)
    np.testing.assert_allclose(centre(table, "crank.slider"), 1j * height, atol=1e-9)


def test_the_fixed_centrode_of_a_trammel_is_cardans_circle():
    table = result_of("trammel").tables["instant_centres"]
    angle = np.radians(table["bar"])
    np.testing.assert_allclose(centre(table, "bar.ground"), 60 * (-np.cos(angle) + 1j * np.sin(angle)), atol=1e-9)


def test_with_several_drives_centres_follow_from_their_rates():
    rates = "kinematics.rates={q1: 2 rad/s, q2: 3 rad/s}"
    result = mechdesign.kinematics(study_of(ARM, rates, "kinematics.instant_centres=[[lower, ground]]"))
    # w_1 z(E) = w_2 (z(E) - z): the centre divides O E as the angular velocities do.
    elbow = 3 * np.exp(1j * np.radians([30, 80]))
    np.testing.assert_allclose(centre(result.tables["instant_centres"], "lower.ground"), elbow * (1 - 2 / 5))
    with pytest.raises(mechdesign.StudyError, match="give 'rates' or a 'speed'"):
        study_of(ARM, "kinematics.instant_centres=[[lower, ground]]")


@pytest.mark.parametrize(("given", "message"), [
    ("instant_centres=[[rod, rod]]", "not with itself"),
    ("instant_centres=[[rod, ground], [ground, rod]]", "listed twice"),
    ("instant_centres=[[rods, ground]]", "did you mean 'rod'"),
    ("mechanical_advantage={B: theta}", "its coordinates are B.x and B.y"),
    ("mechanical_advantage={B.x: B.x}", "is not moved by"),
])  # fmt: skip
def test_what_is_no_pair_and_no_output_is_told(given, message):
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(FOUR_BAR, f"kinematics.{given}")


def test_the_mechanical_advantage_of_a_slider_crank():
    table = mechdesign.kinematics(study_of(SLIDER, "kinematics.mechanical_advantage={B.x: crank}")).tables["motion"]
    angle = np.radians(table["crank"])
    sine, cosine = np.sin(angle), np.cos(angle)
    rate = -40 * sine * (1 + 40 * cosine / np.sqrt(120**2 - (40 * sine) ** 2))
    inside = np.abs(sine) > 1e-9
    np.testing.assert_allclose(table["B.x_advantage"][inside], 1 / rate[inside], rtol=1e-10)
    assert np.isinf(table["B.x_advantage"][~inside]).all()
    assert table.column("B.x_advantage").unit == "1/mm"


def test_the_mechanical_advantage_of_a_lever_and_of_a_toggle():
    lever = """
mechanism:
  links: {ground: {O: [0, 0]}, beam: {O: [0, 0], A: [-50, 0], B: [10, 0]}}
  drives: [beam]
  sketch: {A: [-50, 0], B: [10, 0]}
kinematics: {poses: [{beam: 0}, {beam: 20}], mechanical_advantage: {B.y: A.y, beam.angle: A.y}}
"""
    table = mechdesign.kinematics(study_of(lever.replace("beam.angle: A.y", ""))).tables["motion"]
    np.testing.assert_allclose(table["B.y_advantage"], -5)
    # A knee of two equal links, pushed at A towards its straight position, presses B with 1/(2 tan) of the force.
    knee = SLIDER.replace("120", "40").replace("[113, 0]", "[56, 0]").replace("A: [0, 40]", "A: [28, 28]")
    knee = knee.replace("from: 0, to: 360", "from: 10, to: 80")
    table = mechdesign.kinematics(study_of(knee, "kinematics.mechanical_advantage={B.x: A.y}")).tables["motion"]
    np.testing.assert_allclose(table["B.x_advantage"], -1 / (2 * np.tan(np.radians(table["crank"]))), rtol=1e-12)


def test_advantage_and_effort_are_one_virtual_work():
    table = result_of("toggle_clamp").tables["motion"]
    np.testing.assert_allclose(table["grip_effort"] * table["T.y_advantage"], -100, rtol=1e-9)
