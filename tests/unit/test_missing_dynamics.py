"""Dynamics of a study that has no such section: what acts without it is answered, else it says what to write."""

import numpy as np
import pytest

import mechdesign

ARM = """
mechanism:
  links: {ground: {O: [0, 0], W: [-50, 0]}, arm: {from: O, to: P, length: 100, mass: 2 kg}}
  drives: [arm]
  springs: SPRING
kinematics: {sweep: {arm: {from: 10, to: 90, step: 20}}, RATES}
"""
SPRING = "{pull: {between: [W, P], stiffness: 3 N/mm, free_length: 40}}"
NAME = "dynamics.O_force.max"
SPEED = "rates: {arm: 60 rpm}"


def study(rates="outputs: [P]", spring="{}", **overrides):
    return mechdesign.load(text=ARM.replace("RATES", rates).replace("SPRING", spring), overrides=overrides)


def test_a_mass_that_turns_pulls_at_its_pin():
    result = mechdesign.dynamics(study(SPEED))
    # m r omega^2 with the centre of mass in the middle of the arm, in newtons.
    force = 2.0 * 0.05 * (2 * np.pi) ** 2
    assert result.tables["joint_forces"]["magnitude"] == pytest.approx(force, rel=1e-12)
    assert result.main["arm_effort"] == pytest.approx(0.0, abs=1e-9)
    assert "there is no gravity" in " ".join(map(str, result.warnings))


def test_a_spring_is_held_by_the_drive_at_rest():
    main = mechdesign.dynamics(study(spring=SPRING)).main
    angle = np.radians(main["arm"])
    way = np.hypot(100 * np.cos(angle) + 50, 100 * np.sin(angle))
    # The slope of its energy, (3 N/mm) (way - 40 mm)^2 / 2.
    assert main["arm_effort"] == pytest.approx(-3 * (way - 40) * 50 * 100 * np.sin(angle) / way, rel=1e-9)


def test_an_empty_section_gives_the_same_numbers():
    alone, empty = (mechdesign.dynamics(study(SPEED, SPRING, **more)).main for more in ({}, {"dynamics": {}}))
    assert alone.names == empty.names
    assert all(np.array_equal(alone[name], empty[name]) for name in alone.names)


def test_where_nothing_acts_it_says_what_to_write():
    with pytest.raises(mechdesign.StudyError, match=r"dynamics: is missing.*gravity: \[0, -9\.81 m/s\^2\]"):
        mechdesign.dynamics(study())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "section", "column", "newtons"),
    [
        ("sweep", "matrix: {vary: {MASS: [1, 4]}, results: [NAME]}", NAME, [1, 4]),
        ("sensitivities", "sensitivities: {results: [NAME], parameters: [MASS]}", "derivative", [1]),
        ("optimize", "optimize: {variables: {arm.length: {choices: [100, 50]}}, minimize: NAME}", NAME, [1]),
    ],
)
def test_results_of_dynamics_need_no_section(command, section, column, newtons):
    text = ARM.replace("RATES", SPEED).replace("SPRING", "{}") + section
    text = text.replace("NAME", NAME).replace("MASS", "mechanism.links.arm.mass")
    table = getattr(mechdesign, command)(mechdesign.load(text=text)).main
    assert table[column] == pytest.approx(np.array(newtons) * 0.05 * (2 * np.pi) ** 2, rel=1e-9)
