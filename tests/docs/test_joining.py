"""What a newcomer meets first: how to contribute, forms, checks before a commit, the paper, and no licence."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
FORMS = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("[!c]*.yml"))


def read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_everything_that_the_page_tells_to_add_is_in_the_table_of_contributing() -> None:
    linked = re.findall(r"\(docs/contributing/adding.md#([\w-]+)\)", read("CONTRIBUTING.md"))
    headings = re.findall(r"(?m)^## (.*)$", read("docs/contributing/adding.md"))
    assert linked == [re.sub(r"[^\w ]", "", heading).lower().replace(" ", "-") for heading in headings]


def test_contributing_names_files_that_exist() -> None:
    text = read("CONTRIBUTING.md")
    paths = re.findall(r"\]\((?!https:)([^)#]+)", text) + re.findall(r"(?:tests|configs|\.ci)/[\w./-]+\w", text)
    assert len(paths) > 15
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_nothing_says_that_it_has_a_licence_while_none_is_chosen() -> None:
    project = tomllib.loads(read("pyproject.toml"))["project"]
    assert not {"license", "license-files"} & project.keys()
    assert [line for line in project["classifiers"] if line.startswith("License")] == []
    assert "license" not in yaml.safe_load(read("CITATION.cff"))
    assert [*ROOT.glob("LICEN[CS]E*")] == []
    for page in ("README.md", "CONTRIBUTING.md"):
        assert "No licence has been chosen yet" in read(page)


def test_a_commit_is_checked_as_the_gate_does() -> None:
    (repository,) = yaml.safe_load(read(".pre-commit-config.yaml"))["repos"]
    gate = read(".ci/run").replace('"', "")
    assert repository["repo"] == "local"
    for hook in repository["hooks"]:
        assert "$bin/" + hook["entry"].removeprefix("python -m ").removesuffix(" --force-exclude") in gate


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.stem)
def test_a_form_asks_for_the_study_and_each_answer_once(form: Path) -> None:
    content = yaml.safe_load(form.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= content.keys()
    assert {item["type"] for item in content["body"]} <= {"textarea", "input"}
    names = [item["id"] for item in content["body"]]
    assert "study" in names
    assert len(names) == len(set(names))
    assert all(item["attributes"]["label"] for item in content["body"])


def test_the_paper_has_the_form_of_its_journal_and_cites_what_it_lists() -> None:
    head, text = read("paper/paper.md").removeprefix("---\n").split("\n---\n", 1)
    front = yaml.safe_load(head)
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= front.keys()
    assert 250 <= len(text.split()) <= 1000
    assert re.findall(r"(?m)^# (.*)$", text) == [
        "Summary", "Statement of need", "State of the field", "Design", "Verification", "References"
    ]  # fmt: skip
    entries = dict(re.findall(r"(?ms)^@\w+\{(\w+),(.*?)^\}", read(f"paper/{front['bibliography']}")))
    assert set(re.findall(r"@(\w+)", text)) == entries.keys()
    # Each can be found: by its identifier, its address, or words that say where.
    assert [name for name, entry in entries.items() if not re.search(r"(?m)^  (doi|url|note) = ", entry)] == []
