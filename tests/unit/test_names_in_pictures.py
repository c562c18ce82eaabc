"""Names that are long, or in letters that few fonts have."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from helpers.command_line import ask
from helpers.pictures import figure_of
from helpers.studies import FOUR_BAR, study_of

import mechdesign
from mechdesign.drawing import fonts, style

# A point in a letter that one of Matplotlib's other fonts has, STIXGeneral.
TURNING = FOUR_BAR + "kinematics: {outputs: [P, rocker.angle], sweep: {theta: {from: 0, to: 360, step: 30}}}\n"


@pytest.mark.slow
def test_letters_without_a_font_are_told_in_one_sentence(tmp_path):
    done = ask("kinematics", "-", "--out", tmp_path, study=TURNING.replace("rocker", "曲柄").replace("rod", "연결봉"))
    assert done.exit_code == 0
    told = [line for line in done.stderr.splitlines() if "warning" in line.lower()]
    assert len(told) == 1, done.stderr
    assert "曲柄" in told[0]
    assert "install" in told[0]
    assert not any(word in done.stderr for word in ("Glyph", "missing from", "UserWarning"))


@pytest.mark.slow
def test_letters_of_an_installed_font_are_drawn_and_nothing_is_told(monkeypatch):
    study = study_of(TURNING.replace("P", "の"))
    assert "の" in fonts.lost_letters(str(study.resolved))
    result = mechdesign.kinematics(study)
    boxes = drawn(study, result)
    monkeypatch.setattr(fonts, "_EAST_ASIAN", ("STIXGeneral",))
    monkeypatch.setattr(fonts, "families", fonts.families.__wrapped__)
    assert fonts.lost_letters(str(study.resolved)) == ""
    assert not np.array_equal(drawn(study, result), boxes)


def drawn(study, result):
    """The mechanism's paths as pixels, without a warning."""
    with warnings.catch_warnings(action="error"), style.context():
        figure = figure_of(study, result, "paths")
        figure.canvas.draw()
        return np.asarray(figure.canvas.buffer_rgba())


def test_curves_of_names_that_differ_at_their_end_are_told_apart():
    name = "messpunkt_auf_der_übergroßen_pleuelstange_der_schmiedepresse"
    study = study_of(TURNING.replace("P", name))
    with style.context():
        figure = figure_of(study, mechdesign.kinematics(study), "motion")
        entries = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().texts]
    assert entries[:2] == ["messpunkt_auf…iedepresse.x", "messpunkt_auf…iedepresse.y"]
    assert len(set(entries)) == 3
