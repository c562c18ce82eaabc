"""Every statement of the page of limits holds: a study passes the limit, and the tool says what the page says."""

from __future__ import annotations

from pathlib import Path

import limits
import pytest
from helpers.command_line import ask
from limits import Limit

from mechdesign.commands import COMMANDS
from mechdesign.ground.cautions import KINDS

ALL = [(about, limit) for about, entries in limits.limits().items() for limit in entries]
PAGE = Path(__file__).parents[2] / "docs" / "theory" / "limits.md"


def words(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("limit", [
    # The night looks at all of them.
    pytest.param(limit, id=f"{about}: {limit.limit[:50]}", marks=() if k % 5 == 1 else pytest.mark.nightly)
    for k, (about, limit) in enumerate(ALL)
])  # fmt: skip
def test_a_limit_is_told_as_the_page_says(limit: Limit, tmp_path: Path) -> None:
    out = () if limit.ask == "check" else ("--out", tmp_path)
    done = ask(*limit.command("-"), "--no-plots", *out, study=limit.text)
    said = words(done.stderr + done.stdout)
    assert done.exit_code == limit.code
    if limit.says == limits.NOTHING:
        assert "warning:" not in said
        return
    assert words(limit.says) in said
    if limit.kind:
        told = [line for line in done.stderr.splitlines() if f"[{limit.kind}]" in line]
        assert any(words(limit.says) in words(line) for line in told)


def test_every_question_has_limits_and_every_kind_is_one() -> None:
    assert {about.lower() for about in limits.limits()} == {"all questions", *COMMANDS}
    assert {limit.kind for _, limit in ALL} - {""} <= KINDS.keys()
    assert len(ALL) >= 35


def test_the_page_is_made_of_the_list() -> None:
    (text,) = limits.pages().values()
    assert "{include} _limits.md" in PAGE.read_text(encoding="utf-8")
    for _, limit in ALL:
        assert limit.limit in text
        assert limit.told in text
