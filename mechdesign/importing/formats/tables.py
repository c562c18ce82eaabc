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

from mechdesign.errors import StudyError, cut
from mechdesign.importing.names import clean
from mechdesign.importing.sketch import GROUND, Drive, Sketch, Slide, number
from mechdesign.importing.source import JOINTS, LINKS, Source

NAME = "joints.csv and links.csv, or both as JSON"
_TOOL = "tables of joints and links"
_YES, _NO = ("yes", "y", "true", "x"), ("", "no", "n", "false", "none")
_BETWEEN = re.compile(r"[\s,;|]+")
_KEYS = ("name", "x", "y", "ground", "drive", "trace", "slide")


def recognises(source: Source) -> bool:
    """Whether there are both tables, or JSON with lists of joints and links."""
    data = source.data
    return bool(source.tables) or (isinstance(data, dict) and {"joints", "links"} <= data.keys())


def read(source: Source) -> Sketch:
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
        joints, links = source.data["joints"], source.data["links"]
        sketch.units = {"length": str(source.data.get("units", "mm"))}
    driven = [name for name in (_add_joint(sketch, _row(joint, "joint")) for joint in joints) if name]
    for link in (_row(raw, "link") for raw in links):
        given = link.get("joints", "")
        points = given if isinstance(given, list) else [part for part in _BETWEEN.split(str(given)) if part]
        if str(link.get("name", "")).lower() == "ground":
            sketch.fix(map(str, points))
        else:
            sketch.add_link(str(link.get("name", "")), map(str, points))
        if unknown := [key for key in link if key not in ("name", "joints")]:
            sketch.omitted.append(f"{', '.join(map(repr, unknown))} of link {link['name']!r}")
    for name, speed in driven:
        _add_drive(sketch, name, speed)
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


def _row(raw: Any, noun: str) -> Mapping[str, Any]:
    if not isinstance(raw, dict):
        raise StudyError(f"a {noun} is {cut(repr(raw))}, not a mapping")
    return raw


def _yes(raw: Any, meaning: str) -> bool:
    word = "" if raw is None else str(raw).strip().lower()
    if word not in (*_YES, *_NO, "1", "0"):
        raise StudyError(f"{cut(meaning)} is {cut(repr(raw))}, not yes or no")
    return word in (*_YES, "1")


def _add_joint(sketch: Sketch, joint: Mapping[str, Any]) -> tuple[str, float | None] | None:
    """Add a joint; of a driven one its name and speed are returned."""
    name = str(joint.get("name", ""))
    fixed = _yes(joint.get("ground"), f"ground of joint {name!r}")
    traced = _yes(joint.get("trace"), f"trace of joint {name!r}")
    sketch.add_point(name, joint.get("x"), joint.get("y"), traced=traced, fixed=fixed)
    if unknown := [key for key in joint if key not in _KEYS]:
        sketch.omitted.append(f"{', '.join(map(repr, unknown))} of joint {name!r}")
    slide = joint.get("slide")
    if slide not in (None, ""):
        line = clean(f"{name}_line")
        sketch.add_point(line, joint.get("x"), joint.get("y"), fixed=True)
        angle = math.radians(number(slide, f"slide of joint {name!r}"))
        sketch.slides[clean(f"{name}_slide")] = Slide(name, GROUND, (line,), angle)
    drive = "" if joint.get("drive") is None else str(joint["drive"]).strip().lower().removesuffix("rpm").strip()
    if drive in _NO:
        return None
    return name, None if drive in _YES else number(drive, f"drive of joint {name!r}") * math.pi / 30 or None


def _add_drive(sketch: Sketch, name: str, speed: float | None) -> None:
    links = sketch.moving_at(name)
    slide = clean(f"{name}_slide")
    if slide in sketch.slides:
        sketch.drives.append(Drive("slide", slide))
        return
    if name in sketch.fixed:
        links.insert(0, GROUND)
    if len(links) != 2:
        message = f"the drive at joint {name!r} turns one link against another, or against the ground"
        raise StudyError(f"{message}; there {len(links)} are joined")
    sketch.drives.append(Drive("angle", links[1], links[0], speed))
