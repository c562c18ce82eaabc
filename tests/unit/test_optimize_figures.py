"""Pictures of optimisations: which are drawn for how many variables, the marked optima, the front and its knee."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import study_of
from matplotlib.collections import QuadMesh

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Dots, Panel, Picture
from mechdesign.drawing.pictures import figures
from mechdesign.family.goals import Goal
from mechdesign.questions.optimize.figures.designs import value_text
from mechdesign.questions.optimize.figures.front import front_picture
from mechdesign.questions.optimize.figures.scores import (
    ENVELOPE_STEPS,
    MAX_LINES,
    convergence,
    parallel_axes,
    score_curves,
)
from mechdesign.questions.optimize.judge import DesignSet

ARM = """
mechanism:
  parameters: {a: 40, b: 30, c: 5}
  links:
    ground: {O: [c, 0]}
    upper: [O, E, a]
    lower: [E, P, b]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [30, 30], P: [10, 50]}
workspace: {point: P, scan: {about: [0, 0]}}
kinematics: {poses: [{q1: 0, q2: 30}]}
"""
STEPS = {"a": "{from: 30, to: 50, number: 4}", "b": "{from: 20, to: 40, number: 4}", "c": "{from: 0, to: 6, number: 2}"}


def drawn(*names: str, goals: str = "maximize: [GII, SUI]"):
    variables = ", ".join(f"{name}: {STEPS[name]}" for name in names)
    study = study_of(ARM + f"optimize: {{variables: {{{variables}}}, {goals}}}\n")
    result = mechdesign.optimize(study)
    with style.context():
        return figures(study, result), result


def table(**columns: object) -> mechdesign.Table:
    return mechdesign.Table(
        "designs", tuple(mechdesign.Column(name, np.asarray(values), "mm") for name, values in columns.items())
    )


@pytest.mark.nightly
@pytest.mark.parametrize(("names", "expected"), [
    ("a", {"CPI", "optimum"}), ("ab", {"CPI", "indices", "optimum"}), ("abc", {"CPI", "designs", "optimum"}),
])  # fmt: skip
def test_pictures_by_the_number_of_variables(names: str, expected: set[str]) -> None:
    found, _ = drawn(*names)
    assert set(found) == expected


@pytest.mark.slow
def test_the_best_design_is_marked_and_drawn_with_its_own_dimensions() -> None:
    found, result = drawn("a", "b")
    a, b = (float(result.main[name][0]) for name in "ab")
    marks = [line.get_xydata()[0].tolist() for line in found["CPI"].axes[0].lines]
    assert [a, b] in marks
    title = found["optimum"].texts[0].get_text()
    assert f"a = {a:.4g} mm, b = {b:.4g} mm" in title
    outline = np.concatenate(
        [line.get_xydata() for line in found["optimum"].axes[0].lines if len(line.get_xydata()) > 9]
    )
    # The base of the arm is at x = 5.
    assert np.nanmax(np.hypot(outline[:, 0] - 5, outline[:, 1])) == pytest.approx(a + b, rel=1e-3)


@pytest.mark.slow
def test_a_single_goal_is_shown_in_its_own_unit() -> None:
    found, result = drawn("a", goals="minimize: [kinematics.P.x]")
    axes = found["objective"].axes[0]
    assert axes.get_ylabel().replace("\n", "") == "kinematics.P.x [mm]"
    line = axes.lines[0].get_xydata()
    assert line[:, 1] == pytest.approx(result.tables["designs"]["kinematics.P.x"])


RANGES = "{a: {from: 0, to: 1}, b: {from: 0, to: 1}, c: {from: 0, to: 1}}"


def designed() -> mechdesign.Study:
    return study_of(ARM, f"optimize={{method: search, variables: {RANGES}, maximize: kinematics.P.x}}")


def many(count: int = 500) -> DesignSet:
    x, y, z = np.random.default_rng(0).random((3, count))
    goals = Goal("cost", "", "", smallest=True), Goal("mass", "", "", smallest=True)
    values = dict(zip(goals, (x + y, 1 - x + z), strict=True))
    codes = (np.arange(count) == 3).astype(np.int32)
    variables, weights = {"a": x, "b": y, "c": z}, np.array([[1.0, 0.0]])
    return DesignSet(
        designed(), variables, goals, (), values, {}, codes, ["", "wrong"], np.full(len(codes), np.nan), weights, {}
    )


def test_parallel_axes_of_many_designs_show_some_and_always_the_best() -> None:
    designs = many()
    with style.context():
        axes = draw(parallel_axes(designs)).axes[0]
    lines = axes.collections[0].get_segments()
    assert len(lines) == MAX_LINES
    cost = designs.values[designs.feasible, 0]
    best = axes.lines[0].get_xydata()
    assert best[3, 1] == 0
    assert {text.get_text() for text in axes.texts} >= {f"{cost.min():.4g}", f"{cost.max():.4g}"}


def test_convergence_never_falls_and_ends_at_the_best() -> None:
    with style.context():
        axes = draw(convergence(many())).axes[0]
    heights = axes.lines[0].get_ydata()
    assert (np.diff(heights) >= 0).all()
    assert heights[-1] == 1


def test_the_front_is_drawn_with_its_knee() -> None:
    designs = many()
    front = table(a=[0.1, 0.2, 0.3], b=[0.1, 0.1, 0.1], c=[0.5, 0.5, 0.5], cost=[0.2, 0.3, 0.4], mass=[1.4, 0.9, 0.8],
                  knee=[False, True, False])  # fmt: skip
    with style.context():
        axes = draw(front_picture(designs, front)).axes[0]
    labels = {line.get_label(): line.get_xydata().tolist() for line in axes.lines}
    assert labels["A: best cost, a = 0.1 mm, b = 0.1 mm, c = 0.5 mm"] == [[0.2, 1.4]]
    assert labels["knee, a = 0.2 mm, b = 0.1 mm, c = 0.5 mm"] == [[0.3, 0.9]]
    assert labels["B: best mass, a = 0.3 mm, b = 0.1 mm, c = 0.5 mm"] == [[0.4, 0.8]]
    assert "less is better" in axes.get_xlabel()
    # A corner of the staircase is as bad in each goal as the worse of the two designs beside it.
    (stairs,) = (line for line in axes.lines if line.get_label().startswith("front"))
    assert stairs.get_drawstyle() == "steps-post"
    inside = [(axes.viewLim.contains(*place)) for place in designs.values[designs.feasible]]
    assert axes.get_title(loc="right") == f"{inside.count(False)} worse designs outside"


def test_very_small_values_have_a_power_of_ten() -> None:
    texts = [value_text(value) for value in (5.0268e-9, 0.0, 0.12345, -2e7, "left")]
    assert texts == ["5.03·10⁻⁹", "0", "0.1235", "-2.00·10⁷", "left"]


def test_dots_of_a_legend_can_be_seen() -> None:
    dots = Dots([1], [2], label="designs", look={"marker": ".", "markersize": 2, "alpha": 0.5})
    with style.context():
        figure = draw(Picture("", [Panel([dots])]))
    (handle,) = figure.legends[0].legend_handles
    assert handle.get_markersize() >= 6
    assert handle.get_alpha() == 1.0
    assert figure.axes[0].lines[0].get_markersize() == 2


@pytest.mark.parametrize("look", ["screen", "paper"])
def test_labels_of_a_front_of_three_goals_lie_apart(look: str) -> None:
    x, y, z = np.random.default_rng(0).random((3, 200))
    names = "kinematics.max_theta_effort", "workspace.largest_radius", "stiffness.min_k_min"
    goals = tuple(Goal(name, "", "", smallest=True) for name in names)
    values = dict(zip(goals, (x, y, z), strict=True))
    designs = DesignSet(designed(), {"a": x, "b": y, "c": z}, goals, (), values, {}, np.zeros(200, dtype=np.int32),
                        [""], np.full(200, np.nan), np.ones((1, 3)), {})  # fmt: skip
    front = table(a=x[:3], b=y[:3], c=z[:3], knee=[False, True, False],
                  **{name: values[:3] for name, values in zip(names, (x, y, z), strict=True)})  # fmt: skip
    with style.context(look):
        figure = draw(front_picture(designs, front))
        figure.canvas.draw()
        texts = [axes.xaxis.label for axes in figure.axes] + [axes.yaxis.label for axes in figure.axes]
        boxes = [text.get_window_extent() for text in [*texts, *figure.texts]]
        assert not [pair for pair in combinations(boxes, 2) if pair[0].overlaps(pair[1])]
        assert all(box.y0 >= 0 and box.y1 <= figure.bbox.height and box.x0 >= 0 for box in boxes)


@pytest.mark.nightly
def test_ends_and_knee_of_a_front_stand_side_by_side_in_their_workspaces() -> None:
    study = study_of(
        ARM
        + """optimize:
  {variables: {a: {from: 30, to: 50}, b: {from: 20, to: 40}}, maximize: [GII], minimize: [area], method: pareto,
   evaluations: 40}
"""
    )
    with style.context():
        found = figures(study, mechdesign.optimize(study))
    panels = found["optimum"].axes
    titles = [axes.get_title(loc="left").splitlines() for axes in panels]
    assert [lines[0] for lines in titles][::2] == ["A: best GII", "B: best area"]
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    for axes, (_, a, b, *_) in zip(panels, titles, strict=True):
        reach = sum(float(words.partition("=")[2].split()[0]) for words in (a, b))
        outline = np.concatenate([line.get_xydata() for line in axes.lines if len(line.get_xydata()) > 9])
        assert np.nanmax(np.hypot(outline[:, 0] - 5, outline[:, 1])) == pytest.approx(reach, abs=0.02)


def test_scattered_designs_are_dots_over_their_lower_envelope() -> None:
    x, y = np.random.default_rng(0).random((2, 2000))
    cost = Goal("cost", "", "", smallest=True)
    values = {cost: 1 + (x - 0.5) ** 2 + y}
    designs = DesignSet(designed(), {"a": x, "b": y}, (cost,), (), values, {}, np.zeros(2000, dtype=np.int32), [""],
                      np.full(2000, np.nan), np.ones((1, 1)), {})  # fmt: skip
    with style.context():
        figure = draw(score_curves(designs))
    dots, envelope = figure.axes[0].lines[:2]
    assert len(dots.get_xdata()) == 2000
    along, least = envelope.get_data()
    assert len(along) == ENVELOPE_STEPS
    assert (np.diff(along) > 0).all()
    assert least == pytest.approx(1 + (along - 0.5) ** 2, abs=0.15)
    for left, right, lowest in zip(np.arange(40) / 40, np.arange(1, 41) / 40, least, strict=True):
        near = (x > left + 1e-3) & (x < right - 1e-3)
        assert lowest <= values[cost][near].min()


@pytest.mark.slow
def test_few_designs_of_a_grid_are_cells() -> None:
    found, result = drawn("a", "b", goals="minimize: [kinematics.P.x]")
    (cells,) = [each for each in found["objective"].axes[0].collections if isinstance(each, QuadMesh)]
    table, values = result.tables["designs"], np.asarray(cells.get_array())
    corners = np.asarray(cells.get_coordinates())
    middles = (corners[:-1, :-1] + corners[1:, 1:]) / 2
    for a, b, goal in zip(*(table[name] for name in ("a", "b", "kinematics.P.x")), strict=True):
        distance = np.hypot(*(middles - [a, b]).transpose(2, 0, 1))
        assert distance.min() == pytest.approx(0, abs=1e-9)
        assert values.reshape(distance.shape)[distance == distance.min()] == pytest.approx(goal)


FOUR_BAR = """
units: {length: mm}
mechanism:
  parameters: {b: 90}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, b], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  targets: TARGETS
kinematics: POSES
optimize: {variables: {b: {from: 85, to: 95, number: 3}}, minimize: [GOAL]}
"""


def optimum(targets: str, poses: str, goal: str):
    text = FOUR_BAR.replace("TARGETS", targets).replace("POSES", poses).replace("GOAL", goal)
    result = mechdesign.optimize(study := study_of(text))
    best = study_of(text, f"mechanism.parameters.b={float(result.main['b'][0])}")
    with style.context():
        return figure_of(study, result, "optimum"), mechdesign.kinematics(best).tables["motion"]


@pytest.mark.slow
def test_the_optimum_shows_the_function_wanted_and_reached_and_the_error() -> None:
    figure, motion = optimum("{rocker.angle: 100 + 0.2*crank}", "{sweep: {crank: {from: 20, to: 80, number: 40}}}",
                             "kinematics.rocker.angle_error")  # fmt: skip
    _, curve, error = figure.axes
    crank = curve.lines[0].get_xdata()
    rows = np.flatnonzero(np.isclose(crank[:, None], motion["crank"]).any(axis=1))
    wanted, got = (line.get_ydata() for line in curve.lines)
    assert wanted == pytest.approx(100 + 0.2 * crank)
    assert got[rows] == pytest.approx(motion["rocker.angle"])
    assert error.lines[1].get_ydata()[rows] == pytest.approx(motion["rocker.angle_error"])
    assert error.get_xlabel() == "crank [deg]"
    assert error.get_ylabel() == "error [deg]"


@pytest.mark.slow
def test_the_optimum_at_listed_poses_shows_places_wanted_and_the_worst_pose() -> None:
    figure, motion = optimum("{B.y: [54, 50, 45]}", "{poses: [{crank: 30}, {crank: 60}, {crank: 90}], outputs: [B]}",
                             "kinematics.B.y_error")  # fmt: skip
    axes = figure.axes[0]
    lines = {line.get_label(): line.get_xydata() for line in axes.lines}
    assert lines["B wanted"] == pytest.approx(np.column_stack([motion["B.x"], [54, 50, 45]]))
    assert lines["B reached"] == pytest.approx(np.column_stack([motion["B.x"], motion["B.y"]]))
    # Between the poses the rocker's end runs on its circle.
    assert np.hypot(*(lines["path of B"] - [100, 0]).T) == pytest.approx(60.0)
    worst = motion["crank"][np.argmax(np.abs(motion["B.y_error"]))]
    title = figure.texts[0].get_text().replace("\n", " ").replace("\N{NO-BREAK SPACE}", " ")
    assert title.endswith(f"drawn at the worst pose, crank = {worst:g} deg")
