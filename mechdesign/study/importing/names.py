"""Names of a study for those of a file."""

from __future__ import annotations

import itertools
import re
import unicodedata
from collections.abc import Callable

from mechdesign.ground.errors import cut
from mechdesign.ground.functions import RESERVED
from mechdesign.mechanism.graph import GROUND

_UNFIT = re.compile(r"\W+")
_LONGEST = 40
_RESERVED = {GROUND, "time", "true", "false", "null", *RESERVED}


def clean(raw: str, noun: str = "part") -> str:
    """A text as a name; one that does not begin with a letter has its noun before it."""
    name = _UNFIT.sub("_", unicodedata.normalize("NFC", raw))[:_LONGEST].strip("_")
    return name if name and name[0].isalpha() else f"{noun}_{name}".rstrip("_")


def distinct(name: str, taken: Callable[[str], object]) -> str:
    """The name, or with a number behind it where it is taken."""
    numbered = (f"{name}_{count}" for count in itertools.count(2))
    return next(free for free in itertools.chain([name], numbered) if not taken(free))


class Names:
    """Distinct names, each of letters, digits and underscores with a letter first."""

    def __init__(self) -> None:
        self._given: dict[tuple[str, str], str] = {}
        self._taken = set[str]()

    def make(self, noun: str, raw: str) -> str:
        """The study's name of a `noun` (point, link, ...) that the file calls `raw`; a new one is distinct."""
        if (noun, raw) not in self._given:
            name = distinct(clean(raw, noun), lambda name: name in self._taken or name.lower() in _RESERVED)
            self._taken.add(name)
            self._given[noun, raw] = name
        return self._given[noun, raw]

    def changed(self) -> list[str]:
        """Sentences about the names that differ from those of the file."""
        pairs = [(noun, raw, name) for (noun, raw), name in self._given.items() if raw != name]
        return [f"{name} is the file's {noun} {cut(raw)!r}" for noun, raw, name in pairs]
