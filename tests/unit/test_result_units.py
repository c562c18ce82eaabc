"""Amounts with a unit in bounds, `where`, targets, tolerances: converted, or refused where their kind is another."""

import math

import pytest

import mechdesign

ARM = """
mechanism: {{links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}, drives: [arm]}}
kinematics: {{poses: [{{arm: 0}}, {{arm: 30}}, {{arm: 90}}], outputs: [P, arm.angle]}}
requirements: [{}]
"""
WRONG = "is a {}, where an? {} is expected"


def verdict(requirement):
    study = mechdesign.load(text=ARM.format(requirement))
    (found,) = mechdesign.requirements(study, mechdesign.kinematics(study))
    return found


@pytest.mark.parametrize(
    ("requirement", "margin"),
    [
        ("{result: kinematics.arm.angle, at_most: 1.6 rad}", 1.6 * 180 / math.pi - 90),
        ("{result: kinematics.P.x, at_least: -3 cm}", 30.0),
        ("{result: kinematics.P.y, at_most: 0.2 m, at_least: -1 in}", 25.4),
        ("{result: kinematics.extremes.arm.angle.range, at_least: 0.25 rev}", 0.0),
        ("{result: kinematics.P.x, where: {arm: 0.5235987755982988 rad}, at_least: 8 cm}", 50 * math.sqrt(3) - 80),
        ("{result: kinematics.P.x, at_most: 110}", 10.0),
    ],
)
def test_a_bound_is_converted_to_the_unit_of_its_column(requirement, margin):
    assert verdict(requirement).margin == pytest.approx(margin, abs=1e-9)


@pytest.mark.parametrize(
    ("requirement", "message"),
    [
        ("{result: kinematics.arm.angle, at_least: -3 mm}", WRONG.format("length", "angle")),
        ("{result: kinematics.arm.angle, at_least: -3 N}", WRONG.format("force", "angle")),
        ("{result: kinematics.arm.angle, at_least: -1 kg}", "where an angle is expected"),
        ("{result: kinematics.extremes.arm.angle.max, at_most: 300 mm}", WRONG.format("length", "angle")),
        ("{result: kinematics.conditioning, at_least: 0 mm}", WRONG.format("length", "pure number")),
        ("{result: kinematics.P.x, where: {arm: 30 mm}, at_least: 0}", WRONG.format("length", "angle")),
    ],
)
def test_a_bound_of_another_kind_is_a_mistake_with_its_place(requirement, message):
    with pytest.raises(mechdesign.StudyError, match=message) as caught:
        verdict(requirement)
    assert caught.value.problems[0].key.startswith("requirements.0")


def test_a_verdict_says_the_bound_as_it_was_written():
    assert "at least -3 cm" in verdict("{result: kinematics.P.x, at_least: -3 cm}").requirement


def test_a_column_in_radians_of_a_study_in_degrees_counts_in_radians():
    """A moment m on an arm with a pin of stiffness k turns it by m/k radians."""
    text = """
mechanism: {{links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}, drives: [arm]}}
stiffness: {{at: P, link: arm, actuators: {{arm: 1000 N*mm/rad}}, loads: [[0, 0, 10]], poses: [{{arm: 0}}]}}
requirements: [{{result: stiffness.deflections.dphi, at_most: {} deg}}]
"""
    limit = 0.01 * 180 / math.pi
    for share, met in ((1.001, True), (0.999, False)):
        study = mechdesign.load(text=text.format(share * limit))
        (found,) = mechdesign.requirements(study, mechdesign.stiffness(study))
        assert (found.met, found.worst) == (met, pytest.approx(0.01))


OPTIMIZE = """
mechanism:
  parameters: {{r: 3 cm}}
  links: {{ground: {{O: [0, 0]}}, arm: [O, P, r]}}
  drives: [arm]
kinematics: {{poses: [{{arm: 0}}, {{arm: 30}}], outputs: [P, arm.angle]}}
optimize: {}
"""


def optimised(section):
    return mechdesign.optimize(mechdesign.load(text=OPTIMIZE.format(section))).tables["optimum"]


def test_conditions_and_ranges_of_optimize_are_converted():
    variables = "variables: {r: {from: 1 cm, to: 0.08 m, step: 5}}, maximize: kinematics.P.x"
    assert optimised(f"{{{variables}, subject_to: [{{result: kinematics.P.x, at_most: 4.5 cm}}]}}")["r"] == 45
    assert optimised(f"{{{variables}, subject_to: [{{result: 2*r, at_most: 7 cm}}]}}")["r"] == 35
    variables = variables.replace("kinematics.P.x", "{result: kinematics.P.x, where: {arm: 0.5 rad}}")
    with pytest.raises(mechdesign.StudyError, match="there are"):
        optimised(f"{{{variables}}}")


@pytest.mark.parametrize(
    "section",
    [
        "{variables: {r: {from: 10, to: 80, step: 5}}, maximize: kinematics.P.x, "
        "subject_to: [{result: kinematics.arm.angle, at_most: 80 mm}]}",
        "{variables: {r: {from: 10, to: 80, step: 5}}, maximize: {result: kinematics.P.x, where: {arm: 30 mm}}}",
    ],
)
def test_conditions_and_goals_of_another_kind_are_mistakes(section):
    with pytest.raises(mechdesign.StudyError, match=WRONG.format("length", "angle")):
        optimised(section)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("r: 3 cm", "r: 3 deg", "mechanism.parameters.r"),
        ("from: 10,", "from: 10 deg,", "optimize.variables.r.from"),
        ("step: 5}", "step: 5 N}", "optimize.variables.r.step"),
        ("poses: [{arm: 0}, {arm: 30}]", "sweep: {arm: {from: 0, to: r, step: 5}}", "kinematics.sweep.arm.to"),
        ("{result: 2*r, at_most: 50}", "{result: r + 1, at_most: 50 deg}", "optimize.subject_to.0"),
    ],
)
def test_a_parameter_carries_its_unit(old, new, key):
    text = OPTIMIZE.format(
        "{variables: {r: {from: 10, to: 80, step: 5}}, maximize: kinematics.P.x, "
        "subject_to: [{result: 2*r, at_most: 50}]}"
    )
    mechdesign.optimize(mechdesign.load(text=text))
    assert old in text
    with pytest.raises(mechdesign.StudyError, match="is expected") as caught:
        mechdesign.optimize(mechdesign.load(text=text.replace(old, new)))
    assert [problem.key for problem in caught.value.problems] == [key]


@pytest.mark.parametrize("tolerance", ["0.1 deg", "[-0.1 deg, 0]", "{sigma: 0.1 deg}"])
def test_a_tolerance_of_a_parameter_is_in_its_unit(tolerance):
    text = OPTIMIZE.format("{}").replace("optimize: {}", f"reliability: {{dimensions: {{r: {tolerance}}}}}")
    mechdesign.load(text=text.replace("deg", "mm"))
    with pytest.raises(mechdesign.StudyError, match="is an angle, where a length is expected"):
        mechdesign.load(text=text)


def test_steps_and_cases_are_in_the_unit_of_what_changes():
    asked = "sensitivities: {{results: [kinematics.P.x.max], parameters: [{{parameter: r, step: {}}}]}}"
    text = OPTIMIZE.replace("optimize: {}", asked)
    study = mechdesign.load(text=text.format("1 cm"))
    assert mechdesign.sensitivities(study).main["derivative"] == pytest.approx([1.0])
    with pytest.raises(mechdesign.StudyError, match=WRONG.format("force", "length")):
        mechdesign.sensitivities(mechdesign.load(text=text.format("1 N")))
    asked = "matrix: {{results: [kinematics.P.x.max], vary: {{mechanism.parameters.r: {}}}}}"
    text = OPTIMIZE.replace("optimize: {}", asked)
    found = mechdesign.sweep(mechdesign.load(text=text.format("[4 cm, 50 mm]"))).main
    assert found["kinematics.P.x.max"] == pytest.approx([40.0, 50.0])
    with pytest.raises(mechdesign.StudyError, match="is an angle, where a length is expected"):
        mechdesign.sweep(mechdesign.load(text=text.format("[4 deg, 50 deg]")))


TARGETS = """
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}
  drives: [arm]
  targets: {}
kinematics: {{sweep: {{arm: {{from: 0, to: 90, step: 45}}}}}}
"""


@pytest.mark.parametrize(
    "targets",
    [
        "{arm.angle: 3 mm}",
        "{arm.angle: [1, 2 mm, 3]}",
        "{P.x: [[0 mm, 10 cm], [90, 0]]}",
        "{P: [[0, 10 cm, 0], [90 mm, 0, 100]]}",
    ],
)
def test_targets_are_of_the_kind_of_their_output_and_drive(targets):
    with pytest.raises(mechdesign.StudyError, match=WRONG.format("length", "angle")):
        mechdesign.load(text=TARGETS.format(targets))


def test_a_target_is_converted():
    study = mechdesign.load(text=TARGETS.format("{P.x: [[0 rad, 10 cm], [1.5707963267948966 rad, 0]]}"))
    assert mechdesign.kinematics(study).main["P.x_error"] == pytest.approx([0, 100 * (math.sqrt(0.5) - 0.5), 0])
