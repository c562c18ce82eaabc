"""Limits about targets: what a made mechanism misses counts with what the drawn one misses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import mechdesign

SIGMA = 0.1  # of the crank's length, whose tolerance is three times this


def asked(limit: str, methods: str = "analytic", *, poses: str = "[0, 90]", more: str = "") -> Any:
    """A crank of 50 mm about the origin, whose pin A is limited at two poses."""
    return mechdesign.reliability(mechdesign.load(text=f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, crank: [O, A, 50]}}
  drives: {{theta: {{angle: crank}}}}
reliability:
  path: {{theta: {poses}}}
  dimensions: {{crank.length: 0.3{more}}}
  limits: {{{limit}}}
  methods: [{methods}]
  samples: 20000
  sobol: 0
"""))  # fmt: skip


def share(missed: float, radius: float) -> float:
    """Of pins within a radius of a place that lies `missed` farther out than the drawn pin."""
    return float(norm.cdf((missed + radius) / SIGMA) - norm.cdf((missed - radius) / SIGMA))


@pytest.mark.parametrize("method", ["analytic", "monte_carlo", "form", "importance_sampling", "second_order"])
def test_a_circle_about_a_target_counts_what_the_drawn_mechanism_misses(method: str) -> None:
    table = asked("A: {radius: 0.3, target: [[50.2, 0], [0, 49.9]]}", method).tables["reliability"]
    pose = table.take(table["scope"] == "pose")
    for row, missed in enumerate((0.2, -0.1)):
        assert pose["reliability"][row] == pytest.approx(
            share(missed, 0.3), abs=0.01 if method == "monte_carlo" else 4e-3
        )


def test_errors_and_capability_count_from_the_drawn_place_and_limits_from_the_target() -> None:
    answer = asked("A.x: {min: -0.3, max: 0.2, target: [50.2, null]}")
    assert answer.tables["moments"]["mean"][0] == pytest.approx(50)
    capability = answer.tables["capability"]
    assert (capability["lsl"][0], capability["usl"][0]) == pytest.approx((49.9, 50.4))
    assert capability["cpk"][0] == pytest.approx(0.1 / (3 * SIGMA))
    assert np.isnan(capability["cpk"][1])


@pytest.mark.parametrize("method", ["analytic", "monte_carlo", "form", "auto"])
def test_a_pose_without_a_target_has_no_limit(method: str) -> None:
    answer = asked("A: {radius: 0.3, target: [null, [0, 50.2]]}", method)
    table = answer.tables["reliability"]
    pose = table.take(table["scope"] == "pose")
    assert pose["reliability"][0] == 1.0
    assert pose["reliability"][1] == pytest.approx(share(0.2, 0.3), abs=0.01)
    assert not [warning for warning in answer.warnings if "no failure" in str(warning)]


@pytest.mark.parametrize("method", ["analytic", "monte_carlo"])
def test_with_free_timing_the_distance_from_the_path_counts_whenever_it_is_passed(method: str) -> None:
    """The drive misses by 2 deg, 1.7 mm along the circle; the target lies 0.1 mm outside it, a degree ahead."""
    place = 50.1 * np.exp(1j * np.radians([1, 91]))
    target = f"[[{place[0].real}, {place[0].imag}], [{place[1].real}, {place[1].imag}]]"
    held = asked(f"A: {{radius: 0.3, target: {target}}}", method, more=", theta: 6 deg").tables["reliability"]
    free = asked(f"A: {{radius: 0.3, target: {target}, timing: free}}", method, more=", theta: 6 deg")
    table = free.tables["reliability"]
    assert held["reliability"][0] < 0.2
    # The first order takes the circle for its tangent, 0.008 mm away.
    assert table["reliability"][0] == pytest.approx(share(0.1, 0.3), abs=0.006)


def test_one_target_is_that_of_all_poses() -> None:
    """A circle of 50 mm passes it whenever, by as much as the crank's length deviates."""
    table = asked("A: {radius: 0.3, target: [[50.1, 0]], timing: free}", poses="[-1, 1]").tables["reliability"]
    assert table["reliability"][:2] == pytest.approx([share(0.1, 0.3)] * 2, abs=0.006)


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("A: {radius: 1, target: [[1, 2], [2, 3], [3, 4]]}", "3 targets for 2 poses: give one"),
        ("A: {radius: 1, target: 3}", "a place \\[x, y\\]"),
        ("A.x: {max: 1, target: [[1, 2], null]}", "a place \\[x, y\\], and that of another limit a number"),
        ("A: {radius: 1, target: [[1 deg, 2], null]}", "'1 deg' is an angle, where a length is expected"),
        ("A.x: {usl: 1, target: 3}", "'lsl' and 'usl' have no target"),
        ("A: {radius: 1, timing: free}", "'timing: free' is of a 'target'"),
        ("A.x: {max: 1, target: 3, timing: free}", "'timing: free' is of the radius of a point"),
    ],
)  # fmt: skip
def test_mistakes_of_targets_are_told(limit: str, words: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=words):
        asked(limit)


def test_a_place_that_lies_outside_its_circle_as_it_is_drawn_is_told() -> None:
    (warning,) = asked("A: {radius: 0.3, target: [[50.5, 0], [0, 50]]}").warnings
    assert "A: the nominal place at theta = 0 deg is 0.5 from its target, of 0.3 mm allowed" in str(warning)


def test_limits_of_single_poses_are_marks_in_the_picture_of_errors() -> None:
    answer = asked("A.x: {min: -0.4, max: 0.4, target: [50.1, null, 25]}", poses="[0, 30, 60]")
    limits = [line for line in answer.figure("bands").axes[0].lines if line.get_label() == "limit of the error"]
    upper = np.nanmax(np.concatenate([line.get_ydata() for line in limits]).astype(float))
    assert upper == pytest.approx(0.5)
    assert {line.get_marker() for line in limits} == {"_"}


@pytest.mark.slow
@pytest.mark.parametrize(("more", "tolerance"), [("", 0.2 / norm.ppf(0.99) * 3), (", grades: true", 0.125)])
def test_tolerances_are_allocated_for_a_circle_about_a_target(more: str, tolerance: float) -> None:
    """0.2 mm are left inwards of a target 0.1 mm farther out; IT12 is the coarsest grade that is finer."""
    allocate = f"allocate: {{reliability: 0.99, cost: {{crank.length: 1}}{more}"
    table = asked(f"A: {{radius: 0.3, target: [[50.1, 0], null]}}}}\n  {allocate}").tables["allocation"]
    assert table["allocated"][0] == pytest.approx(tolerance, rel=1e-3)
