"""Workspaces of closed chains: intersections of annuli, one a leg, whose exact area is summed along circular arcs."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.circles import common_area
from helpers.studies import study_of

import mechdesign
from mechdesign.ground.errors import AssemblyError

FIVE_BAR = """
units: {length: m}
mechanism:
  links:
    ground: {B1: [-0.15, 0], B2: [0.15, 0]}
    lower_1: [B1, D1, 0.25]
    upper_1: [D1, C, 0.4]
    lower_2: [B2, D2, 0.25]
    upper_2: [D2, C, 0.4]
  drives: {phi1: {angle: lower_1}, phi2: {angle: lower_2}}
  sketch: {D1: [-0.33, 0.17], D2: [0.33, 0.17], C: [0, 0.4]}
kinematics: {poses: [{C.x: 0.05, C.y: 0.45}], outputs: [C]}
workspace: {point: C, scan: {about: [0, 0]}, assembly: any}
"""
BASES = (0, 1, 0.5 + 0.9j)
CORNERS = (-0.15 - 0.1j, 0.15 - 0.1j, 0.2j)
RPR = """
units: {length: m}
mechanism:
  links:
    ground: {A1: [0, 0], A2: [1, 0], A3: [0.5, 0.9]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.15, -0.1], B2: [0.15, -0.1], B3: [0, 0.2]}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  limits: [{drive: l1, min: 0.3, max: 0.75}, {drive: l2, min: 0.3, max: 0.75}, {drive: l3, min: 0.3, max: 0.75}]
  sketch: {P: [0.52, 0.34], B1: [0.37, 0.24], B2: [0.67, 0.24], B3: [0.52, 0.54]}
workspace: {point: P, at: {platform.angle: [0, 15, -30]}, assembly: any, characteristic_length: 0.2}
"""
CRANK, ROD = 0.4, 0.3
RRR = """
units: {length: m}
mechanism:
  links:
    ground: {A1: [0, 0], A2: [1, 0], A3: [0.5, 0.9]}
    crank_1: [A1, D1, 0.4]
    crank_2: [A2, D2, 0.4]
    crank_3: [A3, D3, 0.4]
    rod_1: [D1, B1, 0.3]
    rod_2: [D2, B2, 0.3]
    rod_3: [D3, B3, 0.3]
    platform: {P: [0, 0], B1: [-0.15, -0.1], B2: [0.15, -0.1], B3: [0, 0.2]}
  drives: {q1: {angle: crank_1}, q2: {angle: crank_2}, q3: {angle: crank_3}}
  sketch:
    {P: [0.5, 0.34], B1: [0.35, 0.24], B2: [0.65, 0.24], B3: [0.5, 0.54], D1: [0.36, -0.05], D2: [0.9, 0.38],
     D3: [0.3, 0.7]}
workspace: {point: P, at: {platform.angle: [0, 20, -30]}, assembly: any, characteristic_length: 0.2}
"""


def legs(low: float, high: float, angle: float):
    """Where P may be for each leg: the corner's annulus about the base, moved by the corner's place on the platform."""
    turn = np.exp(1j * np.radians(angle))
    return [(base - turn * corner, low, high) for base, corner in zip(BASES, CORNERS, strict=True)]


def test_five_bar_reaches_the_intersection_of_two_annuli() -> None:
    """Links 0.25 and 0.40, motors at (+-0.15, 0): 0.799441, as issue 4 gives it; by the arcs in all its digits."""
    exact = common_area([(-0.15, 0.15, 0.65), (0.15, 0.15, 0.65)])
    assert exact == pytest.approx(0.799441, abs=5e-7)
    found = mechdesign.workspace(study_of(FIVE_BAR)).main
    assert found["area"][0] == pytest.approx(exact, rel=1e-6)


def test_five_bar_has_the_published_jacobian() -> None:
    """At (0.05, 0.45) with both elbows out: cond J 1.183957, |det J| 0.062996 (issue 4)."""
    study = study_of(FIVE_BAR)
    motion = mechdesign.kinematics(study).main
    assert 1 / motion["inverse_condition"][0] == pytest.approx(1.183957, abs=5e-7)
    assert abs(motion["det_J"][0]) == pytest.approx(0.062996, abs=5e-7)
    # Independently: J = Jx^-1 Jq of the loops |C - D_i| = const, C. M. Gosselin and J. Angeles (1990).
    place = 0.05 + 0.45j
    rows, cranks = [], []
    for base, side in ((-0.15, 1), (0.15, -1)):
        reach = abs(place - base)
        lift = np.arccos((reach**2 + 0.25**2 - 0.4**2) / (2 * 0.25 * reach))
        elbow = base + 0.25 * np.exp(1j * (np.angle(place - base) + side * lift))
        rod = place - elbow
        rows.append([rod.real, rod.imag])
        cranks.append(np.imag(np.conj(elbow - base) * rod))
    jacobian = np.linalg.solve(rows, np.diag(cranks))
    assert np.linalg.cond(jacobian) == pytest.approx(1 / motion["inverse_condition"][0], rel=1e-12)
    assert abs(np.linalg.det(jacobian)) == pytest.approx(abs(motion["det_J"][0]), rel=1e-12)


@pytest.mark.nightly
def test_three_telescopic_legs_at_several_orientations() -> None:
    """3-RPR: J.-P. Merlet, C. M. Gosselin and N. Mouly, Workspaces of planar parallel manipulators, MMT 33 (1998).

    The constant-orientation workspace is the intersection of three annuli.
    """
    found = mechdesign.workspace(study_of(RPR)).main
    exact = [common_area(legs(0.3, 0.75, angle)) for angle in (0, 15, -30)]
    assert found["area"] == pytest.approx(exact, rel=1e-6)


@pytest.mark.nightly
def test_three_cranks_at_several_orientations() -> None:
    """3-RRR: a leg of two links reaches an annulus too (Merlet, Gosselin and Mouly)."""
    found = mechdesign.workspace(study_of(RRR)).main
    exact = [common_area(legs(CRANK - ROD, CRANK + ROD, angle)) for angle in (0, 20, -30)]
    assert found["area"] == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("annuli", "area"), [
    ([(0, 1, 2)], 3 * np.pi),
    ([(0, 0, 2), (5j, 0, 1)], 0.0),
    ([(0, 0, 2), (0.5, 0, 1)], np.pi),
    ([(0, 0, 1), (1, 0, 1)], 2 * np.pi / 3 - np.sqrt(3) / 2),  # the vesica piscis
])  # fmt: skip
def test_the_arcs_themselves(annuli, area: float) -> None:
    """Areas that are known without arcs, for what the other tests compare with."""
    assert common_area(annuli) == pytest.approx(area, abs=1e-12)


def test_the_arcs_against_counted_points() -> None:
    """The area by a fine grid of points, to its own precision."""
    x, y = np.meshgrid(np.linspace(-0.5, 1.5, 2001), np.linspace(-0.5, 1.5, 2001))
    for angle in (0, 15, -30):
        inside = np.ones(x.shape, dtype=bool)
        for centre, low, high in legs(0.3, 0.75, angle):
            distance = np.abs(x + 1j * y - centre)
            inside &= (distance >= low) & (distance <= high)
        assert common_area(legs(0.3, 0.75, angle)) == pytest.approx(inside.sum() * 1e-6, abs=2e-4)


@pytest.mark.nightly
@pytest.mark.parametrize("measures", ["{}", "{turn: platform.angle*1}"])
def test_a_held_value_that_cannot_be_reached_is_an_empty_row(measures: str) -> None:
    """Whether the inverse problem has a closed form or, for a measure that is an expression, has none."""
    name = "platform.angle" if measures == "{}" else "turn"
    held = f"workspace.at={{{name}: [15, 175]}}"
    changes = [f"mechanism.measures={measures}", held, "workspace.integrate.tolerance=1e-3"]
    result = mechdesign.workspace(study_of(RPR, *changes))
    area = result.tables["indices"]["area"]
    assert area[0] > 0
    assert area[1] == 0
    (warning,) = (warning for warning in map(str, result.warnings) if "nothing is reachable" in warning)
    assert f"{name} = 175" in warning
    with pytest.raises(AssemblyError, match="reaches nothing"):
        mechdesign.workspace(study_of(RPR, changes[0], f"workspace.at={{{name}: [175]}}"))
