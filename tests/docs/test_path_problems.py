"""The page of ten path problems: printed linkages have their errors, and found ones are better."""

from __future__ import annotations

import numpy as np
import path_problems
import pytest
from path_problems import LIMITS, FourBar, Problem

PROBLEMS = {problem.name: problem for problem in path_problems.problems()}
FOUND = path_problems.found()
# Sums of the squared distances of printed linkages and of the best known ones, by another search and measure.
PRINTED = {"eighteen": 0.00496033, "twelve": 0.000148817, "thirty_five": 103.491, "twenty": 3.42983}
KNOWN = {"eighteen": 0.00304266, "twelve": 7.60894e-05, "thirty_five": 3.36757, "twenty": 0.85426, "triangle": 0.932888}


def squares(problem: Problem, bar: FourBar) -> float:
    return float((bar.distances(problem.points) ** 2).sum())


@pytest.mark.parametrize("name", PRINTED)
def test_a_printed_linkage_has_the_error_that_others_measured(name: str) -> None:
    printed = PROBLEMS[name].printed
    assert printed is not None
    assert squares(PROBLEMS[name], printed) == pytest.approx(PRINTED[name], rel=1e-4)


def test_found_linkages_are_never_worse_than_printed_ones_and_near_the_best_known() -> None:
    assert len(PROBLEMS) == 10
    assert FOUND.keys() == PROBLEMS.keys()
    for name, problem in PROBLEMS.items():
        assert FOUND[name].keys() == LIMITS.keys()
        usual, wide = (squares(problem, FOUND[name][limits]) for limits in LIMITS)
        assert wide < max(1.01 * usual, (1e-9 * problem.size) ** 2)
        assert problem.printed is None or usual < squares(problem, problem.printed)
        assert name not in KNOWN or wide < 1.02 * KNOWN[name]


def test_found_linkages_keep_the_usual_limits() -> None:
    for name, bars in FOUND.items():
        bar, problem = bars["usual limits"], PROBLEMS[name]
        lengths = abs(bar.other - bar.pivot), bar.crank, bar.coupler, bar.rocker
        assert max(lengths) <= 6 * min(lengths) * (1 + 1e-6), name
        away = np.abs(np.array([bar.pivot, bar.other]) - problem.points.mean())
        assert away.max() <= 3 * problem.size * (1 + 1e-6), name
        assert not problem.closed or bar.transmission() > 0, name


def test_the_page_shows_every_problem_with_its_errors_and_a_picture() -> None:
    page = path_problems.sections()
    for name, problem in PROBLEMS.items():
        assert f"## {problem.title}\n" in page
        assert f"](path_problems_{name}.svg)" in page
        assert problem.study() in page
    assert "<svg" in path_problems.drawing(PROBLEMS["five"], FOUND["five"])
    assert "| 35 | 1.72 (28°) | " in path_problems.overview()


@pytest.mark.nightly
@pytest.mark.parametrize("name", PROBLEMS)
def test_the_command_finds_again_what_is_written(name: str) -> None:
    problem = PROBLEMS[name]
    again = problem.solve(LIMITS["usual limits"])
    written = FOUND[name]["usual limits"]
    assert again.error(problem.points) <= 1.02 * written.error(problem.points) + 1e-9 * problem.size
