"""What pages claim: how many studies and questions there are, and that nothing is denied which a study may ask for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import gallery
import pytest

import mechdesign
from mechdesign.commands import COMMANDS
from mechdesign.door.reference import entries

ROOT = Path(__file__).parents[2]
# Where each page says how far the tool goes: from, and up to.
SCOPES = {
    "README.md": ("Scope:", "\n\n"), "docs/index.md": ("## How far it goes", "```"),
    "docs/theory/limits.md": ("All questions", "\n\n"),
}  # fmt: skip
# What a study may have, by the words of these pages and the key that it stands for.
ABILITIES = {
    "gears": "mechanism.couplings", "belts": "mechanism.couplings", "cams": "mechanism.couplings.*.cam",
    "springs": "mechanism.springs", "dampers": "mechanism.springs.*.damping", "friction": "mechanism.friction",
    "stops": "dynamics.forward.restitution", "slots": "mechanism.joints.*.slot", "distances": "kinematics.collisions",
    "deflection|bend": "stiffness.elastic", "inertia|masses": "mechanism.links.*.inertia",
}  # fmt: skip
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
# A noun with more words behind it, as in "motions in space", is less than the noun.
QUALIFIED = r"(?: (?:of|in|at|between|by|on|with|from|that|which)\b|$)"


def read(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def single(word: str) -> str:
    return word.removesuffix("s") if not word.endswith("ss") else word


def vocabulary() -> set[str]:
    """Words of the study format, of keys and of what they choose from, and those that the site finds a how-to by."""
    words = {part for entry in entries() if entry.kind == "key" for part in entry.word.split(".")}
    words |= {entry.word for entry in entries() if entry.kind in ("kind of wheels", "pin model", "local index")}
    for page in (ROOT / "docs").rglob("*.md"):
        for block in re.findall(r"```\{index\} (.*)", page.read_text(encoding="utf-8")):
            words |= set(re.findall(r"! ([^,;`]+)", block))
    return {single(word.replace("_", " ")) for word in words}


def denied(text: str) -> Iterator[str]:
    """Words of the study format that a text says the tool does not have."""
    known = vocabulary()
    for clause in re.split(r"[.,;:]\s", re.sub(r"\s+", " ", text) + " "):
        for objects in re.findall(r"\b(?:[Nn]o|[Nn]or|[Ww]ithout|[Nn]ever|leaves out) (.+)", clause):
            for phrase in re.split(r" (?:and|or|nor) ", objects):
                words = re.split(QUALIFIED, phrase)[0].split()
                if words and not re.search(QUALIFIED[:-3] + ")", phrase):
                    yield from (word for word in words if single(word) in known)
        subject = re.match(r"(\w+)\b.* (?:not|never) (?:looked|known|modelled|computed|counted|there)", clause.strip())
        if subject and single(subject[1].lower()) in known:
            yield subject[1].lower()


@pytest.mark.parametrize(("text", "words"), [
    ("kinematics and small elastic deflections. No friction, no contact.", ["friction", "contact"]),
    ("no inertia forces, no friction, no cams or gears.", ["inertia", "forces", "friction", "cams", "gears"]),
    ("No gears, cams or belts. Collisions of links are not looked for.", ["gears", "collisions"]),
    ("No motion in space, no vibrations of links that bend.", []),
])  # fmt: skip
def test_old_denials_would_be_found(text: str, words: list[str]) -> None:
    assert [*denied(text)] == words


@pytest.mark.parametrize("page", SCOPES)
def test_no_page_denies_what_a_study_may_ask_for(page: str) -> None:
    begin, end = SCOPES[page]
    scope = read(page).partition(begin)[2].partition(end)[0]
    assert scope
    assert [*denied(scope)] == []


def test_what_a_question_leaves_out_is_said_with_where_it_is() -> None:
    """Of each question the page of limits has an entry; what it does without has its key or a page beside it."""
    found = re.findall(r"(?m)^(\w.*)\n: ((?:.+\n)+)", read("docs/theory/limits.md"))
    assert len(found) > len(COMMANDS)
    for question, text in found:
        for word in denied(text):
            assert re.search(r"\]\(|`[a-z]+\.[a-z_.]+`", text), f"{question}: {word}"


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_a_page_names_what_the_study_format_has(page: str) -> None:
    keys = {entry.word for entry in entries() if entry.kind == "key"}
    begin, end = SCOPES[page]
    scope = read(page).partition(begin)[2].partition(end)[0]
    for words, key in ABILITIES.items():
        assert key in keys
        assert re.search(words, scope), words


def test_numbers_of_studies_and_questions_are_those_there_are() -> None:
    gallery = len([*(ROOT / "configs" / "gallery").glob("*.yaml")])
    studies = len([*(ROOT / "configs").rglob("*.yaml")])
    assert re.findall(r"(\w+) of them are in\s+\[configs/gallery/\]", read("README.md")) == [str(gallery)]
    assert re.findall(r"\[All (\w+)\]\(gallery/index.md\)", read("docs/index.md")) == [str(studies)]
    for page in ("README.md", *(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").glob("*.md"))):
        for number in re.findall(r"(?i)\b(\w+) questions\b", read(page)):
            assert number.lower() not in NUMBERS or number.lower() == NUMBERS[len(COMMANDS)], page
    assert all(f"mechdesign {question}`" in read("README.md") for question in COMMANDS)


def test_every_name_of_the_package_is_on_its_page() -> None:
    page = read("docs/api.md")
    for name in mechdesign.__all__:
        assert name.startswith("__") or re.search(rf"::\s+mechdesign\.{name}\b", page), name


def test_pages_for_contributors_name_every_folder_and_files_that_exist() -> None:
    overview = read("docs/contributing/index.md")
    for folder in (ROOT / "mechdesign").iterdir():
        assert not (folder / "__init__.py").exists() or f"`mechdesign/{folder.name}/`" in overview
    for page in ("index", "one_study", "adding", "testing"):
        for path in re.findall(r"`((?:mechdesign|tests|docs|configs)/[\w./-]+)`", read(f"docs/contributing/{page}.md")):
            assert (ROOT / path).exists(), path


def test_pages_of_results_show_every_study_of_the_gallery_and_pictures_that_exist() -> None:
    gallery = read("results/gallery/README.md")
    for study in (ROOT / "configs" / "gallery").glob("*.yaml"):
        assert f"]({study.stem})" in gallery, study.stem
    for page in ("results/README.md", "results/gallery/README.md"):
        for path in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", read(page)):
            assert ((ROOT / page).parent / path).exists(), path


def test_every_howto_and_every_page_of_the_gallery_has_a_picture() -> None:
    pages = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "howto").glob("*.md")}
    pages |= {name: gallery.page(path) for name, path in gallery.studies().items()}
    assert [name for name, text in pages.items() if name != "index" and not re.search(r"!\[[^\]]+\]\(", text)] == []
