"""What ends a region, and the curves of singularities inside and around it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.numerics.zero_curves import joined, zero_curves
from mechdesign.results import Table

FIVE_BAR = """
units: {length: dimensionless}
mechanism:
  links:
    ground: {A: [-0.15, 0], B: [0.15, 0]}
    left: [A, C, 0.25]
    right: [B, D, 0.25]
    fore_left: [C, P, 0.4]
    fore_right: [D, P, 0.4]
  drives: {t1: {angle: left}, t2: {angle: right}}
  sketch: {C: [-0.3, 0.2], D: [0.3, 0.2], P: [0, 0.48]}
workspace: {point: P, scan: {about: [0, 0]}, indices: []}
"""
LEGS = """
units: {length: dimensionless}
mechanism:
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits: [{drive: l1, min: 0.5, max: 2}, {distance: [B2, C], min: 0.5, max: 2}]
  sketch: {C: [0, 1.2]}
workspace: {point: C, scan: {about: [0, 0]}, indices: []}
"""
ARM = """
units: {length: dimensionless}
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 1.5], lower: [E, P, 1]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  limits: [{drive: q1, min: -40, max: 100}]
  sketch: {E: [1, 1], P: [2, 1]}
workspace: {point: P, scan: {about: [0, 0]}, indices: []}
"""
# Lines of a grid, on none of which a known function has a root.
LINES = np.linspace(-1.05, 1, 40)
PLATFORM = Path(__file__).parents[2] / "configs" / "planar_3rpr.yaml"


def each(table: Table) -> list[tuple[str, str, np.ndarray]]:
    """Kind, cause and points of each curve."""
    z = table["x"] + 1j * table["y"]
    found = []
    for curve in np.unique(table["curve"]):
        rows = table["curve"] == curve
        assert len(set(zip(table["kind"][rows], table["cause"][rows], strict=True))) == 1
        found.append((table["kind"][rows][0], table["cause"][rows][0], z[rows]))
    return found


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[0.05, 0.45]"])
def test_forward_singularities_of_a_five_bar(about: str) -> None:
    """Both forearms in line: with elbows out, both on the same side of P, so that the elbows meet at (0, +-0.2).

    P is then at 0.4 from there, up to where a leg is folded or stretched: 0.15 or 0.65 from its motor.
    """
    study = study_of(FIVE_BAR, "workspace.assembly=any", f"workspace.scan.about={about}")
    curves = each(mechdesign.workspace(study).tables["singularities"])
    forward = [z for kind, cause, z in curves if (kind, cause) == ("forward", "fore_left-fore_right in line")]
    assert len(forward) == 2
    for z, elbows, depth in zip(sorted(forward, key=lambda z: -z.imag.max()), (0.2j, -0.2j), (0.12, 0.52), strict=True):
        assert np.abs(z - elbows) == pytest.approx(np.full(len(z), 0.4), abs=1e-9)
        assert sorted(z[[0, -1]], key=lambda end: end.real) == pytest.approx(
            [-0.24 - depth * 1j, 0.24 - depth * 1j], abs=1e-8
        )
        # In order: no step is far longer than those beside it, and none leads back.
        steps = np.abs(np.diff(z))
        assert steps.max() < 0.1 * steps.sum()
        assert steps.sum() == pytest.approx(2 * 0.4 * np.arcsin(0.24 / 0.4), rel=1e-3)


@pytest.mark.nightly
def test_they_bound_the_region_of_one_assembly() -> None:
    """The same curves, now told as the boundary: to the corners where a leg is folded or stretched as well."""
    tables = {
        assembly: mechdesign.workspace(study_of(FIVE_BAR, f"workspace.assembly={assembly}")).tables
        for assembly in ("any", "same")
    }
    edge = tables["same"]["boundary"]
    rows = edge["at"] == "fore_left-fore_right in line"
    assert rows.any()
    assert set(edge["kind"][rows]) == {"singularity"}
    lengths = {
        assembly: sum(np.abs(np.diff(z)).sum() for kind, _, z in each(given["singularities"]) if kind == "forward")
        for assembly, given in tables.items()
    }
    assert lengths["same"] == pytest.approx(lengths["any"], rel=5e-3)


@pytest.mark.slow
def test_inverse_singularities_lie_where_a_leg_is_stretched_or_folded() -> None:
    curves = each(mechdesign.workspace(study_of(FIVE_BAR, "workspace.assembly=any")).tables["singularities"])
    told = {"left-fore_left": -0.15, "right-fore_right": 0.15}
    inverse = [(cause, z) for kind, cause, z in curves if kind == "inverse"]
    assert {cause for cause, _ in inverse} == {f"{leg} {how}" for leg in told for how in ("stretched", "folded")}
    for cause, z in inverse:
        leg, how = cause.split()
        assert np.abs(z - told[leg]) == pytest.approx(np.full(len(z), 0.65 if how == "stretched" else 0.15), abs=1e-9)


@pytest.mark.slow
def test_two_legs_in_line_along_a_ray_of_the_scan() -> None:
    """The line through both bases: a ray runs along it, where the function is zero but for rounding."""
    curves = each(mechdesign.workspace(study_of(LEGS, "workspace.assembly=any")).tables["singularities"])
    forward = [z for kind, cause, z in curves if (kind, cause) == ("forward", "leg_1-leg_2 in line")]
    # Between the bases and the rings about them: from -0.5 to 0.5, the whole of what the rings leave of the line.
    z = np.concatenate(forward)
    assert np.abs(z.imag).max() < 1e-9
    assert (z.real.min(), z.real.max()) == pytest.approx((-0.5, 0.5), abs=1e-5)
    assert sum(abs(z[-1] - z[0]) for z in forward) == pytest.approx(1, abs=1e-4)


@pytest.mark.slow
def test_limits_are_named_by_what_they_limit() -> None:
    edge = mechdesign.workspace(study_of(LEGS, "workspace.assembly=any")).tables["boundary"]
    assert set(edge["at"]) == {"l1 min", "l1 max", "B2-C min", "B2-C max"}
    assert set(edge["kind"]) == {"limit"}
    z = edge["x"] + 1j * edge["y"]
    for name, base, length in (("l1 min", 1, 0.5), ("l1 max", 1, 2), ("B2-C min", -1, 0.5), ("B2-C max", -1, 2)):
        rows = edge["at"] == name
        assert np.abs(z[rows] - base) == pytest.approx(np.full(rows.sum(), length), abs=1e-9)


@pytest.mark.slow
def test_every_boundary_point_of_an_arm_says_why() -> None:
    """Stretched and folded on circles about the base; the joint limit's arcs on circles about the held elbow."""
    edge = mechdesign.workspace(study_of(ARM)).tables["boundary"]
    assert set(edge["at"]) == {"upper-lower stretched", "upper-lower folded", "q1 range"}
    # The ends of curves are corners, at which two reasons meet.
    inner = np.append(False, np.diff(edge["curve"]) == 0) & np.append(np.diff(edge["curve"]) == 0, False)
    z = edge["x"] + 1j * edge["y"]
    for name, radius in (("upper-lower stretched", 2.5), ("upper-lower folded", 0.5)):
        rows = (edge["at"] == name) & inner
        assert set(edge["kind"][rows]) == {"singularity"}
        assert np.abs(z[rows]) == pytest.approx(np.full(rows.sum(), radius), abs=1e-9)
    rows = (edge["at"] == "q1 range") & inner
    elbows = 1.5 * np.exp(1j * np.radians([-40, 100]))
    gaps = np.abs(np.abs(z[rows][:, None] - elbows) - 1).min(axis=1)
    assert gaps.max() < 1e-9


def test_parallel_singularities_of_a_platform() -> None:
    """The lines of its three legs meet in one point (or are parallel): their moments depend on each other."""
    limits = (
        "mechanism.limits=[{drive: l1, min: 0.4, max: 1.4}, {drive: l2, min: 0.4, max: 1.4}, {drive: l3, max: 1.6}]"
    )
    section = "workspace={point: P, at: {platform.angle: [10]}, characteristic_length: 0.2, assembly: any, indices: []}"
    curves = each(mechdesign.workspace(mechdesign.load(PLATFORM, [limits, section])).tables["singularities"])
    forward = [z for kind, _, z in curves if kind == "forward"]
    assert forward
    turn = np.exp(1j * np.radians(10))
    for z in forward:
        tips = z[:, None] + turn * np.array([-0.2, 0.2, 0.25 + 0.15j])
        legs = tips - np.array([-0.6, 0.6, 0.3 - 0.2j])
        legs /= np.abs(legs)
        moments = (np.conj(tips - z[:, None]) * legs).imag
        rows = np.stack([legs.real, legs.imag, moments], axis=-1)
        assert np.abs(np.linalg.det(rows)).max() < 1e-9


def zeros(function: Callable[[np.ndarray], np.ndarray]) -> list[np.ndarray]:
    """Curves on which a function of the plane is zero, by a grid of 40 lines each way over a square."""

    def place(row: np.ndarray, column: np.ndarray) -> np.ndarray:
        return np.interp(row, np.arange(40), LINES) + 1j * np.interp(column, np.arange(40), LINES)

    found = zero_curves(function(LINES[:, None] + 1j * LINES), lambda row, column: function(place(row, column)))
    return joined([place(*lines) for lines in found], 1e-9)


def test_zero_curves_of_known_functions() -> None:
    """A circle closes and lies on its radius; two crossing lines are four branches put in order."""
    (circle,) = zeros(lambda z: np.abs(z) - 0.7)
    assert circle[0] == circle[-1]
    assert np.abs(circle) == pytest.approx(np.full(len(circle), 0.7), abs=1e-12)
    assert np.abs(np.diff(circle)).sum() == pytest.approx(2 * np.pi * 0.7, rel=2e-3)
    lines = zeros(lambda z: (z**2).imag - 0.01)
    assert len(lines) == 2
    for z in lines:
        assert (z**2).imag == pytest.approx(np.full(len(z), 0.01), abs=1e-12)


def test_many_short_curves_are_joined() -> None:
    """A circle in 500 stretches, in any order and direction; a single point is none."""
    random = np.random.default_rng(3)
    turn = np.exp(2j * np.pi * np.arange(5001) / 5000)
    turn[-1] = turn[0]
    parts = [turn[10 * k : 10 * k + 11][:: random.choice([-1, 1])] for k in random.permutation(500)]
    (loop,) = joined([np.array([2.0 + 0j]), *parts], 1e-9)
    assert len(loop) == 5001
    assert loop[0] == loop[-1]
    assert np.abs(np.diff(loop)) == pytest.approx(np.full(5000, 2 * np.sin(np.pi / 5000)), rel=1e-9)


def test_a_dip_above_zero_and_a_pole_are_no_curves() -> None:
    assert zeros(lambda z: (np.abs(z) - 0.7) ** 2 + 1e-6) == []
    assert zeros(lambda z: 1 / (z.real - 0.111)) == []


def test_a_curve_ends_where_the_function_does() -> None:
    """A circle of which only the upper half is known."""
    (arc,) = zeros(lambda z: np.where(z.imag > -1e-9, np.abs(z) - 0.7, np.nan))
    assert np.abs(arc) == pytest.approx(np.full(len(arc), 0.7), abs=1e-12)
    assert np.abs(np.diff(arc)).sum() == pytest.approx(np.pi * 0.7, abs=0.1)


def test_a_line_along_the_grid() -> None:
    """Zero at the nodes of one of the grid's lines."""
    (line,) = zeros(lambda z: z.real - LINES[7])
    assert line.real == pytest.approx(np.full(len(line), LINES[7]), abs=1e-12)
    assert abs(line[-1] - line[0]) == pytest.approx(2.05, abs=1e-9)


@pytest.mark.parametrize("width", [0.3, 0.09])
def test_two_curves_two_lines_apart(width: float) -> None:
    """Concentric circles: both whole."""
    found = zeros(lambda z: (np.abs(z) - 0.7) ** 2 - (width / 2) ** 2)
    assert len(found) == 2
    for z, radius in zip(sorted(found, key=lambda z: abs(z[0])), (0.7 - width / 2, 0.7 + width / 2), strict=True):
        assert z[0] == z[-1]
        assert np.abs(z) == pytest.approx(np.full(len(z), radius), abs=1e-12)


def test_curves_that_cross() -> None:
    """Two lines that part by a half: both but for the crossing's cells, whichever branches are told as one."""
    found = zeros(lambda z: (z.imag - 0.011 - 0.25 * z.real) * (z.imag - 0.011 + 0.25 * z.real))
    assert len(found) == 2
    for z in found:
        assert np.abs(z.imag - 0.011) == pytest.approx(0.25 * np.abs(z.real), abs=1e-12)
    assert sum(np.abs(np.diff(z)).sum() for z in found) == pytest.approx(2 * 2.05 * np.hypot(1, 0.25), rel=5e-2)


@pytest.mark.nightly
def test_parallel_singularities_of_a_platform_are_a_conic() -> None:
    """With the platform held the determinant of the legs' lines is quadratic: its six coefficients from six points."""
    limits = (
        "mechanism.limits=[{drive: l1, min: 0.4, max: 1.4}, {drive: l2, min: 0.4, max: 1.4}, {drive: l3, max: 1.6}]"
    )
    held = "at: {platform.angle: [-25]}, characteristic_length: 0.2"
    section = f"workspace={{point: P, {held}, assembly: any, indices: []}}"
    curves = each(mechdesign.workspace(mechdesign.load(PLATFORM, [limits, section])).tables["singularities"])
    corners = np.exp(1j * np.radians(-25)) * np.array([-0.2, 0.2, 0.25 + 0.15j])

    def determinant(z: np.ndarray) -> np.ndarray:
        legs = z[:, None] + corners - np.array([-0.6, 0.6, 0.3 - 0.2j])
        return np.linalg.det(np.stack([legs.real, legs.imag, (np.conj(corners) * legs).imag], axis=-1))

    def powers(z: np.ndarray) -> np.ndarray:
        return np.stack([z.real**2, z.real * z.imag, z.imag**2, z.real, z.imag, np.ones(len(z))], axis=-1)

    six = np.array([0, 1, 1j, 1 + 1j, -1, -1j])
    conic = np.linalg.solve(powers(six), determinant(six))
    forward = [z for kind, _, z in curves if kind == "forward"]
    assert forward
    for z in forward:
        assert np.abs(powers(z) @ conic).max() < 1e-9
    # Each ends where a leg is at its limit: no part is missing.
    lengths = np.abs(
        np.concatenate([z[[0, -1]] for z in forward])[:, None] + corners - np.array([-0.6, 0.6, 0.3 - 0.2j])
    )
    at_limit = np.abs(lengths[:, :, None] - np.array([0.4, 1.4, 1.6])).min(axis=(1, 2))
    assert at_limit == pytest.approx(np.zeros(len(at_limit)), abs=1e-8)
