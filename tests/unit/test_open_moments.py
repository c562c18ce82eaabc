"""Moments of slides and clamps in a closed chain, by the force method where beams or bearings give."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

# A ring of three slides: equilibrium determines their forces and leaves one moment open.
WEDGE = """
units: {length: m, force: N}
mechanism:
  links:
    ground: {O: [0, 0], U: [5, 0]}
    wedge: {A: [0, 0], B: [1, 0]}
    punch: {points: {C: [0, 0], D: [0, 1]}%(mass)s}
  joints:
    base: {prismatic: [ground, wedge], through: O, point: A}
    face: {prismatic: [wedge, punch], through: B, direction: 30, point: C, angle: -30}
    guide: {prismatic: [ground, punch], through: U, direction: 90, point: D, angle: -90}
  drives: {push: {slide: base}}
  sketch: {A: [1, 0], B: [2, 0], C: [5, 1.7], D: [5, 2.7]}
dynamics: {gravity: [-10, 0], sweep: {push: {from: 1, to: 2, number: 3}}, loads: [{at: D, force: [0, -60]}]}
stiffness: {at: D, link: punch, %(gives)s}
"""


def columns(result: mechdesign.Answer, joint: str, *names: str) -> list[list[float]]:
    """Columns of a joint's force, a value a pose."""
    table = result.tables["joint_forces"]
    rows = table["joint"] == joint
    return [table[name][rows].tolist() for name in names]


def test_bearings_share_a_moment_by_what_they_give() -> None:
    give = {"base": 2e6, "face": 1e6, "guide": 4e6}
    bearings = ", ".join(f"{name}: {{moment: {k}}}" for name, k in give.items())
    result = mechdesign.dynamics(study_of(WEDGE % {"mass": "", "gives": f"bearings: {{{bearings}}}"}))
    assert not result.warnings
    base, face, guide = (np.array(columns(result, name, "moment")[0]) / k for name, k in give.items())
    # The wedge turns on its base, the punch on the wedge; that is what it turns in its guide.
    assert base + face == pytest.approx(guide, rel=1e-12)
    # Equilibrium of the punch about D: the face pushes at C, 1 below.
    fx, moment = (np.array(part) for part in columns(result, "face", "fx", "moment"))
    assert moment + np.array(columns(result, "guide", "moment")[0]) + fx == pytest.approx(0, abs=1e-12)


def test_a_beam_does_not_turn_between_its_rigid_slides() -> None:
    """The mean bending moment of the punch is zero; its weight of 30 N acts to the left in its middle."""
    beam = "sections: {bar: {E: 200 GPa, width: 20 mm, height: 40 mm}}, elastic: {punch: bar}"
    result = mechdesign.dynamics(study_of(WEDGE % {"mass": ", mass: 3, center: [0, 0.5]", "gives": beam}))
    normal, moment = columns(result, "guide", "fx", "moment")
    # At s below D the moment is M - N s + 30 max(0, s - 1/2); its mean is M - N / 2 + 30 / 8.
    assert moment == pytest.approx([n / 2 - 30 / 8 for n in normal], rel=1e-12)


def test_a_rigid_chain_stays_open() -> None:
    result = mechdesign.dynamics(study_of(WEDGE % {"mass": "", "gives": "bearings: {base: {radial: 2e6}}"}))
    assert np.isnan(columns(result, "guide", "moment")).all()
    (caution,) = result.warnings
    assert "base, face, guide" in caution.message


# A table on a leg clamped at both ends, lifted along a carrier: a ring of three slides and two clamps.
CLAMPED = """
units: {length: m, force: N}
mechanism:
  links:
    ground: {O: [0, 0], U: [2, -1]}
    leg: {from: O, to: E, telescopic: true}
    block: {points: {E: [0, 0], F: [0, 1]}}
    carrier: {points: {G: [0, 0], H: [0, 2]}}
  joints:
    root: {fixed: [ground, leg], point: O, angle: 0}
    tip: {fixed: [leg, block], point: E, angle: 0}
    lift: {prismatic: [carrier, block], through: G, direction: 90, point: F, angle: -90}
    track: {prismatic: [ground, carrier], through: U, direction: 30, point: G, angle: -30}
  drives: {push: {slide: track}}
  sketch: {E: [3, 0], F: [3, 1], G: [3, -0.4], H: [3, 1.6]}
dynamics: {poses: [{push: 1.2}, {push: -9}], loads: [{at: block.F, force: [7, -60]}]}
stiffness:
  at: F
  link: block
  poses: [{push: 1.2}]
  loads: [[7, -60, 0]]
  sections: {bar: {E: 200 GPa, width: 20 mm, height: 40 mm}, thin: {E: 70 GPa, width: 20 mm, height: 60 mm}}
  elastic: {leg: bar, block: thin, carrier: thin}
  bearings: {lift: {moment: 3e3}, track: {moment: 5e3, radial: 1e6}, leg: {moment: 2e4}}
"""


def test_moments_are_those_of_stiffness_under_the_same_load() -> None:
    agree(CLAMPED)


def test_the_mass_of_beams_is_spread_along_them() -> None:
    heavy = CLAMPED.replace("height: 60 mm", "height: 60 mm, density: 2700 kg/m^3").replace("loads: [[7, -60, 0]]", "")
    load = "loads: [{at: block.F, force: [7, -60]}]"
    agree(heavy.replace(load, "gravity: [3, -9.81]").replace("link: block", "link: block\n  dynamics: true"))


def agree(text: str) -> None:
    """Joint forces of dynamics are those of stiffness under its load."""
    study = study_of(text)
    result, forces = mechdesign.dynamics(study), mechdesign.stiffness(study).tables["forces"]
    assert not result.main["valid"][1]
    names = {"O": "root", "E": "tip"}
    for k in range(len(forces) - 1):
        name = names.get(forces["joint"][k], forces["joint"][k])
        # Stiffness has the force on the first link by the second; dynamics that on the outer one.
        (moment, unknown), (fx, _), (fy, _) = columns(result, name, "moment", "fx", "fy")
        assert (-fx, -fy, -moment) == pytest.approx([forces[part][k] for part in ("fx", "fy", "mz")], abs=1e-9)
        assert np.isnan(unknown)
