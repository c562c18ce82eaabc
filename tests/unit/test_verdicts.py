"""Verdicts: of each case by its own requirements, of motions without a value somewhere, in the unit of the limit."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import mechdesign

# B.x is from 80 - r to the right end; a circle of radius r about O and the line of B.
CRANK_ROCKER = """
mechanism:
  parameters: {{r: 30}}
  measures: {{q: "{measure}"}}
  links: {{ground: {{O: [0, 0], D: [100, 0]}}, crank: [O, A, r], rod: [A, B, 90], rocker: [D, B, 60]}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0, 30], B: [75, 55]}}
kinematics: {{sweep: {{theta: {{from: 0, to: 360, number: {number}}}}}, outputs: [B, q]}}
"""
# An arm of 100 mm: P.x is 100 cos(arm). Its effort against a load of 1 N downwards at P is 100 cos(arm) N mm.
ARM = """
mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
kinematics:
  sweep: {arm: {from: -90, to: 90, step: 30}}
  outputs: [P]
  loads: [{at: P, force: [0, -1]}]
"""


def verdicts(text: str, command: str = "kinematics"):
    study = mechdesign.load(text=text)
    return mechdesign.requirements(study, getattr(mechdesign, command)(study))


def required(text: str, *requirements: str):
    return verdicts(text + "requirements:\n" + "".join(f"  - {requirement}\n" for requirement in requirements))


# Point 14: each case is judged as if it were a study of its own.


@pytest.mark.slow
@pytest.mark.parametrize(
    "entries",
    [
        {"requirements.0.at_most": [1000, 1, 90.0]},
        {"requirements.0.at_most": [1000, 1], "mechanism.parameters.r": [20, 30]},
        {"requirements.0.at_most": ["1 m", "9 cm", "r", "3*r"], "mechanism.parameters.r": [20, 30]},
        {"requirements.0.at_least": [0, 70], "requirements.0.abs": [True, False]},
        {"requirements.0.where": [{"theta": 0}, {"theta": 180}, {"theta": {"from": 90, "to": 270}}]},
        {"requirements.0": [{"result": "kinematics.B.x", "at_most": 60, "where": {"theta": 180}},
                            {"result": "kinematics.B.x", "at_least": 40}]},
        {"fail_on": [[], ["undefined"], ["unassembled"]], "requirements.0.at_most": [1000, 1]},
        {"mechanism.parameters.r": [20, 30], "kinematics.sweep.theta.number": [7, 13],
         "requirements.0.at_most": [95, 5]},
    ],
)  # fmt: skip
def test_a_sweep_judges_every_case_as_a_study_of_its_own(entries: dict[str, list[object]]):
    text = CRANK_ROCKER.format(measure="sqrt(B.x - 80)", number=13) + (
        "requirements: [{result: kinematics.B.x, at_most: 1000, where: {valid: 1}}]\n"
    )
    study = mechdesign.load(text=text, overrides={"matrix": {"vary": entries}})
    table = mechdesign.sweep(study).main
    cases = [*itertools.product(*entries.values())]
    assert len(table) == len(cases)
    column = next(name for name in table.names if f"{name}_met" in table)
    for k, case in enumerate(cases):
        alone = mechdesign.load(text=text, overrides=dict(zip(entries, case, strict=True)))
        result = mechdesign.kinematics(alone)
        (verdict, *barred) = mechdesign.requirements(alone, result)
        assert (bool(table[f"{column}_met"][k]), table[column][k]) == (verdict.met, pytest.approx(verdict.worst))
        assert table["exit_code"][k] == int(not all(part.met for part in (verdict, *barred)))


def test_a_varied_limit_has_no_one_limit_in_pictures():
    text = ARM + "requirements: [{result: kinematics.P.x, at_most: 1000}, {result: kinematics.P.y, at_most: 200}]\n"
    study = mechdesign.load(text=text + "matrix: {vary: {requirements.0.at_most: [1000, 1]}}\n")
    assert dict(mechdesign.sweep(study).drawn.results) == {
        "kinematics.P.x": (None, None),
        "kinematics.P.y": (None, 200),
    }


def test_a_limit_of_another_kind_in_a_case_is_a_mistake():
    text = ARM + "requirements: [{result: kinematics.P.x, at_most: 1000}]\n"
    for values in ("[1000, 30 deg]", "{from: 1 deg, to: 3 deg, step: 1 deg}"):
        study = mechdesign.load(text=text + f"matrix: {{vary: {{requirements.0.at_most: {values}}}}}\n")
        with pytest.raises(mechdesign.StudyError, match="an angle, where a length"):
            mechdesign.sweep(study)


def test_a_limit_in_degrees_of_a_column_in_radians_is_converted_in_cases():
    """A moment of 10 N mm on a pin of 1000 N mm/rad turns the arm by 0.01 rad, 0.573 deg."""
    study = mechdesign.load(
        text="""
mechanism: {parameters: {most: 1 deg}, links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
stiffness: {at: P, link: arm, actuators: {arm: 1000 N*mm/rad}, loads: [[0, 0, 10]], poses: [{arm: 0}]}
requirements:
  - {result: stiffness.deflections.dphi, at_most: 1 deg}
  - {result: stiffness.deflections.dphi, at_most: most}
matrix: {vary: {requirements.0.at_most: [0.5 deg, 0.6 deg], mechanism.parameters.most: [0.5 deg, 0.6 deg]}}
"""
    )
    table = mechdesign.sweep(study).main
    assert [table[name].tolist() for name in table.names if name.endswith("_met")] == [
        [False, False, True, True], [False, True, False, True],
    ]  # fmt: skip


# Point 20: what is required is looked at once for each design.


# Point 10: files of cases.


def test_values_that_fit_together_only_are_cases_with_labels(tmp_path: Path):
    """Driven at the rocker, of which a sweep of the crank knows nothing; alone neither entry makes a study."""
    (tmp_path / "cases.csv").write_text(
        "label,mechanism.drives,kinematics.sweep\n"
        'as drawn,"{theta: {angle: crank}}","{theta: {from: 0, to: 360, number: 13}}"\n'
        '"by the rocker","{phi: {angle: rocker}}","{phi: {from: 100, to: 110, number: 3}}"\n'
    )
    text = CRANK_ROCKER.format(measure="0*B.x", number=13).replace("{theta: {angle: crank}}", "{theta: {angle: crank}}")
    (tmp_path / "study.yaml").write_text(
        text + "matrix: {cases: cases.csv}\nrequirements: [{result: kinematics.B.x, at_least: 80}]\n"
    )
    result = mechdesign.sweep(mechdesign.load(tmp_path / "study.yaml"))
    assert result.main["label"].tolist() == ["as drawn", "by the rocker"]
    # B lies on a circle of 60 mm about D: 100 + 60 cos 110 deg.
    assert result.main["kinematics.B.x"] == pytest.approx([50, 100 + 60 * math.cos(math.radians(110))])
    assert result.drawn.verdicts[0].place.startswith("case 1 (as drawn: drives")


# Point 15: no value on a part of the motion.


@pytest.mark.slow
@pytest.mark.parametrize("word", ["", ".min", ".max", ".mean", ".range", ".rms", ".peak", ".evenness"])
@pytest.mark.parametrize("number", [4, 73])
def test_a_measure_without_a_value_somewhere_meets_nothing(word: str, number: int):
    """B.x is 50 mm at its left end, and above 50.01 mm in every pose of a coarse sweep."""
    (verdict,) = required(
        CRANK_ROCKER.format(measure="sqrt(B.x - 50.01)", number=number), f"{{result: kinematics.q{word}, at_most: 1e9}}"
    )
    assert not verdict.met
    assert verdict.note.startswith("no value ")


@pytest.mark.parametrize("column", ["min", "max", "range"])
@pytest.mark.parametrize(
    ("measure", "number"), [("sqrt(B.x - 80)", 73), ("sqrt(B.x - 50.01)", 4), ("log(B.x - 51)", 7)]
)
def test_its_extremes_meet_nothing_either(column: str, measure: str, number: int):
    (verdict,) = required(
        CRANK_ROCKER.format(measure=measure, number=number), f"{{result: kinematics.extremes.q.{column}, at_most: 1e9}}"
    )
    assert not verdict.met
    assert math.isnan(verdict.worst)


def test_the_part_without_a_value_is_said_and_warned_of():
    """B.x > 80 in 28 of 73 poses."""
    text = CRANK_ROCKER.format(measure="sqrt(B.x - 80)", number=73)
    study = mechdesign.load(text=text + "requirements: [{result: kinematics.extremes.q.max, at_most: 10}]\n")
    result = mechdesign.kinematics(study)
    lost = int(np.count_nonzero(result.main["B.x"] < 80))
    assert mechdesign.requirements(study, result)[0].note == f"no value in {lost} of 73 poses"
    assert [(warning.kind, str(warning)) for warning in result.warnings] == [
        ("undefined", f"q has no value in {lost} of 73 poses; the first: theta = 105 deg")
    ]


def test_the_part_of_the_motion_that_has_values_can_be_judged():
    text = CRANK_ROCKER.format(measure="sqrt(B.x - 80)", number=73)
    (verdict,) = required(text, "{result: kinematics.q.max, at_most: 5, where: {theta: {from: 0, to: 90}}}")
    assert verdict.met
    # At the dead centre O, A and B are in line and B is 120 mm from O, 60 mm from D: B.x is 104 mm.
    assert verdict.worst == pytest.approx(math.sqrt(104 - 80), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "asked",
    [
        *(f"maximize: kinematics.{name}" for name in ("q", "q.max", "q.mean", "q.range", "extremes.q.max")),
        *(f"maximize: r, subject_to: [{{result: kinematics.{name}, at_most: 1e9}}]"
          for name in ("q", "q.peak", "q.rms", "extremes.q.range")),
    ],
)  # fmt: skip
def test_designs_without_a_value_somewhere_are_not_feasible(asked: str):
    """The left end of B.x is 80 - r, which is below 50.01 from r = 29.99 on."""
    text = CRANK_ROCKER.format(measure="sqrt(B.x - 50.01)", number=4)
    study = mechdesign.load(text=text + f"optimize: {{variables: {{r: {{from: 28, to: 32, step: 1}}}}, {asked}}}\n")
    result = mechdesign.optimize(study)
    assert result.tables["designs"]["r"][np.isfinite(result.tables["designs"]["CPI"])].tolist() == [28, 29]


@pytest.mark.slow
@pytest.mark.parametrize("number", [7, 73])
@pytest.mark.parametrize(
    ("command", "result"),
    [
        *(("kinematics", name) for name in ("theta_effort", "theta_effort.rms", "extremes.theta_effort.range")),
        *(("dynamics", name) for name in ("theta_effort", "magnitude.max", "O_force", "flywheel.surplus.max",
                                          "extremes.theta_effort.mean", "extremes.O_force.peak")),
    ],
)  # fmt: skip
def test_forces_of_loads_without_a_value_somewhere_meet_nothing(command: str, result: str, number: int):
    text = CRANK_ROCKER.format(measure="0*B.x", number=number).replace("kinematics:", f"{command}:")
    more = "rates: {theta: 60 rpm}, flywheel: {fluctuation: 0.05}, " if command == "dynamics" else ""
    load = f'{more}loads: [{{at: B, force: ["sqrt(B.x - 50.01)", 0]}}]'
    text = text.replace("outputs: [B, q]", load)
    (verdict,) = verdicts(text + f"requirements: [{{result: {command}.{result}, at_most: 1e12}}]\n", command)
    assert not verdict.met
    assert math.isnan(verdict.worst)


# Point 19: moments of some of the samples.


@pytest.mark.slow
def test_moments_of_few_samples_meet_nothing_unless_the_study_allows_it():
    """Rod and rocker, 36 mm and 35 mm long, hardly reach over the 70.05 mm from A to D."""
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 36], rocker: [D, B, 35]}
  drives: [crank]
  sketch: {A: [30, 0.1], B: [65, 17]}
reliability: {poses: [{crank: 3}], outputs: [B.x], dimensions: {rocker.length: 5, rod.length: 5},
              methods: [analytic, monte_carlo], samples: 2000, limits: {B.x: 100}}
requirements:
"""
    gates = [
        "{result: reliability.moments.sigma, where: {method: monte_carlo}, at_most: 1e6}",
        "{result: reliability.moments.mean.max, at_most: 1e6}",
        "{result: reliability.capability.cpk, where: {method: monte_carlo}, at_least: -1e6}",
        "{result: reliability.moments.sigma, where: {method: analytic}, at_most: 1e6}",
        "{result: reliability.moments.sigma, where: {method: monte_carlo}, at_most: 1e6, unassembled: allowed}",
        "{result: reliability.reliability.reliability, where: {method: monte_carlo}, at_least: 0}",
        "{result: reliability.contributions.sobol_total.max, at_most: 1e6}",
    ]
    study = mechdesign.load(text=text + "".join(f"  - {gate}\n" for gate in gates))
    result = mechdesign.reliability(study)
    lost = result.counts["invalid"]
    assert lost > 500
    found = mechdesign.requirements(study, result)
    assert [verdict.met for verdict in found] == [False, False, False, True, True, True, False]
    assert all(f"{lost} of 2000 samples cannot be assembled" in verdict.note for verdict in (*found[:3], found[4]))


# Point 11: the value in the unit of the limit, at the place of the worst.


@pytest.mark.parametrize(
    ("requirement", "words"),
    [
        ("{result: kinematics.arm_effort, at_most: 0.2 N*m}", "at most 0.2 N*m: met, worst 0.1 N*m at arm 0"),
        ("{result: kinematics.arm_effort.max, at_most: 0.2 N*m}", "at most 0.2 N*m: met, worst 0.1 N*m at arm 0"),
        (
            "{result: kinematics.arm_effort.peak, at_most: 0.05 N*m}",
            "at most 0.05 N*m: NOT MET, worst 0.1 N*m at arm 0",
        ),
        ("{result: kinematics.extremes.arm_effort.max, at_most: 1 N*m}", "worst 0.1 N*m at output arm_effort, arm 0"),
        ("{result: kinematics.P.y.min, at_least: -5 in}", "met, worst -3.93701 in at arm -90"),
        ("{result: kinematics.P.y, at_least: -1 m, at_most: 10.5 cm}", "met, worst 10 cm at arm 90"),
        ("{result: kinematics.P.y, at_least: -10.1 cm, at_most: 1}", "NOT MET, worst 100 at arm 90"),
        ("{result: kinematics.P.y.max, at_most: 200}", "at most 200: met, worst 100 at arm 90"),
        ("{result: kinematics.extremes.P.y.min, at_least: -200}", "met, worst -100 at output P.y, arm -90"),
    ],
)
def test_a_verdict_is_in_the_unit_of_its_limit_at_the_place_of_the_worst(requirement: str, words: str):
    (verdict,) = required(ARM, requirement)
    assert words in str(verdict)
    # As data it has the unit of its column.
    own = verdict.as_required
    assert own.margin == pytest.approx(verdict.margin * own.worst / verdict.worst)


def test_margins_in_several_units_are_compared_in_one():
    """9 cm and 95 mm are 10 and 5 mm below the 100 mm of P.y."""
    study = mechdesign.load(
        text=ARM
        + """
requirements: [{result: kinematics.P.y.max, at_most: 1}]
matrix: {vary: {requirements.0.at_most: [95 mm, 9 cm]}}
"""
    )
    (verdict,) = mechdesign.sweep(study).verdicts
    assert "at most 9 cm: NOT MET, worst 10 cm at case 2" in str(verdict)


# Point 12: what is rounding has no place.


def test_a_balanced_arm_has_extremes_of_zero_without_a_place():
    """The centre of the turning arm lies 100 mm cos(asin(0.6)) - 80 mm = 0 from its pivot, up to rounding."""
    text = """
mechanism:
  parameters: {offset: "100*cos(asin(0.6)) - 80"}
  links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 100, mass: 2, inertia: 100, center: [offset + 1e-14, 0]}}
  drives: [arm]
dynamics: {sweep: {arm: {from: 0, to: 360, step: 5}}, rates: {arm: 600 rpm}, gravity: [0, 0]}
requirements: [{result: dynamics.shaking.x.max, at_most: 1}, {result: dynamics.shaking.x, at_most: 1}]
"""
    study = mechdesign.load(text=text)
    result = mechdesign.dynamics(study)
    table = result.tables["extremes"]
    rounding = np.isin(
        table["output"], ["arm_effort", "shaking.x", "shaking.y", "shaking", "shaking_moment", "O_force"]
    )
    assert np.abs(result.main["shaking.x"]).max() > 0
    for end in ("min", "max", "peak"):
        assert not table[end][rounding].any()
        assert np.isnan(table[f"{end}_at"][rounding]).all()
    assert not table["rms"][rounding].any()
    assert [(verdict.worst, verdict.place) for verdict in mechdesign.requirements(study, result)] == [(0, ""), (0, "")]


def test_a_real_zero_keeps_its_place():
    """100 cos 90 deg."""
    table = mechdesign.kinematics(mechdesign.load(text=ARM)).tables["extremes"]
    by_name = {name: k for k, name in enumerate(table["output"].tolist())}
    assert (table["min"][by_name["P.x"]], abs(table["min_at"][by_name["P.x"]])) == (0, 90)


def test_errors_of_rounding_have_no_place():
    """The arm's end lies where its target says, up to rounding."""
    text = ARM.replace("{links", "{targets: {P.x: 100*cos(arm)}, links")
    table = mechdesign.kinematics(mechdesign.load(text=text)).tables["targets"]
    assert [table[name].tolist() for name in ("rms", "mean", "max_abs")] == [[0], [0], [0]]
    assert np.isnan(table["at"]).all()


def test_of_two_equal_peaks_the_first_counts():
    """The effort of a balanced motion, 100 sin(arm), is largest at 90 and smallest at 270 deg."""
    text = ARM.replace("from: -90, to: 90, step: 30", "from: 0, to: 360, step: 17").replace("[0, -1]", "[-1, 0]")
    (verdict,) = required(text.replace("step: 17", "number: 22"), "{result: kinematics.arm_effort.peak, at_most: 1}")
    assert verdict.place == "arm 90"
