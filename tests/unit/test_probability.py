"""Normal probabilities of limits and intervals of simulated ones, against closed forms and tables."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr, owens_t

import mechdesign
from mechdesign.ground.numerics.statistics import rectangle_failure
from mechdesign.questions.reliability.circles import disc_failure, disc_failures
from mechdesign.questions.reliability.engine.problem import Estimate, binomial
from mechdesign.questions.reliability.first_order import correlation
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.probability import estimated_failure, failure_probability


def quadrant(h: float, k: float, rho: float) -> float:
    """P(X < h, Y < k) by Owen's T function (Owen 1956), for h and k other than zero."""
    rest = np.sqrt(1 - rho * rho)
    half = 0.5 if h * k < 0 else 0.0
    return float(0.5 * (ndtr(h) + ndtr(k)) - owens_t(h, (k / h - rho) / rest) - owens_t(k, (h / k - rho) / rest) - half)


@pytest.mark.parametrize("rho", [0.0, 0.3, -0.7, 0.99, -0.999, 0.9999999])
@pytest.mark.parametrize(
    ("low", "high"), [((-2.9, -2.7), (2.8, 2.6)), ((-1.0, -3.0), (0.5, 2.0)), ((0.2, -6.0), (5.0, 7.0))]
)
def test_rectangle_agrees_with_owens_t(low: tuple[float, float], high: tuple[float, float], rho: float) -> None:
    (a, b), (c, d) = low, high
    inside = quadrant(c, d, rho) - quadrant(a, d, rho) - quadrant(c, b, rho) + quadrant(a, b, rho)
    assert rectangle_failure(np.array(low), np.array(high), rho) == pytest.approx(1 - inside, abs=1e-14)


def test_rectangle_loses_no_digits_far_out() -> None:
    limit = np.array([9.0, 9.0])
    # Independent: 2 p + 2 p - (2 p)^2, of which the last is below rounding.
    assert rectangle_failure(-limit, limit, 0.0) == pytest.approx(4 * ndtr(-9.0), rel=1e-13)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rectangle_of_fully_correlated_errors_is_the_tighter_band(sign: float) -> None:
    low, high = np.array([-2.0, -1.0]), np.array([1.5, 3.0])
    band = (-1.0, 1.5) if sign > 0 else (-2.0, 1.0)
    assert rectangle_failure(low, high, sign) == pytest.approx(ndtr(band[0]) + ndtr(-band[1]), rel=1e-14)


@pytest.mark.parametrize("radius", [0.1, 1.0, 3.0, 8.0, 30.0])
@pytest.mark.parametrize("covariance", [np.eye(2), np.array([[2.0, 0.6], [0.6, 1.0]]), np.diag([1.0, 1e-3])])
def test_disc_agrees_with_the_integral_over_the_direction(covariance: np.ndarray, radius: float) -> None:
    inverse = np.linalg.inv(covariance)
    turn = 2 * np.pi * np.arange(20000) / 20000
    around = np.stack([np.cos(turn), np.sin(turn)])
    form = np.einsum("it,ij,jt->t", around, inverse, around)
    expected = np.mean(np.exp(-0.5 * radius**2 * form) / form) / np.sqrt(np.linalg.det(covariance))
    assert disc_failure(covariance, radius) == pytest.approx(expected, rel=1e-12)


def test_disc_of_an_error_along_one_line() -> None:
    line = np.array([[0.36, 0.48], [0.48, 0.64]])
    assert disc_failure(line, 2.0) == pytest.approx(2 * ndtr(-2.0), rel=1e-12)


def test_one_sided_limit() -> None:
    failure = failure_probability(np.array([[0.04]]), [ErrorBound((0,), -np.inf, 0.5)])
    assert failure == pytest.approx(ndtr(-2.5), rel=1e-14)


def test_three_limits_by_the_lattice() -> None:
    covariance = np.array([[1.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 4.0]])
    bands, third = [ErrorBound((0,), -2.0, 2.0), ErrorBound((1,), -2.0, 2.5)], ErrorBound((2,), -6.0, 6.0)
    pair, single = failure_probability(covariance, bands), failure_probability(covariance, [third])
    together = failure_probability(covariance, [*bands, third])
    assert together == pytest.approx(pair + single - pair * single, rel=1e-4)
    disc = failure_probability(covariance, [ErrorBound((0, 1), -np.inf, 2.0)])
    mixed = failure_probability(covariance, [third, ErrorBound((0, 1), -np.inf, 2.0)])
    assert mixed == pytest.approx(disc + single - disc * single, rel=1e-4)


@pytest.mark.parametrize("limit", [2.0, 3.0, 4.0, 6.0, 9.0])
def test_three_limits_of_errors_with_two_sources(limit: float) -> None:
    """Rarely broken, and depending on each other: against the integral over the direction of the radial one."""
    slopes = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    turn = 2 * np.pi * (np.arange(200_000) + 0.5) / 200_000
    reach = limit / np.abs(slopes @ np.stack([np.cos(turn), np.sin(turn)])).max(axis=0)
    exact = np.mean(np.exp(-0.5 * reach**2))
    bands = [ErrorBound((k,), -limit, limit) for k in range(3)]
    assert failure_probability(slopes @ slopes.T, bands) == pytest.approx(exact, rel=3e-3)


def test_an_error_that_does_not_vary_keeps_its_limit() -> None:
    covariance = np.diag([1.0, 0.0])
    bands = [ErrorBound((0,), -2.0, 2.0), ErrorBound((1,), -0.1, 0.1)]
    assert failure_probability(covariance, bands) == pytest.approx(2 * ndtr(-2.0), rel=1e-14)
    assert np.isnan(correlation(covariance))


def test_clopper_pearson_against_its_tables() -> None:
    # Clopper and Pearson (1934): 3 of 100 and none of 10 at 95 %.
    assert binomial(3, 100, 0.95) == pytest.approx((0.0062300, 0.0851761), abs=5e-8)
    assert binomial(0, 10, 0.95) == pytest.approx((0.0, 1 - 0.025**0.1), rel=1e-12)
    assert binomial(10, 10, 0.95) == pytest.approx((0.025**0.1, 1.0), rel=1e-12)


def test_clopper_pearson_covers_at_its_rate() -> None:
    samples, chance = 400, 0.02
    seen = np.random.default_rng(3).binomial(samples, chance, 4000)
    intervals = {k: binomial(int(k), samples) for k in np.unique(seen)}
    covered = np.mean([intervals[k][0] <= chance <= intervals[k][1] for k in seen])
    assert covered >= 0.997 - 4 * np.sqrt(0.997 * 0.003 / 4000)


def test_simulation_error_is_that_of_the_paper() -> None:
    # S2, Sec. 5: at most 0.0075 at R = 0.5 and 0.0045 at R = 0.9 with 40,000 samples.
    assert round(Estimate(0.5, 0.49, 0.51, 40_000, 40_000, 20_000).error, 4) == 0.0075
    assert round(Estimate(0.1, 0.09, 0.11, 40_000, 40_000, 4_000).error, 4) == 0.0045


@pytest.mark.parametrize("rho", [1 + 1e-15, -1 - 1e-15])
def test_a_correlation_beyond_one_by_rounding_is_one(rho: float) -> None:
    found = rectangle_failure(np.array([-2.0, -3.0]), np.array([2.0, 3.0]), rho)
    assert found == pytest.approx(2 * ndtr(-2.0), rel=1e-12)


@pytest.mark.parametrize("covariance", [np.eye(2), np.array([[2.0, 0.6], [0.6, 1.0]]), np.diag([1.0, 1e-4])])
@pytest.mark.parametrize("mean", [(0.5, -0.3), (2.5, 1.0), (0.0, 4.0)])
def test_disc_about_another_place_than_the_mean(covariance: np.ndarray, mean: tuple[float, float]) -> None:
    """Against the integral over the direction from zero of the closed radial one, by the trapezoidal rule."""
    radius, inverse = 2.0, np.linalg.inv(covariance)
    turn = 2 * np.pi * np.arange(40000) / 40000
    around = np.stack([np.cos(turn), np.sin(turn)])
    a = np.einsum("it,ij,jt->t", around, inverse, around)
    b = np.einsum("it,ij,j->t", around, inverse, mean)
    c = np.asarray(mean) @ inverse @ np.asarray(mean)
    # The integral of r exp(-(a r^2 - 2 b r + c)/2) from the radius on.
    far = np.sqrt(2 * np.pi / a) * ndtr(-(radius - b / a) * np.sqrt(a)) * b / a * np.exp(-0.5 * (c - b * b / a))
    expected = np.mean(np.exp(-0.5 * (a * radius**2 - 2 * b * radius + c)) / a + far) / np.sqrt(
        np.linalg.det(covariance)
    )
    assert disc_failure(covariance, radius, np.array(mean)) == pytest.approx(expected, rel=1e-11)


def test_limits_about_another_place_than_the_mean() -> None:
    covariance, mean = np.array([[1.0, 0.3], [0.3, 2.0]]), np.array([0.4, -0.7])
    one, two = ErrorBound((0,), -2.0, 3.0), ErrorBound((1,), -4.0, 2.0)
    moved = [ErrorBound((0,), -2.4, 2.6), ErrorBound((1,), -3.3, 2.7)]
    assert failure_probability(covariance, (one, two), mean) == failure_probability(covariance, moved)
    # By the lattice, which takes bands and discs together.
    disc = ErrorBound((0, 1), -np.inf, 2.5)
    alone = disc_failure(covariance, 2.5, mean)
    wide = (ErrorBound((0,), -50.0, 50.0),)
    assert failure_probability(covariance, (*wide, disc), mean) == pytest.approx(alone, rel=1e-4)


@pytest.mark.parametrize(("radius", "rho"), [(7.0, 0.9), (6.0, 0.0), (9.0, -0.5), (4.5, 0.99)])
def test_a_circle_beside_an_idle_limit_is_the_circle_however_rare(radius: float, rho: float) -> None:
    covariance = np.array([[1.0, rho, 0.1], [rho, 1.0, 0.0], [0.1, 0.0, 1.0]])
    mean = np.array([0.2, -0.1, 0.0])
    alone = disc_failure(covariance[:2, :2], radius, mean[:2])
    beside = failure_probability(covariance, (ErrorBound((2,), -50.0, 50.0), ErrorBound((0, 1), -np.inf, radius)), mean)
    assert beside == pytest.approx(alone, rel=1e-9)


def test_a_circle_beside_a_limit_that_counts_as_well() -> None:
    """Independent of each other: 1 - (1 - p)(1 - q)."""
    p, q = disc_failure(np.eye(2), 6.0), 2 * ndtr(-5.5)
    found = failure_probability(np.eye(3), (ErrorBound((2,), -5.5, 5.5), ErrorBound((0, 1), -np.inf, 6.0)))
    assert found == pytest.approx(p + q, rel=1e-7)


@pytest.mark.parametrize("least", [0.0, 0.7])
@pytest.mark.parametrize(("radius", "limit"), [(1.5, 1.0), (3.0, 2.5), (5.0, 4.5), (2.0, 6.0)])
def test_a_circle_beside_another_output_is_the_sum_over_the_disc_however_it_is_turned(
    radius: float, limit: float, least: float
) -> None:
    """Against the density times the chance of the band, by equal steps round the ring and Gauss-Legendre across it."""
    covariance = np.array([[1.0, 0.4, 0.5], [0.4, 0.6, -0.3], [0.5, -0.3, 1.2]])
    mean = np.array([0.2, -0.1, 0.3])
    inverse = np.linalg.inv(covariance[:2, :2])
    slopes = inverse @ covariance[:2, 2]
    rest = np.sqrt(covariance[2, 2] - covariance[2, :2] @ slopes)
    nodes, weights = np.polynomial.legendre.leggauss(120)
    r, turn = least + (radius - least) * (nodes + 1) / 2, 2 * np.pi * np.arange(1200) / 1200
    away = r * np.array([np.cos(turn), np.sin(turn)])[..., None] - mean[:2, None, None]
    density = np.exp(-0.5 * np.einsum("itr,ij,jtr->tr", away, inverse, away)) * np.sqrt(np.linalg.det(inverse))
    middle = mean[2] + np.tensordot(slopes, away, 1)
    within = ndtr((limit - middle) / rest) - ndtr((-limit - middle) / rest)
    kept = (density * within * r).mean(axis=0) @ weights * (radius - least) / 2
    for angle in np.radians([0, 17, 45, 90, 200]):
        turned = np.eye(3)
        turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        found, doubt = estimated_failure(
            turned @ covariance @ turned.T,
            [ErrorBound((2,), -limit, limit), ErrorBound((0, 1), least, radius)],
            turned @ mean,
        )
        assert found == pytest.approx(1 - kept, rel=1e-8, abs=1e-12)
        assert doubt == 0


@pytest.mark.parametrize("across", [1.0, 1e-3, 1e-8, 0.0])
def test_a_circle_beside_one_of_its_own_coordinates_ends_at_a_straight_line(across: float) -> None:
    """Errors along x, and hardly across it: within the circle and the band is |x| below the smaller."""
    root = np.array([[1.0, 0.0], [0.0, across], [1.0, 0.0]])
    found = failure_probability(root @ root.T, [ErrorBound((2,), -1.2, 1.5), ErrorBound((0, 1), -np.inf, 1.8)])
    if across < 1:
        assert found == pytest.approx(ndtr(-1.2) + ndtr(-1.5), rel=3 * across**2 + 1e-10)
    else:
        x, weight = np.polynomial.legendre.leggauss(60)
        x, weight = 0.15 + 1.35 * x, 1.35 * weight
        within = weight @ (np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi) * (2 * ndtr(np.sqrt(1.8**2 - x**2)) - 1))
        assert found == pytest.approx(1 - within, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("limit", [1.0, 2.0, 3.0, 4.0])
def test_the_interval_of_many_limits_holds_what_is_exact(limit: float) -> None:
    """Three outputs of two sources: the integral over the direction; two circles and a band, independent."""
    slopes = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    turn = 2 * np.pi * (np.arange(100_000) + 0.5) / 100_000
    reach = limit / np.abs(slopes @ np.stack([np.cos(turn), np.sin(turn)])).max(axis=0)
    exact = np.mean(np.exp(-0.5 * reach**2))
    found, doubt = estimated_failure(slopes @ slopes.T, [ErrorBound((k,), -limit, limit) for k in range(3)])
    assert abs(found - exact) <= doubt <= 0.02 * exact
    circle, band = np.exp(-0.5 * limit**2), 2 * ndtr(-limit)
    exact = 1 - (1 - circle) ** 2 * (1 - band)
    found, doubt = estimated_failure(
        np.eye(5), [ErrorBound((4,), -limit, limit), *(ErrorBound(pair, -np.inf, limit) for pair in ((0, 1), (2, 3)))]
    )
    assert abs(found - exact) <= doubt <= 0.05 * exact


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0, 17, 90, 200])
def test_a_circle_and_the_reach_of_an_arm_fail_alike_in_every_direction(turn: float) -> None:
    """Against equal steps of the direction in the plane of the two lengths, whose tolerances are three deviations."""
    study = study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, 100], lower: [A, T, 70]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: lower, from: upper}}}}
  sketch: {{A: [80, 60], T: [100, 127]}}
  measures: {{reach: {{distance: [O, T]}}}}
reliability:
  poses: [{{q1: {turn}, q2: 70}}]
  dimensions: {{upper.length: 0.3, lower.length: 0.2}}
  limits: {{T: {{radius: 0.26}}, reach: 0.16}}
  methods: [analytic]
""")
    row = mechdesign.reliability(study).tables["reliability"]
    elbow = np.exp(1j * np.radians(70))
    away = (100 + 70 * elbow) / abs(100 + 70 * elbow)
    way = np.exp(2j * np.pi * (np.arange(400_000) + 0.5) / 400_000)
    place = 0.1 * way.real + 0.2 / 3 * way.imag * elbow
    far = np.minimum(0.26 / np.abs(place), 0.16 / np.abs((place * np.conj(away)).real))
    assert row["failure"][0] == pytest.approx(np.mean(np.exp(-0.5 * far**2)), rel=1e-9)
    assert row["failure"][0] == row["failure_low"][0] == row["failure_high"][0]


@pytest.mark.slow
def test_circles_of_many_poses_are_those_one_by_one() -> None:
    """Ovals from round to a line, radii from a tenth of a deviation to twelve, means at the centre and far outside."""
    rng = np.random.default_rng(4)
    count = 300
    turned = np.array([[[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]] for t in rng.uniform(0, 7, count)])
    squares = np.stack([np.ones(count), 10.0 ** rng.uniform(-8, 0, count)], axis=1)
    covariance = turned @ (squares[:, :, None] * turned.swapaxes(1, 2))
    radius, mean = (
        10.0 ** rng.uniform(-1, 1.1, count),
        rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(-3, 1, (count, 1)),
    )
    alone = [disc_failure(c, r, m) for c, r, m in zip(covariance, radius.tolist(), mean, strict=True)]
    assert disc_failures(covariance, radius, mean) == pytest.approx(np.array(alone), rel=1e-11)
    # Of independent errors alike the distance has Rayleigh's law.
    round_ones = disc_failures(np.tile(np.eye(2), (3, 1, 1)), np.array([1.0, 3.0, 9.0]), np.zeros((3, 2)))
    assert round_ones == pytest.approx(np.exp([-0.5, -4.5, -40.5]), rel=1e-13)
