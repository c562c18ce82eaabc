"""Friction in closed form: friction circle, wedge, incline, a slide that jams, and what friction takes of the power."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.ground.results import Result


def answer(text: str, *overrides: str, question: str = "dynamics") -> Result:
    result: Result = getattr(mechdesign, question)(study_of(text, *overrides))
    return result


def kinds(result: Result) -> list[str]:
    return [warning.kind for warning in result.warnings]


# A screw's thread unwound: a wedge of the slope alpha is pushed below a ram that bears the load.
WEDGE = """
mechanism:
  parameters: {alpha: 10, mu: 0.1, sole: 0}
  links: {ground: {O: [0, 0], G: [0, 0]}, wedge: {W: [0, 0]}, ram: {R: [0, 0]}}
  joints:
    floor: {prismatic: [ground, wedge], through: O}
    face: {prismatic: [wedge, ram], through: W, direction: 180 - alpha, angle: alpha - 180}
    guide: {prismatic: [ground, ram], through: G, direction: 90, angle: -90}
  drives: {push: {slide: floor}}
  friction: {face: {coefficient: mu}, floor: {coefficient: sole}, guide: {coefficient: sole}}
dynamics:
  sweep: {push: {from: 0, to: 10, step: 5}}
  rates: {push: 5}
  loads: [{at: R, force: [0, -100]}]
"""


INCLINE = """
mechanism:
  parameters: {beta: 25}
  links: {ground: {O: [0, 0]}, block: {B: [0, 0], C: [10, 0]}}
  joints: {plane: {prismatic: [ground, block], direction: beta, point: B}}
  drives: {way: {slide: plane}}
  friction: {plane: {coefficient: 0.3}}
kinematics:
  sweep: {way: {from: 0, to: 20, step: 10}}
  loads: [{at: B, force: [0, -100]}]
"""


def test_what_a_load_alone_does_not_draw_back_is_said_to_lock_itself() -> None:
    slopes = [answer(WEDGE, f"mechanism.parameters.alpha={alpha}") for alpha in (3, 5, 6, 20)]
    assert ["self_locking" in kinds(result) for result in slopes] == [True, True, False, False]
    assert "face" in slopes[0].warnings[0].message
    flat = answer(INCLINE, "mechanism.parameters.beta=16", question="kinematics")
    assert kinds(flat) == ["self_locking"]
    turning = answer(INCLINE, "kinematics.loads=[{at: C, force: [0, -100]}]", question="kinematics")
    assert kinds(turning) == ["incomplete"]
    assert "give its 'length'" in turning.warnings[0].message


def test_a_wedge_jams_where_its_slope_and_the_angle_of_friction_make_a_right_angle() -> None:
    limit = 90 - np.degrees(np.arctan(0.1))
    below, above = (answer(WEDGE, f"mechanism.parameters.alpha={limit + by}") for by in (-0.01, 0.01))
    assert "jammed" not in kinds(below)
    np.testing.assert_allclose(below.main["push_effort"], 100 / np.tan(np.radians(0.01)), rtol=1e-8)
    assert "jammed" in kinds(above)
    assert "undefined" not in [w.kind for w in above.warnings if "expression" in w.message]
    assert np.isnan(above.main["push_effort"]).all()
    assert any("friction in face jams" in w.message for w in above.warnings)


# A cylinder pushes a slider beside its guide.
OFFSET = """
mechanism:
  parameters: {e: 100, long: 50}
  links:
    ground: {O: [0, -e], G: [0, 0]}
    slider: {B: [0, 0], P: [0, -e]}
    leg: {from: O, to: P, telescopic: true}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: {push: {length: leg}}
  sketch: {B: [50, 0], P: [50, -100]}
  friction: {guide: {coefficient: 0.2, length: long}}
dynamics:
  sweep: {push: {from: 20, to: 60, step: 10}}
  loads: [{at: B, force: [-10, 0]}]
"""


@pytest.mark.parametrize("length", [40.0, 39.999, 20.0, 1.0])
def test_a_slider_pushed_beside_its_guide_jams_where_it_is_too_short(length: float) -> None:
    result = answer(OFFSET, f"mechanism.parameters.long={length}")
    assert np.isnan(result.main["push_effort"]).all()
    assert kinds(result) == ["jammed"]
    assert "friction in guide jams" in result.warnings[0].message
    # It still moves where the load draws it on.
    drawn = answer(OFFSET, f"mechanism.parameters.long={length}", "dynamics.loads=[{at: B, force: [10, 0]}]")
    np.testing.assert_allclose(drawn.main["push_effort"], -10 / (1 + 2 * 0.2 * 100 / length), rtol=1e-9)


CRANK = """
mechanism:
  parameters: {mu: 0.1, sole: 0.15}
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: 30, mass: 0.2 kg}
    rod: {from: A, to: B, length: 90, mass: 0.3 kg, center: [40, 0], inertia: 200}
    piston: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, piston], point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [80, 0]}
  friction:
    O: {coefficient: mu, radius: 8}
    A: {coefficient: mu, radius: 5}
    B: {coefficient: mu, radius: 4}
    guide: {coefficient: sole, length: 60}
dynamics:
  sweep: {theta: {from: 2, to: 362, step: 5}}
  rates: {theta: 300 rpm}
  gravity: [0, -9.81 m/s^2]
  loads: [{at: B, force: ["-0.2*B.x_velocity", 0]}]
"""


def test_a_rate_of_a_coefficient_is_that_of_two_studies() -> None:
    text = (
        CRANK
        + """
reliability:
  poses: [{theta: 40}]
  outputs: [theta_effort]
  dimensions: {friction.A.coefficient: 0.01, friction.guide.length: 1, friction.B.radius: 0.1}
"""
    )
    table = answer(text, question="reliability").tables["contributions"]
    names = list(table["source"])
    for name, key, value, step in (
        ("friction.A.coefficient", "A.coefficient", 0.1, 1e-4),
        ("friction.B.radius", "B.radius", 4.0, 1e-3),
    ):
        ends = [
            answer(CRANK, "dynamics.sweep=null", "dynamics.poses=[{theta: 40}]", f"mechanism.friction.{key}={at}")
            for at in (value - step, value + step)
        ]
        slope = (ends[1].main["theta_effort"][0] - ends[0].main["theta_effort"][0]) / (2 * step)
        assert table["sensitivity"][names.index(name)] == pytest.approx(slope, rel=1e-5)


# Three links turn on a pin, which is fixed in the first of them.
THREE = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0], E: [60, 90]}
    crank: [O, A, 40]
    rod: [A, B, 80]
    rocker: [D, B, 60]
    arm: [A, C, 70]
    lever: [E, C, 50]
  drives: [crank]
  sketch: {A: [0, 40], B: [75, 55], C: [40, 60]}
  friction: {A: {coefficient: 0.2, radius: 6}}
dynamics:
  poses: [{crank: 80}]
  rates: {crank: 1}
  loads: [{link: rocker, moment: 900}, {link: lever, moment: -400}]
"""


def test_each_link_on_a_pin_of_three_rubs_against_the_first() -> None:
    table = answer(THREE).tables["joint_forces"]
    rows = [k for k, joint in enumerate(table["joint"]) if joint == "A"]
    assert [table["on"][k] for k in rows] == ["crank", "rod", "arm"]
    carried, *others = rows
    for k in others:
        assert abs(table["moment"][k]) == pytest.approx(0.2 * 6 * table["magnitude"][k], rel=1e-12)
    assert table["moment"][carried] == pytest.approx(-sum(table["moment"][k] for k in others), rel=1e-12)
