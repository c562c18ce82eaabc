"""PMKS, the simulator before PMKS+: a text ``mech=`` with a joint a line, which its files and addresses have.

A joint names its links, then its type, its place, the angle of a slide, and four letters for what is shown of it, of
which the last says whether it is driven: ``ground,input,R,0,0,0,tfft``. A type is R for a pin, P for a slide and RP for
a pin in a slot; the first link has the line, the second the point [DesignEngrLab/PMKS, JointData.cs].
"""

from __future__ import annotations

import math
import re
from urllib.parse import unquote

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.sketch import GROUND, FileDrive, FileSketch, Slide, number
from mechdesign.study.importing.source import ImportedText

NAME = "PMKS (mech=)"
_TOOL = "PMKS"
_START = re.compile(r"(?:^|[?&\s])mech=")
_TYPES = ("R", "P", "RP")
_GROUND = ("ground", "gnd", "grnd", "0", "1")


def recognises(source: ImportedText) -> bool:
    """Whether the text of its joints begins near the start."""
    return _START.search(source.text[:2000]) is not None


def read(source: ImportedText) -> FileSketch:
    """Read a text of joints.

    Raises
    ------
    StudyError
        If a line is no joint, or of a type that is not read.
    """
    sketch = source.started(_TOOL)
    sketch.choices.append("the file says no unit: lengths are taken as mm; --unit says another")
    text = unquote(_START.split(source.text, 1)[1].partition("&")[0])
    joints = [_Joint(f"P{k}", line) for k, line in enumerate(filter(None, map(str.strip, re.split(r"[\n|]", text))), 1)]
    links: dict[str, list[str]] = {}
    for joint in joints:
        traced = joint.flags.startswith("t") and not joint.fixed
        sketch.add_point(joint.name, joint.x, joint.y, traced=traced, fixed=joint.fixed)
        for link in joint.holders:
            links.setdefault(link, []).append(joint.name)
        if joint.type != "R":
            line = f"{joint.name}_line"
            sketch.add_point(line, joint.x, joint.y, fixed=joint.guide == GROUND)
            links.setdefault(joint.guide, []).append(line)
    for link, points in links.items():
        if link != GROUND:
            sketch.add_link(link, points)
    for joint in joints:
        if joint.type != "R":
            angle = math.radians(number(joint.angle or "0", f"angle of {joint.words}"))
            riders = (joint.links[1],) if joint.type == "P" else ()
            sketch.slides[f"{joint.name}_slide"] = Slide(
                joint.name, joint.guide, (f"{joint.name}_line",), angle, riders
            )
    driven = [joint for joint in joints if joint.flags[3:] == "t"]
    if not driven and joints:
        driven = joints[:1]
        sketch.choices.append("no joint is marked as driven: the first one is, as there")
    for joint in driven:
        if len(joint.links) < 2:
            raise StudyError(f"{joint.words} is driven and has one link alone")
        turned = FileDrive("angle", joint.links[1], joint.links[0])
        sketch.drives.append(turned if joint.type == "R" else FileDrive("slide", f"{joint.name}_slide"))
    return sketch


class _Joint:
    """A line of the text: two or more links, the one with the line or the ground first, or a point of one link."""

    def __init__(self, name: str, line: str) -> None:
        self.name, self.words = name, f"joint {cut(line)!r}"
        fields = [field.strip() for field in line.split(",")]
        at = next((k for k, field in enumerate(fields) if field.upper() in (*_TYPES, "G")), 0)
        if not at or len(fields) < at + 3:
            raise StudyError(f"{self.words} is not links, a type (R, P or RP), x and y")
        self.type = fields[at].upper()
        if self.type == "G":
            raise StudyError(f"{self.words} is the contact of gears, which is not read: take it out")
        self.links = [GROUND if link.lower() in _GROUND else link.lower() for link in fields[:at]]
        if self.type != "R" and len(self.links) != 2:
            raise StudyError(f"{self.words} slides, and has {len(self.links)} of 2 links")
        if GROUND in self.links and self.type != "RP":
            # A slide is the same from either of its links.
            self.links.sort(key=lambda link: link != GROUND)
        self.x, self.y, *rest = fields[at + 1 :]
        self.flags = rest.pop().lower() if rest and re.fullmatch("[tfTF]{4}", rest[-1]) else ""
        self.angle = rest[0] if rest else ""

    @property
    def guide(self) -> str:
        """The link that has the line of a slide."""
        return self.links[0]

    @property
    def holders(self) -> list[str]:
        """The links that have its point."""
        return self.links if self.type == "R" else self.links[1:]

    @property
    def fixed(self) -> bool:
        """Whether its point is on the ground."""
        return GROUND in self.holders
