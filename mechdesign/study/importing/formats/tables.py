"""Tables of joints and links, as a folder with ``joints.csv`` and ``links.csv``, or as one JSON.

Joints have `name`, `x`, `y` and may have `ground` (yes), `drive` (yes, or a speed in turns a minute), `trace` (yes) and
`slide` (an angle in degrees: the joint moves along a fixed line through its place). Links have `name` and `joints`,
names with spaces, commas, semicolons or bars between; a link `ground` has what does not move. JSON:
``{"units": "mm", "joints": [...], "links": [...]}``.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.sketch import FileSketch, listed, mapping, number
from mechdesign.study.importing.source import JOINTS, LINKS, ImportedText

NAME = "joints.csv and links.csv, or both as JSON"
_TOOL = "tables of joints and links"
_YES, _NO = ("yes", "y", "true", "x"), ("", "no", "n", "false", "none")
_BETWEEN = re.compile(r"[\s,;|]+")
_KEYS = ("name", "x", "y", "ground", "drive", "trace", "slide")


def recognises(source: ImportedText) -> bool:
    """Whether there are both tables, or JSON with lists of joints and links."""
    data = source.data
    return bool(source.tables) or (isinstance(data, dict) and {"joints", "links"} <= data.keys())


def read(source: ImportedText) -> FileSketch:
    """Read both tables.

    Raises
    ------
    StudyError
        If they are incomplete or contradict each other.
    """
    sketch = source.started(_TOOL)
    if source.tables:
        joints, links = (list(_rows(source.tables[name], name)) for name in (JOINTS, LINKS))
    else:
        joints, links = (listed(source.data[key], key) for key in ("joints", "links"))
        sketch.units = {"length": str(source.data.get("units", "mm"))}
    driven = [drive for joint in joints for drive in _add_joint(sketch, mapping(joint, "joint"))]
    for link in (mapping(raw, "link") for raw in links):
        given = link.get("joints", "")
        points = given if isinstance(given, list) else [part for part in _BETWEEN.split(str(given)) if part]
        if str(link.get("name", "")).lower() == "ground":
            sketch.fix(map(str, points))
        else:
            sketch.add_link(str(link.get("name", "")), map(str, points))
        if unknown := [key for key in link if key not in ("name", "joints")]:
            sketch.omitted.append(f"{', '.join(map(repr, unknown))} of link {link['name']!r}")
    sketch.drives = [sketch.drive_at(*drive) for drive in driven]
    return sketch


def _rows(text: str, name: str) -> Iterator[dict[str, str]]:
    try:
        rows = csv.reader(text.splitlines(), delimiter=";" if ";" in text.partition("\n")[0] else ",")
        head = [cell.strip().lower() for cell in next(rows, [])]
        if "name" not in head:
            raise StudyError(f"{name} begins with {cut(','.join(head))!r}, not with the names of its columns")
        for row in rows:
            if any(cell.strip() for cell in row):
                yield {key: cell.strip() for key, cell in zip(head, row, strict=False)}
    except csv.Error as error:
        raise StudyError(f"{name} cannot be read as CSV: {error}") from None


def _yes(raw: Any, meaning: str) -> bool:
    word = "" if raw is None else str(raw).strip().lower()
    if word not in (*_YES, *_NO, "1", "0"):
        raise StudyError(f"{cut(meaning)} is {cut(repr(raw))}, not yes or no")
    return word in (*_YES, "1")


def _add_joint(sketch: FileSketch, joint: Mapping[str, Any]) -> Iterator[tuple[str, float | None]]:
    """Add a joint; yields name and speed of a driven one."""
    name = str(joint.get("name", ""))
    fixed = _yes(joint.get("ground"), f"ground of joint {name!r}")
    traced = _yes(joint.get("trace"), f"trace of joint {name!r}")
    sketch.add_point(name, joint.get("x"), joint.get("y"), traced=traced, fixed=fixed)
    if unknown := [key for key in joint if key not in _KEYS]:
        sketch.omitted.append(f"{', '.join(map(repr, unknown))} of joint {name!r}")
    slide = joint.get("slide")
    if slide not in (None, ""):
        sketch.add_line(name, sketch.points[name], math.radians(number(slide, f"slide of joint {name!r}")))
    drive = "" if joint.get("drive") is None else str(joint["drive"]).strip().lower().removesuffix("rpm").strip()
    if drive not in _NO:
        yield name, None if drive in _YES else number(drive, f"drive of joint {name!r}") * math.pi / 30 or None
