"""The commented study of a sketch."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

from mechdesign.errors import StudyError, cut, printable
from mechdesign.importing.bodies import Bodies
from mechdesign.importing.names import Names
from mechdesign.importing.sketch import GROUND, Drive, Gears, Sketch, Slide

Span = tuple[float, float]
"""First and last value of a drive, in degrees or the unit of length."""
_WIDTH = 116
# Poses of a sweep; of a motion in time, at least, and for each turn of a drive.
STEPS = 72
_INSTANTS = 361
_EACH_TURN = 73
# Longest motion of several drives, in seconds.
_LONGEST = 60.0


class Writer:
    """What of a sketch stands in its study, by the names of the study, and its text."""

    def __init__(self, sketch: Sketch) -> None:
        self.sketch = sketch
        self._bodies = Bodies(sketch)
        self._names = Names()
        self._places = {name: (point.x, point.y) for name, point in sketch.points.items()}
        self._points = {body: list(points) for body, points in self._bodies.points.items()}
        self._marks()
        self._loads = self._forces()
        for points in self._points.values():
            for point in points:
                self._names.make("point", point)
        self._frames = {body: self._frame(body) for body in self._points}
        self._moving = [body for body in self._points if body != GROUND]
        for body in self._moving:
            self._names.make("link", body)
        self._joints = self._slides()
        self.drives = self._drives()
        self._couplings = [self._coupling(gears) for gears in sketch.gears]

    # What the bodies are.

    def _marks(self) -> None:
        """Give a wheel that has its axis alone a second point, which shows how it is turned."""
        for gears in self.sketch.gears:
            distance = self.sketch.distance(*gears.axes)
            for link, axis, share in ((gears.follower, 0, 1), (gears.leader, 1, abs(gears.ratio))):
                body = self._bodies.of(link)
                if body in self._points and body != GROUND and len(self._points[body]) == 1:
                    x, y = self._places[gears.axes[axis]]
                    mark = f"{body}_mark"
                    self._places[mark] = x + 0.8 * distance * share / (1 + abs(gears.ratio)), y
                    self._points[body].append(mark)
                    self.sketch.choices.append(f"{mark!r} is a point on wheel {body!r}, which shows how it is turned")

    def _forces(self) -> list[tuple[str, str, tuple[float, float], bool]]:
        """Point, body, vector and kind of each force; the body gets a point where it acts."""
        loads = []
        for force in self.sketch.forces:
            body = self._bodies.of(force.link)
            if body == GROUND or body not in self._points:
                self.sketch.omitted.append(f"force {force.name!r}, which acts on what does not move")
                continue
            point = next((name for name in self._points[body] if self._places[name] == force.place), None)
            if point is None:
                point = force.name
                while point in self._places:
                    point += "_"
                self._places[point] = force.place
                self._points[body].append(point)
            loads.append((point, body, force.vector, force.local))
        return loads

    def _frame(self, body: str) -> tuple[float, float, float]:
        """Origin and angle of a body's frame; of a link with several points it leads from the first to another."""
        if body == GROUND:
            return 0.0, 0.0, 0.0
        (x, y), *others = (self._places[point] for point in self._points[body])
        far = next(((u, v) for u, v in others if (u, v) != (x, y)), (x + 1, y))
        return x, y, math.atan2(far[1] - y, far[0] - x)

    def _local(self, body: str, x: float, y: float) -> str:
        ox, oy, angle = self._frames[body]
        turned = complex(x - ox, y - oy) * complex(math.cos(angle), -math.sin(angle))
        return _pair((turned.real, turned.imag))

    def _point(self, name: str) -> str:
        return self._names.make("point", name)

    def _link(self, body: str) -> str:
        return "ground" if body == GROUND else self._names.make("link", body)

    # Parts of the mechanism.

    def _slides(self) -> dict[str, str]:
        """Slides and slots as joints of the study, by their names in the file."""
        joints = {}
        for name, slide in self.sketch.slides.items():
            text = self._slide(name, slide)
            if text is not None:
                joints[name] = text
        return joints

    def _slide(self, name: str, slide: Slide) -> str | None:
        guide = self._bodies.of(slide.guide)
        riders = list(dict.fromkeys(self._bodies.of(link) for link in slide.riders))
        carried = [body for body in self._points if slide.point in self._points[body] and body != guide]
        if guide not in self._points or not carried or guide in riders:
            self.sketch.omitted.append(f"slide {name!r}, which carries no link or belongs to none")
            return None
        through = ", ".join(map(self._point, slide.through))
        parts = [f"through: {through}" if len(slide.through) == 1 else f"through: [{through}]"]
        if len(slide.through) == 1:
            parts.append(f"direction: {degrees(slide.direction - self._frames[guide][2])}")
        parts.append(f"point: {self._point(slide.point)}")
        if not riders:
            return f"{{slot: {self._link(guide)}, {', '.join(parts)}}}"
        angle = degrees(self._frames[riders[0]][2] - self._direction(slide))
        parts.append(f"angle: {angle}")
        return f"{{prismatic: [{self._link(guide)}, {self._link(riders[0])}], {', '.join(parts)}}}"

    def _direction(self, slide: Slide) -> float:
        if len(slide.through) == 1:
            return slide.direction
        (x, y), (u, v) = (self._places[point] for point in slide.through)
        return math.atan2(v - y, u - x)

    def _slid(self, slide: Slide) -> float:
        """How far along its line the point of a slide is in the sketch."""
        (x, y), (u, v), angle = self._places[slide.through[0]], self._places[slide.point], self._direction(slide)
        return (u - x) * math.cos(angle) + (v - y) * math.sin(angle)

    def _drives(self) -> dict[str, Drive]:
        drives = {}
        for drive in self.sketch.drives:
            if drive.kind == "slide":
                if drive.of not in self._joints:
                    raise StudyError(f"the input {drive.of!r} moves a slide that carries no link")
                drives[self._names.make("slide", drive.of)] = drive
                continue
            body = self._bodies.of(drive.of)
            if body == GROUND or body not in self._points:
                raise StudyError(f"the input moves link {drive.of!r}, which is part of the ground or joined to nothing")
            drives[self._link(body)] = drive
        return drives

    def _drive_text(self, name: str, drive: Drive) -> str:
        base = GROUND if drive.kind != "angle" else self._bodies.of(drive.base)
        return f"{name}: {{{drive.kind}: {name}{'' if base == GROUND else f', from: {self._link(base)}'}}}"

    def start(self, name: str) -> float:
        """Value of a drive in the sketch, in degrees or the unit of length."""
        drive = self.drives[name]
        if drive.kind == "slide":
            return self._slid(self.sketch.slides[drive.of])
        if drive.kind == "length":
            return self.sketch.distance(*self.sketch.links[drive.of].points)
        turn = self._frames[self._bodies.of(drive.of)][2] - self._frames[self._bodies.of(drive.base)][2]
        return math.degrees(math.remainder(turn, 2 * math.pi))

    def span(self, name: str) -> Span:
        """Where a drive may go: through a turn, or where the file says it goes."""
        drive, start = self.drives[name], self.start(name)
        if drive.span is not None:
            factor = math.degrees(1) if drive.kind == "angle" else 1.0
            return factor * drive.span[0], factor * drive.span[1]
        if drive.kind == "angle":
            return start, start + 360
        if drive.kind == "slide" and len(through := self.sketch.slides[drive.of].through) == 2:
            return 0.0, self.sketch.distance(*through)
        reach = self.sketch.size()
        return (max(start - reach, start / 10) if drive.kind == "length" else start - reach), start + reach

    def _coupling(self, gears: Gears) -> tuple[str, str]:
        """Name and text of the coupling of two wheels."""
        follower, leader, ratio = self._bodies.of(gears.follower), self._bodies.of(gears.leader), gears.ratio
        if follower == GROUND or (leader != GROUND and self._driven(follower) and not self._driven(leader)):
            follower, leader, ratio = leader, follower, 1 / ratio
            radius = None if gears.radius is None else gears.radius / abs(gears.ratio)
        else:
            radius = gears.radius
        carriers = [
            body for body, points in self._points.items()
            if body not in (follower, leader) and {*gears.axes} <= {*points}
        ]  # fmt: skip
        if {*gears.axes} <= {*self._points[GROUND]}:
            carriers = [GROUND]
        if follower == GROUND or not carriers:
            raise StudyError(f"wheels {gears.follower!r} and {gears.leader!r} have no link that holds both axes")
        arm = carriers[0]
        name = self._names.make("coupling", f"{self._link(follower)}_{'belt' if gears.belt else 'mesh'}")
        wheels = ", wheels: belt" if gears.belt else ""
        wheels += f", radius: {digits(radius)}" if gears.belt and radius is not None else ""
        set_ = f"set: {self._link(follower)}"
        if arm == GROUND:
            return name, f"{{{set_}, of: {self._link(leader)}, ratio: {digits(ratio)}{wheels}}}"
        turn, lead, carried = (self._frames[body][2] for body in (follower, leader, arm))
        phase = degrees(math.remainder(turn - carried - ratio * (lead - carried), 2 * math.pi))
        carry = f"({digits(1 - ratio)})*{self._link(arm)}.angle"
        led = "" if leader == GROUND else f" + ({digits(ratio)})*{self._link(leader)}.angle"
        return name, f'{{{set_}, to: "{carry}{led} + ({phase})"{wheels}}}'

    def _driven(self, body: str) -> bool:
        return any(drive.kind == "angle" and self._bodies.of(drive.of) == body for drive in self.drives.values())

    # The text.

    def text(self, source: str, spans: Mapping[str, Span], remarks: Sequence[str] = ()) -> str:
        """The study, with what its drives go through."""
        mechanism, kinematics = self._mechanism(), self._kinematics(spans)
        sketch = self.sketch
        lines = [f"# Imported from {sketch.tool}: {source}"]
        lines += _listed("What became what:", [*sketch.choices, *self._names.changed(), *remarks])
        lines += _listed("What the file has and this study does not:", sketch.omitted)
        name = printable(cut(sketch.name)) or f"Mechanism from {sketch.tool}"
        units = ", ".join(f"{kind}: {unit}" for kind, unit in sketch.units.items())
        lines += [f"name: {json.dumps(name, ensure_ascii=False)}", f"units: {{{units}}}", ""]
        lines += [*mechanism, "", *kinematics, *self._dynamics()]
        return "\n".join(lines) + "\n"

    def _mechanism(self) -> list[str]:
        lines = ["mechanism:", "  links:"]
        for body in self._points:
            lines.append(f"    {self._link(body)}: {self._link_text(body)}")
        joints = [f"    {self._names.make('slide', name)}: {text}" for name, text in self._joints.items()]
        lines += ["  joints:", *joints] if joints else []
        drives = ", ".join(self._drive_text(name, drive) for name, drive in self.drives.items())
        lines.append(f"  drives: {{{drives}}}")
        lines += ["  couplings:", *(f"    {name}: {text}" for name, text in self._couplings)] if self._couplings else []
        fixed = {*self._points[GROUND]}
        moving = [p for p in dict.fromkeys(p for body in self._moving for p in self._points[body]) if p not in fixed]
        lines += ["  sketch:", *(f"    {self._point(p)}: {_pair(self._places[p])}" for p in moving)]
        return lines + self._limits()

    def _link_text(self, body: str) -> str:
        points = self._points[body]
        if body == GROUND:
            return "{" + ", ".join(f"{self._point(p)}: {_pair(self._places[p])}" for p in points) + "}"
        link = self.sketch.links.get(body)
        first = points[0]
        second = next((p for p in points[1:] if self._places[p] != self._places[first]), None)
        parts = []
        if second is not None:
            parts = [f"from: {self._point(first)}", f"to: {self._point(second)}"]
            (x, y), (u, v) = self._places[first], self._places[second]
            telescopic = link is not None and link.telescopic
            parts.append("telescopic: true" if telescopic else f"length: {digits(math.hypot(u - x, v - y))}")
        rest = [p for p in points if second is None or p not in (first, second)]
        if rest:
            places = ", ".join(f"{self._point(p)}: {self._local(body, *self._places[p])}" for p in rest)
            parts.append(f"points: {{{places}}}")
        return "{" + ", ".join(parts + (self._mass(body) if self.sketch.dynamic else [])) + "}"

    def _mass(self, body: str) -> list[str]:
        """Mass, centre and moment of inertia of a body's links together; inertias count about the common centre."""
        links = [self.sketch.links[name] for name in self._bodies.links(body)]
        heavy = [(link.mass, link.center, link.inertia or 0.0) for link in links if link.mass and link.center]
        mass = sum(m for m, _, _ in heavy)
        if not mass:
            return []
        x, y = (sum(m * c[k] for m, c, _ in heavy) / mass for k in (0, 1))
        parts = [f"mass: {digits(mass)}", f"center: {self._local(body, x, y)}"]
        if len(heavy) > 1:
            self.sketch.omitted.append(f"the moment of inertia of {body!r}, which several links are together")
        elif heavy[0][2]:
            parts.append(f"inertia: {digits(heavy[0][2])} {self.sketch.inertia_unit}")
        return parts

    def _limits(self) -> list[str]:
        limits, measures = [], []
        for name, slide in self.sketch.slides.items():
            if slide.limited and name in self._joints:
                joint = self._names.make("slide", name)
                measure = self._names.make("measure", f"{joint}_travel")
                measures.append(f"    {measure}: {joint}.slide")
                high = digits(self.sketch.distance(*slide.through))
                limits.append(f"    - {{measure: {measure}, min: 0, max: {high}}}")
        return ["  measures:", *measures, "  limits:", *limits] if limits else []

    def _kinematics(self, spans: Mapping[str, Span]) -> list[str]:
        lines = ["kinematics:"]
        if len(self.drives) == 1:
            (name, (low, high)), drive = next(iter(spans.items())), next(iter(self.drives.values()))
            lines.append(f"  sweep: {{{name}: {{from: {digits(low)}, to: {digits(high)}, number: {STEPS + 1}}}}}")
            if drive.speed:
                lines.append(f"  rates: {{{name}: {self._rate(drive)}}}")
        else:
            lines += self._motion()
        on_bodies = {point for body in self._moving for point in self._points[body]}
        traced = [self._point(name) for name, point in self.sketch.points.items() if point.traced and name in on_bodies]
        lines += [f"  outputs: [{', '.join(traced)}]"] if traced else []
        return lines

    def _rate(self, drive: Drive) -> str:
        speed = drive.speed or 0.0
        if drive.kind != "angle":
            return f"{digits(speed)} {self._length_unit()}/s".replace(" /s", "")
        turns = speed * 30 / math.pi
        return f"{digits(turns)} rpm" if abs(turns - round(turns, 6)) < 1e-12 else f"{digits(speed)} rad/s"

    def _length_unit(self) -> str:
        unit = self.sketch.units["length"]
        return "" if unit == "dimensionless" else unit

    def _motion(self) -> list[str]:
        """All drives at their speeds, from the sketch on; those to and fro go there and back."""
        moving = {name: drive for name, drive in self.drives.items() if drive.speed and not drive.held}
        if not moving:
            return [
                "  poses:",
                f"    - {{{', '.join(f'{name}: {digits(self.start(name))}' for name in self.drives)}}}",
            ]
        periods = {name: self._period(name) for name in moving}
        duration = _common(list(periods.values()))
        lines = ["  motion:"]
        for name, drive in self.drives.items():
            start = digits(self.start(name))
            if name not in moving:
                lines.append(f"    {name}: {start}")
                continue
            if drive.span is None:
                factor = math.degrees(1) if drive.kind == "angle" else 1.0
                way = factor * (drive.speed or 0.0) * duration
                end = digits(self.start(name) + way)
                move = f"{{from: {start}, to: {end}, time: {digits(duration)}, law: constant}}"
                lines += [f"    {name}:", f"      - {move}"]
                continue
            low, high = self.span(name)
            first, second = (high, low) if abs(self.start(name) - low) <= abs(self.start(name) - high) else (low, high)
            half = digits(periods[name] / 2)
            there = f"to: {digits(first)}, time: {half}, law: constant"
            back = f"{{to: {digits(second)}, time: {half}, law: constant}}"
            rounds = max(1, round(duration / periods[name]))
            moves = [f"{{from: {digits(second)}, {there}}}", back, *([f"{{{there}}}", back] * (rounds - 1))]
            lines += [f"    {name}:", *(f"      - {move}" for move in moves)]
        turns = max(duration / period for period in periods.values())
        return [*lines, f"  instants: {max(_INSTANTS, min(3601, round(_EACH_TURN * turns)))}"]

    def _period(self, name: str) -> float:
        drive = self.drives[name]
        low, high = self.span(name)
        way = abs(high - low) * (2 if drive.span is not None else 1)
        return way / abs((drive.speed or 0.0) * (math.degrees(1) if drive.kind == "angle" else 1.0))

    def _dynamics(self) -> list[str]:
        sketch = self.sketch
        if not sketch.dynamic:
            return []
        lines = ["", "dynamics:"]
        lines += ["  gravity: [0, -9.81 m/s^2]"] if sketch.gravity else []
        if self._loads:
            lines.append("  loads:")
        for point, body, (fx, fy), local in self._loads:
            turned = complex(fx, fy)
            if local:
                turned *= complex(math.cos(self._frames[body][2]), -math.sin(self._frames[body][2]))
            frame = f", in: {self._link(body)}" if local else ""
            lines.append(f"    - {{at: {self._point(point)}, force: {_pair((turned.real, turned.imag))}{frame}}}")
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
    """Comment lines with a title and an entry each."""
    return ["#", f"# {title}", *(f"# - {cut(printable(entry), _WIDTH)}" for entry in entries)] if entries else []
