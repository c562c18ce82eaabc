"""Derivatives of results against closed forms and the tables of other questions; what is no derivative is told."""

import numpy as np
import pytest

import mechdesign

SLIDER = """
mechanism:
  parameters: {r: 30, l: 100, e: 10}
  links: {ground: {O: [0, 0], G: [0, e]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: [crank]
  sketch: {A: [0, 30], B: [95, 10]}
kinematics: {poses: [{crank: 60}], outputs: [B.x]}
sensitivities: {results: [kinematics.B.x], parameters: [r, l, e, kinematics.poses.0.crank]}
"""


def rows(text, *changes):
    answer = mechdesign.sensitivities(mechdesign.load(text=text, overrides=changes))
    return answer, answer.main


def test_derivatives_of_a_slider_crank_are_its_closed_form():
    answer, table = rows(SLIDER)
    r, rod, e, q = 30, 100, 10, np.radians(60)
    v = r * np.sin(q) - e
    s = np.sqrt(rod**2 - v**2)
    exact = np.array(
        [np.cos(q) - v * np.sin(q) / s, rod / s, v / s, (-r * np.sin(q) - v * r * np.cos(q) / s) * np.pi / 180]
    )
    np.testing.assert_allclose(table["derivative"], exact, rtol=1e-9)
    assert (np.abs(table["derivative"] - exact) <= table["error"] + 1e-14).all()
    assert table["unit"].tolist() == ["mm/mm", "mm/mm", "mm/mm", "mm/deg"]
    assert not answer.warnings
    jacobian = mechdesign.kinematics(mechdesign.load(text=SLIDER)).tables["jacobian"]
    assert table["derivative"][3] == pytest.approx(np.radians(1) * jacobian["B.x_by_crank"][0], rel=1e-9)


def test_they_are_those_of_the_linear_error_model():
    made = (
        "reliability: {dimensions: {r: 0.1, l: 0.1, e: 0.1}, poses: [{crank: 60}], outputs: [B.x], limits: {B.x: 0.5},"
        " methods: [analytic]}"
    )
    linear = mechdesign.reliability(mechdesign.load(text=SLIDER + made)).tables["contributions"]
    _, table = rows(SLIDER)
    for name in "rle":
        found = table["derivative"][table["parameter"] == name]
        np.testing.assert_allclose(found, linear["derivative"][linear["source"] == name], rtol=1e-9)


def test_deflection_grows_with_the_load_and_falls_with_the_drive_s_stiffness():
    text = """
mechanism:
  links: {ground: {O: [0, 0]}, beam: [O, P, 400]}
  drives: {q: {angle: beam}}
  sketch: {P: [400, 0]}
stiffness: {at: P, actuators: {q: 4.0e+7}, poses: [{q: 30}], loads: [[0, -60]]}
sensitivities:
  results: [stiffness.deflections.dy]
  parameters: [stiffness.loads.0.1, stiffness.actuators.q]
"""
    _, table = rows(text)
    deflection = -60 * (400 * np.cos(np.radians(30))) ** 2 / 4e7
    np.testing.assert_allclose(table["value"], deflection, rtol=1e-12)
    np.testing.assert_allclose(table["derivative"], [deflection / -60, -deflection / 4e7], rtol=1e-8)
    # A larger load bends it further down, stiffer gears less.
    np.testing.assert_allclose(table["elasticity"], [1, 1], rtol=1e-8)
    assert table["unit"].tolist() == ["mm/N", "mm/(N*mm/rad)"]


def test_units_of_what_is_no_parameter_of_the_mechanism():
    """Of a tolerance and of a section's numbers, in the short form too: without them the ratio has another unit."""
    text = """
mechanism:
  links: {ground: {O: [0, 0]}, beam: [O, P, 400]}
  drives: {q: {angle: beam}}
  sketch: {P: [400, 0]}
stiffness: {at: P, sections: {s: {E: 210 GPa, width: 20, height: 40}}, elastic: {beam: s}, poses: [{q: 30}]}
reliability: {dimensions: {"*.length": 0.06, q: 0.01}, poses: [{q: 30}], limits: {P.x: 0.05}, methods: [analytic]}
sensitivities:
  results: [stiffness.k_min]
  parameters: [stiffness.sections.s.E, stiffness.sections.s.height, "reliability.dimensions.*.length",
               reliability.dimensions.q]
"""
    _, table = rows(text)
    assert table["at_unit"].tolist() == ["N/mm^2", "mm", "mm", "deg"]
    assert table["unit"].tolist() == ["N/(mm*N/mm^2)", "N/(mm*mm)", "N/(mm*mm)", "N/(mm*deg)"]


def test_what_is_no_derivative_is_told():
    answer, table = rows(
        SLIDER, "sensitivities.parameters=[l]", "mechanism.parameters.l=20.1", "kinematics.poses=[{crank: 91}]"
    )
    assert np.isnan(table["derivative"][0])
    assert "is not known near 20.1" in str(answer.warnings[0])
    assert "cannot be assembled" in str(answer.warnings[0])


def test_another_step_is_shorter_where_that_given_is_long():
    text = """
mechanism:
  parameters: {g: 100}
  links: {ground: {O: [0, 0], D: [g, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle]}
sensitivities: {results: kinematics.extremes.rocker.angle.range, parameters: {parameter: g, step: 40}}
"""
    answer, _ = rows(text)
    assert "another step may help, {parameter: g, step: 4}" in str(answer.warnings[0])


def test_warnings_of_the_cases_are_told():
    whole = "kinematics={sweep: {crank: {from: 0, to: 360, step: 90}}, outputs: [B.x]}"
    asked = "sensitivities={results: [kinematics.extremes.B.x.range], parameters: [r]}"
    answer, _ = rows(SLIDER, asked, "mechanism.parameters.l=39.9", whole)
    assert any("of 13 cases have warnings; the first: kinematics: " in warning for warning in map(str, answer.warnings))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("sensitivities.parameters=[rr]", "rr"),
        ("sensitivities.parameters=[mechanism.drives]", "only a number"),
        ("sensitivities.results=[kinematics.C.x]", "C.x"),
        ("sensitivities.results=[]", "names nothing"),
        ("sensitivities.parameters=[r, mechanism.parameters.r]", "listed twice"),
        ("mechanism.parameters.e=0", "say by how much"),
    ],
)
def test_mistakes_are_told_before_anything_is_computed(change, message):
    with pytest.raises(mechdesign.StudyError, match=message):
        mechdesign.sensitivities(mechdesign.load(text=SLIDER, overrides=[change]))
