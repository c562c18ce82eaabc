"""Couplings: what a study may say of them, what they give, the forces of their wheels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of
from scipy.interpolate import CubicSpline

import mechdesign

GALLERY = Path(__file__).parents[2] / "configs" / "gallery"
FIVE_BAR = """
mechanism:
  links: {ground: {O: [0, 0], C: [100, 0]}, g1: [O, A, 30], g2: [C, D, 35], a: [A, B, 80], b: [D, B, 85]}
  drives: [g1]
  couplings: {mesh: %s}
  sketch: {A: [30, 0], D: [117, 30], B: [50, 90]}
"""


def five_bar(coupling: str) -> Any:
    return study_of(FIVE_BAR % coupling).mechanism


@pytest.mark.parametrize(
    ("coupling", "message"),
    [
        ("{set: g2}", "one of to: expression, ratio: number, table: file"),
        ("{set: g2, to: g1, ratio: 2}", "to and ratio are given"),
        ("{set: g2, ratio: 2}", "needs 'of'"),
        ("{set: g2, to: 2*g1, of: g1}", "'of' belongs to a 'ratio', a 'table' or a 'law'"),
        ("{set: g2, to: 2*g1, phase: 3}", "'phase' belongs to a 'ratio'"),
        ("{set: g3, of: g1, ratio: 2}", "there is no coordinate 'g3'"),
        ("{set: B.x, of: g1, ratio: 2}", "'B.x' cannot follow others"),
        ("{set: g2, of: g2, ratio: 2}", "'g2' cannot follow itself"),
        ("{set: g2, to: 2*h1}", "there is no coordinate or parameter 'h1'"),
        ("{set: g2, of: g1, table: [[0, 1], [0, 2]]}", "at least 4 rows, the first column rising"),
        ("{set: g2, of: g1, ratio: 2, wheels: chain}", "expected one of gears, belt, none"),
        ("{set: g2, of: g1, ratio: 2, phase: 20 mm}", "'20 mm' is a length, where an angle is expected"),
        ("{set: g2, of: g1, ratio: 2 mm}", "'2 mm' is a length, where a pure number is expected"),
        ("{set: g2, of: g1, ratio: 0}", "with a ratio of 0 'g2' would stand still"),
        ("{set: g2, to: 2*g1 + g2}", "'g2' cannot follow itself"),
        ("{set: g2, of: g1, ratio: 2, pressure_angle: 95}", "between 0 and 90 degrees"),
        ("{set: g1, to: '40'}", "'mesh' and 'g1' fix link 'g1' twice over"),
        ("{set: g2, to: sqrt(g1 - 20)}", "coupling 'mesh' has no value at the sketch (g1 = 0)"),
        ("{set: g2, to: sqrt(-1 - g1**2)}", "coupling 'mesh' has no value at the sketch"),
        ("{set: g2, of: g1, ratio: 2}, other: {set: g2, of: g1, ratio: 3}", "takes: couplings 'mesh' and 'other'"),
        ("{set: g2, of: g1, ratio: 2}, other: {set: g1, of: g2, ratio: 0.5}", "couplings 'mesh' and 'other' hold each"),
        ("{set: a, of: b, ratio: 2}, other: {set: b, of: a, ratio: 0.5}", "couplings 'mesh' and 'other' hold each"),
    ],
)
def test_mistakes_are_named(coupling: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError) as caught:
        five_bar(coupling)
    assert message in str(caught.value)


def test_a_drive_that_follows_by_a_coupling_is_named() -> None:
    with pytest.raises(
        mechdesign.StudyError, match="one of 'g1' or 'g2': each of them follows from the others by coupling 'mesh'"
    ):
        study_of(FIVE_BAR.replace("[g1]", "[g1, g2]") % "{set: g2, of: g1, ratio: 2}")


def test_a_phase_that_is_left_out_is_that_of_the_sketch() -> None:
    mechanism = five_bar("{set: g2, of: g1, ratio: -1.5}")
    drawn = np.degrees(np.arctan2(30, 17))
    pose = mechanism.solve({"g1": [-20, 0, 20]})
    assert pose["g2.angle"] == pytest.approx(drawn + np.array([30, 0, -30]), abs=1e-10)


@pytest.mark.parametrize(
    "coupling",
    [
        "{set: g2, of: g1, ratio: -1.37, phase: 20}",
        '{set: g2, to: "40*sin(g1) + 70 - 0.3*g1"}',
        '{set: g2, to: "30 + 0.3*B.x - 0.002*B.y**2"}',
        "{set: g2, of: g1, table: [[-90, 10], [0, 40], [60, 80], [120, 60], [200, 20]]}",
        '{set: g2, to: "60 + 0.4*b.angle"}',
    ],
)
def test_velocities_and_accelerations_are_differences(coupling: str) -> None:
    mechanism, at, h = five_bar(coupling), np.array([5.0, 25.0, 50.0]), 1e-2
    before, here, after = (mechanism.solve({"g1": at + step}) for step in (-h, 0, h))
    moving = "rates: {g1: 1 rad/s}, accelerations: {g1: 0.4 rad/s^2}, outputs: [B, D.x]"
    poses = [{"g1": float(angle)} for angle in at]
    motion = mechdesign.kinematics(study_of(FIVE_BAR % coupling + f"kinematics: {{poses: {poses}, {moving}}}\n")).main
    turn = np.radians(h)
    for name in ("B.x", "B.y", "D.x"):
        slope = (after[name] - before[name]) / (2 * turn)
        bend = (after[name] - 2 * here[name] + before[name]) / turn**2
        assert motion[f"{name}_velocity"] == pytest.approx(slope, rel=1e-5, abs=1e-4)
        assert motion[f"{name}_acceleration"] == pytest.approx(bend + 0.4 * slope, rel=1e-4, abs=1e-3)


BENT = """
mechanism:
  parameters: {k: 2, lift: 5}
  links:
    ground: {O: [0, 0], C: [100, 0]}
    one: [O, A, 30]
    two: [C, D, 35]
    left: [A, B, 80]
    right: [D, B, 85]
    valve: {V: [0, 0]}
  joints: {guide: {prismatic: [ground, valve], through: O, direction: 90}}
  drives: [one]
  couplings:
    gears: {set: two, to: "-2*one.angle + 60 + 10*sin(k*one.angle)**2"}
    cam: {set: guide, to: "12 + lift*(1 - cos(k*one.angle)) + hypot(B.x, B.y)/20 + max(B.x/50, 0)**2"}
  measures: {ratio: "B.x*B.y/(10 + guide.slide) + sqrt(B.x**2 + k)"}
  sketch: {A: [30, 0], D: [117, 30], B: [50, 90], V: [0, 12]}
"""


# What reliability differentiates by, and where the study gives it.
ENTRIES = {
    "k": "parameters.k",
    "lift": "parameters.lift",
    "one.length": "links.one.2",
    "ground.C.x": "links.ground.C.0",
}
NOMINAL = {"k": 2.0, "lift": 5.0, "one.length": 30.0, "ground.C.x": 100.0}


@pytest.mark.slow
def test_rates_by_dimensions_are_differences() -> None:
    """Derivatives of velocities and accelerations by parameters of couplings and by dimensions, whatever their form."""
    outputs = ("B.x", "guide.slide", "two.angle", "ratio")
    moving = "{poses: [{one: 10}, {one: 33}], rates: {one: 3 rad/s}, accelerations: {one: 1.5 rad/s^2}, outputs: [%s]"
    text, moving = BENT, moving % ", ".join(outputs)
    varied = "dimensions: {k: 0.01, lift: 0.01, one.length: 0.01, ground.C.x: 0.01}"
    study = study_of(
        f"{text}kinematics: {moving}}}\nreliability: {moving}, {varied}, methods: [analytic], sobol: 0}}\n"
    )
    table = mechdesign.reliability(study).tables["contributions"]
    h = 1e-5
    for name, entry in ENTRIES.items():
        ends = [
            mechdesign.kinematics(
                study_of(f"{text}kinematics: {moving}}}\n", f"mechanism.{entry}={NOMINAL[name] + step!r}")
            ).main
            for step in (h, -h)
        ]
        for output in outputs:
            for order in ("velocity", "acceleration"):
                slope = (ends[0][f"{output}_{order}"] - ends[1][f"{output}_{order}"]) / (2 * h)
                found = table["derivative"][table.where(source=name, output=output, order=order)]
                assert found == pytest.approx(slope, rel=1e-6, abs=1e-3)


RACKS = """
mechanism:
  parameters: {r: 20}
  links: {ground: {O: [0, 0]}, head: {H: [0, 0]}, pinion: [H, N, r], rack: {R: [0, 0], S: [40, 0]}}
  joints:
    cross: {prismatic: [ground, head], through: O, direction: 0, point: H}
    top: {prismatic: [ground, rack], through: O, direction: 0, point: R}
  drives: [cross]
  couplings:
    below: {set: pinion, of: cross, ratio: -180/(pi*r)}
    above: {set: top, to: cross - r*pinion.angle*pi/180}
  sketch: {H: [0, 0], N: [0, 20], R: [0, 20], S: [40, 20]}
dynamics:
  sweep: {cross: {from: 0, to: 40, step: 20}}
  loads: [{at: S, force: [-10, 0]}]
"""


@pytest.mark.slow
def test_a_pinion_on_a_crosshead_rolls_between_two_racks() -> None:
    """The fixed rack below and the moving one above bear a half of the crosshead's force each."""
    result = mechdesign.dynamics(study_of(RACKS))
    assert result.tables["dynamics"]["cross_effort"] == pytest.approx(20)
    forces = result.tables["joint_forces"]
    borne = {name: (x, y) for name, x, y in zip(forces["joint"], forces["fx"], forces["fy"], strict=True)}
    apart = 10 * np.tan(np.radians(20))
    assert borne["below"] == pytest.approx((10, -apart))
    assert borne["above"] == pytest.approx((10, apart))
    assert borne["H"] == pytest.approx((20, 0))


def test_a_rack_rolls_on_a_fixed_pinion_about_which_its_guide_turns() -> None:
    """The teeth of a pinion of 20 mm, on the frame, bear the load along the rack, and that times tan 20 deg across."""
    result = mechdesign.dynamics(study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, A, 60], bar: {B: [0, 0]}}
  joints: {guide: {prismatic: [arm, bar], through: O, point: B}}
  drives: [arm]
  couplings: {roll: {set: guide, of: arm, ratio: 20*pi/180}}
  sketch: {A: [60, 0], B: [10, 0]}
dynamics: {poses: [{arm: 30}], loads: [{at: B, force: [7, 0], in: bar}]}
"""))  # fmt: skip
    assert result.main["arm_effort"] == pytest.approx(-7 * 20)
    (teeth,) = (row for row in result.tables["joint_forces"] if row["joint"] == "roll")
    assert {teeth["on"], teeth["by"]} == {"bar", "ground"}
    assert teeth["magnitude"] == pytest.approx(7 / np.cos(np.radians(20)))


def test_gears_on_a_crosshead_have_pitch_circles() -> None:
    """The angle of a crosshead never changes, so that the wheels' angles in the world are those against it.

    30 mm apart, twice as fast: radii of 20 and 10 mm.
    """
    result = mechdesign.dynamics(study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, head: {H: [0, 0], K: [30, 0]}, one: [H, M, 5], two: [K, N, 5]}
  joints: {cross: {prismatic: [ground, head], through: O, point: H}}
  drives: [cross, one]
  couplings: {gears: {set: two, of: one, ratio: -2}}
  sketch: {H: [0, 0], K: [30, 0], M: [5, 0], N: [35, 0]}
dynamics: {poses: [{cross: 0, one: 0}], loads: [{link: two, moment: 60}]}
"""))  # fmt: skip
    (teeth,) = (row for row in result.tables["joint_forces"] if row["joint"] == "gears")
    assert (teeth["on"], teeth["fy"]) == ("two", pytest.approx(60 / 10))
    assert teeth["magnitude"] == pytest.approx(6 / np.cos(np.radians(20)))
    assert result.main["one_effort"] == pytest.approx(6 * 20)


@pytest.mark.slow
def test_a_phase_that_is_left_out_follows_a_ratio_that_varies() -> None:
    """What optimize computes of a design is what its study gives when it is read."""
    text = FIVE_BAR % "{set: g2, of: g1, ratio: -1.5}" + "kinematics: {sweep: {g1: {from: 0, to: 90, step: 45}}}\n"
    study = study_of(
        text + "optimize: {variables: {mesh.ratio: {from: -1.5, to: -1, step: 0.5}}, minimize: kinematics.B.y.range}\n"
    )
    found = mechdesign.optimize(study).tables["designs"]["kinematics.B.y.range"]
    for ratio, range_of_design in zip(("-1.5", "-1"), found, strict=True):
        extremes = mechdesign.kinematics(study_of(text.replace("-1.5", ratio))).tables["extremes"]
        assert range_of_design == pytest.approx(extremes["range"][list(extremes["output"]).index("B.y")])


def test_a_link_stands_for_its_angle_in_an_expression() -> None:
    by_name, by_angle = (five_bar(f"{{set: g2, to: 60 + 0.4*{name}}}").solve({"g1": 20}) for name in ("b", "b.angle"))
    assert by_name["B.x"] == by_angle["B.x"]


def test_turns_count() -> None:
    """Half as fast as the drive, a wheel is on the other side after a turn of the drive."""
    mechanism = five_bar("{set: g2, of: g1, ratio: 0.5, phase: 20}")
    pose = mechanism.solve({"g1": [10.0, 370.0, 730.0]})
    assert pose["g2.angle"] == pytest.approx([25, 205, 385])
    assert pose["D.x"][0] == pytest.approx(pose["D.x"][2])
    assert abs(pose["D.x"][0] - pose["D.x"][1]) > 1


def test_what_is_set_may_be_driven() -> None:
    """The coupling, read backwards, gives the crank, in its turn."""
    drives = FIVE_BAR.replace("drives: [g1]", "drives: [g2]")
    mechanism = study_of(drives % "{set: g2, of: g1, ratio: -1.5, phase: 60}").mechanism
    wanted = np.array([0.0, 30, 80, 170, 355, -300])
    pose = mechanism.solve({"g2": wanted})
    assert pose["g1.angle"] == pytest.approx((wanted - 60) / -1.5, abs=1e-9)
    bent = study_of(drives % '{set: g2, to: "60 - 1.5*g1.angle + 10*sin(g1.angle)"}').mechanism
    crank = bent.solve({"g2": wanted})["g1.angle"]
    assert 60 - 1.5 * crank + 10 * np.sin(np.radians(crank)) == pytest.approx(wanted, abs=1e-8)


def test_an_inverse_problem_leads_back() -> None:
    mechanism = five_bar("{set: g2, of: g1, ratio: -1, phase: 60}")
    pose = mechanism.solve({"g1": [10.0, 20.0, 30.0]})
    back = mechanism.solve({"B.x": pose["B.x"]})
    assert back["g1"] == pytest.approx([10, 20, 30], abs=1e-8)


def test_a_table_is_a_spline_and_repeats_after_a_turn() -> None:
    angles = np.arange(0, 361, 30)
    lifts = 12 + 5 * (1 - np.cos(2 * np.radians(angles))) + np.sin(np.radians(angles))
    lifts[-1] = lifts[0]
    rows = [[int(a), float(s)] for a, s in zip(angles, lifts, strict=True)]
    study = study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, cam: [O, N, 20], follower: {{F: [0, 0]}}}}
  joints: {{valve: {{prismatic: [ground, follower], through: O, direction: 90}}}}
  drives: [cam]
  couplings: {{lift: {{set: valve, of: cam, table: {rows}}}}}
  sketch: {{N: [20, 0], F: [0, 12]}}
kinematics: {{path: {{cam: [0, 17, 123, 359, 377, -10]}}, rates: {{cam: 1 rad/s}}, outputs: [F.y]}}
""")
    spline = CubicSpline(np.radians(angles), lifts, bc_type="periodic")
    at = np.array([0.0, 17, 123, 359, 377, -10])
    pose = study.mechanism.solve({"cam": at})
    assert pose["F.y"] == pytest.approx(spline(np.radians(at % 360)), abs=1e-12)
    bend = mechdesign.kinematics(study).main["F.y_acceleration"]
    assert bend == pytest.approx(spline(np.radians(at % 360), 2), rel=1e-3, abs=1e-3)


@pytest.mark.parametrize(
    ("coupling", "message"),
    [
        (
            "of: g1, table: [[-90, 10], [0, 40], [60, 80], [120, 60]]",
            "g1 = 150 deg: coupling 'mesh' has no value: 'g1' is outside of its table, -90 to 120",
        ),
        ("to: 60 + sqrt(40 - g1)", "coupling 'mesh' has no value"),
    ],
)
def test_poses_at_which_a_coupling_has_no_value_say_so(coupling: str, message: str) -> None:
    sweep = "kinematics: {sweep: {g1: {from: 0, to: 150, step: 50}}, outputs: [B]}"
    result = mechdesign.kinematics(study_of(FIVE_BAR % f"{{set: g2, {coupling}}}" + sweep))
    assert message in str(result.warnings[0])


def test_two_gears_press_their_bearings_apart() -> None:
    """A moment M on the second gear: the teeth bear M/r2 along the pitch circles, and that times tan 20 deg apart."""
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0], C: [90, 0]}, pinion: [O, A, 20], wheel: [C, B, 40]}
  drives: [pinion]
  couplings: {mesh: {set: wheel, of: pinion, ratio: -0.5}}
  sketch: {A: [20, 0], B: [130, 0]}
dynamics:
  sweep: {pinion: {from: 0, to: 90, step: 30}}
  loads: [{link: wheel, moment: 1200}]
""")
    result = mechdesign.dynamics(study)
    assert result.main["pinion_effort"] == pytest.approx(np.full(4, 600))
    forces = result.tables["joint_forces"]
    on_wheel = forces["joint"] == "C"
    sign = np.where(forces["on"][on_wheel] == "wheel", 1.0, -1.0)
    tooth = 1200 / 60
    assert np.hypot(forces["fx"], forces["fy"]) == pytest.approx(np.full(len(forces), tooth / np.cos(np.radians(20))))
    # Pressed away from the pinion, the wheel is held by its bearing towards it.
    assert sign * forces["fx"][on_wheel] == pytest.approx(np.full(4, -tooth * np.tan(np.radians(20))))


@pytest.mark.parametrize(
    "coupling",
    ["{set: g2, of: g1, ratio: -1.37}", '{set: g2, to: "40*sin(g1) + 70 - 0.3*g1"}', '{set: g2, to: "60 + 0.4*B.y"}'],
)
def test_power_is_the_rate_of_energy(coupling: str) -> None:
    text = FIVE_BAR % coupling
    for name, mass in (("g1", 0.5), ("g2", 0.6), ("a", 0.2), ("b", 0.3)):
        ends = {"g1": "O, to: A, length: 30", "g2": "C, to: D, length: 35", "a": "A, to: B, length: 80",
                "b": "D, to: B, length: 85"}[name]  # fmt: skip
        text = text.replace(
            f"{name}: [{ends.replace(' to: ', ' ').replace(' length: ', ' ')}]",
            f"{name}: {{from: {ends}, mass: {mass}, inertia: 1e-4}}",
        )
    study = study_of(text + """
dynamics: {gravity: [0, -9.81 m/s2], sweep: {g1: {from: 10, to: 50, step: 0.25}}, rates: {g1: 600}}
""")  # fmt: skip
    table = mechdesign.dynamics(study).main
    assert table["valid"].all()
    energy = CubicSpline(table["g1"], table["kinetic_energy"] + table["potential_energy"])(table["g1"], 1) * 600
    inner = slice(8, -8)
    size = np.abs(table["g1_power"]).max()
    assert table["g1_power"][inner] / size == pytest.approx(energy[inner] / size, abs=1e-6)


def test_check_tells_couplings() -> None:
    lines = "\n".join(checked((GALLERY / "planetary.yaml").read_text(encoding="utf-8")))
    assert "1. couplings sun_mesh, ring_mesh: arm.angle, planet.angle" in lines
    assert "coupling: ring_mesh (planet.angle = arm.angle - zr/zp*arm.angle)" in lines
    lines = "\n".join(checked(FIVE_BAR % "{set: g2, of: g1, ratio: 1}"))
    assert "coupling: mesh (g2.angle = mesh.ratio*g1 + mesh.phase)" in lines


def test_kinematics_has_what_follows() -> None:
    study = study_of(FIVE_BAR % "{set: g2, of: g1, ratio: -1, phase: 60}" + """
kinematics: {sweep: {g1: {from: 0, to: 40, step: 10}}, outputs: [g2.angle]}
""")  # fmt: skip
    assert mechdesign.kinematics(study).main["g2.angle"] == pytest.approx(60 - np.arange(0, 41, 10))
