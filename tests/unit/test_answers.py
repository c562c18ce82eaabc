"""Kinematics of many designs at once: every table, count and word as of each design alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from helpers.designs import each_of
from helpers.studies import study_of

from mechdesign.family.stacked import at_poses
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Result
from mechdesign.ground.statistics import Request
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.poses import study_poses
from mechdesign.study import Study
from mechdesign.study.designs import Designs, variant

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {C: [1.75, 1.5]}}
    rocker: [D, B, 3]
  drives: [crank]
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
  measures: {mu: {angle: [rod, rocker]}, square: (mu / 90)**2 + C.x}
  targets: {C: [[0.5, 2], [2, 1.5], [3, 2.2]]}
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 20}}
  rates: {crank: 2 rad/s}
  outputs: [C, rocker.angle, mu]
  loads: [{at: C, force: [3, -20]}]
  mechanical_advantage: {rocker.angle: crank}
  instant_centres: [[rod, ground]]
"""
# Without rates: the acceleration of an expression is not known to enough digits to be followed.
STILL = FOUR_BAR.replace("  rates: {crank: 2 rad/s}\n", "").replace("mu]", "mu, square]")
LIMITED = FOUR_BAR.replace("  measures:", "  limits: [{angle: [crank, rod], min: -140, max: 60}]\n  measures:")
SLIDER = """
mechanism:
  links: {ground: {O: [0, 0], G: [0, 0.2]}, crank: [O, A, 1], rod: [A, B, 3], piston: {B: [0, 0]}}
  joints: {cylinder: {prismatic: [ground, piston], through: G}}
  drives: [crank]
  sketch: {A: [0.9, 0.3], B: [3.9, 0.2]}
"""
LISTED = FOUR_BAR.replace("sweep: {crank: {from: 0, to: 360, step: 20}}", "poses: [{crank: 30}, {rocker.angle: 80}]")
FIVE_BAR = """
mechanism:
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    lower_1: [B1, D1, 1]
    upper_1: [D1, C, 2.15]
    lower_2: [B2, D2, 1]
    upper_2: [D2, C, 2.15]
  drives: {phi1: {angle: lower_1}, phi2: {angle: lower_2}}
  sketch: {D1: [1.7, 0.7], D2: [-1.7, 0.7], C: [0, 2.05]}
kinematics:
  path: {C: {circle: {center: [0, 2.2], radius: 0.6}, points: 24}}
  speed: 1
  outputs: [C]
"""
GRID = (
    FIVE_BAR.partition("kinematics:")[0]
    + """
kinematics:
  sweep: {phi1: {from: 20, to: 70, number: 4}, phi2: {from: 100, to: 150, number: 5}}
  outputs: [C, upper_1.angle]
"""
)
PLATFORM = """
mechanism:
  links:
    ground: {A1: [-0.6, 0], A2: [0.6, 0], A3: [0.3, -0.2]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.2, 0], B2: [0.2, 0], B3: [0.25, 0.15]}
  drives: [leg_1, leg_2, leg_3]
  sketch: {P: [0, 1], B1: [-0.2, 1], B2: [0.2, 1], B3: [0.25, 1.15]}
kinematics:
  path: {leg_1: [1.08, 1.2], leg_2: [1.08, 1.1], leg_3: [1.35, 1.4]}
  outputs: [P, platform.angle]
"""
FOLLOWING = (
    FOUR_BAR.replace("mechanism:\n", "mechanism:\n  parameters: {a: 1, f: 3, begin: 0}\n", 1)
    .replace("crank: [O, A, 1]", "crank: [O, A, a]")
    .replace("[[0.5, 2], [2, 1.5], [3, 2.2]]", "[[a / 2, 2], [2, 1.5], [3, 2.2]]")
    .replace("{from: 0, to: 360, step: 20}", "{from: begin, to: begin + 350, number: 20}")
    .replace("crank: 2 rad/s", "crank: 100 * f")
    .replace("force: [3, -20]", "force: [f, -20]")
)
CIRCLES = (
    FIVE_BAR.replace("mechanism:\n", "mechanism:\n  parameters: {y: 2.2, v: 1}\n", 1)
    .replace("center: [0, 2.2]", "center: [0, y]")
    .replace("speed: 1", "speed: v")
)
STUDIES: Mapping[str, tuple[str, Mapping[str, tuple[float, float]]]] = {
    "four-bar": (FOUR_BAR, {"crank.length": (0.8, 1.2), "rod.length": (3, 4)}),
    "expression": (STILL, {"crank.length": (0.8, 1.2), "rod.length": (3, 4)}),
    "some rockers": (FOUR_BAR, {"crank.length": (0.8, 3), "ground.D.x": (3.5, 4.5)}),
    "none at all": (FOUR_BAR, {"rocker.length": (0.2, 3), "rod.length": (0.5, 4)}),
    "limits": (LIMITED, {"crank.length": (0.8, 1.2), "rod.length": (3, 4)}),
    "slider-crank": (SLIDER, {"crank.length": (0.8, 1.2), "rod.length": (0.9, 2)}),
    "listed poses": (LISTED, {"crank.length": (0.8, 1.2), "rocker.length": (2.2, 3.5)}),
    "path": (FIVE_BAR, {"lower_1.length": (0.95, 1.05), "upper_2.length": (2.1, 2.3)}),
    "numbers that follow": (FOLLOWING, {"a": (0.8, 1.2), "f": (2, 4), "begin": (-30, 30)}),
    "paths that follow": (CIRCLES, {"y": (2.1, 2.3), "v": (1, 2), "lower_1.length": (0.9, 1.1)}),
    "grid": (GRID, {"lower_1.length": (0.9, 1.1), "upper_2.length": (1.7, 2.2)}),
    "Newton's method": (PLATFORM, {"platform.B2.x": (0.19, 0.21), "ground.A2.x": (0.59, 0.61)}),
}


def together(study: Study, designs: Mapping[str, Floats]) -> list[Result | AssemblyError]:
    return each_of(at_poses(study, "kinematics", study_poses(study, "kinematics", Designs(study, designs).numbers)))


def alone(study: Study, designs: Mapping[str, Floats], k: int) -> Result | AssemblyError:
    try:
        return kinematics(variant(study, {name: float(values[k]) for name, values in designs.items()}))
    except AssemblyError as error:
        return error


def assert_same(one: Column, other: Column) -> None:
    assert (one.name, one.unit, one.meaning) == (other.name, other.unit, other.meaning)
    if one.values.dtype.kind != "f":
        assert one.values.tolist() == other.values.tolist(), one.name
        return
    finite = np.where(np.isfinite(other.values), np.abs(other.values), 0.0)
    # The place of an extreme is known to the root of rounding.
    digits = 1e-8 if one.name == "at" or one.name.endswith("_at") else 1e-12
    np.testing.assert_allclose(one.values, other.values, rtol=0, atol=digits * max(1.0, finite.max(initial=0.0)))


@pytest.mark.nightly
@pytest.mark.parametrize("name", STUDIES)
def test_designs_together_are_those_alone(name: str) -> None:
    text, ranges = STUDIES[name]
    study, random = study_of(text), np.random.default_rng(5)
    designs = {place: random.uniform(*ends, 7) for place, ends in ranges.items()}
    for k, found in enumerate(together(study, designs)):
        expected = alone(study, designs, k)
        if isinstance(expected, AssemblyError):
            assert str(found) == str(expected)
            continue
        assert isinstance(found, Result)
        assert (found.counts, found.failed) == (expected.counts, expected.failed)
        # Of a study alone the limit that its poses are beyond is told, too.
        assert [(one.kind, one.row, one.pose) for one in found.warnings] == [
            (one.kind, one.row, one.pose) for one in expected.warnings
        ]
        assert all(map(str.startswith, map(str, expected.warnings), map(str, found.warnings)))
        assert [*found.tables] == [*expected.tables]
        for table, own in zip(found.tables.values(), expected.tables.values(), strict=True):
            assert table.meaning == own.meaning
            assert len(table) == len(own)
            assert table.scope is not None
            assert own.scope is not None
            assert (table.scope.poses_only, table.scope.missing) == (own.scope.poses_only, own.scope.missing)
            for pair in zip(table.columns, own.columns, strict=True):
                assert_same(*pair)


@pytest.mark.slow
def test_the_worst_value_between_the_poses_is_that_of_the_design() -> None:
    study = study_of(FOUR_BAR)
    designs = {"crank.length": np.array([0.8, 1.0, 1.2])}
    for k, found in enumerate(together(study, designs)):
        expected = alone(study, designs, k)
        assert isinstance(found, Result)
        assert isinstance(expected, Result)
        for asked in (("mu", 1, False), ("rocker.angle_velocity", -1, False), ("C.x", -1, True)):
            one, other = (worst(result, *asked) for result in (found, expected))
            assert one[0] == pytest.approx(other[0], rel=1e-12)
            assert one[1] == other[1]


def worst(result: Result, name: str, sign: int, absolute: bool) -> tuple[float, str]:
    scope = result.tables["motion"].scope
    assert scope is not None
    assert scope.follow is not None
    (course,) = scope.follow([Request(name)])
    assert course is not None
    (value,), (place,) = course.worst(sign, absolute=absolute)
    return float(value), course.shown(float(place))


@pytest.mark.slow
def test_the_designs_above_are_of_several_kinds() -> None:
    random, found = np.random.default_rng(5), {}
    for name in ("none at all", "some rockers", "listed poses"):
        text, ranges = STUDIES[name]
        study = study_of(text)
        found[name] = together(study, {place: random.uniform(*ends, 7) for place, ends in ranges.items()})
    assert {isinstance(each, Result) for each in found["none at all"]} == {True, False}
    rockers = [each for each in found["some rockers"] if isinstance(each, Result)]
    assert {len(each.tables["limits"]) > 0 for each in rockers} == {True, False}
    assert len({each.tables["loops"]["class"][0] for each in rockers}) > 1
    assert any(each.failed for each in found["listed poses"] if isinstance(each, Result))
