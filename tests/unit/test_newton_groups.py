"""Groups without a closed form: small linear systems, continuation, the exact end of a motion, given expressions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.optimize import brentq

import mechdesign
from mechdesign.mechanism import Mechanism, Reason
from mechdesign.mechanism.derivatives import regularity
from mechdesign.mechanism.margins import turning_point
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.solve import solve_linear

CONFIGS = Path(__file__).parents[2] / "configs"
SIX_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], G: [5, 4]}
    crank: [O, B, 1]
    plate: {from: B, to: C, length: 3.5, points: {E: [1.5, 1.5]}}
    rocker: [D, C, 3]
    link: [E, F, 3]
    last: [G, F, 2]
  drives: [DRIVE]
  sketch: {B: [0.5, 0.87], C: [3.3, 2.9], E: [0.8, 3], F: [3.6, 5]}
"""


def six_bar(drive: str) -> Mechanism:
    """A Stephenson six-bar; driven by `last`, its floating side, it has no dyad."""
    pose = study_of(SIX_BAR.replace("DRIVE", "crank")).mechanism.solve({"crank": 90})
    sketch = [f"mechanism.sketch.{name}=[{float(pose[name + '.x'])}, {float(pose[name + '.y'])}]" for name in "BCEF"]
    return study_of(SIX_BAR.replace("DRIVE", drive), *sketch).mechanism


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 6])
def test_small_systems_are_solved_for_every_pose(size: int) -> None:
    random = np.random.default_rng(size)
    matrix, sides = random.normal(size=(size, size, 50)), random.normal(size=(size, 50))
    unknowns, determinant = solve_linear([list(row) for row in matrix], list(sides))
    stacked = np.moveaxis(matrix, -1, 0)
    assert determinant == pytest.approx(np.linalg.det(stacked), rel=1e-10)
    expected = np.linalg.solve(stacked, sides.T[..., None])[..., 0]
    assert np.stack(unknowns, axis=-1) == pytest.approx(expected, rel=1e-8)


def test_plain_numbers_in_a_system_are_taken_as_they_are() -> None:
    a = np.array([2.0, 4.0])
    unknowns, determinant = solve_linear([[a, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]], [3.0, 5.0, 2.0])
    assert determinant == pytest.approx(a - 1)
    assert unknowns[0] == pytest.approx(1 / (a - 1))
    assert np.broadcast_to(unknowns[1], 2) == pytest.approx([5, 5])


def test_a_six_bar_driven_through_its_floating_side_retraces_its_motion_by_the_crank() -> None:
    by_crank, by_last = six_bar("crank"), six_bar("last")
    assert not by_crank.forward.iterative
    assert by_last.forward.iterative
    forward = by_crank.solve({"crank": np.linspace(70, 92, 200)})
    assert forward.valid.all()
    back = by_last.solve({"last": forward["last.angle"]})
    assert back.valid.all()
    for name in ("B.x", "C.y", "E.x", "F.y"):
        assert back[name] == pytest.approx(forward[name], abs=1e-9)


def last_and_slope(mechanism: Mechanism, crank: float) -> tuple[float, float]:
    configuration = mechanism.forward.solve([np.array(crank)])
    last = mechanism.coordinate("last.angle")
    rates = mechanism.linearize(configuration).velocity([1.0])
    return float(configuration.value(last)), float(first(configuration, last, rates))


@pytest.mark.slow
def test_the_end_of_a_motion_is_found_to_the_last_digits() -> None:
    # Driven through its floating side the six-bar turns back where, driven by its crank, that side stands still.
    by_crank, by_last = six_bar("crank"), six_bar("last")
    grid = np.radians(np.arange(90.0, 20.0, -1.0))
    slopes = [last_and_slope(by_crank, angle)[1] for angle in grid]
    change = next(k for k in range(len(grid) - 1) if slopes[k] * slopes[k + 1] < 0)
    crank = brentq(lambda x: last_and_slope(by_crank, x)[1], grid[change], grid[change + 1], xtol=1e-14)
    expected = last_and_slope(by_crank, crank)[0]
    near = by_crank.forward.solve([np.array(crank + 0.03)])
    given = [float(near.value(by_last.coordinate("last")))]
    pose = by_last.forward.solve([np.array(given[0])])
    assert pose.valid
    found = turning_point(by_last.forward, lambda value: [value], given[0], 0.1, pose)
    assert found is not None
    value, there, index = found
    assert value == pytest.approx(expected, abs=1e-11)
    assert by_last.forward.structure.groups[index].form == "newton"
    assert float(there.value(by_last.coordinate("crank.angle"))) == pytest.approx(crank, abs=1e-6)
    assert float(regularity(by_last.linearize(there))) < 1e-6
    beyond = value + (value - given[0])
    assert int(by_last.forward.solve([np.array(beyond)]).reason) in (Reason.NOT_CLOSED, Reason.OTHER_ASSEMBLY)


def test_no_end_is_found_where_there_is_none() -> None:
    mechanism = mechdesign.load(CONFIGS / "planar_3rpr.yaml").mechanism
    sketch = mechanism.sketch_configuration
    given = [float(sketch.value(mechanism.coordinate(name))) for name in mechanism.drives]
    assert turning_point(mechanism.forward, lambda value: [value, *given[1:]], given[0], 0.1, sketch) is None


@pytest.mark.slow
def test_a_pose_does_not_depend_on_its_batch_or_order() -> None:
    mechanism = mechdesign.load(CONFIGS / "planar_3rpr.yaml").mechanism
    random = np.random.default_rng(1)
    given = [
        float(mechanism.sketch_configuration.value(mechanism.coordinate(name))) + random.uniform(-0.5, 0.5, 400)
        for name in mechanism.drives
    ]
    whole = mechanism.forward.solve(given)
    assert 0 < whole.valid.sum() < 400
    for some in (slice(5, 6), slice(100, 130), slice(None, None, -1)):
        part = mechanism.forward.solve([g[some] for g in given])
        assert (part.reason == whole.reason[some]).all()
        assert np.array_equal(part.point("P"), whole.point("P")[some], equal_nan=True)


@pytest.mark.slow
def test_an_expression_can_be_given() -> None:
    text = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {P: [1, 1]}}
    rocker: [D, B, 3]
  drives: {theta: {angle: crank}}
  measures: {sum: "crank.angle + 2*rocker.angle", lead: "P.x - A.x + 2*hypot(B.x, B.y)", double: "2*crank.angle"}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
"""
    mechanism = study_of(text).mechanism
    forward = mechanism.solve({"theta": np.linspace(60, 80, 9)})
    for measure in ("sum", "lead", "double"):
        back = mechanism.solve({measure: forward[measure]})
        assert back.valid.all()
        assert back["theta"] == pytest.approx(np.linspace(60, 80, 9), abs=1e-9)
    # Nothing meets a value that is out of reach, and nan is no value.
    assert not mechanism.solve({"sum": np.array([5000.0, np.nan])}).valid.any()


def test_given_coordinates_of_different_points_place_a_part_that_no_point_holds() -> None:
    text = """
mechanism:
  links:
    ground: {G: [0, 0], H: [4, 0], K: [2, 4]}
    plate: {A: [0, 0], B: [1, 0.1], C: [0.4, 0.9]}
    one: {from: G, to: A, telescopic: true}
    two: {from: H, to: B, telescopic: true}
    three: {from: K, to: C, telescopic: true}
  drives: [one, two, three]
  sketch: {A: [1.5, 1.2], B: [2.5, 1.3], C: [1.9, 2.1]}
"""
    mechanism = study_of(text).mechanism
    lengths = [float(mechanism.sketch_configuration.value(mechanism.coordinate(name))) for name in mechanism.drives]
    forward = mechanism.solve(
        {name: value + np.linspace(0, 0.3, 7) for name, value in zip(mechanism.drives, lengths, strict=True)}
    )
    assert forward.valid.all()
    for given in (("A.y", "B.x", "C.x"), ("A.y", "B.x", "one"), ("A.x", "B.y", "platform.angle")):
        names = [name.replace("platform", "plate") for name in given]
        back = mechanism.solve({name: forward[name] for name in names})
        for drive in mechanism.drives:
            assert back[drive] == pytest.approx(forward[drive], rel=1e-12)


def test_expressions_of_points_place_them_before_any_link_does() -> None:
    text = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0.7, 1]}
    leg: {from: O, to: E, telescopic: true}
    arm: [E, P, 1.5]
  joints: {clamp: {fixed: [leg, arm], point: E, angle: 74}}
  drives: {turn: {angle: leg}, reach: {length: leg}}
  sketch: {E: [1.2, 1.4], P: [0.1, 2.4]}
  measures: {xy: "P.x * P.y", gap: {distance: [G, E]}, tip: "hypot(E.x, P.y)"}
"""
    mechanism = study_of(text).mechanism
    drawn = mechanism.sketch_configuration
    for given in (("P.x", "xy"), ("E.y", "xy"), ("xy", "gap"), ("E.y", "tip")):
        found = mechanism.plan(given).solve([drawn.value(mechanism.coordinate(name)) for name in given])
        assert found.valid
        assert abs(found.point("P") - drawn.point("P")) == pytest.approx(0, abs=1e-12)
