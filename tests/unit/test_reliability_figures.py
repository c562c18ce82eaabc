"""Pictures of reliability: which are drawn for which study, and what is in them."""

from __future__ import annotations

from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import study_of
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from matplotlib.path import Path as Outline

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.looks import look
from mechdesign.drawing.panels import number, plane
from mechdesign.drawing.pictures import figures
from mechdesign.questions.poses import study_poses
from mechdesign.questions.reliability.figures.bars import allocation, contributions
from mechdesign.questions.reliability.figures.densities import SHARES, smoothed
from mechdesign.questions.reliability.schema.methods import METHODS

SLIDER = """
units: {length: mm}
mechanism:
  parameters: {r: 40, l: 120}
  links:
    ground: {O: [0, 0]}
    crank: [O, A, r]
    rod: [A, B, l]
    slider: {B: [0, 0]}
  joints:
    guide: {prismatic: [ground, slider], through: O}
  drives: [crank]
  sketch: {A: [30, 20], B: [150, 0]}
reliability:
  dimensions: {r: 0.3, l: 0.3}
  outputs: [B.x]
  limits: {B.x: 0.2}
  samples: 2000
"""
ARM = """
units: {length: mm}
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, E, 100]
    lower: [E, P, 80]
  drives: {q1: {angle: upper}, q2: {angle: lower}}
  sketch: {E: [70, 70], P: [50, 140]}
workspace: {point: P, scan: {about: [0, 0]}}
reliability:
  dimensions: {"*.length": 0.3}
  clearances: {E: {radial: 0.1, pin: normal_in_disc, link: lower}}
  outputs: [P]
  limits: {P: {radius: 0.25}}
  samples: 2000
"""
LISTED = "reliability.poses=[{crank: 30}, {crank: 60}]"
SWEPT = "reliability.sweep={crank: {from: 0, to: 180, step: 30}}"
CORNER = "reliability.poses=[{q1: 30, q2: 90}]"


def drawn(text: str, *overrides: str):
    study = study_of(text, "reliability.sobol=0", *overrides)
    result = mechdesign.reliability(study)
    with style.context():
        found = figures(study, result)
        for figure in found.values():
            assert style.encoded(figure).startswith(b"\x89PNG")
    return found, result


def one(name: str, text: str, *overrides: str):
    """A picture, and the result that it is of."""
    study = study_of(text, "reliability.sobol=0", *overrides)
    result = mechdesign.reliability(study)
    with style.context():
        figure = figure_of(study, result, name)
        figure.canvas.draw()
    return figure, result


def legend(figure: Figure) -> list[str]:
    (shown,) = [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]
    return [text.get_text() for text in shown.get_texts()]


def texts(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


@pytest.mark.nightly
@pytest.mark.parametrize("method", METHODS)
def test_every_method_alone_is_drawn(method: str) -> None:
    found, _ = drawn(SLIDER, LISTED, f"reliability.methods=[{method}]")
    assert {"reliability", "contributions"} <= set(found)
    assert len(legend(found["reliability"])) >= 1
    assert legend(found["reliability"])[0].startswith(look(method).words)


@pytest.mark.nightly
def test_a_listed_pose_without_a_value_is_left_empty() -> None:
    figure, _ = one("reliability", ARM, "reliability.poses=[{q1: 30, q2: 90}, {P.x: 300, P.y: 0}]",
                     "reliability.methods=[analytic, monte_carlo]")  # fmt: skip
    (axes,) = figure.axes
    assert sorted(text.xy[0] for text in axes.texts) == pytest.approx([-0.15, 0.15])
    assert len(axes.get_xticks()) == 2


def test_methods_look_different() -> None:
    for aspect in ("words", "color", "marker"):
        assert len({getattr(look(name), aspect) for name in METHODS}) == len(METHODS)


@pytest.mark.slow
def test_intervals_are_drawn_where_a_method_claims_one() -> None:
    figure, result = one("reliability", SLIDER, LISTED, "reliability.methods=[analytic, form, monte_carlo]")
    axes = figure.axes[0]
    (bars,) = axes.containers
    table = result.tables["reliability"]
    rows = table["method"] == "monte_carlo"
    ends = np.sort(bars.lines[2][0].get_segments()[0][:, 1])
    assert ends == pytest.approx([table["failure_low"][rows][0], table["failure_high"][rows][0]])
    assert legend(figure) == ["first order", "FORM", "Monte Carlo"]


@pytest.mark.slow
def test_auto_tells_what_it_used_and_what_it_cost() -> None:
    figure, result = one("reliability", SLIDER, LISTED, "reliability.methods=[auto]", "reliability.limits.B.x=0.5")
    table = result.tables["reliability"]
    (used,) = set(table["used"].tolist())
    assert used != "auto"
    assert legend(figure) == [f"auto by {look(used).words}, {table['evaluations'].sum():,} solved"]


@pytest.mark.slow
def test_no_failure_seen_is_an_arrow_at_the_upper_end() -> None:
    figure, result = one("reliability", SLIDER, "reliability.poses=[{crank: 30}]",
                         "reliability.methods=[analytic, monte_carlo]", "reliability.limits.B.x=1.2")  # fmt: skip
    axes = figure.axes[0]
    (arrow,) = (line for line in axes.lines if line.get_marker() == "v")
    table = result.tables["reliability"]
    high = float(table["failure_high"][table["method"] == "monte_carlo"][0])
    assert arrow.get_ydata() == pytest.approx([high])
    assert f"< {number(high)}" in [text.get_text() for text in axes.texts]
    assert axes.get_yscale() == "log"


@pytest.mark.slow
def test_sweep_has_bands_with_limits_and_the_cycle() -> None:
    found, result = drawn(SLIDER, SWEPT, "reliability.methods=[analytic, monte_carlo]")
    assert set(found) == {"bands", "deviations", "reliability", "contributions", "histogram", "convergence", "estimate"}
    (axes,) = found["bands"].axes
    assert axes.get_ylabel() == "error [mm]"
    assert axes.get_xlabel() == "crank [deg]"
    assert legend(found["bands"]) == ["first order", "Monte Carlo", "limit of the error"]
    level = [line.get_ydata()[0] for line in axes.lines if len(set(line.get_ydata())) == 1]
    assert {-0.2, 0.0, 0.2} <= set(level)
    moments = result.tables["moments"]
    rows = moments["method"] == "monte_carlo"
    high = (moments["mean"] - moments["nominal"] + 3 * moments["sigma"])[rows]
    assert any(len(line.get_ydata()) == 7 and line.get_ydata() == pytest.approx(high) for line in axes.lines)
    assert {"whole cycle, bounds by first order", "whole cycle, Monte Carlo"} <= set(legend(found["reliability"]))


@pytest.mark.slow
def test_a_far_limit_does_not_squeeze_the_bands() -> None:
    figure, _ = one("bands", SLIDER, SWEPT, "reliability.methods=[analytic]", "reliability.limits.B.x={max: 9}")
    (axes,) = figure.axes
    assert axes.get_ylim()[1] < 2
    assert axes.get_title(loc="right") == "limit +9 mm, outside"


@pytest.mark.nightly
def test_velocities_have_panels_and_limits_of_their_own() -> None:
    figure, _ = one("bands", SLIDER, SWEPT, "reliability.methods=[analytic, monte_carlo]",
                    "reliability.rates={crank: 60}", "reliability.limits={B.x_velocity: {max: 0.3}}")  # fmt: skip
    axes = figure.axes
    assert [axis.get_title(loc="left") for axis in axes] == ["B.x", "B.x velocity", "B.x acceleration"]
    assert [axis.get_ylabel() for axis in axes] == ["error [mm]", "error [mm/s]", "error [mm/s²]"]
    limits = [[line for line in axis.lines if line.get_color() == style.VERMILION] for axis in axes]
    assert [len(lines) for lines in limits] == [0, 1, 0]
    assert set(limits[1][0].get_ydata()) == {0.3}


def steps(axes):
    """Heights and edges of the histograms of a panel."""
    return [patch.get_data()[:2] for patch in axes.patches if isinstance(patch, StepPatch)]


@pytest.mark.slow
def test_histogram_shows_every_sample_its_failures_and_the_limits() -> None:
    figure, result = one("histogram", SLIDER, LISTED, "reliability.methods=[monte_carlo]")
    for axes in figure.axes:
        every, failed = (heights * np.diff(edges) for heights, edges in steps(axes))
        assert every.sum() == pytest.approx(1.0, abs=2e-3)
        failure = result.tables["reliability"]["failure"].max()
        assert failed.sum() == pytest.approx(failure, abs=2e-3)
        limits = [line.get_xdata()[0] for line in axes.lines if line.get_color() == style.VERMILION]
        assert limits == [-0.2, 0.2]
    upper, lower = figure.axes
    assert (upper.get_yscale(), lower.get_yscale()) == ("linear", "log")
    assert lower.get_xlabel() == "error [mm]"
    assert lower.get_ylabel() == "density [1/mm]"
    assert "2,000 samples" in texts(figure)


@pytest.mark.slow
def test_pictures_of_samples_show_the_pose_that_fails_most_and_say_so() -> None:
    found, result = drawn(SLIDER, "reliability.poses=[{crank: 80}, {crank: 10}]", "reliability.methods=[monte_carlo]")
    failure = result.tables["reliability"]["failure"]
    assert failure[1] > 1.2 * failure[0]
    for name in ("histogram", "convergence", "estimate"):
        assert "at the pose that fails most, crank = 10 deg" in texts(found[name])
        assert set(result.tables[name]["crank"]) == {10}


@pytest.mark.slow
def test_a_study_may_choose_the_pose_whose_samples_are_shown() -> None:
    found, result = drawn(SLIDER, "reliability.poses=[{crank: 80}, {crank: 10}]", "reliability.methods=[monte_carlo]",
                          "reliability.shown=1")  # fmt: skip
    for name in ("histogram", "convergence", "estimate"):
        assert "at crank = 80 deg" in texts(found[name])
        assert set(result.tables[name]["crank"]) == {80}


@pytest.mark.parametrize(("overrides", "message"), [
    (["reliability.shown=3"], "there are only 2 poses"),
    (["reliability.shown=1", "reliability.methods=[analytic]"], "no method draws samples"),
])  # fmt: skip
def test_a_pose_that_cannot_be_shown(overrides: list[str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        drawn(SLIDER, "reliability.poses=[{crank: 80}, {crank: 10}]", *overrides)


@pytest.mark.nightly
def test_a_far_limit_is_told_in_words() -> None:
    figure, _ = one("histogram", SLIDER, LISTED, "reliability.methods=[monte_carlo]", "reliability.limits.B.x=5")
    axes = figure.axes[0]
    assert axes.get_title("right") == "limit -5, +5 mm, outside"
    assert max(abs(x) for x in axes.get_xlim()) < 2


@pytest.mark.nightly
def test_a_circle_limits_a_distance_not_the_coordinates() -> None:
    figure, _ = one("histogram", ARM, CORNER, "reliability.methods=[monte_carlo]")
    axes = figure.axes
    assert [axis.get_title(loc="left") for axis in axes[:3]] == ["P: distance from no error", "P.x", "P.y"]
    limits = [[line.get_xdata()[0] for line in axis.lines if line.get_color() == style.VERMILION] for axis in axes[:3]]
    assert limits == [[0.25], [], []]
    (every, edges), (failed, _) = steps(axes[0])
    assert not failed[edges[1:] <= 0.25].any()
    assert failed[edges[:-1] > 0.25].tolist() == every[edges[:-1] > 0.25].tolist()
    assert failed.any()


@pytest.mark.slow
def test_estimate_stands_beside_the_other_methods() -> None:
    figure, result = one("estimate", SLIDER, LISTED, "reliability.methods=[analytic, form, monte_carlo]")
    (axes,) = figure.axes
    table = result.tables["reliability"]
    first = {str(m): float(f) for m, f in zip(table["method"][:3], table["failure"][:3], strict=True)}
    level = [
        line.get_ydata()[0] for line in axes.lines if len(line.get_ydata()) == 2 and line.get_linestyle() != "None"
    ]
    assert {first["analytic"], first["form"]} <= set(level)
    assert f"plain samples: {number(first['monte_carlo'])}" in legend(figure)


def contours(*overrides: str):
    figure, result = one("density_contours", ARM, CORNER, *overrides)
    (axes,) = figure.axes
    return axes, figure, result


def limit_of(axes):
    (found,) = [patch for patch in axes.patches if not patch.get_fill()]
    return found


@pytest.mark.nightly
def test_density_is_true_to_scale_with_the_circle_of_the_limit() -> None:
    axes, figure, _ = contours("reliability.methods=[auto]")
    outline = limit_of(axes).get_xy()
    assert np.hypot(*outline.T) == pytest.approx(np.full(len(outline), 0.25))
    assert axes.get_aspect() == 1
    assert axes.get_xlim()[0] < -0.25 < 0.25 < axes.get_xlim()[1]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("P.x error [mm]", "P.y error [mm]")
    assert "limit: 0.25 mm from no error" in legend(figure)
    assert "auto: holds 90 %" in legend(figure)


@pytest.mark.nightly
def test_ellipses_hold_their_shares() -> None:
    axes, _, result = contours("reliability.methods=[analytic, monte_carlo]")
    samples = result.drawn.samples
    lines = [line.get_xydata() for line in axes.lines if len(line.get_xydata()) > 100 and line.get_marker() == "None"]
    for points, share in zip(lines, SHARES, strict=True):
        away = points - samples.mean
        squares = np.einsum("ni,ij,nj->n", away, np.linalg.inv(samples.covariance), away)
        # Of two normal variables the squared distance is exponential.
        assert 1 - np.exp(-squares / 2) == pytest.approx(share)
        assert Outline(points).contains_points(samples.errors.T).mean() == pytest.approx(share, abs=0.03)


def test_smoothed_regions_hold_their_shares_and_end_where_samples_end() -> None:
    errors = np.random.default_rng(1).normal(size=(2, 40_000)) * [[1.0], [0.1]]
    region = smoothed(errors)
    assert region is not None
    assert len(region.levels) == len(SHARES)
    assert region.outside.mean() == pytest.approx(1 - SHARES[-1], abs=1e-3)
    # Half of two independent normal errors lies within sqrt(2 ln 2) deviations.
    inside = region.density > region.levels[0]
    assert np.hypot(region.x, 10 * region.y)[inside].max() == pytest.approx(np.sqrt(2 * np.log(2)), rel=0.05)
    few = smoothed(errors[:, :2000])
    assert few is not None
    assert len(few.levels) == 2
    assert smoothed(errors[:, :50]) is None


@pytest.mark.nightly
def test_samples_that_fail_are_marked() -> None:
    axes, figure, result = contours("reliability.methods=[monte_carlo]")
    (marks,) = [line for line in axes.lines if line.get_marker() == "x"]
    failures = round(float(result.tables["reliability"]["failure"][0]) * 2000)
    assert 0 < len(marks.get_xydata()) == failures
    assert (np.hypot(*marks.get_xydata().T) > 0.25).all()
    assert f"2,000 samples, {failures} of them fail" in texts(figure)


@pytest.mark.nightly
def test_open_and_far_limits_of_a_density() -> None:
    axes, figure, _ = contours("reliability.methods=[monte_carlo]", "reliability.limits={P.x: {max: 0.2}, P.y: 9}")
    (left, low), (right, high) = limit_of(axes).get_path().get_extents().get_points()
    assert right == pytest.approx(0.2)
    assert left < axes.get_xlim()[0]
    assert low < axes.get_ylim()[0] < axes.get_ylim()[1] < high
    assert max(abs(y) for y in axes.get_ylim()) < 1
    assert "limits outside: -9 mm of P.y, +9 mm of P.y" in texts(figure)


@pytest.mark.nightly
def test_a_far_circle_of_a_density_is_told() -> None:
    axes, figure, _ = contours("reliability.methods=[monte_carlo]", "reliability.limits.P.radius=9")
    assert texts(figure).endswith("limit: 9 mm from no error, outside")
    assert not axes.patches


@pytest.mark.nightly
def test_density_of_velocities_has_their_limits() -> None:
    axes, _, _ = contours("reliability.methods=[monte_carlo]", "reliability.rates={q1: 60, q2: 30}",
                          "reliability.limits={P.x_velocity: 0.3, P.y_velocity: {min: -0.2, max: 0.3}}")  # fmt: skip
    assert limit_of(axes).get_path().get_extents().get_points() == pytest.approx(np.array([[-0.3, -0.2], [0.3, 0.3]]))
    assert axes.get_xlabel() == "P.x velocity error [mm/s]"


@pytest.mark.nightly
def test_density_of_an_output_and_its_velocity() -> None:
    axes, _, result = contours("reliability.methods=[monte_carlo]", "reliability.rates={q1: 60, q2: 30}",
                               "reliability.limits={P.x: 0.2, P.x_velocity: 0.3}")  # fmt: skip
    table = result.tables["density"]
    assert [c.name for c in table.columns if c.name.endswith("_error")] == ["P.x_error", "P.x_velocity_error"]
    assert not np.array_equal(table["P.x_error"], table["P.x_velocity_error"])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("P.x error [mm]", "P.x velocity error [mm/s]")
    assert axes.get_aspect() == "auto"


@pytest.mark.nightly
def test_density_of_one_sided_tolerances_lies_about_their_mean() -> None:
    axes, _, result = contours("reliability.methods=[monte_carlo]",
                               "reliability.dimensions={'*.length': {tolerance: [0, 0.6]}}")  # fmt: skip
    table, moments = result.tables["density"], result.tables["moments"]
    for name, mean in zip(("P.x", "P.y"), moments["mean"] - moments["nominal"], strict=True):
        assert abs(mean) > 0.1
        for column in ("normal", "simulated"):
            weights = table[column] / table[column].sum()
            assert weights @ table[f"{name}_error"] == pytest.approx(mean, abs=0.01)
    cell = np.prod([np.diff(np.unique(table[axis])).mean() for axis in "xy"])
    assert table["simulated"].sum() * cell == pytest.approx(1.0, abs=0.02)
    left, right = axes.get_xlim()
    assert left < -0.25 < table["P.x_error"].max() < right


@pytest.mark.nightly
def test_workspace_has_maps() -> None:
    found, _ = drawn(ARM, "reliability.poses=workspace", "reliability.methods=[analytic]")
    assert set(found) == {"deviation_map", "failure_map", "contributions"}
    maps = found["deviation_map"].axes
    assert [axis.get_title(loc="left") for axis in maps] == ["P.x [mm]", "P.y [mm]"]
    assert all(axis.get_aspect() == 1 for axis in maps)
    assert found["failure_map"].axes[0].get_xlabel() == "P.x [mm]"
    # The arm turns as it likes: nothing depends on the direction, so every level is a circle about its shoulder.
    lines = [line for line in found["failure_map"].axes[0].lines if len(line.get_xdata()) > 20]
    assert np.hypot(*lines[0].get_xydata().T) == pytest.approx(np.full(len(lines[0].get_xdata()), 20.0), abs=0.1)


@pytest.mark.slow
def test_grid_of_drives_has_maps_over_them() -> None:
    grid = "reliability.sweep={q1: {from: 0, to: 60, step: 20}, q2: {from: 80, to: 140, step: 15}}"
    figure, _ = one("failure_map", ARM, grid, "reliability.methods=[analytic]")
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("q1 [deg]", "q2 [deg]")
    assert axes.get_aspect() == "auto"


@pytest.mark.slow
def test_patches_of_a_workspace_are_kept_apart() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs/gallery/five_bar_precision_map.yaml")
    poses = study_poses(study, "reliability")
    over = plane(study, poses)
    assert over is not None
    ((_, sectors),) = over.maps
    rays = [patch.rays for patch in sectors.patches]
    assert [patch.stop - patch.start for patch in rays] == [3, 30, 30, 3]
    assert (rays[0].start, rays[-1].stop) == (0, len(over.x))
    # The ends of the rays of a patch follow one another without jumps.
    z = over.x + 1j * over.y
    for patch in rays:
        assert np.abs(np.diff(z[patch], axis=0)).max() < 0.4 * np.ptp(over.x)


@pytest.mark.slow
def test_outline_of_a_map_is_the_boundary_of_the_workspace() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs/gallery/five_bar_precision_map.yaml")
    over = plane(study, study_poses(study, "reliability"))
    assert over is not None
    z = np.concatenate(over.maps[0][1].outline)
    # A leg is stretched, or its pin and C are as near as they may be.
    reach = np.abs(z - np.array([[100], [-100]]))
    assert np.abs(reach[..., None] - (140, 340)).min(axis=(0, 2)).max() < 1e-6
    assert len(z) > 300


@pytest.mark.slow
def test_path_in_the_plane_is_drawn_over_its_poses() -> None:
    path = "reliability.path={P: [[60, 100], [70, 110], [80, 100], [70, 90], [60, 100]]}"
    figure, _ = one("reliability", ARM, path, "reliability.methods=[analytic]")
    assert figure.axes[0].get_xlabel() == "pose along the path"
    places = figure.axes[0].lines[0].get_xdata()
    # The curve goes on between the poses.
    assert {1, 2, 3, 4, 5} < {*places.tolist()}
    assert (places[0], places[-1]) == (1, 5)


@pytest.mark.slow
def test_a_sweep_of_a_single_pose_is_drawn_as_one_that_is_listed() -> None:
    figure, _ = one("reliability", SLIDER, "reliability.sweep={crank: 30}", "reliability.methods=[analytic]")
    (place,) = figure.axes[0].get_xticklabels()
    assert place.get_text() == "crank = 30 deg"


@pytest.mark.slow
def test_a_curve_over_poses_out_of_reach_goes_on_to_the_ends_of_the_reach_and_leaves_a_gap() -> None:
    path = "reliability.path={P: [[60, 100], [70, 110], [300, 100], [70, 90], [60, 100]]}"
    figure, _ = one("reliability", ARM, path, "reliability.methods=[analytic]")
    places, failure = figure.axes[0].lines[0].get_data()
    (lost,) = np.flatnonzero(np.isnan(failure))
    # The arm of 100 and 80 reaches 180: parts of the ways from (70, 110) and (70, 90) to (300, 100).
    ends = [max(np.roots([230**2 + rise**2, 2 * (70 * 230 + y * rise), 70**2 + y**2 - 180**2]))
            for y, rise in ((110, -10), (90, 10))]  # fmt: skip
    assert places[lost - 1 : lost + 2] == pytest.approx([2 + ends[0], 3, 4 - ends[1]], abs=1e-6)
    # Beside the reach it is bent: a fifth of the way is a pose of its own.
    _, there = one("reliability", ARM, "reliability.poses=[{P.x: 116, P.y: 108}]", "reliability.methods=[analytic]")
    (expected,) = {*there.tables["reliability"].take(there.tables["reliability"].where(scope="pose"))["failure"]}
    assert np.interp(2.2, places, failure) == pytest.approx(expected, rel=1e-3)


def test_contributions_are_one_bar_with_sobol_indices_where_these_differ() -> None:
    study = study_of(SLIDER, "reliability.poses=[{crank: 60}]")
    columns = {
        "crank": [60.0] * 4, "source": ["r", "l"] * 2, "output": ["B.x"] * 2 + ["A.x"] * 2, "order": ["position"] * 4,
        "share": [0.3, 0.7, 0.4, 0.6], "sobol_first": [0.3, 0.6, 0.4, 0.6], "sobol_first_low": [0.29, 0.58, 0.39, 0.58],
        "sobol_first_high": [0.31, 0.62, 0.41, 0.62], "sobol_total": [0.4, 0.7, 0.4, 0.6],
        "sobol_total_low": [0.37, 0.69, 0.39, 0.59], "sobol_total_high": [0.45, 0.71, 0.41, 0.61],
    }  # fmt: skip
    table = mechdesign.Table(
        "contributions", tuple(mechdesign.Column(name, np.array(values)) for name, values in columns.items())
    )
    with style.context():
        figure = draw(contributions(study, table, study_poses(study, "reliability")))
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["l", "r"]
    for axes, shares in zip(figure.axes, ([70, 30], [60, 40]), strict=True):
        assert [bar.get_width() for bar in axes.patches] == pytest.approx(shares)
    marks = [[bars.lines[0].get_xydata().tolist() for bars in axes.containers if not hasattr(bars, "patches")]
             for axes in figure.axes]  # fmt: skip
    assert marks == [[[[60.0, 0.0]], [[40.0, 1.0]]], []]
    assert legend(figure) == ["share, to the first order", "Sobol index, alone", "Sobol index, with all interactions"]


@pytest.mark.slow
def test_shares_of_correlated_sources_are_explained() -> None:
    figure, result = one("contributions", SLIDER, "reliability.poses=[{crank: 30}]", "reliability.methods=[analytic]",
                          "reliability.correlation=[[r, l, -0.9]]")  # fmt: skip
    assert result.tables["contributions"]["share"].min() < 0
    assert "negative shares" in texts(figure)


def test_allocation_shows_given_beside_allocated_and_how_often_either_fails() -> None:
    study = study_of(SLIDER, LISTED, "reliability.allocate={reliability: 0.999}")
    columns = {
        "source": ["r", "l", "O"], "kind": ["tolerance", "sigma", "clearance"], "given": [0.3, 0.3, 0.1],
        "allocated": [0.2, 0.25, 0.1], "unit": ["mm"] * 3,
        "cost_given": [10.0, 5.0, np.nan], "cost_allocated": [15.0, 6.0, np.nan], "share": [0.5, 0.4, 0.1],
    }  # fmt: skip
    before = {"scope": ["pose", "pose", "cycle"], "method": ["analytic"] * 3, "failure": [0.02, 0.05, 0.06],
              "failure_low": [0.02, 0.05, 0.06], "failure_high": [0.02, 0.05, 0.06]}  # fmt: skip
    after = {"simulated": [0.9995, 0.9991], "low": [0.9993, 0.999], "high": [0.9997, 0.9992]}
    tables = {
        name: mechdesign.Table(name, tuple(mechdesign.Column(key, np.array(values)) for key, values in data.items()))
        for name, data in {"allocation": columns, "reliability": before, "confirmation": after}.items()
    }
    with style.context():
        figure = draw(allocation(study, tables))
    tolerances, costs, failures = figure.axes
    assert [[bar.get_width() for bar in bars] for bars in tolerances.containers] == [[0.3, 0.3, 0.1], [0.2, 0.25, 0.1]]
    assert [label.get_text() for label in tolerances.get_yticklabels()] == ["r", "l (sigma)", "O (clearance)"]
    assert tolerances.get_xlabel() == "tolerance [mm]"
    assert costs.get_xlabel() == "cost"
    assert "0.999" in texts(figure)
    assert "cost 15 as given, 21 allocated (+40.0 %)" in texts(figure)
    places = [bars.lines[0].get_xydata()[0].tolist() for bars in failures.containers]
    assert places == [[0.05, 0], [pytest.approx(0.0009), 1]]
    assert "allowed: 0.001" in legend(figure)


@pytest.mark.parametrize(("value", "text"), [(1.6566e-9, "1.66·10⁻⁹"), (0.0277, "0.0277"), (0.0, "0")])
def test_probabilities_in_three_digits(value: float, text: str) -> None:
    assert number(value) == text


def test_powers_of_ten_stand_with_the_unit() -> None:
    made, _ = drawn(SLIDER, "units.length=um", "reliability.dimensions.r=0.0001", "reliability.dimensions.l=0.0001",
                 "reliability.limits={B.x: 0.0002}",
                 "kinematics={sweep: {crank: {from: 0, to: 360, step: 15}}}")  # fmt: skip
    for name, label in (("deviations", "position"), ("bands", "error")):
        (axes,) = made[name].axes
        assert axes.get_ylabel() == f"{label} [10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT SIX} \N{MICRO SIGN}m]"
        made[name].canvas.draw()
        assert not axes.yaxis.offsetText.get_visible()
        numbers = [float(text.get_text().replace("\N{MINUS SIGN}", "-")) for text in axes.get_yticklabels()]
        np.testing.assert_allclose(numbers, 1e6 * axes.get_yticks(), atol=1e-9)


def test_curves_of_the_first_order_follow_the_motion_between_its_poses() -> None:
    """A length of 100 +- 0.3 mm gives P.x a deviation of 0.1 mm |cos|, and 4.55 % beyond 0.2 mm where |cos| is 1."""
    study = study_of("""
    units: {length: mm}
    mechanism:
      links: {ground: {O: [0, 0]}, arm: [O, P, 100]}
      drives: [arm]
    reliability:
      dimensions: {arm.length: 0.3}
      outputs: [P.x]
      limits: {P.x: 0.2}
      sweep: {arm: {from: 0, to: 180, step: 60}}
      methods: [analytic]
    """)
    result = mechdesign.reliability(study)
    turn = np.linspace(0, 180, 181)
    cosine = np.abs(np.cos(np.radians(turn)))
    with style.context():
        deviations, bands, failures = (
            figure_of(study, result, name).axes[0] for name in ("deviations", "bands", "reliability")
        )
        line = next(line for line in deviations.get_lines() if len(line.get_xdata()) > 3)
        assert np.interp(turn, *line.get_xydata().T) == pytest.approx(0.1 * cosine, abs=2e-4)
        edge = bands.collections[0].get_paths()[0].vertices
        assert len(edge) > 50
        assert np.abs(edge[:, 1]) == pytest.approx(0.3 * np.abs(np.cos(np.radians(edge[:, 0]))), abs=1e-4)
        chance = next(line for line in failures.get_lines() if len(line.get_xdata()) > 3)
        at_thirty = 10 ** np.interp(30, chance.get_xdata(), np.log10(chance.get_ydata()))
        assert at_thirty == pytest.approx(2 * NormalDist().cdf(-2 / np.cos(np.pi / 6)), rel=0.02)
