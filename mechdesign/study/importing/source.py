"""What is imported: a file, a folder of tables, an address or a text, read whole and within bounds."""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.sketch import FileSketch
from mechdesign.study.text.document import decoded
from mechdesign.study.text.inputs import Folder

# Most characters of a source.
MOST_CHARACTERS = 5_000_000
# An address in angle brackets, in a link of Markdown, or before a full stop.
_AROUND = re.compile(r"<([^<>]*)>|!?\[[^\[\]]*\]\(([^()]*)\)|(\S*[^.\s])\.+")
# Names of the tables of a folder; either stands for both.
JOINTS, LINKS = "joints.csv", "links.csv"


@dataclass(frozen=True)
class ImportedText:
    """The text that is imported, what it is called, and the texts of tables of a folder."""

    name: str
    text: str
    tables: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, source: str) -> ImportedText:
        """An address, a folder with tables, or a file.

        Raises
        ------
        StudyError
            Where there is nothing to read, or too much.
        """
        if "://" in source or ("?" in source and not os.path.exists(source)):
            return cls.of_text(source, "a share address")
        path = Path(source)
        if path.name.lower() in (JOINTS, LINKS):
            path = path.parent
        if path.is_dir():
            missing = [name for name in (JOINTS, LINKS) if not (path / name).exists()]
            if missing:
                raise StudyError(f"the folder {cut(str(path))!r} has no {' and no '.join(missing)}")
            tables = {name: _read(path / name) for name in (JOINTS, LINKS)}
            return cls(path.resolve().name, tables[JOINTS], tables)
        return cls(path.name, _read(path))

    @classmethod
    def of_text(cls, text: str, name: str = "a text") -> ImportedText:
        """A text."""
        return cls(name, _address(_bounded(text, name)))

    @property
    def stem(self) -> str:
        """The name without its ending."""
        return self.name.partition(".")[0]

    def started(self, tool: str) -> FileSketch:
        """The empty sketch of a tool's file."""
        return FileSketch(tool, "" if self.name.startswith("a ") else self.stem)

    @cached_property
    def data(self) -> Any:
        """The text as JSON, None if it is none."""
        if not self.text.lstrip().startswith(("{", "[")):
            return None
        try:
            return json.loads(self.text)
        except (ValueError, RecursionError):
            return None


def _read(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16, else in the code page of Windows, as older drawings are."""
    content = Folder(anywhere=True).content(path)
    try:
        return _bounded(decoded(content), str(path))
    except UnicodeDecodeError:
        return _bounded(content.decode("cp1252", errors="replace"), str(path))


def _address(text: str) -> str:
    """An address without what stands around it in a text: ``<...>``, ``[words](...)``, a full stop; else the text."""
    address = text.strip()
    while (around := _AROUND.fullmatch(address)) is not None:
        address = (around[1] or around[2] or around[3]).strip()
    return address if "://" in address.partition("?")[0] else text


def _bounded(text: str, name: str) -> str:
    if len(text) > MOST_CHARACTERS:
        raise StudyError(f"{cut(name)} is larger than {MOST_CHARACTERS // 1_000_000} million characters")
    return text
