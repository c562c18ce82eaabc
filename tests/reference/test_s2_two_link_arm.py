"""S2: S. J. Lee (1993), reliability analysis of a two-link robot manipulator due to tolerances; Tables 1 and 2.

The exact values are those of the corrected theory. The paper's own simulated columns are estimates from 40,000 samples
as ours are, so the two may differ by the error of both.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import mechdesign
from mechdesign.ground.results import Result

CONFIGS = Path(__file__).parents[2] / "configs"
SAMPLES = 40_000
CASES = ((30.0, 60.0), (45.0, 45.0), (60.0, 80.0))
# Per case: sigma_X, sigma_Y, rho, R.
ANALYTIC = {
    "two_link_arm": ((0.0174, 0.0174, 0.286, 0.992), (0.0174, 0.0174, 0.331, 0.992), (0.0152, 0.0194, 0.206, 0.989)),
    "two_link_arm_uniform": (
        (0.0275, 0.0275, 0.344, 0.871),
        (0.0275, 0.0275, 0.397, 0.873),
        (0.0232, 0.0312, 0.250, 0.865),
    ),
}
# Table 1 case 1 and Table 2 case 1: sigma, rho, R to the first order, and the true R of the sampling model.
EXACT = {
    "two_link_arm": (0.01739164, 0.28631860, 0.99200038, 0.99346125),
    "two_link_arm_uniform": (0.02748737, 0.34386303, 0.87149795, 0.87150401),
}

studies = pytest.mark.parametrize("name", ANALYTIC)
cases = pytest.mark.parametrize("case", range(3))


@cache
def result(name: str) -> Result:
    return mechdesign.reliability(mechdesign.load(CONFIGS / f"{name}.yaml"))


def row(name: str, case: int, method: str) -> tuple[float, float, float, float]:
    moments, table = result(name).tables["moments"], result(name).tables["reliability"]
    pose = (moments["theta1"] == CASES[case][0]) & (moments["method"] == method)
    sigma = dict(zip(moments["output"][pose], moments["sigma"][pose], strict=True))
    (k,) = np.flatnonzero((table["theta1"] == CASES[case][0]) & (table["method"] == method))
    return sigma["P.x"], sigma["P.y"], table["rho"][k], table["reliability"][k]


def standard_errors(values: tuple[float, ...]) -> np.ndarray:
    """Errors of sigma, sigma, rho and R estimated from so many nearly normal samples."""
    one, two, rho, chance = values
    return np.array([one / np.sqrt(2), two / np.sqrt(2), 1 - rho**2, np.sqrt(chance * (1 - chance))]) / np.sqrt(SAMPLES)


@studies
def test_analytic_method_at_case_1_to_all_digits(name: str) -> None:
    sigma, rho, reliability, _ = EXACT[name]
    assert row(name, 0, "analytic") == pytest.approx((sigma, sigma, rho, reliability), abs=6e-9)


@studies
def test_simulated_reliability_against_the_true_one(name: str) -> None:
    true = EXACT[name][3]
    assert abs(row(name, 0, "monte_carlo")[3] - true) <= 4 * np.sqrt(true * (1 - true) / SAMPLES)


@studies
@cases
def test_methods_differ_by_less_than_the_paper_says(name: str, case: int) -> None:
    analytic, simulated = row(name, case, "analytic")[3], row(name, case, "monte_carlo")[3]
    # Sec. 5: "the largest relative difference is below 0.5 %"; ours has the error of another sample.
    assert abs(analytic / simulated - 1) < 0.005 + 4 * standard_errors((1, 1, 0, simulated))[3]


def test_simulated_density_follows_the_bivariate_normal() -> None:
    """Figs. 4 and 5: 25 x 25 cells over +-3 sigma."""
    table = result("two_link_arm_uniform").tables["density"]
    first = slice(0, 625)
    cell = (6 / 25) ** 2
    expected = table["normal"][first] * cell * SAMPLES
    counts = table["simulated"][first] * cell * SAMPLES
    assert len(table) == 3 * 625
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    likely = expected > 20
    chi2 = np.sum((counts[likely] - expected[likely]) ** 2 / expected[likely]) / np.count_nonzero(likely)
    # Uniform lengths flatten the density a little: more than 1, but far below what another density would give.
    assert chi2 < 2.5
