"""Curves, motions for controllers, the study as JSON, and the drawing sheet."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest
from helpers.command_line import ask, exported
from helpers.studies import SLIDER_CRANK

import mechdesign

SLIDER = (
    SLIDER_CRANK
    + """\
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 30}}
  rates: {theta: 60 rpm}
  outputs: [B.x]
"""
)
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 100], lower: [E, T, 80]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [50, 85], T: [120, 60]}
kinematics:
  path: {T: {circle: {center: [110, 60], radius: 20}, points: 12}}
  speed: 50 mm/s
"""


def rows_of(name, text, **said):
    reader = csv.reader(io.StringIO(exported(name, text, **said)[0].decode()))
    head = next(reader)
    return dict(zip(head, np.array([[float(cell) for cell in row] for row in reader]).T, strict=True))


def refused(name, text, code=2, **said):
    """Why a file is not made."""
    done = ask("export", "-", "--to", name, *(f"--{key}={value}" for key, value in said.items()), study=text)
    assert done.exit_code == code
    return done.stderr


def test_a_curve_is_exact_between_the_poses_of_the_study():
    table = rows_of("curve.csv", SLIDER)
    assert len(table["part"]) >= 721
    theta = np.radians(table["theta"])
    assert table["B.x"] == pytest.approx(30 * np.cos(theta) + np.sqrt(90**2 - (30 * np.sin(theta)) ** 2), abs=1e-9)
    assert set(table["part"]) == {1}


def test_a_constant_rate_gives_time_to_a_sweep():
    table = rows_of("motion.csv", SLIDER, rate="200 Hz")
    assert table["time"] == pytest.approx(np.arange(201) / 200)
    assert table["theta"] == pytest.approx(360 * table["time"])
    assert set(table["theta_velocity"]) == {360}
    assert not table["theta_acceleration"].any()


def test_a_law_is_told_at_the_rate_of_the_controller():
    law = "motion: {theta: [{from: 0, to: 90, time: 0.3, law: cycloidal}, {dwell: 0.1}]}\n  outputs: [B.x]\n"
    table = rows_of("motion.csv", SLIDER.split("  sweep")[0] + "  " + law, rate="0.8 ms")
    time = 0.0008 * np.arange(501)
    u = np.minimum(time / 0.3, 1.0)
    assert table["theta"] == pytest.approx(90 * (u - np.sin(2 * math.pi * u) / (2 * math.pi)), abs=1e-9)
    assert table["theta_velocity"] == pytest.approx(90 / 0.3 * (1 - np.cos(2 * math.pi * u)), abs=1e-6)
    moving = u < 0.999
    assert table["theta_acceleration"][moving] == pytest.approx(
        90 / 0.09 * 2 * math.pi * np.sin(2 * math.pi * u[moving]), abs=1e-6
    )


def test_a_path_is_passed_at_its_speed():
    table = rows_of("motion.csv", ARM)
    q1, q2 = np.radians(table["q1"]), np.radians(table["q2"])
    place = 100 * np.exp(1j * q1) + 80 * np.exp(1j * (q1 + q2))
    assert np.abs(place - (110 + 60j)) == pytest.approx(20, abs=1e-9)
    assert len(place) == int(1000 * 2 * math.pi * 20 / 50) + 1
    assert np.angle((place[1:] - (110 + 60j)) / (place[:-1] - (110 + 60j))) == pytest.approx(0.0025, abs=1e-9)
    assert np.gradient(table["q1"], 0.001)[1:-1] == pytest.approx(table["q1_velocity"][1:-1], abs=1e-3)


def test_a_motion_without_time_says_what_is_missing():
    still = SLIDER.replace("  rates: {theta: 60 rpm}\n", "")
    backwards = SLIDER.replace("60 rpm", "-60 rpm")
    wrong = (
        (still, "the motion has no time: give kinematics 'rates'"),
        (backwards, "runs against its rate"),
        (SLIDER.replace("sweep: {theta: {from: 0, to: 360, step: 30}}", "poses: [{theta: 0}]"), "listed poses"),
    )
    for text, words in wrong:
        assert words in refused("motion.csv", text)
    for rate in ("fast", "0 Hz", "2 mm", "-1 ms"):
        assert "--rate is a rate such as" in refused("motion.csv", SLIDER, rate=rate)
    short = SLIDER.replace("[A, B, 90]", "[A, B, 25]").replace("105, 0", "40, 0")
    assert "has no valid pose" in refused("motion.csv", short, code=3)


def test_the_study_as_json_gives_the_same_tables(tmp_path):
    text = SLIDER.replace("[O, A, 30]", "[O, A, r]").replace("links:", "parameters: {r: 30}\n  links:", 1)
    change = {"mechanism.parameters.r": 20}
    copy = tmp_path / "study.json"
    copy.write_bytes(exported("study.json", text, change)[0])
    assert json.loads(copy.read_text())["mechanism"]["links"]["crank"] == ["O", "A", "r"]
    one, other = (
        mechdesign.kinematics(study).tables
        for study in (mechdesign.load(text=text, overrides=change), mechdesign.load(copy))
    )
    assert one.keys() == other.keys()
    for name, table in one.items():
        assert table.names == other[name].names
        for column in table.names:
            np.testing.assert_array_equal(table[column], other[name][column])


def test_a_sheet_is_the_same_bytes_and_has_the_size_of_its_paper():
    data, _ = exported("sheet.pdf", SLIDER)
    assert data == exported("sheet.pdf", SLIDER)[0]
    assert data.startswith(b"%PDF")
    assert b"mechdesign" in data
    box = data.split(b"/MediaBox [")[1].split(b"]")[0].split()
    assert [float(side) * 25.4 / 72 for side in box[2:]] == pytest.approx([210, 297], abs=0.01)
    assert "--paper is A4 or A3, not 'A5'" in refused("sheet.pdf", SLIDER, paper="A5")
