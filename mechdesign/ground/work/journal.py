"""The journal of a long computation: its finished batches, from which it resumes after an interrupt.

A computation asks for the same batches in the same order each time. The journal keeps the result of each batch under a
digest of the batch; a computation that is started again reads finished batches from there.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from mechdesign.ground.errors import OutputError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.records import remove_recorded, write_recorded
from mechdesign.ground.work.blocks import packed, unpacked

NAME = "unfinished.npz"
# Least seconds between two versions of the file, and the least ratio of this time to that of writing it.
INTERVAL = 30.0
_MIN_RATIO = 20.0


def digest(columns: Sequence[Floats]) -> bytes:
    """The key of a batch: a digest of its designs, bit by bit."""
    state = hashlib.blake2b(digest_size=16)
    for column in columns:
        state.update(np.ascontiguousarray(column).tobytes())
    return state.digest()


class Journal:
    """Finished batches in a file, written whole or not at all by `save` and every half minute.

    `origin` decides the results: study, overrides, seed, versions. With `resume` a file of the same origin is read;
    `usable` is whether there is one, and `kept` how many designs or cases it has.
    """

    def __init__(self, path: Path, origin: Mapping[str, Any], *, resume: bool = False) -> None:
        self.path = path
        self._origin = json.dumps(origin, sort_keys=True)
        self._digests: list[bytes] = []
        self._rows: list[Floats] = []
        self._stored: list[tuple[bytes, Floats]] = []
        self.words: list[str] = []
        self._written = time.monotonic()
        self._patience = INTERVAL
        self.usable = resume and self._read()
        self.kept = sum(len(rows) for _, rows in self._stored)

    def _read(self) -> bool:
        try:
            head, blocks = unpacked(self.path)
            if head["origin"] != self._origin:
                return False
            self._stored = list(zip(map(bytes.fromhex, head["digests"]), blocks, strict=True))
            self.words = head["words"]
        except (ValueError, KeyError, TypeError):
            return False
        self._stored.reverse()
        return bool(self._stored)

    def recall(self, key: bytes) -> Floats | None:
        """The result of the next batch if it was finished; if another batch was next, the rest of the file is void."""
        if not self._stored:
            return None
        stored, rows = self._stored.pop()
        if stored != key:
            self._stored.clear()
            return None
        return rows

    def add(self, key: bytes, rows: Floats, words: Sequence[str]) -> None:
        """Add a finished batch: numbers, a row for each design, and all words so far that the numbers refer to."""
        self._digests.append(key)
        self._rows.append(rows)
        self.words = list(words)
        if time.monotonic() - self._written > self._patience:
            # The next attempt may find room on the disk.
            with suppress(OutputError):
                self.save()

    def save(self) -> None:
        """Write all finished batches, including those of an earlier run that this one has not reached yet.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        begun = self._written = time.monotonic()
        digests = [*self._digests, *(key for key, _ in reversed(self._stored))]
        rows = [*self._rows, *(block for _, block in reversed(self._stored))]
        if not rows:
            return
        head = {"origin": self._origin, "digests": [key.hex() for key in digests], "words": self.words}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_recorded(self.path, packed(head, rows))
        except OSError as error:
            raise OutputError(f"{self.path}: could not be written: {error.strerror or error}") from error
        self._written = time.monotonic()
        self._patience = max(INTERVAL, _MIN_RATIO * (self._written - begun))

    def discard(self) -> None:
        """Remove the file: the computation is finished, or begins anew."""
        remove_recorded(self.path)
