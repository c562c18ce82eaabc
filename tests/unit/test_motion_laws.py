"""Motions over time: laws, dwells and files; their rates, and what lies between the poses."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import FOUR_BAR
from PIL import Image

import mechdesign

ROOT = Path(__file__).parents[2]
MECHANISM = FOUR_BAR.replace("  links:", "  parameters: {rise: 90, fast: 0.3}\n  links:")
ARM = """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, E, 100]
    fore: [E, T, 80]
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [80, 60], T: [150, 20]}
"""
# Peak velocity and acceleration of a unit move in unit time, as printed in Norton, Design of Machinery, table of peak
# factors of cam motion curves; of trapezoidal velocity as drives' manuals have it (thirds). Norton's accelerations of
# the polynomials, 5.777 and 7.526, are larger than those of their own equations by less than two parts in a thousand.
PRINTED = {
    "constant": (1.0, 0.0),
    "harmonic": (1.571, 4.935),
    "double_harmonic": (2.040, 9.870),
    "cycloidal": (2.000, 6.283),
    "polynomial345": (1.875, 5.777),
    "polynomial4567": (2.188, 7.526),
    "modified_sine": (1.760, 5.528),
    "trapezoidal": (1.5, 4.5),
}


# Where a law goes on by another curve.
PHASES = {"modified_sine": (1 / 8, 7 / 8), "trapezoidal": (1 / 3, 2 / 3)}
UNIT = """
units: {length: m}
mechanism:
  links: {ground: {O: [0, 0]}, block: {B: [0, 0]}}
  joints: {way: {prismatic: [ground, block], through: O, point: B}}
  drives: {x: {slide: way}}
kinematics: {motion: {x: [{from: 0, to: 1, time: 1, law: %s}]}, instants: %d, outputs: [B.x]}
"""


def curves(law: str, instants: int) -> list[np.ndarray]:
    """Rise, velocity and acceleration of a unit move in unit time."""
    table = mechdesign.kinematics(mechdesign.load(text=UNIT % (law, instants))).main
    assert table["time"] == pytest.approx(np.linspace(0, 1, instants), abs=1e-12)
    return [table[name] for name in ("x", "x_velocity", "x_acceleration")]


def peaks(law: str) -> list[float]:
    """Largest velocity and acceleration of a unit move in unit time."""
    table = mechdesign.kinematics(mechdesign.load(text=UNIT % (law, 101))).tables["extremes"]
    rows = {row["output"]: max(abs(row["min"]), abs(row["max"])) for row in table}
    return [rows[f"B.x_{order}"] for order in ("velocity", "acceleration")]


def load(text: str, folder: Path, mechanism: str = MECHANISM) -> mechdesign.Study:
    (folder / "study.yaml").write_text(mechanism + text)
    return mechdesign.load(folder / "study.yaml")


def asked(text: str, folder: Path, mechanism: str = MECHANISM) -> mechdesign.Answer:
    return mechdesign.kinematics(load(text, folder, mechanism))


def problems(text: str, folder: Path, mechanism: str = MECHANISM) -> str:
    with pytest.raises(mechdesign.StudyError) as caught:
        load(text, folder, mechanism)
    return str(caught.value)


@pytest.mark.parametrize("law", PRINTED)
def test_each_law_rises_from_0_to_1_with_the_rates_of_its_rise(law: str) -> None:
    h = 1e-4
    s, speed, bend = curves(law, 10_001)
    assert s[0] == pytest.approx(0, abs=1e-15)
    assert s[-1] == pytest.approx(1, abs=1e-15)
    assert np.all(np.diff(s) >= 0)
    # By symmetry half of the way is passed in half of the time; the double harmonic begins softly and ends at once.
    if law != "double_harmonic":
        np.testing.assert_allclose(s + s[::-1], 1, atol=1e-14)
    u = np.linspace(0, 1, len(s))[1:-1]
    away = np.min(np.abs(u[:, None] - [0, *PHASES.get(law, ()), 1]), axis=1) > 1.5 * h
    np.testing.assert_allclose(((s[2:] - s[:-2]) / (2 * h))[away], speed[1:-1][away], atol=1e-6)
    np.testing.assert_allclose(((speed[2:] - speed[:-2]) / (2 * h))[away], bend[1:-1][away], atol=2e-6)


@pytest.mark.parametrize("law", PRINTED)
def test_peaks_are_the_printed_ones(law: str) -> None:
    velocity, acceleration = PRINTED[law]
    found = peaks(law)
    assert found[0] == pytest.approx(velocity, abs=6e-4)
    assert found[1] == pytest.approx(acceleration, rel=2e-3)


def test_page_has_the_peaks_of_every_law() -> None:
    page = (ROOT / "docs" / "howto" / "motion_laws.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| `(\w+)` \| ([\d.]+) \| ([\d.]+)", page)
    assert rows == [(law, *(f"{peak:.3f}" for peak in peaks(law))) for law in PRINTED]
    with pytest.raises(mechdesign.StudyError) as caught:
        curves("unheard", 11)
    assert all(law in str(caught.value) for law in PRINTED)


@pytest.mark.parametrize("law", ["cycloidal", "polynomial345", "polynomial4567", "modified_sine"])
def test_laws_without_jumps_begin_and_end_without_acceleration(law: str) -> None:
    _, v, a = curves(law, 11)
    np.testing.assert_allclose(v[[0, -1]], 0, atol=1e-14)
    np.testing.assert_allclose(a[[0, -1]], 0, atol=1e-13)


def test_a_double_harmonic_fall_is_its_rise_backwards() -> None:
    """Both are soft at the lower end; where a rise and a fall meet the acceleration goes on."""
    text = UNIT % ("double_harmonic}, {to: 0, time: 1, law: double_harmonic", 2001)
    table = mechdesign.kinematics(mechdesign.load(text=text)).main
    for name, sign in (("x", 1), ("x_velocity", -1), ("x_acceleration", 1)):
        np.testing.assert_allclose(table[name], sign * table[name][::-1], atol=1e-12 * np.abs(table[name]).max())
    bend = table["x_acceleration"]
    assert bend[[0, 1000, -1]] == pytest.approx([0, -(np.pi**2), 0], abs=1e-12)
    assert np.abs(np.diff(bend)).max() < 0.05


CYCLE = "{to: 90, time: 0.3, law: cycloidal}, {dwell: 0.1}, {to: 0, time: 0.4, law: %s}"


def test_motion_table_has_time_first_and_the_ends_of_segments(tmp_path: Path) -> None:
    table = asked(f"kinematics: {{motion: {{theta: [{CYCLE % 'harmonic'}]}}, outputs: [P]}}", tmp_path).tables["motion"]
    assert table.names[:4] == ("time", "theta", "theta_velocity", "theta_acceleration")
    assert [table.column(name).unit for name in table.names[:4]] == ["s", "deg", "deg/s", "deg/s^2"]
    assert len(table) == 182
    assert {0.0, 0.3, 0.8} <= set(table["time"].tolist())
    assert np.abs(table["time"] - 0.4).min() < 1e-15
    for name in ("theta", "P.x", "P.y"):
        assert table[name][0] == pytest.approx(table[name][-1], abs=1e-12)
    assert np.ptp(table["theta"][(table["time"] >= 0.3) & (table["time"] <= 0.4)]) == 0.0


@pytest.mark.parametrize("law", ["constant", "harmonic", "trapezoidal", "modified_sine"])
def test_rates_of_outputs_are_differences_of_their_positions_over_time(law: str, tmp_path: Path) -> None:
    study = f"kinematics: {{motion: {{theta: [{CYCLE % law}]}}, outputs: [P, rocker.angle], instants: 40001}}"
    table = asked(study, tmp_path).tables["motion"]
    time = table["time"]
    h = 2e-5
    even = np.ones(len(time), dtype=bool)
    # Five even steps around, and within one smooth part of the law.
    ends = [0.3, 0.4, *(0.4 + 0.4 * begin for begin in PHASES.get(law, ()))]
    for k in (-2, -1, 0, 1):
        even[2:-2] &= np.abs(np.roll(time, -k - 1) - np.roll(time, -k) - h)[2:-2] < 1e-9
    even[:2] = even[-2:] = False
    even &= np.min(np.abs(time[:, None] - ends), axis=1) > 3 * h
    rows = np.flatnonzero(even)[::40]
    for name in ("P.x", "P.y", "rocker.angle"):
        velocity, acceleration = table[f"{name}_velocity"], table[f"{name}_acceleration"]
        slope = (table[name][rows + 1] - table[name][rows - 1]) / (2 * h)
        np.testing.assert_allclose(slope, velocity[rows], atol=1e-6 * np.abs(velocity).max())
        slope = velocity[rows - 2] - 8 * velocity[rows - 1] + 8 * velocity[rows + 1] - velocity[rows + 2]
        np.testing.assert_allclose(slope / (12 * h), acceleration[rows], atol=1e-6 * np.abs(acceleration).max())


def test_accelerations_are_second_differences_of_positions(tmp_path: Path) -> None:
    """Positions at seven instants around each, a part in 10^6 of the largest acceleration."""
    study = f"kinematics: {{motion: {{theta: [{CYCLE % 'polynomial4567'}]}}, outputs: [P], instants: 2001}}"
    table = asked(study, tmp_path).tables["motion"]
    h = 4e-4
    weights = np.array([2, -27, 270, -490, 270, -27, 2]) / (180 * h**2)
    for name in ("P.x", "P.y"):
        acceleration = table[f"{name}_acceleration"]
        windows = np.lib.stride_tricks.sliding_window_view(table[name], 7)
        time = np.lib.stride_tricks.sliding_window_view(table["time"], 7)
        far = np.min(np.abs(time[:, 3, None] - [0.3, 0.4]), axis=1) > 4 * h
        good = far & (np.abs(np.diff(time, axis=1) - h).max(axis=1) < 1e-12)
        assert np.count_nonzero(good) > 1900
        error = np.abs(windows @ weights - acceleration[3:-3])[good]
        assert error.max() < 1e-6 * np.abs(acceleration).max()


def test_extremes_are_those_before_and_after_a_jump(tmp_path: Path) -> None:
    """A harmonic law is fastest to change its velocity at its very ends, beside a dwell in which nothing moves."""
    study = "kinematics: {motion: {theta: [{dwell: 0.1}, {from: 0, to: 90, time: 0.3, law: harmonic}, {dwell: 0.2}]}}"
    study = study.replace("{dwell: 0.1}, {from: 0, ", "{from: 0, dwell: 0.1}, {")
    table = asked(study, tmp_path).tables["extremes"]
    rows = dict(zip(table["output"].tolist(), range(len(table)), strict=True))
    row = rows["theta_acceleration"]
    peak = math.pi**2 / 2 * 90 / 0.3**2
    assert (table["max"][row], table["min"][row]) == pytest.approx((peak, -peak), rel=1e-12)
    assert (table["max_at"][row], table["min_at"][row]) == pytest.approx((0.1, 0.4), abs=1e-12)
    row = rows["theta_velocity"]
    assert table["max"][row] == pytest.approx(math.pi / 2 * 90 / 0.3, rel=1e-12)
    assert table["max_at"][row] == pytest.approx(0.25, abs=1e-6)
    # Of an output as well: beside the dwell it has the acceleration of its Jacobian alone.
    by_drive = asked("kinematics: {sweep: {theta: {from: 0, to: 90, step: 90}}, rates: {theta: 0}, "
                     f"accelerations: {{theta: {-peak}}}}}", tmp_path).tables["motion"]  # fmt: skip
    assert table["max"][rows["rocker.angle_acceleration"]] >= abs(by_drive["rocker.angle_acceleration"][1]) * (1 - 1e-9)


@pytest.mark.parametrize("instants", [2, 7, 181, 1000])
def test_extremes_do_not_depend_on_the_number_of_instants(instants: int, tmp_path: Path) -> None:
    kinds = [asked(f"kinematics: {{motion: {{theta: [{CYCLE % 'trapezoidal'}]}}, instants: {n}}}", tmp_path)
             for n in (instants, 400)]  # fmt: skip
    own, other = (kind.tables["extremes"] for kind in kinds)
    for column in ("min", "max"):
        sizes = np.maximum(np.abs(other["min"]), np.abs(other["max"]))
        assert np.all(np.abs(own[column] - other[column]) <= 1e-9 * sizes)


def test_motion_of_an_output_moves_the_drives(tmp_path: Path) -> None:
    given = "{motion: {theta: [{from: 40, to: 80, time: 0.5, law: polynomial345}]}, outputs: [rocker.angle]}"
    table = asked(f"kinematics: {given}", tmp_path).tables["motion"]
    begin, end = table["rocker.angle"][[0, -1]]
    motion = f"[{{from: {begin!r}, to: {end!r}, time: 0.5, law: cycloidal}}]".replace("np.float64", "")
    inverse = asked(f"kinematics: {{motion: {{rocker.angle: {motion}}}, outputs: [P]}}", tmp_path).tables["motion"]
    # Back through the drive's own rates.
    assert inverse["theta"][[0, -1]] == pytest.approx([40, 80], abs=1e-9)
    time, h = inverse["time"], inverse["time"][1]
    for name in ("theta", "P.x", "P.y"):
        velocity = inverse[f"{name}_velocity"]
        slope = velocity[:-4] - 8 * velocity[1:-3] + 8 * velocity[3:-1] - velocity[4:]
        acceleration = inverse[f"{name}_acceleration"]
        np.testing.assert_allclose(slope / (12 * h), acceleration[2:-2], atol=1e-5 * np.abs(acceleration).max())
    assert np.allclose(np.diff(time), h)


def test_several_coordinates_drives_and_outputs_mixed(tmp_path: Path) -> None:
    motion = """
kinematics:
  motion:
    theta1: [{from: 20, to: 80, time: 0.2 s, law: cycloidal}, {dwell: 100 ms}]
    T.x: [{from: 120 mm, to: 70, time: 0.3}]
  outputs: [T]
"""
    table = asked(motion, tmp_path, ARM).tables["motion"]
    assert table["valid"].all()
    assert table["T.x"][[0, -1]] == pytest.approx([120, 70])
    assert table["theta1"][-1] == 80
    assert {"theta2_velocity", "T.y_acceleration"} <= set(table.names)
    held = asked("kinematics: {motion: {theta1: [{from: 20, to: 80, time: 0.2}], theta2: -30}}", tmp_path, ARM)
    assert np.ptp(held.tables["motion"]["theta2"]) == 0


def test_file_of_times_and_values_is_a_cubic_spline(tmp_path: Path) -> None:
    time = np.linspace(0, 2, 81)
    values = 60 + 30 * np.sin(np.pi * time)
    rows = "\n".join(f"{t:.12g},{v:.15g}" for t, v in zip(time + 5, values, strict=True))
    (tmp_path / "law.csv").write_text(f"time,value\n{rows}\n")
    for form in ("law.csv", "{file: law.csv}"):
        result = asked(f"kinematics: {{motion: {{theta: {form}}}, outputs: [P], instants: 401}}", tmp_path)
        table = result.tables["motion"]
        t = table["time"]
        assert (t[0], t[-1], len(t)) == (0, 2, 401)
        np.testing.assert_allclose(table["theta"], 60 + 30 * np.sin(np.pi * t), atol=1e-5)
        np.testing.assert_allclose(table["theta_velocity"], 30 * np.pi * np.cos(np.pi * t), atol=2e-3)
        np.testing.assert_allclose(table["theta_acceleration"], -30 * np.pi**2 * np.sin(np.pi * t), atol=0.3)
    (tmp_path / "sub").mkdir()
    assert "--allow-files" in problems("kinematics: {motion: {theta: ../law.csv}}", tmp_path / "sub")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("0,1\n1,2\n", "three lines or more"),
        ("1\n2\n3\n", "a time and a value a line"),
        ("0,1\n1,2\n1,3\n", "do not rise, 1 is followed by 1"),
        ("0,1\n2,2\n1,3\n", "do not rise, 2 is followed by 1"),
        ("0,1\nnan,2\n1,3\n", "finite numbers"),
    ],
)
def test_file_that_is_no_motion_is_told(content: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "law.csv").write_text(content)
    assert words in problems("kinematics: {motion: {theta: law.csv}}", tmp_path)


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ("{theta: [{from: 0, to: 90, time: -1}]}", "must be positive, not -1"),
        ("{theta: [{from: 0, to: 90, time: 0}]}", "must be positive, not 0"),
        ("{theta: [{from: 0, to: 90, time: .nan}]}", "finite number"),
        ("{theta: [{from: 0, to: .inf, time: 1}]}", "finite number"),
        ("{theta: [{from: 0, to: 90, time: 1 mm}]}", "time"),
        ("{theta: [{from: 0, to: 90 mm, time: 1}]}", "angle"),
        ("{theta: [{from: 0, to: 90, time: 1, law: cycloid}]}", "did you mean 'cycloidal'"),
        ("{theta: [{from: 0, to: 90}]}", "needs a time: {to: 90, time: 0.3}"),
        ("{theta: [{from: 0, to: 90, dwell: 1}]}", "to and dwell are given"),
        ("{theta: [{from: 0, to: 90, time: 1}, {dwell: 1, law: harmonic}]}", "a dwell has no 'law'"),
        ("{theta: [{from: 0, time: 1}]}", "a segment is a move, {to: 90, time: 0.3}"),
        ("{theta: [{to: 90, time: 1}, {dwell: 1}]}", "a cycle that begins where it ends, and so needs two moves"),
        ("{theta: [{to: 90, time: 1}, {from: 2, to: 0, time: 1}]}", "'from' is for the first one"),
        ("{theta: []}", "an empty motion"),
        ("{theta: {to: 90, time: 1}}", "segments of a motion stand in a list, [{from: 0, to: 90, time: 0.3}"),
        ("{}", "an empty motion"),
        ("{theta: 30}", "stand still"),
        ("{thet: [{from: 0, to: 90, time: 1}]}", "theta"),
        ("{P: [{from: 0, to: 90, time: 1}]}", "its coordinates are P.x and P.y"),
        ("{theta: [{from: 0, to: 90, time: 1e-12}, {to: 0, time: 1}]}", "less than 1e-06 of the whole time"),
        ("{theta: law.csv}", "cannot be read"),
    ],
)
def test_hostile_motions_are_told(motion: str, words: str, tmp_path: Path) -> None:
    assert words in problems(f"kinematics: {{motion: {motion}}}", tmp_path)


@pytest.mark.parametrize(
    "other",
    ["sweep: {theta: {from: 0, to: 1, number: 3}}", "poses: [{theta: 1}]", "path: {P: [[1, 2], [3, 4]]}",
     "rates: {theta: 1}", "accelerations: {theta: 1}", "speed: 3"],
)  # fmt: skip
def test_motion_stands_alone(other: str, tmp_path: Path) -> None:
    told = problems(f"kinematics: {{motion: {{theta: [{{from: 0, to: 90, time: 1}}]}}, {other}}}", tmp_path)
    assert re.search(r"motion.* both given", told)
    assert other.partition(":")[0] in told


def test_instants_are_those_of_a_motion(tmp_path: Path) -> None:
    assert "'instants' are those of a 'motion'" in problems("kinematics: {instants: 9}", tmp_path)


def test_coordinates_that_end_at_different_times_are_told(tmp_path: Path) -> None:
    motion = "{theta1: [{from: 0, to: 9, time: 0.8}], theta2: [{from: 0, to: 9, time: 0.3}, {dwell: 400 ms}]}"
    told = problems(f"kinematics: {{motion: {motion}}}", tmp_path, ARM)
    assert "'theta1' ends after 0.8 and 'theta2' after 0.7" in told
    told = problems("kinematics: {motion: {theta1: [{from: 0, to: 9, time: 0.8}]}}", tmp_path, ARM)
    assert "theta1" in told


@pytest.mark.slow
def test_more_segments_than_a_motion_has_are_refused(tmp_path: Path) -> None:
    segments = ", ".join(["{to: 1, time: 1}"] * 10_001)
    assert "10001 segments; at most 10000" in problems(f"kinematics: {{motion: {{theta: [{segments}]}}}}", tmp_path)


def test_sums_that_differ_by_rounding_end_together(tmp_path: Path) -> None:
    first = ", ".join(["{to: 1, time: 0.1}", "{to: 2, time: 0.2}", "{to: 0, time: 0.7}"])
    motion = f"{{theta1: [{first}], theta2: [{{to: 3, time: 0.3}}, {{to: 4, time: 0.7}}]}}"
    table = asked(f"kinematics: {{motion: {motion}, instants: 11}}", tmp_path, ARM).main
    assert table["time"] == pytest.approx(np.linspace(0, 1, 11), abs=1e-15)
    # At 0.3 both go on.
    assert table["theta2_velocity"][3] == pytest.approx(0, abs=1e-12)


def test_jump_of_velocity_is_told(tmp_path: Path) -> None:
    warnings = asked(f"kinematics: {{motion: {{theta: [{CYCLE % 'constant'}]}}}}", tmp_path).warnings
    assert any("the velocity jumps at 1 instant" in str(warning) for warning in warnings)
    warnings = asked(f"kinematics: {{motion: {{theta: [{CYCLE % 'harmonic'}]}}}}", tmp_path).warnings
    assert not any("jumps" in str(warning) for warning in warnings)


def test_units_of_time_and_angle_are_the_studys(tmp_path: Path) -> None:
    units = "units: {time: min, angle: rad}\n"
    motion = "{motion: {theta: [{from: 0, to: 90 deg, time: 30 s, law: constant}]}}"
    table = asked(f"kinematics: {motion}", tmp_path, units + MECHANISM).tables["motion"]
    assert table.column("time").unit == "min"
    assert table["time"][-1] == pytest.approx(0.5)
    assert table["theta_velocity"][3] == pytest.approx(math.pi)


def test_reliability_has_the_rates_of_each_instant(tmp_path: Path) -> None:
    motion = "motion: {theta: [{from: 40, to: 100, time: 0.3, law: cycloidal}]}"
    asks = "dimensions: {rod.length: 0.05}, outputs: [P.x], methods: [analytic]"
    timed = mechdesign.reliability(load(f"reliability: {{{motion}, instants: 4, {asks}}}", tmp_path)).tables["moments"]
    rows = np.flatnonzero((timed["time"] > 0.05) & (timed["time"] < 0.15))
    drive = asked(f"kinematics: {{{motion}, instants: 4}}", tmp_path).tables["motion"]
    rates = (
        f"rates: {{theta: {drive['theta_velocity'][1]}}}, accelerations: {{theta: {drive['theta_acceleration'][1]}}}"
    )
    listed = f"reliability: {{poses: [{{theta: {drive['theta'][1]}}}], {rates}, {asks}}}"
    alone = mechdesign.reliability(load(listed, tmp_path)).tables["moments"]
    assert timed["order"][rows].tolist() == alone["order"].tolist() == ["position", "velocity", "acceleration"]
    np.testing.assert_allclose(timed["sigma"][rows], alone["sigma"], rtol=1e-9)


def test_other_questions_take_the_poses_of_the_motion(tmp_path: Path) -> None:
    text = """
kinematics: {motion: {theta: [{from: 40, to: 100, time: 0.3}]}, instants: 7}
stiffness:
  {link: rod, at: P, sections: {bar: {E: 2e5, width: 4, height: 8}}, elastic: {rod: bar}, actuators: {theta: 3e7}}
reliability: {dimensions: {rod.length: 0.05}, limits: {P.x: 0.1}, methods: [analytic]}
"""
    study = load(text, tmp_path)
    for table in (mechdesign.stiffness(study).tables["stiffness"], mechdesign.reliability(study).tables["reliability"]):
        assert "time" in table.names
        # The row of all poses together has no time.
        times = table["time"][np.isfinite(table["time"])]
        assert np.unique(times) == pytest.approx(np.linspace(0, 0.3, 7))
    for key, words in (("rates: {theta: 3}", "those of the motion of kinematics"), ("speed: 3", "leave out 'speed'")):
        told = problems(text.replace("{dimensions", f"{{{key}, dimensions"), tmp_path)
        assert words in told
    told = problems(text.replace("P.x: 0.1", "P.x_velocity: 0.1"), tmp_path)
    assert "needs 'rates', a 'speed' or a 'motion'" in told


def test_designs_are_judged_as_if_each_were_asked_alone(tmp_path: Path) -> None:
    """The time of a move and its rise are design variables: poses differ in number and in place."""
    text = """
kinematics:
  motion: {theta: [{from: 40, to: 40 + rise, time: fast, law: harmonic}, {dwell: 0.1}, {to: 40, time: 0.4}]}
  outputs: [P]
  instants: 9
optimize:
  variables: {rise: {from: 50, to: 70, number: 2}, fast: {from: 0.1, to: 0.3, number: 5}}
  minimize: [{result: kinematics.P.x_acceleration.peak}, {result: kinematics.P.y.mean}]
"""
    study = load(text, tmp_path)
    designs = mechdesign.optimize(study).tables["designs"]
    goals = [name for name in designs.names if name.startswith("kinematics")]
    assert len(designs) == 10
    assert len(np.unique(designs[goals[0]])) == 10
    for k in range(len(designs)):
        values = {f"mechanism.parameters.{name}": float(designs[name][k]) for name in ("rise", "fast")}
        extremes = mechdesign.kinematics(mechdesign.load(study.path, values)).tables["extremes"]
        row = extremes["output"].tolist().index("P.x_acceleration")
        peak = max(-extremes["min"][row], extremes["max"][row])
        assert designs[goals[0]][k] == pytest.approx(peak, rel=1e-9)
        # The mean is over time.
        many = mechdesign.load(study.path, {**values, "kinematics.instants": 20001})
        table = mechdesign.kinematics(many).tables["motion"]
        mean = np.trapezoid(table["P.y"], table["time"]) / table["time"][-1]
        assert designs[goals[1]][k] == pytest.approx(mean, rel=1e-7)


@pytest.mark.nightly
def test_the_animation_runs_over_the_time_of_the_motion(tmp_path: Path) -> None:
    for factor in (1, 4):
        cycle = f"{{to: 90, time: {0.3 * factor}}}, {{dwell: {0.1 * factor}}}, {{to: 0, time: {0.4 * factor}}}"
        result = asked(f"kinematics: {{motion: {{theta: [{cycle}]}}, outputs: [P]}}", tmp_path)
        with Image.open(result.save(tmp_path / f"{factor}", animate=True) / "motion.gif") as picture:
            assert picture.n_frames * picture.info["duration"] == pytest.approx(800 * factor, rel=0.12)


def test_radians_in_place_of_degrees_are_doubted(tmp_path: Path) -> None:
    study = load("kinematics: {motion: {theta: [{from: 0, to: 1.5707963, time: 1}]}}", tmp_path)
    assert any("if rad is meant" in str(warning) for warning in study.warnings)


def test_pictures_of_velocities_take_the_rates_of_the_motion(tmp_path: Path) -> None:
    motion = "motion: {theta: [{from: 40, to: 100, time: 0.3}]}, outputs: [P], pictures: [polygons]"
    assert asked(f"kinematics: {{{motion}}}", tmp_path).tables["motion"]["P.x_velocity"].any()
