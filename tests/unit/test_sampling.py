"""Moments of every distribution and pin law, and streams that depend on nothing but seed, pose and chunk."""

from __future__ import annotations

import numpy as np
import pytest

from mechdesign.analyses.reliability.sampling import PIN_VARIANCE, deviations, generator, pins

SAMPLES = 400_000


@pytest.mark.parametrize(("distribution", "kurtosis"), [("normal", 3.0), ("uniform", 1.8)])
def test_deviations(distribution: str, kurtosis: float) -> None:
    drawn = deviations(generator(1, 0, 0), distribution, 0.2, SAMPLES)
    assert abs(drawn.mean()) < 4 * 0.2 / np.sqrt(SAMPLES)
    assert drawn.std() == pytest.approx(0.2, rel=4 * np.sqrt((kurtosis - 1) / 4 / SAMPLES))
    assert np.mean((drawn / drawn.std()) ** 4) == pytest.approx(kurtosis, rel=0.02)


def test_uniform_deviations_stay_within_the_half_width() -> None:
    drawn = deviations(generator(1, 0, 0), "uniform", 1.0, SAMPLES)
    assert np.abs(drawn).max() <= np.sqrt(3.0)
    assert np.abs(drawn).max() == pytest.approx(np.sqrt(3.0), abs=1e-4)


@pytest.mark.parametrize("law", PIN_VARIANCE)
def test_pins_have_the_variance_that_the_analytic_method_takes(law: str) -> None:
    x, y = pins(generator(2, 0, 0), law, SAMPLES)
    for drawn in (x, y):
        error = np.sqrt((np.mean(drawn**4) - np.mean(drawn**2) ** 2) / SAMPLES)
        assert abs(np.mean(drawn**2) - PIN_VARIANCE[law]) < 4 * error
        assert abs(drawn.mean()) < 4 * drawn.std() / np.sqrt(SAMPLES)
    assert abs(np.mean(x * y)) < 4 * np.std(x * y) / np.sqrt(SAMPLES)


def test_variance_of_the_normal_law_cut_to_the_circle() -> None:
    assert PIN_VARIANCE["normal_in_disc"] == pytest.approx(0.1054942148, abs=5e-11)


def test_pins_in_the_disc_stay_there_and_normal_ones_do_not() -> None:
    reach = {law: np.hypot(*pins(generator(2, 0, 0), law, SAMPLES)).max() for law in PIN_VARIANCE}
    assert reach["normal_in_disc"] <= 1.0
    assert reach["uniform"] <= 1.0
    assert reach["normal"] > 1.0


def test_uniform_pins_fill_the_disc_evenly() -> None:
    radius = np.hypot(*pins(generator(2, 0, 0), "uniform", SAMPLES))
    shares, _ = np.histogram(radius**2, 10, (0, 1))
    assert np.abs(shares / SAMPLES - 0.1).max() < 4 * np.sqrt(0.09 / SAMPLES)


def test_streams_are_told_apart_by_seed_pose_and_chunk() -> None:
    keys = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    first = [generator(*key).standard_normal() for key in keys]
    assert len(set(first)) == len(keys)
    assert generator(0, 1, 2).standard_normal() == generator(0, 1, 2).standard_normal()
