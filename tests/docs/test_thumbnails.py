"""Thumbnails of the gallery: they move as the mechanism does, stand still on request, and are small."""

from __future__ import annotations

import re

import gallery
import numpy as np
import pytest
import thumbnails

import mechdesign


def keyframes(svg: str, key: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """The frames of a property in each rule of an SVG that moves by it: shares of the time, and the values."""
    rules = []
    for rule in re.findall(r"@keyframes \S+?\{((?:[^{}]+\{[^{}]*\})+)\}", svg):
        frames = re.findall(rf"([\d.]+)%\{{[^}}]*{key}:([^;}}]+)", rule)
        values = [[float(number) for number in re.findall(r"-?[\d.]+", text)] for _, text in frames]
        rules.append((np.array([float(share) / 100 for share, _ in frames]), np.array(values)))
    return rules


@pytest.fixture(scope="module")
def four_bar() -> str:
    """The thumbnail of a crank-rocker whose crank turns evenly."""
    svg = thumbnails.thumbnail(gallery.studies()["four_bar"])
    assert svg is not None
    return svg


def test_pins_are_where_the_solver_has_them_between_the_frames_too(four_bar: str) -> None:
    time = np.linspace(0, 1, 200)
    study = mechdesign.load(gallery.studies()["four_bar"])
    solved = study.mechanism.solve({"crank": 360 * time})
    for shares, values in keyframes(four_bar, "translate"):
        if len(values) < 3:
            continue
        drawn = np.interp(time, shares, values[:, 0]) - 1j * np.interp(time, shares, values[:, 1])
        beside = []
        for point in study.mechanism.points:
            path = np.asarray(solved[f"{point}.x"]) + 1j * np.asarray(solved[f"{point}.y"])
            # The drawing is the plane, moved and enlarged.
            basis = np.column_stack([path, np.ones_like(path)])
            fit, *_ = np.linalg.lstsq(basis, drawn, rcond=None)
            if abs(fit[0].imag) < 0.01 * fit[0].real:
                beside.append(np.abs(basis @ fit - drawn).max())
        assert min(beside) < 2.0


def test_a_full_turn_is_360_degrees_in_two_frames(four_bar: str) -> None:
    turns = [values[:, 0] for _, values in keyframes(four_bar, "rotate") if len(values)]
    assert any(len(values) == 2 and abs(abs(values[1] - values[0]) - 360) < 0.2 for values in turns)


def test_it_is_small_has_no_script_and_stands_still_where_less_motion_is_wanted(four_bar: str) -> None:
    assert len(four_bar) < 15_000
    assert "<script" not in four_bar
    assert "<text" not in four_bar
    assert "@media(prefers-reduced-motion:reduce){*{animation:none!important}}" in four_bar


def test_a_study_without_a_motion_has_none() -> None:
    assert thumbnails.thumbnail(gallery.studies()["scara"]) is None


def test_the_linkage_of_a_task_moves_through_its_positions() -> None:
    moving = thumbnails.best(mechdesign.load(gallery.studies()["five_positions"]))
    path = mechdesign.kinematics(moving).main
    for place in (0, 19 + 13j, 46 + 21j, 67 + 18j, 89 - 2j):
        assert np.abs(path["P.x"] + 1j * path["P.y"] - place).min() < 1


def test_frames_are_found_where_two_poses_stand_at_the_same_time() -> None:
    # As beside a limit of a motion: the last step takes no time, and what moves goes on by 3 units.
    places = np.array([[0.0], [10.0], [13.0]])
    svg = thumbnails._rule("m-0", {"translate": places}, np.array([0.0, 1.0, 1.0]))
    assert re.findall(r"translate:(\d+)px", svg)[-1] == "13"
