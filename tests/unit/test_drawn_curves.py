"""Pictures of a motion show its functions: no chords between the poses of a table, and one peak everywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import FOUR_BAR, study_of
from matplotlib.axes import Axes

import mechdesign
from mechdesign.door.report.page.headlines import headlines
from mechdesign.door.report.page.moving import moving
from mechdesign.drawing import style
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Result

GALLERY = Path(__file__).parents[2] / "configs" / "gallery"
SEEN = 2e-3  # of the height of a panel
SLIDER_CRANK = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    slider: {points: {B: [0, 0]}}
  joints: {way: {prismatic: [ground, slider], through: O, direction: 0}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [85, 0]}
kinematics:
  sweep: {theta: {from: 360, to: 720, step: 5}}
  outputs: [B.x]
  rates: {theta: 60 rpm}
  loads: [{at: B, force: [-100, 0]}]
"""
ROUGH = SLIDER_CRANK.replace("step: 5", "step: 45")


def curves(axes: Axes) -> list[Floats]:
    """Curves of a panel, shape (points, 2)."""
    lines = [np.asarray(line.get_xydata(), dtype=float) for line in axes.get_lines()]
    return [line for line in lines if len(line) > 5]


def far(axes: Axes, x: Floats, values: Floats) -> float:
    """How far the nearest of the curves of a panel is from a function at its most, as a part of the panel's height."""
    low, high = axes.get_ylim()
    gaps = [np.abs(np.interp(x, *curve.T) - values).max() for curve in curves(axes)]
    return float(min(gaps) / (high - low))


@pytest.mark.slow
@pytest.mark.parametrize("look", ["screen", "paper"])
def test_velocities_of_a_motion_in_steps_of_45_degrees_are_curves_and_no_chords(look: str) -> None:
    rough, fine = study_of(ROUGH), mechdesign.kinematics(study_of(SLIDER_CRANK, "kinematics.sweep.theta.step=0.5"))
    with style.context(look):
        figure = figure_of(rough, mechdesign.kinematics(rough), "motion")
    table = fine.tables["motion"]
    for name, label in (("B.x", "position"), ("B.x_velocity", "velocity"), ("theta_effort", "effort")):
        axes = next(axes for axes in figure.axes if axes.get_ylabel().startswith(label))
        assert far(axes, table["theta"], table[name]) < SEEN, name


@pytest.mark.slow
def test_a_chart_of_a_page_has_the_same_curves_and_its_key_number_their_peak() -> None:
    rough, fine = study_of(ROUGH), mechdesign.kinematics(study_of(SLIDER_CRANK, "kinematics.sweep.theta.step=0.5"))
    result = mechdesign.kinematics(rough)
    part = moving(rough, result)
    assert part is not None
    assert part.data["poses"] > 40
    (peak,) = (float(number.value.replace("\N{NARROW NO-BREAK SPACE}", "")) for number in headlines(result)
               if number.label.endswith("effort of theta"))  # fmt: skip
    with style.context():
        figure = figure_of(rough, result, "motion")
    effort = next(axes for axes in figure.axes if axes.get_ylabel().startswith("effort"))
    assert np.abs(curves(effort)[0][:, 1]).max() == pytest.approx(peak, rel=1e-3)
    assert np.abs(fine.tables["motion"]["theta_effort"]).max() == pytest.approx(peak, rel=1e-3)
    extremes = result.tables["extremes"]
    assert extremes["max"][extremes.where(output="theta_effort")] == pytest.approx(peak, rel=1e-3)


def on_its_curve(axes: Axes) -> tuple[float, float]:
    """The ring of a panel, which lies on one of the curves."""
    (ring,) = (np.asarray(line.get_xydata())[0] for line in axes.get_lines() if line.get_markerfacecolor() == "none"
               and len(line.get_xydata()) == 1)  # fmt: skip
    assert far(axes, ring[:1], ring[1:]) < SEEN
    return float(ring[0]), float(ring[1])


@pytest.mark.slow
def test_the_ring_of_a_peak_between_the_poses_is_on_its_curve_and_is_that_of_the_table() -> None:
    study = mechdesign.load(GALLERY / "flywheel_press.yaml")
    result = mechdesign.dynamics(study)
    extremes = result.tables["extremes"]
    with style.context():
        efforts, joints = (figure_of(study, result, name) for name in ("efforts", "joint_forces"))
    (effort,) = extremes["peak"][extremes.where(output="crank_effort")]
    assert on_its_curve(efforts.axes[0]) == pytest.approx((244.423, effort), rel=1e-5)
    forces = [name for name in extremes["output"] if name.endswith("_force") or "_force_on_" in name]
    largest = max(forces, key=lambda name: extremes["peak"][extremes.where(output=name)][0])
    row = extremes.take(extremes.where(output=largest))
    assert on_its_curve(joints.axes[0]) == pytest.approx((row["peak_at"][0], row["peak"][0]), rel=1e-6)


def hodograph(result: Result, study: mechdesign.Study) -> Floats:
    with style.context():
        axes = figure_of(study, result, "bearings").axes[0]
    return max(curves(axes), key=len)


@pytest.mark.slow
def test_the_way_of_a_constant_force_that_turns_is_a_circle_and_no_polygon() -> None:
    study = mechdesign.load(GALLERY / "one_tooth_difference.yaml")
    way = hodograph(mechdesign.dynamics(study), study) @ [1, 1j]
    middles = (way[1:] + way[:-1]) / 2
    radius = np.abs(way[0])
    assert np.abs(middles) == pytest.approx(radius, abs=SEEN * 2 * radius)


@pytest.mark.slow
def test_stiffness_and_joint_forces_between_the_poses_are_drawn_as_they_are() -> None:
    path = GALLERY / "press_stiffness.yaml"
    rough = mechdesign.load(path, {"stiffness.sweep.theta.step": 45})
    fine = mechdesign.load(path, {"stiffness.sweep.theta.step": 1})
    table = mechdesign.stiffness(fine).tables["stiffness"]
    with style.context():
        drawn, joints = (figure_of(rough, mechdesign.stiffness(rough), name) for name in ("stiffness", "joint_forces"))
        exact = figure_of(fine, mechdesign.stiffness(fine), "joint_forces")
    assert far(drawn.axes[0], table["theta"], table["k_min"]) < SEEN
    (place, peak), (exact_place, exact_peak) = on_its_curve(joints.axes[0]), on_its_curve(exact.axes[0])
    assert place == pytest.approx(exact_place, abs=0.05)
    assert peak == pytest.approx(exact_peak, rel=1e-6)


@pytest.mark.slow
def test_places_that_fall_together_leave_the_crank_angle_on_the_axis() -> None:
    # Of a constant force the effort is the velocity many times over: both have their largest value at one place, which
    # is known but for rounding.
    for radius in (30, 32, 34, 54):
        study = study_of(SLIDER_CRANK.replace("[O, A, 30]", f"[O, A, {radius}]"))
        result = mechdesign.kinematics(study)
        marked = [number.place for number in headlines(result) if number.place is not None]
        assert np.diff(np.sort(marked)).min() < 1e-9
        part = moving(study, result, marked=marked)
        assert part is not None
        assert part.data["over"][0] == "theta [deg]"


def test_errors_that_are_given_pose_by_pose_cost_no_picture_of_a_path():
    """A path of the drive with as many rows of a target as poses: its errors have no values between them."""
    study = study_of(
        FOUR_BAR + "kinematics: {path: {theta: [0, 60, 120, 180]}, outputs: [P]}",
        "mechanism.targets={P: [[40, 40], [30, 50], [10, 40], [0, 30]]}",
    )
    figure = mechdesign.kinematics(study).figure("motion")
    assert figure.axes
