"""The formats that are read, a module each; `FORMATS` is the one list of them."""

from __future__ import annotations

from mechdesign.study.importing.formats import dxf, linkage, pmks, pmks_desktop, pylinkage, tables

# Each has its `NAME`, whether a text is of it (`recognises`), by what the text says, and what reads it (`read`).
FORMATS = (pmks, pmks_desktop, linkage, pylinkage, tables, dxf)
