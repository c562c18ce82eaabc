"""Workspace: regions along rays, panels, roots, bounding boxes, and what a study may ask wrongly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

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


def boundary(*changes: str) -> tuple[mechdesign.Table, np.ndarray]:
    """The outline of a region of two legs, and its places."""
    table = mechdesign.workspace(study_of(LEGS, *changes)).tables["boundary"]
    return table, table["x"] + 1j * table["y"]


@pytest.mark.slow
def test_the_boundary_lies_on_the_limits() -> None:
    table, place = boundary("workspace.indices=[]")
    limited = table["kind"] == "limit"
    assert limited.sum() > 50
    lengths = np.abs(place[limited, None] - np.array([1, -1]))
    assert np.abs(lengths[:, :, None] - [1, 3]).min(axis=(1, 2)) == pytest.approx(np.zeros(limited.sum()), abs=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(("base", "tolerance"), [(1.0, 1e-8), (1.3, 1e-11)])
def test_smooth_curves_of_the_boundary_end_where_the_active_limits_change(base: float, tolerance: float) -> None:
    """The corners are where two circles meet, above the middle of the bases or beside it."""
    table, place = boundary(UPPER, f"mechanism.links.ground.B1.0={base}", "workspace.indices=[]")
    corner = (base**2 - 1) / (2 * (base + 1)) + 0j
    corner += 1j * np.sqrt(9 - (corner.real + 1) ** 2)
    ends = np.flatnonzero(np.diff(table["curve"]))
    assert np.abs(place[ends] - corner).min() < tolerance


@pytest.mark.nightly
def test_designs_together_are_as_one_by_one() -> None:
    goals = ("area", "GII", "GRI", "SUI")

    def asked(low: float, count: int) -> mechdesign.Table:
        variables = f"variables: {{low: {{from: {low}, to: {low + 0.5 * (count - 1)}, number: {count}}}}}"
        optimize = f"optimize={{{variables}, maximize: [{', '.join(goals)}]}}"
        return mechdesign.optimize(study_of(LEGS, UPPER, "mechanism.parameters.high=low + 2", optimize)).tables[
            "designs"
        ]

    together = asked(1.0, 4)
    for k in range(4):
        alone = asked(1.0 + 0.5 * k, 1)
        for name in goals:
            assert alone[name][0] == pytest.approx(together[name][k], rel=1e-10), name


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
