"""Limits of values themselves, and process capability, against closed forms of a lever and a shifted point."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr, ndtri

import mechdesign

# P.x = l cos(theta), of a length with sigma 0.1.
LEVER = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  poses: [{theta: 60}, {theta: 60.05}]
  dimensions: {lever.length: 0.3}
  limits: {P.x: {lsl: 49.85, usl: 50.1}}
  methods: [analytic]
  samples: 40000
"""
COSINES = np.cos(np.radians([60.0, 60.05]))


def capability(*overrides: str) -> mechdesign.Table:
    return mechdesign.reliability(study_of(LEVER, *overrides)).tables["capability"]


@pytest.mark.slow
def test_limits_of_the_value_hold_at_every_pose() -> None:
    methods = "reliability.methods=[analytic, second_order, monte_carlo, form, importance_sampling]"
    table = mechdesign.reliability(study_of(LEVER, methods)).tables["reliability"]
    sigma, nominal = 0.1 * COSINES, 100.0 * COSINES
    exact = ndtr((49.85 - nominal) / sigma) + ndtr((nominal - 50.1) / sigma)
    for method in ("analytic", "second_order", "form"):
        assert table["failure"][table["method"] == method] == pytest.approx(exact, rel=1e-6)
    for method in ("monte_carlo", "importance_sampling"):
        rows = table["method"] == method
        assert (table["failure_low"][rows] < exact).all()
        assert (table["failure_high"][rows] > exact).all()


@pytest.mark.slow
def test_limits_of_the_value_are_those_of_the_error_about_the_nominal_value() -> None:
    methods = ("reliability.methods=[monte_carlo]", "reliability.poses=[{theta: 60}]")
    value, error = (
        mechdesign.reliability(study_of(LEVER, *methods, f"reliability.limits.P.x={limit}")).tables["reliability"]
        for limit in ("{lsl: 49.85, usl: 50.1}", "[-0.15, 0.1]")
    )
    assert value["failure"].tolist() == error["failure"].tolist()
    assert min(value["failure"]) > 0


def test_limits_of_an_angle_are_at_the_nearest_turn() -> None:
    drive = ("reliability.dimensions={theta: 0.3}", "reliability.limits={lever.angle: {lsl: 9.9, usl: 10.2}}")
    table = mechdesign.reliability(study_of(LEVER, *drive, "reliability.poses=[{theta: 10}, {theta: 370}]")).tables
    exact = ndtr(-1.0) + ndtr(-2.0)
    assert table["reliability"]["failure"] == pytest.approx([exact, exact], rel=1e-9)
    assert table["capability"]["usl"] - table["capability"]["nominal"] == pytest.approx([0.2, 0.2])
    # A single limit has no middle to be near to: the value is that of the tables.
    single = (
        drive[0],
        "reliability.limits={lever.angle: {usl: 170}}",
        "reliability.poses=[{theta: -20}, {theta: 179}]",
    )
    assert mechdesign.reliability(study_of(LEVER, *single)).tables["reliability"]["failure"].tolist() == [0.0, 1.0]


def test_a_nominal_value_outside_its_limits_is_told_with_its_pose() -> None:
    result = mechdesign.reliability(study_of(LEVER, "reliability.limits={P.x: {lsl: 49.95}}"))
    assert [*map(str, result.warnings)] == [
        "P.x: the nominal value 49.9244 at theta = 60.05 deg lies outside its limits, at least 49.95 mm"
    ]
    assert result.tables["reliability"]["reliability"][0] == pytest.approx(ndtr(1.0), rel=1e-9)
    assert result.tables["reliability"]["reliability"][1] == pytest.approx(ndtr(-(49.95 / COSINES[1] - 100) / 0.1))


def test_capability_of_two_sided_and_one_sided_limits() -> None:
    table = capability("reliability.dimensions.lever.length=[-0.1, 0.5]")
    mean, sigma = 100.2 * COSINES, 0.1 * COSINES
    assert table["cp"] == pytest.approx(0.25 / (6 * sigma), rel=1e-9)
    assert table["cpk"] == pytest.approx(np.minimum(50.1 - mean, mean - 49.85) / (3 * sigma), rel=1e-9)
    failure = ndtr((49.85 - mean) / sigma) + ndtr((mean - 50.1) / sigma)
    assert table["ppm"] == pytest.approx(1e6 * failure, rel=1e-9)
    assert table["sigma_level"] == pytest.approx(-ndtri(failure), rel=1e-9)
    assert table["lsl"].tolist() == pytest.approx([49.85] * 2, rel=1e-14)
    single = capability("reliability.limits={P.x: {max: 0.2}}")
    assert np.isnan(single["cp"]).all()
    assert np.isnan(single["lsl"]).all()
    assert single["cpk"] == pytest.approx(0.2 / (0.3 * COSINES), rel=1e-9)
    assert single["sigma_level"] == pytest.approx(0.2 / (0.1 * COSINES), rel=1e-9)


def test_a_radial_limit_has_ppm_and_sigma_level() -> None:
    """The error of a point that moves alike in x and y lies beyond r with exp(-r^2/(2 sigma^2)) [Rayleigh]."""
    table = capability(
        "reliability.dimensions={ground.O.x: 0.3, ground.O.y: 0.3}", "reliability.limits={P: {radius: 0.3}}"
    )
    assert table["output"].tolist() == ["P", "P"]
    assert table["usl"].tolist() == [0.3, 0.3]
    assert table["ppm"] == pytest.approx(1e6 * np.exp(-4.5), rel=1e-9)
    assert table["sigma_level"] == pytest.approx(-ndtri(np.exp(-4.5)), rel=1e-9)
    assert np.isnan(table["cp"]).all()
    assert np.isnan(table["cpk"]).all()


@pytest.mark.slow
def test_each_of_several_limits_is_judged_by_itself_by_all_methods() -> None:
    """x and y of a shifted point are independent, and the radius is Rayleigh's."""
    table = capability(
        "reliability.dimensions={ground.O.x: 0.3, ground.O.y: 0.6}", "reliability.poses=[{theta: 60}]",
        "reliability.limits={P.x: 0.15, P.y: {max: 0.3}, P: {radius: 0.4}}",
        "reliability.methods=[analytic, second_order, monte_carlo, auto]",
    )  # fmt: skip
    exact = {"P.x": 2 * ndtr(-1.5), "P.y": ndtr(-1.5)}
    analytic = table["method"] == "analytic"
    exact["P"] = table["ppm"][analytic & (table["output"] == "P")][0] / 1e6
    assert set(table["method"]) == {"analytic", "second_order", "monte_carlo", "auto"}
    for output, low, high, ppm in zip(*(table[name] for name in ("output", "ppm_low", "ppm_high", "ppm")), strict=True):
        assert low * (1 - 1e-6) <= 1e6 * exact[output] <= high * (1 + 1e-6)
        assert low <= ppm <= high
    whole = mechdesign.reliability(study_of(LEVER)).tables["reliability"]
    assert whole["ppm"] == pytest.approx(1e6 * whole["failure"])
    assert whole["sigma_level"] == pytest.approx(-ndtri(whole["failure"]))


@pytest.mark.parametrize(("at_least", "met"), [(0.65, True), (0.7, False)])
def test_a_capability_can_be_required(at_least: float, met: bool) -> None:
    gate = f"requirements=[{{result: reliability.capability.P.x.cpk, at_least: {at_least}}}]"
    study = study_of(LEVER, gate, "reliability.poses=[{theta: 60}]")
    (verdict,) = mechdesign.requirements(study, mechdesign.reliability(study))
    # The nearer limit is 0.1 away, and sigma is 0.05.
    assert (verdict.met, verdict.worst) == (met, pytest.approx(2 / 3))


def test_designs_are_centred_between_limits_of_the_value() -> None:
    study = study_of(
        LEVER, "reliability.poses=[{theta: 60}]",
        "optimize={variables: {lever.length: {from: 99.8, to: 100.1, number: 31}}, "
        "maximize: [reliability.capability.P.x.cpk]}",
    )  # fmt: skip
    best = mechdesign.optimize(study).tables["optimum"]
    assert best["lever.length"] == pytest.approx(99.95)
    assert best["reliability.capability.P.x.cpk"] == pytest.approx(0.125 / 0.15, rel=1e-9)


@pytest.mark.slow
def test_tolerances_are_allocated_to_limits_of_the_value() -> None:
    pose = "reliability.poses=[{theta: 60}]"
    asked = (pose, "reliability.allocate={reliability: 0.99}", "reliability.samples=2000")
    value, error = (
        mechdesign.reliability(study_of(LEVER, *asked, f"reliability.limits.P.x={limit}")).tables["allocation"]
        for limit in ("{lsl: 49.85, usl: 50.1}", "[-0.15, 0.1]")
    )
    assert value["allocated"].tolist() == error["allocated"].tolist()
    outside = mechdesign.reliability(study_of(LEVER, *asked, "reliability.limits.P.x={lsl: 50.01}"))
    assert "the nominal value lies outside its limits" in outside.failed


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ("{lsl: 1, max: 2}", "'max' and 'lsl' exclude each other"),
        ("{radius: 1, usl: 2}", "'usl' and 'radius' exclude each other"),
        ("{lsl: 2, usl: 1}", "the maximum 1 is below the minimum 2"),
        ("[1, 2, 3]", r"expected a number, or the lowest and highest error such as \[-1, 0.8\], not a list of 3"),
        ("{usl: 2 deg}", "is an angle, where a length is expected"),
        ("[-1, 2 deg]", "is an angle, where a length is expected"),
    ],
)
def test_limits_that_make_no_sense_are_refused(limit: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(LEVER, f"reliability.limits={{P.x: {limit}}}")


@pytest.mark.nightly
def test_limits_of_the_value_over_a_workspace() -> None:
    """The index at each node is what the first order says there; P.x alone is limited, far from most of the nodes."""
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, A, 100], fore: [A, P, 80]}
  drives: {t1: {angle: upper}, t2: {angle: fore, from: upper}}
  limits: [{drive: t1, min: 0, max: 90}, {drive: t2, min: 20, max: 160}]
  sketch: {A: [87, 50], P: [130, 120]}
workspace: {point: P, indices: [reliability], integrate: {rule: midpoint, nodes: 9}}
reliability:
  poses: workspace
  dimensions: {upper.length: 3, fore.length: 3}
  limits: {P.x: {usl: 60}}
  methods: [analytic]
""")
    local, table = mechdesign.workspace(study).tables["local"], mechdesign.reliability(study).tables["reliability"]
    chance = dict(zip(zip(local["x"].round(6), local["y"].round(6), strict=True), local["reliability"], strict=True))
    nodes = zip(zip(table["P.x"].round(6), table["P.y"].round(6), strict=True), table["reliability"], strict=True)
    shared = [(chance[node], expected) for node, expected in nodes if node in chance]
    found, expected = np.array(shared).T
    assert len(found) > 100
    # Nodes are found to about 1e-8 of the arm.
    assert found == pytest.approx(expected, abs=1e-6)
    assert (expected > 0.99).any()
    assert (expected < 0.01).any()
