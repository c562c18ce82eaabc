"""Files that are written whole or not at all, and the formats of those that are pictures."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from mechdesign.errors import StudyError

# Of pictures; the first is drawn where none is asked.
FORMATS = ("png", "svg", "pdf")


def formats_of(listed: str | None, option: str) -> str:
    """Formats of pictures as an option lists them, each once, with commas between.

    Raises
    ------
    StudyError
        If one is none of `FORMATS`.
    """
    wanted = dict.fromkeys((listed or FORMATS[0]).replace(" ", "").lower().split(","))
    for kind in wanted:
        if kind not in FORMATS:
            raise StudyError(f"{option} takes {', '.join(FORMATS)} or several with commas between, not {kind!r}")
    return ",".join(wanted)


def replace(path: Path, blocks: Iterable[bytes]) -> str:
    """Write a file block by block, put it in place when it is whole, and return its SHA-256.

    Raises
    ------
    OSError
        If it cannot be written; an older file of that name is then as it was.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    digest = hashlib.sha256()
    try:
        with temporary.open("wb") as stream:
            for block in blocks:
                stream.write(block)
                digest.update(block)
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
    return digest.hexdigest()
