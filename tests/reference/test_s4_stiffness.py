"""S4: stiffness of planar parallel mechanisms with serial-chain legs, by reciprocal screws.

Reference values are those of the corrected theory on the project's reference geometry (the paper's own is lost); the
finite-element model stands in for the paper's ADAMS model (Sec. 3.3), with which it agreed within 0.014 %.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.beam_model import Frame

import mechdesign
from mechdesign.questions.poses import study_poses
from mechdesign.study import Study

CONFIGS = Path(__file__).parents[2] / "configs"
TYPES = {"I": "planar_3rpr.yaml", "II": "planar_2rpr_rp.yaml", "III": "planar_rp_rr.yaml"}
ENTRIES = ("C11", "C12", "C13", "C22", "C23", "C33")
COMPLIANCE = {
    "I": (3.0835033763e-7, -3.2704265711e-8, 4.0775675544e-7, 1.5504244485e-8, -6.5408531422e-8, 7.8523178337e-7),
    "II": (3.3423163835e-6, -1.6779485374e-10, 6.5474604740e-6, 1.5504244485e-8, -3.3558970747e-10, 1.3208182474e-5),
    "III": (7.1899792645e-5, 4.0801630826e-5, -6.0189977202e-5, 2.3564583130e-5, -3.6173174894e-5, 6.0485920067e-5),
}
SPRINGS = {
    "I": {"leg_1": [3.7409110812e7], "leg_2": [3.7409110812e7], "leg_3": [3.5157683021e7]},
    "II": {"leg_1": [3.7409110812e7], "leg_2": [3.7409110812e7], "leg_3": [2.5958863262e4]},
    "III": {"leg_1": [8.5692159436e3, 1.2840103959e5], "leg_2": [1.4855627054e8]},
}
AXIAL, BENDING = 200e9 * 0.02 * 0.04, 200e9 * 0.02 * 0.04**3 / 12
K_PRISMATIC, K_REVOLUTE = 5e7, 1e5


def load(kind: str) -> Study:
    return mechdesign.load(CONFIGS / TYPES[kind])


def compliance(result: mechdesign.ground.results.Result, row: int) -> np.ndarray:
    table = result.tables["compliance"]
    matrix = np.zeros((3, 3))
    for name in ENTRIES:
        i, j = int(name[1]) - 1, int(name[2]) - 1
        matrix[i, j] = matrix[j, i] = table[name][row]
    return matrix


@pytest.mark.parametrize("kind", TYPES)
def test_compliance_at_the_reference_pose(kind: str) -> None:
    table = mechdesign.stiffness(load(kind)).tables["compliance"]
    # The table of the theory gives eleven digits; the smallest entries of type II are differences of large ones.
    assert [table[name][0] for name in ENTRIES] == pytest.approx(COMPLIANCE[kind], rel=1e-8)


@pytest.mark.parametrize("kind", TYPES)
def test_equivalent_springs_at_the_reference_pose(kind: str) -> None:
    table = mechdesign.stiffness(load(kind)).tables["springs"]
    first = list(table)[: sum(map(len, SPRINGS[kind].values()))]
    for leg, expected in SPRINGS[kind].items():
        assert [row["stiffness"] for row in first if row["leg"] == leg] == pytest.approx(expected, rel=1e-9)


def test_the_springs_of_a_bent_leg_lie_on_both_sides_of_its_tip() -> None:
    """Type III, eq. 42: a = 0.7173005737 m, along the leg from A1 (-0.6, 0) to B1 (-0.2, 1), away from A1 first."""
    table = mechdesign.stiffness(load("III")).tables["springs"]
    along = (0.4 + 1j) / abs(0.4 + 1j)
    places = table["x"][:2] + 1j * table["y"][:2]
    assert (places - (-0.2 + 1j)) / along == pytest.approx([0.7173005737, -0.7173005737], abs=1e-9)
    assert table["angle"][:2] == pytest.approx(np.degrees(np.angle(1j * along)))


@pytest.mark.parametrize("kind", TYPES)
def test_springs_carry_the_platform_as_the_legs_do(kind: str) -> None:
    """Parallel linear springs on the lines of springs.csv sum to the stiffness matrix (Fig. 6)."""
    result = mechdesign.stiffness(load(kind))
    table = result.tables["springs"]
    total = np.zeros((3, 3))
    for row in list(table)[: len(table) // 3]:
        angle = np.radians(row["angle"])
        force = np.array([np.cos(angle), np.sin(angle)])
        moment = row["x"] * force[1] - (row["y"] - 1.0) * force[0]
        total += row["stiffness"] * np.outer([*force, moment], [*force, moment])
    assert total @ compliance(result, 0) == pytest.approx(np.eye(3), abs=1e-8)


def build(kind: str, points: dict[str, complex]) -> np.ndarray:
    """Compliance at P of the finite-element model of a type, its joints at given places."""
    frame = Frame()
    centre = frame.node(points["P"])

    def corner(name: str) -> int:
        node = frame.node(points[name])
        frame.rigid(centre, node)
        return node

    def telescope(k: int, *, motor: float | None, turned: float | None, clamped: bool) -> None:
        base, tip = points[f"A{k}"], points[f"B{k}"]
        foot, root, end = frame.node(base), frame.node(base), frame.node(tip)
        frame.ground(foot, 0, 1)
        if turned is not None:
            wall = frame.node(base)
            frame.ground(wall, 0, 1, 2)
            frame.turning_spring(foot, wall, turned)
        frame.slide(foot, root, tip - base)
        if motor is not None:
            frame.sliding_spring(foot, root, tip - base, motor)
        frame.beam(root, end, AXIAL, BENDING)
        (frame.clamp if clamped else frame.hinge)(end, corner(f"B{k}"))

    if kind == "III":
        telescope(1, motor=None, turned=K_REVOLUTE, clamped=True)
        start, end = frame.node(points["A2"]), frame.node(points["B2"])
        frame.ground(start, 0, 1)
        frame.beam(start, end, AXIAL, BENDING)
        frame.hinge(end, corner("B2"))
    else:
        telescope(1, motor=K_PRISMATIC, turned=None, clamped=False)
        telescope(2, motor=K_PRISMATIC, turned=None, clamped=False)
        telescope(3, motor=K_PRISMATIC if kind == "I" else None, turned=None, clamped=kind == "II")
    return frame.compliance(centre)


@pytest.mark.parametrize("kind", TYPES)
def test_agrees_with_beam_elements_at_three_poses(kind: str) -> None:
    """Within 0.0001 % at the reference pose and at two displaced ones (Sec. 3.3)."""
    study = load(kind)
    result = mechdesign.stiffness(study)
    poses = study_poses(study, "stiffness")
    assert poses.count == 3
    pose = study.mechanism.solve(poses.values)
    for row in range(3):
        points = {name: complex(pose[f"{name}.x"][row], pose[f"{name}.y"][row]) for name in study.mechanism.points}
        assert compliance(result, row) == pytest.approx(build(kind, points), rel=1e-6)


def test_displaced_poses_are_displaced() -> None:
    """0.4 m away along x, and along y where the platform can go there, as in Sec. 3.3; type III moves on a curve."""
    for kind in TYPES:
        study = load(kind)
        pose = study.mechanism.solve(study_poses(study, "stiffness").values)
        places = np.asarray(pose["P.x"]) + 1j * np.asarray(pose["P.y"])
        assert places[0] == pytest.approx(1j)
        assert abs(places[1:] - places[0]).min() >= 0.4 - 1e-12
