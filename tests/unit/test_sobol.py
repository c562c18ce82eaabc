"""Sobol' indices: the Ishigami function and linear models, whose indices are known, and mechanisms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign
from mechdesign.questions.reliability.sobol import SobolIndices, combine, sample

CONFIGS = Path(__file__).parents[2] / "configs"
A, B = 7.0, 0.1
# A slider whose rod and crank vary, and one whose guide and motor do.
SLIDER_CRANK = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, -20]}
    crank: [O, A, 100]
    rod: [A, B, 200]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [87, 50], B: [285, -20]}
reliability:
  dimensions: {crank.length: 0.3, rod.length: 0.6, ground.G.y: {tolerance: 0.3, distribution: uniform}, theta: 0.1}
  clearances: {A: {radial: 0.05, tolerance: 0.02, pin: uniform, link: rod}}
  poses: [{theta: 60}, {theta: 90}]
  outputs: [B.x, rod.angle]
"""


def ishigami(u: np.ndarray) -> np.ndarray:
    x, y, z = np.pi * (2.0 * ndtr(u) - 1.0)
    values = np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x)
    return np.stack([values, np.zeros_like(values)])[:, None]


def of_ishigami(seed: int, count: int) -> SobolIndices:
    rng = np.random.default_rng(seed)
    return combine([sample(ishigami, [[0], [1], [2]], 3, count, rng) for _ in range(16)])


def exact_of_ishigami() -> tuple[np.ndarray, np.ndarray]:
    """Ishigami & Homma (1990): variances of x, y, and of x with z."""
    alone = np.array([0.5 * (1 + B * np.pi**4 / 5) ** 2, A**2 / 8, 0.0])
    mixed = B**2 * np.pi**8 * (1 / 18 - 1 / 50)
    whole = alone.sum() + mixed
    return alone / whole, (alone + np.array([mixed, 0.0, mixed])) / whole


def test_ishigami() -> None:
    first, total = exact_of_ishigami()
    assert first == pytest.approx([0.31390519, 0.44241114, 0.0], abs=1e-8)
    found = of_ishigami(1, 4096)
    assert found.first[0, 0] == pytest.approx(first, abs=0.02)
    assert found.total[0, 0] == pytest.approx(total, abs=0.02)
    assert (found.first[1] <= found.first[0]).all()
    assert (found.first[0] <= found.first[2]).all()
    assert (found.first[2] - found.first[1] < 0.08).all()
    assert found.samples == 16 * 4096


@pytest.mark.slow
def test_the_intervals_hold_the_true_indices_in_997_of_1000_seeds() -> None:
    seeds = 200
    first, total = exact_of_ishigami()
    missed = np.zeros(6)
    for seed in range(seeds):
        found = of_ishigami(seed, 128)
        inside = [(part[1, 0] - 1e-12 <= true) & (true <= part[2, 0] + 1e-12)
                  for part, true in ((found.first, first), (found.total, total))]  # fmt: skip
        missed += ~np.concatenate(inside)
    # 0.6 misses are expected of each; more than 5 of 200 are less likely than 1e-4.
    assert (missed <= 5).all()


def test_a_mean_far_from_zero_costs_no_digits() -> None:
    def far(u: np.ndarray) -> np.ndarray:
        return ishigami(u) + np.array([1e3, 0.0])[:, None, None]

    rng = np.random.default_rng(3)
    moved = combine([sample(far, [[0], [1], [2]], 3, 500, rng) for _ in range(16)])
    still = of_ishigami(3, 500)
    assert moved.first == pytest.approx(still.first, abs=1e-6)
    assert moved.total == pytest.approx(still.total, abs=1e-6)


def test_beside_its_own_linear_model_the_indices_are_exact() -> None:
    slopes = np.array([3.0, -2.0, 0.5])

    def model(u: np.ndarray) -> np.ndarray:
        return np.stack([slopes @ u, slopes @ u])[:, None]

    rng = np.random.default_rng(0)
    control = slopes[None] ** 2, np.array([slopes @ slopes])
    found = combine([sample(model, [[0], [1], [2]], 3, 10, rng) for _ in range(16)], control)
    for part in (*found.first, *found.total):
        assert part[0] == pytest.approx(slopes**2 / (slopes @ slopes), rel=1e-12)


def test_what_has_no_value_is_counted_and_left_out() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        values = np.where(np.abs(u[0]) > 2.5, np.nan, u[0] + u[1])
        return np.stack([values, values])[:, None]

    rng = np.random.default_rng(0)
    found = combine([sample(model, [[0], [1]], 2, 1000, rng) for _ in range(16)], (np.ones((1, 2)), np.full(1, 2.0)))
    # Both A and B must have values.
    assert found.invalid == pytest.approx(16_000 * (1 - (1 - 2 * ndtr(-2.5)) ** 2), rel=0.2)
    # The first variable, cut at 2.5, has a smaller variance than the second.
    cut = 1 - 2 * 2.5 * np.exp(-3.125) / np.sqrt(2 * np.pi) / (1 - 2 * ndtr(-2.5))
    share = np.array([cut, 1.0]) / (1 + cut)
    assert (found.first[1, 0] <= share).all()
    assert (share <= found.first[2, 0]).all()


def test_of_a_nearly_linear_mechanism_they_are_the_shares() -> None:
    table = mechdesign.reliability(study_of(SLIDER_CRANK)).tables["contributions"]
    for name in ("sobol_first", "sobol_total"):
        assert table[name] == pytest.approx(table["share"], abs=2e-3)
        assert (table[f"{name}_low"] <= table["share"] + 2e-3).all()
    assert (table["sobol_first_high"] - table["sobol_first_low"] < 2e-3).all()
    sums = table["sobol_first"].reshape(-1, 5).sum(axis=1)
    assert sums == pytest.approx(np.ones(4), abs=1e-3)


def test_a_pin_across_its_link_acts_through_its_radius_and_place_together() -> None:
    """A lever's angle errs by y/r: a clearance's radius alone explains nothing, radius and place as one source all."""
    text = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  clearances: {O: {radial: 0.05, tolerance: 0.04, pin: uniform, link: lever}}
  poses: [{theta: 30}]
  outputs: [P]
"""
    table = mechdesign.reliability(study_of(text)).tables["contributions"]
    assert table["sobol_first"] == pytest.approx([1.0, 1.0], abs=1e-9)


@pytest.mark.slow
def test_which_poses_are_asked() -> None:
    def columns(*overrides: str) -> np.ndarray | None:
        table = mechdesign.reliability(study_of(SLIDER_CRANK, *overrides)).tables["contributions"]
        return np.isfinite(table["sobol_first"]) if "sobol_first" in table else None

    assert columns("reliability.samples=100").all()
    assert columns("reliability.methods=analytic") is None
    assert columns("reliability.sobol=0", "reliability.samples=100") is None
    assert columns("reliability.sobol=100", "reliability.methods=analytic").all()
    swept = ["reliability.poses=", "reliability.sweep={theta: {from: 0, to: 300, step: 60}}", "reliability.samples=100"]
    assert columns(*swept) is None
    assert columns(*swept, "reliability.sobol=100").all()
    many = "reliability.poses=[" + ", ".join(f"{{theta: {k}}}" for k in range(6)) + "]"
    assert columns(many, "reliability.samples=100").reshape(6, -1).all(axis=1).tolist() == [True] * 4 + [False] * 2


def test_correlated_sources_have_none_of_their_own_and_the_others_keep_theirs() -> None:
    text = SLIDER_CRANK + "  correlation: [[crank.length, rod.length, 0.8]]\n"
    result = mechdesign.reliability(study_of(text))
    assert [note for note in map(str, result.warnings) if "crank.length, rod.length are correlated" in note]
    table = result.tables["contributions"]
    bound = np.isin(table["source"], ["crank.length", "rod.length"])
    assert np.isnan(table["sobol_first"][bound]).all()
    assert table["sobol_total"][~bound] == pytest.approx(table["share"][~bound], abs=2e-3)


def test_mechanisms_that_cannot_be_assembled_are_told() -> None:
    """A crank that may be too long for its rod."""
    few = ["reliability.dimensions.crank.length={sigma: 45}", "reliability.samples=100", "reliability.sobol=2000"]
    result = mechdesign.reliability(study_of(SLIDER_CRANK, *few))
    (told,) = [note for note in map(str, result.warnings) if "Sobol' indices" in note]
    assert "theta = 90 deg" in told
    assert np.isfinite(result.tables["contributions"]["sobol_first"]).all()


@pytest.mark.slow
def test_the_number_of_threads_changes_no_bit() -> None:
    one, two = (mechdesign.reliability(study_of(SLIDER_CRANK), jobs=jobs).tables["contributions"] for jobs in (1, 2))
    assert one["sobol_first"].tobytes() == two["sobol_first"].tobytes()
