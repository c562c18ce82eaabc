"""Regions in any assembly: every way of putting the legs together within the limits, against legs solved here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

ARM = """
mechanism:
  parameters: {l2: 70}
  links: {ground: {O: [0, 0]}, upper: [O, A, 100], lower: [A, P, l2]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  limits: [{drive: q1, min: 10, max: 60}, {drive: q2, min: -60, max: 70}]
  sketch: {A: [80, 60], P: [100, 127]}
workspace: {point: P, assembly: any}
"""
Complexes = np.ndarray


class Leg(NamedTuple):
    """A driven crank on the ground and a rod to a corner of the platform."""

    base: complex
    crank: float
    rod: float
    side: int
    low: float
    width: float
    corner: complex = 0j

    def elbow(self, point: Complexes, side: int) -> Complexes:
        """Its elbow on one side, nan where it does not reach."""
        way = point + self.corner - self.base
        with np.errstate(invalid="ignore"):
            bend = np.arccos((self.crank**2 + np.abs(way) ** 2 - self.rod**2) / (2 * self.crank * np.abs(way)))
        return np.asarray(self.base + self.crank * np.exp(1j * (np.angle(way) + side * bend)))

    def allowed(self, elbow: Complexes) -> np.ndarray:
        """Where it reaches and its crank is within the limits."""
        turned = (np.degrees(np.angle(elbow - self.base)) - self.low) % 360
        return np.isfinite(elbow) & (turned <= self.width)


def told(z: complex) -> str:
    return f"[{z.real:.17g}, {z.imag:.17g}]"


def text_of(legs: list[Leg], point: complex) -> str:
    """A study of legs to a platform that does not turn; of two legs to the point itself."""
    names, platform, at = range(len(legs)), "", ""
    if any(leg.corner for leg in legs):
        platform = f"    platform: {{P: [0, 0], {', '.join(f'C{k}: {told(legs[k].corner)}' for k in names)}}}"
        at = "at: {platform.angle: 0}, characteristic_length: 60, "
    ends = [f"C{k}" if platform else "P" for k in names]
    drawn = [f"D{k}: {told(complex(leg.elbow(np.array(point), leg.side)))}" for k, leg in enumerate(legs)]
    drawn += [f"C{k}: {told(point + leg.corner)}" for k, leg in enumerate(legs) if platform]
    return f"""
mechanism:
  links:
    ground: {{{", ".join(f"O{k}: {told(leg.base)}" for k, leg in enumerate(legs))}}}
{chr(10).join(f"    crank_{k}: [O{k}, D{k}, {leg.crank:.17g}]" for k, leg in enumerate(legs))}
{chr(10).join(f"    rod_{k}: [D{k}, {ends[k]}, {leg.rod:.17g}]" for k, leg in enumerate(legs))}
{platform}
  drives: {{{", ".join(f"q{k}: {{angle: crank_{k}}}" for k in names)}}}
  limits:
{chr(10).join(f"    - {{drive: q{k}, min: {g.low:.17g}, max: {g.low + g.width:.17g}}}" for k, g in enumerate(legs))}
  sketch: {{{", ".join(drawn)}, P: {told(point)}}}
workspace: {{point: P, {at}assembly: any, indices: [inverse_condition]}}
"""


def random_legs(seed: int, corners: list[complex]) -> tuple[list[Leg], complex]:
    """Legs with limits of 20 to 180 deg about a drawn pose."""
    rng = np.random.default_rng(seed)
    count = len(corners)
    bases = 90 * np.exp(2j * np.pi * np.arange(count) / count) + rng.uniform(-25, 25, (2, count)).T @ [1, 1j]
    lengths, sides = rng.uniform(70, 130, (count, 2)), rng.choice([-1, 1], count)
    while True:
        point = complex(*rng.uniform(-120, 120, 2))
        legs = [Leg(complex(b), *size, int(s), 0.0, 0.0, c)
                for b, size, s, c in zip(bases, lengths, sides, corners, strict=True)]  # fmt: skip
        elbows = [leg.elbow(np.array(point), leg.side) for leg in legs]
        if np.isfinite(elbows).all():
            break
    widths, shares = rng.uniform(20, 180, count), rng.uniform(0.1, 0.9, count)
    lows = [np.degrees(np.angle(e - leg.base)) - w * s
            for e, leg, w, s in zip(elbows, legs, widths, shares, strict=True)]  # fmt: skip
    return [leg._replace(low=float(v), width=float(w)) for leg, v, w in zip(legs, lows, widths, strict=True)], point


def raster(legs: list[Leg], cells: int) -> tuple[float, float]:
    """Area, and the mean of the inverse condition number, each leg with the sketch's elbow where that is allowed."""
    reach = [(leg.base - leg.corner, leg.crank + leg.rod) for leg in legs]
    low = complex(max(z.real - r for z, r in reach), max(z.imag - r for z, r in reach))
    size = complex(min(z.real + r for z, r in reach), min(z.imag + r for z, r in reach)) - low
    steps = (np.arange(cells) + 0.5) / cells
    z = low + size.real * steps + 1j * size.imag * steps[:, None]
    good, elbows = np.ones(z.shape, dtype=bool), []
    for leg in legs:
        own, other = leg.elbow(z, leg.side), leg.elbow(z, -leg.side)
        first = leg.allowed(own)
        good &= first | leg.allowed(other)
        elbows.append(np.where(first, own, other))
    # A rod's length stays: its direction times the rate of the platform is that times the rate of its elbow.
    place, rows, rates = z[good], [], []
    for leg, elbow in zip(legs, elbows, strict=True):
        rod, crank = place + leg.corner - elbow[good], elbow[good] - leg.base
        moment = (rod * np.conj(1j * leg.corner)).real / 60
        rows.append(np.stack([rod.real, rod.imag, moment][: len(legs)], axis=-1))
        rates.append((rod * np.conj(1j * crank)).real)
    jacobian = np.linalg.solve(np.stack(rows, axis=1), np.eye(len(legs)) * np.stack(rates, axis=-1)[:, None])
    sizes = np.linalg.svd(jacobian, compute_uv=False)
    return good.sum() * size.real * size.imag / cells**2, float((sizes[:, -1] / sizes[:, 0]).mean())


def test_both_elbows_of_an_arm_with_limits_count() -> None:
    """In polar coordinates about the shoulder: at each radius the arcs of both elbows, and what both reach once."""
    found = mechdesign.workspace(study_of(ARM, "workspace.indices=[]")).main
    q2 = np.linspace(0, np.radians(70), 200_001)
    hand = 100 + 70 * np.exp(1j * q2)
    # The elbow's arc is 50 deg wide and begins at the hand's direction; that of the other at minus this, to 60 deg.
    apart = 2 * np.angle(hand)
    arc = np.where(q2 <= np.radians(60), np.minimum(apart, np.radians(50)), 0.0) + np.radians(50)
    radius = np.abs(hand)
    exact = -np.sum(0.5 * (arc[1:] * radius[1:] + arc[:-1] * radius[:-1]) * np.diff(radius))
    assert found["area"][0] == pytest.approx(exact, rel=1e-6)
    assert exact == pytest.approx(5969.6, abs=0.05)


@pytest.mark.nightly
def test_the_boundary_and_the_pictures_of_an_arm_have_the_elbow_that_counts_there() -> None:
    result = mechdesign.workspace(study_of(ARM))
    edge = result.tables["boundary"]
    assert (edge["q1"] >= 10 - 1e-6).all()
    assert (edge["q1"] <= 60 + 1e-6).all()
    assert edge["q2"].min() == pytest.approx(-60, abs=1e-6)
    assert edge["q2"].max() == pytest.approx(70, abs=1e-6)
    assert set(zip(edge["kind"], edge["at"], strict=True)) == {
        ("limit", "q1 range"), ("limit", "q2 range"), ("singularity", "upper-lower stretched"),
    }  # fmt: skip
    # Both sides of where the elbow changes hang together.
    assert "pieces" not in result.tables
    assert (result.tables["local"]["piece"] == 1).all()


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(6))
def test_five_bars_count_both_elbows_of_each_leg(seed: int) -> None:
    legs, point = random_legs(seed, [0j, 0j])
    area, mean = raster(legs, 1500)
    found = mechdesign.workspace(study_of(text_of(legs, point))).main
    assert found["area"][0] == pytest.approx(area, rel=1e-3)
    assert found["GII"][0] == pytest.approx(mean, rel=1e-3)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(2))
def test_platforms_count_both_elbows_of_each_leg(seed: int) -> None:
    corners = [complex(z) for z in 40 * np.exp(2j * np.pi * np.arange(3) / 3)]
    legs, point = random_legs(100 + seed, corners)
    area, mean = raster(legs, 1200)
    found = mechdesign.workspace(study_of(text_of(legs, point))).main
    assert found["area"][0] == pytest.approx(area, rel=2e-3)
    assert found["GII"][0] == pytest.approx(mean, rel=2e-3)


@pytest.mark.nightly
def test_a_sliver_that_one_elbow_alone_reaches() -> None:
    """l1 l2 (cos 4 - cos 8.4) dq1 of an arm that is nearly stretched, by the sketch's elbow; the other has no place."""
    limits = "mechanism.limits=[{drive: q1, min: 42.5, max: 54}, {drive: q2, min: 4.1, max: 8.4}]"
    elbow, hand = 62 * np.exp(1j * np.radians(44)), 77 * np.exp(1j * np.radians(52))
    sketch = f"mechanism.sketch={{A: {told(elbow)}, P: {told(elbow + hand)}}}"
    links = "mechanism.links={ground: {O: [0, 0]}, upper: [O, A, 62], lower: [A, P, 77]}"
    found = mechdesign.workspace(study_of(ARM.replace("  parameters: {l2: 70}\n", ""), limits, sketch, links)).main
    exact = 62 * 77 * np.radians(11.5) * (np.cos(np.radians(4.1)) - np.cos(np.radians(8.4)))
    assert abs(found["area"][0] - exact) <= found["area_error"][0] + 1e-6 * exact


@pytest.mark.nightly
def test_designs_of_many_count_the_elbows_that_a_single_one_counts() -> None:
    designs = mechdesign.optimize(
        study_of(ARM, "optimize={variables: {l2: {from: 50, to: 90, step: 20}}, maximize: [area, GII]}")
    ).tables["designs"]
    for length, area, index in zip(designs["l2"], designs["area"], designs["GII"], strict=True):
        alone = mechdesign.workspace(study_of(ARM, f"mechanism.parameters.l2={length}")).main
        assert area == pytest.approx(alone["area"][0], rel=1e-6)
        assert index == pytest.approx(alone["GII"][0], rel=1e-4)


@pytest.mark.nightly
def test_poses_of_other_questions_keep_the_elbow_of_the_sketch() -> None:
    """Within its limits, 0 to 70 deg: the other elbow is reached in the workspace alone."""
    poses = mechdesign.kinematics(study_of(ARM, "kinematics={outputs: [P], poses: workspace}")).main
    assert poses["valid"].all()
    assert poses["q2"].min() > -1e-3
    assert poses["q2"].max() == pytest.approx(70, abs=0.1)


@pytest.mark.slow
def test_a_point_on_one_path_has_those_of_both_sides_of_the_rocker() -> None:
    """A point on the line of the coupler: with the rocker on the other side its path is the mirror image."""
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rocker: [D, B, 60], rod: {from: A, to: B, length: 90,
    points: {P: [40, 0]}}}
  drives: {q: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
workspace: {point: P}
"""
    one = mechdesign.workspace(study_of(text)).tables["indices"]
    both = mechdesign.workspace(study_of(text, "workspace.assembly=any")).tables["indices"]
    assert len(one) == 1
    assert both["length"] == pytest.approx(np.full(2, one["length"][0]), rel=1e-9)
    assert both["box_y"][1] == pytest.approx(-both["box_y"][0] - both["box_height"][0], rel=1e-9)
