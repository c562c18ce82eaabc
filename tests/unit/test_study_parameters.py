"""From parameters to the geometry, one design or thousands at once."""

import math

import numpy as np
import pytest

import mechdesign

STUDY = """
mechanism:
  parameters: {r: 40, l: "3*r", e: -20, tilt: 10, free: 5}
  links:
    ground: {O: [0, 0], G: [0, e]}
    crank: [O, A, r]
    rod: {from: A, to: B, length: l, points: {P: [l/2, 15]}}
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G, direction: tilt - 10}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
"""


@pytest.fixture
def parameters(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return mechdesign.load(path).parameters


def test_what_depends_on_a_parameter_follows(parameters):
    assert parameters.nominal["l"] == 120.0
    assert parameters.places({"r": 41.0}) == {"crank.length": 41.0, "rod.length": 123.0, "rod.P.x": 61.5}
    assert parameters.places({"free": 6.0}) == {}


def test_a_parameter_that_is_set_no_longer_follows(parameters):
    assert parameters.places({"r": 41.0, "l": 100.0}) == {"crank.length": 41.0, "rod.length": 100.0, "rod.P.x": 50.0}


def test_thousands_of_designs_at_once(parameters):
    r, tilt = np.linspace(30, 50, 2000)[:, None], np.array([10.0, 20.0])
    places = parameters.places({"r": r, "tilt": tilt})
    np.testing.assert_allclose(places["rod.P.x"], 1.5 * r)
    np.testing.assert_allclose(places["guide.direction"], np.radians([0.0, 10.0]), atol=1e-15)


def test_a_place_varies_alone(parameters):
    assert parameters.places({"rod.length": 99.0}) == {"rod.length": 99.0}
    assert parameters.places({"guide.direction": 90.0}) == {"guide.direction": pytest.approx(math.pi / 2)}
    with pytest.raises(KeyError):
        parameters.places({"rod.lenght": 1.0})


def test_derivatives_go_through_all_parameters(parameters):
    assert parameters.derivatives("r") == pytest.approx({"crank.length": 1.0, "rod.length": 3.0, "rod.P.x": 1.5})
    assert parameters.derivatives("tilt") == pytest.approx({"guide.direction": math.pi / 180})
    assert parameters.derivatives("guide.direction") == pytest.approx({"guide.direction": math.pi / 180})
    assert parameters.derivatives("free") == {}


def test_patterns(parameters):
    assert parameters.match("*.length") == ("crank.length", "rod.length")
    assert parameters.match("rod.P.*") == ("rod.P.x", "rod.P.y")
