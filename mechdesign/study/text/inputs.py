"""Files that a study names: where they may lie, and their texts."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mechdesign.ground.errors import StudyError
from mechdesign.study.text.document import KeyPath, decoded

# Endings of the names of files with a table.
FILES = (".csv", ".txt", ".dat")
# Largest file that is read, in bytes.
MAX_FILE_BYTES = 50_000_000


@dataclass(frozen=True)
class Folder:
    """The folder that must contain the files that a study names, unless they may lie `anywhere`.

    Those whose names, as seen from the folder, the user gave beside the study (`given`) may lie anywhere, too.

    A file is read once: changes of it during the computation have no effect.
    """

    path: Path = Path()
    anywhere: bool = False
    given: frozenset[str] = frozenset()
    _read: dict[str, str] = field(default_factory=dict, compare=False, repr=False)

    def text(self, name: str) -> str:
        """The text of a file.

        Raises
        ------
        StudyError
            Where it lies elsewhere, cannot be read, or is no text of a bounded size.
        """
        if name not in self._read:
            self._read[name] = self._text(self.path / name)
        return self._read[name]

    def _text(self, file: Path) -> str:
        try:
            return decoded(self.content(file))
        except UnicodeDecodeError:
            raise StudyError(f"{file} cannot be read: not a text file; save the table as CSV in UTF-8") from None

    def content(self, file: Path) -> bytes:
        """The bytes of a file.

        Raises
        ------
        StudyError
            Where it lies elsewhere, cannot be read, or is too large.
        """
        try:
            free = self.anywhere or file in {self.path / name for name in self.given}
            if not free and not file.resolve().is_relative_to(self.path.resolve()):
                raise StudyError(f"{file} is not in the folder of the study; --allow-files reads it all the same")
            # Opened without waiting, as a pipe may never be written to.
            with open(file, "rb", opener=_without_waiting) as stream:
                if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                    raise StudyError(f"{file} cannot be read: not a file")
                content = stream.read(MAX_FILE_BYTES + 1)
            if len(content) > MAX_FILE_BYTES:
                raise StudyError(f"{file} cannot be read: larger than {MAX_FILE_BYTES // 1_000_000} MB")
            return content
        except (OSError, ValueError, RuntimeError) as error:
            # The name may be impossible, or links may form a circle.
            why = getattr(error, "strerror", None) or "no such name"
            hint = "; every system reads / between folders" * ("\\" in file.name)
            raise StudyError(f"{file} cannot be read: {why}{hint}") from None


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def file_of(raw: Any) -> str | None:
    """The file that a path or a target names: ``{file: NAME}``, or a name with the ending of a table; else None."""
    name = raw.get("file") if isinstance(raw, Mapping) else raw
    return name if isinstance(name, str) and (name is not raw or name.lower().endswith(FILES)) else None


def files(data: Mapping[str, Any], commands: Iterable[str]) -> Iterator[tuple[KeyPath, str]]:
    """Every file that a valid study names, by the keys at which its name stands."""
    owners = [("mechanism", "targets"), *((command, key) for command in commands for key in ("path", "motion"))]
    for section, key in owners:
        for name, raw in ((data.get(section) or {}).get(key) or {}).items():
            keys: KeyPath = (section, key, name)
            if key == "targets" and isinstance(raw, Mapping) and "curve" in raw:
                keys, raw = (*keys, "curve"), raw["curve"]
            if (file := file_of(raw)) is not None:
                yield (*keys, "file") if isinstance(raw, Mapping) else keys, file
    for name, raw in ((data.get("mechanism") or {}).get("couplings") or {}).items():
        if isinstance(raw, Mapping) and (file := file_of(raw.get("table"))) is not None:
            yield ("mechanism", "couplings", name, "table"), file
    for name, raw in ((data.get("reliability") or {}).get("dimensions") or {}).items():
        if isinstance(raw, Mapping) and isinstance(raw.get("measured"), str):
            yield ("reliability", "dimensions", name, "measured"), raw["measured"]
    synthesis = data.get("synthesis") or {}
    if isinstance(points := (synthesis.get("path") or {}).get("points"), str):
        yield ("synthesis", "path", "points"), points
    if isinstance(synthesis.get("of"), str):
        yield ("synthesis", "of"), synthesis["of"]
    if isinstance(cases := (data.get("matrix") or {}).get("cases"), str):
        yield ("matrix", "cases"), cases
