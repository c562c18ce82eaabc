"""A motion as a curve: what lies between the poses of sweeps and paths, by closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

FIVE_BAR = """\
mechanism:
  links:
    ground: {O1: [-50, 10], O2: [50, -20]}
    l: [O1, A, 100]
    lr: [A, C, 140]
    r: [O2, B, 110]
    rr: [B, C, 130]
  drives: {q1: {angle: l}, q2: {angle: r, from: l}}
  sketch: {A: [-120, 80], B: [120, 60], C: [10, 150]}
"""
ARM = """\
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 100], fore: [E, P, 80]}
  drives: [upper, fore]
  sketch: {E: [-50, 60], P: [-100, 10]}
"""
FOUR_BAR = """\
mechanism:
  parameters: {a: 30}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
MEASURES
kinematics: {sweep: {crank: {from: 0, to: 360, step: 10}}, outputs: OUTPUTS}
"""

LOADED = """\
mechanism:
  parameters: {a: 30}
  links: {ground: {O: [0, 0]}, crank: [O, A, a]}
  drives: [crank]
  sketch: {A: [30, 0]}
kinematics: {sweep: {crank: {from: -60, to: 60, step: 40}}, loads: [{at: A, force: [0, 10]}]}
optimize: {minimize: GOAL, variables: {a: {from: 10, to: 50, step: 10}}}
"""


def four_bar(outputs: str = "[rocker.angle]", measures: str = "") -> str:
    return FOUR_BAR.replace("OUTPUTS", outputs).replace("MEASURES", measures)


def row(result: mechdesign.Answer, output: str) -> dict[str, float]:
    table = result.tables["extremes"]
    (k,) = np.flatnonzero(table["output"] == output)
    return {name: table[name][k] for name in table.names if name not in ("output", "unit")}


def judged(text: str, *requirements: str) -> list[mechdesign.Verdict]:
    study = study_of(text + "requirements:\n" + "".join(f"  - {{{line}}}\n" for line in requirements))
    return list(mechdesign.requirements(study, mechdesign.kinematics(study)))


@pytest.mark.slow
def test_a_circle_of_seven_poses_has_the_extremes_of_the_circle() -> None:
    text = FIVE_BAR + "kinematics: {path: {C: {circle: {center: [10, 150], radius: 35}, points: 7}}, outputs: [C]}\n"
    result = mechdesign.kinematics(study_of(text))
    assert result.tables["motion"]["C.x"].min() > -22
    x, y = row(result, "C.x"), row(result, "C.y")
    assert (x["min"], x["max"], y["min"], y["max"]) == pytest.approx((-25, 45, 115, 185), rel=1e-13)
    assert (x["min_at"], y["max_at"]) == pytest.approx((3.5, 1.75), rel=1e-7)
    wanted = ["result: kinematics.C.x, at_least: -24.99", "result: kinematics.extremes.C.x.min, at_least: -24.99"]
    assert [verdict.met for verdict in judged(text, *wanted)] == [False, False]
    wanted = ["result: kinematics.C.x, at_least: -25.01", "result: kinematics.extremes.C.x.min, at_least: -25.01"]
    assert [verdict.met for verdict in judged(text, *wanted)] == [True, True]


@pytest.mark.slow
def test_a_line_that_leaves_the_reach_between_its_poses_meets_nothing() -> None:
    # The arm reaches no nearer to its base than 100 - 80.
    text = ARM + "kinematics: {path: {P: {line: [[-100, 10], [100, 10]], points: 4}}, outputs: [P, E]}\n"
    result = mechdesign.kinematics(study_of(text))
    assert result.tables["motion"]["valid"].all()
    assert result.tables["limits"]["P.x"] == pytest.approx([-np.sqrt(300), np.sqrt(300)])
    assert result.tables["limits"]["joint"].tolist() == ["O E P", "O E P"]
    refused, allowed = judged(
        text, "result: kinematics.E.y, at_most: 200", "result: kinematics.E.y, at_most: 200, unassembled: allowed"
    )
    assert (refused.met, allowed.met) == (False, True)
    missing = f"{2 * np.sqrt(300) / 200:.1%}".replace("%", " %")
    assert f"{missing} of the motion is missing" in refused.note
    assert refused.note == allowed.note


def test_a_polyline_has_its_extremes_in_its_sides_and_at_its_corners() -> None:
    # The side from (-90, 40) to (90, 40) passes (0, 40), the nearest to the base.
    path = "{through: [[-90, 40], [90, 40], [90, 100]]}"
    measures = "  measures: {reach: {distance: [O, P]}}\n"
    result = mechdesign.kinematics(
        study_of(ARM + measures + f"kinematics: {{path: {{P: {path}}}, outputs: [reach]}}\n")
    )
    reach = row(result, "reach")
    assert (reach["min"], reach["max"]) == pytest.approx((40, np.hypot(90, 100)), rel=1e-12)


@pytest.mark.slow
def test_a_design_that_does_not_assemble_in_between_is_not_the_best() -> None:
    # The crank turns where 100 + a does not exceed 90 + 60; it then swings the rocker between two stretched poses.
    optimize = "optimize:\n  maximize: {GOAL}\n  variables: {a: {from: 20, to: 60, step: 5}}\n"
    goal = "result: kinematics.extremes.rocker.angle.range"
    results = [
        mechdesign.optimize(study_of(four_bar() + optimize.replace("GOAL", text)))
        for text in (goal, f"{goal}, unassembled: allowed")
    ]
    assert [result.tables["optimum"]["a"][0] for result in results] == [50, 60]
    assert ["% of the motion is missing" in " ".join(map(str, result.warnings)) for result in results] == [False, True]


def test_an_angle_of_an_expression_goes_on_without_a_jump() -> None:
    # D sees B, and so does the rocker; the angle passes half a turn in its mirror image.
    measures = '  measures: {behind: "atan2(-(B.y - D.y), D.x - B.x)", rest: "B.y - D.y"}\n'
    result = mechdesign.kinematics(study_of(four_bar("[rocker.angle, behind]", measures)))
    rocker, behind = row(result, "rocker.angle"), row(result, "behind")
    assert behind["range"] == pytest.approx(rocker["range"], rel=1e-10)
    table = result.tables["extremes"]
    assert table["unit"][table["output"].tolist().index("behind")] == "deg"


@pytest.mark.slow
def test_a_measure_of_angles_is_followed_over_whole_turns() -> None:
    text = """\
mechanism:
  links: {ground: {O: [0, 0], Q: [200, 0]}, crank: [O, A, 50], crank2: [Q, B, 40]}
  drives: [crank, DRIVE]
  measures: {mesh: crank2.angle + 2*crank.angle}
  sketch: {A: [50, 0], B: [240, 0]}
"""
    both = mechdesign.kinematics(
        study_of(text.replace("DRIVE", "crank2") + "kinematics: {poses: [{crank: 210, crank2: -150}], outputs: [B]}\n")
    )
    mesh = mechdesign.kinematics(
        study_of(text.replace("DRIVE", "crank2") + "kinematics: {poses: [{crank: 210, mesh: 270}], outputs: [B]}\n")
    )
    for name in ("B.x", "B.y"):
        assert mesh.tables["motion"][name] == pytest.approx(both.tables["motion"][name])
    sweep = "kinematics: {sweep: {crank: {from: 0, to: 360, step: 20}, mesh: 270}, outputs: [B, crank2.angle]}\n"
    turn = mechdesign.kinematics(study_of(text.replace("DRIVE", "crank2") + sweep)).tables["motion"]
    assert turn["valid"].all()
    wanted = np.radians(270 - 2 * turn["crank"])
    assert turn["B.x"] == pytest.approx(200 + 40 * np.cos(wanted))
    assert np.diff(turn["crank2.angle"]) == pytest.approx(-40)


@pytest.mark.parametrize(
    "motion",
    ["{poses: [{upper: 0, fore: 20}, {upper: 10, fore: 30}]}",
     "{sweep: {upper: {from: 0, to: 40, step: 20}, fore: {from: 20, to: 60, step: 20}}}"],
)  # fmt: skip
def test_a_verdict_on_poses_alone_says_so(motion: str) -> None:
    (verdict,) = judged(f"{ARM}kinematics: {motion}\n", "result: kinematics.P.x, at_most: 1000")
    assert verdict.met
    assert "of the asked poses only" in str(verdict)


def test_a_verdict_on_a_motion_says_nothing_of_poses() -> None:
    (verdict,) = judged(four_bar(), "result: kinematics.rocker.angle, at_most: 1000")
    assert verdict.met
    assert "asked poses" not in str(verdict)


@pytest.mark.slow
def test_a_goal_of_magnitudes_does_not_take_the_least_signed() -> None:
    # The drive's moment is -10 N P.x: of the shortest crank the least in magnitude, of the longest the lowest.
    study = study_of(LOADED.replace("GOAL", "{result: kinematics.crank_effort, abs: true}"))
    assert (mechdesign.kinematics(study).tables["motion"]["crank_effort"] < 0).all()
    signed = study_of(LOADED.replace("GOAL", "kinematics.crank_effort"))
    assert [mechdesign.optimize(each).tables["optimum"]["a"][0] for each in (study, signed)] == [10, 50]


def test_numbers_without_poses_take_no_word_for_poses_that_are_missing() -> None:
    text = LOADED.replace("GOAL", "{result: a, unassembled: allowed}")
    with pytest.raises(mechdesign.StudyError, match="'a' is of no poses that could be missing"):
        study_of(text)


def test_designs_that_tie_are_no_optimum_without_a_word() -> None:
    # Where the load stands along the crank, its moment is zero for every length.
    text = LOADED.replace("GOAL", "kinematics.crank_effort")
    (warning,) = mechdesign.optimize(study_of(text, "kinematics.sweep.crank={from: -90, to: 90, step: 30}")).warnings
    assert warning.message.startswith("all 5 feasible designs tie: kinematics.crank_effort is")


def test_rates_at_a_corner_are_those_behind_it_and_a_warning_says_so() -> None:
    path = "{path: {P: {through: [[-90, 40], [0, 40], [90, 40], [90, 100]]}}, speed: 50, outputs: [P]}"
    result = mechdesign.kinematics(study_of(ARM + f"kinematics: {path}\n"))
    motion = result.tables["motion"]
    assert motion["P.x_velocity"] == pytest.approx([50, 50, 0, 0], abs=1e-9)
    assert motion["P.y_velocity"] == pytest.approx([0, 0, 50, 50], abs=1e-9)
    (warning,) = map(str, result.warnings)
    assert warning.startswith("the path has corners at 1 pose, the first: P.x = 90 mm, P.y = 40 mm")


SMALL_CIRCLE = "{path: {C: {circle: {center: [20, 25], radius: 20}, points: 25}}, outputs: [J]}"
REACH = """\
mechanism:
  links: {ground: {O: [0, 0]}, up: [O, J, 100], fore: [J, C, 80]}
  drives: {q1: {angle: up}, q2: {angle: fore, from: up}}
  sketch: {J: [0, 100], C: [80, 100]}
"""


def circle_of_reach() -> np.ndarray:
    """Joints of the arm while C passes the small circle outside its inner reach of 20, the dead centres among them."""
    c = 20 + 25j + 20 * np.exp(1j * np.linspace(0, 2 * np.pi, 200_001))
    c = c[np.abs(c) >= 20]
    along = (100**2 - 80**2 + np.abs(c) ** 2) / (2 * np.abs(c))
    # Where both circles of radius 20 meet the arm is folded along the line to C.
    half = abs(20 + 25j) / 2
    meet = (20 + 25j) / abs(20 + 25j) * (half + np.array([1j, -1j]) * np.sqrt(20**2 - half**2))
    return np.concatenate([c / np.abs(c) * (along + 1j * np.sqrt(100**2 - along**2)), 5 * meet])


def test_a_circle_beyond_the_inner_reach_is_followed_to_its_dead_centres() -> None:
    result = mechdesign.kinematics(study_of(REACH + f"kinematics: {SMALL_CIRCLE}\n"))
    joints = circle_of_reach()
    for output, values in (("J.x", joints.real), ("J.y", joints.imag)):
        extremes = row(result, output)
        assert (extremes["min"], extremes["max"]) == pytest.approx((values.min(), values.max()), abs=1e-5)
    assert row(result, "J.x")["max"] == pytest.approx(result.tables["limits"]["J.x"].max(), rel=1e-9)


def test_a_limit_behind_a_dead_centre_ends_the_motion_there() -> None:
    limited = REACH + "  measures: {x: J.x}\n  limits: [{measure: x, max: 60}]\n"
    result = mechdesign.kinematics(study_of(limited + f"kinematics: {SMALL_CIRCLE}\n"))
    assert result.tables["limits"]["kind"].tolist() == ["dead centre", "limit"]
    assert row(result, "J.x")["max"] == pytest.approx(60, rel=1e-12)


@pytest.mark.slow
def test_least_magnitudes_do_not_jump_over_zero_at_a_corner() -> None:
    # C turns back at (110, 60): the rate of the elbow changes its sign there, and its least magnitude is at a row.
    path = "kinematics: {path: {C: [[60, 60], [110, 60], [60, 60]]}, speed: 100, outputs: [C]}\n"
    c = np.linspace(60, 110, 100_001) + 60j
    elbow = np.arccos((np.abs(c) ** 2 - 100**2 - 80**2) / (2 * 100 * 80))
    rate = np.abs(np.degrees(np.gradient(elbow, c.real))) * 100
    below, above = judged(
        REACH + path,
        f"result: kinematics.q2_velocity, abs: true, at_least: {rate.min() - 0.01}",
        f"result: kinematics.q2_velocity, abs: true, at_least: {rate.min() + 0.01}",
    )
    assert (below.met, above.met) == (True, False)


@pytest.mark.slow
def test_a_limit_that_is_touched_ends_no_motion() -> None:
    text = """\
mechanism:
  links: {ground: {O: [0, 0], G: [0, 0]}, crank: [O, A, 30], rod: [A, B, 100], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [95, 0]}
  measures: {x: B.x}
  limits: [{measure: x, max: 130}]
kinematics: {sweep: {theta: {from: -100, to: 260, step: 20}}, outputs: [B.x]}
"""
    (verdict,) = judged(text, "result: kinematics.B.x, at_most: 130.001")
    assert verdict.met
    assert not len(mechdesign.kinematics(study_of(text)).tables["limits"])


@pytest.mark.nightly
def test_a_rate_is_infinite_where_a_spline_crosses_the_reach() -> None:
    path = """\
kinematics:
  path: {C: {through: [[-38.4, -72.1], [-62.1, -70.7], [-57.2, -60.7], [-59.7, -45.3], [-46.2, -49.7]], spline: true}}
  speed: 100
  outputs: [J]
"""
    text = REACH.replace("[O, J, 100]", "[O, J, 43]").replace("[J, C, 80]", "[J, C, 55]")
    text = text.replace("{J: [0, 100], C: [80, 100]}", "{J: [0, 43], C: [55, 43]}") + path
    for verdict in judged(
        text,
        *(f"result: kinematics.{q}_velocity, abs: true, at_most: 1e15, unassembled: allowed" for q in ("q1", "q2")),
    ):
        assert not verdict.met
        assert verdict.worst == np.inf
    assert not any("corners" in words for words in map(str, mechdesign.kinematics(study_of(text)).warnings))
