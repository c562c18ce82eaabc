"""Random draws against the moments, ends and quantiles of their distributions."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import VARIED, study_of
from scipy.special import ndtr, ndtri
from scipy.stats import beta

import mechdesign
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability import laws
from mechdesign.questions.reliability.copula import Correlation
from mechdesign.questions.reliability.laws import (
    Beta,
    Lognormal,
    Marginal,
    MeasuredLaw,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from mechdesign.questions.reliability.methods.second_order import Quadratic, cumulants
from mechdesign.questions.reliability.pin_laws import PIN_LAWS, PlaceLaw
from mechdesign.questions.reliability.schema.variation import Dimension
from mechdesign.questions.reliability.simulation import generator
from mechdesign.questions.reliability.study_sources import find_sources

SAMPLES = 200_000
OF_SIGMA = [law.name for law in laws.LAWS.values() if not law.between_ends]
LAWS: dict[str, Marginal] = {
    "normal": Normal(-0.5, 0.7),
    "truncated": TruncatedNormal(-0.7, 0.5),
    "uniform": Uniform(-0.1, 0.3),
    "triangular": Triangular(-0.1, 0.3),
    "lognormal": Lognormal(-0.5, 0.7, 1.0),
    "beta": Beta(-0.1, 0.3, 0.0, (2.0, 5.0)),
}
# Panels fine enough for the kink of a triangular law's density, in standard normal variables.
EDGES = np.linspace(-12, 12, 4001)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
U = (0.5 * (EDGES[1:] + EDGES[:-1])[:, None] + 0.5 * np.diff(EDGES)[:, None] * NODES).ravel()
DENSITY = (0.5 * np.diff(EDGES)[:, None] * WEIGHTS).ravel() * np.exp(-0.5 * U * U) / np.sqrt(2 * np.pi)


def drawn_by(law: Marginal | PlaceLaw, seed: int, parts: int = 1) -> Floats:
    """Draws of a law; of places of pins both parts."""
    out = np.empty((parts, SAMPLES))
    law.draw(generator(seed, 0, 0), out if parts > 1 else out[0])
    return out if parts > 1 else out[0]


def test_every_declared_law_is_tested_here() -> None:
    assert {type(law) for law in LAWS.values()} == {*laws.LAWS.values()}


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_moments_are_those_of_the_quantiles(law: Marginal) -> None:
    mean, *central = law.moments
    x = law.at(U)
    assert DENSITY @ x == pytest.approx(mean, rel=1e-9)
    for order, moment in zip((2, 3, 4), central, strict=True):
        scale = central[0] ** (order / 2)
        assert DENSITY @ (x - mean) ** order == pytest.approx(moment, rel=1e-6, abs=1e-6 * scale)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_draws_have_the_law_of_the_quantiles(law: Marginal) -> None:
    """Kolmogorov's distance; 1.95/sqrt(n) is passed once in a thousand."""
    drawn = np.sort(drawn_by(law, 1))
    u = np.linspace(-4, 4, 400)
    share = np.searchsorted(drawn, law.at(u)) / SAMPLES
    assert np.abs(share - ndtr(u)).max() < 1.95 / np.sqrt(SAMPLES)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_quantiles_rise_and_keep_their_digits_far_out(law: Marginal) -> None:
    u = np.linspace(-9, 9, 181)
    x = law.at(u)
    assert np.all(np.diff(x) >= 0)
    if isinstance(law, Uniform | Triangular):
        # The chance of being nearer to an end than this is that of the variable behind.
        assert law.at(np.array([-8.0]))[0] - law.low == pytest.approx(
            0.4 * ndtr(-8.0) if isinstance(law, Uniform) else np.sqrt(ndtr(-8.0) * 0.4 * 0.1), rel=1e-3, abs=1e-16
        )


def test_a_beta_law_is_that_of_scipy() -> None:
    law = Beta(-0.1, 0.3, 0.0, (2.0, 5.0))
    true = beta(2.0, 5.0, -0.1, 0.4)
    mean, variance, skewness, excess = true.stats("mvsk")
    moments = (mean, variance, skewness * variance**1.5, (excess + 3.0) * variance**2)
    assert law.moments == pytest.approx(moments, rel=1e-12)
    u = np.linspace(-5, 5, 21)
    assert law.at(u) == pytest.approx(true.ppf(ndtr(u)), rel=1e-9)


def test_measured_values_have_their_mean_and_deviation_and_interpolated_quantiles() -> None:
    values = np.random.default_rng(3).gamma(2.0, 0.1, 25)
    law = MeasuredLaw.of(values, 0.0, 10.0)
    mean, *central = law.moments
    assert (mean, central[0]) == pytest.approx((values.mean(), values.var(ddof=1)), rel=1e-12)
    # Quantiles are straight between the shares of the values, whose middle rule is exact to the cell's square.
    shares = (np.arange(500_000) + 0.5) / 500_000
    x = law.at(ndtri(shares))
    for order, moment in zip((2, 3, 4), central, strict=True):
        assert np.mean((x - mean) ** order) == pytest.approx(moment, rel=1e-8)
    # The median is the middle value, stretched about the mean with all others; nothing lies beyond the ends.
    stretch = (law.high - law.low) / np.ptp(values)
    assert 1.0 < stretch < 1.1
    assert law.at(np.zeros(1))[0] - mean == pytest.approx(stretch * (np.median(values) - mean), rel=1e-12)
    assert law.at(np.array([-9.0, 9.0])) == pytest.approx([law.low, law.high])
    drawn = drawn_by(law, 1)
    assert np.abs(np.searchsorted(np.sort(drawn), x[::1000]) / SAMPLES - shares[::1000]).max() < 0.02 + 1.95 / 447


def test_a_tolerance_is_three_sigma_its_ends_or_its_peak() -> None:
    found = {
        name: Dimension(tolerance=[-0.1, 0.3], distribution=name).law(2.0, 10.0)  # type: ignore[arg-type]
        for name in OF_SIGMA
    }
    for law in found.values():
        assert (law.low, law.high, law.nominal) == (-1.0, 3.0, 2.0)
    for name in ("normal", "truncated_normal", "lognormal"):
        assert (found[name].mean, found[name].sigma) == (1.0, pytest.approx(2.0 / 3.0))
    assert isinstance(found["triangular"], Triangular)
    assert found["triangular"].mode == 0.0
    for name in OF_SIGMA:
        law = Dimension(sigma=0.2, distribution=name).law(2.0)
        # What is cut loses a little of the deviation that is asked for before the cut.
        cut = 0.9733369 if name == "truncated_normal" else 1.0
        assert law.moments[1] == pytest.approx(0.04 * cut, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", PIN_LAWS)
def test_pins(name: str) -> None:
    law = PIN_LAWS[name]
    x, y = drawn_by(law, 2, 2)
    for drawn in (x, y):
        error = np.sqrt(np.mean(drawn**4) / SAMPLES)
        assert abs(np.mean(drawn**2) - law.variance) < 4 * error
        assert abs(np.mean(drawn**4) - law.fourth) < 4 * np.std(drawn**4) / np.sqrt(SAMPLES) + 1e-12
    assert abs(np.mean(x * y)) < 4 * law.variance / np.sqrt(SAMPLES)
    assert np.mean(x * x * y * y) == pytest.approx(law.fourth / 3, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", PIN_LAWS)
def test_pins_from_normal_variables_have_the_same_law(name: str) -> None:
    law = PIN_LAWS[name]
    x, y = law.at(*generator(3, 0, 0).standard_normal((2, SAMPLES)))
    other = np.sort(np.hypot(*drawn_by(law, 4, 2)))
    radius = np.sort(np.hypot(x, y))
    levels = np.linspace(0, 1.2, 200)
    gap = np.searchsorted(radius, levels) - np.searchsorted(other, levels)
    if name != "contact":
        assert np.abs(gap).max() / SAMPLES < 1.95 * np.sqrt(2 / SAMPLES)
    turn = np.sort(np.arctan2(y, x))
    even = (turn + np.pi) / (2 * np.pi)
    assert np.abs(even - (np.arange(SAMPLES) + 0.5) / SAMPLES).max() < 1.95 / np.sqrt(SAMPLES)


def test_pins_near_the_middle_of_normal_variables_have_no_kink() -> None:
    for law in PIN_LAWS.values():
        if law is not PIN_LAWS["contact"]:
            small = np.array([1e-160, 1e-9, 1e-5])
            x, y = law.at(small, -small)
            assert x / small == pytest.approx(np.full(3, x[2] / small[2]), rel=1e-9)
            assert y == pytest.approx(-x)


def test_the_normal_law_cut_to_the_disc_has_the_variance_of_s2() -> None:
    assert PIN_LAWS["normal_in_disc"].variance == pytest.approx(0.1054942148, abs=5e-11)


def test_which_pins_leave_their_hole() -> None:
    reach = {name: np.hypot(*drawn_by(law, 2, 2)).max() for name, law in PIN_LAWS.items()}
    assert reach["normal"] > 1
    assert 0.99 < reach["normal_in_disc"] <= 1
    assert 0.99 < reach["uniform"] <= 1
    assert reach["contact"] == pytest.approx(1)


def test_pins_that_are_uniform_fill_the_disc_evenly() -> None:
    radius = np.hypot(*drawn_by(PIN_LAWS["uniform"], 2, 2))
    shares, _ = np.histogram(radius**2, 10, (0, 1))
    assert np.abs(shares / SAMPLES - 0.1).max() < 4 * np.sqrt(0.09 / SAMPLES)


@pytest.mark.slow
@pytest.mark.parametrize("names", [("normal", "uniform"), ("lognormal", "triangular"), ("uniform", "uniform")])
def test_correlation_of_any_two_laws_is_what_was_asked(names: tuple[str, str]) -> None:
    laws = [LAWS[name] for name in names]
    for asked in (0.7, -0.4):
        mixed = Correlation.of(laws, {(0, 1): asked}).root @ generator(5, 0, 0).standard_normal((2, SAMPLES))
        found = np.corrcoef(*(law.at(u) for law, u in zip(laws, mixed, strict=True)))[0, 1]
        assert found == pytest.approx(asked, abs=4 / np.sqrt(SAMPLES))


def test_correlations_that_no_laws_have() -> None:
    three = [Normal(-3, 3)] * 3
    with pytest.raises(mechdesign.StudyError, match="contradict"):
        Correlation.of(three, {(0, 1): 0.9, (1, 2): 0.9, (0, 2): -0.9})
    with pytest.raises(mechdesign.StudyError, match=r"cannot have -0\.9, only -0\.2 to 1"):
        Correlation.of([Lognormal(-6, 6, 1), Lognormal(-6, 6, 1)], {(0, 1): -0.9})


def two_values(low: int, high: int) -> MeasuredLaw:
    return MeasuredLaw.of(np.array([0.0] * low + [1.0] * high), 0.0, 0.0)


def with_outliers(seed: int, count: int) -> MeasuredLaw:
    """Nineteen parts in twenty near 0, the others near 0.1."""
    rng, many = np.random.default_rng(seed), count - count // 20
    return MeasuredLaw.of(np.concatenate([rng.normal(0, 0.002, many), rng.normal(0.1, 0.002, count // 20)]), 0.0, 0.0)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("one", "other", "asked"),
    [
        (with_outliers(1, 100), with_outliers(2, 100), 0.7),
        (with_outliers(1, 100), with_outliers(2, 40), -0.02),
        (with_outliers(1, 3000), with_outliers(2, 100), 0.9),
        (with_outliers(1, 100), Uniform(-1.0, 1.0), 0.4),
        (
            MeasuredLaw.of(np.array([0.0] * 40 + [1.0] * 40), 0.0, 0.0),
            MeasuredLaw.of(np.array([0.0] * 70 + [1.0] * 9), 0.0, 0.0),
            0.3,
        ),
        (Triangular(0.0, 1.0), with_outliers(2, 100), -0.25),
    ],
)
def test_measured_samples_with_outliers_are_drawn_with_the_correlation_asked(
    one: Marginal, other: Marginal, asked: float
) -> None:
    """By the middle rule over the quantiles of a plane of 3000 x 3000 points, which knows nothing of the series."""
    root = Correlation.of([one, other], {(0, 1): asked}).root
    u = ndtri((np.arange(3000) + 0.5) / 3000)
    x, found = one.at(u), 0.0
    for value, first in zip(x, u, strict=True):
        found += float(value * other.at(root[1, 0] * first + root[1, 1] * u).mean())
    mean = x.mean() * other.at(u).mean()
    size = np.sqrt(one.moments[1] * other.moments[1])
    assert (found / len(u) - mean) / size == pytest.approx(asked, abs=2e-3)


def test_what_a_measured_sample_cannot_reach_is_refused_with_its_range() -> None:
    """Uniform shares against one jump: at most sqrt(12 p (1 - p)/4) for a jump at the share p."""
    law = two_values(90, 10)
    with pytest.raises(mechdesign.StudyError, match=r"cannot have 0.7, only -0.52.* to 0.52"):
        Correlation.of([law, Uniform(0.0, 1.0)], {(0, 1): 0.7})


@pytest.mark.nightly
@pytest.mark.parametrize("correlation", ["null", "[[crank.length, rod.length, 0.6]]"])
def test_cumulants_are_those_of_what_is_drawn(correlation: str) -> None:
    """Moments of random quadratic functions of all that varies against a million draws."""
    changes = [] if correlation == "null" else [f"reliability.correlation={correlation}"]
    sources, _ = find_sources(study_of(VARIED, *changes))
    law = cumulants(sources)
    count = 1_000_000
    drawn = sources.draw(np.random.default_rng(5), count)
    pins = drawn[len(sources.scalars) :].reshape(-1, 3, count)
    z = np.concatenate([drawn[: len(sources.scalars)], (pins[:, :1] * pins[:, 1:]).reshape(-1, count)])
    rng = np.random.default_rng(6)
    sigma = np.sqrt(np.diagonal(law.covariance))
    slope = rng.normal(size=(3, len(z))) / sigma
    bend = rng.normal(size=(3, len(z), len(z))) / np.outer(sigma, sigma)
    # The last is bent by the places of pins only, most of all by x^2 - y^2 and x y of each.
    bend[2, :5], bend[2, :, :5] = 0.0, 0.0
    bend += bend.swapaxes(1, 2)
    mean, covariance = Quadratic(np.zeros(3), slope, bend).moments(law)
    values = slope @ z + 0.5 * np.einsum("cij,in,jn->cn", bend, z, z, optimize=True)
    centred = values - values.mean(axis=1, keepdims=True)
    assert (np.abs(values.mean(axis=1) - mean) < 4.5 * values.std(axis=1) / np.sqrt(count)).all()
    products = centred[:, None] * centred
    error = products.std(axis=2) / np.sqrt(count)
    assert (np.abs(products.mean(axis=2) - covariance) < 4.5 * error).all()
