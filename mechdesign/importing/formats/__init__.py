"""The formats that are read, a module each; `FORMATS` is the one list of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mechdesign.importing.formats import dxf, linkage, pmks, pmks_desktop, pylinkage, tables
from mechdesign.importing.sketch import FileSketch
from mechdesign.importing.source import ImportedText


@dataclass(frozen=True)
class Format:
    """A format: its name, whether a text is of it, by what the text says, and what reads it."""

    name: str
    recognises: Callable[[ImportedText], bool]
    read: Callable[[ImportedText], FileSketch]


FORMATS = tuple(
    Format(module.NAME, module.recognises, module.read)
    for module in (pmks, pmks_desktop, linkage, pylinkage, tables, dxf)
)
