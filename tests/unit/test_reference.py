"""The reference: every key of the format has a text, every example loads, every word is found."""

import pytest
from pydantic import ValidationError

from mechdesign.door.reference import below, entries, find, near, place
from mechdesign.door.reference.keys import Key, continued, keys
from mechdesign.ground.indices import INDEX_NAMES
from mechdesign.questions.reliability import task
from mechdesign.questions.workspace import quadrature, question
from mechdesign.region import regions
from mechdesign.study.schema.study_file import schema
from mechdesign.study.text.document import read
from mechdesign.study.text.forms import properties
from mechdesign.study.text.reading import Context

ENTRIES = entries()
NAMES = dict.fromkeys(("r", "l", "l_min", "R", "r1"), 1.0)
# What else a section has where the key of an example is checked.
BESIDE = {"weights": {"maximize": ["GII", "SUI"]}}
EXAMPLES = [(key, example) for key in keys() for example in key.model.said(key.name).examples]


def words(name: str) -> list[str]:
    return [entry.word for entry in find(ENTRIES, name)]


def test_a_path_that_is_typed_goes_on_to_keys_of_the_format_and_names_of_the_study():
    """What a Tab completes behind --set and --vary."""
    data = {"mechanism": {"parameters": {"r": 40}, "links": {"crank": ["O", "A", "r"]}}, "synthesis": {"body": [{}]}}
    assert continued("synthesis.j", None)[:3] == [
        "synthesis.judge", "synthesis.judge.tolerance", "synthesis.judge.dimensions"
    ]  # fmt: skip
    assert continued("synthesis.judge.w", None) == ["synthesis.judge.within"]
    assert continued("mechanism.parameters.", data) == ["mechanism.parameters.r"]
    assert "mechanism.links.crank.length" in continued("mechanism.links.crank", data)
    assert continued("synthesis.body.0.a", data) == ["synthesis.body.0.angle"]
    assert continued("nowhere.", data) == continued("synthesis.judge.within=", data) == []


@pytest.mark.slow
def test_every_key_has_a_text():
    told = {entry.word: entry.text for entry in ENTRIES if entry.kind == "key"}
    assert [key.path for key in keys() if len(told.get(key.path, "")) < 8] == []
    found = schema()
    for model in (found, *found["$defs"].values()):
        for key, form in properties(model).items():
            assert "description" in form or "$ref" in form or "anyOf" in form, (model, key)
            assert form["title"]


@pytest.mark.slow
@pytest.mark.parametrize(("key", "example"), EXAMPLES, ids=[f"{key.path}-{text}" for key, text in EXAMPLES])
def test_every_example_is_read(key: Key, example: str):
    document = read(f"{key.name}: {example}".encode(), key.path)
    assert not document.problems
    # Other keys of the section may be missing; what is wrong with this one is not.
    try:
        key.model.model_validate(document.data | BESIDE.get(key.name, {}), context=Context(parameters=NAMES))
    except ValidationError as error:
        wrong = [each for each in error.errors() if each["loc"][:1] == (key.name,)]
        assert not wrong


def test_an_example_that_is_wrong_is_found():
    key = next(key for key in keys() if key.path == "mechanism.links.*.length")
    with pytest.raises(AssertionError):
        test_every_example_is_read(key, "-90")


def test_numbers_in_the_texts_are_those_of_the_code():
    told = {entry.word: entry.text for entry in ENTRIES if entry.kind == "key"}
    rays, nodes = quadrature.RAYS, quadrature.RADIAL_NODES
    for path, numbers in {
        "workspace.scan.rays": (regions.RAYS, rays["midpoint"], rays["sector_mean"]),
        "workspace.integrate.nodes": (nodes["midpoint"], nodes["sector_mean"]),
        "reliability.samples": (f"{task.MAX_SAMPLES:,}",),
        "reliability.precision": (task.RELATIVE_PRECISION,),
        "kinematics.path.*.points": (72, 51),
        "reliability.dimensions.*.measured": (10,),
    }.items():
        for number in numbers:
            assert f" {number}" in told[path], path
    assert question.TOLERANCE == 1e-5
    assert question.GRID_TOLERANCE == 1e-4


def test_words_are_found_by_path_by_last_part_by_kind_and_in_any_case():
    assert words("mechanism.joints.guide.angle") == words("mechanism.joints.angle") == ["mechanism.joints.*.angle"]
    assert words("pin") == ["mechanism.plates.pin", "reliability.clearances.*.pin", "synthesis.judge.clearances.*.pin"]
    assert set(words("angle")) == {
        "angle", "units.angle", "synthesis.body.*.angle",
        *(f"mechanism.{part}.*.angle" for part in ("joints", "drives", "measures", "limits"))
    }  # fmt: skip
    assert words("gii") == ["GII"]
    assert words("sigma_min_mean") == ["*_mean"]
    assert words("local index") == list(INDEX_NAMES)
    assert words("kN") == ["k-", "N"]
    assert words("reliability.dimensions.rod.length.tolerance") == ["reliability.dimensions.*.tolerance"]
    assert words("clearence") == []
    assert near(ENTRIES, "clearence") == "clearance"


def test_what_is_said_of_a_word():
    (pin,) = find(ENTRIES, "reliability.clearances.pin")
    assert [word for word, _ in pin.words] == ["normal", "normal_in_disc", "uniform", "contact"]
    index, column = find(ENTRIES, "inverse_condition")
    assert column.where == ("motion.csv",)
    assert (index.source, index.unit) == ("S1, eq. 23", "Pure number")
    assert "sigma_min/sigma_max" in index.formula
    (clearances,) = find(ENTRIES, "reliability.clearances")
    assert [key.last for key in below(ENTRIES, clearances)][:3] == ["radial", "diametral", "fit"]
    (length,) = find(ENTRIES, "mechanism.links.length")
    assert (length.takes, length.unit) == ("number", "length (mm where the study says no units)")


def test_a_method_of_reliability_says_when_to_use_it_and_which_keys_it_takes():
    for word, parts in {
        "analytic": ("First-order errors", "linear over the tolerances", "no interval", "pin.analytic"),
        "auto": ("a 99.7 % interval", "reliability.samples, reliability.precision, ", "pin.monte_carlo"),
    }.items():
        entry = next(entry for entry in find(ENTRIES, word) if entry.kind == "method of reliability")
        assert all(part in entry.text for part in parts)
        assert entry.where == ("reliability.methods",)
        keys = entry.text.partition("Its keys: ")[2].removesuffix(".").split(", ")
        assert all(find(ENTRIES, key) for key in keys)


def test_every_word_out_of_a_list_has_a_meaning():
    assert all(entry.text for entry in ENTRIES)
    assert all(meaning for entry in ENTRIES for _, meaning in entry.words)
    kinds = {entry.kind for entry in ENTRIES}
    assert kinds >= {"distribution", "pin model", "local index", "function", "unit", "exit code"}


@pytest.mark.parametrize(
    ("path", "key"),
    [
        ("mechanism.links.crank.lenght", "mechanism.links"),
        ("requirements.0.result", "requirements.result"),
        ("reliability.dimensions.*.length", "reliability.dimensions"),
        ("nothing.of.it", ""),
    ],
)
def test_the_place_of_a_mistake(path, key):
    assert place(path) == key
