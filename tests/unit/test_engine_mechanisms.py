"""Methods about the limits at mechanisms of every kind, against plain simulation of the same ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from helpers.studies import PLATFORM, study_of
from scipy import optimize, stats

import mechdesign

ARM = """
mechanism:
  parameters: {r1: 10, r2: 8}
  links: {ground: {O: [0, 0]}, upper_arm: [O, E, r1], forearm: [E, P, r2]}
  drives: {theta1: {angle: upper_arm}, theta2: {angle: forearm}}
  sketch: {E: [8.7, 5], P: [12.7, 11.9]}
reliability:
  poses: [{theta1: 30, theta2: 60}]
  outputs: [P]
"""
# Study, dimensions, what else varies, limits.
STUDIES = {
    "newton_group": (PLATFORM, "{l1: 0.03, l2: 0.03, ground.A2.x: 0.06, platform.B3.y: 0.06}", "",
                     "{B1: {radius: 0.13}, platform.angle: 0.2}"),
    "newton_group_acceleration": (PLATFORM, "{l1: 0.3, ground.A2.x: 0.6, platform.B3.y: 0.6}", "",
                                  "{platform.angle_velocity: 0.6, B1.x_acceleration: {max: 0.6}}"),
    "distributions": (ARM, """
    r1: {tolerance: [-0.01, 0.04], distribution: triangular}
    r2: {sigma: 0.01, distribution: lognormal}
    theta1: {tolerance: 0.1, distribution: uniform}
    theta2: {tolerance: 0.1, distribution: truncated_normal}
    ground.O.y: {tolerance: [0, 0.02]}""", "", "{P.x: 0.04, P.y: {min: -0.03, max: 0.05}}"),
    "correlation": (ARM, "{r1: 0.03, r2: {tolerance: 0.03, distribution: uniform}, theta1: 0.05}",
                    "correlation: [[r1, r2, 0.8], [r1, theta1, -0.3]]", "{P: {radius: 0.055}}"),
    "contact": (ARM, "{r1: 0.03}", "clearances: {O: {radial: 0.03, link: upper_arm, pin: contact}, "
                "E: {radial: 0.03, tolerance: 0.01, link: forearm, pin: contact}}", "{P: {radius: 0.07}}"),
}  # fmt: skip


def ask(name: str, *changes: str, jobs: int = 1) -> mechdesign.Answer:
    text, dimensions, more, limits = STUDIES[name]
    text += f"  dimensions: {dimensions}\n  limits: {limits}\n" + (f"  {more}\n" if more else "")
    return mechdesign.reliability(study_of(text, *changes), seed=2, jobs=jobs)


class Interval(NamedTuple):
    failure: float
    low: float
    high: float


def estimates(result: mechdesign.Answer) -> dict[str, Interval]:
    table = result.tables["reliability"]
    columns = (table[name].tolist() for name in ("failure", "failure_low", "failure_high"))
    return dict(zip(table["method"].tolist(), (Interval(*row) for row in zip(*columns, strict=True)), strict=True))


@pytest.mark.nightly
@pytest.mark.parametrize("name", STUDIES)
def test_methods_agree(name: str) -> None:
    methods = "reliability.methods=[monte_carlo, form, importance_sampling, auto]"
    found = estimates(ask(name, methods, "reliability.samples=60000", "reliability.precision=0.0336"))
    plain = found["monte_carlo"]
    assert 1e-4 < plain.failure < 0.05
    for method in ("importance_sampling", "auto"):
        assert max(found[method].low, plain.low) <= min(found[method].high, plain.high)
    width = found["importance_sampling"].high - found["importance_sampling"].low
    assert width < 0.5 * (plain.high - plain.low)
    assert found["auto"].high - found["auto"].low <= 0.2 * found["auto"].failure
    if name == "distributions":
        # Bounded laws bend the limits: the tangents are what they are, and no nearer.
        assert found["form"].failure == pytest.approx(tangents(), rel=0.01)
        return
    # The tangents are near, except of pins on their rims: those fail by their direction alone, from the mean on.
    assert 0.8 < found["form"].failure / plain.failure < (15 if name == "contact" else 1.25)


def tangents() -> float:
    """FORM of the arm of "distributions", its design points by SciPy from six starts each."""
    s = np.sqrt(np.log1p((0.01 / 8) ** 2))
    laws = (
        stats.triang(0.2, -0.01, 0.05), stats.lognorm(s, -8, 8 * np.exp(-s * s / 2)), stats.uniform(-0.1, 0.2),
        stats.truncnorm(-3, 3, 0, 0.1 / 3), stats.norm(0.01, 0.01 / 3),
    )  # fmt: skip

    def margins(u: np.ndarray) -> np.ndarray:
        r1, r2, theta1, theta2, y = (law.ppf(stats.norm.cdf(value)) for law, value in zip(laws, u, strict=True))
        upper, fore = np.exp(1j * np.pi / 6), np.exp(1j * np.pi / 3)
        p = (10 + r1) * upper * np.exp(1j * np.radians(theta1)) + (8 + r2) * fore * np.exp(1j * np.radians(theta2))
        p += 1j * y - 10 * upper - 8 * fore
        return np.array([0.04 - p.real, 0.04 + p.real, 0.05 - p.imag, 0.03 + p.imag])

    points = []
    for k in range(4):
        bound = {"type": "eq", "fun": lambda u, k=k: 100 * margins(u)[k]}
        starts = np.random.default_rng(0).standard_normal((6, 5))
        ended = [optimize.minimize(lambda u: u @ u / 2, u, method="SLSQP", constraints=bound) for u in starts]
        points.append(min((one.x for one in ended if one.success), key=np.linalg.norm))
    distance = np.linalg.norm(points, axis=1)
    normal = np.array(points) / distance[:, None]
    return float(1 - stats.multivariate_normal(cov=normal @ normal.T, allow_singular=True, seed=0).cdf(distance))


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["newton_group", "contact"])
def test_the_number_of_threads_and_a_second_run_change_nothing(name: str) -> None:
    changes = ("reliability.methods=[form, importance_sampling, auto]", "reliability.samples=4000")
    first, again, threads = (ask(name, *changes, jobs=jobs) for jobs in (1, 1, 2))
    for key, table in first.tables.items():
        for column in table.columns:
            assert column.values.tobytes() == again.tables[key][column.name].tobytes()
            assert column.values.tobytes() == threads.tables[key][column.name].tobytes()


@pytest.mark.nightly
def test_auto_along_a_sweep() -> None:
    sweep = ["reliability.poses=null", "reliability.sweep={theta1: {from: 0, to: 360, step: 15}, theta2: 60}"]
    result = ask("correlation", "reliability.methods=[auto, monte_carlo]", "reliability.precision=0.0673", *sweep)
    table = result.tables["reliability"]
    poses = table["scope"] == "pose"
    auto, plain = (poses & (table["method"] == name) for name in ("auto", "monte_carlo"))
    assert auto.sum() == plain.sum() == 25
    assert (table["failure_high"] - table["failure_low"] <= 0.4 * table["failure"])[auto].all()
    apart = (table["failure_low"][auto] > table["failure_high"][plain]) | (
        table["failure_high"][auto] < table["failure_low"][plain]
    )
    # Of 50 intervals 0.3 % do not cover.
    assert apart.sum() <= 1
    assert table["evaluations"][auto].max() < 60_000
    assert set(table["used"][auto].tolist()) <= {"monte_carlo", "importance_sampling"}


@pytest.mark.slow
def test_where_no_failure_is_within_reach_there_is_a_value_of_0_and_a_bound() -> None:
    """Uniform links of the arm reach 0.06 together at the most."""
    dimensions = "{r1: {tolerance: 0.03, distribution: uniform}, r2: {tolerance: 0.03, distribution: uniform}}"
    text = ARM + f"  dimensions: {dimensions}\n  limits: {{P: {{radius: 0.0601}}}}\n  samples: 30000\n"
    result = mechdesign.reliability(study_of(text, "reliability.methods=[importance_sampling, auto]"))
    for found in estimates(result).values():
        assert found.failure == found.low == 0.0
        assert found.high == pytest.approx(1 - 0.0015 ** (1 / 30_000), rel=1e-9)
    assert sum("no failure in 30000 samples" in text for text in map(str, result.warnings)) == 2
    assert np.isfinite(result.tables["reliability"]["failure"]).all()
