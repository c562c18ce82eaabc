"""Regions between narrow limits of angles and stretched or folded legs, against the first leg's two angles."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.joint_plane import elbow, told
from helpers.legs import KINDS, FiveBar
from helpers.regions import EFFORTS, asked, compare
from helpers.studies import study_of

import mechdesign

ARM = "{ground: {A: [0, 0]}, upper: [A, B, 1], fore: [B, P, 0.5]}"


SEEN = [("five_bar", "same", 25), ("3-RRR", "same", 19), ("arm", "any", 11), ("arm", "any", 165), ("arm", "same", 55)]
NIGHTLY = [("five_bar", "same", 15), ("five_bar", "same", 87), ("five_bar", "same", 89), ("five_bar", "any", 25),
           ("five_bar", "any", 35), ("arm", "any", 27), ("arm", "same", 13)]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "assembly", "seed"), [*SEEN, *(pytest.param(*case, marks=pytest.mark.nightly) for case in NIGHTLY)]
)
def test_spikes_bumps_between_samples_and_other_elbows_are_part_of_regions(kind: str, assembly: str, seed: int) -> None:
    compare(KINDS[kind].of(seed), assembly, "of many")


@pytest.mark.slow
@pytest.mark.parametrize(("assembly", "effort"), [("same", "alone"), ("same", "of many"),
                         *(pytest.param("any", effort, marks=pytest.mark.nightly) for effort in EFFORTS)])  # fmt: skip
def test_a_region_of_a_coupler_point_between_a_stretched_leg_and_narrow_limits(assembly: str, effort: str) -> None:
    bases, cranks, at = np.array([-52 - 12.2j, 37.5 + 19.8j]), np.array([135.6, 145.6]), complex(146.3, -1.7)
    low, high = np.radians([[82.0, 85.0], [115.0, 108.0]])
    pins = bases + cranks * np.exp(1j * np.radians([106.14, 92.31]))
    _, joint = elbow(pins[1], complex(pins[0]), 142.1, 130.5, -1)
    point = complex(pins[0] + (joint - pins[0]) * at / 142.1)
    rods = np.array([abs(at), 130.5])
    robot = FiveBar(bases, cranks, rods, low, high, point, pins, np.zeros(1, complex), 142.1 / at)
    compare(robot, assembly, effort)


@pytest.mark.slow
@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("width", [0.5, *(pytest.param(width, marks=pytest.mark.nightly) for width in (2.0, 8.0))])
@pytest.mark.parametrize(("shoulder", "elbow"), [(20, 90), (-70, -120)])
def test_an_arm_whose_shoulder_hardly_turns(shoulder: float, elbow: float, width: float, effort: str) -> None:
    """The crescent that the forearm sweeps: A = 2 w l1 l2, and the mean of 1/|det J| is w pi/A."""
    upper = 100 * np.exp(1j * np.radians(shoulder))
    hand = upper + 70 * np.exp(1j * np.radians(shoulder + elbow))
    text = f"""
units: {{length: mm}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, 100], fore: [A, P, 70]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{drive: q1, min: {shoulder - 0.5 * width}, max: {shoulder + 0.5 * width}}}]
  sketch: {{A: {told(upper)}, P: {told(hand)}}}
workspace: {{point: P, indices: [resistivity]}}
"""
    (area, mean), (error, doubt) = asked(text, effort, ("area", "GRI"))
    true = 2 * np.radians(width) * 7000
    assert abs(area - true) <= 2 * error
    assert abs(mean - np.radians(width) * np.pi / true) <= 2 * doubt


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 5, 24])
def test_the_error_of_a_design_of_many_is_near_its_true_one(seed: int) -> None:
    """Narrow limits leave cells of the raster open that rays decide."""
    text = KINDS["arm"].of(seed).text("same")
    (alone,), _ = asked(text, "alone", ("area",))
    (area,), (error,) = asked(text, "of many", ("area",))
    assert abs(area - alone) <= 2 * error <= 1e-3 * area


@pytest.mark.slow
@pytest.mark.parametrize("effort", EFFORTS)
def test_a_neck_beside_a_panel_narrower_than_breaks_are_known_divides_no_piece(effort: str) -> None:
    """The mean is taken over a range of angle of 4e-7 rad that begins 9e-8 rad before a gap opens in the ray."""
    robot, low, high = KINDS["arm"].of(55), 3.583557423, 3.583557813
    begin, end, margin = np.degrees([low - 0.3, high + 0.3, 0.3])
    scan = f"workspace.scan.from={begin:.17g}", f"workspace.scan.to={end:.17g}"
    text = robot.text("same")
    (whole,), (error,) = asked(text, effort, ("area",), *scan)
    (area,), (doubt,) = asked(text, effort, ("area",), *scan, f"workspace.margin={margin:.17g}")
    assert abs(area - whole) <= error + doubt


@pytest.mark.slow
def test_notches_too_many_for_the_rays_of_a_design_of_many_are_part_of_the_error() -> None:
    """61 notches in a turn, 5e-4 deep in a radius of 1.5."""
    text = f"""
units: {{length: m}}
mechanism:
  measures: {{room: "1.5095 + 0.01*sin(61*atan2(P.y, P.x)) - sqrt(P.x*P.x + P.y*P.y)"}}
  links: {ARM}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{measure: room, min: 0}}]
  sketch: {{B: [1, 0], P: [1.3, 0.4]}}
workspace: {{point: P, assembly: any, scan: {{about: [0, 0], from: -170, to: 170}}}}
"""
    theta = np.radians(170) * (2 * (np.arange(1_000_000) + 0.5) / 1_000_000 - 1)
    outer = np.minimum(1.5, 1.5095 + 0.01 * np.sin(61 * theta))
    (area,), (error,) = asked(text, "of many", ("area",))
    assert abs(area - np.radians(170) * np.mean(outer**2 - 0.25)) <= 2 * error <= 0.02


@pytest.mark.slow
@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("rate", [6000, 12000, pytest.param(24000, marks=pytest.mark.nightly)])
def test_rings_too_many_for_the_samples_of_a_ray_are_part_of_the_error(rate: int, effort: str) -> None:
    """Where sin(rate r^2) is at least 0.3, in degrees: of every turn of the angle the part (180 - 2 asin 0.3)/360."""
    (area,), (error,) = asked(rings(rate), effort, ("area",))
    first = np.degrees(np.arcsin(0.3)) + 360 * np.arange(rate // 100)
    ends = np.clip([first, first + 180 - 2 * first[0]], 0.25 * rate, 2.25 * rate)
    true = np.pi * np.ptp(ends, axis=0).sum() / rate
    assert abs(area - true) <= 2 * error + 1e-9 * true
    assert error <= 2 * np.pi


@pytest.mark.nightly
def test_a_workspace_of_too_many_rings_is_answered_with_its_error() -> None:
    """Rays of different accuracy, of the region and of the inscribed circle, need not agree there."""
    result = mechdesign.workspace(study_of(rings(12000)))
    region = result.main
    assert any("a limit begins and ends too often along its rays" in str(caution) for caution in result.warnings)
    assert 0 < region["area"][0] < 2 * np.pi
    assert 0.1 < region["area_error"][0] <= 2 * np.pi


def rings(rate: int) -> str:
    return f"""
units: {{length: m}}
mechanism:
  measures: {{wave: "sin({rate}*(P.x*P.x + P.y*P.y))"}}
  links: {ARM}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{measure: wave, min: 0.3}}]
  sketch: {{B: [1, 0], P: [1.3, 0.4]}}
workspace: {{point: P, assembly: any, scan: {{about: [0, 0]}}}}
"""
