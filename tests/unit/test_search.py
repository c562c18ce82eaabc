"""Continuous search: the algorithm on functions with known minima, then mechanisms with known optima."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from helpers.syntheses import OPEN, held_height, timed_path, tray
from typer.testing import CliRunner

import mechdesign
from mechdesign.door.cli.app import app
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.questions.optimize.analysis import _doubts
from mechdesign.questions.optimize.explorer import Explorer, Part, Points, Spent
from mechdesign.questions.optimize.question import designs_question
from mechdesign.questions.optimize.search import Ending, search
from mechdesign.questions.optimize.variables import from_cube

CONFIGS = Path(__file__).parents[2] / "configs"

# x = r1 cos 30 + r2 cos 60, y = r1 sin 30 + r2 sin 60.
ARM = """\
mechanism:
  parameters: {r1: 5, r2: 5}
  links: {ground: {O: [0, 0]}, upper: [O, E, r1], fore: [E, P, r2]}
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [4, 3], P: [6, 8]}
kinematics: {poses: [{theta1: 30, theta2: 60}], outputs: [P]}
optimize:
  method: search
  variables: {r1: {from: 1, to: 11}, r2: {from: 1, to: 11}}
  minimize: kinematics.P.x
  subject_to: [{result: kinematics.P.y, at_least: 12}]
"""
FIRST = np.ones(1)
C30, S30 = np.sqrt(3) / 2, 0.5


def branin(u):
    """Three equal minima 0.397887 [Dixon & Szego, 1978]."""
    x, y = 15 * u[:, 0] - 5, 15 * u[:, 1]
    return (y - 5.1 / (4 * np.pi**2) * x**2 + 5 / np.pi * x - 6) ** 2 + 10 * (1 - 1 / (8 * np.pi)) * np.cos(x) + 10


def rastrigin(u):
    """A minimum 0 at 0.43, among a hundred others that are not so low."""
    z = 10 * (u - 0.43)
    return (z**2 - 10 * np.cos(2 * np.pi * z) + 10).sum(axis=1)


def evaluated(u, values, margins, rows):
    """Points of which those without a value are all alike."""
    return Points(u, values, margins, rows, np.isnan(values).any(axis=1).astype(float))


def explorer(function, dimensions, margins=None, budget=3000):
    return Explorer(
        lambda u: evaluated(
            u,
            function(u).reshape(len(u), -1),
            np.empty((len(u), 0)) if margins is None else margins(u),
            np.empty((len(u), 0)),
        ),
        dimensions, budget,
    )  # fmt: skip


def least(function, dimensions, margins=None, seed=0):
    searched = explorer(function, dimensions, margins)
    search(searched, np.ones(1), [[1.0]], seed)
    row = int(np.argmin(searched.points.merit(FIRST)))
    return searched.points.u[row], searched.points.values[row, 0]


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(5))
def test_minimum_of_branin(seed):
    assert least(branin, 2, seed=seed)[1] == pytest.approx(0.39788735773, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_lowest_of_many_minima(seed):
    at, value = least(rastrigin, 2, seed=seed)
    assert at == pytest.approx([0.43, 0.43], abs=1e-4)
    assert value < 1e-4


@pytest.mark.slow
def test_a_condition_that_holds_the_minimum():
    at, value = least(lambda u: u.sum(axis=1), 2, lambda u: (u[:, 0] * u[:, 1] - 0.25)[:, None])
    assert value == pytest.approx(1, abs=1e-5)
    assert at == pytest.approx([0.5, 0.5], abs=1e-2)
    assert at[0] * at[1] >= 0.25


@pytest.mark.slow
def test_points_without_a_value_are_avoided():
    """The minimum lies at the edge of where there is a value."""

    def holed(u):
        return np.where(u[:, 0] < 0.3, np.nan, u[:, 0] + (u[:, 1] - 0.5) ** 2)

    at, _ = least(holed, 2)
    assert at[0] == pytest.approx(0.3, abs=2e-3)


@pytest.mark.slow
def test_noise_of_a_millionth_does_not_mislead():
    """As integrals to a tolerance have it: the same each time, but rough."""

    def rough(u):
        return ((u - [0.3, 0.6, 0.8]) ** 2).sum(axis=1) + 1e-6 * np.sin(1e7 * u.sum(axis=1))

    at, value = least(rough, 3)
    assert value < 1e-5
    assert at == pytest.approx([0.3, 0.6, 0.8], abs=2e-3)


def worst_of(rows, dimensions, margins=None):
    """What a search finds where a goal is the largest absolute value of rows, of which the search knows."""

    def outcome(u):
        found = rows(u)
        values = np.abs(found).max(axis=1, keepdims=True)
        return evaluated(u, values, np.empty((len(u), 0)) if margins is None else margins(u), found)

    places = slice(0, rows(np.zeros((1, dimensions))).shape[1])
    searched = Explorer(outcome, dimensions, 5000, [Part(0, 1.0, True, places)])
    assert search(searched, np.ones(1), [[1.0]], 0).checked
    row = int(np.argmin(searched.points.merit(FIRST)))
    return searched.points.u[row], searched.points.values[row, 0]


@pytest.mark.slow
def test_the_worst_of_many_rows():
    """Of x^3 the nearest quadratic on [-1, 1] is 3/4 x, 1/4 away at four places: it lacks a Chebyshev polynomial."""
    x = np.linspace(-1, 1, 81)
    at, value = worst_of(lambda u: x**3 - (4 * u - 2) @ np.array([x**0, x, x**2]), 3)
    assert value == pytest.approx(0.25, abs=1e-9)
    assert 4 * at - 2 == pytest.approx([0, 0.75, 0], abs=1e-6)


@pytest.mark.slow
def test_along_a_narrow_valley_of_two_rows():
    """The rows of Rosenbrock's function, whose worst has an edge along a parabola."""

    def rows(u):
        x, y = 4 * u[:, 0] - 2, 4 * u[:, 1] - 1
        return np.column_stack([10 * (y - x**2), 1 - x])

    at, value = worst_of(rows, 2)
    assert value < 1e-9
    assert at == pytest.approx([0.75, 0.5], abs=1e-9)


@pytest.mark.nightly
def test_two_worst_rows_weighed_under_a_condition_that_is_one():
    """|x - 1/2| and |y - 1/2|, and both x and y at most 0.4: the nearest corner."""

    def outcome(u):
        off = u - 0.5
        rows = np.concatenate([off, -off, u], axis=1)
        return evaluated(u, np.abs(off), 0.4 - u.max(axis=1, keepdims=True), rows)

    parts = [Part(0, 1.0, False, slice(0, 3, 2)), Part(1, 1.0, False, slice(1, 4, 2)),
             Part(2, 1.0, False, slice(4, 6), bound=0.4)]  # fmt: skip
    searched = Explorer(outcome, 2, 5000, parts)
    assert search(searched, np.ones(2), [[1.0, 3.0]], 0).checked
    best = int(np.argmin(searched.points.merit(np.array([1.0, 3.0]))))
    assert searched.points.u[best] == pytest.approx([0.4, 0.4], abs=1e-8)


def test_rows_of_goals_are_those_of_the_tables():
    study = study_of(ARM, "kinematics={sweep: {theta1: {from: 0, to: 50, step: 10}, theta2: 60}, outputs: [P]}")
    goals = [goal("kinematics.P.x", smallest=True), goal("kinematics.P.y"), goal("kinematics.extremes.P.x.max")]
    designs = {"r1": np.array([3.0, 4.0, 5.0]), "r2": np.array([6.0, 5.0, 6.0])}
    evaluator = Evaluator(designs_question(study, goals, graded=True))
    found = evaluator(designs)
    # An extreme is one row.
    places = evaluator.layout.rows
    assert list(places) == goals[:2]
    turn = np.exp(1j * np.radians([0, 10, 20, 30, 40, 50]))
    path = designs["r1"][:, None] * turn + designs["r2"][:, None] * np.exp(1j * np.radians(60))
    assert found.table[:, places[goals[0]]] == pytest.approx(path.real)
    assert found.table[:, places[goals[1]]] == pytest.approx(path.imag)
    assert found.table[:, 0] == pytest.approx(path.real.max(axis=1))
    evaluator.question.limit(evaluator.layout.width - evaluator.layout.head - 1)
    evaluator = Evaluator(evaluator.question)
    assert not evaluator.layout.rows
    assert evaluator(designs).table.shape == (3, evaluator.layout.head)


def test_no_point_is_evaluated_twice_nor_more_than_allowed():
    asked = []
    searched = explorer(lambda u: asked.append(u.copy()) or rastrigin(u), 2, budget=60)
    assert not search(searched, np.ones(1), [[1.0]], 0).checked
    points = np.concatenate(asked)
    assert len(points) == len(searched.points.u) <= 60
    assert len(np.unique(points, axis=0)) == len(points)
    with pytest.raises(Spent):
        searched(np.random.default_rng(9).random((61, 2)))


@pytest.mark.slow
def test_extremes_and_weighted_sum_of_two_goals():
    """Of (x, 1 - x^2), normalised, the equal-weight best is where 1 = 2 x."""
    searched = explorer(lambda u: np.column_stack([u[:, 0], 1 - u[:, 0] ** 2]), 1)
    assert search(searched, -np.ones(2), [[1.0, 1.0]], 0).checked
    values = searched.points.values
    assert values.min(axis=0) == pytest.approx([0, 0], abs=1e-12)
    assert values.max(axis=0) == pytest.approx([1, 1], abs=1e-12)
    assert searched.points.u[np.argmax(values.sum(axis=1))] == pytest.approx([0.5], abs=1e-3)


def test_bounds_that_depend_on_variables_above():
    study = mechdesign.load(CONFIGS / "two_rrr.yaml")
    designs, given, _ = from_cube(study, np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.25]]))
    assert given.all()
    assert designs["l_min"] == pytest.approx([1, 5, 3])
    assert designs["l_a"] == pytest.approx([1, 3, 1.25])


@pytest.mark.nightly
def test_bounds_that_leave_no_value():
    study = study_of(ARM, "optimize.variables.r2={from: 4, to: r1}", "optimize.subject_to=[]")
    assert from_cube(study, np.array([[0.0, 0.5], [0.5, 0.5]]))[1].tolist() == [False, True]
    designs = mechdesign.optimize(study).tables["designs"]
    assert (designs["r1"] >= 4).all()
    with pytest.raises(mechdesign.AssemblyError, match="leave no value"):
        mechdesign.optimize(study_of(ARM, "optimize.variables.r2={from: 40, to: r1}"))


@pytest.mark.nightly
def test_optimum_at_a_bound_and_a_condition():
    """Turned less to the x axis, the forearm is as long as may be; the upper arm makes up what the height lacks."""
    result = mechdesign.optimize(study_of(ARM))
    r1 = (12 - 11 * C30) / S30
    assert result.main["r2"][0] == pytest.approx(11, abs=1e-3)
    assert result.main["r1"][0] == pytest.approx(r1, abs=1e-3)
    assert result.main["kinematics.P.x"][0] == pytest.approx(r1 * C30 + 11 * S30, rel=1e-5)
    assert result.main["active"][0] == "r2 to, kinematics.P.y at least 12"
    bounds = result.tables["bounds"]
    # The farthest reach is not bounded by the condition.
    assert bounds["max"][0] == pytest.approx(11 * (C30 + S30), rel=1e-6)
    designs = result.tables["designs"]
    assert ((designs["r1"] * S30 + designs["r2"] * C30 >= 12) == designs["feasible"]).all()
    assert result.counts["designs"] == len(designs)


def test_a_search_that_was_cut_short_says_so():
    result = mechdesign.optimize(study_of(ARM, "optimize.evaluations=30"))
    assert result.counts["designs"] <= 30
    assert "the search ended with its 30 evaluations" in str(result.warnings[0])


@pytest.mark.slow
def test_sensitivity_is_the_change_of_the_score_a_step():
    changes = ("optimize.subject_to=[]", "optimize.variables.r1.step=0.5", "optimize.variables.r2={from: 2, to: 4}")
    result = mechdesign.optimize(study_of(ARM, *changes))
    table, bounds = result.tables["sensitivity"], result.tables["bounds"]
    span = bounds["max"][0] - bounds["min"][0]
    assert table["variable"].tolist() == ["r1", "r2"]
    assert table["step"] == pytest.approx([0.5, 0.02])
    assert np.isnan(table["score_down"]).all()
    assert table["score_up"] == pytest.approx([-0.5 * C30 / span, -0.02 * S30 / span])
    assert result.main["active"][0] == "r1 from, r2 from"


@pytest.mark.slow
def test_best_designs_are_apart():
    best = mechdesign.optimize(study_of(ARM)).tables["best"]
    assert best["rank"].tolist() == list(range(1, 11))
    assert (np.diff(best["score"]) <= 0).all()
    for k in range(10):
        for other in range(k):
            apart = max(abs(best[name][k] - best[name][other]) for name in ("r1", "r2"))
            assert apart > 0.05 * 9


@pytest.mark.nightly
def test_same_seed_same_bits_whatever_the_jobs():
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", ["optimize.method=search", "optimize.evaluations=60"])
    one, two = (mechdesign.optimize(study, jobs=jobs).tables["designs"] for jobs in (1, 2))
    other = mechdesign.optimize(study, seed=1).tables["designs"]
    assert len(one) <= 60
    for name in ("l_min", "l_a", "GII", "CPI"):
        assert one[name].tobytes() == two[name].tobytes()
    assert one["l_min"].tobytes() != other["l_min"].tobytes()


def test_no_feasible_design_says_which_requirement_kills_most():
    """A design that misses two conditions counts under both."""
    changes = (
        "optimize.subject_to=[{result: kinematics.P.y, at_least: 1000}, {result: kinematics.P.x, at_most: 4}]",
        "optimize.method=grid", "optimize.variables={r1: {from: 1, to: 5, number: 2}, r2: {from: 1, to: 2, number: 2}}",
    )  # fmt: skip
    with pytest.raises(mechdesign.AssemblyError) as told:
        mechdesign.optimize(study_of(ARM, *changes))
    assert "P.y at least 1000 (4 designs); not kinematics.P.x at most 4 (2 designs)" in str(told.value)


@pytest.mark.nightly
def test_nothing_feasible_leaves_the_nearest_miss_as_a_study(tmp_path):
    """Long arms reach highest, 11 sin 30 + 11 sin 60, which is too low; what else is asked they keep."""
    (tmp_path / "arm.yaml").write_text(ARM.replace("at_least: 12}", "at_least: 20}, {result: r1, at_least: 2}"))
    with pytest.raises(
        mechdesign.AssemblyError, match=r"nearest, r1 = 11, r2 = 11, misses kinematics.P.y at least 20 by"
    ) as told:
        mechdesign.optimize(mechdesign.load(tmp_path / "arm.yaml"))
    result = told.value.result
    highest = 11 * (S30 + C30)
    assert result.main["condition"].tolist() == ["kinematics.P.y at least 20", "r1 at least 2"]
    assert result.main["value"] == pytest.approx([highest, 11])
    assert result.main["bound"].tolist() == [20, 2]
    assert result.main["missing"] == pytest.approx([20 - highest, 0])
    assert result.main["unit"].tolist() == ["mm", "mm"]
    out = tmp_path / "out"
    run = CliRunner().invoke(app, ["optimize", str(tmp_path / "arm.yaml"), "--out", str(out), "--no-plots"])
    assert run.exit_code == 3
    alone = mechdesign.load(out / "nearest.yaml")
    assert mechdesign.kinematics(alone).main["P.y"][0] == pytest.approx(highest)
    assert (out / "nearest.csv").read_text().count("\n") == 3


@pytest.mark.slow
def test_nothing_assembles_leaves_the_design_that_lacks_least():
    """Poses lie 30 from the base; arms of at most 22 that reach farthest lack least."""
    text = ARM.replace("{theta1: 30, theta2: 60}", "{P.x: 30, P.y: 0}").replace("P.y, at_least: 12", "P.y, at_least: 0")
    with pytest.raises(
        mechdesign.AssemblyError, match=r"nearest, r1 = 11, r2 = 11, misses a pose cannot be assembled"
    ) as told:
        mechdesign.optimize(study_of(text))
    table = told.value.result.main
    assert table["condition"].tolist() == ["a pose cannot be assembled"]
    assert np.isnan(table["value"][0])
    assert table["missing"][0] > 0


@pytest.mark.parametrize(
    ("weights", "told"),
    [
        ("[[1, 0, 0], [1, 1]]", r"optimize\.weights\.1: 2 weights for 3 goals"),
        ("[[1, 0, 0], {GIL: 1}]", r"optimize\.weights\.1: 'GIL' is neither .* did you mean 'GRI'"),
        ("[[0, 0, 0]]", r"optimize\.weights\.0: all weights are zero"),
        ("[[1, -1, 0]]", r"optimize\.weights\.0: a weight is not negative"),
    ],
)
def test_wrong_weights_are_told_at_their_row(weights, told):
    with pytest.raises(mechdesign.StudyError, match=told):
        mechdesign.load(CONFIGS / "two_rrr.yaml", [f"optimize.weights={weights}"])


def test_wrong_weights_in_a_file_are_told_with_line_and_column():
    text = ARM + "  weights:\n    - [1]\n    - [1, 2]\n"
    with pytest.raises(mechdesign.StudyError, match=r"<study>:14:7: optimize\.weights\.1: 2 weights for 1 goals"):
        study_of(text)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("optimize.method=grid", "needs either 'step' or 'number'"),
        ("optimize.method=pareto", "between two goals or more"),
        ("optimize.evaluations=3", "at least 10"),
    ],
)
def test_what_a_method_needs(change, told):
    with pytest.raises(mechdesign.StudyError, match=told):
        study_of(ARM, change)


def test_designs_that_do_not_assemble_have_a_slope():
    """The longer the links of a tray's five-bar, the less its poses miss; none where all assemble."""
    problem = tray(None)
    evaluator = Evaluator(
        designs_question(study_of(problem.study), [goal("kinematics.S.x", smallest=True)], graded=True)
    )
    l1 = np.linspace(60, 140, 30)
    designs = {"l1": l1, "l2": l1 + 10, "y0": 0 * l1 + 150}
    found = evaluator(designs)
    open_ = problem.cost(*designs.values()) >= OPEN
    assert 5 < open_.sum() < 25
    assert [bool(reason) for reason in found.reasons] == open_.tolist()
    shortfall = found.table[:, evaluator.layout.shortfall]
    assert (np.diff(shortfall[open_]) < 0).all()
    assert (shortfall[~open_] == 0).all()
    assert ((found.table[:, evaluator.layout.margins] < 0).any(axis=1) == open_).all()


def test_residuals_are_what_a_root_mean_square_is_of():
    problem = timed_path(6, lambda t: 30 * np.cos(t) + 20j * np.sin(t) + 60j, {"a": (10, 20), "b": (90, 99)},
                         more={"c": 80, "u": 30, "v": 20, "x0": 3, "y0": 4})  # fmt: skip
    each = goal(problem.goal, smallest=True)
    evaluator = Evaluator(designs_question(study_of(problem.study), [each], graded=True))
    found = evaluator({"a": np.array([12.0, 18.0]), "b": np.array([95.0, 91.0])})
    assert evaluator.question.squares == {each}
    rows = found.table[:, evaluator.layout.rows[each]]
    assert rows.shape == (2, 12)
    exact = problem.cost(np.array([12.0, 18.0]), np.array([95.0, 91.0]))
    assert np.sqrt((rows**2).sum(axis=1)) == pytest.approx(exact, rel=1e-12)
    assert found.table[:, 0] == pytest.approx(exact, rel=1e-12)


@pytest.mark.slow
def test_errors_over_part_of_a_motion_are_no_optimum():
    """Few poses may be near their target where the others do not assemble."""
    problem = held_height("kinematics.targets.C.y.rms", 0, 360, 10)
    result = mechdesign.optimize(study_of(problem.study, "optimize.evaluations=600"))
    designs = result.tables["designs"]
    cost = problem.cost(*(designs[name] for name in problem.ranges))
    assert ((cost < OPEN) == designs["feasible"]).all()
    assert 0 < designs["feasible"].sum() < len(designs)


@pytest.mark.nightly
def test_searches_use_their_evaluations_and_tell_where_starts_disagree():
    problem = held_height("kinematics.C.y_error", 40, 140, 20)
    result = mechdesign.optimize(study_of(problem.study, "optimize.evaluations=6000"))
    assert 0.9 * 6000 < result.counts["designs"] <= 6000
    ends = search(explorer(rastrigin, 4, budget=5000), np.ones(1), [[1.0]], 0).ends[0]
    assert len(ends) > 2
    assert np.ptp(ends) > 0.5
    told = [*map(str, _doubts(Ending(True, [np.array([2.0, 1.0, np.nan, 1.001])], [0.0], [0.4]), 5000, ["P_error"]))]
    assert told == ["the 4 starts of the search ended with P_error between 1 and 2, 2 of them within 1 % of the best, "
                    "1 found no feasible design, and the last steps from the best led to 0.4; allow "
                    "more, e.g. optimize.evaluations: 20000"]  # fmt: skip
