"""Templates are studies, and the JSON Schema accepts what the loader accepts."""

import json
from pathlib import Path

import jsonschema
import pytest
import yaml
from helpers import command_line

import mechdesign

TEMPLATES = ("five_bar", "four_bar", "slider_crank", "two_link_arm")


def template(name):
    """The study that `mechdesign new` prints."""
    return command_line.ask("new", name, study="").stdout


def schema():
    return json.loads(command_line.ask("schema", study="").stdout)


@pytest.fixture(scope="module")
def validator():
    found = schema()
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEMPLATES)
def test_templates_are_studies(name, validator):
    study = mechdesign.load(text=template(name))
    assert study.questions
    for section in {"kinematics", "stiffness"} & {*study.questions}:
        assert len(getattr(mechdesign, section)(study).main)
    validator.validate(yaml.safe_load(template(name)))


def test_unknown_template():
    done = command_line.ask("new", "five_bra", study="")
    assert done.exit_code == 2
    assert "did you mean 'five_bar'?; templates are " + ", ".join(TEMPLATES) in done.stderr
    assert "did you mean 'cam_dwell'?" in command_line.ask("new", "cam_dwel", study="").stderr


def test_shipped_studies_and_pages_are_printed_where_there_is_no_checkout():
    """As the reference names them: a study by its place or its name, of which a template goes first."""
    root = Path(__file__).parents[2]
    told = command_line.ask("docs", "dwell", study="").stdout
    for command, place in (("new", "configs/gallery/cam_dwell.yaml"), ("docs", "docs/howto/gears_and_cams.md")):
        assert f"(mechdesign {command} {place} prints the " in told
        assert command_line.ask(command, place, study="").stdout == (root / place).read_text(encoding="utf-8")
    workflow = command_line.ask("docs", "docs/ci/github.yml", study="").stdout
    assert workflow == (root / "docs/ci/github.yml").read_text(encoding="utf-8")
    assert template("cam_dwell") == (root / "configs/gallery/cam_dwell.yaml").read_text(encoding="utf-8")
    assert template("four_bar") != template("configs/gallery/four_bar.yaml")
    assert template("four_bar").startswith("# The shortest study")


def test_the_built_in_arm_has_the_dimensions_of_its_source():
    study = mechdesign.load(text=template("two_link_arm"))
    assert study.parameters.nominal == {"r1": 10.0, "r2": 8.0}
    assert [pose["theta2"] for pose in study.reliability.poses] == [60.0, 45.0, 80.0]
    assert study.reliability.clearances["O"].radius == 0.03


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "configs").glob("*.yaml")), ids=lambda p: p.stem)
def test_the_schema_accepts_the_shipped_studies(path, validator):
    validator.validate(yaml.safe_load(path.read_bytes()))


@pytest.mark.parametrize(
    "text",
    [
        "mechanism: {links: {ground: 3}}",
        "mechanism: {links: {ground: {from: O, to: A, lenght: 3}}}",
        "mechanism: {links: {}, branch: no}",
        "kinematics: {}",
        "mechanism: {links: {ground: {O: [0, 0]}}}\nreliability: {methods: [forms]}",
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(text, validator, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(text)
    with pytest.raises(mechdesign.StudyError):
        mechdesign.load(path)
    assert list(validator.iter_errors(yaml.safe_load(text)))


@pytest.mark.slow
def test_the_committed_schema_is_current():
    committed = Path(__file__).parents[2] / "configs" / "mechdesign.schema.json"
    assert json.loads(committed.read_text(encoding="utf-8")) == schema(), (
        "run: mechdesign schema > configs/mechdesign.schema.json"
    )
