"""Search over three variables for the continuous optimum of S1's 2-RRR, and the front between its indices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.fronts import FRONTS
from helpers.studies import study_of
from helpers.syntheses import PROBLEMS
from scipy.optimize import differential_evolution

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.ground.numerics.fronts import hypervolume
from mechdesign.questions.optimize.question import designs_question

STUDY = Path(__file__).parent / "three_variables.yaml"
INDICES = ("GII", "GRI", "SUI")

SEEDS, MORE = 10, 10


def best_of_a_line(bounds: mechdesign.ground.results.Table) -> float:
    """The best score of symmetrical designs with lower links of length R, l_min in steps of 0.0005, by these bounds."""
    study = mechdesign.load(STUDY, ["workspace.integrate.tolerance=1e-6"])
    l_min = np.arange(1.05, 1.15, 0.0005)
    found = Evaluator(designs_question(study, [goal(name) for name in INDICES]))(
        {"l_min": l_min, "l_1": l_min**0, "l_2": l_min**0}
    )
    low, high = bounds["min"][:3], bounds["max"][:3]
    values = found.table[:, : len(INDICES)].T
    return float(((values - low[:, None]) / (high - low)[:, None]).sum(axis=0).max())


@pytest.mark.parametrize("jobs", [1, 2])
def test_three_variables(benchmark: Any, jobs: int) -> None:
    study = mechdesign.load(STUDY)
    result = benchmark.pedantic(lambda: mechdesign.optimize(study, jobs=jobs), rounds=3)
    assert result.main["l_1"][0] == result.main["l_2"][0] == 1
    assert result.main["score"][0] == pytest.approx(best_of_a_line(result.tables["bounds"]), abs=1e-4)
    benchmark.extra_info.update(designs=result.counts["designs"], l_min=float(result.main["l_min"][0]))


def test_front_of_two_indices(benchmark: Any) -> None:
    changes = ["optimize.method=pareto", "optimize.maximize=[GII, SUI]", "optimize.evaluations=1000"]
    study = mechdesign.load(STUDY, changes)
    result = benchmark.pedantic(lambda: mechdesign.optimize(study, jobs=2), rounds=1)
    benchmark.extra_info.update(designs=result.counts["designs"], front=len(result.main))


@pytest.mark.parametrize("name", list(PROBLEMS))
def test_as_good_as_ten_times_the_evaluations_of_differential_evolution(benchmark: Any, name: str) -> None:
    """On closed forms, which know nothing of the package; in nine of ten seeds."""
    problem = PROBLEMS[name]()
    study = study_of(problem.study)
    results = benchmark.pedantic(lambda: [mechdesign.optimize(study, seed=k) for k in range(SEEDS)], rounds=1)
    found = np.array([result.main[problem.goal][0] for result in results])
    size = 15 * len(problem.ranges)
    evolved = np.array([
        differential_evolution(
            problem.of_cube, [(0, 1)] * len(problem.ranges), vectorized=True, updating="deferred", polish=False, tol=0,
            maxiter=MORE * result.counts["designs"] // size, rng=seed,
        ).fun
        for seed, result in enumerate(results)
    ])  # fmt: skip
    benchmark.extra_info.update(
        designs=max(result.counts["designs"] for result in results), best=found.min(), worst=found.max(),
        evolved=evolved.min(), evolved_worst=evolved.max(),
    )  # fmt: skip
    assert (found <= 1.01 * evolved).sum() >= SEEDS - 1


@pytest.mark.parametrize(("name", "variables"), [("zdt1", 30), ("zdt3", 30), ("dtlz2", 12)])
def test_default_fronts_have_all_but_a_hundredth_of_the_hypervolume(benchmark: Any, name: str, variables: int) -> None:
    problem = FRONTS[name]
    study = problem.study(variables)
    results = benchmark.pedantic(lambda: [mechdesign.optimize(study, seed=k) for k in range(3)], rounds=1)
    missing = [
        1 - hypervolume(np.column_stack([each.main[g] for g in problem.goals]), 1.1) / problem.hypervolume
        for each in results
    ]
    benchmark.extra_info.update(missing=max(missing), designs=max(each.counts["designs"] for each in results))
    assert max(missing) < 0.01
