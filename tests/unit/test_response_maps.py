"""Response maps: contours of limits where the closed form has them, what is hatched, what is left out or a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

import mechdesign
from mechdesign.experiments.figures.sweep.planes import REDUCTIONS, CasePlane, Gates
from mechdesign.experiments.figures.sweep.quantities import CaseAxis, sample
from tests.unit.test_cases import SLIDER_CRANK

STROKE, ANGLE = "kinematics.extremes.B.x.range", "kinematics.rod.angle.max"
R, L = "mechanism.parameters.r", "mechanism.parameters.l"


def answer_of(vary: dict[str, Any], **more: Any) -> Any:
    overrides = {"matrix": {"vary": vary, "results": [ANGLE], **more}}
    return mechdesign.sweep(mechdesign.load(text=SLIDER_CRANK, overrides=overrides))


def maps_of(figure: Figure) -> list[Any]:
    return [axes for axes in figure.axes if axes.get_title(loc="left")]


def axis(name: str, values: Any, **limits: float) -> CaseAxis:
    return CaseAxis(name, "mm", np.asarray(values, dtype=float), (), limits.get("low"), limits.get("high"))


def contours(figure: Figure) -> list[np.ndarray]:
    """Points of the contours of limits on the first map."""
    axes = maps_of(figure)[0]
    sets = [each for each in axes.collections if isinstance(each, ContourSet) and not each.filled]
    return [each.get_paths()[0].vertices for each in sets if np.array_equal(each.levels, [0.0])]


@pytest.mark.nightly
@pytest.mark.parametrize("design", [{}, {"method": "sobol", "samples": 128}])
def test_limits_are_contours_where_the_closed_form_has_them(design):
    vary = {R: "30:46", L: "90:130"} if design else {R: "30:46:2", L: "90:130:4"}
    figure = answer_of(vary, **design).figure("response")
    assert [axes.get_title(loc="left") for axes in maps_of(figure)] == [
        f"{STROKE} [mm]", "|kinematics.rod.angle| [deg]", f"{ANGLE} [deg]",
    ]  # fmt: skip
    stroke, swing = contours(figure)
    # The stroke is twice the crank, the largest angle of the rod has the ratio of crank and rod for its sine.
    np.testing.assert_allclose(stroke[:, 0], 35, atol=1e-6)
    np.testing.assert_allclose(stroke[:, 1].max() - stroke[:, 1].min(), 40, atol=3)
    np.testing.assert_allclose(np.degrees(np.arcsin(swing[:, 0] / swing[:, 1])), 25, atol=0.15)


def test_hatched_is_where_what_is_required_is_not_met():
    r, length = (values.ravel() for values in np.meshgrid(np.arange(30.0, 46, 2), np.arange(90.0, 131, 5)))
    met = np.ones(len(r), dtype=bool)
    met[0] = False
    table = mechdesign.Table("sweep", (mechdesign.Column("s_met", r > 35.05), mechdesign.Column("q_met", met)))
    limited = [axis("s", 2 * r, low=70.1), axis("q", np.where(met, r + length, np.nan), high=160.03)]
    plane = CasePlane.of(axis("r", r), axis("l", length), others=False)
    assert plane is not None
    gates = Gates.of(plane, limited, table)
    x, y = np.meshgrid(*plane.fine)
    # Beside the case without a number nothing is met.
    beside = (x <= 32) & (y <= 95)
    inside = (x >= 35.05) & (x + y <= 160.03)
    np.testing.assert_array_equal((gates.joint >= 0)[~beside], inside[~beside])
    assert not (gates.joint >= 0)[beside].any()
    assert gates.crossed(0)


def test_over_other_entries_a_map_has_what_is_best_of_the_cases_that_count():
    x, y, z = (values.ravel() for values in np.meshgrid([0.0, 1.0], [0.0, 2.0], [1.0, 2.0, 4.0]))
    plane = CasePlane.of(axis("x", x), axis("y", y), others=True)
    assert plane is not None
    counted = z < 3
    shown = {word: plane.field(10 * x + z, counted, reduction) for reduction, word in REDUCTIONS.values()}
    fine = 10 * np.meshgrid(*plane.fine)[0]
    for word, z_shown in (("largest", 2), ("smallest", 1), ("mean", 1.5)):
        np.testing.assert_allclose(shown[word], fine + z_shown)
    # Of no case that counts all of them are shown.
    np.testing.assert_allclose(plane.field(10 * x + z, z > 5, REDUCTIONS[-1][0]), fine + 4)


@pytest.mark.slow
def test_titles_say_what_is_shown_of_other_entries():
    vary = {R: "30:46:8", L: "90:130:20", "mechanism.branch": ["side", "follow"]}
    figure = answer_of(vary, best={"maximize": ANGLE}).figure("response")
    titles = [axes.get_title(loc="left").replace("\n", " ") for axes in maps_of(figure)]
    assert titles == [
        f"{ANGLE} [deg], largest over branch", f"{STROKE} [mm], largest over branch",
        "|kinematics.rod.angle| [deg], smallest over branch",
    ]  # fmt: skip
    best = [text.get_text() for text in figure.legends[0].get_texts() if text.get_text().startswith("best: ")]
    assert best == ["best: case 7 (r 38, l 90, branch side) and 1 more as good"]


def test_cases_scattered_over_three_entries_are_gathered_in_classes():
    x, y = np.random.default_rng(5).random((2, 2000))
    plane = CasePlane.of(axis("x", x), axis("y", y), others=True)
    assert plane is not None
    assert 3 <= plane.classes < 20
    field = plane.field(x, np.ones(len(x), dtype=bool), REDUCTIONS[0][0])
    np.testing.assert_allclose(field, np.meshgrid(*plane.fine)[0], atol=0.06)


def test_triangles_between_scattered_cases_follow_a_plane_and_leave_out_what_failed():
    x, y = np.random.default_rng(6).random((2, 60)) * [[1.0], [1000.0]]
    values = 3 * x - 0.002 * y
    plane = CasePlane.of(axis("x", x), axis("y", y), others=False)
    assert plane is not None
    every = np.ones(60, dtype=bool)
    field = plane.field(values, every, REDUCTIONS[0][0])
    across, up = np.meshgrid(*plane.fine)
    known = np.isfinite(field)
    np.testing.assert_allclose(field[known], (3 * across - 0.002 * up)[known], atol=1e-9)
    values[20] = np.nan
    assert np.isfinite(plane.field(values, every, REDUCTIONS[0][0])).sum() < known.sum()


@pytest.mark.nightly
@pytest.mark.parametrize("vary", [{R: "30:46:2"}, {R: "30:46:2", "mechanism.branch": ["side", "follow"]}])
def test_there_is_no_map_of_one_number_that_varies(vary):
    assert "response" not in answer_of(vary).figures


def test_cases_on_a_line_span_no_map():
    assert CasePlane.of(axis("x", [0, 1, 2]), axis("y", [5, 6, 7]), others=False) is None


@pytest.mark.nightly
def test_of_many_cases_a_sample_is_drawn_with_the_best_and_the_front(monkeypatch: pytest.MonkeyPatch):
    count = 40_000
    rank = np.where(np.arange(count) == 12_345, 1.0, 2.0)
    front = np.isin(np.arange(count), [12_345, 777, 31_000])
    table = mechdesign.Table("sweep", (mechdesign.Column("rank", rank), mechdesign.Column("front", front)))
    rows, _ = sample(table, 500)
    assert {12_345, 777, 31_000} <= {*rows.tolist()}
    assert 500 <= len(rows) <= 503
    # Evenly spread, also over the last entry of a grid.
    for part in (rows // (count // 10), rows % 100 // 10):
        assert np.bincount(part, minlength=10).min() > 40
    assert sample(table, count)[0].tolist() == [*range(count)]

    monkeypatch.setattr("mechdesign.experiments.figures.sweep.maps.MOST_OVER_MAP", 20)
    monkeypatch.setattr("mechdesign.experiments.figures.sweep.effects.MOST_DRAWN", 20)
    answer = answer_of({R: "30:46:2", L: "90:130:4"})
    for name, words in (("response", "dots: a sample of 20 of them"), ("scatter", "an even sample of 20 of 99 cases")):
        figure = answer.figure(name)
        said = [text.get_text() for text in (figure.texts or [figure._suptitle]) if text is not None]
        assert words in " ".join(said).replace("\n", " ")
