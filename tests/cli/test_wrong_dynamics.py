"""Wrong masses, springs and loads: one clear message where it stands; and numbers at the end of what is taken."""

from __future__ import annotations

import warnings

import pytest

STUDY = """\
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: {from: O, to: A, length: 30, mass: 0.5, center: [10, 0], inertia: 100}
    rod: {from: A, to: B, length: 90, mass: 1}
    rocker: [D, B, 60]
  springs: {back: {between: [O, B], stiffness: 2, free_length: 50}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
dynamics:
  gravity: [0, -9810]
  sweep: {theta: {from: 0, to: 360, number: 7}}
  rates: {theta: 360}
  loads: [{at: B, force: [1, 2]}]
"""
MASS, SPRING, LOAD = "mass: 0.5", "between: [O, B], stiffness: 2, free_length: 50", "{at: B, force: [1, 2]}"
WRONG = [
    (MASS, "mass: -0.5", "mechanism.links.crank.mass: must be at least 0"),
    (MASS, "mass: .nan", "finite number, not nan"),
    (MASS, "mass: 1e300", "too large a number"),
    (MASS, "mass: 3 N", "'3 N' is a force, where a mass is expected"),
    (MASS, "mas: 1", "did you mean 'mass'?"),
    (f"{MASS}, ", "", "'center' belongs to a mass"),
    ("inertia: 100", "inertia: 3 kg", "where a moment of inertia is expected"),
    ("center: [10, 0]", "center: [1, 2, 3]", "expected [x, y]"),
    ("{O: [0, 0], D: [100, 0]}", "{points: {O: [0, 0], D: [100, 0]}, mass: 3}", "the ground does not move"),
    ("rocker: [D, B, 60]", "rocker: {from: D, to: B, length: 60, rod: {mass: 1}}", "of a telescopic link"),
    (SPRING, "between: [O, O], stiffness: 2, free_length: 50", "'O' and itself does nothing"),
    (SPRING, "between: [rod.A, crank.A], stiffness: 2, free_length: 0", "which are one place, does nothing"),
    (SPRING, "between: [O], stiffness: 2, free_length: 50", "a list of two points or two links"),
    (SPRING, "between: [O, Z], stiffness: 2, free_length: 50", "there is no point 'Z'"),
    (SPRING, "between: [ground, crunk], stiffness: 2, free_angle: 5", "no link 'crunk'; did you mean 'crank'?"),
    (SPRING, "between: [O, crank], stiffness: 2, free_length: 50", "there is no point 'crank'"),
    (SPRING, "between: [O, B], stiffness: 2", "a stiffness counts from a 'free_length'"),
    (SPRING, "between: [O, B], stiffness: 2, free_angle: 3", "between two points there is no 'free_angle'"),
    (SPRING, "between: [ground, rod], stiffness: 2, free_length: 3", "between two links there is no 'free_length'"),
    (SPRING, "between: [O, B], stiffness: -2, free_length: 3", "must be at least 0"),
    (SPRING, "between: [O, B], stiffness: 2 N*m/rad, free_length: 3", "where a stiffness is expected"),
    (SPRING, "between: [O, B], rise: 3", "'rise' belongs to the 'force' of a gas spring"),
    (SPRING, "between: [O, B], force: 3, stiffness: 3, free_length: 1", "a gas spring has 'force' and 'rise'"),
    (LOAD, "{at: B, between: [O, B], force: [1, 2]}", "a load is {at: point"),
    (LOAD, "{at: B, force: [1, 2, 3]}", "a force is [fx, fy]"),
    (LOAD, "{at: B, force: 1}", "a force at a point is [fx, fy]"),
    (LOAD, "{between: [O, B], force: [1, 2]}", "between two points a single number"),
    (LOAD, "{between: [A, crank.A], force: 2}", "are one place"),
    (LOAD, "{at: rod.D, force: [1, 2]}", "there is no point 'rod.D'"),
    (LOAD, "{link: crunk, moment: 2}", "did you mean 'crank'?"),
    (LOAD, "{link: ground, moment: 2}", "a moment on it does nothing"),
    (LOAD, "{link: rod, moment: 2 N}", "where a moment is expected"),
    (LOAD, "{at: B, force: [1, 2], in: crunk}", "did you mean 'crank'?"),
    (LOAD, "{between: [O, B], force: 1, in: rod}", "'in' turns the directions of a force 'at' a point"),
    (LOAD, "{at: B, force: [q, 2]}", "no coordinate or parameter 'q'"),
    (LOAD, "{at: B, force: [1e300, 2]}", "too large a number"),
    (LOAD, "{at: B, force: [time, 2]}", "'time' needs poses over time"),
    (LOAD, "{at: B, force: [B.x_acceleration, 2]}", "no coordinate or parameter 'B.x_acceleration'"),
    (LOAD, "{}", "a load needs a force or a moment"),
    ("  rates: {theta: 360}\n  loads: [" + LOAD, "  loads: [{at: B, force: [B.x_velocity, 2]}", "needs velocities"),
    ("[0, -9810]", "-9810", "expected [gx, gy]"),
    ("[0, -9810]", "[0, 9.81 N]", "where an acceleration is expected"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG, ids=[new or "no mass" for _, new, _ in WRONG])
def test_wrong_masses_springs_and_loads_are_told(folder, invoke, old, new, message) -> None:
    assert old in STUDY
    (folder / "study.yaml").write_text(STUDY.replace(old, new))
    done = invoke("dynamics", "study.yaml")
    assert done.exit_code == 2, done.output
    assert message in done.stderr
    assert not (folder / "results").exists()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("rates: {theta: 360}", "rates: {theta: 1e60}\n  accelerations: {theta: -1e60}"),
        pytest.param(
            f"{MASS}, center: [10, 0], inertia: 100",
            "mass: 1e60, center: [1e15, 0], inertia: 1e60",
            marks=pytest.mark.nightly,
        ),
        pytest.param(
            SPRING,
            "between: [O, B], stiffness: 1e60, free_length: 1e15, damping: 1e60, preload: 1e60",
            marks=pytest.mark.nightly,
        ),
        (LOAD, '{at: B, force: [1e60, -1e60]}, {link: rod, moment: "1e60*theta_velocity"}'),
        ("[0, -9810]", "[1e60, -1e60]"),
    ],
)
def test_huge_numbers_give_huge_forces(folder, invoke, old, new) -> None:
    assert old in STUDY
    (folder / "study.yaml").write_text(STUDY.replace(old, new))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert invoke("dynamics", "study.yaml", "--no-plots").exit_code == 0


@pytest.mark.parametrize(
    "size", ["1/(theta - theta)", "sqrt(B.x - 1000)", pytest.param("exp(theta*1000)", marks=pytest.mark.nightly)]
)
def test_a_load_without_a_value_is_told(folder, invoke, size) -> None:
    (folder / "study.yaml").write_text(STUDY.replace(LOAD, f"{{at: B, force: ['{size}', 2]}}"))
    done = invoke("dynamics", "study.yaml", "--no-plots")
    assert done.exit_code == 0
    assert "an expression of the loads has no value at" in done.stderr
