"""Workspace: regions along rays, panels, roots, bounding boxes, and what a study may ask wrongly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.numerics.roots import bracketed_roots
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.panels import find_panels
from mechdesign.region.rays import BATCH, Designs, trace

ARM = """
units: {length: dimensionless}
mechanism:
  parameters: {a: 1.5, b: 1.0}
  links:
    ground: {O: [0, 0]}
    upper: [O, E, a]
    lower: [E, P, b]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [1, 1], P: [2, 1]}
workspace: {point: P}
"""
LEGS = """
units: {length: dimensionless}
mechanism:
  parameters: {R: 1, low: 1, high: 3}
  links:
    ground: {B1: [R, 0], B2: [-R, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits:
    - {drive: l1, min: low, max: high}
    - {drive: l2, min: low, max: high}
  sketch: {C: [0, 1.8]}
workspace: {point: C, scan: {about: [0, 0]}}
"""
UPPER = "workspace.scan={about: [0, 0], from: 0, to: 180}"


@pytest.mark.slow
def test_annulus_of_a_two_link_arm() -> None:
    """About its base a ring, between |a - b| and a + b; inverse condition and det J from sin q2 alone."""
    result = mechdesign.workspace(study_of(ARM, "workspace.scan.about=[0, 0]"))
    area = np.pi * (2.5**2 - 0.5**2)
    assert result.main["area"][0] == pytest.approx(area, rel=1e-9)
    assert result.main["box_area"][0] == pytest.approx(25, rel=1e-9)
    # 1/|det J| = 1/(a b |sin q2|), and the area element is a b |sin q2| dq1 dq2: the mean is 2 pi^2 / area.
    assert result.main["GRI"][0] == pytest.approx(2 * np.pi**2 / area, rel=1e-6)


@pytest.mark.slow
def test_a_region_seen_from_elsewhere_has_several_intervals_a_ray() -> None:
    """From a point of the ring, rays cross the hole: the same area, box and mean as about the middle."""
    about = mechdesign.workspace(study_of(ARM, "workspace.scan.about=[1.5, 0.2]")).main
    assert about["area"][0] == pytest.approx(np.pi * (2.5**2 - 0.5**2), rel=1e-8)
    assert about["box_area"][0] == pytest.approx(25, rel=1e-8)
    assert about["GRI"][0] == pytest.approx(2 * np.pi**2 / about["area"][0], rel=2e-5)


@pytest.mark.slow
def test_from_outside_the_region_too() -> None:
    about = mechdesign.workspace(study_of(ARM, "workspace.scan.about=[4, 0.3]")).main
    assert about["area"][0] == pytest.approx(np.pi * (2.5**2 - 0.5**2), rel=1e-7)


@pytest.mark.nightly
def test_the_assembly_of_the_sketch_ends_at_a_singularity() -> None:
    """All round, two legs reach above and below their base; only one half is the sketch's assembly."""
    half = mechdesign.workspace(study_of(LEGS))
    both = mechdesign.workspace(study_of(LEGS, "workspace.assembly=any"))
    assert both.main["area"][0] == pytest.approx(2 * half.main["area"][0], rel=1e-9)
    assert half.main["area"][0] == pytest.approx(5.108614977730989, rel=1e-9)
    assert half.tables["local"]["y"].min() > -1e-9


@pytest.mark.nightly
def test_a_margin_is_left_out_of_the_means_only() -> None:
    whole = mechdesign.workspace(study_of(LEGS, UPPER)).main
    cut = mechdesign.workspace(study_of(LEGS, UPPER, "workspace.margin=20")).main
    assert cut["area"][0] == pytest.approx(whole["area"][0], rel=1e-12)
    assert cut["GII"][0] > whole["GII"][0] + 0.005


def test_ends_of_intervals_lie_on_the_limits() -> None:
    study = study_of(LEGS)
    question = questions(study)[0]
    theta = np.linspace(0.05, 3.1, 57)
    zero = np.zeros(len(theta), dtype=int)
    found = trace(Designs(question.field, {}, 1, 0j, question.scan, BATCH), zero, theta, np.full(len(theta), 7.0))
    for radius in (found.inner, found.outer):
        place = radius * np.exp(1j * theta[found.ray])
        lengths = np.abs(place[:, None] - np.array([1, -1]))
        assert np.abs(lengths[:, :, None] - [1, 3]).min(axis=(1, 2)) == pytest.approx(np.zeros(len(place)), abs=1e-14)


def test_panels_end_where_the_active_limits_change() -> None:
    question = questions(study_of(LEGS, UPPER))[0]
    panels = find_panels(Designs(question.field, {}, 1, 0j, (0.0, np.pi), BATCH))
    assert panels.high == pytest.approx([np.pi / 2, np.pi], abs=1e-8)
    # A base that is not symmetric: the corners are where two circles meet.
    moved = {"ground.B1.x": np.array([1.3])}
    panels = find_panels(Designs(question.field, moved, 1, 0j, (0.0, np.pi), BATCH))
    corner = (1.3**2 - 1) / (2 * 2.3) + 0j
    corner += 1j * np.sqrt(9 - (corner.real + 1) ** 2)
    assert np.abs(panels.high - np.angle(corner)).min() < 1e-12


@pytest.mark.nightly
def test_batch_of_designs_equals_one_by_one() -> None:
    study = study_of(LEGS, UPPER)
    question = questions(study)[0]
    lows = np.array([1.0, 1.2, 1.7, 2.5])
    places = study.parameters.places({"low": lows, "high": lows + 2})
    together = answer(question, places, 4, BATCH).values
    for k in range(4):
        alone = answer(question, {name: value[k : k + 1] for name, value in places.items()}, 1, BATCH).values
        for name, values in together.items():
            assert alone[name][0] == pytest.approx(values[k], rel=1e-10), name


def test_roots_of_many_functions() -> None:
    """Quadratics in one step; a kink, a step and a function that ends (nan) by halving."""
    functions = [
        lambda x: x * x - 2, lambda x: np.cos(x) - x, lambda x: np.where(x < 1.1, 1.0, -1.0),
        lambda x: np.where(x < 1.3, 2 - x, np.nan), lambda x: np.abs(x - 1.5) - 0.4,
    ]  # fmt: skip
    calls = np.zeros(5, dtype=int)

    def evaluate(which: np.ndarray, x: np.ndarray) -> np.ndarray:
        np.add.at(calls, which, 1)
        return np.array([functions[k](v) for k, v in zip(which, x, strict=True)])

    low, high = np.array([0.0, 0, 0, 0, 0]), np.array([2.0, 2, 2, 2, 1.5])
    third = np.array([1.0, 1, 1, 1, 1])
    every = np.arange(5)
    at = [evaluate(every, v) for v in (low, high, third)]
    calls[:] = 0
    found = bracketed_roots(evaluate, low, at[0], high, at[1], third, at[2], np.full(5, 1e-13))
    assert found == pytest.approx([np.sqrt(2), 0.7390851332151607, 1.1, 1.3, 1.1], abs=1e-12)
    assert calls[0] <= 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (("workspace={}",), "workspace.point"),
        (("workspace.at={l1: 2}",), "workspace.at"),
        (("workspace.margin=180",), "leaves nothing"),
    ],
)
def test_what_a_section_lacks(changes: tuple[str, ...], said: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=said):
        mechdesign.workspace(study_of(LEGS, *changes))


def test_one_degree_of_freedom_gives_a_path() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs" / "toggle.yaml", ["workspace={point: S}"])
    assert "path" in mechdesign.workspace(study).tables


def test_mixed_units_need_a_length() -> None:
    path = Path(__file__).parents[2] / "configs" / "planar_3rpr.yaml"
    section = "workspace={point: P, at: {platform.angle: [0, 10]}}"
    with pytest.raises(mechdesign.StudyError, match="characteristic_length"):
        mechdesign.workspace(mechdesign.load(path, [section]))


@pytest.mark.nightly
def test_platform_at_constant_orientation() -> None:
    """Three strokes: the common part of three rings about the base points moved by the platform's."""
    path = Path(__file__).parents[2] / "configs" / "planar_3rpr.yaml"
    limits = (
        "mechanism.limits=[{drive: l1, min: 0.4, max: 1.4}, {drive: l2, min: 0.4, max: 1.4}, {drive: l3, max: 1.6}]"
    )
    section = "workspace={point: P, at: {platform.angle: [0, 10]}, characteristic_length: 0.2, assembly: any}"
    table = mechdesign.workspace(mechdesign.load(path, [limits, section])).main
    assert table["platform.angle"] == pytest.approx([0, 10])
    x, y = np.meshgrid(*(np.linspace(-2, 2, 2001),) * 2)
    for row, angle in enumerate(np.radians([0, 10])):
        turn = np.exp(1j * angle)
        shifted = np.array([-0.6 + 0.2 * turn, 0.6 - 0.2 * turn, 0.3 - 0.2j - (0.25 + 0.15j) * turn])
        lengths = np.abs((x + 1j * y)[..., None] - shifted)
        inside = ((lengths >= [0.4, 0.4, 0]) & (lengths <= [1.4, 1.4, 1.6])).all(axis=-1)
        assert table["area"][row] == pytest.approx(inside.mean() * 16.016, rel=3e-3)


@pytest.mark.slow
def test_a_region_without_an_end_says_so() -> None:
    with pytest.raises(mechdesign.AssemblyError, match="has no end"):
        mechdesign.workspace(study_of(LEGS, "mechanism.limits=[]"))


def test_nothing_reachable_says_so() -> None:
    with pytest.raises(mechdesign.AssemblyError, match="reaches nothing"):
        mechdesign.workspace(study_of(LEGS, "workspace.scan={about: [9, 0], from: -20, to: 20}"))


SIMILAR = """
units: {length: m}
mechanism:
  links:
    ground: {A1: [-0.6, -0.4], A2: [0.6, -0.4], A3: [0, 0.8]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.15, -0.1], B2: [0.15, -0.1], B3: [0, 0.2]}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  limits: [{drive: l1, min: 0.3, max: 0.75}, {drive: l2, min: 0.3, max: 0.75}, {drive: l3, min: 0.3, max: 0.75}]
  sketch: {P: [0.02, 0.04], B1: [-0.13, -0.03], B2: [0.15, -0.09], B3: [0.06, 0.23]}
workspace: {point: P, at: {platform.angle: [0, -20]}, characteristic_length: 0.2}
"""


@pytest.mark.nightly
@pytest.mark.parametrize("assembly", ["any", "same"])
def test_every_pose_is_singular_where_platform_and_base_are_similar(assembly: str) -> None:
    """Not turned against the base, the platform's legs always meet in one point; its area is known all the same."""
    result = mechdesign.workspace(study_of(SIMILAR, f"workspace.assembly={assembly}"))
    main = result.main
    assert np.isnan(main["GII"]).tolist() == [True, False]
    assert (main["area"] > 0).all()
    (warning,) = (text for text in map(str, result.warnings) if "every pose" in text)
    assert "platform.angle = 0 is a forward singularity" in warning
