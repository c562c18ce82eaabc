"""The drawing with dimensions: its numbers are the lengths of the links, apart from each other, and so is its table."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from helpers.gallery import study_named
from helpers.pages import faults
from helpers.studies import SLIDER_CRANK, study_of
from matplotlib.text import Text

import mechdesign
from mechdesign.door.exporting.sheet import BLOCK, PAPERS, PaperSheet
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.drawing import style
from mechdesign.drawing.dimensions import dimensions_picture, table_rows
from mechdesign.drawing.layout import draw
from mechdesign.drawing.scene import pose

FOUR_BAR = """
mechanism:
  parameters: {e: 45}
  links:
    ground: {O: [0, 0], D: [80, 60]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {C: [e, 60]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 105]}
reliability:
  dimensions: {crank.length: 0.05, rocker.length: {tolerance: [-0.1, 0.2]}, e: {sigma: 0.01}, theta: 0.5}
  outputs: [C]
  poses: [{theta: 90}]
stiffness: {at: C, sections: {bar: {E: 70 GPa, diameter: 8}}, elastic: {rocker: bar}, actuators: {theta: 1e6 N*mm/rad}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("look", ["screen", "paper"])
def test_numbers_of_a_four_bar_are_its_lengths_and_stand_apart(look):
    with style.context(look):
        figure = draw(dimensions_picture(study_of(FOUR_BAR)))
        figure.canvas.draw()
        assert not list(faults(figure))
        numbers = [text for text in figure.axes[0].texts if text.get_text()[:1].isdigit()]
        boxes = [Text.get_window_extent(text) for text in numbers]
    # The triangle's sides by Pythagoras: 45 and 60, twice; the ground's 80 and 60.
    assert sorted(text.get_text() for text in numbers) == sorted(
        ["30", "60", "75", "75", "90", "100 \N{ANGLE} 36.9\N{DEGREE SIGN}"]
    )
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_a_point_inside_its_link_has_its_place_in_the_table():
    study = study_of(FOUR_BAR.replace("{C: [e, 60]}", "{C: [e, 60], I: [40, 10]}"))
    rows = table_rows(study, pose(study.mechanism, study.mechanism.sketch_configuration))
    assert ("", "I in its frame", "(40, 10)", "", "") in rows


def test_the_table_tells_tolerances_and_sections():
    study = study_of(FOUR_BAR)
    rows = table_rows(study, pose(study.mechanism, study.mechanism.sketch_configuration))
    assert rows[0] == ("link", "between", "length", "tolerance", "section")
    by_link = {row[0]: row for row in rows if row[0]}
    assert by_link["crank"][2:] == ("30", "\N{PLUS-MINUS SIGN}0.05", "")
    assert by_link["rocker"][2:] == ("60", "+0.2 / -0.1", "bar \N{DIAMETER SIGN}8")
    assert by_link["e"][2:4] == ("45", "\N{GREEK SMALL LETTER SIGMA} = 0.01")
    assert by_link["theta"][3] == "\N{PLUS-MINUS SIGN}0.5 deg"


@pytest.mark.slow
def test_the_pose_that_fails_most_is_drawn_beside_the_sketch():
    from mechdesign.drawing.mechanism import mechanism_picture

    study = study_of(FOUR_BAR.replace("poses: [{theta: 90}]", "poses: [{theta: 90}, {theta: 40}]\n"
                                      "  limits: {C: {radius: 0.2}}\n  samples: 2000"))  # fmt: skip
    result = mechdesign.reliability(study)
    table = result.tables["reliability"]
    rows = table.take(table.where(scope="pose", method="monte_carlo"))
    worst = rows["theta"][rows["failure"].argmax()]
    with style.context():
        titles = [axes.get_title(loc="left") for axes in draw(mechanism_picture(study, result)).axes]
    assert any("the pose that fails most" in title and f"{worst:g}" in title for title in titles)


def test_slides_alone_have_no_dimensions_and_are_drawn_all_the_same():
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, carriage: {A: [0, 0]}, tool: {T: [0, 0]}}
  joints: {feed: {prismatic: [ground, carriage]}, cross: {prismatic: [carriage, tool], direction: 90}}
  drives: {x: {slide: feed}, y: {slide: cross}}
""")
    with style.context():
        figure = draw(dimensions_picture(study))
        style.encoded(figure)
        assert not list(faults(figure))
        assert len(figure.axes) == 1


def test_a_drawing_of_slides_tells_that_their_lengths_are_not_to_scale():
    table = """
mechanism:
  links: {ground: {O: [0, 0]}, carriage: {A: [0, 0]}, tool: {T: [0, 0]}}
  joints: {feed: {prismatic: [ground, carriage]}, cross: {prismatic: [carriage, tool], direction: 90}}
  drives: {x: {slide: feed}, y: {slide: cross}}
"""
    with style.context():
        titles = [dimensions_picture(study_of(text)).title for text in (table, FOUR_BAR)]
    assert "not to scale" in titles[0]
    assert "not to scale" not in titles[1]


@pytest.mark.slow
def test_a_sheet_is_at_a_standard_scale():
    for text, paper, scale, words in (
        (SLIDER_CRANK, None, 1.0, "1 : 1"),
        (SLIDER_CRANK, "A3", 1.0, "1 : 1"),
        ("units: {length: m}\n" + SLIDER_CRANK, None, 1 / 1000, "1 : 1000"),
        ("units: {length: cm}\n" + SLIDER_CRANK, None, 0.1, "1 : 10"),
    ):
        view = PosedStudy(mechdesign.load(text=text), paper=paper)
        scene = pose(view.mechanism, view.pose)
        sheet = PaperSheet.of(view, scene, 40.0)
        assert (sheet.scale, sheet.words) == (pytest.approx(scale), words)
        with style.context():
            figure = sheet.draw(view, scene, [])
        axes = figure.axes[1]
        wide, _ = PAPERS[sheet.paper]
        drawn = axes.get_position().width * wide / np.ptp(axes.get_xlim())
        assert drawn == pytest.approx(scale * view.millimetres)
        assert sheet.region[1] >= 10 + (sum(BLOCK) if sheet.paper == "A4" else 0)


@pytest.mark.slow
def test_the_white_behind_a_number_leaves_the_axes_whole() -> None:
    with style.context("paper"):
        figure = draw(dimensions_picture(study_named("oldham")))
        figure.canvas.draw()
        axes = figure.axes[0]
        numbers = [patch for text in axes.texts if text.get_text() and (patch := text.get_bbox_patch()) is not None]
        assert numbers
        for box in (patch.get_window_extent() for patch in numbers):
            assert box.x0 > axes.bbox.x0 + 0.5
            assert box.y0 > axes.bbox.y0 + 0.5
