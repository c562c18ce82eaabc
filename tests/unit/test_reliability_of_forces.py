"""Errors of efforts and joint forces by tolerances of masses, springs and dimensions."""

import numpy as np
import pytest

import mechdesign
from mechdesign import StudyError, load

G = 9.81
ARM = """
units: {length: m}
mechanism:
  parameters: {lift: 3}
  links:
    ground: {O: [0, 0], S: [0, 0.4]}
    arm: {from: O, to: P, length: 0.5, mass: 2, center: [0.3, 0]}
  SPRINGS
  drives: [arm]
dynamics: {gravity: [0, -9.81], loads: [{link: arm, moment: 2*lift}]}
reliability:
  poses: [{arm: 20}, {arm: 65}]
  methods: [analytic, monte_carlo]
  samples: 40000
"""
CRANK = """
units: {length: m}
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: 0.05, mass: 1, center: [0.02, 0.004], inertia: 1e-3}
    rod: {from: A, to: B, length: 0.15, mass: 0.8, center: [0.06, 0], inertia: 1.5e-3}
    piston: {points: {B: [0, 0]}, mass: 0.5}
  joints: {guide: {prismatic: [ground, piston], through: O}}
  springs: {back: {between: [O, B], stiffness: 400, free_length: 0.12, damping: 3}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0.03, 0.04], B: [0.17, 0]}
dynamics: {gravity: [0, -9.81], loads: [{at: B, force: [-20, 0]}], rates: {theta: 30 rad/s}, poses: [{theta: 40}]}
"""
TOLERANCES = {"crank.mass": 0.03, "crank.length": 2e-4, "rod.length": 3e-4, "back.stiffness": 12, "rod.center.x": 1e-3,
              "rod.inertia": 8e-5, "theta": 0.3}  # fmt: skip


def sigmas(study, output, method="analytic"):
    table = mechdesign.reliability(study).tables["moments"]
    return table["sigma"][table.where(output=output, method=method)]


def arm(section, springs=""):
    return load(text=ARM.replace("SPRINGS", springs) + section)


def test_the_torque_of_an_arm_varies_with_its_mass_its_centre_and_its_load():
    study = arm("  dimensions: {arm.mass: 0.06, arm.center.x: 0.009, arm: 0.3, lift: 0.06}\n  outputs: [arm_effort]\n")
    angle = np.deg2rad([20, 65])
    # T = m g c cos(angle) - 2 lift; standard deviations are thirds of the tolerances.
    weight = [G * 0.3 * np.cos(angle) * 0.02, 2 * G * np.cos(angle) * 0.003]
    parts = [*weight, 2 * G * 0.3 * np.sin(angle) * np.deg2rad(0.1), np.full(2, 2 * 0.02)]
    expected = np.sqrt(sum(part**2 for part in parts))
    assert sigmas(study, "arm_effort") == pytest.approx(expected, rel=1e-8)
    assert sigmas(study, "arm_effort", "monte_carlo") == pytest.approx(expected, rel=0.02)


def test_what_a_spring_leaves_of_a_balanced_arm_varies_with_its_stiffness_and_the_place_of_its_end():
    # A spring of zero free length between S, h above O, and P: its moment about O is k h l cos(angle).
    stiffness = 2 * G * 0.3 / (0.4 * 0.5)
    springs = f"springs: {{back: {{between: [S, P], stiffness: {stiffness!r}, free_length: 0}}}}"
    study = arm(
        "  dimensions: {arm.mass: 0.06, back.stiffness: 0.6, ground.S.y: 0.003}\n  outputs: [arm_effort]\n", springs
    )
    share = np.cos(np.deg2rad([20, 65]))
    parts = [G * 0.3 * 0.02, 0.4 * 0.5 * 0.2, stiffness * 0.5 * 0.001]
    expected = share * np.sqrt(sum(part**2 for part in parts))
    assert sigmas(study, "arm_effort") == pytest.approx(expected, rel=1e-8)
    table = mechdesign.reliability(study).tables["moments"]
    assert table["nominal"] == pytest.approx(-6.0, abs=1e-9)
    assert set(table["unit"]) == {"N*m"}


def test_efforts_and_joint_forces_of_a_slider_crank_as_by_differences_of_changed_studies():
    dimensions = ", ".join(f"{name}: {tolerance}" for name, tolerance in TOLERANCES.items())
    outputs = ["theta_effort", "theta_power", "A_force", "guide_force", "shaking", "kinetic_energy"]
    section = (f"reliability: {{dimensions: {{{dimensions}}}, outputs: [{', '.join(outputs)}], poses: [{{theta: 40}}], "
               "samples: 40000, methods: [analytic, monte_carlo, second_order]}\n")  # fmt: skip
    keys = {
        "crank.mass": "mechanism.links.crank.mass", "crank.length": "mechanism.links.crank.length",
        "rod.length": "mechanism.links.rod.length", "back.stiffness": "mechanism.springs.back.stiffness",
        "rod.center.x": "mechanism.links.rod.center.0", "rod.inertia": "mechanism.links.rod.inertia",
        "theta": "dynamics.poses.0.theta",
    }  # fmt: skip
    nominal = {"crank.mass": 1, "crank.length": 0.05, "rod.length": 0.15, "back.stiffness": 400, "rod.center.x": 0.06,
               "rod.inertia": 1.5e-3, "theta": 40}  # fmt: skip

    def forces(changes):
        tables = mechdesign.dynamics(load(text=CRANK, overrides=changes)).tables
        row, joints = tables["dynamics"], tables["joint_forces"]
        sizes = {f"{joint}_force": size for joint, size in zip(joints["joint"], joints["magnitude"], strict=True)}
        whole = np.hypot(row["shaking.x"][0], row["shaking.y"][0])
        numbers = {name: row[name][0] for name in row.names if name != "valid"} | sizes | {"shaking": whole}
        return np.array([numbers[name] for name in outputs])

    variance = np.zeros(len(outputs))
    for name, tolerance in TOLERANCES.items():
        step = tolerance / 50
        high, low = (forces({keys[name]: nominal[name] + sign * step}) for sign in (1, -1))
        variance += ((high - low) / (2 * step) * tolerance / 3) ** 2
    study = load(text=CRANK + section)
    table = mechdesign.reliability(study).tables["moments"]
    for k, name in enumerate(outputs):
        rows = table.take(table.where(output=name))
        by_method = dict(zip(rows["method"].tolist(), rows["sigma"].tolist(), strict=True))
        assert by_method["analytic"] == pytest.approx(np.sqrt(variance[k]), rel=1e-5)
        for method in ("monte_carlo", "second_order"):
            assert by_method[method] == pytest.approx(by_method["analytic"], rel=0.03), (name, method)


def test_methods_agree_on_how_often_an_effort_leaves_its_limit():
    study = load(
        text=CRANK
        + """
reliability:
  dimensions: {crank.mass: 0.03, rod.length: 3e-4, back.stiffness: 12}
  clearances: {A: {radial: 2e-4, pin: normal_in_disc}}
  limits: {theta_effort: 0.01}
  poses: [{theta: 40}]
  methods: [analytic, form, second_order, importance_sampling, monte_carlo, auto]
"""
    )
    table = mechdesign.reliability(study).tables["reliability"]
    failures = table["failure"]
    assert 1e-4 < failures.min() < 0.5
    assert failures == pytest.approx(np.full(len(failures), failures.mean()), rel=0.1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CRANK.replace("dynamics:", "kinematics:").replace("gravity: [0, -9.81], ", "")
         + "reliability: {dimensions: {crank.mass: 0.1}, limits: {theta_effort: 5}}", "add one, such as dynamics:"),
        (CRANK.replace("rates: {theta: 30 rad/s}, ", "")
         + "reliability: {dimensions: {crank.mass: 0.1}, outputs: [theta_power]}", "'theta_power' needs velocities"),
        (CRANK + "reliability: {dimensions: {crank.mass: 0.1 mm}, outputs: [theta_effort]}", "a mass is expected"),
        (CRANK + "reliability: {dimensions: {crank.mass: 0.1}, limits: {theta_effort: 5 N}}", "a moment is expected"),
        (CRANK + "reliability: {dimensions: {crank.mass: 0.1}, limits: {shaking: {radius: 5}}}", "that of a point"),
        (CRANK + "reliability: {dimensions: {crank.mass: js9}, outputs: [theta_effort]}", "of a length or an angle"),
        (CRANK + "reliability: {dimensions: {crank.mass: 0.1}, outputs: [theta_efort]}", "did you mean 'theta_effort'"),
        (CRANK.replace("at: B", "at: Q") + "reliability: {dimensions: {crank.mass: 0.1}, outputs: [A_force]}", "'Q'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(text, message):
    with pytest.raises(StudyError, match=message.replace("[", r"\[")):
        load(text=text)


def test_a_coordinate_of_the_name_of_a_force_is_the_coordinate():
    text = CRANK.replace("{points: {B: [0, 0]}, mass", "{points: {B: [0, 0], shaking: [0.01, 0]}, mass")
    text = text.replace("through: O}", "point: B, through: O}")
    study = load(text=text + "reliability: {dimensions: {rod.length: 3e-4}, outputs: [shaking], poses: [{theta: 40}]}")
    table = mechdesign.reliability(study).tables["moments"]
    assert set(zip(table["output"], table["order"], table["unit"], strict=True)) == {
        ("shaking.x", "position", "m"), ("shaking.y", "position", "m"),
    }  # fmt: skip


def test_patterns_name_masses():
    study = load(text=CRANK + "reliability: {dimensions: {'*.mass': 0.01}, outputs: [theta_effort]}")
    table = mechdesign.reliability(study).tables["contributions"]
    assert set(table["source"]) == {"crank.mass", "rod.mass", "piston.mass"}
    assert set(table["unit"]) == {"N*m/kg"}


def test_a_pose_that_the_drives_do_not_hold_is_not_valid():
    text = CRANK.replace("drives: {theta: {angle: crank}}", "drives: {stroke: {slide: guide}}")
    text = text.replace("rates: {theta: 30 rad/s}, poses: [{theta: 40}]", "poses: [{stroke: 0.2}, {stroke: 0.15}]")
    study = load(text=text + "reliability: {dimensions: {crank.mass: 0.01}, outputs: [stroke_effort], "
                 "poses: [{stroke: 0.2}, {stroke: 0.15}], methods: [analytic]}")  # fmt: skip
    table = mechdesign.reliability(study).tables["moments"]
    assert table["valid"].tolist() == [False, True]
    assert np.isfinite(table["sigma"]).tolist() == [False, True]


def test_designs_of_optimize_have_the_errors_of_each_alone():
    section = """  dimensions: {arm.mass: 0.06, lift: 0.06}
  limits: {arm_effort: {usl: 1.5}}
optimize:
  variables: {lift: {choices: [2, 2.2]}, arm.center.x: {choices: [0.29, 0.3]}}
  minimize: [{result: reliability.moments.sigma, where: {method: analytic}},
             {result: reliability.failure, where: {method: analytic}}]
"""
    study = arm(section)
    designs = mechdesign.optimize(study).tables["designs"]
    assert np.ptp(designs[designs.names[3]]) > 0.1
    for lift, center, sigma, failure in zip(*(designs[name] for name in designs.names[:4]), strict=True):
        changes = {"mechanism.parameters.lift": lift, "mechanism.links.arm.center": [center, 0]}
        tables = mechdesign.reliability(load(text=study.text, overrides=changes)).tables
        for name, column, value in (("moments", "sigma", sigma), ("reliability", "failure", failure)):
            table = tables[name]
            assert value == pytest.approx(table[column][table.where(method="analytic")].max(), rel=1e-6)


def test_loads_over_time_are_those_of_each_pose():
    motion = "motion: {arm: [{from: 20, to: 65, time: 2}]}"
    text = ARM.replace("SPRINGS", "").replace("moment: 2*lift", "moment: lift*time")
    text = text[: text.index("reliability:")]
    asked = "reliability: {dimensions: {lift: 0.06}, outputs: [arm_effort], methods: [analytic]}"
    study = load(text=text.replace("dynamics:", f"kinematics: {{{motion}}}\ndynamics:") + asked)
    table = mechdesign.reliability(study).tables["moments"]
    times = mechdesign.dynamics(study).tables["dynamics"]["time"]
    assert table["sigma"] == pytest.approx(times * 0.02, abs=1e-9)
    with pytest.raises(StudyError, match="these are of its own poses"):
        load(text=text.replace("loads:", f"{motion}, loads:") + asked)
