"""Workspaces of closed chains: intersections of annuli, one a leg, whose exact area is summed along circular arcs."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.circles import common_area
from helpers.studies import study_of

import mechdesign
from mechdesign.ground.errors import AssemblyError

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


def legs(low: float, high: float, angle: float):
    """Where P may be for each leg: the corner's annulus about the base, moved by the corner's place on the platform."""
    turn = np.exp(1j * np.radians(angle))
    return [(base - turn * corner, low, high) for base, corner in zip(BASES, CORNERS, strict=True)]


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
