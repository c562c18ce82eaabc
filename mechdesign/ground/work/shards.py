"""A list divided between processes that do not communicate, such as those of a job array: studies, or batches of cases.

Each takes every n-th of the list. Answers of cases are kept in a file, as numbers and words, until a merge has read
those of all shards.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from mechdesign.ground.errors import OutputError, StudyError, cut
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.records import remove_recorded, write_recorded
from mechdesign.ground.work.blocks import packed, unpacked

Item = TypeVar("Item")
Block = tuple[Floats, str]
"""Answers of a batch: a row of numbers for each case, and what is not a number."""

FILE = "answers.npz"  # in a folder of its own
# Of what decides the answers: the numbers and words of the study, and what gives them.
_RESOLVED = re.compile(r"^study\.resolved\.")
_AS_GIVEN = ("study", "overrides")
_SHOWN = 40  # characters of a value in a message
_SHARD = re.compile(r"([1-9]\d{0,5})/([1-9]\d{0,5})")


@dataclass(frozen=True)
class Shard:
    """Part `number` of `count`, from 1 on."""

    number: int
    count: int

    @classmethod
    def of(cls, text: str) -> Shard:
        """From ``2/4``.

        Raises
        ------
        StudyError
            If it is something else.
        """
        match = _SHARD.fullmatch(text.strip())
        if match is None or int(match[1]) > int(match[2]):
            raise StudyError(f"--shard takes I/N, the shard and how many there are, e.g. 1/4 to 4/4, not {text!r}")
        return cls(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def folder(self) -> str:
        """Name of the folder of its file."""
        return f"shard_{self.number}_of_{self.count}"

    def share(self, items: Iterable[Item]) -> Iterator[Item]:
        """Its part of a list."""
        return islice(items, self.number - 1, None, self.count)


WHOLE = Shard(1, 1)


@dataclass(frozen=True)
class _Kept:
    shard: Shard
    origin: Mapping[str, Any]
    blocks: Sequence[Block]


def write(directory: Path, shard: Shard, origin: Mapping[str, Any], blocks: Sequence[Block]) -> None:
    """Write a shard's blocks into its folder; `origin` decides what they are: study, overrides, seed, versions.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    head = {"shard": [shard.number, shard.count], "origin": origin, "words": [words for _, words in blocks]}
    try:
        write_recorded(directory / FILE, packed(head, [rows for rows, _ in blocks]), whole=False)
    except OSError as error:
        raise OutputError(f"{directory}: the shard could not be written: {error.strerror or error}") from error


def files_in(directory: Path) -> list[Path]:
    """Files of the shards in a folder."""
    return sorted(directory.glob(f"shard_*_of_*/{FILE}"))


def origin_of(path: Path) -> Mapping[str, Any]:
    """What decided the answers of a shard.

    Raises
    ------
    StudyError
        If the file is damaged.
    """
    return _read(path).origin


def merge(directory: Path, origin: Mapping[str, Any]) -> list[Block]:
    """The blocks of all shards in a folder, each of the same origin, in the order of the list.

    Raises
    ------
    StudyError
        If one is missing, damaged, or of another origin.
    """
    parts: dict[int, Sequence[Block]] = {}
    counts: dict[int, Path] = {}
    origin = json.loads(json.dumps(origin))
    for path in files_in(directory):
        kept = _read(path)
        if kept.origin != origin:
            other = ", ".join(_differences(kept.origin, origin))
            raise StudyError(f"{path}: is a shard of something else: {other}")
        counts[kept.shard.count] = path
        if len(counts) > 1:
            raise StudyError(f"{path}: there are shards of {' and of '.join(map(str, counts))}; remove those of one")
        parts[kept.shard.number] = kept.blocks
    (count,) = counts
    lost = [f"{k}/{count}" for k in range(1, count + 1) if k not in parts]
    if lost:
        listed = ", ".join(lost)
        raise StudyError(f"{directory}: shards are missing: {listed}; compute them, e.g. with --shard {lost[0]}")
    total = sum(map(len, parts.values()))
    if any(len(parts[k]) != len(range(k - 1, total, count)) for k in parts):
        raise StudyError(f"{directory}: the shards do not fit together; compute them anew")
    return [parts[k % count + 1][k // count] for k in range(total)]


def _differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """What decides the answers of a shard and is another here: ``seed is 5, here 0``.

    That the text of the study or the overrides differ is said only where no number or word of the study does.
    """
    one, other = ({_RESOLVED.sub("", key): value for key, value in _leaves(origin)} for origin in (there, here))
    differing = [key for key in {**one, **other} if one.get(key) != other.get(key)]
    telling = [key for key in differing if key.split(".")[0] not in _AS_GIVEN]
    return [" is ".join((key, ", here ".join(cut(str(part.get(key, "left out")), _SHOWN) for part in (one, other))))
            for key in telling or differing]  # fmt: skip


def _leaves(part: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """The numbers, words and lists in nested mappings by their dotted keys."""
    if isinstance(part, Mapping):
        for name, inner in part.items():
            yield from _leaves(inner, f"{key}.{name}" if key else str(name))
    else:
        yield key, part


def remove(directory: Path) -> None:
    """Remove the shards in a folder, once they are merged."""
    for path in files_in(directory):
        remove_recorded(path)
        path.unlink(missing_ok=True)
        with suppress(OSError):
            # A folder with files of others stays.
            path.parent.rmdir()


def is_current(directory: Path, origin: Mapping[str, Any]) -> bool:
    """Whether a folder holds a whole shard of this origin."""
    try:
        return bool(_read(directory / FILE).origin == json.loads(json.dumps(origin)))
    except StudyError:
        return False


def _read(path: Path) -> _Kept:
    try:
        head, tables = unpacked(path)
        shard = Shard(*map(int, head["shard"]))
        if path.parent.name != shard.folder or not isinstance(head["origin"], dict):
            raise ValueError
        return _Kept(shard, head["origin"], list(zip(tables, map(str, head["words"]), strict=True)))
    except (ValueError, KeyError, TypeError):
        raise StudyError(f"{path}: is not a whole shard; remove {path.parent} and compute it anew") from None
