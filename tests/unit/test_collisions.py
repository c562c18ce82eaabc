"""Clearances between plates over a motion, against hulls of differences and against searches of the tests' own."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.drawings import distance
from helpers.pictures import figure_of
from scipy.optimize import minimize_scalar

import mechdesign
from mechdesign.door.report.page.headlines import headlines
from mechdesign.drawing import style

FOUR_BAR = """
mechanism:
  parameters: {w: 10}
  links:
    ground: {points: {O: [0, 0], D: [60, 0]}}
    crank: {from: O, to: A, length: 30}
    coupler: {from: A, to: B, length: 70}
    rocker: {from: D, to: B, length: 60}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [55, 60]}
  plates: {width: w, pin: 4}
kinematics:
  sweep: {theta: {from: 90, to: 300, step: 30}}
  collisions: [[crank, rocker]]
"""


def clearance(theta, width=10.0):
    """Of crank and rocker of the four-bar, by its closed form."""
    a = 30 * np.exp(1j * np.radians(theta))
    along = 60 - a
    share = (70**2 - 60**2 + abs(along) ** 2) / (2 * abs(along) ** 2)
    height = np.sqrt(70**2 - (share * abs(along)) ** 2) / abs(along)
    b = a + along * (share + 1j * height)
    return distance([0j, a], [60 + 0j, b]) - width


def test_the_smallest_clearance_is_found_between_the_poses():
    result = mechdesign.kinematics(mechdesign.load(text=FOUR_BAR))
    motion, extremes = result.tables["motion"], result.tables["extremes"]
    assert motion["crank.rocker.clearance"] == pytest.approx([clearance(theta) for theta in motion["theta"]], abs=1e-9)
    np.testing.assert_array_equal(motion["clearance"], motion["crank.rocker.clearance"])
    row = list(extremes["output"]).index("crank.rocker.clearance")
    angles = np.linspace(90, 300, 421)
    near = angles[np.argmin([clearance(theta) for theta in angles])]
    best = minimize_scalar(clearance, bounds=(near - 1, near + 1), method="bounded", options={"xatol": 1e-10})
    assert extremes["min"][row] == pytest.approx(best.fun, abs=1e-9)
    assert extremes["min_at"][row] == pytest.approx(best.x, abs=1e-4)
    assert best.fun < motion["crank.rocker.clearance"].min() - 0.01


def test_clearances_are_goals_and_conditions_of_designs():
    study = mechdesign.load(
        text=FOUR_BAR
        + """
optimize:
  variables: {w: {choices: [8, 10, 12, 14]}, coupler.length: {choices: [66, 70]}}
  maximize: kinematics.clearance.min
  subject_to: [{result: kinematics.crank.rocker.clearance.min, at_least: 25}]
"""
    )
    designs = mechdesign.optimize(study).tables["designs"]
    values = designs["kinematics.clearance.min"]
    alone = [
        mechdesign.kinematics(mechdesign.load(text=FOUR_BAR, overrides={"mechanism.parameters.w": w})) for w in (8, 14)
    ]
    least = [min(result.tables["extremes"]["min"][-1:]) for result in alone]
    long = designs["coupler.length"] == 70
    assert values[long][[0, -1]] == pytest.approx(least, abs=1e-9)
    assert np.diff(values[long]) == pytest.approx([-2, -2, -2], abs=1e-9)
    np.testing.assert_array_equal(designs["feasible"], values >= 25)


def test_pins_meet_what_lies_between_the_links_that_they_join():
    links = ("ground", "crank", "coupler", "rocker")
    layers = {f"mechanism.links.{link}.layer": layer for layer, link in enumerate(links, start=1)}
    study = mechdesign.load(text=FOUR_BAR, overrides={**layers, "kinematics.collisions": True})
    motion = mechdesign.kinematics(study).tables["motion"]
    # The rocker's pin in the frame passes the layers of crank and coupler; those at A and B join neighbours.
    assert [name for name in motion.names if name.endswith("clearance")] == [
        "D.crank.clearance", "D.coupler.clearance", "clearance",
    ]  # fmt: skip
    ends = 30 * np.exp(1j * np.radians(motion["theta"]))
    expected = [distance([60 + 0j], [0j, end]) - 5 - 2 for end in ends]
    assert motion["D.crank.clearance"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([["crank", "coupler"]], "'crank' and 'coupler' are joined at A"),
        ([["crank", "crank"]], "'crank' has a clearance with another link, not with itself"),
        ([], "name pairs of links"),
    ],
)
def test_wrong_pairs_are_refused(pairs, words):
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=FOUR_BAR, overrides={"kinematics.collisions": pairs})


def test_all_pairs_of_which_none_is_left_are_refused():
    arm = "mechanism: {links: {ground: {O: [0, 0]}, arm: [O, A, 9]}, drives: [arm], plates: {width: 2}, "
    with pytest.raises(mechdesign.StudyError, match="nothing is left to compare"):
        mechdesign.load(text=arm + "sketch: {A: [9, 0]}}", overrides={"kinematics.collisions": True})


def test_clearances_need_plates():
    with pytest.raises(mechdesign.StudyError, match=r"give mechanism.plates, such as {width: 20}"):
        mechdesign.load(text=FOUR_BAR.replace("  plates: {width: w, pin: 4}\n", ""))


# Crank and rocker overlap most between two poses of the sweep.
WIDE = {"mechanism.parameters.w": 45}
REQUIRED = FOUR_BAR + "requirements: [{result: kinematics.clearance, at_least: 1 mm}]\n"


def least():
    """Least clearance of plates so wide, and the angle there."""
    angles = np.linspace(90, 300, 421)
    near = angles[np.argmin([clearance(theta) for theta in angles])]
    best = minimize_scalar(clearance, bounds=(near - 1, near + 1), method="bounded", options={"xatol": 1e-10})
    return best.fun + 10 - 45, best.x


def crashed():
    study = mechdesign.load(text=REQUIRED, overrides=WIDE)
    return study, mechdesign.kinematics(study)


def test_a_collision_is_a_warning_with_its_depth_and_its_pose():
    depth, angle = least()
    (warning,) = (warning for warning in crashed()[1].warnings if warning.kind == "collision")
    assert str(warning) == f"crank and rocker overlap by {-depth:.4g} mm at theta = {angle:.4g} deg"
    apart = mechdesign.kinematics(mechdesign.load(text=FOUR_BAR))
    assert "collision" not in [warning.kind for warning in apart.warnings]


def test_the_verdict_on_a_collision_names_the_pose_and_the_depth():
    depth, angle = least()
    (verdict,) = crashed()[1].verdicts
    assert not verdict.met
    assert verdict.worst == pytest.approx(depth, abs=1e-9)
    assert verdict.place.startswith(f"theta {angle:.4f}"[:-2])
    assert verdict.note == f"an overlap of {-depth:.6g} mm"


def test_the_first_key_number_is_the_least_clearance():
    depth, _ = least()
    first, *others = headlines(crashed()[1])
    assert first.label == "least clearance, crank and rocker"
    assert float(first.value.replace("\N{MINUS SIGN}", "-")) == pytest.approx(depth, rel=1e-3)
    assert "theta" in first.at
    assert not [number.label for number in others if "clearance" in number.label]


@pytest.mark.slow
@pytest.mark.parametrize("look", ["screen", "paper"])
def test_plates_are_drawn_where_they_overlap_most_with_the_overlap_marked(look):
    depth, _ = least()
    study, result = crashed()
    with style.context(look):
        axes = figure_of(study, result, "collisions").axes[0]
    title = axes.get_title("left").replace("\n", " ")
    assert f"crank and rocker overlap by {-depth:.3g} mm at theta = " in title
    (overlap,) = (patch for patch in axes.patches if patch.get_label() == "overlap")
    places = overlap.get_xy() @ [1, 1j]
    # Two round ends: the overlap is a lens as thick as it is deep.
    thickness = min(np.ptp((places * np.exp(1j * turn)).real) for turn in np.linspace(0, np.pi, 181))
    assert thickness == pytest.approx(-depth, rel=0.02)


@pytest.mark.slow
def test_plates_that_do_not_meet_are_drawn_where_they_are_nearest():
    study = mechdesign.load(text=FOUR_BAR)
    result = mechdesign.kinematics(study)
    with style.context():
        axes = figure_of(study, result, "collisions").axes[0]
    (way,) = (line for line in axes.lines if line.get_label() == "least clearance")
    least = result.tables["extremes"]["min"][-1]
    assert abs(np.diff(way.get_xydata() @ [1, 1j])[0]) == pytest.approx(least, rel=0.01)
