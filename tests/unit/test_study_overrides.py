"""``--set``: which key a dotted name means, and what is told where it means none."""

import pytest

import mechdesign

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


@pytest.mark.slow
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
        ("mechanism.links.krank.2=42", "there is no mechanism.links.krank to have a '2'; did you mean 'crank'?"),
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
    with pytest.raises(mechdesign.StudyError) as caught:
        load(override)
    assert str(caught.value).startswith(f"--set {override}")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["mechanism.parameters.R=99"], "the study has no parameter 'R', and nothing uses one; did you mean 'r'?"),
        (["mechanism.parameters.nosuch=99"], "the study has no parameter 'nosuch', and nothing uses one"),
        (["mechanism.parameters.nosuch.x=99"], "a parameter's name is letters"),
        (["mechanism.parameters.a=1", "mechanism.parameters.b=2*a"], "the study has no parameter 'a'"),
        (["stiffness.at=B", "stiffness.sections.tube={E: 2e5, diameter: 9}"], "the study has no section 'tube'"),
        (["kinematics.sweeep="], "there is no kinematics.sweeep to take away; did you mean 'sweep'?"),
        (["mechanism.sketch.Q="], "there is no mechanism.sketch.Q to take away"),
    ],
)
def test_what_an_override_adds_for_nothing(load, overrides, message):
    with pytest.raises(mechdesign.StudyError) as caught:
        load(*overrides)
    assert str(caught.value).startswith(f"--set {overrides[0]}") or len(overrides) > 1
    assert message in str(caught.value)


def test_what_an_override_adds_and_something_uses(load):
    study = load("mechanism.parameters.k=2", "mechanism.parameters.half=r/k", "mechanism.links.rocker.length=2*half*k")
    assert study.mechanism.description.places["rocker.length"].nominal == 60
    assert study.warnings == ()
    assert load("mechanism.parameters.k=2", "optimize={variables: {k: {from: 1, to: 2, number: 3}}, minimize: [area]}")


def test_taking_away_what_may_stand_there_and_does_not(load):
    study = load("stiffness.loads=", "kinematics.poses=")
    assert study.stiffness is None
    assert study.kinematics is not None


USES = [
    "mechanism.links.rocker.length=u",
    "mechanism.sketch.B.1=u",
    "mechanism.limits=[{distance: [A, D], max: u}]",
    "mechanism.targets={B.x: u*theta}",
    "mechanism.targets={B.x: [[0, 3], [9, u]]}",
    "kinematics.sweep.theta.to=u",
    "kinematics.rates.theta=u",
    "reliability.dimensions.u=0.1",
    "reliability.dimensions.rod.length.tolerance=u",
    "reliability.samples=u*10",
    "stiffness={at: B, loads: [[u, 0]]}",
    "optimize={variables: {u: {from: 1, to: 2, number: 3}}, minimize: [area]}",
    "optimize={variables: {r: {from: 1, to: u, number: 3}}, minimize: [area]}",
    "requirements=[{result: kinematics.B.x, at_least: u}]",
    "mechanism.parameters.r=u/2",
]


@pytest.mark.slow
@pytest.mark.parametrize("use", ["name=x", *USES])
def test_a_parameter_that_nothing_uses_is_told(use, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.replace("{r: 30}", "{u: 60, r: 30}"))
    told = [str(warning) for warning in mechdesign.load(path, [use]).warnings]
    assert told == ([] if use in USES else [f"{path}:2:16: mechanism.parameters.u: nothing uses parameter 'u'"])


@pytest.mark.parametrize("text", ["²", "99999999999999999999", "٣", "-1", "1e3", "", " "])
def test_odd_places_in_a_list(text, load):
    with pytest.raises(mechdesign.StudyError):
        load(f"mechanism.links.rocker.{text}=3")


@pytest.mark.parametrize(
    "override",
    ["\udcff=3", "name=\udcff", "a\n.b=3", "x" * 100_000 + "=1", ".".join("a" * 3000) + "=1", "seed=\x00", "=", "."],
)
def test_odd_overrides(override, load):
    with pytest.raises(mechdesign.StudyError) as caught:
        load(override)
    assert len(str(caught.value)) < 2000


@pytest.mark.slow
@pytest.mark.parametrize(
    "word", ["a\N{GRINNING FACE}b", "\U0001d4b3", "\u2028x", "\x7f\x85", "\U000e0041", "\\ud83d\\ude00"]
)
def test_a_mapping_has_the_letters_that_it_has(tmp_path, word):
    """Also those that JSON writes as pairs of surrogates, and breaks of lines, alone and in lists and keys."""
    (tmp_path / "study.yaml").write_text(STUDY)
    study = mechdesign.load(tmp_path / "study.yaml", {"name": word, "mechanism.parameters": {"r": 30, "𝒳": 2}})
    assert study.name == word
    assert study.parameters.nominal == {"r": 30, "𝒳": 2}
    assert mechdesign.load(tmp_path / "study.yaml", study.overrides).name == word
