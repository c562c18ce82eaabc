"""Pareto fronts: known fronts of functions and of an arm, the knee, crowding, repeatability."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.fronts import FRONTS, dtlz2, functions
from helpers.studies import study_of
from helpers.syntheses import tray

import mechdesign
from mechdesign.ground.numerics.fronts import crowding
from mechdesign.questions.optimize.explorer import Explorer, Points
from mechdesign.questions.optimize.pareto import evolve_front, front, knee
from mechdesign.questions.optimize.search import sample

# x = r1 cos 30 + r2 cos 60 is small and y = r1 sin 30 + r2 sin 60 large: first r2 grows, then r1.
ARM = """\
mechanism:
  parameters: {r1: 5, r2: 5}
  links: {ground: {O: [0, 0]}, upper: [O, E, r1], fore: [E, P, r2]}
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [4, 3], P: [6, 8]}
kinematics: {poses: [{theta1: 30, theta2: 60}], outputs: [P]}
optimize:
  method: pareto
  evaluations: 2000
  variables: {r1: {from: 1, to: 11}, r2: {from: 1, to: 11}}
  maximize: kinematics.P.y
  minimize: kinematics.P.x
"""


def zdt1(u):
    """The front is f2 = 1 - sqrt(f1) [Zitzler, Deb & Thiele, 2000]."""
    g = 1 + 9 * u[:, 1:].mean(axis=1)
    return np.column_stack([u[:, 0], g * (1 - np.sqrt(u[:, 0] / g))])


def spread(function, margins=lambda u: np.empty((len(u), 0)), seed=0):
    def evaluated(u):
        values = function(u)
        return Points(u, values, margins(u), np.empty((len(u), 0)), np.isnan(values).any(axis=1).astype(float))

    explorer = Explorer(evaluated, 3, 3000)
    evolve_front(explorer, np.ones(2), sample(3, np.random.default_rng(seed), 100, 100), seed)
    return explorer.points


def test_front_of_zdt1():
    points = spread(zdt1)
    assert len(points.u) <= 3000
    values = points.values[front(points.values)]
    assert values[:, 1] == pytest.approx(1 - np.sqrt(values[:, 0]), abs=0.02)
    assert np.ptp(values[:, 0]) > 0.98
    assert np.diff(np.sort(values[:, 0])).max() < 0.05
    # Where the front is parallel to the line between its ends.
    assert values[knee(values)] == pytest.approx([0.25, 0.5], abs=0.03)


def test_a_condition_cuts_the_front():
    points = spread(zdt1, lambda u: (u[:, 0] - 0.3)[:, None])
    values = points.values[points.feasible]
    values = values[front(values)]
    assert values[:, 0].min() == pytest.approx(0.3, abs=0.01)
    # A design that is on the front for being nearest to the condition alone may be far from it in the other goal.
    inside = values[values[:, 0] > 0.31]
    assert inside[:, 1] == pytest.approx(1 - np.sqrt(inside[:, 0]), abs=0.02)


def test_points_without_a_value_do_not_reach_the_front():
    points = spread(lambda u: np.where(u[:, [0]] < 0.2, np.nan, zdt1(u)))
    values = points.values[points.feasible]
    assert np.isfinite(values).all()
    assert values[front(values)][:, 0].min() == pytest.approx(0.2, abs=0.02)


def test_front_against_the_definition():
    values = np.random.default_rng(3).integers(0, 12, (300, 3)).astype(float)
    found = set(front(values).tolist())
    seen = set()
    for k, row in enumerate(values):
        beaten = ((values <= row).all(axis=1) & (values < row).any(axis=1)).any()
        first = tuple(row) not in seen
        seen.add(tuple(row))
        assert (k in found) == (first and not beaten)


def test_knee_is_farthest_from_the_plane_through_the_extremes():
    bent = np.array([[0.0, 10.0], [1.0, 2.0], [5.0, 1.5], [10.0, 0.0]])
    assert knee(bent) == 1
    # Scales of the goals do not matter.
    assert knee(bent * [1e6, 1e-3]) == 1
    ball = np.array([[0, 1, 1], [1, 0, 1], [1, 1, 0], [0.2, 0.3, 0.2], [0.9, 0.5, 0.5]])
    assert knee(ball) == 3


def test_crowding_is_the_gap_between_neighbours():
    values = np.array([[0.0, 1.0], [0.25, 0.5], [0.5, 0.25], [1.0, 0.0]])
    assert crowding(values) == pytest.approx([np.inf, 0.5 + 0.75, 0.75 + 0.5, np.inf])


@pytest.mark.nightly
def test_front_of_an_arm_and_its_knee():
    result = mechdesign.optimize(study_of(ARM))
    table = result.main
    assert table.name == "pareto"
    r1, r2 = table["r1"], table["r2"]
    # The front bends where the forearm is longest and the upper arm shortest.
    on_front = np.minimum(np.abs(r1 - 1), np.abs(r2 - 11))
    assert np.quantile(on_front, 0.9) < 0.1
    knee_row = np.flatnonzero(table["knee"])
    assert len(knee_row) == 1
    assert (r1[knee_row[0]], r2[knee_row[0]]) == pytest.approx((1, 11), abs=0.15)
    # The best of the first goal comes first, and no design evaluated surpasses one of the front.
    assert (np.diff(table["kinematics.P.y"]) <= 0).all()
    designs = result.tables["designs"]
    for x, y in zip(table["kinematics.P.x"], table["kinematics.P.y"], strict=True):
        better = (designs["kinematics.P.x"] <= x) & (designs["kinematics.P.y"] >= y)
        assert not (better & ((designs["kinematics.P.x"] < x) | (designs["kinematics.P.y"] > y))).any()
    assert f"r1: {float(r1[knee_row[0]])!r}" in result.files["knee.yaml"]
    assert len(designs) <= 2000


@pytest.mark.nightly
def test_both_ends_of_a_front_are_searched_for():
    """Between short links and good conditioning, where few designs assemble at all."""
    problem = tray(None)
    study = study_of(problem.study, "optimize.method=pareto", "optimize.maximize=[kinematics.conditioning]")
    result = mechdesign.optimize(study)
    table = result.main
    assert table["kinematics.S.x"].min() == pytest.approx(182.28, abs=1e-3)
    designs = result.tables["designs"]
    assert table["kinematics.S.x"].min() == designs["kinematics.S.x"][designs["feasible"]].min()
    values = np.column_stack([table["kinematics.S.x"], -table["kinematics.conditioning"]])
    assert len(front(values)) == len(values) > 20
    share = (values - values.min(axis=0)) / np.ptp(values, axis=0)
    gaps = np.abs(share[:, None] - share[None]).max(axis=2)
    assert gaps[~np.eye(len(gaps), dtype=bool)].min() > 1e-4


def test_same_seed_same_bits():
    study = study_of(ARM, "optimize.evaluations=150")
    one, two, other = (mechdesign.optimize(study, seed=seed, jobs=jobs).main for seed, jobs in ((4, 1), (4, 2), (5, 1)))
    assert one["kinematics.P.x"].tobytes() == two["kinematics.P.x"].tobytes()
    assert one["kinematics.P.x"].tobytes() != other["kinematics.P.x"].tobytes()


@pytest.mark.nightly
def test_a_front_that_still_grows_says_so_and_one_at_its_end_does_not():
    text = """\
mechanism:
  parameters: {x1: 0.5, x2: 0.5, x3: 0.5, x4: 0.5, g: 1 + 3*(x2 + x3 + x4), f2: g*(1 - sqrt(x1/g))}
  links: {ground: {O: [0, 0]}, arm: [O, P, 10]}
  drives: [arm]
  sketch: {P: [10, 0]}
optimize:
  method: pareto
  minimize: [x1, f2]
  evaluations: 400
  variables: {x1: &part {from: 0, to: 1}, x2: *part, x3: *part, x4: *part}
"""
    for evaluations, grows in ((300, True), (6000, False)):
        result = mechdesign.optimize(study_of(text, f"optimize.evaluations={evaluations}"))
        assert any("the front still grows" in words for words in map(str, result.warnings)) is grows
        values = np.column_stack([result.tables["pareto"][name] for name in ("x1", "f2")])
        x, y = values[np.argsort(values[:, 0])].T
        # Between the front f2 = 1 - sqrt(f1) and the corner (1, 1) lies an area of 2/3.
        area = np.sum(np.diff(np.append(x, 1.0)) * (1 - np.minimum(y, 1)))
        assert (area < 0.995 * 2 / 3) == grows


def hypervolume(values, corner):
    """The area between a front of two goals and a corner."""
    x, y = values[np.argsort(values[:, 0])].T
    return float(np.sum(np.diff(np.append(x, corner)) * (corner - y)))


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["zdt1", "zdt3"])
def test_the_default_front_has_nearly_all_of_the_hypervolume(name):
    whole = FRONTS[name].hypervolume
    result = mechdesign.optimize(FRONTS[name].study(5))
    values = np.column_stack([result.main["x1"], result.main["f2"]])
    assert whole * 0.998 < hypervolume(values, 1.1) <= whole * (1 + 1e-5)
    assert not result.warnings
    growth = result.tables["hypervolume"]
    assert growth["designs"][-1] == len(result.tables["designs"])
    assert (np.diff(growth["hypervolume"]) >= -1e-12).all()


@pytest.mark.nightly
def test_optima_of_a_front_are_its_knee_and_its_ends():
    """The second goal leaves y free: of designs that are best in the first the best in the second is the end."""
    formulas = {"f1": "1 + (x1 - 0.5)**2", "f2": "(x1 - 0.75)**2 + (x2 - 0.25)**2"}
    result = mechdesign.optimize(functions(2, formulas, ["f1", "f2"]))
    optimum = result.tables["optimum"]
    assert optimum["what"].tolist() == ["knee", "best f1", "best f2"]
    assert optimum["f1"][1:] == pytest.approx([1, 1.0625], abs=1e-6)
    assert optimum["f2"][1:] == pytest.approx([0.0625, 0], abs=1e-6)
    # f1 - 1 = t^2 and f2 = (1/4 - t)^2: the line between the ends is farthest at t = 1/8.
    assert optimum["x1"][0] == pytest.approx(0.625, abs=0.005)
    assert result.files["knee.yaml"] == result.files["optimum.yaml"]
    best = result.tables["best"]
    assert best["x1"][best["rank"] == 1].tolist() == optimum["x1"].tolist()
    weighted = mechdesign.optimize(functions(2, formulas, ["f1", "f2"], "optimize.weights=[[1, 1]]"))
    assert weighted.tables["optimum"]["what"].tolist() == ["knee", "best f1", "best f2", "weights"]


@pytest.mark.nightly
def test_a_front_of_three_goals_is_a_surface():
    """DTLZ2, an eighth of the unit sphere; few evaluations are no error."""
    for evaluations in (40, 6000):
        given = mechdesign.optimize(dtlz2(4, f"optimize.evaluations={evaluations}"))
        assert given.counts["designs"] <= evaluations
        values = np.column_stack([given.main[name] for name in ("f1", "f2", "f3")])
        assert (np.linalg.norm(values, axis=1) > 1 - 1e-12).all()
    assert np.median(np.linalg.norm(values, axis=1)) < 1.01
    # Every direction of a coarse grid has a design near it.
    steps = np.array([(i, j, 8 - i - j) for i in range(9) for j in range(9 - i)], dtype=float)
    directions = steps / np.linalg.norm(steps, axis=1)[:, None]
    assert np.linalg.norm(directions[:, None] - values, axis=2).min(axis=1).max() < 0.15
