"""The page of other tools: every tool is there with its own site, and files go where it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mechdesign.door.exporting.exports import exports
from mechdesign.study.importing.formats import FORMATS

PAGE = (Path(__file__).parents[2] / "docs" / "other_tools.md").read_text(encoding="utf-8")
TOOLS = ("PMKS+", "Linkage", "SAM", "GIM", "pylinkage", "MuJoCo", "EXUDYN", "CETOL 6σ", "OpenTURNS")
ROWS = {re.match(r"\[([^\]]+)\]", row)[1]: row for row in PAGE.partition(":::{list-table}")[2].split("* - ")[2:]}  # type: ignore[index]


def test_every_tool_has_a_row_of_four_cells_and_a_site() -> None:
    assert tuple(ROWS) == TOOLS
    for row in ROWS.values():
        assert re.match(r"\[[^\]]+\]\(https://[\w./-]+\)\n", row)
        assert len(re.findall(r"(?m)^  - ", row)) == 3


@pytest.mark.parametrize("tool", TOOLS)
def test_files_go_where_the_page_says(tool: str) -> None:
    """A format that is read names its tool; what is exported is an export."""
    reads = any(tool.lower() in kind.NAME.lower() for kind in FORMATS)
    assert ("`mechdesign import" in ROWS[tool]) is reads
    for name in re.findall(r"--to ([\w.]+)", ROWS[tool]):
        assert name in exports()
