"""Errors and warnings that a user can meet: read from the calls that make them, where each is written once."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

import yaml

from mechdesign.cautions import KINDS
from mechdesign.errors import EXIT_CODES
from mechdesign.reference.entries import Entry
from mechdesign.reference.made import PLACE, Reader

KIND = "message"
PART = 0  # in place of an exit code: what may stand in a place of another message
# Two words at least, outside of its places; and letters by which a text is known to be that message.
_SENTENCE = re.compile(r"[A-Za-z]{2,}[,;:')]* +['(]?[A-Za-z]")
_LETTERS = 10
_WORDS = 3  # of a part


@dataclass(frozen=True, eq=False)
class Group:
    """Messages about one subject: what is to be known of them, and what mends those that do not say it."""

    group: str
    about: str
    files: tuple[str, ...]  # beginnings of the names of the files that they stand in; the longest that fits counts
    mends: Mapping[str, str]  # by a part of the text


class Message(NamedTuple):
    """An error with its exit code, or a warning with its kind, what it is about, and what mends it."""

    text: str
    group: Group
    code: int | None
    kind: str
    mend: str

    def holds(self, words: str) -> bool:
        """Whether these words stand in it, or it in these words."""
        if any(words.casefold() in text.casefold() for text in (self.text, self.text.replace(PLACE, ""))):
            return True
        parts, end = self.text.split(PLACE), 0
        for part in parts:
            if (start := words.find(part, end)) < 0:
                return False
            end = start + len(part)
        return sum(map(len, parts)) >= _LETTERS


@cache
def groups() -> tuple[Group, ...]:
    """What ``messages.yaml`` says, in its order."""
    said = yaml.safe_load((files("mechdesign.reference") / "messages.yaml").read_text(encoding="utf-8"))
    return tuple(Group(**{"mends": {}, **each}) for each in said)


@cache
def messages() -> tuple[Message, ...]:
    """Every message of the package, group by group, in the order of a group's files and of the source in them."""
    found: dict[tuple[Group, str], tuple[int, Message]] = {}
    for name, text, code, kind in _read():
        if (owner := _owner(name)) is not None:
            group, place = owner
            mend = next((mend for part, mend in group.mends.items() if part in text), "")
            known = found.get((group, text))
            if known is None or known[1].code == PART:
                found[group, text] = place, Message(text, group, code, kind, mend)
    order = sorted(found.values(), key=lambda each: (groups().index(each[1].group), each[0]))
    return tuple(message for _, message in order)


def unread() -> set[str]:
    """Files with messages that belong to no group."""
    return {name for name, *_ in _read() if _owner(name) is None}


def _owner(name: str) -> tuple[Group, int] | None:
    """The group of a file, and the place of its name there."""
    fits = [
        (len(begin), group, k) for group in groups() for k, begin in enumerate(group.files) if name.startswith(begin)
    ]
    return max(fits, key=lambda each: each[0])[1:] if fits else None


def find_messages(words: str) -> list[Entry]:
    """Entries of the messages in which these words stand, or that these words are."""
    found = [
        Entry(message.text, KIND, ". ".join(filter(None, (f"{message.group.group}; {meaning(message)}", message.mend))))
        for message in messages() if message.holds(words)
    ]  # fmt: skip
    # What is between quotes in what is said of a group may be any part of a message.
    said = [group for group in groups() if any(part in words for part in re.findall('"(.+?)"', group.about))]
    return found or [Entry(f"{group.group}: ...", KIND, group.about) for group in said]


def meaning(message: Message) -> str:
    """What an error with its exit code means, or a warning of its kind."""
    if message.code == PART:
        return "a part of an error or a warning"
    if message.code is None:
        return f"a warning of kind {message.kind}: {KINDS[message.kind].meaning}" if message.kind else "a warning"
    return f"exit code {message.code}: {EXIT_CODES[message.code]}"


def _sources(folder: Traversable, prefix: str = "") -> Iterator[tuple[str, ast.Module]]:
    for each in sorted(folder.iterdir(), key=lambda item: item.name):
        if each.is_dir():
            yield from _sources(each, f"{prefix}{each.name}/")
        elif each.name.endswith(".py"):
            yield f"{prefix}{each.name}", ast.parse(each.read_text(encoding="utf-8"))


def _read() -> Iterator[tuple[str, str, int | None, str]]:
    """File, text, exit code and kind of each message; what may stand in its places follows as `PART`."""
    reader = Reader(dict(_sources(files("mechdesign"))))
    for name in reader.trees:
        for made in reader.made(name):
            for text, part in reader.texts(made.argument, made.scope):
                plain = text.replace(PLACE, "")
                if _SENTENCE.search(plain) and (not part or len(re.findall(r"[A-Za-z']{2,}", plain)) >= _WORDS):
                    yield name, " ".join(text.split()).strip(" ;,:"), PART if part else made.code, made.kind
