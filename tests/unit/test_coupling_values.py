"""Poses at which a coupling has no value: not valid, named, counted, also between the poses; tables that repeat."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.interpolate import CubicSpline

import mechdesign

VALVE = """
units: {angle: %(unit)s}
mechanism:
  links: {ground: {O: [0, 0]}, cam: [O, N, 20], follower: {F: [0, 0]}}
  joints: {valve: {prismatic: [ground, follower], through: O, direction: %(up)s}}
  drives: [cam]
  couplings: {lift: {set: valve, %(law)s}}
  sketch: {N: [20, 0], F: [0, 12]}
kinematics: {sweep: {cam: {from: %(begin)s, to: %(end)s, step: %(step)s}}, outputs: [F.y]}
dynamics: {loads: [{at: F, force: [0, -1]}]}
requirements:
  - {result: kinematics.F.y, at_most: 1000}
  - {result: dynamics.cam_effort, at_most: 1e9}
  - {result: kinematics.F.y.max, at_most: 1000, unassembled: allowed}
"""
TABLE = "of: cam, table: [[-10, 10], [30, 12], [60, 14], [118.25, 9]]"
SLIT = "to: 12 + sqrt(abs(cam - 97.3) - 0.4)"


def valve(law: str, step: float, begin: float = 0, end: float = 180, unit: str = "deg") -> str:
    return VALVE % {**locals(), "up": 90 if unit == "deg" else np.pi / 2}


@pytest.mark.parametrize("step", [1, 7, 45])
@pytest.mark.parametrize(
    ("law", "ends"),
    [
        (TABLE, [118.25]), ("to: 12 + sqrt(100.7 - cam)", [100.7]), ("to: 12 + log(2 - cam/66.25)", [132.5]),
        (SLIT, [96.9, 97.7]),
    ],
)  # fmt: skip
def test_a_motion_ends_where_a_coupling_has_its_last_value(law: str, ends: list[float], step: float) -> None:
    answer = mechdesign.kinematics(mechdesign.load(text=valve(law, step)))
    motion, limits = answer.tables["motion"], answer.tables["limits"]
    assert limits["cam"] == pytest.approx(ends, abs=1e-9)
    assert set(limits["joint"]) == {"lift"}
    assert set(limits["kind"]) == {"coupling without a value"}
    lost = (motion["cam"] > ends[0]) & (motion["cam"] < (ends[1] if ends[1:] else np.inf))
    assert (motion["valid"] == ~lost).all()
    assert np.isfinite(motion["F.y"][~lost]).all()
    assert np.isnan(motion["F.y"][lost]).all()
    if lost.any():
        assert f"{lost.sum()} coupling 'lift' has no value" in str(answer.warnings[0])
    assert [verdict.met for verdict in answer.verdicts] == [False, True]


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (TABLE, "3 coupling 'lift' has no value"), ("to: 12 + 1/(cam - 90)", "1 coupling 'lift' has no value"),
        pytest.param(
            "to: 12 + sqrt(90 - cam)", "the slope of coupling 'lift' is infinite at 1 of 7", marks=pytest.mark.nightly
        ),
    ],
)  # fmt: skip
def test_forces_without_a_value_are_told_as_the_coupling_s(law: str, words: str) -> None:
    answer = mechdesign.dynamics(mechdesign.load(text=valve(law, 30)))
    warnings = " ".join(str(warning) for warning in answer.warnings)
    assert words in warnings
    assert "expression of the loads" not in warnings
    assert [verdict.met for verdict in answer.verdicts] == [False]


def test_a_pose_that_a_coupling_does_not_give_is_an_error_with_its_name() -> None:
    study = study_of(valve(TABLE, 30))
    with pytest.raises(mechdesign.AssemblyError, match="'lift' has no value: 'cam' is outside of its table"):
        study.mechanism.solve({"cam": 130})
    with pytest.raises(mechdesign.AssemblyError, match="no pose is valid; cam = 130 deg: coupling 'lift' has no value"):
        mechdesign.kinematics(study_of(valve(TABLE, 30, 130, 190)))
    forward = "{forward: {start: {cam: 130}, duration: 1}}"
    with pytest.raises(mechdesign.AssemblyError, match=r"the start of dynamics\.forward: coupling 'lift' has"):
        mechdesign.dynamics(study_of(valve(TABLE, 30), f"dynamics={forward}"))


def test_the_first_coupling_without_a_value_is_named() -> None:
    study = mechdesign.load(
        text="""
mechanism:
  links: {ground: {O: [0, 0], A: [50, 0], B: [99, 0]}, one: [O, P, 20], two: [A, Q, 20], three: [B, R, 20]}
  drives: [one]
  couplings:
    last: {set: three, to: sqrt(two.angle)}
    middle: {set: two, to: sqrt(55 - one.angle)}
  sketch: {P: [20, 0], Q: [70, 0], R: [119, 0]}
kinematics: {sweep: {one: {from: 0, to: 100, step: 10}}, outputs: [R]}
"""
    )
    answer = mechdesign.kinematics(study)
    assert "(5 coupling 'middle' has no value); the first: one = 60 deg" in str(answer.warnings[0])
    assert answer.tables["motion"]["valid"].sum() == 6


@pytest.mark.slow
def test_designs_whose_coupling_loses_its_value_are_not_feasible() -> None:
    text = valve("to: 12 + sqrt(reach - cam)", 30).replace("links:", "parameters: {reach: 200}\n  links:", 1)
    optimize = "optimize: {variables: {reach: {from: 100, to: 220, step: 40}}, maximize: kinematics.F.y.max}"
    answer = mechdesign.optimize(mechdesign.load(text=text + optimize))
    designs = answer.tables["designs"]
    assert designs["feasible"].tolist() == [False, False, True, True]
    assert set(designs["reason"][:2]) == {"a coupling has no value at a pose"}


@pytest.mark.parametrize(
    ("last", "repeats"), [("6.2831853", True), ("6.283", True), ("6.2831", True), ("6.28", True), ("6.2", False)]
)
def test_a_table_in_radians_that_ends_at_a_turn_as_it_is_typed_repeats(last: str, repeats: bool) -> None:
    places = [*np.arange(7.0), 2 * np.pi]
    lifts = [12 + 3 * np.sin(x) + np.cos(2 * x) for x in places]
    rows = ", ".join(f"[{x:g}, {y!r}]" for x, y in zip(places[:-1], map(float, lifts), strict=False))
    study = study_of(valve(f"of: cam, table: [{rows}, [{last}, {float(lifts[0])!r}]]", 0.1, unit="rad", end=1))
    drives = np.array([0.3, 6.1, 12.7, -40.0, 2000.3])
    pose = study.mechanism.solve({"cam": drives})
    if not repeats:
        assert pose.valid.tolist() == [True, True, False, False, False]
        return
    spline = CubicSpline(places, [*lifts[:-1], lifts[0]], bc_type="periodic")
    assert pose["F.y"] == pytest.approx(spline(drives % (2 * np.pi)), abs=1e-9)


def test_a_table_holds_to_its_last_row() -> None:
    for end in (0.3, 77.7, 118.25, 333.3):
        law = f"of: cam, table: [[-{end}, 10], [0, 12], [{end / 2}, 14], [{end}, 9]]"
        motion = mechdesign.kinematics(study_of(valve(law, end, -end, end))).tables["motion"]
        assert motion["valid"].all()
        assert motion["F.y"] == pytest.approx([10, 12, 9])
