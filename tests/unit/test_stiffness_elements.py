"""Every kind of elastic element, by itself and in a mechanism, against closed forms and finite elements."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.frames import posed
from helpers.stiffness import ARM, BENT, FIVE_BAR, METRES, SLIDER, SLOTTED, ask_stiffness, matrix
from helpers.studies import study_of
from numpy.testing import assert_allclose

SECTIONS = {
    "rectangle": "{E: 200 GPa, width: 0.02, height: 0.04}",
    "rectangle with shear": "{E: 200 GPa, G: 80 GPa, width: 0.02, height: 0.04, shear: true}",
    "bar": "{E: 200 GPa, diameter: 0.03}",
    "bar with shear": "{E: 200 GPa, G: 80 GPa, diameter: 0.03, shear: true}",
    "tube": "{E: 200 GPa, diameter: 0.05, inner_diameter: 0.04}",
    "tube with shear": "{E: 200 GPa, G: 80 GPa, diameter: 0.05, inner_diameter: 0.04, shear: true}",
    "given": "{E: 70 GPa, area: 3e-4, inertia: 2e-8}",
    "given with shear factor": "{E: 70 GPa, G: 26 GPa, area: 3e-4, inertia: 2e-8, shear: true, shear_factor: 0.4}",
}
LEG = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], Q: [1.5, -0.2]}
    leg: {from: O, to: B, telescopic: true}
    plate: {B: [0, 0], D: [0.5, -0.1], T: [0.2, 0.3]}
    prop: [Q, D, 0.7]
  joints: {grip: {fixed: [leg, plate], point: B, angle: 10}}
  drives: [leg]
  sketch: {B: [0.8, 0.2], D: [1.3, 0.25], T: [0.9, 0.55]}
stiffness:
  link: plate
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {leg: beam, prop: beam}
  actuators: {leg: 1e6}
  poses: [{leg: 0.8}]
"""
)
TEXTS = {"arm": ARM, "slider": SLIDER, "bent": BENT, "slot": SLOTTED, "leg": LEG}


def check(text: str, *overrides: str) -> None:
    study = study_of(text, *overrides)
    expected = posed(study).compliance()
    size = np.sqrt(np.abs(np.diag(expected)))
    found = matrix(ask_stiffness(text, *overrides), "C")
    assert (np.abs(found - expected) <= 1e-6 * np.outer(size, size) + 1e-18).all()


@pytest.mark.nightly
@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("text", TEXTS)
def test_sections_in_mechanisms(text: str, section: str) -> None:
    check(TEXTS[text], f"stiffness.sections={{beam: {SECTIONS[section]}}}")


@pytest.mark.slow
@pytest.mark.parametrize("section", SECTIONS)
def test_a_cantilever_of_every_section(section: str) -> None:
    """Stretch L/EA, lift L^3/3EI + L/(factor G A), turn L/EI, written out for each form."""
    text = (
        METRES
        + f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, bar: [O, P, 0.5]}}
  drives: [bar]
  sketch: {{P: [0.4, 0.3]}}
stiffness: {{link: bar, at: P, sections: {{beam: {SECTIONS[section]}}}, elastic: {{bar: beam}}, poses: [{{bar: 0}}]}}
"""
    )
    ring = 6 * (1 + 0.64) ** 2 / (7 * (1 + 0.64) ** 2 + 20 * 0.64)
    young, area, inertia, shear = {
        "rectangle": (200e9, 8e-4, 0.02 * 0.04**3 / 12, 5 / 6 * 80e9),
        "bar": (200e9, math.pi * 0.03**2 / 4, math.pi * 0.03**4 / 64, 6 / 7 * 80e9),
        "tube": (200e9, math.pi * (0.05**2 - 0.04**2) / 4, math.pi * (0.05**4 - 0.04**4) / 64, ring * 80e9),
        "given": (70e9, 3e-4, 2e-8, 0.4 * 26e9),
    }[section.split()[0]]
    softer = 0.5 / (shear * area) if "shear" in section else 0.0
    expected = np.zeros((3, 3))
    expected[0, 0] = 0.5 / (young * area)
    expected[1, 1], expected[2, 2] = 0.5**3 / (3 * young * inertia) + softer, 0.5 / (young * inertia)
    expected[1, 2] = expected[2, 1] = 0.5**2 / (2 * young * inertia)
    assert_allclose(matrix(ask_stiffness(text), "C"), expected, rtol=1e-12, atol=1e-22)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "bearings"),
    [
        ("arm", "{O: 1e6}"),
        ("arm", "{O: 1e6, E: {radial: 2e6}}"),
        ("slider", "{guide: 1e6}"),
        ("slider", "{guide: {radial: 1e6, moment: 1e4}, A: 3e6, B: 4e6}"),
        ("bent", "{O: 1e7, A: 2e7, B: 3e7, Q: 4e7}"),
        ("slot", "{slit: {radial: 1e6, moment: 1e4}, O: 1e6}"),
        ("leg", "{leg: {radial: 1e6}}"),
        ("leg", "{leg: {radial: 1e6, moment: 2e3}, O: 1e7, D: 2e6}"),
    ],
)
def test_bearings_in_mechanisms(text: str, bearings: str) -> None:
    check(TEXTS[text], f"stiffness.bearings={bearings}")


def test_a_bearing_across_a_guide_and_one_at_a_pin() -> None:
    """The slider (rigid, its motor too) gives across its guide, and turns about the place where it sits on it."""
    only = ["stiffness.elastic={}", "stiffness.actuators={}", "stiffness.at=T"]
    found = matrix(ask_stiffness(SLIDER, *only, "stiffness.bearings={guide: {radial: 1e6, moment: 1e4}}"), "C")
    # Along the guide the rod holds it: B moves across the rod's line only, so that x follows y.
    rod = 0.15 + np.sqrt(0.64 - 0.0675) - 0.3 * np.exp(1j * np.pi / 3)
    slope = -rod.imag / rod.real
    turn, lift = np.array([-0.05, 0.1, 1]), np.array([slope, 1, 0])
    assert_allclose(found, np.outer(turn, turn) / 1e4 + np.outer(lift, lift) / 1e6, rtol=1e-10, atol=1e-16)
    rigid = ["stiffness.elastic={}", "stiffness.actuators={}"]
    pin = matrix(ask_stiffness(ARM, *rigid, "stiffness.bearings={O: 1e6, E: 5e5}"), "C")
    assert_allclose(pin, np.diag([3e-6, 3e-6, 0]), rtol=1e-12, atol=1e-20)


def test_a_bearing_by_a_bare_quantity_is_its_stiffness_across() -> None:
    bare, long = (ask_stiffness(ARM, f"stiffness.bearings={{E: {given}}}") for given in ("5e2 N/mm", "{radial: 5e5}"))
    assert_allclose(matrix(bare, "C"), matrix(long, "C"), rtol=1e-12)


def test_a_link_of_one_point_has_no_beam_and_is_said_to_be_rigid() -> None:
    result = ask_stiffness(SLIDER, "stiffness.elastic={rod: beam, slider: beam}", "stiffness.at=B")
    assert not any("slider" in warning for warning in map(str, result.warnings))
    text = SLIDER.replace("slider: {B: [0, 0], T: [0.1, 0.05]}", "slider: {B: [0, 0]}")
    single = ask_stiffness(text, "stiffness.elastic={rod: beam, slider: beam}", "stiffness.at=B")
    assert "link 'slider' has a single point, and so no beam" in str(single.warnings[0])
    assert_allclose(matrix(single, "C"), matrix(result, "C"), rtol=1e-9, atol=1e-20)


@pytest.mark.slow
def test_an_asked_pin_lies_midway_in_the_bearing_of_its_two_links() -> None:
    """Each rod, else rigid, holds the pin along itself by half of its bearing; between them there is all of it."""
    rigid = ["stiffness.actuators={}", "stiffness.bearings={P: 1e6}"]
    pose = study_of(FIVE_BAR).mechanism.solve({"P.x": 0.05, "P.y": 0.45})
    lines = []
    for elbow in ("E1", "E2"):
        rod = np.array([0.05 - float(pose[f"{elbow}.x"]), 0.45 - float(pose[f"{elbow}.y"])]) / 0.4
        lines.append(np.outer(rod, rod))
    assert_allclose(matrix(ask_stiffness(FIVE_BAR, *rigid), "K"), 2e6 * sum(lines), rtol=1e-9)
    bearings = "stiffness.bearings={P: 1e6, E1: 2e6, O2: 3e6}"
    for link in ("", "  link: b1\n", "  link: b2\n"):
        check(FIVE_BAR.replace("  at: P\n", f"{link}  at: P\n"), bearings)
