"""Look a word up by its path, its last part, its kind or a similar spelling."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from mechdesign.door.reference.entries import Entry
from mechdesign.door.reference.keys import KIND, place
from mechdesign.door.reference.pages import beginning
from mechdesign.ground.errors import nearest


def find(entries: Sequence[Entry], word: str) -> list[Entry]:
    """Entries of a word: those of that path or name, else of that last part, else of that kind.

    A path may be that of a study, ``mechanism.joints.guide.angle``, or leave names out, ``mechanism.joints.angle``.
    """
    folded = word.strip().lstrip("-").casefold()

    def named(entry: Entry) -> bool:
        own = entry.word.lstrip("-").casefold()
        return folded in (own, entry.plain.casefold()) or (bool(own.strip("*")) and fnmatchcase(folded, own))

    matches = [entry for entry in entries if named(entry)]
    matches += [entry for entry in entries if entry.last.casefold() == folded and entry not in matches]
    matches = matches or [entry for entry in entries if folded in (entry.kind, f"{entry.kind}s")]
    if not matches:
        parts = [entry for entry in entries if entry.kind in ("prefix of units", "unit")]
        pairs = ((part, other) for part in parts for other in parts if part.word.endswith("-"))
        matches = next(([*pair] for pair in pairs if word == pair[0].word.removesuffix("-") + pair[1].word), [])
    if not matches and (above := place(word)):
        matches = [entry for entry in entries if entry.kind == KIND and entry.plain == above]
    return matches or (find(entries, folded[:-1]) if folded.endswith("s") else [])


def holding(entries: Sequence[Entry], words: str) -> list[Entry]:
    """Entries whose texts contain these words."""
    pattern = beginning(words)
    return [entry for entry in entries if any(map(pattern.search, (entry.text, entry.formula)))]


def below(entries: Sequence[Entry], entry: Entry) -> list[Entry]:
    """Keys directly in a section, not those of sections inside it."""
    inside = (key for key in entries if entry.kind == key.kind == KIND and key.word.startswith(f"{entry.word}."))
    depth = entry.plain.count(".") + 1
    return [key for key in inside if key.plain.count(".") == depth]


def near(entries: Sequence[Entry], word: str) -> str | None:
    """The word of the reference with the most similar spelling; None if none is similar."""
    names = [
        *(entry.last for entry in entries),
        *(entry.plain for entry in entries),
        *(entry.kind for entry in entries),
    ]
    return nearest(word, names)
