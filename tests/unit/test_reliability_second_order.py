"""Second-order moments: exact for quadratic errors of all laws; near a dead point, where the first order is wrong."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from helpers.studies import VARIED, study_of
from scipy.special import ndtr

import mechdesign

LEVER = """
mechanism:
  parameters: {a: 2, b: 3}
  links: {ground: {O: [0, 0]}, lever: [O, P, a*a + a*b]}
  drives: {theta: {angle: lever}}
  sketch: {P: [10, 0]}
reliability:
  poses: [{theta: 0}]
  outputs: [P.x]
  methods: [analytic, second_order]
"""
SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 100], rod: [A, B, 105], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [148, 0]}
reliability:
  poses: [{theta: 80}]
  rates: {theta: 1}
  outputs: [B.x]
  dimensions: {crank.length: 2, rod.length: 2}
  methods: [analytic, second_order, monte_carlo]
  samples: 1000000
"""


def ask(text: str, *changes: str, jobs: int = 1) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(text, *changes), jobs=jobs)


def moment(result: mechdesign.Answer, method: str, name: str, order: str = "position") -> float:
    table = result.tables["moments"]
    (found,) = table[name][(table["method"] == method) & (table["order"] == order)]
    return float(found)


def by_density(low: float, high: float, mode: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and probabilities of a uniform law, or of a triangular one."""
    edges = [low, high] if mode is None else [low, mode, high]
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x = np.concatenate([0.5 * (b - a) * nodes + 0.5 * (a + b) for a, b in pairwise(edges)])
    w = np.concatenate([0.5 * (b - a) * weights for a, b in pairwise(edges)])
    if mode is None:
        return x, w / (high - low)
    rising = (x - low) / (mode - low)
    return x, w * np.where(x < mode, rising, (high - x) / (high - mode)) * 2 / (high - low)


def test_a_quadratic_error_has_its_exact_moments() -> None:
    """P.x = a^2 + a b with a triangular between -0.3 and 0.9 about 0 and b uniform within 0.6."""
    dimensions = (
        "reliability.dimensions={a: {tolerance: [-0.3, 0.9], distribution: triangular}, "
        "b: {tolerance: 0.6, distribution: uniform}}"
    )
    result = ask(LEVER, dimensions)
    x, p = by_density(-0.3, 0.9, 0.0)
    y, q = by_density(-0.6, 0.6, None)
    a, b, weight = 2 + x[:, None], 3 + y, p[:, None] * q
    value = a * a + a * b
    mean = (weight * value).sum()
    sigma = np.sqrt((weight * (value - mean) ** 2).sum())
    assert moment(result, "second_order", "mean") == pytest.approx(mean, rel=1e-7)
    assert moment(result, "second_order", "sigma") == pytest.approx(sigma, rel=1e-7)
    # Without the second order the mean is 0.065 and the deviation 8 % off.
    assert moment(result, "analytic", "mean") == pytest.approx(11.4)
    assert moment(result, "analytic", "sigma") < 0.95 * sigma


def test_correlated_normal_dimensions_of_a_quadratic_error() -> None:
    """Isserlis: of a^2 + a b with sigmas s, t and correlation r."""
    s, t, r = 0.2, 0.3, -0.7
    result = ask(
        LEVER,
        f"reliability.dimensions={{a: {{sigma: {s}}}, b: {{sigma: {t}}}}}",
        f"reliability.correlation=[[a, b, {r}]]",
    )
    covariance = np.array([[s * s, r * s * t], [r * s * t, t * t]])
    slope, hessian = np.array([2 * 2 + 3, 2]), np.array([[2, 1], [1, 0]])
    mean = 10 + 0.5 * np.trace(hessian @ covariance)
    variance = slope @ covariance @ slope + 0.5 * np.trace(hessian @ covariance @ hessian @ covariance)
    assert moment(result, "second_order", "mean") == pytest.approx(mean, rel=1e-8)
    assert moment(result, "second_order", "sigma") == pytest.approx(np.sqrt(variance), rel=1e-7)


def test_a_clearance_that_only_changes_the_length_lengthens_it() -> None:
    """sqrt((r + x)^2 + y^2) is longer by y^2/(2 r): E[y^2] = R^2/4 of a uniform pin."""
    result = ask(LEVER, "reliability.clearances={O: {radial: 0.4, pin: uniform, link: lever, effect: length}}")
    shift = 0.4**2 / 4 / (2 * 10)
    assert moment(result, "second_order", "mean") - 10 == pytest.approx(shift, rel=1e-5)
    assert moment(result, "analytic", "mean") == 10
    variance = 0.4**2 / 4 + (0.4**4 * (1 / 8 - 1 / 16)) / (4 * 10**2)
    assert moment(result, "second_order", "sigma") == pytest.approx(np.sqrt(variance), rel=1e-7)


def test_where_the_first_order_sees_nothing() -> None:
    """At 0 deg the drive's error turns P.x by r (1 - cos d): mean -r s^2/2 and deviation r s^2/sqrt(2)."""
    result = ask(LEVER, "reliability.dimensions={theta: {sigma: 2}}", "reliability.limits={P.x: {min: -0.02}}")
    s = np.radians(2)
    assert moment(result, "analytic", "sigma") == pytest.approx(0, abs=1e-12)
    assert moment(result, "second_order", "mean") == pytest.approx(10 - 10 * s * s / 2, rel=1e-9)
    assert moment(result, "second_order", "sigma") == pytest.approx(10 * s * s / np.sqrt(2), rel=1e-5)
    table = result.tables["reliability"]
    failure = dict(zip(table["method"], table["failure"], strict=True))
    assert failure["analytic"] == 0
    expected = ndtr((-0.02 + 10 * s * s / 2) / (10 * s * s / np.sqrt(2)))
    assert failure["second_order"] == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_before_the_upright_crank_the_mean_is_shifted() -> None:
    """A crank of 100 and a rod of 105: the nearer to where they line up, the more their errors bend the slider's."""
    result = ask(SLIDER_CRANK, jobs=2)
    for order in ("position", "velocity"):
        first, second, drawn = (moment(result, m, "mean", order) for m in ("analytic", "second_order", "monte_carlo"))
        assert abs(second - drawn) < 0.2 * abs(first - drawn)
        assert abs(first - drawn) > 10 * moment(result, "monte_carlo", "sigma", order) / 1000


@pytest.mark.slow
def test_near_a_dead_point_against_simulation() -> None:
    """One degree beside the slider's dead point the drive's error of two degrees acts by its square."""
    dimensions = "reliability.dimensions={theta: {sigma: 2}, crank.length: {sigma: 0.02}, rod.length: {sigma: 0.02}}"
    result = ask(SLIDER_CRANK, "reliability.poses=[{theta: 1}]", dimensions, jobs=2)
    first, second, drawn = (moment(result, m, "mean") for m in ("analytic", "second_order", "monte_carlo"))
    sigmas = [moment(result, m, "sigma") for m in ("analytic", "second_order", "monte_carlo")]
    error = sigmas[2] / 1000
    assert abs(first - drawn) > 20 * error
    assert abs(second - drawn) < 4 * error
    assert sigmas[0] < 0.7 * sigmas[2]
    assert sigmas[1] == pytest.approx(sigmas[2], rel=0.01)


@pytest.mark.slow
def test_velocities_and_every_source_against_simulation() -> None:
    changes = ["reliability.rates={theta: 1}", "reliability.outputs=[C, rocker.angle]", "reliability.samples=400000"]
    # A lognormal rod of 10 % is left to the test of cumulants: higher orders than the second count there.
    changes += ["reliability.methods=[second_order, monte_carlo]", "reliability.dimensions.rod.length.sigma=0.5"]
    table = ask(VARIED, *changes, jobs=2).tables["moments"]
    second, drawn = (table["method"] == m for m in ("second_order", "monte_carlo"))
    sigma = table["sigma"][drawn]
    assert (np.abs(table["mean"][second] - table["mean"][drawn]) < 4.5 * sigma / np.sqrt(400_000)).all()
    assert table["sigma"][second] == pytest.approx(sigma, rel=0.008)


def test_a_small_link_in_a_large_mechanism() -> None:
    """A finger of 0.1 on an arm of 10 m, tilted by an offset of its tip: y = sqrt(r^2 - x^2) bends within itself."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0], G: [10000, 0.06]}
    arm: [O, A, 10000]
    finger: [A, B, 0.1]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: arm}}
  sketch: {A: [10000, 0], B: [10000.08, 0.06]}
reliability:
  poses: [{theta: 0}]
  outputs: [B.x]
  dimensions: {ground.G.y: {sigma: 0.003}}
  methods: [second_order]
"""
    shift = -0.5 * 0.1**2 / 0.08**3 * 0.003**2
    result = ask(text)
    found = moment(result, "second_order", "mean") - moment(result, "second_order", "nominal")
    # Of a place of 10,000 so small a shift has about four digits.
    assert found == pytest.approx(shift, rel=0.02)


def test_a_parameter_that_changes_nothing_adds_nothing() -> None:
    moments = []
    for more in ({}, {"mechanism.parameters.c": "7", "reliability.dimensions.c": "0.5"}):
        study = study_of(LEVER, "reliability.dimensions.a=0.3", *(f"{path}={value}" for path, value in more.items()))
        table = mechdesign.reliability(study).tables["moments"]
        moments.append([table[name].tolist() for name in ("mean", "sigma", "worst_case")])
    assert moments[0] == moments[1]
    assert 10 < moments[0][0][1] < 10.1


def test_without_neighbours_there_is_no_second_order() -> None:
    """Exactly at the fold, the crank upright and as long as the rod, a shorter rod cannot be assembled."""
    changes = ["mechanism.links.rod=[A, B, 100]", "reliability.poses=[{theta: 90}, {theta: 60}]"]
    table = ask(SLIDER_CRANK, *changes, "reliability.methods=[second_order]").tables["moments"]
    assert np.isnan(table["sigma"][:3]).all()
    assert np.isfinite(table["sigma"][3:]).all()


def test_the_number_of_threads_changes_nothing() -> None:
    sweep = ["reliability.poses=null", "reliability.sweep={theta: {from: 20, to: 80, step: 5}}"]
    one, two = (ask(VARIED, *sweep, jobs=jobs).tables["moments"] for jobs in (1, 2))
    for column in one.columns:
        assert column.values.tobytes() == two[column.name].tobytes()
