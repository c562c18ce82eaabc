"""What a study may say of friction, and what it says of a mistake."""

from __future__ import annotations

import pytest
from helpers.studies import study_of

import mechdesign

CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 30], rod: [A, B, 90], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], point: B}}
  drives: [crank]
  sketch: {A: [0, 30], B: [85, 0]}
dynamics: {poses: [{crank: 40}], loads: [{at: B, force: [-100, 0]}]}
"""
YOKE = """
mechanism:
  links: {ground: {O: [0, 0], G: [0, -50]}, crank: [O, A, 30], yoke: {Y: [0, 0]}}
  joints:
    slot: {slot: yoke, point: A, direction: 90}
    guide: {prismatic: [ground, yoke], through: G}
  drives: [crank]
  sketch: {A: [0, 30], Y: [0, -50]}
dynamics: {poses: [{crank: 40}], loads: [{at: Y, force: [-100, 0]}]}
"""


@pytest.mark.parametrize(("text", "friction", "message"), [
    (CRANK, "{a: {coefficient: 0.1, radius: 5}}", "there is no pin, slide or telescopic link 'a'"),
    (CRANK, "{A: {coefficient: 0.1}}", "friction of the pin 'A' turns against its radius: give 'radius'"),
    (CRANK, "{A: {coefficient: 0.1, radius: 5, length: 3}}", "a pin has no 'length'; give its 'radius'"),
    (CRANK, "{A: {coefficient: -0.1, radius: 5}}", "coefficient"),
    (CRANK, "{guide: {coefficient: 0.1, radius: 5}}", "'guide' slides: its friction has no 'radius'"),
    (CRANK, "{guide: {coefficient: 0.1, length: 0}}", "length"),
    (CRANK, "{guide: {}}", "coefficient"),
    (YOKE, "{A: {coefficient: 0.1, radius: 5}}", "no pin turns at 'A'; it slides in 'slot': give the friction of that"),
    (YOKE, "{Y: {coefficient: 0.1, radius: 5}}", "no pin turns at 'Y'; leave it out"),
    (YOKE, "{slot: {coefficient: 0.1, length: 5}}", "the pin in a slot bears no moment"),
])  # fmt: skip
def test_a_mistake_is_said_with_its_cure(text: str, friction: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError) as error:
        study_of(text, f"mechanism.friction={friction}")
    assert message in str(error.value)


def test_a_pin_in_a_slot_rubs_against_its_walls() -> None:
    smooth = mechdesign.dynamics(study_of(YOKE)).main["crank_effort"][0]
    rubbed = mechdesign.dynamics(study_of(YOKE, "mechanism.friction={slot: {coefficient: 0.2}}")).main
    # The pin goes up and presses on the slot with 100 N.
    lift = 0.2 * 100 * 30 * 0.7660444431189780
    assert rubbed["crank_effort"][0] - smooth == pytest.approx(lift, rel=1e-12)


def test_what_does_not_move_does_not_rub() -> None:
    text = CRANK.replace("{crank: 40}", "{crank: 0}")
    table = mechdesign.dynamics(study_of(text, "mechanism.friction={guide: {coefficient: 0.2}}")).main
    assert table["crank_effort"][0] == pytest.approx(0, abs=1e-12)


def test_a_moment_that_equilibrium_leaves_open_has_no_length() -> None:
    text = """
mechanism:
  links: {ground: {O: [0, 0], G: [40, 0]}, wedge: {W: [0, 0]}, ram: {R: [0, 0]}}
  joints:
    floor: {prismatic: [ground, wedge], through: O}
    face: {prismatic: [wedge, ram], through: W, direction: 170, angle: -170}
    guide: {prismatic: [ground, ram], through: G, direction: 90, angle: -90}
  drives: {push: {slide: floor}}
  friction: {face: {coefficient: 0.1, length: 5}}
dynamics: {poses: [{push: 10}], loads: [{at: R, force: [0, -100]}]}
"""
    with pytest.raises(mechdesign.StudyError) as error:
        study_of(text)
    assert "equilibrium leaves open which moment 'face' bears" in str(error.value)


def test_friction_without_loads_has_no_columns_in_kinematics() -> None:
    text = CRANK.replace("dynamics:", "kinematics:").replace(", loads: [{at: B, force: [-100, 0]}]", "")
    table = mechdesign.kinematics(study_of(text, "mechanism.friction={A: {coefficient: 0.1, radius: 5}}")).main
    assert "efficiency" not in table.names


def test_the_teeth_of_gears_press_their_pins_with_friction() -> None:
    gears = """
mechanism:
  links: {ground: {O: [0, 0], Q: [60, 0]}, sun: [O, A, 10], wheel: [Q, B, 10]}
  couplings: {mesh: {set: wheel, of: sun, ratio: -0.5}}
  drives: [sun]
  sketch: {A: [10, 0], B: [70, 0]}
  friction: {O: {coefficient: 0.2, radius: 5}, Q: {coefficient: 0.2, radius: 5}}
dynamics: {poses: [{sun: 30}], loads: [{link: wheel, moment: 400}]}
"""
    table = mechdesign.dynamics(study_of(gears)).main
    # The wheels have radii of 20 and 40 mm; their teeth, with 20 degrees of pressure, push with F/cos(20 deg) at both.
    share = 0.2 * 5 / 0.9396926207859084
    force = 400 / (40 - share)
    assert table["sun_effort"][0] == pytest.approx(force * (20 + share), rel=1e-12)
