"""Results of many designs by `mechdesign.evaluate`: as each study says alone, as `sweep` and `optimize` say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import mechdesign
from mechdesign.ground.errors import StudyError

FOUR_BAR = """
mechanism:
  parameters: {a: 30, b: 90, c: 60, k: 1}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, b], rocker: [D, B, c]}
  drives: [crank]
  springs: {s: {between: [O, B], stiffness: k, free_length: 50}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle, B], rates: {crank: 60 rpm}}
dynamics: {}
"""
FIVE_BAR = """
mechanism:
  parameters: {l: 100}
  links:
    ground: {O: [0, 0], E: [120, 0]}
    left: [O, A, l]
    right: [E, B, 100]
    arm: [A, P, 160]
    other: [B, P, 160]
  drives: [left, right]
  sketch: {A: [-40, 90], P: [60, 220], B: [160, 90]}
stiffness:
  at: P
  actuators: {left: 1e6 N*mm/rad, right: 1e6 N*mm/rad}
  poses: [{P.x: 60, P.y: 190}, {P.x: 70, P.y: 200}]
reliability:
  dimensions: {arm.length: 0.1, other.length: 0.2}
  poses: [{P.x: 60, P.y: 190}]
  outputs: [P]
  methods: analytic
"""
ARM = """
mechanism:
  parameters: {l: 100}
  links: {ground: {O: [0, 0]}, upper: [O, E, 200], fore: [E, P, l]}
  drives: [upper, fore]
  sketch: {E: [200, 0], P: [200, 100]}
workspace: {point: P, scan: {about: [0, 0], rays: 12}, integrate: {rule: midpoint, nodes: 9}}
"""
A, B = "mechanism.parameters.a", "mechanism.parameters.b"
ONE = {A: [1]}
SWING = "kinematics.extremes.rocker.angle.range"
Designs = Mapping[str, Sequence[Any]]


def one_by_one(text: str, values: Designs, result: str) -> list[float]:
    """A result of each design as its own study gives it."""
    command, table, *row, column = result.split(".")
    found = []
    for design in zip(*values.values(), strict=True):
        study = mechdesign.load(text=text, overrides=dict(zip(values, design, strict=True)))
        rows = getattr(mechdesign, command)(study).tables[table]
        (number,) = rows[column][rows["output"] == ".".join(row)] if row else rows[column]
        found.append(float(number))
    return found


def swept(text: str, values: Designs, result: str, tmp_path: Any) -> list[float]:
    """The same of a sweep over its cases."""
    lines = [",".join(values), *(",".join(map(str, design)) for design in zip(*values.values(), strict=True))]
    (tmp_path / "cases.csv").write_text("\n".join(lines))
    (tmp_path / "study.yaml").write_text(text)
    matrix = {"cases": "cases.csv", "results": [result]}
    table = mechdesign.sweep(mechdesign.load(tmp_path / "study.yaml", {"matrix": matrix})).main
    return [float(number) for number in table[result]]


def optimized(text: str, values: Designs, result: str) -> dict[tuple[Any, ...], float]:
    """The same of an optimisation's designs, by their values."""
    variables = {name: {"choices": sorted({*column})} for name, column in values.items()}
    study = mechdesign.load(
        text=text, overrides={"optimize": {"method": "grid", "variables": variables, "minimize": [result]}}
    )
    designs = mechdesign.optimize(study).tables["designs"]
    columns = (designs[name].tolist() for name in designs.names[: len(values)])
    return dict(zip(zip(*columns, strict=True), designs[result], strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "values", "result"),
    [
        (FOUR_BAR, {"mechanism.parameters.a": [25, 30.5], "mechanism.links.ground.D.0": [100, 104.0]}, SWING),
        (FOUR_BAR, {"mechanism.springs.s.stiffness": [1, 2.5]}, "dynamics.extremes.crank_effort.max"),
        (FIVE_BAR, {"mechanism.links.right": [["E", "B", 100], ["E", "B", 105]]}, "reliability.moments.P.x.sigma"),
        (ARM, {"mechanism.parameters.l": [100, 104]}, "workspace.indices.GII"),
        (FIVE_BAR, {"reliability.dimensions.arm.length": [0.1, 0.3]}, "reliability.moments.P.y.sigma"),
    ],
)
def test_designs_at_once_are_what_each_study_says_alone(text: str, values: Designs, result: str) -> None:
    found = mechdesign.evaluate(mechdesign.load(text=text), values, [result])
    assert found["valid"].all()
    np.testing.assert_allclose(found[result], one_by_one(text, values, result), rtol=1e-9)
    assert np.ptp(found[result]) > 1e-6 * np.abs(found[result]).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "values", "result"),
    [
        (FOUR_BAR, {"mechanism.parameters.a": [25, 30], "mechanism.links.ground.D.0": [100, 104]}, SWING),
        (FOUR_BAR, {"mechanism.springs.s.stiffness": [1.0, 2.5]}, "dynamics.crank_effort.peak"),
        (FOUR_BAR, {"mechanism.parameters.b": [90, 95]}, "kinematics.B.x_velocity.rms"),
        (FIVE_BAR, {"mechanism.links.left.2": [100, 110]}, "stiffness.k_min.min"),
        (ARM, {"mechanism.parameters.l": [100, 104]}, "workspace.indices.GII"),
        (ARM, {"mechanism.parameters.l": [100, 104]}, "GRI"),
    ],
)  # fmt: skip
def test_evaluate_sweep_and_optimize_say_the_same(text: str, values: Designs, result: str, tmp_path: Any) -> None:
    found = mechdesign.evaluate(mechdesign.load(text=text), values, [result])[result]
    np.testing.assert_allclose(swept(text, values, result, tmp_path), found, rtol=1e-9)
    names = {name.removeprefix("mechanism.parameters."): column for name, column in values.items()}
    designs = optimized(text, names, result)
    of_optimize = [designs[design] for design in zip(*names.values(), strict=True)]
    np.testing.assert_allclose(of_optimize, found, rtol=1e-9)


@pytest.mark.slow
def test_words_are_values_too() -> None:
    """Of samples, of which each method has its own; and the shape of a link that is given whole."""
    study = mechdesign.load(text=FIVE_BAR, overrides={"reliability.samples": 4000})
    values: dict[str, list[Any]] = {
        "reliability.methods": ["analytic", "monte_carlo"] * 2,
        "mechanism.parameters.l": [100, 100, 110, 110],
    }
    sigma = mechdesign.evaluate(study, values, ["reliability.moments.P.x.sigma"])["reliability.moments.P.x.sigma"]
    assert len({*sigma}) == 4
    assert sigma[1::2] == pytest.approx(sigma[::2], rel=0.05)


def test_the_swing_of_a_rocker_is_that_between_its_dead_centres() -> None:
    """By the law of cosines; designs of any number, whole numbers among them."""
    a, c = np.linspace(20, 32, 13), 60 + 5 * np.arange(13)
    table = mechdesign.evaluate(
        mechdesign.load(text=FOUR_BAR), {"mechanism.parameters.a": a, "mechanism.parameters.c": c}, [SWING]
    )
    ends = [np.degrees(np.arccos((100**2 + c**2 - (90 + side * a) ** 2) / (200 * c))) for side in (1, -1)]
    np.testing.assert_allclose(table[SWING], ends[0] - ends[1], rtol=1e-9)
    assert (table.column(SWING).unit, table.names) == ("deg", (SWING, "valid", "reason"))
    assert table["valid"].all()


def test_a_result_is_named_with_the_rows_that_count() -> None:
    study = mechdesign.load(text=FOUR_BAR)
    name: Any = {"result": "kinematics.extremes.range", "where": {"output": "rocker.angle"}}
    table = mechdesign.evaluate(study, {"mechanism.parameters.a": [25.0]}, [name, SWING])
    assert table["kinematics.extremes.range (output rocker.angle)"][0] == table[SWING][0]


def test_designs_that_cannot_be_built_have_their_reasons() -> None:
    study = mechdesign.load(text=FOUR_BAR)
    values = {
        "mechanism.parameters.a": [30, -1, np.nan, 60, 30],
        "mechanism.links.ground.D.0": [100, 100, 100, 100, np.inf],
    }
    table = mechdesign.evaluate(study, values, [SWING])
    assert table["valid"].tolist() == [True, False, False, False, False]
    assert table["reason"].tolist() == [
        "", "crank.length is not positive", "a has no finite value", "a pose cannot be assembled",
        "mechanism.links.ground.D.0 has no finite value",
    ]  # fmt: skip
    words = mechdesign.evaluate(study, {A: ["30 mm", "long", True]}, [SWING])
    assert words["valid"].tolist() == [True, False, False]
    assert "mechanism.parameters.a: unknown name 'long'" in words["reason"][1]


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("mechanism.springs.back.stiffness", "back.stiffness is negative"),
        ("mechanism.springs.back.free_length", "back.free_length is negative"),
        ("mechanism.links.arm.mass", "arm.mass is negative"),
        ("mechanism.friction.O.radius", "friction.O.radius is negative"),
    ],
)
def test_a_design_has_no_number_that_a_study_may_not_have(entry: str, reason: str) -> None:
    study = mechdesign.load(
        text="""
mechanism:
  links:
    ground: {O: [0, 0], S: [0, 100]}
    arm: {points: {O: [0, 0], P: [100, 0]}, mass: 2 kg, center: [30, 5]}
  drives: [arm]
  springs: {back: {between: [S, P], stiffness: 2, free_length: 60}}
  friction: {O: {coefficient: 0.1, radius: 5}}
dynamics: {gravity: [0, -9810], poses: [{arm: 10}, {arm: 60}]}
"""
    )
    table = mechdesign.evaluate(study, {entry: [-1, 0, 3]}, ["dynamics.arm_effort.max"])
    assert table["valid"].tolist() == [False, True, True]
    assert table["reason"].tolist() == [reason, "", ""]


def test_no_design_is_an_empty_table() -> None:
    table = mechdesign.evaluate(mechdesign.load(text=FOUR_BAR), {"mechanism.parameters.a": []}, [SWING])
    assert (len(table), table.names[0]) == (0, SWING)


@pytest.mark.parametrize(
    ("values", "results", "message"),
    [
        ({"mechanism.parameters.aa": [1]}, [SWING], r"^mechanism\.parameters\.aa: .* did you mean 'a'"),
        ({"a": [1]}, [SWING], r"^a: .* did you mean 'mechanism\.parameters\.a'"),
        ({A: 1}, [SWING], r"^mechanism\.parameters\.a: .* for each design"),
        ({A: [[1]]}, [SWING], r"^mechanism\.parameters\.a: .* not an array of shape \(1, 1\)"),
        ({A: [object()]}, [SWING], r"^mechanism\.parameters\.a: .* type object"),
        ({A: [1], B: [1, 2]}, [SWING], r"^mechanism\.parameters\.b: has 2"),
        ({}, [SWING], "'values' names entries"),
        (ONE, [], "'results' lists names"),
        (ONE, SWING, "'results' lists names"),
        (ONE, ["kinematics.rocker.angle"], r"^kinematics\.rocker\.angle: .* has 73 rows; ask"),
        (ONE, ["kinematics.rockr.angle.max"], r"^kinematics\.rockr\.angle\.max: .*no column"),
        (ONE, ["kinematic.B.x.max"], r"^kinematic\.B\.x\.max: .* mean 'kinematics'"),
        (ONE, ["stiffness.k_min"], r"^stiffness\.k_min: .* needs the stiffness section"),
        (ONE, [SWING, SWING], r"is listed twice"),
        ({"zz": [1]}, ["kinematics.zz.max"], r"(?s)^zz: .*\nkinematics\.zz\.max: "),
    ],
)  # fmt: skip
def test_a_wrong_entry_or_result_is_told_by_its_name(values: Any, results: Any, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        mechdesign.evaluate(mechdesign.load(text=FOUR_BAR), values, results)


def test_an_optimiser_of_scipy_finds_the_rocker_of_a_swing() -> None:
    """A swing of 60 deg: the law of cosines solved for the crank."""
    study = mechdesign.load(text=FOUR_BAR)

    def miss(a: float) -> float:
        return float((mechdesign.evaluate(study, {"mechanism.parameters.a": [a]}, [SWING])[SWING][0] - 50) ** 2)

    a = minimize_scalar(miss, bounds=(20, 30), method="bounded", options={"xatol": 1e-6}).x
    ends = [math.acos((100**2 + 60**2 - (90 + side * a) ** 2) / (200 * 60)) for side in (1, -1)]
    assert math.degrees(ends[0] - ends[1]) == pytest.approx(50, abs=1e-4)


@pytest.mark.slow
def test_means_are_added_for_each_design() -> None:
    """Means along the motion, which are followed only once they are asked for; a sum as the sum of its parts."""
    study = mechdesign.load(text=FOUR_BAR)
    parts = ["kinematics.B.x.mean", "kinematics.B.y.mean"]
    total = " + ".join(parts)
    table = mechdesign.evaluate(study, {"mechanism.parameters.a": [25.0, 30.0]}, [*parts, total])
    np.testing.assert_allclose(table[total], table[parts[0]] + table[parts[1]], rtol=1e-12)
    changes = {"optimize": {"method": "grid", "variables": {"a": {"choices": [25, 30]}}, "minimize": [total]}}
    designs = mechdesign.optimize(mechdesign.load(text=FOUR_BAR, overrides=changes)).tables["designs"]
    np.testing.assert_allclose(designs[total], table[total], rtol=1e-9)
