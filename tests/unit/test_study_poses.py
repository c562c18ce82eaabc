"""Poses: lists, sweeps, grids, paths, and what is assumed where a study gives none."""

import pickle

import numpy as np
import pytest

import mechdesign

CRANK = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: [upper, fore]
  sketch: {E: [8, 5], P: [13, 11]}
"""
LEG = """
mechanism:
  links: {ground: {O: [0, 0], D: [50, 0]}, leg: {from: O, to: A, telescopic: true}, rocker: [D, A, 40]}
  drives: [leg]
  sketch: {A: [40, 35]}
"""


@pytest.fixture
def poses(tmp_path):
    """Columns of the poses at which a question is answered."""

    def poses(text, command="kinematics"):
        path = tmp_path / "study.yaml"
        path.write_text(text)
        return getattr(mechdesign, command)(mechdesign.load(path)).main

    return poses


def test_a_sweep_includes_both_ends(poses):
    found = poses(CRANK + "kinematics: {sweep: {crank: {from: 0, to: 1, step: 0.1}}}")
    np.testing.assert_allclose(found["crank"], np.linspace(0, 1, 11), atol=1e-12)


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        ("{from: 0, to: 10, step: 4}", [0, 4, 8]),
        ("{from: 10, to: 0, step: -5}", [10, 5, 0]),
        ("{from: 0, to: 10, number: 3}", [0, 5, 10]),
        ("{from: 0, to: 0.3 rad, number: 2}", [0, np.degrees(0.3)]),
        ("7", [7]),
    ],
)
def test_sweeps(poses, sweep, expected):
    np.testing.assert_allclose(poses(CRANK + f"kinematics: {{sweep: {{crank: {sweep}}}}}")["crank"], expected)


def test_several_keys_make_a_grid_and_a_number_is_held(poses):
    found = poses(ARM + "kinematics: {sweep: {upper: {from: 0, to: 2, step: 1}, fore: {from: 5, to: 6, step: 1}}}")
    np.testing.assert_array_equal(found["upper"], [0, 0, 1, 1, 2, 2])
    np.testing.assert_array_equal(found["fore"], [5, 6, 5, 6, 5, 6])
    held = poses(ARM + "kinematics: {sweep: {upper: {from: 0, to: 2, step: 1}, fore: 5}}")
    np.testing.assert_array_equal(held["fore"], [5, 5, 5])


def test_listed_poses_may_give_different_coordinates(poses):
    asked = "poses: [{upper: 1, fore: 2}, {P.x: 3, P.y: 4}, {fore: 6, upper: 5}]"
    found = poses(
        ARM + f"reliability: {{{asked}, dimensions: {{fore.length: 1}}, outputs: [E.x], methods: [analytic]}}",
        "reliability",
    )
    for name, values in {"upper": [1, np.nan, 5], "fore": [2, np.nan, 6], "P.x": [np.nan, 3, np.nan]}.items():
        np.testing.assert_array_equal(found[name], values)
    # A pose that is listed and cannot be assembled is told; one on the way of a sweep only where it is not.
    asked = ARM + "kinematics: {poses: [{upper: 1, fore: 2}, {P.x: 30, P.y: 4}], outputs: [P]}"
    assert mechdesign.kinematics(mechdesign.load(text=asked)).failed
    path = ARM + "kinematics: {path: {P: [[10, 4], [30, 4]]}}"
    assert not mechdesign.kinematics(mechdesign.load(text=path)).failed


def test_paths(poses, tmp_path):
    found = poses(ARM + "kinematics: {path: {P: [[1, 2], [3, 4]]}}")
    np.testing.assert_array_equal(found["P.x"], [1, 3])
    np.testing.assert_array_equal(found["P.y"], [2, 4])
    (tmp_path / "way.csv").write_text("x,y\n1,2\n3, 4\n\n")
    for given in ("way.csv", "{file: way.csv}"):
        from_file = poses(ARM + f"kinematics: {{path: {{P: {given}}}}}")
        np.testing.assert_array_equal(from_file["P.x"], found["P.x"])
    mixed = poses(ARM + "kinematics: {path: {upper: [1, 2, 3], fore: 7}}")
    np.testing.assert_array_equal(mixed["fore"], [7, 7, 7])


@pytest.mark.slow
def test_defaults(poses):
    np.testing.assert_array_equal(poses(CRANK)["crank"], np.arange(0, 361, 5))
    assert len(poses(CRANK + "stiffness: {at: B, actuators: {crank: 1e6}}", "stiffness")) == 73
    limited = CRANK + "  limits: [{drive: crank, min: 10, max: 60}]\n"
    np.testing.assert_allclose(poses(limited)["crank"], np.linspace(10, 60, 51))
    limited = LEG + "  limits: [{drive: leg, min: 20, max: 70}]\n"
    np.testing.assert_allclose(poses(limited)["leg"], np.linspace(20, 70, 51))
    asked = CRANK + "kinematics: {sweep: {crank: 5}}\nreliability: {dimensions: {rod.length: 1}, outputs: [B.x]}\n"
    assert poses(asked, "reliability")["crank"].tolist() == [5] * 2


@pytest.mark.parametrize(("text", "message"), [(ARM, "with 2 drives"), (LEG, "'leg' has no limits")])
def test_nothing_is_assumed_without_reason(poses, text, message):
    with pytest.raises(mechdesign.StudyError, match=message):
        poses(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{poses: [{crank: 1}, {crank: 1, B.x: 3}]}", "study.yaml:6:34: kinematics.poses.1: a pose gives 1 coordinate"),
        ("{poses: [{O.x: 1}]}", "study.yaml:6:22: kinematics.poses.0: 'O.x' never changes: point 'O'"),
        ("{poses: []}", "kinematics.poses: an empty list"),
        ("{sweep: {}}", "kinematics.sweep: a pose gives 1 coordinate"),
        ("{sweep: {crank: {from: 0, to: 360, step: 1e-9}}}", "more than 10000000 poses"),
        ("{sweep: {crank: {from: 0, to: 360, step: 0}}}", "a step of 0 never leads"),
        ("{sweep: {crank: {from: 0, to: 360}}}", "either 'step' or 'number'"),
        ("{sweep: {crank: 1}, poses: [{crank: 1}]}", "poses and sweep are both given"),
        ("{path: {crank: missing.csv}}", "missing.csv cannot be read: No such file"),
        ("{path: {crank: [1, [2, 3]]}}", "not a mixture"),
        ("{path: {B.x: [[1, 2]]}}", "'B.x' needs a list of numbers"),
        ("{poses: workspace}", "kinematics.poses: needs the workspace section"),
    ],
)
def test_wrong_poses(poses, section, message):
    with pytest.raises(mechdesign.StudyError) as caught:
        poses(CRANK + f"kinematics: {section}")
    assert message in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mechanism", "poses"),
    [
        (CRANK, "sweep: {crank: {from: 0, to: 360, number: 1000000}}"),
        (ARM, "path: {P: {circle: {center: [8, 5], radius: 3}, points: 1000000}}"),
        (CRANK, "{motion: {crank: [{from: 0, to: 90, time: 1}]}, instants: 1000000}"),
    ],
    ids=["sweep", "path", "motion"],
)
def test_a_study_of_a_million_poses_goes_to_another_process_in_some_kilobytes(mechanism, poses):
    study = mechdesign.load(text=f"{mechanism}kinematics: {poses if poses[0] == '{' else '{' + poses + '}'}\n")
    assert len(pickle.dumps(study)) < 20_000
