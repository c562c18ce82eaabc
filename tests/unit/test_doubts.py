"""Slips of units, places and sizes that can be computed all the same are warned of; what is right is not."""

import math
from pathlib import Path

import pytest

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
FOUR_BAR = """
units: {angle: deg}
mechanism:
  parameters: {r: 30}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, r], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {sweep: {theta: {from: 0, to: 360, number: 7}}}
reliability: {dimensions: {r: 0.1, "*.length": 0.05}, poses: [{theta: 30}]}
"""


def doubts(*changes, text=FOUR_BAR):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return [(warning.key, warning.message) for warning in mechdesign.load(text=text).warnings]


def test_a_study_without_a_slip_has_no_warning():
    assert doubts() == []


ARMS = """
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: [O, A, 210], fore: [A, P, 130], motor: [O, M, 20]}}
  drives: [arm, motor]
  couplings: {{belt: {{set: fore, {}}}}}
  sketch: {{A: [200, 60], P: [180, 190], M: [10, 15]}}
"""


def test_a_belt_that_no_pulleys_make():
    ((key, message),) = doubts(text=ARMS.format("of: motor, ratio: 0.5, phase: 100, wheels: belt, radius: 18"))
    assert key == "mechanism.couplings.belt.wheels"
    assert "link 'arm', which carries their axes, turns too; write {to: 0.5*motor + 0.5*arm + 100}" in message
    assert not doubts(text=ARMS.format("to: 0.5*motor + 0.5*arm + 100, wheels: belt, radius: 18"))
    ((key, message),) = doubts(text=ARMS.format("to: 30*sin(motor), pressure_angle: 18"))
    assert "no wheels can make coupling 'belt', and their forces are left out: wheels turn about pins" in message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("unit", "start", "end", "meant"),
    [
        ("deg", "0", "6.283", "rad"),
        ("deg", "0", "2*pi", "rad"),
        ("deg", "-3.14", "0", "rad"),
        ("deg", "10", str(10 + math.tau), "rad"),
        ("rad", "0", "360", "deg"),
        ("rad", "-90", "90", "deg"),
        ("deg", "0", "6", ""),
        ("deg", "0", "11", ""),
        ("deg", "0", "6.283 deg", ""),
        ("deg", "0", "6.283 rad", ""),
        ("rad", "0", "6.283", ""),
        ("rad", "0", "12*pi", ""),
        ("rad", "0", "360 deg", ""),
    ],
)
def test_a_sweep_in_the_other_unit_of_angle(unit, start, end, meant):
    found = doubts(("angle: deg", f"angle: {unit}"), ("from: 0, to: 360", f"from: {start}, to: {end}"))
    if unit == "rad":
        found = [each for each in found if each[0].startswith("kinematics")]
    assert [key for key, _ in found] == ["kinematics.sweep.theta"] * bool(meant)
    assert all(f"if {meant} is meant" in message for _, message in found)


def test_a_pose_in_the_other_unit_of_angle():
    assert [key for key, _ in doubts(("theta: 30}", "theta: 1.5708}"))] == ["reliability.poses.0.theta"]


@pytest.mark.parametrize(
    ("lower", "upper", "warned"),
    [
        ("[O, A, 30]", "[A, B, 90000]", True),
        ("[O, A, 90]", "[A, B, 90 m]", True),
        ("[O, A, 0.09]", "[A, B, 90]", True),
        ("[O, A, 30]", "{A: [0, 0], B: [90, 0], P: [0.01, 90000]}", True),
        ("[O, A, 30]", "{A: [0, 0], B: [90, 0], P: [0.01, 0.01]}", False),
        ("[O, A, 0.3]", "[A, B, 90]", False),
    ],
)
def test_lengths_a_thousand_times_apart(lower, upper, warned):
    text = f"mechanism: {{links: {{ground: {{O: [0, 0]}}, lower: {lower}, upper: {upper}}}, drives: [lower, upper]}}"
    assert ["a thousand times apart" in message for _, message in doubts(text=text)] == [True] * warned


def test_pivots_of_the_ground_at_one_place():
    text = """
mechanism:
  links: {ground: {O: [10, 5], D: %s, Q: [10, 5]}, crank: [O, A, 30], rocker: [D, B, 60]}
  drives: [crank, rocker]
"""
    ((key, message),) = doubts(text=text % "[10, 5]")
    assert (key, "'O' and 'D' are at one place" in message) == ("mechanism.links.ground", True)
    assert doubts(text=text % "[11, 5]") == []


@pytest.mark.parametrize(
    ("dimensions", "keys"),
    [
        ("{rod.length: 91}", ["rod.length"]),
        ("{r: [-31, 1]}", ["r"]),
        ("{r: {sigma: 40}}", ["r"]),
        ("{rod.length: 89, ground.D.x: 200, theta: 50}", []),
    ],
)
def test_a_tolerance_that_is_larger_than_its_length(dimensions, keys):
    found = doubts(('{r: 0.1, "*.length": 0.05}', dimensions))
    assert [key for key, _ in found] == [f"reliability.dimensions.{key}" for key in keys]


def test_a_drive_that_is_named_after_the_ground():
    ((key, _),) = doubts(("{theta: {angle: crank}}", "{Ground: {angle: crank}}"), ("{theta:", "{Ground:"))
    assert key == "mechanism.drives.Ground"
    with pytest.raises(mechdesign.StudyError, match="the ground never moves"):
        doubts(("{theta: {angle: crank}}", "[ground]"))


@pytest.mark.parametrize(("old", "new"), [("r: 0.1", "r: 1 %"), ("number: 7}", "number: 7%}"), ("r: 30", "r: 30%")])
def test_per_cent_is_no_unit(old, new):
    with pytest.raises(mechdesign.StudyError, match="is in per cent"):
        doubts((old, new))


@pytest.mark.slow
def test_no_shipped_study_is_doubted():
    files = [*CONFIGS.glob("*.yaml"), *(CONFIGS / "gallery").glob("*.yaml")]
    assert files
    assert {file.name: mechdesign.load(file).warnings for file in files} == {file.name: () for file in files}


PLANETARY = """
units: {{length: mm}}
mechanism:
  parameters: {{zs: {sun}, zp: {planet}, zr: {ring}}}
  links:
    ground: {{O: [0, 0]}}
    sun: [O, S, 12]
    arm: [O, A, (zs + zp)/2]
    planet: [A, P, 12]
  drives: [sun]
  couplings:
    sun_mesh: {{set: planet, to: arm.angle - zs/zp*(sun.angle - arm.angle)}}
    ring_mesh: {{set: planet, to: arm.angle - zr/zp*arm.angle{wheels}}}
  sketch: {{S: [0, 12], A: [27.7, 11.5], P: [36.2, 3]}}
"""


def test_a_planet_that_needs_two_pitch_radii_is_refused_with_both() -> None:
    """The planet's radius is e zp/(zs + zp) at its sun and e zp/(zr - zp) at its ring, e the distance of the axes."""
    for sun, planet, ring in ((20, 30, 70), (24, 18, 50)):
        with pytest.raises(mechdesign.StudyError) as refused:
            mechdesign.load(text=PLANETARY.format(sun=sun, planet=planet, ring=ring, wheels=""))
        apart = (sun + planet) / 2
        for number in (apart * planet / (sun + planet), apart * planet / (ring - planet), apart):
            assert f"{number:.6g} mm" in str(refused.value)
        assert not mechdesign.load(
            text=PLANETARY.format(sun=sun, planet=planet, ring=ring, wheels=", wheels: none")
        ).warnings
        assert not mechdesign.load(
            text=PLANETARY.format(sun=sun, planet=planet, ring=sun + 2 * planet, wheels="")
        ).warnings


def test_pitch_radii_that_a_profile_shift_makes_one_are_only_suspect() -> None:
    (doubt,) = mechdesign.load(text=PLANETARY.format(sun=20, planet=30, ring=81, wheels="")).warnings
    assert "14.7059 mm" in str(doubt)
