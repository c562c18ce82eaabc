"""All assembly modes of a mechanism, change points that are followed, and large batches in chunks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.errors import MechanismError
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.describe import assemblies_in_words
from mechdesign.mechanism.plan import CHUNK

CONFIGS = Path(__file__).parents[2] / "configs"
FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {P: [1, 1]}}
    rocker: [D, B, 3]
  drives: {theta: {angle: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
"""
PARALLELOGRAM = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], G: [9, 1]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 4, points: {P: [2, 1]}}
    rocker: [D, B, 1]
    arm: [B, F, 4]
    last: [G, F, 3]
  drives: {theta: {angle: crank}}
  branch: follow
  sketch: {A: [0.5, 0.87], B: [4.5, 0.87], F: [7.4, 3.6]}
"""


def test_a_four_bar_has_two_assemblies_mirrored_about_the_line_of_its_outer_joints() -> None:
    mechanism = study_of(FOUR_BAR).mechanism
    drawn, other = assemblies(mechanism, mechanism.drives)
    assert (drawn.label, drawn.drawn, other.label, other.drawn) == ("B+", True, "B-", False)
    angles = np.linspace(0, 360, 9)
    one, two = (assembly.mechanism.solve({"theta": angles}) for assembly in (drawn, other))
    a, d = one.configuration.point("A"), one.configuration.point("D")
    mirrored = d + (a - d) * np.conj((one.configuration.point("B") - d) / (a - d))
    assert two.configuration.point("B") == pytest.approx(mirrored, abs=1e-12)
    assert one["rocker.angle"] == pytest.approx(mechanism.solve({"theta": angles})["rocker.angle"])
    assert assemblies_in_words(mechanism) == ["assembly modes: 2, chosen by B (2 each)"]


def test_working_modes_of_the_inverse_problem_are_listed_too() -> None:
    mechanism = mechdesign.load(CONFIGS / "two_rrr.yaml").mechanism
    found = assemblies(mechanism, ("C.x", "C.y"))
    assert len(found) == 4
    assert [assembly.drawn for assembly in found] == [True, False, False, False]
    drives = {tuple(float(a.mechanism.solve({"C.x": 0.1, "C.y": 1.2})[d]) for d in mechanism.drives) for a in found}
    assert len(drives) == 4


@pytest.mark.slow
def test_every_assembly_of_a_group_without_a_closed_form_solves_its_loops() -> None:
    mechanism = mechdesign.load(CONFIGS / "planar_3rpr.yaml").mechanism
    found = assemblies(mechanism, mechanism.drives)
    assert len(found) > 1
    assert found[0].drawn
    lengths = {
        name: float(mechanism.sketch_configuration.value(mechanism.coordinate(name))) for name in mechanism.drives
    }
    places = []
    for assembly in found:
        pose = assembly.mechanism.solve(lengths)
        places.append([float(pose[name]) for name in ("P.x", "P.y", "platform.angle")])
        back = assembly.mechanism.plan(("P.x", "P.y", "platform.angle"))
        again = back.solve([places[-1][0], places[-1][1], np.radians(places[-1][2])])
        for name in mechanism.drives:
            assert float(again.value(mechanism.coordinate(name))) == pytest.approx(lengths[name], rel=1e-12)
    assert len(np.unique(np.round(places, 6), axis=0)) == len(found)
    assert f"{len(found)} found" in assemblies_in_words(mechanism)[0]


def test_too_many_assemblies_are_refused() -> None:
    links = "".join(f"    a{k}: [P{k}, P{k + 1}, 1]\n    b{k}: [Q{k}, P{k + 1}, 1]\n" for k in range(9))
    ground = ", ".join(["P0: [0, 0]", *(f"Q{k}: [{k + 1}, {-1 + 0.3 * (k % 2)}]" for k in range(9))])
    sketch = ", ".join(f"P{k + 1}: [{k + 1 + 0.1 * k:.2f}, 0.1]" for k in range(9))
    text = f"mechanism:\n  links:\n    ground: {{{ground}}}\n{links}  drives: []\n  sketch: {{{sketch}}}\n"
    mechanism = study_of(text).mechanism
    with pytest.raises(MechanismError, match="more than 256"):
        assemblies(mechanism, ())


def test_a_parallelogram_stays_one_through_its_change_points() -> None:
    mechanism = study_of(PARALLELOGRAM).mechanism
    angles = np.arange(-725.0, 1100.0, 5.0)
    whole = mechanism.solve({"theta": angles})
    assert whole.valid.all()
    crank = np.exp(1j * np.radians(angles))
    assert whole.configuration.point("B") == pytest.approx(4 + crank, abs=1e-7)
    away = np.abs(np.mod(angles + 90, 180) - 90) > 1
    assert whole.configuration.point("B")[away] == pytest.approx((4 + crank)[away], abs=1e-12)
    # The dyad behind keeps its own side, and order and chunks do not matter.
    backwards = mechanism.solve({"theta": angles[::-1]})
    assert (backwards["F.y"][::-1] == whole["F.y"]).all()
    alone = np.array([float(mechanism.solve({"theta": angle})["F.y"]) for angle in angles[::40]])
    assert alone == pytest.approx(whole["F.y"][::40], rel=1e-12)


def test_side_keeps_the_joint_on_its_side_instead() -> None:
    mechanism = study_of(PARALLELOGRAM, "mechanism.branch=side").mechanism
    pose = mechanism.solve({"theta": [60, 300]})
    a, d, b = (pose.configuration.point(name) for name in "ADB")
    sides = ((a - d).conjugate() * (b - d)).imag
    assert (sides < 0).all()


@pytest.mark.parametrize("jobs", [1, 2])
def test_large_batches_come_out_as_small_ones(jobs: int) -> None:
    mechanism = study_of(FOUR_BAR, "mechanism.links.rod.length=1.9").mechanism
    angles = np.linspace(-2.0, 3.0, 3 * CHUNK + 17)
    longer = np.linspace(1.85, 1.95, len(angles))
    whole = mechanism.forward.solve([angles], {"rod.length": longer}, jobs=jobs)
    assert 0 < whole.valid.sum() < len(angles)
    for some in (slice(0, 100), slice(CHUNK - 50, CHUNK + 50), slice(len(angles) - 20, None)):
        part = mechanism.forward.solve([angles[some]], {"rod.length": longer[some]})
        assert (part.reason == whole.reason[some]).all()
        for name in ("O", "B", "P"):
            assert np.array_equal(part.point(name), whole.point(name)[some], equal_nan=True)
    grid = mechanism.forward.solve([angles.reshape(-1, 1)[:2000]], {"rod.length": np.linspace(1.8, 2.0, 40)}, jobs=jobs)
    assert grid.shape == (2000, 40)
    one = mechanism.forward.solve([angles[1234]], {"rod.length": np.linspace(1.8, 2.0, 40)})
    assert np.array_equal(one.point("B"), grid.point("B")[1234], equal_nan=True)


@pytest.mark.slow
def test_rates_go_smoothly_through_the_change_points_that_are_followed() -> None:
    study = study_of(
        PARALLELOGRAM + "kinematics:\n  sweep: {theta: {from: -180, to: 360, step: 45}}\n  rates: {theta: 1 rad/s}\n"
        "  accelerations: {theta: 2 rad/s^2}\n  outputs: [B, F.x, rocker.angle]\n"
    )
    result = mechdesign.kinematics(study)
    motion = result.tables["motion"]
    turn = np.exp(1j * np.radians(motion["theta"]))
    expected = {"": 4 + turn, "_velocity": 1j * turn, "_acceleration": (2j - 1) * turn}
    for order, value in expected.items():
        assert motion[f"B.x{order}"] + 1j * motion[f"B.y{order}"] == pytest.approx(value, abs=1e-9)
    assert np.diff(motion["rocker.angle"]) == pytest.approx(np.diff(motion["theta"]), abs=1e-9)
    assert motion["rocker.angle_velocity"] == pytest.approx(np.full(len(motion), np.degrees(1)), rel=1e-9)
    assert np.isfinite(motion["F.x_acceleration"]).all()
    assert not result.warnings
