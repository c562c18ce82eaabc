"""Pictures of optimisations: which are drawn for how many variables, the marked optima, the front and its knee."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.analyses.optimize.goals import Goal
from mechdesign.analyses.optimize.judge import Designs
from mechdesign.report.figures import style
from mechdesign.report.figures.optimize import MAX_LINES, convergence, figures, front_figure, parallel_axes
from mechdesign.results import Column, Table

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


def table(**columns: object) -> Table:
    return Table("designs", tuple(Column(name, np.asarray(values), "mm") for name, values in columns.items()))


@pytest.mark.parametrize(("names", "expected"), [
    ("a", {"CPI", "optimum"}), ("ab", {"CPI", "indices", "optimum"}), ("abc", {"CPI", "designs", "optimum"}),
])  # fmt: skip
def test_pictures_by_the_number_of_variables(names: str, expected: set[str]) -> None:
    found, _ = drawn(*names)
    assert set(found) == expected


def test_the_best_design_is_marked_and_drawn_with_its_own_dimensions() -> None:
    found, result = drawn("a", "b")
    a, b = (float(result.main[name][0]) for name in "ab")
    marks = [line.get_xydata()[0].tolist() for line in found["CPI"].axes[0].lines]
    assert [a, b] in marks
    title = found["optimum"].texts[0].get_text()
    assert f"a = {a:.4g}, b = {b:.4g}" in title
    outline = np.concatenate(
        [line.get_xydata() for line in found["optimum"].axes[0].lines if len(line.get_xydata()) > 9]
    )
    # The base of the arm is at x = 5.
    assert np.hypot(outline[:, 0] - 5, outline[:, 1]).max() == pytest.approx(a + b, rel=1e-3)


def test_a_single_goal_is_shown_in_its_own_unit() -> None:
    found, result = drawn("a", goals="minimize: [kinematics.P.x]")
    axes = found["CPI"].axes[0]
    assert axes.get_ylabel().startswith("kinematics.P.x")
    line = axes.lines[0].get_xydata()
    assert line[:, 1] == pytest.approx(result.tables["designs"]["kinematics.P.x"])


def many(count: int = 500) -> Designs:
    x, y, z = np.random.default_rng(0).random((3, count))
    goals = Goal("cost", "", "", smallest=True), Goal("mass", "", "", smallest=True)
    values = dict(zip(goals, (x + y, 1 - x + z), strict=True))
    codes = (np.arange(count) == 3).astype(np.int32)
    variables, weights = {"x": x, "y": y, "z": z}, np.array([[1.0, 0.0]])
    return Designs(study_of(ARM), variables, goals, (), values, {}, codes, ["", "wrong"], weights, {})


def test_parallel_axes_of_many_designs_show_some_and_always_the_best() -> None:
    designs = many()
    with style.context():
        axes = parallel_axes(designs).axes[0]
    lines = axes.collections[0].get_segments()
    assert len(lines) == MAX_LINES
    cost = designs.values[designs.feasible, 0]
    best = axes.lines[0].get_xydata()
    assert best[3, 1] == 0
    assert {text.get_text() for text in axes.texts} >= {f"{cost.min():.4g}", f"{cost.max():.4g}"}


def test_convergence_never_falls_and_ends_at_the_best() -> None:
    with style.context():
        axes = convergence(many()).axes[0]
    heights = axes.lines[0].get_ydata()
    assert (np.diff(heights) >= 0).all()
    assert heights[-1] == 1


def test_the_front_is_drawn_with_its_knee() -> None:
    designs = many()
    front = table(x=[0.1, 0.2, 0.3], y=[0.1, 0.1, 0.1], z=[0.5, 0.5, 0.5], cost=[0.2, 0.3, 0.4], mass=[1.4, 0.9, 0.8],
                  knee=[False, True, False])  # fmt: skip
    with style.context():
        axes = front_figure(designs, front).axes[0]
    labels = {line.get_label(): line.get_xydata() for line in axes.lines}
    assert labels["knee: x = 0.2, y = 0.1, z = 0.5"].tolist() == [[0.3, 0.9]]
    assert "less is better" in axes.get_xlabel()
