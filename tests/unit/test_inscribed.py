"""The largest circle and axis-parallel rectangle inside a region, where both are known."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import CROSSED, FIVE_BAR, study_of
from scipy.optimize import brentq

import mechdesign

# The workspace of a point in the assembly of the sketch, without indices.
PLAIN = "workspace={point: P, indices: []}"
LEGS = """
units: {length: dimensionless}
mechanism:
  parameters: {high: 3}
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits: [{drive: l1, max: high}, {drive: l2, max: high}]
  sketch: {C: [0, 1.8]}
workspace: {point: C, scan: {about: [0, 0]}, assembly: any}
"""
ARM = """
units: {length: dimensionless}
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 1.5], lower: [E, P, 1]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [1, 1], P: [2, 1]}
workspace: {point: P, scan: {about: [0, 0]}}
"""


def half_height(x: float) -> float:
    return float(np.sqrt(9 - (x + 1) ** 2))


@pytest.mark.slow
def test_lens_of_two_circles() -> None:
    """The circle touches both arcs on the axis; the rectangle's corners make 4 x y(x) largest on one arc."""
    main = mechdesign.workspace(study_of(LEGS)).main
    assert main["circle_radius"][0] == pytest.approx(2, rel=1e-8)
    assert (main["circle_x"][0], main["circle_y"][0]) == pytest.approx((0, 0), abs=1e-6)
    x = brentq(lambda x: half_height(x) ** 2 - x * (x + 1), 0.5, 1.9, xtol=1e-14)
    area = main["rectangle_width"][0] * main["rectangle_height"][0]
    assert area == pytest.approx(4 * x * half_height(x), rel=1e-9)
    assert main["rectangle_width"][0] == pytest.approx(2 * x, rel=1e-4)
    assert main["area"][0] == pytest.approx(2 * (9 * np.arccos(1 / 3) - np.sqrt(8)), rel=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[0.3, 0.9]"])
def test_a_ring_keeps_its_hole_free(about: str) -> None:
    """The circle is as wide as the ring; the rectangle lies on the hole, or beside it."""
    main = mechdesign.workspace(study_of(ARM, f"workspace.scan.about={about}")).main
    assert main["circle_radius"][0] == pytest.approx(1, rel=1e-8)
    assert np.hypot(main["circle_x"][0], main["circle_y"][0]) == pytest.approx(1.5, rel=1e-7)
    # From y = 0.5 up, corners on the outer circle: (y - 0.5) 2 sqrt(2.5^2 - y^2) is largest where its slope vanishes.
    y = brentq(lambda y: 2.5**2 - y * y - y * (y - 0.5), 0.5, 2.4, xtol=1e-14)
    area = main["rectangle_width"][0] * main["rectangle_height"][0]
    assert area == pytest.approx(2 * (y - 0.5) * np.sqrt(2.5**2 - y * y), rel=1e-9)


@pytest.mark.nightly
def test_a_scan_of_half_a_turn_bounds_the_region() -> None:
    """The upper half of the lens: the rectangle stands on the scan's side, the circle touches it."""
    main = mechdesign.workspace(study_of(LEGS, "workspace.scan={about: [0, 0], from: 0, to: 180}")).main
    x = brentq(lambda x: half_height(x) ** 2 - x * (x + 1), 0.5, 1.9, xtol=1e-14)
    area = main["rectangle_width"][0] * main["rectangle_height"][0]
    assert area == pytest.approx(2 * x * half_height(x), rel=1e-9)
    # Inside both circles and above the axis, centred on x = 0: 3 - hypot(1, r) = r.
    assert main["circle_radius"][0] == pytest.approx(4 / 3, rel=1e-8)
    assert main["circle_y"][0] == pytest.approx(4 / 3, rel=1e-6)


@pytest.mark.slow
def test_shapes_lie_inside() -> None:
    """No place of their borders is outside, and their size cannot grow about the same centre."""
    study = study_of(LEGS, "mechanism.limits=[{drive: l1, min: 1, max: 3}, {drive: l2, min: 1.2, max: 2.7}]")
    main = mechdesign.workspace(study).main
    centre, radius = complex(main["circle_x"][0], main["circle_y"][0]), main["circle_radius"][0]
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 100_001))

    def least(z: np.ndarray) -> float:
        one, two = np.abs(z - 1), np.abs(z + 1)
        return float(np.min([one - 1, 3 - one, two - 1.2, 2.7 - two]))

    assert least(centre + radius * (1 - 1e-7) * turn) > 0
    assert least(centre + radius * (1 + 1e-7) * turn) < 0
    half = complex(main["rectangle_width"][0], main["rectangle_height"][0]) / 2
    middle = complex(main["rectangle_x"][0], main["rectangle_y"][0])
    s = np.linspace(-1, 1, 20_001)
    border = np.concatenate([s * half.real + 1j * half.imag, s * half.real - 1j * half.imag,
                             half.real + 1j * s * half.imag, -half.real + 1j * s * half.imag])  # fmt: skip
    assert least(middle + border * (1 - 1e-7)) > 0
    assert least(middle + border * (1 + 1e-6)) < 0


@pytest.mark.nightly
def test_a_side_along_which_one_margin_ends_the_region() -> None:
    """Half of what two rings share, above the line through their middles: its lower side is a line of singularities."""
    limits = "mechanism.limits=[{drive: l1, min: 0.5, max: 2}, {drive: l2, min: 0.5, max: 2}]"
    main = mechdesign.workspace(study_of(LEGS, limits, "workspace.assembly=same", "mechanism.sketch.C=[0, 1.2]")).main
    # Between the small circles and below the large ones: 2 w sqrt(4 - (1 + w)^2) grows up to their edge at w = 0.5.
    width, height = main["rectangle_width"][0], main["rectangle_height"][0]
    assert (width, height) == pytest.approx((1, np.sqrt(4 - 1.5**2)), rel=1e-7)
    assert main["rectangle_y"][0] == pytest.approx(height / 2, abs=1e-7)
    assert main["circle_radius"][0] == pytest.approx(0.75, rel=1e-7)


@pytest.mark.nightly
def test_a_shape_that_a_singularity_crosses_is_told() -> None:
    """In any assembly of a five-bar the rods come in line inside the region; in the sketch's they bound it."""
    warnings = [str(warning) for warning in mechdesign.workspace(study_of(CROSSED)).warnings]
    (told,) = (words for words in warnings if "crossed" in words)
    assert "parallel singularity" in told
    assert "lower_1" in told
    same = mechdesign.workspace(study_of(CROSSED, "workspace.assembly=same"))
    assert not any("crossed" in str(warning) for warning in same.warnings)


@pytest.mark.nightly
def test_largest_circles_and_rectangles_are_goals_of_designs() -> None:
    """Those of the workspace, design by design, in its unit: they were found by a whole answer for every design."""
    goals = "maximize: [workspace.circle_radius, workspace.rectangle_width]"
    lengths = "left.length: {from: 0.22, to: 0.26, step: 0.02}"
    designs = mechdesign.optimize(study_of(FIVE_BAR, PLAIN, f"optimize={{variables: {{{lengths}}}, {goals}}}")).tables[
        "designs"
    ]
    for goal in ("circle_radius", "rectangle_width"):
        column = designs.column(f"workspace.{goal}")
        assert column.unit == "m"
        for length, value in zip(designs["left.length"], column.values, strict=True):
            alone = mechdesign.workspace(study_of(FIVE_BAR, PLAIN, f"mechanism.links.left=[A, D, {length}]")).main
            assert value == pytest.approx(alone[goal][0], rel=1e-6)
