"""A study drawn over the one before a change: its curves and places are in the pictures, and both are named."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import study_of
from typer.testing import CliRunner

import mechdesign
from mechdesign.door.cli.app import app
from mechdesign.door.report.page.moving import moving
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.overlay import COLOR
from mechdesign.drawing.pictures import figures
from mechdesign.ground.errors import StudyError

FOUR_BAR = """
mechanism:
  links:
    ground: {{O: [0, 0], D: [100, 0]}}
    crank: [O, A, 30]
    rod: {{from: A, to: B, length: 90, points: {{C: [45, 40]}}}}
    rocker: [D, B, {rocker}]
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0, 30], B: [75, 55]}}
kinematics:
  {motion}
"""
SWEEP = "sweep: {theta: {from: 0, to: 360, step: 5}}"
ARM = """
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, E, 50], lower: [E, P, {lower}]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: lower, from: upper}}}}
  sketch: {{E: [30, 30], P: [10, 50]}}
workspace: {{point: P, scan: {{about: [0, 0]}}}}
"""


def overlaid(command, now, then):
    results = [getattr(mechdesign, command)(study) for study in (now, then)]
    return results[0], Before.of(now, results[0], then, results[1])


@pytest.mark.slow
def test_names_are_drawn_letter_by_letter(tmp_path):
    """No formula of TeX, and no mark that turns the letters round, which no font has."""
    file = tmp_path / "study.yaml"
    file.write_text(FOUR_BAR.format(rocker=60, motion=SWEEP))
    now, then = (mechdesign.load(file, overrides=[f"name={name}"]) for name in ("a", "$\\frac$ \u202e"))
    result, before = overlaid("kinematics", now, then)
    with style.context():
        figure = figure_of(now, result, "paths", before)
        drawn = style.encoded(figure, "svg").decode()
    (legend,) = figure.legends
    assert legend.get_texts()[1].get_text() == r"study, name=\$\frac\$ \u202e (before)"
    assert drawn.isascii() or "\u202e" not in drawn


@pytest.mark.slow
def test_curves_and_paths_before_are_dashed_under_those_now():
    now, then = (study_of(FOUR_BAR.format(rocker=rocker, motion=SWEEP)) for rocker in (60, 68))
    result, before = overlaid("kinematics", now, then)
    with style.context("paper"):
        found = figures(now, result, before)
        assert not found.failed
        for figure in found.values():
            figure.canvas.draw()
    table = before.result.tables["motion"]
    path = np.column_stack([table["C.x"], table["C.y"]])
    (axes,) = found["paths"].axes
    grey = [line.get_xydata() for line in axes.lines if line.get_color() == COLOR and line.get_linestyle() == "--"]
    assert any(line.shape == path.shape and np.allclose(line, path) for line in grey)
    for places, (low, high) in zip(path.T, (axes.get_xlim(), axes.get_ylim()), strict=True):
        assert low < places.min()
        assert places.max() < high
    curves = [line for axes in found["motion"].axes for line in axes.lines if line.get_linestyle() == "--"]
    for name in ("C.x", "C.y_velocity", "rocker.angle"):
        if name in table:
            # A curve passes every row, and places between them.
            assert any(np.isin(table[name], line.get_ydata()).all() for line in curves), name
    for name in ("motion", "paths"):
        words = [text.get_text() for text in found[name].legends[-1].get_texts()]
        assert sum(text.endswith(("(now)", "(before)")) for text in words) == 2


@pytest.mark.slow
def test_curves_before_are_beside_the_mechanism_that_moves():
    now, then = (study_of(FOUR_BAR.format(rocker=rocker, motion=SWEEP), f"name=arm{rocker}") for rocker in (60, 68))
    result, before = overlaid("kinematics", now, then)
    assert "(before)" in moving(now, result, before).beside
    assert "(before)" not in moving(now, result).beside


@pytest.mark.nightly
def test_the_boundary_before_is_in_the_picture_of_the_workspace():
    now, then = (study_of(ARM.format(lower=lower)) for lower in (30, 40))
    result, before = overlaid("workspace", now, then)
    with style.context():
        figure = figure_of(now, result, "workspace", before)
        figure.canvas.draw()
    grey = [line.get_xydata() for line in figure.axes[0].lines if line.get_color() == COLOR]
    radii = np.hypot(*np.concatenate([line for line in grey if len(line) > 3]).T)
    # The arm before reaches from the difference of its links to their sum.
    assert radii.min() == pytest.approx(10, rel=1e-6)
    assert radii.max() == pytest.approx(90, rel=1e-6)
    assert figure.axes[0].get_xlim()[1] > 90


def test_motions_of_other_coordinates_are_not_drawn_over_each_other():
    now = study_of(FOUR_BAR.format(rocker=60, motion=SWEEP))
    for motion, message in (
        ("poses: [{theta: 10}]", "only a sweep or a path is drawn over another"),
        (SWEEP.replace("theta", "phi"), "it moves phi, this study theta"),
    ):
        drive = "phi" if "phi" in motion else "theta"
        then = study_of(FOUR_BAR.format(rocker=60, motion=motion).replace("drives: {theta", f"drives: {{{drive}"))
        result = mechdesign.kinematics(now)
        with pytest.raises(StudyError, match=message):
            Before.of(now, result, then, mechdesign.kinematics(then))


@pytest.mark.nightly
def test_the_command_line_records_the_study_before_and_names_it_in_errors(tmp_path):
    now, then = tmp_path / "now.yaml", tmp_path / "then.yaml"
    now.write_text(FOUR_BAR.format(rocker=60, motion=SWEEP))
    asked = ["kinematics", str(now), "--set", "mechanism.links.rocker=[D, B, 65]", "--before", str(now),
             "--out", str(tmp_path / "out")]  # fmt: skip
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "out" / "manifest.json").read_text())["before"]
    assert told["study"]["name"] == "now"
    assert told["overrides"] == []
    then.write_text(FOUR_BAR.format(rocker=60, motion="poses: [{theta: 10}]"))
    wrong = CliRunner().invoke(app, [*asked[:-4], "--before", str(then), *asked[-2:]])
    assert wrong.exit_code == 2
    assert "--before then: only a sweep or a path" in wrong.stderr
    then.write_text("mechanism: {links: {}}\n")
    wrong = CliRunner().invoke(app, [*asked[:-4], "--before", str(then), *asked[-2:]])
    assert wrong.exit_code == 2
    assert "then.yaml" in wrong.stderr
    assert CliRunner().invoke(app, [*asked, "--no-plots"]).exit_code == 2
