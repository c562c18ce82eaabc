"""Any region: holes, several pieces, crescents, and tangent rays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.circles import common_area
from helpers.studies import study_of

import mechdesign
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.panels import find_panels
from mechdesign.region.rays import BATCH, SINGLE, Effort, Scanned, trace

ARM = """
units: {length: dimensionless}
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 1.5], lower: [E, P, 1]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  limits: [{drive: q1, min: -40, max: 100}, {drive: q2, min: -170, max: -10}]
  sketch: {E: [1, 1], P: [2, 1]}
workspace: {point: P, scan: {about: [0, 0]}, indices: []}
"""
FIVE_BAR = """
units: {length: dimensionless}
mechanism:
  parameters: {a: 0.25, b: 0.4, h: 0.15}
  links:
    ground: {A: [-h, 0], B: [h, 0]}
    left: [A, C, a]
    right: [B, D, a]
    fore_left: [C, P, b]
    fore_right: [D, P, b]
  drives: {t1: {angle: left}, t2: {angle: right}}
  sketch: {C: [-0.3, 0.2], D: [0.3, 0.2], P: [0, 0.48]}
workspace: {point: P, scan: {about: [0, 0]}, assembly: any, indices: []}
"""
LEGS = """
units: {length: dimensionless}
mechanism:
  parameters: {low: 1, high: 3}
  measures: {d: C.x*C.y}
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits: [{drive: l1, min: low, max: high}, {drive: l2, min: low, max: high}]
  sketch: {C: [0, 1.8]}
workspace: {point: C, scan: {about: [0, 0]}, assembly: any, indices: []}
"""
PLATFORM = Path(__file__).parents[2] / "configs" / "planar_3rpr.yaml"
STROKES = (
    "mechanism.limits=[{drive: l1, min: 0.4, max: 1.4}, {drive: l2, min: 0.4, max: 1.4}, "
    "{drive: l3, min: 0.3, max: 1.6}]"
)
SAMPLES = 400_000


def area(text: str, *overrides: str) -> tuple[float, float]:
    main = mechdesign.workspace(study_of(text, *overrides)).main
    return float(main["area"][0]), float(main["area_error"][0])


def by_chance(inside: np.ndarray, box: float) -> tuple[float, float]:
    """Area by uniform samples in a box, and four standard deviations."""
    part = inside.mean()
    return box * part, 4 * box * np.sqrt(part * (1 - part) / inside.size)


def uniform(half: float) -> np.ndarray:
    random = np.random.default_rng(5)
    return random.uniform(-half, half, SAMPLES) + 1j * random.uniform(-half, half, SAMPLES)


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[1.2, 0.3]", "[-0.7, 0.9]", "[6, 1]"])
def test_crescent_of_an_arm_with_joint_limits(about: str) -> None:
    """dA = a b |sin q2| dq1 dq2, seen from anywhere: thin parts along the rays and between them are met."""
    found, error = area(ARM, f"workspace.scan.about={about}")
    exact = 1.5 * np.radians(140) * 2 * np.cos(np.radians(10))
    assert found == pytest.approx(exact, rel=1e-6)
    assert error < 1e-5 * exact


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[1, 1]"])
def test_joint_limits_just_short_of_a_turn(about: str) -> None:
    """Half a degree short of stretched and folded, and a narrow gap all across: slivers wherever one looks from."""
    limits = "mechanism.limits=[{drive: q1, min: -150, max: 170}, {drive: q2, min: -179, max: -1}]"
    found, _ = area(ARM, limits, f"workspace.scan.about={about}")
    assert found == pytest.approx(1.5 * np.radians(320) * 2 * np.cos(np.radians(1)), rel=1e-7)


@pytest.mark.nightly
def test_a_limit_of_the_forearm_gives_two_arcs_and_their_sweep() -> None:
    """The forearm within 120 deg of the world: the elbow's circle moved along, with the elbow on one side only."""
    limits = "mechanism.limits=[{angle: [ground, lower], min: -60, max: 60}]"
    found, _ = area(ARM, limits, "workspace.scan.about=[3, 0.5]")
    # a b times the integral of |sin(q2)| over q2 < 0, q1 + q2 within the range: 1.5 (2 pi / 3) 2.
    assert found == pytest.approx(1.5 * 2 * np.pi / 3 * 2, rel=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[0.05, 0.45]", "[0.6, 0.3]"])
def test_five_bar_with_holes(about: str) -> None:
    """Common part of two rings about the motors: a known area, seen from the hole, from inside, outside."""
    found, error = area(FIVE_BAR, f"workspace.scan.about={about}")
    assert found == pytest.approx(0.799441, abs=5e-7)
    assert error < 1e-6


@pytest.mark.nightly
def test_five_bar_cut_by_limits_and_singularities() -> None:
    """Against samples whose legs are solved here: both elbows of each, motors within limits."""
    limits = "mechanism.limits=[{drive: t1, min: 30, max: 200}, {drive: t2, min: -20, max: 150}]"
    found, error = area(FIVE_BAR, limits)
    z = uniform(0.85)
    good = np.ones(z.shape, dtype=bool)
    for base, low, high in ((-0.15, 30, 200), (0.15, -20, 150)):
        k = z - base
        cosine = (0.25**2 + np.abs(k) ** 2 - 0.4**2) / (2 * 0.25 * np.abs(k))
        angles = np.angle(k) + np.array([[1], [-1]]) * np.arccos(np.clip(cosine, -1, 1))
        within = np.radians(high - low) > (angles - np.radians(low)) % (2 * np.pi)
        good &= (np.abs(cosine) < 1) & within.any(axis=0)
    guess, doubt = by_chance(good, 1.7**2)
    assert abs(found - guess) < doubt + error


def lens(one: float, two: float, apart: float) -> float:
    """Common part of two discs."""
    if one + two <= apart:
        return 0.0
    if apart <= abs(one - two):
        return float(np.pi * min(one, two) ** 2)
    a = np.arccos((apart**2 + one**2 - two**2) / (2 * apart * one))
    b = np.arccos((apart**2 + two**2 - one**2) / (2 * apart * two))
    return float(one**2 * (a - np.sin(2 * a) / 2) + two**2 * (b - np.sin(2 * b) / 2))


def rings(low: float, high: float) -> float:
    """Common part of two rings about places 2 apart."""
    return lens(high, high, 2) - 2 * lens(low, high, 2) + lens(low, low, 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("low", "high", "about"),
    [
        (1, 3, "[0, 0]"),
        (1, 3, "[1, 0]"),
        (1, 3, "[2, 0]"),
        (1, 3, "[30, 0.1]"),
        (1.2, 1.3, "[0, 0]"),
        (1.2, 1.3, "[0, 0.66]"),
        (1.2, 1.3, "[0.3, 0.1]"),
        (0.5, 1.5, "[1.5, 0]"),
        (0.5, 1.8, "[0.5, 0]"),
        (0.9, 1.001, "[0, 0]"),
    ],
)
def test_common_part_of_two_rings(low: float, high: float, about: str) -> None:
    """Two pieces or one, from inside, outside, a base, a corner, and where rays touch the circles."""
    found, _ = area(LEGS, f"mechanism.parameters={{low: {low}, high: {high}}}", f"workspace.scan.about={about}")
    assert found == pytest.approx(rings(low, high), rel=1e-7)


@pytest.mark.nightly
def test_a_band_of_a_measure_leaves_pieces() -> None:
    limits = (
        "mechanism.limits=[{drive: l1, min: low, max: high}, {drive: l2, min: low, max: high}, "
        "{measure: d, min: 0.1, max: 0.8}]"
    )
    found, error = area(LEGS, limits)
    z = uniform(3)
    one, two, product = np.abs(z - 1), np.abs(z + 1), z.real * z.imag
    good = (one > 1) & (one < 3) & (two > 1) & (two < 3) & (product > 0.1) & (product < 0.8)
    guess, doubt = by_chance(good, 36)
    assert abs(found - guess) < doubt + error


@pytest.mark.nightly
@pytest.mark.parametrize("low", [0, -60])
def test_a_limit_on_half_an_angle(low: float) -> None:
    """The angle lies within half a turn of the sketch's: at -53 deg its half jumps from -27 to 153, elbow out.

    From 0 to 60 the limit ends the region where it is zero; from -60 also where it jumps, and no circle is found there.
    """
    limit = f"mechanism.limits=[{{measure: half, min: {low}, max: 60}}]"
    result = mechdesign.workspace(study_of(FIVE_BAR, "mechanism.measures={half: left.angle/2}", limit))
    z, a, b, drawn = uniform(0.7), 0.25, 0.4, np.arctan2(0.2, -0.15)
    one, other = np.abs(z + 0.15), np.abs(z - 0.15)
    bend = np.arccos(np.clip((a**2 + one**2 - b**2) / (2 * a * one), -1, 1))
    # The sketch's point is where its drives put it; with the other elbow the crank lies beyond the line to it.
    elbow = -0.15 + a * np.exp(1j * drawn)
    point = 1j * (elbow.imag + np.sqrt(b**2 - elbow.real**2))
    mirrored = 2 * np.angle(point + 0.15) - drawn
    kept = np.zeros(z.shape, dtype=bool)
    for side, near in ((1, drawn), (-1, mirrored)):
        angle = np.angle(z + 0.15) + side * bend
        half = np.degrees(angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))) / 2
        kept |= (low <= half) & (half <= 60)
    legs = (one <= a + b) & (one >= b - a) & (other <= a + b) & (other >= b - a)
    guess, doubt = by_chance(legs & kept, 1.4**2)
    assert abs(result.main["area"][0] - guess) < doubt
    found = np.isfinite(result.main["circle_radius"][0])
    assert found or any("jumps" in warning for warning in map(str, result.warnings))


@pytest.mark.nightly
@pytest.mark.parametrize("degrees", [-15, 0, 10, 40])
def test_a_platform_at_constant_orientation(degrees: float) -> None:
    """The common part of three rings about the bases moved by the platform's points: area by arcs."""
    at = f"at: {{platform.angle: {degrees}}}, characteristic_length: 0.2"
    section = f"workspace={{point: P, {at}, assembly: any, indices: []}}"
    found = mechdesign.workspace(mechdesign.load(PLATFORM, [STROKES, section])).main
    turn = np.exp(1j * np.radians(degrees))
    centres = np.array([-0.6, 0.6, 0.3 - 0.2j]) - turn * np.array([-0.2, 0.2, 0.25 + 0.15j])
    strokes = ((0.4, 1.4), (0.4, 1.4), (0.3, 1.6))
    rings_there = [(complex(c), low, high) for c, (low, high) in zip(centres, strokes, strict=True)]
    assert found["area"][0] == pytest.approx(common_area(rings_there), rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("effort", [BATCH, SINGLE], ids=["batch", "single"])
@pytest.mark.parametrize("assembly", ["any", "same"])
def test_panels_end_at_corners_and_where_rays_touch(assembly: str, effort: Effort) -> None:
    """The rays that touch the holes, of radius b - a about A and B, and those through where the outer circles meet."""
    about, one, other, hole, reach = 0.05 + 0.45j, -0.15, 0.15, 0.15, 0.65
    study = study_of(FIVE_BAR, f"workspace.assembly={assembly}", "workspace.scan.about=[0.05, 0.45]")
    question = questions(study)[0]
    panels = find_panels(Scanned(question.field, {}, 1, about, question.scan, effort))
    ends = np.concatenate([panels.low, panels.high])
    touching = [np.angle(one - about) - np.arcsin(hole / abs(one - about)),
                np.angle(other - about) + np.arcsin(hole / abs(other - about))]  # fmt: skip
    corners = [np.angle(k * np.sqrt(reach**2 - 0.15**2) * 1j - about) for k in (1, -1)]
    for angle in [*touching, *(corners if assembly == "any" else corners[:1])]:
        assert np.abs((ends - angle + np.pi) % (2 * np.pi) - np.pi).min() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("effort", [BATCH, SINGLE], ids=["batch", "single"])
def test_holes_smaller_than_a_cell_of_the_raster(effort: Effort) -> None:
    text = """
mechanism:
  links: {ground: {O: [0, 0], W: [7.1, 3.3], V: [-4.4, 6.2], U: [-6.3, -5.9]}, upper: [O, A, 10], fore: [A, P, 6]}
  drives: {q1: {angle: upper}, q2: {angle: fore, from: upper}}
  sketch: {A: [8, 6], P: [8, 12]}
  limits: [{distance: [W, P], min: 0.05}, {distance: [V, P], min: 0.3}, {distance: [U, P], min: 0.004}]
workspace: {point: P, indices: []}
"""
    exact = np.pi * (16**2 - 4**2 - 0.05**2 - 0.3**2 - 0.004**2)
    found = answer(questions(study_of(text), 1e-4, ("area",))[0], {}, 1, effort).values["area"][0]
    assert found == pytest.approx(exact, abs=1e-6)


def test_few_samples_find_a_gap_between_them() -> None:
    """A gap that a determinant leaves, where it dips hardly steeper to one side of a sample than to the other."""
    study = study_of(FIVE_BAR, "workspace.assembly=same", "mechanism.parameters.b=0.3675195822454308")
    question, about = questions(study)[0], 0.2267883835941191j
    zero, angle, reach = np.zeros(1, dtype=np.intp), np.array([4.377794174748168]), np.array([1.2])
    few, many = (
        trace(Scanned(question.field, {}, 1, about, question.scan, effort), zero, angle, reach)
        for effort in (BATCH, SINGLE)
    )
    assert len(many.inner) == 3
    np.testing.assert_allclose([few.inner, few.outer], [many.inner, many.outer], atol=1e-12)
