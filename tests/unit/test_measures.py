"""Measures stand wherever a coordinate may."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: fore}}
  sketch: {E: [8, 5], P: [13, 11]}
  measures:
    far: {distance: [O, P]}
    bend: {angle: [upper, fore]}
    high: P.y - 2
    share: high/far
    twice: 2*bend
"""
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {reach: {distance: [O, B]}, mu: {angle: [rod, rocker]}, half: mu/2, drop: B.y - A.y, lower: drop - 1}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("poses", "given"),
    [
        ("sweep: {far: {from: 9, to: 15, step: 3}, P.y: 8}", {"far": [9, 12, 15], "P.y": [8] * 3}),
        ("poses: [{far: 9, t1: 30}, {t1: 20, far: 11}]", {"far": [9, 11], "t1": [30, 20]}),
        ("path: {bend: [30, 50], P.x: [12, 13]}", {"bend": [30, 50], "P.x": [12, 13]}),
        ("path: {high: [7, 8], far: [14, 14]}", {"high": [7, 8], "far": [14, 14]}),
        ("path: {share: [0.5, 0.6], t1: 30}", {"share": [0.5, 0.6], "t1": [30, 30]}),
    ],
)
def test_measures_are_given(poses: str, given: dict[str, list[float]]) -> None:
    outputs = "outputs: [P, far, bend, high, share, twice, t1]"
    table = mechdesign.kinematics(study_of(ARM, f"kinematics={{{poses}, {outputs}}}")).tables["motion"]
    assert table["valid"].all()
    for name, values in given.items():
        assert table[name] == pytest.approx(values, rel=1e-9)
    far = np.hypot(table["P.x"], table["P.y"])
    assert table["far"] == pytest.approx(far)
    assert table["share"] == pytest.approx((table["P.y"] - 2) / far)
    assert table["twice"] == pytest.approx(2 * table["bend"])


def test_rates_of_chained_measures() -> None:
    kinematic = "kinematics={path: {share: [0.5], t1: 30}, rates: {share: 0.02, t1: 3}, outputs: [t2, share]}"
    study = study_of(ARM, kinematic)
    table = mechdesign.kinematics(study).tables["motion"]
    assert table["share_velocity"] == pytest.approx(0.02)
    h = 1e-4
    angles = [float(study.mechanism.solve({"share": 0.5 + 0.02 * t, "t1": 30 + 3 * t})["t2"]) for t in (-h, 0, h)]
    assert table["t2_velocity"] == pytest.approx((angles[2] - angles[0]) / (2 * h), rel=1e-6)
    assert table["t2_acceleration"] == pytest.approx((angles[2] - 2 * angles[1] + angles[0]) / h**2, rel=1e-4)


def test_measures_are_limited_and_required() -> None:
    limits = "mechanism.limits=[{measure: mu, min: 55, max: 180}, {measure: lower, max: 55}]"
    study = study_of(
        FOUR_BAR
        + "requirements: [{result: kinematics.half, at_least: 20}, {result: kinematics.lower_error, at_most: 1}]",
        limits,
        "kinematics.outputs=[mu, half, lower]",
        "mechanism.targets={lower: 20}",
    )
    result = mechdesign.kinematics(study)
    table = result.tables["motion"]
    outside = (table["mu"] < 55) | (table["lower"] > 55)
    assert outside.any()
    assert np.array_equal(table["valid"], ~outside)
    verdicts = mechdesign.requirements(study, result)
    assert verdicts[0].worst == np.min(table["half"])
    assert verdicts[1].worst == pytest.approx(np.max(table["lower"]) - 20)


def test_angles_of_measures_are_continuous() -> None:
    text = FOUR_BAR.replace("measures: {", "measures: {to_crank: {angle: [rocker, crank]}, ")
    table = mechdesign.kinematics(
        study_of(text, "kinematics={sweep: {theta: {from: 0, to: 720, step: 120}}, outputs: [to_crank]}")
    ).tables["motion"]
    assert table["to_crank"][-1] - table["to_crank"][0] == pytest.approx(720)


def test_measures_in_reliability() -> None:
    question = """
reliability:
  dimensions: {rod.length: 0.1, theta: 0.05}
  poses: [{reach: 100}, {mu: 60}]
  outputs: [half, lower]
  limits: {reach: 0.2, half: {max: 0.1}}
  methods: analytic
"""
    result = mechdesign.reliability(study_of(FOUR_BAR + question))
    assert set(result.tables["moments"]["output"]) == {"half", "lower", "reach"}
    assert np.isfinite(result.tables["reliability"]["reliability"]).all()


def test_measures_place_what_is_stiff() -> None:
    study = study_of(
        ARM.replace("t2: {angle: fore}", "t2: {angle: fore, from: upper}")
        + "stiffness: {at: P, actuators: {t1: 1e5, t2: 1e5}, poses: [{twice: 90, t1: 30}, {bend: 45, t1: 30}]}"
    )
    table = mechdesign.stiffness(study).tables["stiffness"]
    assert np.isfinite(table["k_x"]).all()
    assert table["k_x"][0] == pytest.approx(table["k_x"][1], rel=1e-12)


@pytest.mark.slow
def test_a_measure_is_held_in_a_workspace() -> None:
    study = study_of(
        """
mechanism:
  links: {ground: {O: [0, 0]}, a: [O, E, 10], b: [E, F, 8], c: [F, P, 3]}
  drives: [a, b, c]
  sketch: {E: [8, 5], F: [13, 11], P: [16, 11]}
  measures: {reach: {distance: [O, F]}}
workspace: {point: P, at: {reach: 12}, characteristic_length: 5, scan: {rays: 40}}
"""
    )
    indices = mechdesign.workspace(study).tables["indices"]
    # The wrist F on a circle of 12, P 3 from it.
    assert indices["area"] == pytest.approx(np.pi * (15**2 - 9**2), rel=1e-4)


@pytest.mark.nightly
def test_an_expression_is_held_at_a_value_far_from_the_sketchs() -> None:
    """At the point's place in the sketch the held value cannot be had at all."""
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, a: [O, E, 10], b: [E, F, 8], c: [F, P, 3]}
  drives: [a, b, c]
  sketch: {E: [8, 5], F: [13, 11], P: [16, 11]}
  measures: {reach: "hypot(F.x, F.y)"}
workspace: {point: P, at: {reach: 12}, characteristic_length: 5, scan: {about: [0, 0], from: 20, to: 50}}
optimize: {variables: {a.length: {choices: [10]}}, maximize: workspace.area}
""")
    # The wrist F on a circle of 12, P 3 from it.
    area = mechdesign.optimize(study).main["workspace.area"]
    assert area == pytest.approx(np.pi * (15**2 - 9**2) * 30 / 360, rel=1e-4)


PARAMETRIC = """
mechanism:
  parameters: {r: 30, l: 90, k: 2, double: 2*r}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, r], rod: [A, B, l], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {reach: "hypot(B.x, B.y) - r", steep: "k**2*reach + sin(theta)/double", size: r + l}
"""


def test_measures_take_parameters() -> None:
    question = "kinematics={poses: [{theta: 40}, {reach: 80}], outputs: [B, reach, steep, size, theta]}"
    table = mechdesign.kinematics(study_of(PARAMETRIC, question, "mechanism.parameters.r=25")).tables["motion"]
    reach = np.hypot(table["B.x"], table["B.y"]) - 25
    assert table["reach"] == pytest.approx(reach, rel=1e-12)
    assert table["reach"][1] == pytest.approx(80)
    assert table["steep"] == pytest.approx(4 * reach + np.sin(np.radians(table["theta"])) / 50, rel=1e-12)
    assert table["size"] == pytest.approx([115, 115])
    with pytest.raises(
        mechdesign.StudyError, match=r"measures\.reach: there is no coordinate or parameter 'doubel'; did"
    ):
        study_of(PARAMETRIC, "mechanism.measures.reach=B.x - doubel")


@pytest.mark.slow
def test_measures_follow_the_parameters_of_designs() -> None:
    section = (
        "optimize: {variables: {r: {from: 20, to: 40, number: 3}, k: {from: 1, to: 3, number: 2}},"
        " maximize: [kinematics.steep], subject_to: [{result: kinematics.size, at_most: 125}]}"
    )
    question = "kinematics={poses: [{theta: 40}, {theta: 70}], outputs: [reach, steep, size]}"
    designs = mechdesign.optimize(study_of(PARAMETRIC + section, question)).tables["designs"]
    for row in designs:
        changes = [f"mechanism.parameters.{name}={row[name]}" for name in ("r", "k")]
        steep = mechdesign.kinematics(study_of(PARAMETRIC, question, *changes)).tables["motion"]["steep"]
        assert row["kinematics.steep"] == pytest.approx(min(steep), rel=1e-9)
        assert row["feasible"] == (row["r"] + 90 <= 125)


@pytest.mark.slow
def test_a_parameter_that_varies_changes_measures_directly_too() -> None:
    section = """
reliability:
  dimensions: {r: {sigma: 0.1}, k: {sigma: 0.05}}
  poses: [{theta: 40}]
  outputs: [reach, steep, size]
  samples: 100000
"""
    methods = ("analytic", "second_order", "monte_carlo")
    result = mechdesign.reliability(study_of(PARAMETRIC + section, f"reliability.methods=[{', '.join(methods)}]"))
    assert not result.warnings
    contributions = result.tables["contributions"]

    def measured(name: str, r: float, k: float) -> float:
        changes = [f"mechanism.parameters.r={r!r}", f"mechanism.parameters.k={k!r}"]
        return float(study_of(PARAMETRIC, *changes).mechanism.solve({"theta": 40})[name])

    h = 1e-4
    for name in ("reach", "steep", "size"):
        slopes = [
            (measured(name, 30 + h, 2) - measured(name, 30 - h, 2)) / (2 * h),
            (measured(name, 30, 2 + h) - measured(name, 30, 2 - h)) / (2 * h),
        ]
        found = contributions["sensitivity"][contributions.where(output=name)]
        assert found == pytest.approx(slopes, rel=1e-7, abs=1e-9)
    moments = result.tables["moments"]
    first, second, sampled = (moments.take(moments.where(method=method)) for method in methods)
    assert first["sigma"] == pytest.approx(sampled["sigma"], rel=0.01)
    # E[k**2] is 2**2 + 0.05**2.
    reach = measured("reach", 30, 2)
    assert second["mean"][1] - second["nominal"][1] == pytest.approx(0.05**2 * reach, rel=1e-3)
    assert sampled["mean"] == pytest.approx(second["mean"], abs=0.02 * float(second["sigma"][1]))
