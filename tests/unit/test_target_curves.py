"""Curves that a point shall pass at whatever time: how far their points are from its path."""

import numpy as np
import pytest
from helpers.syntheses import four_bar

import mechdesign

LINKAGE = """
mechanism:
  parameters: {a: 20, b: 90, c: 80, u: 30, v: 30}
  links:
    ground: {O: [0, 0], D: [70, 0]}
    crank: [O, A, a]
    rod: {from: A, to: B, length: b, points: {P: [u, v]}}
    rocker: [D, B, c]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 20], B: [60, 80]}
  targets: {P: {curve: CURVE, closed: true}}
kinematics:
  MOTION
  outputs: [P]
"""
POINTS = [[35.0, 40.0], [25.0, 55.0], [5.0, 55.0], [-10.0, 35.0], [-5.0, 15.0], [20.0, 20.0]]


def study(curve: object, motion: str = "sweep: {theta: {from: 0, to: 360, step: 5}}") -> mechdesign.Study:
    return mechdesign.load(text=LINKAGE.replace("CURVE", str(curve)).replace("MOTION", motion))


def by_hand(points: list[list[float]], first: float = 0.0, last: float = 360.0) -> np.ndarray:
    """Distances of points from the path of P, by closed form at two million crank angles about the nearest."""
    near, width = np.full(len(points), 0.5 * (first + last)), last - first
    for _ in range(4):
        angles = np.clip(near[:, None] + np.linspace(-width, width, 20_001), first, last)
        paths = np.array([four_bar(20, 90, 80, 30, 30, own, 70, 1.0)[0][0] for own in angles])
        gaps = np.abs(paths - np.array([complex(*point) for point in points])[:, None])
        near, width = angles[np.arange(len(points)), gaps.argmin(axis=1)], width / 1000
    return gaps.min(axis=1)


@pytest.mark.parametrize(("step", "first", "last"), [(5, 0, 360), (20, 0, 360), (7, 40, 180)])
def test_the_points_of_a_curve_are_as_far_from_the_motion_as_a_fine_search_says(
    step: int, first: int, last: int
) -> None:
    motion = f"sweep: {{theta: {{from: {first}, to: {last}, step: {step}}}}}"
    last = first + (last - first) // step * step
    table = mechdesign.kinematics(study(POINTS, motion)).tables["targets"]
    gaps = by_hand(POINTS, first, last)
    assert table["output"].tolist() == ["P"]
    assert table["rms"][0] == pytest.approx(np.sqrt((gaps**2).mean()), rel=1e-8)
    assert table["mean"][0] == pytest.approx(gaps.mean(), rel=1e-8)
    assert table["max_abs"][0] == pytest.approx(gaps.max(), rel=1e-8)


def test_points_on_the_path_between_its_poses_have_no_error() -> None:
    path = four_bar(20, 90, 80, 30, 30, np.array([3.3, 61.7, 187.2, 359.9]), 70, 1.0)[0][0]
    table = mechdesign.kinematics(study([[z.real, z.imag] for z in path.tolist()])).tables["targets"]
    assert table["max_abs"][0] < 1e-9


def test_a_requirement_judges_the_largest_distance() -> None:
    text = LINKAGE.replace("CURVE", str(POINTS)).replace("MOTION", "sweep: {theta: {from: 0, to: 360, step: 5}}")
    largest = by_hand(POINTS).max()
    for bound, met in ((largest + 1e-6, True), (largest - 1e-6, False)):
        required = f"requirements: [{{result: kinematics.targets.P.max_abs, at_most: {bound}}}]\n"
        made = mechdesign.load(text=text + required)
        assert [one.met for one in mechdesign.requirements(made, mechdesign.kinematics(made))] == [met]


def test_the_curve_may_stand_in_a_file_and_follow_parameters(tmp_path) -> None:
    (tmp_path / "points.csv").write_text("".join(f"{x},{y}\n" for x, y in POINTS))
    motion = "sweep: {theta: {from: 0, to: 360, step: 5}}"
    file = tmp_path / "study.yaml"
    file.write_text(LINKAGE.replace("CURVE", "{file: points.csv}").replace("MOTION", motion))
    rms = mechdesign.kinematics(mechdesign.load(file)).tables["targets"]["rms"][0]
    assert rms == pytest.approx(np.sqrt((by_hand(POINTS) ** 2).mean()), rel=1e-8)
    moved = mechdesign.kinematics(study("[[u + 5, v + 10], [u - 5, 55]]")).tables["targets"]
    assert moved["rms"][0] == pytest.approx(np.sqrt((by_hand(POINTS[:2]) ** 2).mean()), rel=1e-8)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("sweep: {theta: {from: 0, to: 360, step: 5}}", "poses: [{theta: 0}, {theta: 90}]", "passed by a motion; give"),
        ("P: {curve", "theta: {curve", "a curve is of a point"),
        ("closed: true", "closed: 3", "expected true or false"),
        ("closed: true", "open: true", "or {curve: "),
        (str(POINTS), "[[1, 2, 3]]", "every row is"),
        (str(POINTS), "[]", "an empty list"),
        (str(POINTS), "[1, 2]", "a list of"),
    ],
)
def test_what_is_no_curve_is_said(old: str, new: str, words: str) -> None:
    text = LINKAGE.replace("CURVE", str(POINTS)).replace("MOTION", "sweep: {theta: {from: 0, to: 360, step: 5}}")
    assert old in text
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=text.replace(old, new))
