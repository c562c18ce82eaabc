"""The journal of a long computation: what was finished, kept so that it can go on after an interrupt.

A computation that is the same each time asks for the same batches in the same order. The journal keeps each batch's
outcome under a digest of what was asked; a computation begun anew finds there what had been finished.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from mechdesign.errors import OutputError
from mechdesign.files import replace
from mechdesign.numerics.arrays import Floats

NAME = "unfinished.npz"
MARK = b"origin.npy"  # by which it is known
# Seconds between two versions of the file, and how many times as long as its writing took they are at least.
_INTERVAL = 30.0
_MIN_RATIO = 20.0


def digest(columns: Sequence[Floats]) -> bytes:
    """The key of a batch: a digest of its designs, bit by bit."""
    found = hashlib.blake2b(digest_size=16)
    for column in columns:
        found.update(np.ascontiguousarray(column).tobytes())
    return found.digest()


class Journal:
    """Finished batches in a file, written whole or not at all by `save` and every half minute.

    `origin` is what decides the results: study, overrides, seed, versions. To resume, a file of the same origin is
    used; `usable` says whether there is one.
    """

    def __init__(self, path: Path, origin: Mapping[str, Any], *, resume: bool = False) -> None:
        self.path = path
        self._origin = json.dumps(origin, sort_keys=True)
        self._digests: list[bytes] = []
        self._rows: list[Floats] = []
        self._found: list[tuple[bytes, Floats]] = []
        self.words: list[str] = []
        self._written = time.monotonic()
        self._patience = _INTERVAL
        self.usable = resume and self._read()

    def _read(self) -> bool:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as content:
                if str(content["origin"]) != self._origin:
                    return False
                digests, counts, rows = content["digests"], content["counts"], content["rows"]
                self.words = json.loads(str(content["words"]))
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, zlib.error):
            return False
        blocks = np.split(rows, np.cumsum(counts)[:-1])
        self._found = [(key.tobytes(), block) for key, block in zip(digests, blocks, strict=True)]
        self._found.reverse()
        return bool(self._found)

    def recall(self, key: bytes) -> Floats | None:
        """The outcome of the next batch if it was finished; if another batch was, it and what follows is void."""
        if not self._found:
            return None
        known, rows = self._found.pop()
        if known != key:
            self._found.clear()
            return None
        return rows

    def add(self, key: bytes, rows: Floats, words: Sequence[str]) -> None:
        """Note a finished batch: numbers, a row a design, and all words that they refer to so far."""
        self._digests.append(key)
        self._rows.append(rows)
        self.words = list(words)
        if time.monotonic() - self._written > self._patience:
            # A disk that is full now may have room when it is tried again.
            with suppress(OutputError):
                self.save()

    def save(self) -> None:
        """Write what is finished, also what an earlier run finished and this one has not come to yet.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        begun = self._written = time.monotonic()
        digests = [*self._digests, *(key for key, _ in reversed(self._found))]
        rows = [*self._rows, *(block for _, block in reversed(self._found))]
        if not rows:
            return
        stream = io.BytesIO()
        np.savez(
            stream,
            origin=np.array(self._origin),
            digests=np.frombuffer(b"".join(digests), dtype=np.uint8).reshape(-1, 16),
            counts=np.array([len(block) for block in rows]),
            rows=np.concatenate(rows),
            words=np.array(json.dumps(self.words)),
        )
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            replace(self.path, [stream.getvalue()])
        except OSError as error:
            raise OutputError(f"{self.path}: could not be written: {error.strerror or error}") from error
        self._written = time.monotonic()
        self._patience = max(_INTERVAL, _MIN_RATIO * (self._written - begun))

    def discard(self) -> None:
        """Remove the file: the computation is finished, or begins anew."""
        self.path.unlink(missing_ok=True)
