"""``--set``: which key a dotted name means, and what is told where it means none."""

import pytest

import mechdesign
from mechdesign.errors import StudyError

STUDY = """\
mechanism:
  parameters: {r: 30}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, r], rod: {from: A, to: B, length: 90}, rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {sweep: {theta: {from: 0, to: 90, step: 5}}}
reliability: {dimensions: {rod.length: {tolerance: 0.1}}}
"""


@pytest.fixture
def load(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return lambda *overrides: mechdesign.load(path, overrides)


def test_values_are_yaml(load):
    study = load("mechanism.parameters.r=42", "kinematics.sweep=", "kinematics.poses=[{theta: 3}, {B.x: 80}]")
    assert study.parameters.nominal == {"r": 42}
    assert study.kinematics.poses == ({"theta": 3.0}, {"B.x": 80.0})
    assert study.overrides[0] == "mechanism.parameters.r=42"
    assert study.resolved["mechanism"]["parameters"] == {"r": 42}


def tolerance(study, name):
    return study.reliability.dimensions[name].tolerance


@pytest.mark.parametrize(
    ("override", "read", "value"),
    [
        ("kinematics.sweep.theta.to=45", lambda s: s.kinematics.sweep["theta"].to, 45.0),
        ("kinematics.rates.theta=2", lambda s: s.kinematics.rates, {"theta": 2.0}),
        ("reliability.dimensions.rod.length.tolerance=1", lambda s: tolerance(s, "rod.length"), (-1.0, 1.0)),
        ("reliability.dimensions.rod.length=2", lambda s: tolerance(s, "rod.length"), (-2.0, 2.0)),
        ("reliability.dimensions.crank.length=2", lambda s: tolerance(s, "crank.length"), (-2.0, 2.0)),
        ("reliability.dimensions.ground.D.x.sigma=2", lambda s: s.reliability.dimensions["ground.D.x"].sigma, 2.0),
        ("reliability.limits.B.x=1", lambda s: s.reliability.limits["B.x"].max, 1.0),
        ("mechanism.links.rocker.length=61", lambda s: s.mechanism.description.places["rocker.length"].nominal, 61.0),
        ("mechanism.links.rocker.2=62", lambda s: s.mechanism.description.places["rocker.length"].nominal, 62.0),
        ("mechanism.sketch.B.1=50", lambda s: s.mechanism.description.sketch["B"], 75 + 50j),
        ("seed=3", lambda s: s.seed, 3),
        ("name=a=b", lambda s: s.name, "a=b"),
    ],
)
def test_dotted_names(load, override, read, value):
    assert read(load(override)) == value


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("mechanism.parametrs.r=42", "mechanism.parametrs: unknown key; did you mean 'parameters'?"),
        ("mechanism.links.crank.lenght=42", "mechanism.links.crank is a list of 3; it has no 'lenght'"),
        ("mechanism.links.rocker.length=-1", "must be positive, not -1"),
        ("mechanism.drives.theta.angle.x=1", "mechanism.drives.theta.angle is neither a mapping nor a list"),
        ("kinematics.sweep.theta={to: min(1, 2)}", "put the expression in quotes"),
        ("mechanism.parameters.r=[", "is not YAML"),
        ("mechanism.parameters.r", "an override is <dotted name>=<value>"),
        ("=3", "an override is <dotted name>=<value>"),
        ("a..b=3", "an override is <dotted name>=<value>"),
    ],
)
def test_wrong_overrides(load, override, message):
    with pytest.raises(StudyError) as caught:
        load(override)
    assert str(caught.value).startswith(f"--set {override}")
    assert message in str(caught.value)
