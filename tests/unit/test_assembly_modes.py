"""All assembly modes of a mechanism, change points that are followed, and large batches in chunks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of

import mechdesign

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


def modes(result: mechdesign.Answer) -> dict[str, dict[str, np.ndarray]]:
    """The rows of each assembly, the drawn one first."""
    table = result.tables["modes"]
    labels = dict.fromkeys(table["mode"].tolist())
    return {label: {name: table[name][table["mode"] == label] for name in table.names} for label in labels}


def assemblies_told(study: str) -> list[str]:
    return [line for line in checked(study) if line.startswith("assembly modes")]


def test_the_assemblies_of_a_four_bar_are_named_by_the_joint_that_chooses_them() -> None:
    assert list(modes(mechdesign.kinematics(study_of(FOUR_BAR), all_modes=True))) == ["B+", "B-"]
    assert assemblies_told(FOUR_BAR) == ["assembly modes: 2, chosen by B (2 each)"]


def test_working_modes_of_the_inverse_problem_are_listed_too() -> None:
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", {"kinematics": {"poses": [{"C.x": 0.1, "C.y": 1.2}]}})
    found = modes(mechdesign.kinematics(study, all_modes=True))
    drives = [tuple(float(rows[name][0]) for name in study.mechanism.drives) for rows in found.values()]
    assert len(set(drives)) == len(drives) == 4
    drawn = study.mechanism.solve({"C.x": 0.1, "C.y": 1.2})
    assert drives[0] == pytest.approx([float(drawn[name]) for name in study.mechanism.drives])


@pytest.mark.slow
def test_every_assembly_of_a_group_without_a_closed_form_has_the_legs_that_are_given() -> None:
    lengths = [np.hypot(0.4, 1), np.hypot(0.4, 1), np.hypot(0.05, 1.35)]
    pose = dict(zip(("l1", "l2", "l3"), lengths, strict=True))
    file = CONFIGS / "planar_3rpr.yaml"
    study = mechdesign.load(file, {"kinematics": {"poses": [pose], "outputs": ["P", "platform.angle"]}})
    found = modes(mechdesign.kinematics(study, all_modes=True))
    places = [
        (rows["P.x"][0] + 1j * rows["P.y"][0], np.exp(1j * np.radians(rows["platform.angle"][0])))
        for rows in found.values()
    ]
    assert places[0] == pytest.approx((1j, 1), abs=1e-9)
    for place, turn in places:
        legs = place + turn * np.array([-0.2, 0.2, 0.25 + 0.15j]) - np.array([-0.6, 0.6, 0.3 - 0.2j])
        assert np.abs(legs) == pytest.approx(lengths, rel=1e-9)
    assert len({(round(place.real, 6), round(place.imag, 6)) for place, _ in places}) == len(found) > 1
    (line,) = assemblies_told(file.read_text(encoding="utf-8"))
    assert f"{len(found)} found" in line


@pytest.mark.slow
def test_too_many_assemblies_are_refused() -> None:
    links = "".join(f"    a{k}: [P{k}, P{k + 1}, 1]\n    b{k}: [Q{k}, P{k + 1}, 1]\n" for k in range(9))
    ground = ", ".join(["O: [-1, 0]", *(f"Q{k}: [{k + 1}, {-1 + 0.3 * (k % 2)}]" for k in range(9))])
    sketch = ", ".join(f"P{k + 1}: [{k + 1 + 0.1 * k:.2f}, 0.1]" for k in range(9))
    text = f"mechanism:\n  links:\n    ground: {{{ground}}}\n    crank: [O, P0, 1]\n{links}"
    text += f"  drives: [crank]\n  sketch: {{P0: [0, 0], {sketch}}}\n"
    with pytest.raises(mechdesign.MechanismError, match="more than 256"):
        mechdesign.kinematics(study_of(text), all_modes=True)
    assert assemblies_told(text) == ["assembly modes: 512, chosen by P1, P2, P3, P4, P5, P6, P7, P8, P9 (2 each)"]


def test_a_parallelogram_stays_one_through_its_change_points() -> None:
    mechanism = study_of(PARALLELOGRAM).mechanism
    angles = np.arange(-725.0, 1100.0, 5.0)
    whole = mechanism.solve({"theta": angles})
    assert whole.valid.all()
    crank = np.exp(1j * np.radians(angles))
    found = whole["B.x"] + 1j * whole["B.y"]
    assert found == pytest.approx(4 + crank, abs=1e-7)
    away = np.abs(np.mod(angles + 90, 180) - 90) > 1
    assert found[away] == pytest.approx((4 + crank)[away], abs=1e-12)
    # The dyad behind keeps its own side, and order and chunks do not matter.
    backwards = mechanism.solve({"theta": angles[::-1]})
    assert (backwards["F.y"][::-1] == whole["F.y"]).all()
    alone = np.array([float(mechanism.solve({"theta": angle})["F.y"]) for angle in angles[::40]])
    assert alone == pytest.approx(whole["F.y"][::40], rel=1e-12)


def test_side_keeps_the_joint_on_its_side_instead() -> None:
    mechanism = study_of(PARALLELOGRAM, "mechanism.branch=side").mechanism
    pose = mechanism.solve({"theta": [60, 300]})
    a, d, b = (pose[f"{name}.x"] + 1j * pose[f"{name}.y"] for name in "ADB")
    sides = ((a - d).conjugate() * (b - d)).imag
    assert (sides < 0).all()


def test_large_batches_come_out_as_small_ones() -> None:
    mechanism = study_of(FOUR_BAR, "mechanism.links.rod.length=1.9").mechanism
    angles = np.linspace(-120.0, 170.0, 100_017)
    longer = np.linspace(1.85, 1.95, len(angles))
    whole = mechanism.solve({"theta": angles}, {"rod.length": longer})
    assert 0 < whole.valid.sum() < len(angles)
    for some in (slice(0, 100), slice(32_700, 32_800), slice(len(angles) - 20, None)):
        part = mechanism.solve({"theta": angles[some]}, {"rod.length": longer[some]})
        assert (part.valid == whole.valid[some]).all()
        for name in ("O.x", "B.x", "B.y", "P.y"):
            assert np.array_equal(part[name], whole[name][some], equal_nan=True)
    grid = mechanism.solve({"theta": angles.reshape(-1, 1)[:2000]}, {"rod.length": np.linspace(1.8, 2.0, 40)})
    assert grid.valid.shape == (2000, 40)
    one = mechanism.solve({"theta": np.full(40, angles[1234])}, {"rod.length": np.linspace(1.8, 2.0, 40)})
    assert np.array_equal(one["B.y"], grid["B.y"][1234], equal_nan=True)


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
