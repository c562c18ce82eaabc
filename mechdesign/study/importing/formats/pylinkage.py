"""pylinkage (https://github.com/HugoFara/pylinkage): the JSON of its mechanisms, and of its linkages up to 0.8.

A mechanism has joints with a type and a position, and links of joints: `ground`, `driver`, `arc_driver`, `link`. A
linkage has joints alone, each placed by those that it names: on a crank, at distances from two others, fixed to two, on
the line of two. Lengths have no unit, speeds are angles a step [HugoFara/pylinkage, mechanism/serialization.py].
"""

from __future__ import annotations

import cmath
import math
from typing import Any

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.names import clean
from mechdesign.study.importing.sketch import FileDrive, FileSketch, listed, mapping, number
from mechdesign.study.importing.source import ImportedText

NAME = "pylinkage (JSON)"
_TOOL = "pylinkage"
_OLD = ("Static", "Crank", "Revolute", "Pivot", "Fixed", "Prismatic", "Linear")
_NEW = ("ground", "revolute", "prismatic", "tracker")


def recognises(source: ImportedText) -> bool:
    """Whether its joints have the types of pylinkage."""
    data = source.data
    joints = data.get("joints") if isinstance(data, dict) else None
    first = joints[0] if isinstance(joints, list) and joints else None
    return isinstance(first, dict) and first.get("type") in (*_OLD, *_NEW)


def read(source: ImportedText) -> FileSketch:
    """Read a mechanism or a linkage.

    Raises
    ------
    StudyError
        If it is incomplete or contradicts itself.
    """
    data = source.data
    sketch = source.started(_TOOL)
    sketch.name = data["name"] if isinstance(data.get("name"), str) and data["name"] else sketch.name
    sketch.units = {"length": "dimensionless"}
    sketch.choices.append("a step of pylinkage is taken as a second")
    joints = [mapping(joint, "joint") for joint in data["joints"]]
    if any(joint.get("type") in _OLD for joint in joints):
        _read_linkage(sketch, joints)
    else:
        _read_mechanism(sketch, joints, [mapping(link, "link") for link in listed(data.get("links", []), "links")])
    return sketch


def _name(raw: Any, noun: str) -> str:
    if not isinstance(raw, str) or not raw:
        raise StudyError(f"a {noun} has the name {cut(repr(raw))}, not a text")
    return raw


def _place(raw: Any, meaning: str) -> complex:
    if not isinstance(raw, list) or len(raw) != 2:
        raise StudyError(f"{cut(meaning)} is {cut(repr(raw))}, not [x, y]")
    return complex(number(raw[0], meaning), number(raw[1], meaning))


def _read_mechanism(sketch: FileSketch, joints: list[dict[str, Any]], links: list[dict[str, Any]]) -> None:
    trackers, prismatic = [], []
    for joint in joints:
        name, kind = _name(joint.get("id"), "joint"), joint.get("type", "revolute")
        if kind == "tracker":
            trackers.append(joint)
            continue
        place = _place(joint.get("position"), f"the position of joint {name!r}")
        sketch.add_point(name, place.real, place.imag, fixed=kind == "ground")
        if kind == "prismatic":
            prismatic.append(joint)
        elif kind not in _NEW:
            sketch.omitted.append(f"that joint {name!r} is of the kind {cut(repr(kind))}: it is taken as a pin")
    for link in links:
        _add_link(sketch, link)
    for joint in prismatic:
        name = joint["id"]
        along = _place(joint.get("axis", [1, 0]), f"the axis of {name!r}")
        sketch.add_line(name, _place(joint.get("line_point", [0, 0]), f"the line of {name!r}"), cmath.phase(along))
    for joint in trackers:
        _add_tracker(sketch, joint)


def _add_link(sketch: FileSketch, link: dict[str, Any]) -> None:
    name, kind = _name(link.get("id"), "link"), link.get("type", "link")
    points = [_name(joint, "joint") for joint in listed(link.get("joints", []), f"the joints of {name!r}")]
    motor = link.get("motor_joint")
    if kind == "ground":
        sketch.fix(points)
        return
    sketch.add_link(name, points)
    if kind not in ("driver", "arc_driver"):
        return
    sketch.fix([str(motor)])
    speed = number(link.get("angular_velocity", math.tau / 360), f"the speed of {name!r}")
    arc = f"the arc of {name!r}"
    low, high = number(link.get("arc_start", 0), arc), number(link.get("arc_end", 0), arc)
    span = (low, high) if kind == "arc_driver" else None
    sketch.drives.append(FileDrive("angle", name, speed=speed, span=span))


def _add_tracker(sketch: FileSketch, joint: dict[str, Any]) -> None:
    """A point at a distance and an angle from two joints of a link."""
    name, one, other = joint["id"], str(joint.get("ref_joint1_id")), str(joint.get("ref_joint2_id"))
    links = sketch.links_with(one, other)
    if not links:
        sketch.omitted.append(f"the traced point {name!r}, whose two joints are on no common link")
        return
    a, b = sketch.points[one], sketch.points[other]
    turn = cmath.phase(b - a) + number(joint.get("angle", 0), f"the angle of {name!r}")
    place = a + cmath.rect(number(joint.get("distance", 0), f"the distance of {name!r}"), turn)
    sketch.add_point(name, place.real, place.imag, traced=True)
    sketch.links[links[0]].points.append(name)


def _read_linkage(sketch: FileSketch, joints: list[dict[str, Any]]) -> None:
    for joint in joints:
        _add_joint(sketch, joint)
    for joint in joints:
        name, kind = str(joint["name"]), joint.get("type")
        ends = [_end(sketch, joint[key]) for key in ("joint0", "joint1", "joint2") if joint.get(key) is not None]
        if kind == "Crank" and ends:
            sketch.add_link(clean(f"{name}_crank"), [ends[0], name])
            speed = number(joint.get("angle") or 0, f"the angle of {name!r}")
            sketch.drives.append(FileDrive("angle", clean(f"{name}_crank"), speed=speed))
        elif kind == "Fixed" and len(ends) == 2:
            sketch.add_link(clean(f"{name}_plate"), [*ends, name])
        elif kind in ("Revolute", "Pivot"):
            for count, end in enumerate(ends):
                sketch.add_link(clean(f"{name}_rod_{count + 1}"), [end, name])
        elif kind in ("Prismatic", "Linear") and len(ends) == 3:
            sketch.add_link(clean(f"{name}_rod"), [ends[0], name])
            sketch.add_track(name, ends[1:])
        elif kind != "Static":
            raise StudyError(f"joint {name!r} of the kind {cut(repr(kind))} names {len(ends)} others")


def _add_joint(sketch: FileSketch, joint: dict[str, Any]) -> None:
    """A joint, and those without a name of their own by which it is placed."""
    name = _name(joint.get("name"), "joint")
    sketch.add_point(name, joint.get("x"), joint.get("y"), fixed=joint.get("type") == "Static")
    for key in ("joint0", "joint1", "joint2"):
        end = joint.get(key)
        if isinstance(end, dict) and end.get("inline"):
            sketch.add_point(_inline(end), end.get("x"), end.get("y"), fixed=True)


def _inline(end: dict[str, Any]) -> str:
    return str(end.get("name") or f"{end.get('x')}, {end.get('y')}")


def _end(sketch: FileSketch, raw: Any) -> str:
    end = mapping(raw, "reference to a joint")
    name = _inline(end) if end.get("inline") else str(end.get("ref"))
    if name not in sketch.points:
        raise StudyError(f"a joint names the joint {cut(name)!r}, which the file does not have")
    return name
