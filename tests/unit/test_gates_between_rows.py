"""Gates, goals and sweeps of what has a row a pose: the same between the rows, whatever their step."""

import itertools
import math

import numpy as np
import pytest

import mechdesign

pytestmark = pytest.mark.slow

FOUR_BAR = """
mechanism:
  parameters: {r: 30}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: {from: O, to: A, length: r, mass: 1 kg, center: [15, 0], inertia: 100}
    coupler: {from: A, to: B, length: 100, mass: 1 kg, center: [50, 10], inertia: 1000, points: {P: [60, -60]}}
    rocker: {from: D, to: B, length: 80, mass: 1 kg, center: [40, 0], inertia: 1000}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 0], B: [90, 80]}
  targets: {P.y: 3*sin(theta)}
"""
FORCES = """
dynamics:
  sweep: {theta: {from: 0, to: 360, step: STEP}}
  rates: {theta: 3000 rpm}
  gravity: [0, -9.81 m/s^2]
"""
# A piston pushes a crank through both dead centres, where it holds it no longer.
PUSHED = """
mechanism:
  parameters: {r: 30}
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: r, mass: 1 kg, center: [10, 3], inertia: 20}
    rod: {from: A, to: B, length: 100}
    piston: {B: [0, 0]}
  joints: {way: {prismatic: [ground, piston], through: O}}
  drives: {x: {slide: way}}
  sketch: {A: [5, 29], B: [100, 0]}
dynamics:
  sweep: {crank.angle: {from: 7, to: 367, step: 10}}
  gravity: [0, -9.81 m/s^2]
  loads: [{at: A, force: [-10, 3]}]
"""


def verdicts(text, command):
    study = mechdesign.load(text=text)
    return mechdesign.requirements(study, getattr(mechdesign, command)(study))


def asked(*requirements):
    return "requirements:\n" + "".join(f"  - {one}\n" for one in requirements)


def extremes(result, output):
    table = result.tables["extremes"]
    return {name: table[name][table.where(output=output)][0] for name in ("min", "max", "peak", "mean", "rms")}


@pytest.fixture(scope="module")
def dense():
    return mechdesign.dynamics(mechdesign.load(text=FOUR_BAR + FORCES.replace("STEP", "0.1"))).tables["joint_forces"]


@pytest.mark.parametrize("where", ["where: {joint: A}, ", "where: {joint: B}, ", "where: {joint: O, on: crank}, ", ""])
@pytest.mark.parametrize("column", ["magnitude", "fx", "fy"])
def test_a_gate_on_joint_forces_is_that_of_rows_a_hundred_times_as_dense(dense, column, where):
    rows = np.ones(len(dense), dtype=bool)
    for key, word in (("joint", "A"), ("joint", "B"), ("joint", "O")):
        if f"{key}: {word}" in where:
            rows &= dense.where(**{key: word})
    gates = asked(f"{{result: dynamics.{column}, {where}at_most: 1e9}}",
                  f"{{result: dynamics.{column}, {where}at_least: -1e9}}")  # fmt: skip
    high, low = verdicts(FOUR_BAR + FORCES.replace("STEP", "15") + gates, "dynamics")
    assert not high.note
    for verdict, end in ((high, dense[column][rows].max()), (low, dense[column][rows].min())):
        assert verdict.worst == pytest.approx(end, abs=1e-4 * np.abs(dense[column][rows]).max())
        assert "joint " in verdict.place


def test_gate_statistic_extremes_and_sweep_of_a_joint_force_agree():
    text = FOUR_BAR + FORCES.replace("STEP", "15") + asked(
        "{result: dynamics.B_force, at_most: 1}", "{result: dynamics.magnitude, where: {joint: B}, at_most: 1}",
        "{result: dynamics.B_force.max, at_most: 1}", "{result: dynamics.B_force.rms, at_most: 1}",
        "{result: dynamics.B_force.mean, at_most: 1}", "{result: dynamics.B_force.min, at_most: 1}",
    )  # fmt: skip
    study = mechdesign.load(
        text=text + "matrix: {vary: {mechanism.parameters.r: [30, 25]}, results: [dynamics.B_force.max]}"
    )
    result = mechdesign.dynamics(study)
    told = extremes(result, "B_force")
    worst = [verdict.worst for verdict in mechdesign.requirements(study, result)]
    expected = [told[name] for name in ("max", "max", "max", "rms", "mean", "min")]
    assert worst == pytest.approx(expected, rel=1e-9)
    swept = mechdesign.sweep(study).main
    assert swept["dynamics.B_force.max"][0] == pytest.approx(told["max"], rel=1e-9)
    assert swept["dynamics.B_force"][0] == pytest.approx(told["max"], rel=1e-9)


def test_a_joint_at_which_a_load_acts_is_judged_on_all_its_links():
    text = FOUR_BAR + FORCES.replace("STEP", "15") + "  loads: [{at: B, force: [0, 900*abs(sin(2*theta))]}]\n"
    gates = "{result: dynamics.B_force, at_most: 1}", "{result: dynamics.B_force.peak, at_most: 1}"
    whole = "{result: dynamics.magnitude, where: {joint: B}, at_most: 1}"
    rows, peak, table = (verdict.worst for verdict in verdicts(text + asked(*gates, whole), "dynamics"))
    result = mechdesign.dynamics(mechdesign.load(text=text))
    largest = max(extremes(result, f"B_force_on_{link}")["max"] for link in ("coupler", "rocker"))
    assert (rows, peak, table) == pytest.approx((largest,) * 3, rel=1e-9)


def test_goals_and_conditions_on_a_joint_force_are_those_of_extremes():
    optimize = """
optimize:
  method: grid
  variables: {r: {from: 25, to: 30, step: 5}}
  minimize: [dynamics.B_force, {result: dynamics.fx, where: {joint: A}, abs: true}]
  subject_to: [{result: dynamics.magnitude, where: {joint: B}, at_most: 1e9}]
"""
    study = mechdesign.load(text=FOUR_BAR + FORCES.replace("STEP", "15") + optimize)
    designs = mechdesign.optimize(study).tables["designs"]
    result = mechdesign.dynamics(mechdesign.load(text=FOUR_BAR + FORCES.replace("STEP", "0.5")))
    forces = result.tables["joint_forces"]
    assert designs["dynamics.B_force"][1] == pytest.approx(extremes(result, "B_force")["max"], rel=1e-9)
    most = np.abs(forces["fx"][forces.where(joint="A")]).max()
    assert designs["dynamics.fx (joint A)"][1] == pytest.approx(most, rel=1e-4)


def test_a_part_of_the_motion_of_one_joint_is_judged_between_the_rows():
    gate = asked("{result: dynamics.magnitude, where: {joint: B, theta: {from: 31, to: 44}}, at_most: 1}",
                 "{result: dynamics.B_force.range, where: {theta: {from: 31, to: 44}}, at_most: 1}")  # fmt: skip
    coarse, fine = (
        [verdict.worst for verdict in verdicts(FOUR_BAR + FORCES.replace("STEP", step) + gate, "dynamics")]
        for step in ("60", "0.1")
    )
    assert coarse == pytest.approx(fine, rel=1e-6)


def test_at_dead_centres_between_the_rows_no_gate_on_a_joint_is_met():
    gates = asked(
        "{result: dynamics.magnitude, where: {joint: B}, at_most: 1e6}", "{result: dynamics.B_force, at_most: 1e6}",
        "{result: dynamics.fx, where: {joint: B}, at_least: -1e6}", "{result: dynamics.B_force.rms, at_most: 1e6}",
        "{result: dynamics.B_force.mean, at_most: 1e6}", "{result: dynamics.extremes.B_force.peak, at_most: 1e6}",
    )  # fmt: skip
    study = mechdesign.load(text=PUSHED + gates)
    result = mechdesign.dynamics(study)
    assert [verdict.met for verdict in mechdesign.requirements(study, result)] == [False] * 6
    told = extremes(result, "B_force")
    # The size of a force has no negative pole.
    assert told["min"] >= 0
    assert [told[name] for name in ("max", "peak", "mean", "rms")] == [math.inf] * 4


def test_a_direction_that_jumps_by_a_turn_is_judged_at_the_poses_and_says_so():
    (verdict,) = verdicts(
        FOUR_BAR + FORCES.replace("STEP", "15") + asked("{result: dynamics.B_force.angle, at_most: 180}"), "dynamics"
    )
    assert verdict.note == "of the asked poses only"


def test_natural_frequencies_are_judged_at_the_poses_and_say_so():
    spring = "  springs: {s: {between: [O, B], stiffness: 1, free_length: 10}}\n"
    text = FOUR_BAR + spring + FORCES.replace("STEP", "15") + "  modes: true\n"
    (verdict,) = verdicts(text + asked("{result: dynamics.theta_shape, at_most: 1}"), "dynamics")
    assert verdict.note == "of the asked poses only"


def test_a_follower_that_lifts_off_between_two_poses_is_warned_of():
    text = """
units: {length: mm, force: N}
mechanism:
  links:
    ground: {O: [0, 0]}
    disc: [O, N, 20]
    stem: {points: {F: [0, 0], T: [60, 0]}, mass: 1 kg, center: [10, 0]}
  joints: {valve: {prismatic: [ground, stem], direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: valve, to: 40 + 10*cos(2*cam), cam: {link: disc, roller: F, radius: 8 mm}}}
  sketch: {N: [20, 0], F: [0, 30], T: [0, 90]}
dynamics:
  sweep: {cam: {from: 45, to: 405, step: 90}}
  rates: {cam: SPEED rad/s}
  gravity: [0, -9.81 m/s^2]
requirements: [{result: dynamics.normal, where: {joint: lift}, at_least: 0}]
"""
    # It lifts off where 4 h w^2 is more than g: above 15.66 rad/s.
    for speed, lifts in (("15", False), ("17", True)):
        study = mechdesign.load(text=text.replace("SPEED", speed))
        result = mechdesign.dynamics(study)
        assert any("lifts off between the poses" in str(warning) for warning in result.warnings) == lifts
        assert [verdict.met for verdict in mechdesign.requirements(study, result)] == [not lifts]


def test_an_instant_centre_that_goes_to_infinity_between_two_poses_meets_no_gate():
    kinematics = """
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 7}}
  instant_centres: [[coupler, ground]]
"""
    gates = asked("{result: kinematics.coupler.ground.x, at_most: 1e6}",
                  "{result: kinematics.coupler.ground.y, at_least: -1e6}")  # fmt: skip
    assert [verdict.worst for verdict in verdicts(FOUR_BAR + kinematics + gates, "kinematics")] == [math.inf, -math.inf]


ERRORS = """
kinematics:
  sweep: {theta: {from: 0, to: 360, step: STEP}}
  outputs: [P, gap]
"""


def test_errors_over_a_part_of_the_motion_are_those_of_the_same_measure_whatever_the_rows():
    four_bar = FOUR_BAR + "  measures: {gap: P.y - 3*sin(theta)}\n"
    words = ("range", "rms", "mean", "peak")
    part = "where: {theta: {from: 204, to: 222}}, at_most: 1}"
    gates = asked(*(f"{{result: kinematics.{name}.{word}, {part}" for word in words for name in ("P.y_error", "gap")))
    for step in ("15", "0.5"):
        worst = [verdict.worst for verdict in verdicts(four_bar + ERRORS.replace("STEP", step) + gates, "kinematics")]
        assert worst[::2] == pytest.approx(worst[1::2], rel=1e-9)
        assert worst[0] > 0.1


def test_designs_are_ranked_by_errors_over_a_part_of_the_motion_between_the_rows():
    four_bar = FOUR_BAR + "  measures: {gap: P.y - 3*sin(theta)}\n"
    goals = [f"{{result: kinematics.{name}.rms, where: {{theta: {{from: 204, to: 222}}}}}}"
             for name in ("P.y_error", "gap")]  # fmt: skip
    optimize = f"""
optimize:
  method: grid
  variables: {{r: {{from: 28, to: 32, step: 2}}}}
  minimize: [{", ".join(goals)}]
"""
    designs = mechdesign.optimize(mechdesign.load(text=four_bar + ERRORS.replace("STEP", "15") + optimize))
    own, same = (designs.tables["designs"].columns[k].values for k in (1, 2))
    assert own == pytest.approx(same, rel=1e-9)


FIVE_BAR = """
mechanism:
  parameters: {r: 80}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    left: [O, A, r]
    right: [D, B, r]
    one: [A, P, 110]
    two: [B, P, 110]
  drives: [left, right]
  sketch: {A: [-60, 60], B: [160, 60], P: [50, 120]}
kinematics:
  sweep: {P.x: {from: -30, to: 120, step: 50}, P.y: 120}
  outputs: [P]
"""


@pytest.mark.nightly
def test_a_goal_does_not_contradict_the_condition_on_the_same():
    optimize = """
optimize:
  method: METHOD
  variables: {r: {from: 80, to: 90STEP}}
  maximize: [kinematics.inverse_condition]
  subject_to: [{result: kinematics.inverse_condition, at_least: 0.1}]
requirements: [{result: kinematics.inverse_condition, at_least: 0.1}]
"""
    for method, step in (("grid", ", step: 5"), ("search", "")):
        text = FIVE_BAR + optimize.replace("METHOD", method).replace("STEP", step)
        optimum = mechdesign.optimize(mechdesign.load(text=text)).main
        best = mechdesign.load(text=text, overrides={"mechanism.parameters.r": float(optimum["r"][0])})
        result = mechdesign.kinematics(best)
        (verdict,) = mechdesign.requirements(best, result)
        assert optimum["kinematics.inverse_condition"][0] == pytest.approx(verdict.worst, rel=1e-9)
        assert verdict.worst < result.main["inverse_condition"].min() - 1e-4


def test_an_infinite_goal_is_not_feasible_and_says_so():
    optimize = """
optimize:
  method: grid
  variables: {r: {from: 28, to: 30, step: 2}}
  minimize: [dynamics.B_force]
"""
    with pytest.raises(mechdesign.AssemblyError, match="B_force is infinite"):
        mechdesign.optimize(mechdesign.load(text=PUSHED + optimize))


def test_conditioning_does_not_depend_on_the_order_of_the_links():
    legs = [f"leg_{k}: {{from: A{k}, to: B{k}, telescopic: true}}" for k in (1, 2, 3)]
    points = ["P: [0, 0]", "B1: [-0.2, 0]", "B2: [0.2, 0]", "B3: [0.25, 0.15]"]
    columns = []
    for order, first in itertools.product([*itertools.permutations(range(4))][::5], (points, points[::-1])):
        links = [*legs, f"platform: {{{', '.join(first)}}}"]
        written = "\n".join(f"    {links[k]}" for k in order)
        text = f"""
units: {{length: m}}
mechanism:
  links:
    ground: {{A1: [-0.6, 0], A2: [0.6, 0], A3: [0.3, -0.2]}}
{written}
  drives: {{l1: {{length: leg_1}}, l2: {{length: leg_2}}, l3: {{length: leg_3}}}}
  sketch: {{P: [0, 1], B1: [-0.2, 1], B2: [0.2, 1], B3: [0.25, 1.15]}}
kinematics: {{poses: [{{P.x: 0.1, P.y: 1, platform.angle: 5}}], outputs: [P]}}
"""
        columns.append(mechdesign.kinematics(mechdesign.load(text=text)).main["conditioning"][0])
    assert columns == pytest.approx([columns[0]] * len(columns), rel=1e-9)


def test_links_whose_other_joints_are_at_one_place_are_not_determined():
    arm = """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, A, 100]
    lower: [A, P, LOWER]
  drives: [upper, lower]
  sketch: {A: [0, 100], P: [60, 170]}
kinematics:
  poses: [{P.x: 0, P.y: 0}, {P.x: 20, P.y: 150}]
  outputs: [P]
"""
    # With equal links the elbow is free on a circle; with others the shorter does not reach.
    for lower, why in (("100", "not determined"), ("99", "cannot be assembled")):
        (warning,) = mechdesign.kinematics(mechdesign.load(text=arm.replace("LOWER", lower))).warnings
        assert why in str(warning)


@pytest.mark.parametrize("step", [1, 5])
def test_a_gate_on_stiffness_is_that_of_the_whole_motion(step: int) -> None:
    # A motor of the stiffness c turns an arm of the length L: k_y = c/(L cos theta)^2, least where it lies flat.
    text = f"""
mechanism: {{links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}, drives: {{theta: {{angle: arm}}}}}}
stiffness:
  {{link: arm, at: P, actuators: {{theta: 2e6}}, sweep: {{theta: {{from: -7.3, to: 7.7, step: {step}}}}}}}
requirements:
  - {{result: stiffness.k_y, at_least: 200.01}}
  - {{result: stiffness.compliance.C22, at_most: 0.00501}}
  - {{result: stiffness.k_y.max, at_most: 203.7}}
"""
    least, softest, largest = verdicts(text, "stiffness")
    assert (least.met, softest.met, largest.met) == (False, True, True)
    assert (least.note, softest.note) == ("", "")
    assert least.worst == pytest.approx(2e6 / 100**2, rel=1e-12)
    assert softest.worst == pytest.approx(100**2 / 2e6, rel=1e-12)
    assert largest.worst == pytest.approx(2e6 / (100 * math.cos(math.radians(7.7))) ** 2, rel=1e-12)
    assert float(least.place.removeprefix("theta ")) == pytest.approx(0, abs=1e-6)


def test_an_optimisation_judges_stiffness_where_a_requirement_does() -> None:
    # k_y = c/(L cos theta)^2 is least at 0, which is no row: of L the largest within the bound is sqrt(c/200).
    text = """
mechanism:
  parameters: {l: 90}
  links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: l}}
  drives: {theta: {angle: arm}}
stiffness: {link: arm, at: P, actuators: {theta: 2e6}, sweep: {theta: {from: -7.3, to: 7.7, step: 5}}}
optimize:
  variables: {l: {from: 80, to: 120}}
  method: search
  maximize: l
  subject_to: [{result: stiffness.k_y, at_least: 200}]
  evaluations: 40
"""
    best = mechdesign.optimize(mechdesign.load(text=text)).tables["best"]
    assert best["l"][0] == pytest.approx(math.sqrt(2e6 / 200), rel=1e-6)


def test_stiffness_is_infinite_or_nothing_where_it_is_so_between_the_rows() -> None:
    # An arm along x bears all along itself: k_x = c/(L sin theta)^2. A piston at its dead centre holds no crank.
    arm = """
mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: {theta: {angle: arm}}}
stiffness: {link: arm, at: P, actuators: {theta: 2e6}, sweep: {theta: {from: -7.3, to: 27.7, step: 5}}}
requirements: [{result: stiffness.k_x, at_least: 900}, {result: stiffness.k_x, at_most: 1e9}]
"""
    least, largest = verdicts(arm, "stiffness")
    assert least.met
    assert least.worst == pytest.approx(2e6 / (100 * math.sin(math.radians(27.7))) ** 2, rel=1e-12)
    assert not largest.met
    assert largest.worst == math.inf
    pushed = (
        PUSHED.partition("dynamics:")[0]
        + """
stiffness: {link: crank, at: A, actuators: {x: 1000}, sweep: {crank.angle: {from: -7.3, to: 27.7, step: 5}}}
requirements:
  - {result: stiffness.k_min, at_least: 1}
  - {result: stiffness.k_min, at_least: 0}
  - {result: stiffness.compliance.C22, at_most: 1e9}
  - {result: stiffness.compliance.C22, at_least: 0}
"""
    )
    loose, held, soft, positive = verdicts(pushed, "stiffness")
    assert (loose.met, held.met, soft.met, positive.met) == (False, True, False, True)
    assert (loose.worst, soft.worst) == (0.0, math.inf)


def test_a_stiffness_that_grows_without_bound_is_never_below_zero() -> None:
    """Where the body is rigid in a direction the largest stiffness goes up on both sides; its least is that of rows."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0.08477207196661851], D: [98.47507140212251, 5]}
    crank: {from: O, to: A, length: 30}
    rod: {from: A, to: B, length: 90, points: {C: [44.40082840919299, 30]}}
    rocker: {from: D, to: B, length: 59.993342537879926}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
stiffness:
  at: C
  link: rod
  characteristic_length: 50
  actuators: {crank: [100000, 300000]}
  bearings: {B: {radial: 98668.50757598442}}
  elastic: {rocker: beam}
  sections: {beam: {E: 201695.44143933238, height: 8, width: 10}}
  sweep: {crank: SWEEP}
requirements: [{result: stiffness.k_max, at_least: 0}]
"""
    turn, part = "{from: 0, to: 360, step: 5}", "{from: 15, to: 25, step: 0.01}"
    whole, fine = (mechdesign.stiffness(mechdesign.load(text=text.replace("SWEEP", sweep))) for sweep in (turn, part))
    assert whole.verdicts[0].met
    assert whole.verdicts[0].worst == pytest.approx(fine.main["k_max"].min(), rel=1e-6)
