"""Cams of couplings: profile, pressure angle, curvature and contact force against closed forms and own code."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

SLIDING = """
mechanism:
  parameters: {base: 30, r: 8, e: 0}
  links:
    ground: {O: [0, 0], G: [e, 0]}
    disc: [O, N, 40]
    follower: {F: [0, 0], T: [60, 0]}
  joints: {valve: {prismatic: [ground, follower], through: G, direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: valve, %s}}
  sketch: {N: [40, 0], F: [0, 40], T: [0, 100]}
kinematics: {sweep: {cam: {from: 0, to: 360, step: 10}}, outputs: [F.y]}
"""
HARMONIC = "to: base + 10 - 10*cos(cam), cam: {link: disc, %s}"
ROLLER = SLIDING % (HARMONIC % "roller: F, radius: r")
TURN = np.radians(np.arange(361.0))


def cam_of(study: mechdesign.Study) -> mechdesign.Table:
    return mechdesign.kinematics(study).tables["cam"]


def warnings_of(study: mechdesign.Study) -> list[str]:
    return [str(warning) for warning in mechdesign.kinematics(study).warnings if warning.kind == "cam"]


def placed(table: mechdesign.Table) -> np.ndarray:
    return np.asarray(table["x"] + 1j * table["y"])


def clearances(profile: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Smallest distance of each place from the sides of a polygon."""
    begin, way = profile[:-1], np.diff(profile)
    part = np.clip(((centers[:, None] - begin) * np.conj(way)).real / np.abs(way) ** 2, 0, 1)
    return np.asarray(np.abs(centers[:, None] - begin - part * way).min(axis=1))


@pytest.mark.parametrize(
    ("cam", "message"),
    [
        ("{link: disc}", "one of roller: point, flat: point"),
        ("{link: disc, roller: F}", "a roller has a 'radius'"),
        ("{link: disc, flat: F, radius: 3}", "a flat follower has no 'radius'"),
        ("{link: disc, roller: F, radius: 3, direction: 4}", "a roller follower has no 'direction'"),
        ("{link: disc, flat: F, side: groove}", "runs in no groove"),
        ("{link: disc, flat: [F, T], direction: 4}", "leave 'direction' out"),
        ("{link: disc, roller: N, radius: 3}", "point 'N' is on the cam 'disc' itself"),
        ("{link: disk, roller: F, radius: 3}", "there is no link 'disk'"),
        ("{link: disc, roller: F, radius: 3, range: [90, 0]}", "rises from its first value"),
        ("{link: disc, roller: F, radius: 3, range: [0 mm, 9 mm]}", "'0 mm' is a length"),
        ("{link: disc, roller: F, radius: 3, steps: 2}", "must be at least 8, not 2"),
        ("{link: disc, roller: O, radius: 3}", "'valve.slide' does not move the roller at 'O'"),
        ("{link: disc, flat: F, direction: 0}", "moves the flat face at 'F' along itself"),
    ],
)
def test_mistakes_are_named(cam: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(SLIDING % f"to: 40 + cam, cam: {cam}")
    assert message in str(caught.value)


def test_a_cam_that_two_drives_turn_has_no_profile() -> None:
    text = ROLLER.replace("[ground, follower], through: G", "[table, follower], through: G").replace("G: [e, 0]}", "}")
    text = text.replace("disc: [O, N, 40]", "disc: [O, N, 40]\n    table: {G: [0, 0]}")
    text = text.replace("joints: {", "joints: {way: {prismatic: [ground, table], through: O, point: G}, ")
    text = text.replace("drives: {", "drives: {x: {slide: way}, ").replace("sketch: {", "sketch: {G: [0, 0], ")
    with pytest.raises(
        mechdesign.StudyError, match="drive 'x' moves the follower against the cam too, not 'cam' alone"
    ):
        study_of(text)


@pytest.mark.parametrize("offset", [0.0, 12.0])
def test_a_roller_on_a_slide_has_the_pressure_angle_and_curvature_of_textbooks(offset: float) -> None:
    """With d = sqrt(rb^2 - e^2) in the law already: tan(phi) = (s' - e)/s, and the curvature of the pitch curve."""
    table = cam_of(study_of(ROLLER.replace("e: 0", f"e: {offset}")))
    s, slope, bend = 40 - 10 * np.cos(TURN), 10 * np.sin(TURN), 10 * np.cos(TURN)
    pitch = (offset + 1j * s) * np.exp(-1j * TURN)
    first = (1j * slope - 1j * (offset + 1j * s)) * np.exp(-1j * TURN)
    second = (1j * bend + 2 * slope - (offset + 1j * s)) * np.exp(-1j * TURN)
    curvature = -(np.conj(first) * second).imag / np.abs(first) ** 3
    inward = -1j * first / np.abs(first)
    np.testing.assert_allclose(placed(table), pitch + 8 * inward, atol=1e-12)
    np.testing.assert_allclose(np.tan(np.radians(table["pressure_angle"])), (slope - offset) / s, atol=1e-13)
    np.testing.assert_allclose(table["curvature_radius"], 1 / curvature - 8, rtol=1e-12)
    assert np.isnan(table["face"]).all()


def test_a_harmonic_rise_is_steepest_where_its_sine_says() -> None:
    """A rise of 2 in from a prime circle of 2 in: tan(phi) = sin(t)/(3 - cos(t)), at most asin(1/3) at acos(1/3)."""
    text = ROLLER.replace("base + 10 - 10*cos(cam)", "3 - cos(cam)").replace("r: 8", "r: 0.375").replace("40]", "2]")
    extremes = mechdesign.kinematics(study_of(text)).tables["extremes"]
    row = extremes["output"].tolist().index("lift_pressure_angle")
    assert extremes["max"][row] == pytest.approx(np.degrees(np.arcsin(1 / 3)), rel=1e-10)
    assert extremes["max_at"][row] == pytest.approx(np.degrees(np.arccos(1 / 3)), rel=1e-6)


def test_a_flat_follower_in_harmonic_motion_runs_on_an_eccentric_circle() -> None:
    """A problem of textbooks: 50 mm of lift from a smallest radius of 25 mm.

    The cam is a circle of 50 mm, 25 mm out of its centre, and the face is touched 25 mm to both sides.
    """
    table = cam_of(study_of(SLIDING % "to: 50 - 25*cos(cam), cam: {link: disc, flat: F, direction: 90}"))
    np.testing.assert_allclose(np.abs(placed(table) + 25j), 50, rtol=1e-13)
    np.testing.assert_allclose(table["curvature_radius"], 50, rtol=1e-12)
    np.testing.assert_allclose(np.abs(table["face"]), 25 * np.abs(np.sin(TURN)), atol=1e-12)
    np.testing.assert_allclose(table["pressure_angle"], 0, atol=1e-12)


ARM = """
mechanism:
  links:
    ground: {O: [0, 0], P: [-80, 20]}
    disc: [O, N, 20]
    arm: {P: [0, 0], F: [90, 5], H: [90, 30]}
  drives: [disc]
  couplings: {lift: {set: arm, to: 20 - 7*cos(disc) + 2*sin(2*disc), cam: {link: disc, %s}}}
  sketch: {N: [20, 0], F: [10, 40], H: [10, 60]}
kinematics: {sweep: {disc: {from: 0, to: 360, step: 15}}, outputs: [arm.angle]}
"""


@pytest.mark.parametrize("side", ["outer", "inner"])
def test_a_roller_on_an_arm_touches_the_profile_everywhere(side: str) -> None:
    table = cam_of(study_of(ARM % f"roller: F, radius: 9, side: {side}, steps: 3600"))
    turn = np.radians(np.arange(0, 360, 7.0))
    angle = np.radians(20 - 7 * np.cos(turn) + 2 * np.sin(2 * turn))
    arm = (90 + 5j) * np.exp(1j * angle)
    centers = (arm - 80 + 20j) * np.exp(-1j * turn)
    np.testing.assert_allclose(clearances(placed(table), centers), 9, atol=1e-4)
    # The normal from the profile to the roller, against the way that the roller goes on the arm.
    rows = np.searchsorted(table["disc"], np.degrees(turn) - 1e-9)
    out = (centers - placed(table)[rows]) * np.exp(1j * turn)
    assert (np.abs(placed(table)[rows]) < np.abs(centers)).all() == (side == "outer")
    assert np.tan(np.radians(table["pressure_angle"][rows])) == pytest.approx(
        np.tan(np.angle(out / (1j * arm))), abs=1e-10
    )


def test_a_flat_face_on_an_arm_stays_on_one_side_of_the_profile() -> None:
    table = cam_of(study_of(ARM % "flat: F, direction: 3, steps: 720"))
    turn = np.radians(np.arange(0, 360, 7.0))
    angle = np.radians(20 - 7 * np.cos(turn) + 2 * np.sin(2 * turn))
    point = ((90 + 5j) * np.exp(1j * angle) - 80 + 20j) * np.exp(-1j * turn)
    face = np.exp(1j * (angle + np.radians(3) - turn))
    above = ((placed(table) - point[:, None]) / face[:, None]).imag
    np.testing.assert_allclose(above.max(axis=1), 0, atol=1e-12)
    rows = np.searchsorted(table["disc"], np.degrees(turn) - 1e-9)
    np.testing.assert_allclose(placed(table)[rows], point + table["face"][rows] * face, atol=1e-11)
    # The profile's own curvature, by differences.
    way = np.diff(placed(table))
    curved = np.angle(way[1:] / way[:-1]) / (np.abs(way[1:]) + np.abs(way[:-1])) * 2
    np.testing.assert_allclose(1 / np.abs(curved), table["curvature_radius"][1:-1], rtol=1e-3)


def test_the_cam_may_stand_still_while_its_follower_goes_round() -> None:
    fixed = """
mechanism:
  links:
    ground: {O: [0, 0]}
    carrier: [O, N, 40]
    follower: {F: [0, 0], T: [60, 0]}
  joints: {valve: {prismatic: [carrier, follower], through: O, direction: 90, point: F}}
  drives: [carrier]
  couplings: {lift: {set: valve, to: 40 - 10*cos(-carrier), cam: {link: ground, roller: F, radius: 8}}}
  sketch: {N: [40, 0], F: [0, 40], T: [0, 100]}
kinematics: {sweep: {carrier: {from: 0, to: 360, step: 10}}, outputs: [F.y]}
"""
    one, other = cam_of(study_of(ROLLER)), cam_of(study_of(fixed))
    np.testing.assert_allclose(placed(other), placed(one)[::-1], atol=1e-12)
    np.testing.assert_allclose(other["pressure_angle"], one["pressure_angle"][::-1], atol=1e-12)


def test_a_groove_has_both_sides() -> None:
    table = cam_of(study_of(SLIDING % (HARMONIC % "roller: F, radius: r, side: groove")))
    outer, inner = (placed(table)[table["side"] == side] for side in ("outer", "inner"))
    np.testing.assert_allclose(np.abs(outer - inner), 16, rtol=1e-12)
    radii = [table["curvature_radius"][table["side"] == side] for side in ("outer", "inner")]
    np.testing.assert_allclose(radii[0] + radii[1], -16, rtol=1e-11)


def test_a_table_is_a_cam_over_its_range() -> None:
    rows = "of: cam, table: [[0, 40], [30, 42], [60, 46], [90, 48]]"
    table = cam_of(study_of(SLIDING % f"{rows}, cam: {{link: disc, roller: F, radius: 0, steps: 9}}"))
    np.testing.assert_allclose(table["cam"], np.linspace(0, 90, 10))
    np.testing.assert_allclose(np.abs(placed(table)), table["valve.slide"], rtol=1e-13)


def test_what_is_wrong_with_a_cam_is_said() -> None:
    small = ROLLER.replace("base: 30", "base: 9")
    (steep,) = warnings_of(study_of(small))
    assert "the pressure angle is above 30 deg, at most 31.76" in steep
    (cut,) = warnings_of(study_of(SLIDING % "to: 40 + 4*cos(4*cam), cam: {link: disc, roller: F, radius: 20}"))
    assert "the profile is undercut" in cut
    (cut,) = warnings_of(study_of(SLIDING % "to: 40 + 4*cos(4*cam), cam: {link: disc, flat: F, direction: 90}"))
    assert "the profile is undercut" in cut
    (opened,) = warnings_of(study_of(SLIDING % "to: 40 + cam/40, cam: {link: disc, roller: F, radius: 5}"))
    assert "does not close after a turn" in opened
    broken, _ = warnings_of(study_of(SLIDING % "to: 40 + 2*abs(sin(cam)), cam: {link: disc, roller: F, radius: 5}"))
    assert "the law of the follower has a corner (0, 180)" in broken


def test_a_follower_at_rest_is_no_dead_centre_but_a_piston_is() -> None:
    assert not mechdesign.kinematics(study_of(ROLLER)).warnings
    engine = (
        ROLLER.replace("T: [60, 0]}", "T: [60, 0]}\n    rod: [N, B, 120]\n    piston: {B: [0, 0]}")
        .replace("point: F}", "point: F}, guide: {prismatic: [ground, piston], through: O, point: B}")
        .replace("sketch: {", "sketch: {B: [160, 0], ")
        .replace("[F.y]", "[B.x]")
    )
    (dead,) = mechdesign.kinematics(study_of(engine)).warnings
    assert str(dead) == "3 poses are at a dead centre: B.x stands still there, and det_J is 0"


LOADED = ROLLER + "dynamics: {sweep: {cam: {from: 0, to: 350, step: 10}}, loads: [{at: T, force: [0, -50]}]}\n"


def test_the_contact_force_bears_the_load_along_the_normal() -> None:
    """On a follower without friction N cos(phi) is the load, the guide bears N sin(phi), the shaft F s'."""
    result = mechdesign.dynamics(study_of(LOADED))
    joints, turn = result.tables["joint_forces"], np.radians(np.arange(0, 360, 10.0))
    slope, s = 10 * np.sin(turn), 40 - 10 * np.cos(turn)
    phi = np.arctan(slope / s)
    on_cam = joints["joint"] == "lift"
    np.testing.assert_allclose(joints["normal"][on_cam], 50 / np.cos(phi), rtol=1e-12)
    np.testing.assert_allclose(joints["fx"][on_cam], -50 * np.tan(phi), atol=1e-11)
    np.testing.assert_allclose(joints["fx"][joints["joint"] == "valve"], 50 * np.tan(phi), atol=1e-11)
    np.testing.assert_allclose(joints["fy"][joints["joint"] == "O"], 50, rtol=1e-12)
    np.testing.assert_allclose(result.tables["dynamics"]["cam_effort"], 50 * slope, atol=1e-11)
    assert not result.warnings


@pytest.mark.parametrize("follower", ["roller: F, radius: 9", "flat: F, direction: 3"])
def test_the_shaft_bears_the_moment_of_the_contact_force(follower: str) -> None:
    """Of a massless cam under an arm with a mass, which moves: equilibrium at the place that cam.csv has."""
    text = ARM.replace("H: [90, 30]}", "H: [90, 30], mass: 0.4, center: [50, 0]}") % follower
    moving = "{sweep: {disc: {from: 0, to: 345, step: 15}}, rates: {disc: 300 rpm}, loads: [{at: H, force: [5, -40]}]}"
    study = study_of(text.replace("arm: {P: [0, 0]", "arm: {points: {P: [0, 0]").replace("30], m", "30]}, m")
                     + f"dynamics: {moving}\n")  # fmt: skip
    result, table = mechdesign.dynamics(study), cam_of(study)
    place = (placed(table) * np.exp(1j * np.radians(table["disc"])))[:-1:15]
    joints = result.tables["joint_forces"]
    on_arm = (joints["fx"] + 1j * joints["fy"])[joints["joint"] == "lift"]
    bearing = (joints["fx"] + 1j * joints["fy"])[joints["joint"] == "O"]
    np.testing.assert_allclose(bearing, on_arm, rtol=1e-11)
    np.testing.assert_allclose(result.tables["dynamics"]["disc_effort"], (np.conj(place) * on_arm).imag, atol=1e-8)


@pytest.mark.nightly
def test_a_follower_that_is_pulled_lifts_off() -> None:
    text = LOADED.replace("[0, -50]", "[0, 50]")
    assert any(
        "the follower lifts off at 36 of 36 poses" in str(w) for w in mechdesign.dynamics(study_of(text)).warnings
    )
    groove = text.replace("radius: r", "radius: r, side: groove")
    forward = "{forward: {duration: 0.01 s, rows: 3}, loads"
    moving = text.replace("{sweep: {cam: {from: 0, to: 350, step: 10}}, loads", forward)
    disc = "disc: {from: O, to: N, length: 40, mass: 1, center: [20, 0], inertia: 0}"
    moving = moving.replace("disc: [O, N, 40]", disc)
    (caution,) = mechdesign.dynamics(study_of(moving)).warnings
    assert "the follower lifts off at 3 of 3 poses" in str(caution)
    assert not any(w.kind == "cam" for w in mechdesign.dynamics(study_of(groove)).warnings)


def test_a_design_may_be_chosen_by_its_pressure_angle() -> None:
    """The largest is asin(10/(base + 10)) of a harmonic law."""
    variables = "variables: {base: {from: 15, to: 55, number: 3}}"
    goal = f"optimize: {{{variables}, minimize: kinematics.lift_pressure_angle.peak}}\n"
    designs = mechdesign.optimize(study_of(ROLLER + goal)).tables["designs"]
    np.testing.assert_allclose(
        designs["kinematics.lift_pressure_angle.peak"], np.degrees(np.arcsin(10 / (designs["base"] + 10))), rtol=1e-9
    )
