"""The commented study of a draft."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TypeAlias

from mechdesign.ground.errors import StudyError, cut, printable
from mechdesign.study.importing.draft import Draft, Span
from mechdesign.study.importing.sketch import GROUND, FileDrive, FileLink, Gears, Slide

_WIDTH = 116
# Steps of a sweep, least instants of a motion in time, and instants for each turn of a drive.
STEPS = 72
_INSTANTS = 361
_EACH_TURN = 73
# Longest motion of several drives, in seconds, and most times that one of them goes to and fro in it.
_LONGEST = 60.0
_MOST_ROUNDS = 1000


# What a line of a study holds.
Flow: TypeAlias = "str | float | Sequence[Flow] | Mapping[str, Flow]"


class Writer:
    """Writes the study of a draft."""

    def __init__(self, draft: Draft) -> None:
        self._draft, self._sketch = draft, draft.sketch
        self._couplings = [self._coupling(gears) for gears in draft.sketch.gears]

    def text(
        self, source: str, spans: Mapping[str, Span], remarks: Sequence[str] = (), undecided: Sequence[str] = ()
    ) -> str:
        """The study, with what its drives go through, and what is to be moved before it runs."""
        mechanism, kinematics = self._mechanism(), self._kinematics(spans)
        sketch = self._sketch
        lines = [f"# Imported from {sketch.tool}: {source}"]
        lines += _listed("What to move before it runs:", undecided)
        lines += _listed("What became what:", [*sketch.choices, *self._draft.names.changed(), *remarks])
        lines += _listed("What the file has and this study does not:", sketch.omitted)
        name = printable(cut(sketch.name)) or f"Mechanism from {sketch.tool}"
        lines += [f"name: {json.dumps(name, ensure_ascii=False)}", f"units: {flow(sketch.units)}", ""]
        lines += [*mechanism, "", *kinematics, *self._dynamics()]
        return "\n".join(lines) + "\n"

    def _mechanism(self) -> list[str]:
        draft = self._draft
        lines = _section("links", {draft.link(body): self._link(body) for body in draft.points})
        lines += _section("joints", {draft.joint(name): self._slide(slide) for name, slide in draft.slides.items()})
        drives = {name: self._driven(name, drive) for name, drive in draft.drives.items()}
        lines.append(f"  drives: {flow(drives)}")
        lines += _section("couplings", dict(self._couplings))
        moving = dict.fromkeys(point for body in draft.moving for point in draft.points[body])
        fixed = draft.points[GROUND]
        places = {draft.point(point): _pair(draft.places[point]) for point in moving if point not in fixed}
        lines += _section("sketch", places)
        measures, limits = dict[str, Flow](), list[Flow]()
        for name, slide in draft.slides.items():
            if slide.limited:
                measure = draft.names.make("measure", f"{draft.joint(name)}_travel")
                measures[measure] = f"{draft.joint(name)}.slide"
                limits.append({"measure": measure, "min": 0.0, "max": self._sketch.distance(*slide.through)})
        for point, middle, end in self._sketch.reaches:
            bound = self._sketch.distance(middle, end)
            limits.append({"distance": [draft.point(point), draft.point(middle)], "max": bound})
        return ["mechanism:", *lines, *_section("measures", measures), *_section("limits", limits)]

    def _link(self, body: str) -> dict[str, Flow]:
        draft, points = self._draft, self._draft.points[body]
        if body == GROUND:
            return {draft.point(point): _pair(draft.places[point]) for point in points}
        first, *rest = points
        entries: dict[str, Flow] = {}
        second = next((point for point in rest if draft.places[point] != draft.places[first]), None)
        if second is not None:
            entries |= {"from": draft.point(first), "to": draft.point(second)}
            telescopic = self._sketch.links[body].telescopic
            entries |= (
                {"telescopic": "true"} if telescopic else {"length": abs(draft.places[second] - draft.places[first])}
            )
            points = [point for point in rest if point != second]
        if points:
            entries["points"] = {draft.point(p): _pair(draft.local(body, draft.places[p])) for p in points}
        return entries | (self._mass(body) if self._sketch.dynamic else {})

    def _mass(self, body: str) -> dict[str, Flow]:
        """Mass, centre and moment of inertia of a body's links together; inertias count about the common centre."""
        links = [self._sketch.links[name] for name in self._draft.bodies.links(body)]
        heavy = [(link.mass, self._center(link), link.inertia or 0.0) for link in links if link.mass]
        mass = sum(m for m, _, _ in heavy)
        if not mass:
            return {}
        center = sum(m * place for m, place, _ in heavy) / mass
        entries: dict[str, Flow] = {"mass": mass, "center": _pair(self._draft.local(body, center))}
        if len(heavy) > 1:
            self._sketch.omitted.append(f"the moment of inertia of {body!r}, which several links are together")
        elif heavy[0][2]:
            entries["inertia"] = f"{digits(heavy[0][2])} {self._sketch.inertia_unit}"
        return entries

    def _center(self, link: FileLink) -> complex:
        """Centre of mass of a link; where the file gives none, the middle of its points."""
        places = [self._sketch.points[point] for point in link.points]
        return link.center if link.center is not None else sum(places) / len(places)

    def _slide(self, slide: Slide) -> dict[str, Flow]:
        draft, guide = self._draft, self._draft.bodies.of(slide.guide)
        line: dict[str, Flow] = {"through": [draft.point(point) for point in slide.through]}
        if len(slide.through) == 1:
            line = {"through": draft.point(slide.through[0]), "direction": degrees(slide.direction - draft.turn(guide))}
        line["point"] = draft.point(slide.point)
        riders = draft.riders(slide)
        if not riders:
            return {"slot": draft.link(guide), **line}
        angle = degrees(draft.turn(riders[0]) - draft.direction(slide))
        return {"prismatic": [draft.link(guide), draft.link(riders[0])], **line, "angle": angle}

    def _driven(self, name: str, drive: FileDrive) -> Flow:
        base = self._draft.bodies.of(drive.base)
        return {drive.kind: name, **({} if base == GROUND else {"from": self._draft.link(base)})}

    def _coupling(self, gears: Gears) -> tuple[str, Flow]:
        """Name and entries of the coupling of two wheels."""
        draft = self._draft
        follower, leader = map(draft.bodies.of, (gears.follower, gears.leader))
        ratio, radius = gears.ratio, gears.radius
        if follower == GROUND or (leader != GROUND and draft.turned(follower) and not draft.turned(leader)):
            follower, leader, ratio = leader, follower, 1 / ratio
            radius = None if radius is None else radius / abs(ratio)
        holders = [body for body, points in draft.points.items() if {*gears.axes} <= {*points}]
        carrier = GROUND if GROUND in holders else next((b for b in holders if b not in (follower, leader)), None)
        if follower == GROUND or carrier is None:
            raise StudyError(f"wheels {gears.follower!r} and {gears.leader!r} have no link that holds both axes")
        name = draft.names.make("coupling", f"{draft.link(follower)}_{'belt' if gears.belt else 'mesh'}")
        wheels: dict[str, Flow] = {"wheels": "belt"} if gears.belt else {}
        if gears.belt and radius is not None:
            wheels["radius"] = radius
        if carrier == GROUND:
            return name, {"set": draft.link(follower), "of": draft.link(leader), "ratio": ratio, **wheels}
        turn, lead, carried = map(draft.turn, (follower, leader, carrier))
        phase = degrees(math.remainder(turn - carried - ratio * (lead - carried), 2 * math.pi))
        carry = f"({digits(1 - ratio)})*{draft.link(carrier)}.angle"
        led = "" if leader == GROUND else f" + ({digits(ratio)})*{draft.link(leader)}.angle"
        return name, {"set": draft.link(follower), "to": f'"{carry}{led} + ({phase})"', **wheels}

    def _kinematics(self, spans: Mapping[str, Span]) -> list[str]:
        draft, lines = self._draft, ["kinematics:"]
        if len(draft.drives) == 1:
            ((name, drive),) = draft.drives.items()
            low, high = spans[name]
            lines.append(f"  sweep: {flow({name: {'from': low, 'to': high, 'number': STEPS + 1}})}")
            lines += [f"  rates: {flow({name: self._rate(drive)})}"] if drive.speed else []
        else:
            lines += self._motion()
        on_bodies = {point for body in draft.moving for point in draft.points[body]}
        traced = [draft.point(name) for name in self._sketch.points if name in self._sketch.traced & on_bodies]
        return [*lines, *([f"  outputs: {flow(traced)}"] if traced else [])]

    def _rate(self, drive: FileDrive) -> str:
        speed, unit = drive.speed or 0.0, self._sketch.units["length"]
        if drive.kind != "angle":
            return digits(speed) if unit == "dimensionless" else f"{digits(speed)} {unit}/s"
        turns = speed * 30 / math.pi
        return f"{digits(turns)} rpm" if abs(turns - round(turns, 6)) < 1e-12 else f"{digits(speed)} rad/s"

    def _motion(self) -> list[str]:
        """All drives at their speeds, from the sketch on; those to and fro go there and back."""
        draft = self._draft
        starts = {name: draft.start(name) for name in draft.drives}
        moving = {name: drive for name, drive in draft.drives.items() if drive.speed and not drive.held}
        if not moving:
            return _section("poses", [starts])
        periods = {name: draft.period(name) for name in moving}
        duration = _common(list(periods.values()))
        lines = ["  motion:"]
        for name, start in starts.items():
            if name not in moving:
                lines.append(f"    {name}: {flow(start)}")
                continue
            if moving[name].span is None:
                moves: list[Flow] = [{"from": start, **_move(start + moving[name].rate * duration, duration)}]
            else:
                far, near = sorted(draft.span(name), key=lambda end: -abs(end - start))
                there, back = (_move(end, periods[name] / 2) for end in (far, near))
                rounds = max(1, round(duration / periods[name]))
                if rounds > _MOST_ROUNDS:
                    raise StudyError(
                        f"the input {name!r} goes to and fro {rounds:,} times while the slowest one moves once: choose "
                        "one of them with --drive"
                    )
                moves = [{"from": near, **there}, back, *[there, back] * (rounds - 1)]
            lines += [f"    {name}:", *(f"      - {flow(move)}" for move in moves)]
        turns = max(duration / period for period in periods.values())
        return [*lines, f"  instants: {max(_INSTANTS, min(3601, round(_EACH_TURN * turns)))}"]

    def _dynamics(self) -> list[str]:
        draft, sketch = self._draft, self._sketch
        if not sketch.dynamic:
            return []
        loads: list[Flow] = []
        for point, body, force in draft.loads:
            vector = draft.turned_back(body, force.vector) if force.local else force.vector
            frame: dict[str, Flow] = {"in": draft.link(body)} if force.local else {}
            loads.append({"at": draft.point(point), "force": _pair(vector), **frame})
        lines = ["  gravity: [0, -9.81 m/s^2]"] if sketch.gravity else []
        lines += _section("loads", loads)
        return ["", "dynamics:", *lines] if lines else ["", "dynamics: {}"]


def _move(end: float, time: float) -> dict[str, Flow]:
    """A move at a constant rate."""
    return {"to": end, "time": time, "law": "constant"}


def _common(periods: list[float]) -> float:
    """The shortest time that is a whole number of each period, or `_LONGEST`, or the longest period."""
    longest = max(periods)
    for count in range(1, min(round(_LONGEST / longest), _MOST_ROUNDS) + 1):
        time = count * longest
        if all(abs(time / period - round(time / period)) < 1e-6 for period in periods):
            return time
    return longest


def digits(value: float) -> str:
    """A number with twelve digits."""
    return format(value + 0.0, ".12g")


def degrees(angle: float) -> str:
    """An angle within half a turn of 0, in degrees."""
    return digits(math.degrees(math.remainder(angle, 2 * math.pi)))


def _pair(place: complex) -> list[Flow]:
    """Coordinates; what rounding has left of a zero is one."""
    return [0.0 if abs(value) <= 1e-13 * abs(place) else value for value in (place.real, place.imag)]


def flow(value: Flow) -> str:
    """A value as YAML in one line; a text as it is."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {flow(part)}' for key, part in value.items())}}}"
    if isinstance(value, str):
        return value
    return f"[{', '.join(map(flow, value))}]" if isinstance(value, Sequence) else digits(value)


def _section(key: str, entries: Mapping[str, Flow] | Sequence[Flow]) -> list[str]:
    """Lines of a key of a section, one for each of its entries; none without entries."""
    if isinstance(entries, Mapping):
        lines = [f"    {name}: {flow(entry)}" for name, entry in entries.items()]
    else:
        lines = [f"    - {flow(entry)}" for entry in entries]
    return [f"  {key}:", *lines] if lines else []


def _listed(title: str, entries: Sequence[str]) -> list[str]:
    """Comment lines with a title and the entries, folded."""
    lines = ["#", f"# {title}"] if entries else []
    for entry in dict.fromkeys(map(printable, entries)):
        lines += textwrap.wrap(entry, _WIDTH, initial_indent="# - ", subsequent_indent="#   ")
    return lines
