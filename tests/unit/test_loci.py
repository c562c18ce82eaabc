"""What ends a region, and the curves of singularities inside and around it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

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
PLATFORM = Path(__file__).parents[2] / "configs" / "planar_3rpr.yaml"


def each(table: mechdesign.Table) -> list[tuple[str, str, np.ndarray]]:
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


@pytest.mark.nightly
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


@pytest.mark.nightly
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
