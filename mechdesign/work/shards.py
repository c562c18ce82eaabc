"""Long computations divided between processes that do not communicate, such as those of a job array.

Each process computes every n-th chunk of its maps and writes the values to a file. A merge reads the values from the
files and computes the rest.
"""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, is_dataclass
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import Any

from mechdesign.errors import OutputError, StudyError
from mechdesign.records import remove_recorded, write_recorded
from mechdesign.work.chunks import Divided

Compute = Callable[[Iterable[Any]], Iterator[Any]]

FILE = "chunks"  # in a folder of its own
_SHARD = re.compile(r"([1-9]\d{0,5})/([1-9]\d{0,5})")
# Types that a file may have besides dataclasses and named tuples of this package.
_ARRAYS = {
    ("numpy", "dtype"), ("numpy", "ndarray"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"), ("numpy._core.numeric", "_frombuffer"),
}  # fmt: skip


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


@dataclass(frozen=True)
class Kept:
    """Values of every n-th chunk of a map with this number of chunks."""

    chunks: int
    values: Sequence[Any]


class Taken:
    """Computes the chunks of one shard, keeps them by the name of their map, and raises `Divided`.

    A map of a single chunk is computed by every shard.
    """

    def __init__(self, shard: Shard) -> None:
        self.shard = shard
        self.kept: dict[str, Kept] = {}
        self._names: Counter[str] = Counter()

    def __call__(self, name: str, compute: Compute, items: Iterable[Any]) -> Iterator[Any]:
        """See `mechdesign.work.chunks.divided`."""
        source = iter(items)
        first = [*islice(source, 2)]
        if len(first) < 2:
            yield from compute(first)
            return
        count = 0

        def own() -> Iterator[Any]:
            nonlocal count
            for item in chain(first, source):
                if count % self.shard.count == self.shard.number - 1:
                    yield item
                count += 1

        values = [*compute(own())]
        self.kept[_numbered(name, self._names)] = Kept(count, values)
        raise Divided

    def write(self, directory: Path, origin: Mapping[str, Any], command: str) -> None:
        """Write the kept values into a folder; `origin` decides the values, `command` was given.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        content = pickle.dumps(self.kept, protocol=5)
        head = {
            "shard": [self.shard.number, self.shard.count],
            "command": command,
            "origin": origin,
            "sha256": hashlib.sha256(content).hexdigest(),
        }
        try:
            data = json.dumps(head, sort_keys=True).encode() + b"\n" + content
            write_recorded(directory / FILE, data, whole=False)
        except OSError as error:
            raise OutputError(f"{directory}: the shard could not be written: {error.strerror or error}") from error


class Merged:
    """Reads the values of all shards; maps that the shards did not reach are computed here."""

    def __init__(self, parts: Sequence[Mapping[str, Kept]]) -> None:
        self._parts = parts
        self._names: Counter[str] = Counter()

    def __call__(self, name: str, compute: Compute, items: Iterable[Any]) -> Iterator[Any]:
        """See `mechdesign.work.chunks.divided`."""
        source = iter(items)
        first = [*islice(source, 2)]
        items = chain(first, source)
        name = _numbered(name, self._names) if len(first) > 1 else ""
        if name not in self._parts[0]:
            yield from compute(items)
            return
        count = len(self._parts)
        for k, _ in enumerate(items):
            yield self._parts[k % count][name].values[k // count]


def _numbered(name: str, names: Counter[str]) -> str:
    names[name] += 1
    return f"{name} {names[name]}"


def files_in(directory: Path) -> list[Path]:
    """Files of the shards in a folder."""
    return sorted(directory.glob(f"shard_*_of_*/{FILE}"))


def head_of(path: Path) -> Mapping[str, Any]:
    """The head of a shard: the ``command`` that was given, and in ``origin`` the study, its changes and the seed.

    Raises
    ------
    StudyError
        If the file is damaged.
    """
    return _read(path)[0]


def merge(directory: Path, origin: Mapping[str, Any]) -> Merged:
    """All shards in a folder, each of the same origin.

    Raises
    ------
    StudyError
        If one is missing, damaged, or of another origin.
    """
    parts: dict[int, Mapping[str, Kept]] = {}
    counts: dict[int, Path] = {}
    for path in files_in(directory):
        head, content = _read(path)
        other = [key for key in origin.keys() | head["origin"].keys() if origin.get(key) != head["origin"].get(key)]
        if other:
            raise StudyError(f"{path}: is a shard of something else; other than here: {', '.join(sorted(other))}")
        number, count = head["shard"]
        counts[count] = path
        if len(counts) > 1:
            raise StudyError(f"{path}: there are shards of {' and of '.join(map(str, counts))}; remove those of one")
        try:
            parts[number] = _Reader(io.BytesIO(content)).load()
        except Exception as error:
            raise _damaged(path) from error
    if not parts:
        raise missing(directory)
    lost = [f"{k}/{count}" for k in range(1, count + 1) if k not in parts]
    if lost:
        listed = ", ".join(lost)
        raise StudyError(f"{directory}: shards are missing: {listed}; compute them, e.g. with --shard {lost[0]}")
    merged = [parts[k] for k in sorted(parts)]
    for name, kept in merged[0].items():
        sizes = [len(part[name].values) if name in part else -1 for part in merged]
        if sizes != [len(range(k, kept.chunks, count)) for k in range(count)]:
            raise StudyError(f"{directory}: the shards do not fit together; compute them anew")
    return Merged(merged)


def missing(directory: Path) -> StudyError:
    """The error where there are no shards to merge."""
    return StudyError(f"{directory}: there are no shards; compute them with --shard 1/N to N/N")


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
        head, _ = _read(directory / FILE)
    except StudyError:
        return False
    return bool(head["origin"] == json.loads(json.dumps(origin)))


def _read(path: Path) -> tuple[dict[str, Any], bytes]:
    try:
        line, _, content = path.read_bytes().partition(b"\n")
        head = json.loads(line)
        if head["sha256"] != hashlib.sha256(content).hexdigest():
            raise ValueError
        number, count = map(int, head["shard"])
        if path.parent.name != Shard(number, count).folder or not isinstance(head["origin"], dict):
            raise ValueError
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise _damaged(path) from None
    return head, content


def _damaged(path: Path) -> StudyError:
    return StudyError(f"{path}: is not a whole shard; remove {path.parent} and compute it anew")


class _Reader(pickle.Unpickler):
    """Reads values of this package and arrays, and refuses everything else that a foreign file might call."""

    def find_class(self, module: str, name: str) -> Any:
        """The type of a name that a shard may have."""
        if (module, name) in _ARRAYS:
            return getattr(import_module(module), name)
        if module.startswith("mechdesign."):
            kind = getattr(import_module(module), name)
            if isinstance(kind, type) and (is_dataclass(kind) or issubclass(kind, tuple)):
                return kind
        raise pickle.UnpicklingError(f"{module}.{name} has no place in a shard")
