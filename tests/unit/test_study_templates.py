"""Templates are studies, and the JSON Schema accepts what the loader accepts."""

import json
from pathlib import Path

import jsonschema
import pytest

import mechdesign
from mechdesign.questions.poses import study_poses
from mechdesign.study import template, template_path
from mechdesign.study.schema.study_file import schema
from mechdesign.study.templates import templates
from mechdesign.study.text.document import read


@pytest.fixture(scope="module")
def validator():
    found = schema()
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", templates())
def test_templates_are_studies(name, validator):
    study = mechdesign.load(template_path(name))
    assert study.questions
    for section in ("kinematics", "reliability", "stiffness"):
        if section in study.questions:
            assert study_poses(study, section).count
    validator.validate(read(template(name).encode(), name).data)


def test_unknown_template():
    with pytest.raises(mechdesign.StudyError, match="no template 'five_bra'; did you mean 'five_bar'"):
        template("five_bra")


def test_the_built_in_arm_has_the_dimensions_of_its_source():
    study = mechdesign.load(template_path("two_link_arm"))
    assert study.parameters.nominal == {"r1": 10.0, "r2": 8.0}
    assert [pose["theta2"] for pose in study.reliability.poses] == [60.0, 45.0, 80.0]
    assert study.reliability.clearances["O"].radius == 0.03


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "configs").glob("*.yaml")), ids=lambda p: p.stem)
def test_the_schema_accepts_the_shipped_studies(path, validator):
    validator.validate(read(path.read_bytes(), path.name).data)


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
    assert list(validator.iter_errors(read(text.encode(), "s").data))


def test_the_committed_schema_is_current():
    committed = Path(__file__).parents[2] / "configs" / "mechdesign.schema.json"
    assert json.loads(committed.read_text(encoding="utf-8")) == schema(), (
        "run: mechdesign schema > configs/mechdesign.schema.json"
    )
