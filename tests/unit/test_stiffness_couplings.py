"""Couplings in a stiffness: closed forms, finite elements with teeth, and the forces that dynamics says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from helpers.frames import Teeth, posed
from helpers.stiffness import ask_stiffness, matrix
from helpers.studies import study_of

import mechdesign

BELT_ARM = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: [O, A, 200]
    forearm: [A, P, 150]
    motor: [O, M, 20]
  drives: [arm, motor]
  couplings:
    elbow: {set: forearm, of: motor, ratio: 1, phase: 0, wheels: belt, radius: 25}
  sketch: {M: [10, 17], A: [190, 60], P: [260, 190]}
stiffness:
  at: P
  actuators: {arm: 1e4 N*m/rad, motor: 2e4 N*m/rad}
  poses: [{arm: 20, motor: 75}]
"""


@pytest.mark.parametrize(
    ("gives", "soft"),
    [
        ("{elbow: 300 N/mm}", 1 / (300 * 25**2)),
        ("{elbow: {moment: 400 N*m/rad}}", 1 / 4e5),
        ("{elbow: {force: 300, moment: 400 N*m/rad}}", 1 / (300 * 25**2) + 1 / 4e5),
        ("{}", 0.0),
    ],
)
def test_an_arm_with_an_elbow_belt(gives: str, soft: float) -> None:
    """The belt is in series with the motor: C = J diag(1/k_arm, 1/k_motor + 1/(k r^2)) J^T."""
    found = matrix(ask_stiffness(BELT_ARM + f"  couplings: {gives}\n"), "C")
    ends = 1j * np.array([200, 150]) * np.exp(1j * np.radians([20, 75]))
    jacobian = np.array([ends.real, ends.imag])
    assert found == pytest.approx(jacobian @ np.diag([1e-7, 0.5e-7 + soft]) @ jacobian.T, rel=1e-12)


def test_a_stiff_coupling_tends_to_a_rigid_one() -> None:
    rigid = matrix(ask_stiffness(BELT_ARM), "C")
    errors = [
        np.abs(matrix(ask_stiffness(BELT_ARM + f"  couplings: {{elbow: {k}}}\n"), "C") - rigid).max()
        for k in (1e6, 1e9)
    ]
    assert errors[1] == pytest.approx(errors[0] / 1000, rel=1e-6)


def test_a_gear_train_reflects_the_stiffness_of_its_motor() -> None:
    """1/k = n1^2 n2^2/k_motor + n2^2/(k_1 r_b^2) + 1/(k_2 r_c^2), wheels of 20, 80 and 30, 60 mm."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0], C: [100, 0], D: [190, 0]}
    one: [O, A, 30]
    two: [C, B, 70]
    three: [D, P, 50]
  drives: [one]
  couplings:
    first: {set: two, of: one, ratio: -0.25, phase: 10}
    second: {set: three, of: two, ratio: -0.5, phase: 10}
stiffness:
  {at: P, link: three, actuators: {one: 1000 N*m/rad}, couplings: {first: 1e4, second: 2e4 N/mm}, poses: [{one: 40}]}
"""
    expected = 0.125**2 / 1e6 + 0.25 / (1e4 * 80**2) + 1 / (2e4 * 60**2)
    assert ask_stiffness(text).main["k_phi"] == pytest.approx(1 / expected, rel=1e-12)


RACK = """
mechanism:
  links:
    ground: {O: [0, 0]}
    pinion: [O, A, 30]
    bar: {Q: [0, 0], R: [80, 0]}
  joints: {guide: {prismatic: [ground, bar], through: O, point: Q}}
  drives: [pinion]
  couplings: {rack: {set: guide, of: pinion, ratio: 0.4, phase: 10}}
  sketch: {A: [20, 20], Q: [30, 0], R: [110, 0]}
stiffness: {at: R, actuators: {pinion: 100 N*m/rad}, couplings: {rack: 4e3 N/mm}, poses: [{pinion: 40}]}
"""


def test_a_slider_on_a_rack() -> None:
    radius = 0.4 * 180 / np.pi
    assert ask_stiffness(RACK).main["k_x"] == pytest.approx(1 / (radius**2 / 1e5 + 1 / 4e3), rel=1e-12)


def test_a_pinion_that_follows_a_rack() -> None:
    text = RACK.replace(
        "{set: guide, of: pinion, ratio: 0.4, phase: 10}", "{set: pinion, of: guide, ratio: 2.5, phase: 0}"
    )
    text = text.replace("drives: [pinion]", "drives: [guide]").replace("{pinion: 100 N*m/rad}", "{guide: 700 N/mm}")
    text = text.replace("at: R", "at: A, link: pinion").replace("{pinion: 40}", "{guide: 16}")
    radius = 0.4 * 180 / np.pi
    assert ask_stiffness(text).main["k_phi"] == pytest.approx(radius**2 / (1 / 700 + 1 / 4e3), rel=1e-12)


def test_a_cam_reflects_the_stiffness_of_its_motor_by_its_slope() -> None:
    text = RACK.replace("of: pinion, ratio: 0.4, phase: 10", 'to: "50 + 20*(1 - cos(pinion.angle))"')
    slope = 20 * np.sin(np.radians(40))
    assert ask_stiffness(text).main["k_x"] == pytest.approx(1 / (slope**2 / 1e5 + 1 / 4e3), rel=1e-12)


# An offset follower with a roller on a cam, whose shaft gives.
VALVE = """
mechanism:
  links:
    ground: {O: [0, 0], G: [6, 0]}
    disc: [O, N, 20]
    stem: {F: [0, 0], T: [60, 0]}
  joints: {valve: {prismatic: [ground, stem], through: G, direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: valve, to: 40 - 10*cos(cam), cam: {link: disc, roller: F, radius: 8}}}
  sketch: {N: [20, 0], F: [6, 30], T: [6, 90]}
"""


def test_a_cam_gives_along_its_normal_and_loads_its_shaft() -> None:
    """A push F on the follower is F/cos(phi) on the cam and its shaft, tan(phi) = (s' - e)/s, and F s' on the motor."""
    text = VALVE + (
        "stiffness: {at: T, actuators: {cam: 100 N*m/rad}, couplings: {lift: 4e3 N/mm}, bearings: {O: 5e3 N/mm},"
        " poses: [{cam: 50}]}\n"
    )
    slope, s = 10 * np.sin(np.radians(50)), 40 - 10 * np.cos(np.radians(50))
    steep = 1 + ((slope - 6) / s) ** 2
    found = matrix(ask_stiffness(text), "C")
    assert found == pytest.approx(np.diag([0, slope**2 / 1e5 + steep * (1 / 4e3 + 1 / 5e3)]), rel=1e-12, abs=1e-16)


FIVE_BAR = """
mechanism:
  parameters: {p: 0}
  links: {ground: {O: [0, 0], C: [100, 0]}, g1: [O, A, 30], g2: [C, D, 35], a: [A, B, 80], b: [D, B, 85]}
  drives: [g1]
  measures: {span: {distance: [A, D]}}
  couplings: {mesh: {set: g2, to: "%s + p", wheels: none}}
  sketch: {A: [30, 5], D: [117, 30], B: [50, 90]}
"""


@pytest.mark.parametrize(
    "law", ["40*sin(g1) + 70 - 0.3*g1", "30 + 0.3*B.x - 0.002*B.y**2", "60 + 0.4*b.angle", "0.7*span + 0.1*a.B.y - 20",
            "90*g1/(20 + g1) + atan2(B.y, B.x)"],
)  # fmt: skip
def test_a_coupling_by_any_law_is_that_of_the_motions_it_allows(law: str) -> None:
    """Rigid links: C = sum of j j^T/k, j the motions by the drive and by the coupling's own deflection."""
    step, moves = 1e-4, []
    for drive, phase in ((step, 0.0), (0.0, step)):
        sides = [study_of(FIVE_BAR % law, f"mechanism.parameters.p={sign * phase}").mechanism.solve(
            {"g1": [20 + sign * drive]}) for sign in (1, -1)]  # fmt: skip
        moves.append([(sides[0][name][0] - sides[1][name][0]) / np.radians(2 * step) for name in ("B.x", "B.y")])
    expected = np.transpose(moves) @ np.diag([1 / 4e5, 1 / 7e5]) @ moves
    section = "stiffness: {at: B, actuators: {g1: 4e5}, couplings: {mesh: {moment: 7e5}}, poses: [{g1: 20}]}\n"
    assert matrix(ask_stiffness(FIVE_BAR % law + section), "C") == pytest.approx(expected, rel=1e-6)


# A five-bar whose cranks mesh, each with its wheel, the second on a bracket that bends.
GEARED = """
mechanism:
  links:
    ground: {O: [0, 0]}
    frame: {O: [0, 0], C: [100, 0]}
    one: [O, A, 30]
    two: [C, D, 35]
    left: [A, B, 80]
    right: [D, B, 85]
  joints: {wall: {fixed: [ground, frame], point: O, angle: 0}}
  drives: {theta: {angle: one}}
  couplings: {gears: {set: two, to: 3*frame.angle - 2*one.angle + 80, pressure_angle: %s}}
  sketch: {C: [100, 0], A: [30, 5], D: [117, 30], B: [50, 90]}
stiffness:
  at: B
  sections: {bar: {E: 2e5, width: 10, height: 15}}
  elastic: {frame: bar, one: bar, left: bar, two: bar}
  bearings: {A: 1e4 N/mm, C: 3e4 N/mm}
  actuators: {theta: 2e3 N*m/rad}
  couplings: {gears: 5e3 N/mm}
  loads: [[0, -50], [0, 50], {at: D, force: [20, 10]}]
  poses: [{theta: 15}, {theta: 35}]
"""


PULLED = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: [O, A, 100]
    forearm: [A, P, 80]
    motor: [O, M, 20]
  drives: [arm, motor]
  couplings: {elbow: {set: forearm, to: motor*0.5 + 0.5*arm.angle, wheels: belt, radius: 20}}
  sketch: {M: [20, 5], A: [95, 30], P: [120, 105]}
"""
STRAPPED = (
    PULLED
    + """
stiffness:
  at: P
  sections: {bar: {E: 2e5, width: 10, height: 15}}
  elastic: {arm: bar, forearm: bar, motor: bar}
  bearings: {A: 1e4 N/mm, O: 3e4 N/mm}
  actuators: {arm: 2e3 N*m/rad}
  couplings: {elbow: 300 N/mm}
  loads: [[0, -50], [0, 50]]
  poses: [{arm: 15, motor: 40}, {arm: 35, motor: 90}]
"""
)


# An arm that bends, with a roller on a cam whose shaft gives.
ROCKED = """
mechanism:
  links:
    ground: {O: [0, 0], P: [-60, 40]}
    disc: [O, N, 20]
    arm: {from: P, to: H, length: 100, points: {F: [60, -10]}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: arm, to: 8 - 12*cos(cam), cam: {link: disc, roller: F, radius: 8}}}
  sketch: {N: [20, 0], H: [40, 35]}
stiffness:
  at: H
  sections: {bar: {E: 2e5, width: 10, height: 15}}
  elastic: {arm: bar}
  bearings: {O: 1e4 N/mm, P: 3e4 N/mm}
  actuators: {cam: 200 N*m/rad}
  couplings: {lift: 5e3 N/mm}
  loads: [[0, -50], [0, 50]]
  poses: [{cam: 70}, {cam: 200}]
"""


def rolling(pose: Any, _: int) -> Teeth:
    """The cam of ROCKED presses square to the motion of the roller against it."""
    turn = np.radians(pose["disc.angle"])
    arm = (60 - 10j) * np.exp(1j * np.radians(8 - 12 * np.cos(turn)))
    roller = -60 + 40j + arm
    normal = -1j * (1j * arm * np.radians(12) * np.sin(turn) - 1j * roller)
    normal *= np.sign((normal * np.conj(roller)).real) / abs(normal)
    return Teeth((("arm", "F"), ("disc", "O")), ((complex(roller - 8 * normal), complex(normal)),))


def meshing(pressure: float) -> Callable[[Any, int], Teeth]:
    """The mesh of GEARED: wheel two, of 100/3 mm, touches wheel one at x = 200/3."""

    def teeth(_: Any, side: int) -> Teeth:
        push = -1j + side * np.tan(np.radians(pressure))
        return Teeth((("two", "C"), ("one", "O")), ((200 / 3 + 0j, push),))

    return teeth


def belt(pose: Any, side: int) -> Teeth:
    """The belt of STRAPPED on pulleys of 20 and 10 mm: its strand on the right pulls, on the left, or half of both."""
    driven, driver = (complex(pose[f"{point}.x"], pose[f"{point}.y"]) for point in "AO")
    way = (driver - driven) / abs(driver - driven)
    lean = (20 - 10) / abs(driver - driven)
    pushes = []
    for sign, share in ((1, (1 + side) / 2), (-1, (1 - side) / 2)):
        normal = way * (lean - sign * 1j * np.sqrt(1 - lean**2))
        begin, end = driven + 20 * normal, driver + 10 * normal
        pushes.append((begin, sign * share * (end - begin) / abs(end - begin)))
    return Teeth((("forearm", "A"), ("motor", "O")), tuple(pushes))


@pytest.mark.parametrize(
    ("text", "coupling", "of_side", "odd"),
    [
        (GEARED % 0.0, "gears", meshing(0.0), False),
        (GEARED % 20.0, "gears", meshing(20.0), True),
        (STRAPPED, "elbow", belt, True),
        (ROCKED, "lift", rolling, False),
    ],
    ids=["teeth along", "teeth", "belt", "cam"],
)
def test_wheels_on_links_and_pins_that_give_are_those_of_finite_elements(
    text: str, coupling: str, of_side: Callable[[Any, int], Teeth], odd: bool
) -> None:
    """In general by both flanks or strands; under a load by the one that takes it."""
    study = study_of(text)
    result = mechdesign.stiffness(study)
    moves = result.tables["deflections"]
    loads = len(moves) // 2

    def frame(row: int, side: int) -> np.ndarray:
        pose = study.mechanism.solve(study.stiffness.poses[row])
        return posed(study, row, {coupling: of_side(pose, side)}).compliance()

    for row in range(2):
        assert matrix(result, "C", row) == pytest.approx(frame(row, 0), rel=1e-7)
        flanks, pressed = [frame(row, side) for side in (1, -1)], []
        for k, load in enumerate(([0, -50], [0, 50])):
            moved = [moves[name][loads * row + k] for name in ("dx", "dy")]
            pressed.append([moved == pytest.approx(flank @ load, rel=1e-7) for flank in flanks])
        assert sorted(pressed) == ([[False, True], [True, False]] if odd else [[True, True], [True, True]])


RINGED = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: [O, A, 60]
    planet: [A, P, 15]
    sun: [O, S, 10]
  drives: [arm]
  couplings:
    inner: {set: planet, to: arm.angle - 3*(sun.angle - arm.angle)}
    outer: {set: planet, to: arm.angle - 5*arm.angle}
  sketch: {A: [50, 30], P: [60, 40], S: [8, 5]}
"""


@pytest.mark.parametrize(
    ("mechanism", "poses", "loads"),
    [
        (GEARED.partition("stiffness:")[0] % 20, "[{theta: 15}, {theta: 35}]", "[{at: B, force: [0, %s]}]"),
        (RACK.partition("stiffness:")[0], "[{pinion: 40}]", "[{at: R, force: [%s, 5]}]"),
        (PULLED, "[{arm: 15, motor: 40}]", "[{at: P, force: [3, %s]}]"),
        (RINGED, "[{arm: 10}, {arm: 60}]", "[{link: sun, moment: %s}]"),
        (VALVE, "[{cam: 50}, {cam: 200}]", "[{at: T, force: [3, %s]}]"),
    ],
)
@pytest.mark.parametrize("push", [40.0, -40.0])
def test_rigid_links_and_teeth_bear_what_dynamics_says(mechanism: str, poses: str, loads: str, push: float) -> None:
    at = next(point for point in ("B", "R", "P", "T") if f"{point}: [" in mechanism)
    section = f"{{poses: {poses}, loads: {loads % push}}}\n"
    study = study_of(f"{mechanism}stiffness: {{at: {at}, dynamics: true}}\ndynamics: {section}")
    ours, theirs = mechdesign.stiffness(study).tables["forces"], mechdesign.dynamics(study).tables["joint_forces"]
    largest, compared = theirs["magnitude"].max(), 0
    for joint in dict.fromkeys(theirs["joint"]):
        some, others = (table["joint"] == joint for table in (ours, theirs))
        if some.sum() != others.sum():
            continue
        sign = 1 if ours["on"][some][0] == theirs["on"][others][0] else -1
        for axis in ("fx", "fy"):
            assert sign * ours[axis][some] == pytest.approx(theirs[axis][others], abs=1e-12 * largest), joint
        compared += 1
    assert compared >= 2
    assert {coupling.name for coupling in study.mechanism.couplings} <= {*ours["joint"]}


@pytest.mark.slow
def test_designs_of_other_radii_are_as_stiff_as_each_alone() -> None:
    text = BELT_ARM.replace("radius: 25", "radius: r").replace("mechanism:", "mechanism:\n  parameters: {r: 25}")
    text += "  couplings: {elbow: 30 N/mm}\n"
    asked = "optimize: {variables: {r: {from: 20, to: 30, step: 5}}, minimize: stiffness.compliance.C11}\n"
    designs = mechdesign.optimize(study_of(text + asked)).tables["designs"]
    alone = [matrix(ask_stiffness(text, f"mechanism.parameters.r={r}"), "C")[0, 0] for r in designs["r"]]
    assert len({*np.round(alone, 9)}) == 3
    assert designs["stiffness.compliance.C11"] == pytest.approx(alone, rel=1e-9)


def test_mistakes_are_named() -> None:
    cases = {
        "{elbow: 30 N*m/rad}": "where a stiffness is expected",
        "{ellbow: 30}": "did you mean 'elbow'",
        "{elbow: {}}": "has a 'force' stiffness or",
    }
    for gives, message in cases.items():
        with pytest.raises(mechdesign.StudyError) as caught:
            study_of(BELT_ARM + f"  couplings: {gives}\n")
        assert message in str(caught.value)
    with pytest.raises(mechdesign.StudyError, match="no pitch circles"):
        study_of(BELT_ARM.replace(", radius: 25", "") + "  couplings: {elbow: 30}\n")
    with pytest.raises(mechdesign.StudyError, match=r"no angle follows, but guide\.slide"):
        study_of(RACK.replace("{rack: 4e3 N/mm}", "{rack: {moment: 3}}"))
