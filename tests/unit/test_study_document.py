"""Reading YAML: numbers and words of YAML 1.2, positions, and files that are no study."""

import time

import pytest

import mechdesign

ARM = "mechanism: {parameters: PARAMETERS, links: {ground: {O: [0, 0]}, arm: [O, P, 7]}, drives: [arm]}\n"


def parameters(text):
    """Parameters of a study in which they are written so."""
    return mechdesign.load(text=ARM.replace("PARAMETERS", text)).parameters.nominal


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 0.001), ("-2.5E+3", -2500.0), (".5", 0.5), ("010", 10), ("'40'", 40), ("2024-01-01", 2022)],
)
def test_numbers_follow_yaml_1_2(text, value):
    assert parameters(f"{{x: {text}}}") == {"x": value}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("on", "unknown name 'on'"),
        ("no", "unknown name 'no'"),
        ("y", "unknown name 'y'"),
        ("12:30", "':' has no meaning in the expression '12:30'"),
        ("1_000", "unexpected '_000' in the expression '1_000'"),
        ("true", "expected a number, not true"),
        ("~", "expected a number, not nothing"),
        ("-.inf", "expected a finite number, not -inf"),
    ],
)
def test_words_follow_yaml_1_2(text, message):
    with pytest.raises(mechdesign.StudyError, match=f"^<study>:1:29: mechanism.parameters.x: {message}"):
        parameters(f"{{x: {text}}}")


def test_keys_are_words_whatever_they_look_like():
    assert parameters("{on: 1, off: 3, no: 4, true: 5}") == {"on": 1, "off": 3, "no": 4, "true": 5}
    with pytest.raises(mechdesign.StudyError, match=r"mechanism\.parameters\.2: a parameter's name is letters"):
        parameters("{2: 3}")


def test_aliases_are_expanded_and_each_is_changed_alone():
    text = """
mechanism:
  links: {ground: {O: &there [3, 4], Q: *there}, arm: [O, P, 1]}
  drives: [arm]
"""
    for changes, other in ((), (3, 4)), (["mechanism.links.ground.Q.0=5"], (5, 4)):
        pose = mechdesign.load(text=text, overrides=changes).mechanism.solve({"arm": 0})
        assert (pose["O.x"], pose["O.y"], pose["Q.x"], pose["Q.y"]) == (3, 4, *other)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: 2\na: 3\n", "<study>:3:1: a: duplicate key; 'a' is given in line 1 already"),
        ("v: {to: min(a, b)}", "<study>:1:9: v: 'min(a' is cut off"),
        ("v: [hypot(1, 2)]", "<study>:1:5: v: 'hypot(1' is cut off"),
    ],
)
def test_mistakes_of_writing_are_told(text, expected):
    with pytest.raises(mechdesign.StudyError) as caught:
        mechdesign.load(text=text)
    assert any(str(problem).startswith(expected) for problem in caught.value.problems)


def test_balanced_parentheses_and_quotes_are_no_trap():
    assert parameters('{a: 1, b: (a + 4)/2, c: "min(a, b)"}') == {"a": 1, "b": 2.5, "c": 1}


BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{previous}'] * 10)}]\n"
    for previous, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "<study>: is empty"),
        (b"# only a comment\n", "<study>: is empty"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", "<study>: is not a text file in UTF-8"),
        (b"\x00\x01\x02", "<study>: is not a text in YAML"),
        (b"a: [1, 2\nb: 3", "<study>:1:4: is not YAML: this '[' is not closed where line 2 goes on"),
        (b"a:\n\tb: 1", "<study>:2:1: is not YAML"),
        (b"a: b: c", "<study>:1:5: is not YAML"),
        (b"*.length: 1", "put a word that begins with '*' in quotes"),
        (b"a: 1\n---\nb: 2\n", "<study>:2:1: a second YAML document"),
        (b"a: !!python/object/apply:os.system [ls]", "<study>:1:4: the YAML tag"),
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
        mechdesign.load(text=content)
    assert message in str(caught.value)
    assert time.perf_counter() - start < 5.0
