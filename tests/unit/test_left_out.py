"""What a study leaves out of its masses is taken as documented, and said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import mechdesign

FOUR_BAR = """
units: {length: m}
mechanism:
  links:
    ground: {O: [0, 0], D: [0.1, 0]}
    crank: [O, A, 0.03]
    rod: {from: A, to: B, length: 0.09, mass: 3 kg POINTS}
    rocker: [D, B, 0.06]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 0.03], B: [0.075, 0.055]}
dynamics:
  sweep: {theta: {from: 0, to: 350, step: 10}}
  gravity: [0, -9.81]
"""
FLAP = """
units: {length: m}
mechanism:
  links: {ground: {O: [0, 0]}, flap: {from: O, to: P, length: 0.8, mass: 2 kg INERTIA}}
  drives: [flap]
dynamics: {gravity: [0, -9.81], forward: {duration: 2 s, events: {down: {of: flap, value: -90}}}}
"""


def efforts(text: str) -> np.ndarray:
    return np.asarray(mechdesign.dynamics(mechdesign.load(text=text)).tables["dynamics"]["theta_effort"])


def said(text: str) -> str:
    warnings = mechdesign.dynamics(mechdesign.load(text=text)).warnings
    return "\n".join(str(warning) for warning in warnings if warning.kind == "assumed")


@pytest.mark.parametrize(
    "link",
    [
        "rod: {from: A, to: B, length: 0.09, mass: 3 kg, points: {T: [0.02, 0.4]}}",
        "rod: {points: {A: [0, 0], T: [0.02, 0.4], B: [0.09, 0]}, mass: 3 kg}",
    ],
)
def test_a_traced_point_does_not_move_the_centre_of_mass(link: str) -> None:
    plain = FOUR_BAR.replace(" POINTS", "")
    given = efforts(plain.replace("mass: 3 kg", "mass: 3 kg, center: [0.045, 0]"))
    traced = plain.replace("rod: {from: A, to: B, length: 0.09, mass: 3 kg}", link)
    assert traced != plain
    assert efforts(traced) == pytest.approx(given, rel=1e-12)
    assert "rod [0.045, 0] m between A and B" in said(traced)


def test_a_link_of_one_joint_has_its_centre_in_the_middle_of_its_ends() -> None:
    arm = """
units: {length: m}
mechanism:
  links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 0.8, mass: 2 kg, points: {T: [3, 3]}}}
  drives: {theta: {angle: arm}}
dynamics: {poses: [{theta: 0}], gravity: [0, -9.81]}
"""
    assert efforts(arm) == pytest.approx([2 * 9.81 * 0.4])


@pytest.mark.slow
@pytest.mark.parametrize(("inertia", "about"), [("", 0.0), (", inertia: rod", 2 * 0.8**2 / 12)])
def test_a_flap_falls_as_a_point_mass_or_as_a_slender_bar(inertia: str, about: float) -> None:
    result = mechdesign.dynamics(mechdesign.load(text=FLAP.replace(" INERTIA", inertia)))
    # From rest at the level: (J + m a^2) omega^2 / 2 = m g a sin(angle).
    weight, whole = 2 * 9.81 * 0.4, about + 2 * 0.4**2
    time = quad(lambda u: 2 * u / np.sqrt(2 * weight / whole * np.sin(u * u)), 0, np.sqrt(np.pi / 2))[0]
    assert result.tables["events"]["time"][0] == pytest.approx(time, rel=1e-8)
    kinds = [warning.kind for warning in result.warnings]
    assert kinds == ([] if inertia else ["assumed", "assumed"])


def test_an_inertia_that_is_left_out_is_said_with_that_of_a_bar_where_the_link_turns() -> None:
    moving = FOUR_BAR.replace(" POINTS", "").replace("gravity: [0, -9.81]", "rates: {theta: 60 rpm}")
    assert f"rod (inertia: rod would be {3 * 0.09**2 / 12:.6g} kg*m^2)" in said(moving)
    assert "without 'inertia'" not in said(FOUR_BAR.replace(" POINTS", ""))
    assert not said(moving.replace("mass: 3 kg", "mass: 3 kg, center: [0.045, 0], inertia: 0"))


def test_a_bar_follows_the_length_of_its_link() -> None:
    text = FLAP.replace(" INERTIA", ", inertia: rod").split("dynamics:")[0]
    text += "dynamics: {poses: [{flap: -90}], gravity: [0, -9.81], modes: true}"
    for length in (0.8, 0.4):
        study = mechdesign.load(text=text, overrides={"mechanism.links.flap.length": length})
        frequency = mechdesign.dynamics(study).tables["modes"]["frequency"][0]
        assert frequency == pytest.approx(np.sqrt(1.5 * 9.81 / length) / (2 * np.pi), rel=1e-9)


def test_a_rod_between_three_joints_is_refused() -> None:
    text = FOUR_BAR.replace(" POINTS", ", inertia: rod, points: {C: [0.05, 0.05]}")
    text = text.replace("D: [0.1, 0]}", "D: [0.1, 0]}\n    other: [C, E, 0.05]")
    with pytest.raises(mechdesign.StudyError, match="a rod runs between two joints, and 'rod' has 3"):
        mechdesign.load(text=text)


@pytest.mark.parametrize(
    ("length", "gravity", "other"),
    [
        ("mm", "9.81", "m/s^2"),
        ("m", "9810", "mm/s^2"),
        ("in", "9.8", "m/s^2"),
        ("m", "386", "in/s^2"),
        ("mm", "9810", ""),
        ("mm", "9.81 m/s^2", ""),
        ("mm", "9.81 mm/s^2", ""),
        ("m", "1.62", ""),
    ],
)
def test_gravity_in_another_unit_of_length_is_suspect(length: str, gravity: str, other: str) -> None:
    text = FLAP.replace(" INERTIA", "").replace("-9.81", f"-{gravity}").replace("length: m}", f"length: {length}}}")
    words = " ".join(str(warning) for warning in mechdesign.load(text=text).warnings)
    assert (f"if {other} is meant" in words) == bool(other)
