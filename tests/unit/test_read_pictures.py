"""What is read in pictures: colours of links, scales, units of places, designs described once."""

from __future__ import annotations

import io

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import study_of
from PIL import Image

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Axis, Panel, Picture, Trace

FOUR_BAR = """
units: {length: mm}
mechanism:
  parameters: {a: 30, b: 90}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, a]
    rod: {from: A, to: B, length: b, points: {P: [45, 20]}}
    rocker: [D, B, 60]
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""


def test_pale_links_keep_their_colours_in_a_file() -> None:
    """Blue and green of 22 % over white are 40 of 255 apart: one is not drawn in the other's."""
    pale = {"#0072B2": (0.78 * 255, 0.78 * 255 + 0.22 * 114, 0.78 * 255 + 0.22 * 178),
            "#009E73": (0.78 * 255, 0.78 * 255 + 0.22 * 158, 0.78 * 255 + 0.22 * 115)}  # fmt: skip
    with style.context():
        lines = [Trace([0, 9], [k, k + 1], look={"color": color, "alpha": 0.22, "linewidth": 6})
                 for k, color in enumerate(pale)]  # fmt: skip
        data = style.encoded(draw(Picture("Links", [Panel(lines, Axis("x"), Axis("y"))])))
    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).reshape(-1, 3).astype(float)
    for color in pale.values():
        assert (np.abs(pixels - color).max(axis=1) <= 4).sum() > 500


@pytest.mark.parametrize("ends", [(-0.115, 0.115), (0.3, 1.2), (-130, 130)])
def test_a_narrow_axis_has_two_numbers(ends: tuple[float, float]) -> None:
    with style.context("paper"):
        panels = [Panel([Trace(ends, (0, 1))], Axis("error", "cm", ends=ends), Axis("density", "1/cm"))] * 2
        figure = draw(Picture("Errors", panels, across=2))
        figure.canvas.draw()
        for axes in figure.axes:
            low, high = axes.get_xlim()
            assert sum(low <= place <= high for place in axes.get_xticks()) >= 2


def test_a_unit_stays_in_one_line_and_what_follows_it_stays_behind_it() -> None:
    with style.context("paper"):
        y = Axis("follower.angle acceleration", "deg/s^2")
        figure = draw(Picture("", [Panel([Trace([0, 1], [0, 2e-4])], Axis("mass [g], less is better"), y)] * 3))
        for axes in figure.axes:
            assert "[10⁻⁶ deg/s²]" in axes.get_ylabel()
        assert figure.axes[-1].get_xlabel() == "mass [g], less is better"


@pytest.mark.nightly
def test_a_goal_that_is_a_variable_is_said_once_of_a_design() -> None:
    study = study_of(f"""{FOUR_BAR.replace("60]", "c]").replace("b: 90", "b: 90, c: 60")}
kinematics: {{sweep: {{crank: {{from: 20, to: 80, step: 20}}}}, outputs: [rocker.angle]}}
optimize:
  method: pareto
  variables: {{a: {{from: 25, to: 35}}, b: {{from: 85, to: 95}}, c: {{from: 55, to: 65}}}}
  minimize: [kinematics.rocker.angle.range, c]
  evaluations: 60
""")
    result = mechdesign.optimize(study)
    with style.context():
        lines = figure_of(study, result, "designs").axes[0].get_xticklabels()
        assert [line.get_text() for line in lines].count("c [mm]") == 1
        panels = [axes.get_title(loc="left").split("\n") for axes in figure_of(study, result, "optimum").axes]
        assert len(panels) > 1
        for lines in panels:
            assert [line.split()[:2] for line in lines].count(["c", "="]) == 1, lines


def test_places_of_instant_centres_that_are_not_drawn_have_their_unit() -> None:
    study = study_of(f"""{FOUR_BAR}
kinematics:
  outputs: [P]
  sweep: {{crank: {{from: 0, to: 360, step: 15}}}}
  instant_centres: [[rod, ground]]
""")
    with style.context():
        figure = figure_of(study, mechdesign.kinematics(study), "poses")
    remarks = [line for axes in figure.axes for line in axes.get_title(loc="left").split("\n") if "centre of" in line]
    assert remarks
    assert all(line.endswith(") mm") for line in remarks)


def test_drives_of_different_units_have_theirs_in_the_legend() -> None:
    study = study_of("""
units: {length: mm}
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, A, 100], hand: {T: [0, 0]}}
  joints: {reach: {prismatic: [arm, hand]}}
  drives: {q: {angle: arm}, s: {slide: reach}}
  limits: [{drive: q, min: 0, max: 90 deg}, {drive: s, min: 50, max: 80}]
  sketch: {A: [100, 0], T: [60, 0]}
workspace: {point: T, scan: {about: [46, 46], rays: 31}, characteristic_length: 50}
""")
    with style.context():
        legend = figure_of(study, mechdesign.workspace(study), "drives").legends[0]
    assert {"q [deg]", "s [mm]"} <= {text.get_text() for text in legend.get_texts()}


def test_a_number_and_its_unit_stay_in_one_line() -> None:
    lines = style.folded("1: four-bar, error 0.25 mm\ntransmission 62.5 deg", 9.5, 1.35).split("\n")
    assert len(lines) > 2
    assert {"0.25 mm", "62.5 deg"} <= {number for line in lines for number in ("0.25 mm", "62.5 deg") if number in line}
