"""S4: stiffness of planar parallel mechanisms with serial-chain legs, by reciprocal screws.

Reference values are those of the corrected theory on the project's reference geometry (the paper's own is lost); the
compliance is compared with finite elements in the verification manual.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechdesign
from mechdesign.questions.poses import study_poses
from mechdesign.study import Study

CONFIGS = Path(__file__).parents[2] / "configs"
TYPES = {"I": "planar_3rpr.yaml", "II": "planar_2rpr_rp.yaml", "III": "planar_rp_rr.yaml"}
SPRINGS = {
    "I": {"leg_1": [3.7409110812e7], "leg_2": [3.7409110812e7], "leg_3": [3.5157683021e7]},
    "II": {"leg_1": [3.7409110812e7], "leg_2": [3.7409110812e7], "leg_3": [2.5958863262e4]},
    "III": {"leg_1": [8.5692159436e3, 1.2840103959e5], "leg_2": [1.4855627054e8]},
}


def load(kind: str) -> Study:
    return mechdesign.load(CONFIGS / TYPES[kind])


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


def test_displaced_poses_are_displaced() -> None:
    """0.4 m away along x, and along y where the platform can go there, as in Sec. 3.3; type III moves on a curve."""
    for kind in TYPES:
        study = load(kind)
        pose = study.mechanism.solve(study_poses(study, "stiffness").values)
        places = np.asarray(pose["P.x"]) + 1j * np.asarray(pose["P.y"])
        assert places[0] == pytest.approx(1j)
        assert abs(places[1:] - places[0]).min() >= 0.4 - 1e-12
