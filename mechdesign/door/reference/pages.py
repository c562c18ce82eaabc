"""Pages of the documentation and shipped studies, found by any word in them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from mechdesign.door.reference.entries import Entry

PAGE, SHIPPED = "page", "shipped study"  # kinds of entries
# Beside the package in a checkout, in it where it is installed.
_PACKAGE = Path(__file__).parents[2]
_ROOTS = (_PACKAGE / "pages", _PACKAGE.parent)
_FOLDERS = ("docs/howto", "docs/tutorials", "docs/notebooks", "docs/theory", "docs/ci", "configs")
_PAGE, _STUDY = ".md", ".yaml"
_MOST = 4  # pages of a word
_LONG = 220  # letters of the sentence that is shown
_MARKUP = re.compile(r"\[([^\]]*)\]\([^)]*\)|\{[a-z]+\}|^- |[`*$]")
_ENDING = re.compile(r"(?<=\w{4})(?:s|ing)$")


class _Page(NamedTuple):
    place: str  # from the root of the project
    title: str
    subjects: str  # headings, and the words by which the site's search finds it
    paragraphs: tuple[str, ...]


@cache
def _files() -> dict[str, Path]:
    """Pages, studies and files for CI by their places; none where the package stands alone."""
    root = next((root for root in _ROOTS if (root / _FOLDERS[0]).is_dir()), Path())
    paths = (path for folder in _FOLDERS for path in sorted((root / folder).rglob("*.*")))
    return {path.relative_to(root).as_posix(): path for path in paths}


@cache
def _pages() -> tuple[_Page, ...]:
    kinds = {_PAGE: _of_page, _STUDY: _of_study}
    return tuple(
        kinds[path.suffix](place, path.read_text("utf-8")) for place, path in _files().items() if path.suffix in kinds
    )


def studies() -> dict[str, Path]:
    """Shipped studies by their names."""
    return {path.stem: path for path in _files().values() if path.suffix == _STUDY}


def text_of(name: str) -> str | None:
    """The text of a page, study or file for CI by its place, or of a study by its name; None where there is none."""
    path = _files().get(name, studies().get(name))
    return None if path is None else path.read_text("utf-8")


def _of_page(place: str, text: str) -> _Page:
    headings = re.findall(r"(?m)^#+ (.+)$", text)
    indexed = re.findall(r"```\{index\} (.+)", text)
    prose = re.sub(r"(?ms)^```.*?^```$", "", text)
    paragraphs = (" ".join(_MARKUP.sub(r"\1", part).split()) for part in re.split(r"\n\s*\n|\n(?=[-#] )", prose))
    # Of a path of links alone nothing is shown, and the names of tests say nothing about a word.
    shown = tuple(part for part in paragraphs if part and not part.startswith(("#", "!", "|", "Test:", "Tests:")))
    return _Page(place, headings[0] if headings else place, "\n".join((*headings[1:], *indexed)), shown)


def _of_study(place: str, text: str) -> _Page:
    lines = text.splitlines()
    opening = lines[: next((k for k, line in enumerate(lines) if not line.startswith("#")), len(lines))]
    name = re.search(r"(?m)^name: (.+)$", text)
    paragraphs = "\n".join(line.removeprefix("#").strip() for line in opening).split("\n\n")
    return _Page(place, name[1] if name else place, "", tuple(" ".join(part.split()) for part in paragraphs if part))


def beginning(words: str) -> re.Pattern[str]:
    """Where words begin in a text; they may have a hyphen between them."""
    parts = re.split(r"[\s-]+", words.strip())
    return re.compile(r"\b" + r"[\s-]+".join(map(re.escape, parts)), re.IGNORECASE)


def pages(word: str, *, subjects: bool = False) -> Iterator[Entry]:
    """The pages that say most of a word, with a sentence that has it: those about it first, then by how often.

    Only pages of which it is a subject, where `subjects` are asked alone; else, of a term that no page has, the pages
    with all of its words.
    """
    # A word may end otherwise, as balance of balancing.
    patterns = [beginning(_ENDING.sub("", word.strip()))]
    ranked = _ranked(patterns, subjects=subjects)
    if not ranked and not subjects:
        patterns = [beginning(_ENDING.sub("", part)) for part in word.split()]
        ranked = _ranked(patterns)
    for page in ranked[:_MOST]:
        kind = PAGE if page.place.endswith(_PAGE) else SHIPPED
        yield Entry(page.place, kind, f"{page.title}: {_sentence(page, patterns)}")


def _ranked(patterns: Sequence[re.Pattern[str]], *, subjects: bool = False) -> list[_Page]:
    """The pages with all of some words."""
    ranked = []
    for page in _pages():
        parts = (page.title, page.subjects, " ".join(page.paragraphs))
        title, subject, text = ([len(pattern.findall(part)) for pattern in patterns] for part in parts)
        if any((*title, *subject)) if subjects else all(map(any, zip(title, subject, text, strict=True))):
            ranked.append((-sum(map(bool, title)), -sum(map(bool, subject)), -sum(text), page.place, page))
    return [page for *_, page in sorted(ranked)]


def _sentence(page: _Page, patterns: Sequence[re.Pattern[str]]) -> str:
    """The first sentence with most of the words, or that a page begins with, as far as a line or two go."""
    sentences = [sentence for part in page.paragraphs for sentence in re.split(r"(?<=[.:!?]) (?=[A-Z])", part)]
    sentence = max(sentences, key=lambda one: sum(bool(pattern.search(one)) for pattern in patterns), default="")
    return sentence if len(sentence) <= _LONG else f"{sentence[:_LONG].rpartition(' ')[0]} ..."
