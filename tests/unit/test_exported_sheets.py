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
from matplotlib.text import Text

import mechdesign
from mechdesign.drawing import style

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


PRESS = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 20], C: [-60, 0]}
    crank: {from: O, to: A, length: 30, width: 14}
    coupler: {from: A, to: B, length: 90, points: {P: [45, 25]}}
    rocker: {from: D, to: B, length: 60}
    pinion: {points: {C: [0, 0], M: [12, 0]}}
  drives: {theta: {angle: pinion}}
  couplings: {gears: {set: crank, of: theta, ratio: -0.5, module: 2 mm}}
  sketch: {A: [0, 30], B: [75, 55], M: [-50, 0]}
  plates: {width: 16, pin: 6, kerf: 0.2, thickness: 5, general_tolerance: ISO 2768-m}
kinematics: {sweep: {theta: {from: 0, to: 720, step: 15}}, outputs: [P]}
reliability:
  poses: [{theta: 30}]
  outputs: [P]
  dimensions: {crank.length: 0.05, rocker.length: {tolerance: [-0.1, 0.2]}, ground.D.x: 0.02}
"""
CAM = """
mechanism:
  links: {ground: {O: [0, 0]}, disc: [O, N, 20], stem: {F: [0, 0], T: [60, 0]}}
  joints: {valve: {prismatic: [ground, stem], through: O, direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings:
    lift: {set: valve, of: cam, law: [{to: 60, over: 120, law: cycloidal}, {dwell: 60}, {to: 40, over: 180}],
      cam: {link: disc, roller: F, radius: 8}}
  sketch: {N: [20, 0], F: [0, 40], T: [0, 100]}
kinematics: {sweep: {cam: {from: 0, to: 360, step: 10}}, outputs: [F.y]}
"""


def drawn(text, monkeypatch):
    """The figure of a sheet as it is written."""
    figures = []

    def kept(figure, *options):
        figures.append(figure)
        return encoded(figure, *options)

    encoded = style.encoded
    monkeypatch.setattr(style, "encoded", kept)
    exported("sheet.pdf", text)
    return figures[0]


def rows_on(figure):
    """The words on the page outside of the drawing, line by line, and those at dimensions."""
    page, drawing = figure.axes[0], figure.axes[1]
    lines = {}
    for words in page.texts:
        if words.get_text():
            lines.setdefault(round(words.get_position()[1], 2), []).append(words.get_text())
    return list(lines.values()), [words.get_text() for words in drawing.texts if words.get_text()]


@pytest.mark.slow
def test_a_sheet_has_what_a_workshop_needs_of_plates_pivots_and_gears(monkeypatch):
    rows, numbers = rows_on(drawn(PRESS, monkeypatch))
    flat = [" ".join(row) for row in rows]

    def stands(*words):
        return any(" ".join(words) in line for line in flat)

    # By hand: 60 mm apart, twice as many teeth: 20 and 40 mm, so 20 and 40 teeth of 2 mm.
    assert stands("wheels", "link", "teeth", "module", "pitch radius", "centre distance", "pressure angle")
    assert stands("gears", "crank", "40", "2", "40", "60", "20\N{DEGREE SIGN}")
    assert stands("pinion", "20", "2", "20")
    assert stands("pivot", "x", "y")
    for pivot in (("O", "0", "0"), ("D", "100 \N{PLUS-MINUS SIGN}0.02", "20"), ("C", "-60", "0")):
        assert stands(*pivot)
    assert stands("plate", "width", "thickness")
    assert stands("ground, coupler, rocker, pinion", "16", "5")
    assert stands("crank", "14", "5")
    assert stands("ISO 2768-m")
    assert any("plates to scale" in line for line in flat)
    # Tolerances stand at their dimensions, and pivots are apart in x and y.
    assert {"30 \N{PLUS-MINUS SIGN}0.05", "60 +0.2 / -0.1", "100", "20"} <= {*numbers}
    assert not any("\N{ANGLE}" in number for number in numbers)


@pytest.mark.slow
def test_plates_are_drawn_as_wide_as_they_are(monkeypatch):
    figure = drawn(PRESS.replace("width: 14", "width: 24"), monkeypatch)
    lines = [line.get_xydata() @ [1, 1j] for line in figure.axes[1].lines if len(line.get_xdata()) > 40]
    # The crank's wheel of 84 mm tip diameter about O, and the end of the rocker's plate about D.
    assert any(np.allclose(np.abs(line), 42, atol=1e-9) for line in lines)
    assert any(np.abs(np.abs(line - (100 + 20j)) - 8).min() < 1e-9 for line in lines)


@pytest.mark.slow
def test_a_sheet_without_plates_says_that_it_is_schematic_and_has_the_sizes_of_cams(monkeypatch):
    rows, _ = rows_on(drawn(CAM, monkeypatch))
    flat = [" ".join(row) for row in rows]
    assert any("schematic, as the study has no plates" in line for line in flat)
    assert any("cam link base radius follower from to lift" in line for line in flat)
    # The base circle of the profile: 40 mm to the roller's centre, less its radius.
    assert any("lift disc 32 roller of radius 8 40 mm 60 mm 20 mm" in line for line in flat)
    assert any(
        "valve.slide: to 60 over 120 by cycloidal, dwell 60, to 40 over 180 by polynomial345" in line for line in flat
    )
    assert any("none is given" in line for line in flat)


@pytest.mark.slow
def test_a_class_that_all_dimensions_have_is_the_general_tolerance(monkeypatch):
    text = SLIDER + "reliability: {dimensions: {'*.length': ISO 2768-f}, outputs: [B.x], poses: [{theta: 20}]}\n"
    rows, numbers = rows_on(drawn(text, monkeypatch))
    assert any("ISO 2768-f" in row for row in rows)
    assert "30 \N{PLUS-MINUS SIGN}0.1" in numbers


@pytest.mark.slow
def test_nothing_on_a_sheet_is_in_smaller_type_than_six_points(monkeypatch):
    """Long names once made tables of five points."""
    name = "pleuelstange_der_übergroßen_schmiedepresse_mit_schwungrad_ab"
    drawn = []
    monkeypatch.setattr(style, "encoded", lambda figure, *said: drawn.append(figure) or b"")
    exported("sheet.pdf", SLIDER.replace("rod", name))
    (sheet,) = drawn
    words = [text for text in sheet.findobj(Text) if text.get_visible() and text.get_text()]
    assert min(text.get_fontsize() for text in words) >= 6
    assert not any(name in text.get_text() for text in words)
