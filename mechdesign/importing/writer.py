"""The commented study of a draft."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Mapping, Sequence

from mechdesign.errors import StudyError, cut, printable
from mechdesign.importing.draft import Draft, Span
from mechdesign.importing.sketch import GROUND, Drive, Gears, Slide

_WIDTH = 116
# Poses of a sweep; of a motion in time, at least, and for each turn of a drive.
STEPS = 72
_INSTANTS = 361
_EACH_TURN = 73
# Longest motion of several drives, in seconds.
_LONGEST = 60.0


class Writer:
    """Writes the study of a draft."""

    def __init__(self, draft: Draft) -> None:
        self._draft, self._sketch = draft, draft.sketch
        self._couplings = [self._coupling(gears) for gears in draft.sketch.gears]

    def text(self, source: str, spans: Mapping[str, Span], remarks: Sequence[str] = ()) -> str:
        """The study, with what its drives go through."""
        mechanism, kinematics = self._mechanism(), self._kinematics(spans)
        sketch = self._sketch
        lines = [f"# Imported from {sketch.tool}: {source}"]
        lines += _listed("What became what:", [*sketch.choices, *self._draft.names.changed(), *remarks])
        lines += _listed("What the file has and this study does not:", sketch.omitted)
        name = printable(cut(sketch.name)) or f"Mechanism from {sketch.tool}"
        units = ", ".join(f"{kind}: {unit}" for kind, unit in sketch.units.items())
        lines += [f"name: {json.dumps(name, ensure_ascii=False)}", f"units: {{{units}}}", ""]
        lines += [*mechanism, "", *kinematics, *self._dynamics()]
        return "\n".join(lines) + "\n"

    def _mechanism(self) -> list[str]:
        lines = ["mechanism:", "  links:"]
        for body in self._draft.points:
            lines.append(f"    {self._draft.link(body)}: {self._link_text(body)}")
        joints = [f"    {self._draft.joint(name)}: {self._slide(slide)}" for name, slide in self._draft.slides.items()]
        lines += ["  joints:", *joints] if joints else []
        drives = ", ".join(self._drive_text(name, drive) for name, drive in self._draft.drives.items())
        lines.append(f"  drives: {{{drives}}}")
        lines += ["  couplings:", *(f"    {name}: {text}" for name, text in self._couplings)] if self._couplings else []
        fixed = {*self._draft.points[GROUND]}
        on_links = dict.fromkeys(point for body in self._draft.moving for point in self._draft.points[body])
        moving = [point for point in on_links if point not in fixed]
        lines += ["  sketch:", *(f"    {self._draft.point(p)}: {_pair(self._draft.places[p])}" for p in moving)]
        return lines + self._limits()

    def _link_text(self, body: str) -> str:
        points = self._draft.points[body]
        if body == GROUND:
            return "{" + ", ".join(f"{self._draft.point(p)}: {_pair(self._draft.places[p])}" for p in points) + "}"
        link = self._sketch.links.get(body)
        first = points[0]
        second = next((p for p in points[1:] if self._draft.places[p] != self._draft.places[first]), None)
        parts = []
        if second is not None:
            parts = [f"from: {self._draft.point(first)}", f"to: {self._draft.point(second)}"]
            (x, y), (u, v) = self._draft.places[first], self._draft.places[second]
            telescopic = link is not None and link.telescopic
            parts.append("telescopic: true" if telescopic else f"length: {digits(math.hypot(u - x, v - y))}")
        rest = [p for p in points if second is None or p not in (first, second)]
        if rest:
            places = ", ".join(
                f"{self._draft.point(p)}: {_pair(self._draft.local(body, *self._draft.places[p]))}" for p in rest
            )
            parts.append(f"points: {{{places}}}")
        return "{" + ", ".join(parts + (self._mass(body) if self._sketch.dynamic else [])) + "}"

    def _mass(self, body: str) -> list[str]:
        """Mass, centre and moment of inertia of a body's links together; inertias count about the common centre."""
        links = [self._sketch.links[name] for name in self._draft.bodies.links(body)]
        heavy = [(link.mass, link.center, link.inertia or 0.0) for link in links if link.mass and link.center]
        mass = sum(m for m, _, _ in heavy)
        if not mass:
            return []
        x, y = (sum(m * c[k] for m, c, _ in heavy) / mass for k in (0, 1))
        parts = [f"mass: {digits(mass)}", f"center: {_pair(self._draft.local(body, x, y))}"]
        if len(heavy) > 1:
            self._sketch.omitted.append(f"the moment of inertia of {body!r}, which several links are together")
        elif heavy[0][2]:
            parts.append(f"inertia: {digits(heavy[0][2])} {self._sketch.inertia_unit}")
        return parts

    def _slide(self, slide: Slide) -> str:
        draft = self._draft
        guide = draft.bodies.of(slide.guide)
        through = ", ".join(map(draft.point, slide.through))
        parts = [f"through: [{through}]"]
        if len(slide.through) == 1:
            parts = [f"through: {through}", f"direction: {degrees(slide.direction - draft.turn(guide))}"]
        parts.append(f"point: {draft.point(slide.point)}")
        riders = draft.riders(slide)
        if not riders:
            return f"{{slot: {draft.link(guide)}, {', '.join(parts)}}}"
        parts.append(f"angle: {degrees(draft.turn(riders[0]) - draft.direction(slide))}")
        return f"{{prismatic: [{draft.link(guide)}, {draft.link(riders[0])}], {', '.join(parts)}}}"

    def _drive_text(self, name: str, drive: Drive) -> str:
        base = GROUND if drive.kind != "angle" else self._draft.bodies.of(drive.base)
        return f"{name}: {{{drive.kind}: {name}{'' if base == GROUND else f', from: {self._draft.link(base)}'}}}"

    def _coupling(self, gears: Gears) -> tuple[str, str]:
        """Name and text of the coupling of two wheels."""
        follower, leader = map(self._draft.bodies.of, (gears.follower, gears.leader))
        ratio, radius = gears.ratio, gears.radius
        if follower == GROUND or (leader != GROUND and self._draft.turned(follower) and not self._draft.turned(leader)):
            follower, leader, ratio = leader, follower, 1 / ratio
            radius = None if radius is None else radius / abs(ratio)
        carriers = [
            body for body, points in self._draft.points.items()
            if body not in (follower, leader) and {*gears.axes} <= {*points}
        ]  # fmt: skip
        if {*gears.axes} <= {*self._draft.points[GROUND]}:
            carriers = [GROUND]
        if follower == GROUND or not carriers:
            raise StudyError(f"wheels {gears.follower!r} and {gears.leader!r} have no link that holds both axes")
        arm = carriers[0]
        name = self._draft.names.make("coupling", f"{self._draft.link(follower)}_{'belt' if gears.belt else 'mesh'}")
        wheels = ", wheels: belt" if gears.belt else ""
        wheels += f", radius: {digits(radius)}" if gears.belt and radius is not None else ""
        set_ = f"set: {self._draft.link(follower)}"
        if arm == GROUND:
            return name, f"{{{set_}, of: {self._draft.link(leader)}, ratio: {digits(ratio)}{wheels}}}"
        turn, lead, carried = map(self._draft.turn, (follower, leader, arm))
        phase = degrees(math.remainder(turn - carried - ratio * (lead - carried), 2 * math.pi))
        carry = f"({digits(1 - ratio)})*{self._draft.link(arm)}.angle"
        led = "" if leader == GROUND else f" + ({digits(ratio)})*{self._draft.link(leader)}.angle"
        return name, f'{{{set_}, to: "{carry}{led} + ({phase})"{wheels}}}'

    def _limits(self) -> list[str]:
        limits, measures = [], []
        for name, slide in self._draft.slides.items():
            if slide.limited:
                joint = self._draft.joint(name)
                measure = self._draft.names.make("measure", f"{joint}_travel")
                measures.append(f"    {measure}: {joint}.slide")
                high = digits(self._sketch.distance(*slide.through))
                limits.append(f"    - {{measure: {measure}, min: 0, max: {high}}}")
        return ["  measures:", *measures, "  limits:", *limits] if limits else []

    def _kinematics(self, spans: Mapping[str, Span]) -> list[str]:
        lines = ["kinematics:"]
        if len(self._draft.drives) == 1:
            (name, (low, high)), drive = next(iter(spans.items())), next(iter(self._draft.drives.values()))
            lines.append(f"  sweep: {{{name}: {{from: {digits(low)}, to: {digits(high)}, number: {STEPS + 1}}}}}")
            if drive.speed:
                lines.append(f"  rates: {{{name}: {self._rate(drive)}}}")
        else:
            lines += self._motion()
        on_bodies = {point for body in self._draft.moving for point in self._draft.points[body]}
        traced = [
            self._draft.point(name) for name, point in self._sketch.points.items() if point.traced and name in on_bodies
        ]
        lines += [f"  outputs: [{', '.join(traced)}]"] if traced else []
        return lines

    def _rate(self, drive: Drive) -> str:
        speed = drive.speed or 0.0
        if drive.kind != "angle":
            return f"{digits(speed)} {self._length_unit()}/s".replace(" /s", "")
        turns = speed * 30 / math.pi
        return f"{digits(turns)} rpm" if abs(turns - round(turns, 6)) < 1e-12 else f"{digits(speed)} rad/s"

    def _length_unit(self) -> str:
        unit = self._sketch.units["length"]
        return "" if unit == "dimensionless" else unit

    def _motion(self) -> list[str]:
        """All drives at their speeds, from the sketch on; those to and fro go there and back."""
        moving = {name: drive for name, drive in self._draft.drives.items() if drive.speed and not drive.held}
        if not moving:
            return [
                "  poses:",
                f"    - {{{', '.join(f'{name}: {digits(self._draft.start(name))}' for name in self._draft.drives)}}}",
            ]
        periods = {name: self._draft.period(name) for name in moving}
        duration = _common(list(periods.values()))
        lines = ["  motion:"]
        for name, drive in self._draft.drives.items():
            start = digits(self._draft.start(name))
            if name not in moving:
                lines.append(f"    {name}: {start}")
                continue
            if drive.span is None:
                factor = math.degrees(1) if drive.kind == "angle" else 1.0
                way = factor * (drive.speed or 0.0) * duration
                end = digits(self._draft.start(name) + way)
                move = f"{{from: {start}, to: {end}, time: {digits(duration)}, law: constant}}"
                lines += [f"    {name}:", f"      - {move}"]
                continue
            low, high = self._draft.span(name)
            first, second = sorted((low, high), key=lambda end: -abs(end - self._draft.start(name)))
            half = digits(periods[name] / 2)
            there = f"to: {digits(first)}, time: {half}, law: constant"
            back = f"{{to: {digits(second)}, time: {half}, law: constant}}"
            rounds = max(1, round(duration / periods[name]))
            moves = [f"{{from: {digits(second)}, {there}}}", back, *([f"{{{there}}}", back] * (rounds - 1))]
            lines += [f"    {name}:", *(f"      - {move}" for move in moves)]
        turns = max(duration / period for period in periods.values())
        return [*lines, f"  instants: {max(_INSTANTS, min(3601, round(_EACH_TURN * turns)))}"]

    def _dynamics(self) -> list[str]:
        sketch = self._sketch
        if not sketch.dynamic:
            return []
        lines = ["", "dynamics:"]
        lines += ["  gravity: [0, -9.81 m/s^2]"] if sketch.gravity else []
        if self._draft.loads:
            lines.append("  loads:")
        for point, body, (fx, fy), local in self._draft.loads:
            turned = complex(fx, fy)
            if local:
                turned *= complex(math.cos(self._draft.turn(body)), -math.sin(self._draft.turn(body)))
            frame = f", in: {self._draft.link(body)}" if local else ""
            lines.append(f"    - {{at: {self._draft.point(point)}, force: {_pair((turned.real, turned.imag))}{frame}}}")
        return lines if len(lines) > 2 else [*lines[:-1], "dynamics: {}"]


def _common(periods: list[float]) -> float:
    """The shortest time that is a whole number of each period, or `_LONGEST`, or the longest period."""
    longest = max(periods)
    for count in range(1, round(_LONGEST / longest) + 1):
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


def _pair(place: tuple[float, float]) -> str:
    """Coordinates; what rounding has left of a zero is one."""
    least = 1e-13 * max(map(abs, place))
    x, y = (0.0 if abs(value) <= least else value for value in place)
    return f"[{digits(x)}, {digits(y)}]"


def _listed(title: str, entries: Sequence[str]) -> list[str]:
    """Comment lines with a title and the entries, folded."""
    lines = ["#", f"# {title}"] if entries else []
    for entry in dict.fromkeys(map(printable, entries)):
        lines += textwrap.wrap(entry, _WIDTH, initial_indent="# - ", subsequent_indent="#   ")
    return lines
