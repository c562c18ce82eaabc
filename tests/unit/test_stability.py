"""What version 1 promises: studies, tables, exit codes, options and Python as they were frozen (`helpers/promises.py`).

Each failure here is a promise that is broken (docs/reference/stability.md): take the change back, or make it version 2.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from helpers import command_line
from helpers.promises import FACTS, FROZEN, facts, frozen_studies, promises

import mechdesign

THEN = json.loads(FROZEN.read_text(encoding="utf-8"))
NOW = promises()
THEN_ASKED = json.loads(frozen_studies()[FACTS])
BROKEN = "docs/reference/stability.md promises otherwise: take it back, or make it version 2"


@pytest.mark.parametrize("name", sorted(frozen_studies().keys() - {FACTS}))
def test_a_study_of_version_1_asks_the_same_of_the_same_mechanism(name: str) -> None:
    now, then = facts(mechdesign.load(text=frozen_studies()[name].decode())), THEN_ASKED[name]
    if "points" in then:
        size = max(abs(part) for place in then["points"].values() for part in place)
        for part in ("dimensions", "points"):
            told = f"{name}: {part} of its mechanism have other values; {BROKEN}"
            assert now[part].keys() >= then[part].keys(), told
            for one, value in then[part].items():
                assert now[part][one] == pytest.approx(value, abs=1e-7 * size), told
        assert now["drives"] == then["drives"], f"{name}: other drives; {BROKEN}"
        assert not {*then["coordinates"]} - {*now["coordinates"]}, f"{name}: coordinates are gone; {BROKEN}"
    for part in ("questions", "sections", "requirements"):
        assert now[part] == then[part], f"{name}: asks otherwise; {BROKEN}"


@pytest.mark.parametrize("part", ["words", "columns", "options"])
def test_no_word_column_or_option_of_version_1_is_gone(part: str) -> None:
    for name, then in THEN[part].items():
        now = NOW[part].get(name, {})
        gone = sorted({*then} - {*now})
        assert not gone, f"{', '.join(gone)} is gone, {part} of {name!r}; {BROKEN}"
        if isinstance(then, Mapping):
            assert {column: now[column] for column in then} == then, f"another unit: {part} of {name!r}; {BROKEN}"


def test_what_counts_where_a_key_is_left_out_is_as_in_version_1() -> None:
    changed = {key: default for key, default in THEN["defaults"].items() if NOW["defaults"].get(key) != default}
    assert not changed, BROKEN


@pytest.mark.parametrize(
    ("pose", "most", "folder", "code"),
    [
        ("{arm: 60}", 60, "out", 0),
        ("{arm: 60}", 40, "out", 1),
        ("{leg: 60}", 60, "out", 2),
        ("{P.x: 120}", 60, "out", 3),
        ("{arm: 60}", 60, "file/out", 4),
    ],
)
def test_exit_codes_of_version_1_mean_the_same(tmp_path: Path, pose: str, most: int, folder: str, code: int) -> None:
    assert NOW["exit codes"].items() >= THEN["exit codes"].items(), BROKEN
    (tmp_path / "file").touch()
    study = f"""
mechanism: {{links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}, drives: [arm]}}
kinematics: {{poses: [{pose}]}}
requirements: [{{result: kinematics.P.x.max, at_most: {most}}}]
"""
    done = command_line.ask("run", "-", "--no-plots", "--out", tmp_path / folder, study=study)
    assert done.exit_code == code, BROKEN


@pytest.mark.parametrize("name", THEN["python"])
def test_functions_and_classes_of_version_1_take_and_have_what_they_did(name: str) -> None:
    assert name in NOW["python"], f"{name} is gone; {BROKEN}"
    now, then = NOW["python"][name], THEN["python"][name]
    if isinstance(then, list):
        now, then = {"": now}, {"": then}
    for member, parameters in then.items():
        assert member in now, f"{name} {member} is gone; {BROKEN}"
        assert fits(parameters, now[member]), f"{name} {member} takes {now[member]}, not {parameters}; {BROKEN}"


def fits(then: Sequence[Sequence[str]] | None, now: Sequence[Sequence[str]] | None) -> bool:
    """Whether each call that was right still is: the same parameters, and new ones that may be left out."""
    if then is None or now is None:
        return then is now
    in_order = [parameter for parameter in then if parameter[1] != "KEYWORD_ONLY"]
    new = [parameter for parameter in now if parameter not in then]
    return (
        [*now[: len(in_order)]] == in_order
        and all(parameter in now for parameter in then)
        and all(default or kind.startswith("VAR") for _, kind, default in new)
    )


def test_what_would_break_a_call_is_seen() -> None:
    then = [["study", "POSITIONAL_OR_KEYWORD", ""], ["jobs", "KEYWORD_ONLY", "1"]]
    assert fits(then, [*then, ["style", "KEYWORD_ONLY", "None"]])
    assert not fits(then, [*then, ["style", "KEYWORD_ONLY", ""]])
    assert not fits(then, [then[0], ["jobs", "KEYWORD_ONLY", "2"]])
    assert not fits(then, [["style", "POSITIONAL_OR_KEYWORD", "None"], *then])
    assert not fits(then, then[:1])
