"""Reading YAML: numbers and words of YAML 1.2, positions, and files that are no study."""

import math
import time

import pytest

import mechdesign
from mechdesign.study.text.document import read


def data(text):
    return read(text.encode(), "s.yaml").data


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("-2.5E+3", -2500.0),
        (".5", 0.5),
        ("010", 10),
        ("on", "on"),
        ("no", "no"),
        ("y", "y"),
        ("12:30", "12:30"),
        ("2024-01-01", "2024-01-01"),
        ("1_000", "1_000"),
        ("true", True),
        ("~", None),
        ("'40'", "40"),
        ("-.inf", -math.inf),
    ],
)
def test_scalars_follow_yaml_1_2(text, value):
    found = data(f"key: {text}")["key"]
    assert found == value
    assert type(found) is type(value)


def test_keys_are_words_whatever_they_look_like():
    assert data("{on: 1, 2: 3, true: 4}") == {"on": 1, "2": 3, "true": 4}


def test_aliases_are_expanded_and_stand_where_they_are_written():
    document = read(b"a: &x [1, 2]\nb: *x\n", "s.yaml")
    assert document.data == {"a": [1, 2], "b": [1, 2]}
    assert document.data["a"] is not document.data["b"]


def test_positions_count_from_one():
    document = read(b"a:\n  b: [1, {c: 2}]\n", "s.yaml")
    mark = document.values["a", "b", 1, "c"]
    assert (mark.line, mark.column) == (2, 14)
    assert (document.keys["a", "b"].line, document.keys["a", "b"].column) == (2, 3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: 2\na: 3\n", "s.yaml:3:1: a: duplicate key; 'a' is given in line 1 already"),
        ("v: {to: min(a, b)}", "s.yaml:1:9: v: 'min(a' is cut off"),
        ("v: [hypot(1, 2)]", "s.yaml:1:5: v: 'hypot(1' is cut off"),
    ],
)
def test_mistakes_of_writing_are_noted(text, expected):
    problems = read(text.encode(), "s.yaml").problems
    assert len(problems) == 1
    assert str(problems[0]).startswith(expected)


def test_balanced_parentheses_and_quotes_are_no_trap():
    document = read(b'v: {to: (a + b)/2, from: "min(a, b)"}\nw: min(a, b)', "s.yaml")
    assert not document.problems
    assert document.data == {"v": {"to": "(a + b)/2", "from": "min(a, b)"}, "w": "min(a, b)"}


BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{previous}'] * 10)}]\n"
    for previous, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "s.yaml: is empty"),
        (b"# only a comment\n", "s.yaml: is empty"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", "s.yaml: is not a text file in UTF-8"),
        (b"\x00\x01\x02", "s.yaml: is not a text in YAML"),
        (b"a: [1, 2\nb: 3", "s.yaml:1:4: is not YAML: this '[' is not closed where line 2 goes on"),
        (b"a:\n\tb: 1", "s.yaml:2:1: is not YAML"),
        (b"a: b: c", "s.yaml:1:5: is not YAML"),
        (b"*.length: 1", "put a word that begins with '*' in quotes"),
        (b"a: 1\n---\nb: 2\n", "s.yaml:2:1: a second YAML document"),
        (b"a: !!python/object/apply:os.system [ls]", "s.yaml:1:4: the YAML tag"),
        (b"a: &x [*x]", "nested deeper than 40 levels"),
        (b"a: *x", "undefined alias"),
        (b"[" * 100_000, "nested deeper than"),
        (b"- " * 100_000, "nested deeper than"),
        (BOMB.encode(), "once its aliases are expanded"),
    ],
    ids=[
        "empty",
        "comment",
        "png",
        "control",
        "open",
        "tab",
        "colons",
        "star",
        "two",
        "tag",
        "cycle",
        "alias",
        "flow",
        "block",
        "bomb",
    ],
)
def test_what_is_no_study_is_told_quickly(content, message):
    start = time.perf_counter()
    with pytest.raises(mechdesign.StudyError) as caught:
        read(content, "s.yaml")
    assert message in str(caught.value)
    assert time.perf_counter() - start < 5.0
