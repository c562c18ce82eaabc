"""Look a word up by its path, its last part, its kind or a similar spelling."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from mechdesign.errors import nearest
from mechdesign.reference.entries import Entry
from mechdesign.reference.keys import KIND, place


def find(entries: Sequence[Entry], word: str) -> list[Entry]:
    """Entries of a word: those of that path or name, else of that last part, else of that kind.

    A path may be that of a study, ``mechanism.joints.guide.angle``, or leave names out, ``mechanism.joints.angle``.
    """
    asked = word.strip().lstrip("-").casefold()

    def named(entry: Entry) -> bool:
        own = entry.word.lstrip("-").casefold()
        return asked in (own, entry.plain.casefold()) or (bool(own.strip("*")) and fnmatchcase(asked, own))

    found = [entry for entry in entries if named(entry)]
    found += [entry for entry in entries if entry.last.casefold() == asked and entry not in found]
    found = found or [entry for entry in entries if asked in (entry.kind, f"{entry.kind}s")]
    if not found:
        parts = [entry for entry in entries if entry.kind in ("prefix of units", "unit")]
        pairs = ((part, other) for part in parts for other in parts if part.word.endswith("-"))
        found = next(([*pair] for pair in pairs if word == pair[0].word.removesuffix("-") + pair[1].word), [])
    if not found and (above := place(word)):
        found = [entry for entry in entries if entry.kind == KIND and entry.plain == above]
    return found


def holding(entries: Sequence[Entry], words: str) -> list[Entry]:
    """Entries whose texts contain these words."""
    asked = words.casefold()
    return [entry for entry in entries if any(asked in text.casefold() for text in (entry.text, entry.formula))]


def below(entries: Sequence[Entry], entry: Entry) -> list[Entry]:
    """Keys directly in a section, not those of sections inside it."""
    inside = (each for each in entries if entry.kind == each.kind == KIND and each.word.startswith(f"{entry.word}."))
    depth = entry.plain.count(".") + 1
    return [each for each in inside if each.plain.count(".") == depth]


def near(entries: Sequence[Entry], word: str) -> str | None:
    """The word of the reference with the most similar spelling; None if none is similar."""
    known = [
        *(entry.last for entry in entries),
        *(entry.plain for entry in entries),
        *(entry.kind for entry in entries),
    ]
    return nearest(word, known)
