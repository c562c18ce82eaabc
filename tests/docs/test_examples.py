"""Examples of pages do what the pages say, and what counts as the output that a page shows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import examples
import pytest
from forking import forked

LINK = re.compile(r"\]\((?!\w+:)([^)#\s.][^)#\s]*|\.\.?/[^)#\s]+)(?:#[^)]*)?\)")
# Pages and pictures that are made while the site is built.
MADE = {"gallery", "verification", "study", "tables", "lists", "papers.md", "_run"}


@pytest.fixture(scope="session")
def tools() -> Iterator[Path]:
    """The folder of a `mechdesign` that begins at once."""
    with forked() as folder:
        yield folder


@pytest.mark.parametrize("page", examples.pages(), ids=lambda page: str(page.relative_to(examples.ROOT)))
def test_a_page_shows_what_its_commands_do(page: Path, tools: Path, tmp_path: Path) -> None:
    assert examples.run(tools, page, tmp_path)[1] == []


@pytest.mark.parametrize("page", examples.pages(), ids=lambda page: str(page.relative_to(examples.ROOT)))
def test_links_of_a_page_lead_to_files(page: Path) -> None:
    targets = [page.parent / target for target in LINK.findall(page.read_text(encoding="utf-8"))]
    assert [target for target in targets if not MADE.intersection(target.parts) and not target.exists()] == []


@pytest.mark.parametrize(
    ("told", "shown", "same"),
    [
        ("a 1.0\n...\nz\n", "a 1.0000001\nb\nc\nz\n", True),
        ("...\nb 2\n...\nd\n", "a\nb 2\nc\nd\n", True),
        ("a\n...\n", "a\n", True),
        ("", "", True),
        ("error  -1.3e-12\n", "error 2e-13\n", True),
        ("a 1.001\n", "a 1.0\n", False),
        ("a 1\n", "b 1\n", False),
        ("a\n", "a\nb\n", False),
        ("a\n...\nz\n", "a\nb\nc\n", False),
        ("a\n...\na\n", "a\n", False),
        ("", "x\n", False),
    ],
)
def test_lines_stand_for_any_and_numbers_agree_to_six_digits(told: str, shown: str, same: bool) -> None:
    assert examples.agree(told, shown) is same


def test_how_far_a_slow_command_was_is_no_part_of_what_a_page_shows(tmp_path: Path) -> None:
    done = "reach: optimize: 4 of 4 neighbours of the optimum after 10 s; Ctrl-C ends it"
    command = f"echo '3000 designs to compute'; echo '{done}' >&2"
    assert examples.terminal(command, tmp_path, tmp_path, ()) == "3000 designs to compute\n"
