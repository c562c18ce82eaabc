"""The pages of theory: every equation names a test that exists, and the papers' page explains every difference."""

from __future__ import annotations

import ast
import re
import sys
from functools import cache
from pathlib import Path

import pytest
import yaml

import mechdesign

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
# The page of papers is made from its data.
PAGES = sorted(path for path in (DOCS / "theory").glob("*.md") if path.name[0] != "_" and path.name != "papers.md")
NAME = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
CASE = re.compile(r"\]\(\.\./verification/(\w+)\.md\)")

sys.path.insert(0, str(DOCS))
import cases  # noqa: E402
import papers  # noqa: E402


@cache
def functions_of(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}


def missing(text: str) -> list[str]:
    lost = [f"{file}::{name}" for file, name in NAME.findall(text)
            if not (ROOT / file).exists() or name not in functions_of(file)]  # fmt: skip
    return lost + [name for name in CASE.findall(text) if name not in cases.cases() and name != "index"]


def unchecked(text: str) -> list[str]:
    """Headings of the sections with an equation that name neither a test nor a case of the verification manual."""
    sections = re.split(r"(?m)^#{1,6} ", text)
    return [
        part.partition("\n")[0] for part in sections if "$$" in part and not (NAME.search(part) or CASE.search(part))
    ]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_equation_names_a_test_that_exists(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert unchecked(text) == []
    assert missing(text) == []


def test_what_is_missing_is_found() -> None:
    text = "# A\n$$x$$\n`tests/docs/test_theory.py::test_no_such_thing`\n## B\n$$y$$\n## C\nwords\n"
    text += "## D\n$$z$$\n[a case](../verification/no_such_case.md)\n"
    assert unchecked(text) == ["B"]
    assert missing(text) == ["tests/docs/test_theory.py::test_no_such_thing", "no_such_case"]


def cited(text: str) -> set[tuple[str, str]]:
    """First word and year of the sources that a page names, such as [Deb, 2000; Fay & Feuer, 1997]."""
    groups = re.findall(r"\[([A-Z][^\]\[$`]*,\s\d{4})\]", text)
    return {(source.split()[0].strip(","), source[-4:]) for group in groups for source in re.split(r";\s+", group)}


def test_every_source_is_listed_and_none_is_idle() -> None:
    entries = (DOCS / "theory" / "sources.md").read_text(encoding="utf-8").split("\n- ")[1:]
    named = set().union(*(cited(path.read_text(encoding="utf-8")) for path in PAGES))
    assert [f"{name} {year}" for name, year in sorted(named)
            if not any(entry.startswith(name) and year in entry for entry in entries)] == []  # fmt: skip
    idle = [entry for entry in entries if not any(entry.startswith(name) and year in entry for name, year in named)]
    assert [entry for entry in idle if not entry.startswith("ISO")] == []


def test_every_page_is_listed() -> None:
    listed = (DOCS / "theory" / "index.md").read_text(encoding="utf-8")
    assert {path.stem for path in PAGES} - {"index"} <= set(listed.split())


def test_papers_page_is_made_and_names_tests_that_exist() -> None:
    (text,) = papers.pages().values()
    assert missing(text) == []
    assert len(NAME.findall(text)) == sum(
        len(paper["tests"]) for paper in yaml.safe_load(papers.DATA.read_text()).values()
    )


def test_citation_names_the_version_and_the_papers() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == mechdesign.__version__
    assert len(cited["references"]) == len(yaml.safe_load(papers.DATA.read_text(encoding="utf-8")))
