"""A mechanism drawn in an assembled pose: written out as a study, and judged by its own equations.

Everything is kept in the world, so that a layout closes by construction, can be moved, scaled and mirrored, and knows
what the study must give. Its equations are those of body coordinates (x, y and angle of every body, a row for each
constraint): they share nothing with the vector loops of the package.
"""

from __future__ import annotations

import cmath
import copy
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from random import Random

import numpy as np
import yaml

from mechdesign.ground.numerics.arrays import Complexes, Floats

GROUND = "ground"
# The same text, ten times as fast, where PyYAML has its C library.
DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
# ("x" | "y", point), ("angle", body, reference), ("slide" | "length", joint or leg), ("distance", point, point), and
# ("product", point, point): x of the first times y of the second, which a study writes as an expression
Coordinate = tuple[str, ...]
Renaming = Callable[[str], str]


@dataclass
class Body:
    """A link: its frame in the world, its points, and how the study writes it."""

    name: str
    origin: complex
    turn: complex
    points: list[str]
    style: str = "frame"  # frame | binary | pair | measured | measured pair | leg
    to: str = ""  # the far end of a leg


@dataclass
class Guide:
    """A prismatic joint or a slot: a line fixed in `guide`, and the point of `slider` that moves along it."""

    name: str
    kind: str  # prismatic | slot
    guide: str
    slider: str
    through: str  # "" for the origin of the guide's frame
    base: complex
    along: complex
    point: str
    toward: str = ""


@dataclass
class Clamp:
    """Two links fixed to one another at a point."""

    name: str
    first: str
    second: str
    point: str
    told: bool = True


@dataclass
class Follower:
    """A coupling: a coordinate is ``constant + sum(linear * x + wave * sin(x))`` over others, angles in radians."""

    coordinate: Coordinate
    terms: dict[Coordinate, tuple[float, float]]
    constant: float = 0.0


@dataclass
class Layout:
    """Points in the world, links, joints, drives and measures (by name: the coordinate), and couplings."""

    places: dict[str, complex] = field(default_factory=dict)
    bodies: dict[str, Body] = field(default_factory=dict)
    guides: dict[str, Guide] = field(default_factory=dict)
    clamps: dict[str, Clamp] = field(default_factory=dict)
    drives: dict[str, Coordinate] = field(default_factory=dict)
    measures: dict[str, Coordinate] = field(default_factory=dict)
    couplings: dict[str, Follower] = field(default_factory=dict)
    undrawn: set[str] = field(default_factory=set)
    unit: str = "deg"

    # What it is.

    def owners(self, point: str) -> list[str]:
        return [body.name for body in self.bodies.values() if point in body.points or point == body.to]

    def holder(self, body: str, point: str) -> str:
        """The rigid body of a link that carries a point: a leg's far end is on its rod."""
        return f"{body}:rod" if point and point == self.bodies[body].to else body

    def rigid(self) -> list[str]:
        """Every moving rigid body."""
        moving = [name for name in self.bodies if name != GROUND]
        return moving + [f"{name}:rod" for name in moving if self.bodies[name].to]

    def classes(self) -> list[set[str]]:
        """Links that turn together."""
        sets = [{name} for name in self.bodies]
        ties = [{g.guide, g.slider} for g in self.guides.values() if g.kind == "prismatic"]
        for tie in [*ties, *({c.first, c.second} for c in self.clamps.values())]:
            joined = [s for s in sets if s & tie]
            sets = [s for s in sets if not s & tie] + [set().union(*joined)]
        return sets

    def coordinates(self) -> list[Coordinate]:
        """Everything that may be given or driven, but for measures."""
        found: list[Coordinate] = []
        for point in self.places:
            if GROUND not in self.owners(point):
                found += [("x", point), ("y", point)]
        return found + self.drivable()

    def drivable(self) -> list[Coordinate]:
        """Angles, absolute and between links, slides and legs."""
        names = list(self.bodies)
        found: list[Coordinate] = [("angle", b, a) for a in names for b in names if b not in (a, GROUND)]
        found += [("slide", guide) for guide in self.guides]
        return found + [("length", body.name) for body in self.bodies.values() if body.to]

    def value(self, coordinate: Coordinate) -> float:
        """Value of a coordinate in the pose drawn, angles in radians."""
        kind, name = coordinate[:2]
        if kind in ("x", "y"):
            return self.places[name].real if kind == "x" else self.places[name].imag
        if kind == "angle":
            return cmath.phase(self.bodies[name].turn / self.bodies[coordinate[2]].turn)
        if kind == "slide":
            guide = self.guides[name]
            return ((self.places[guide.point] - guide.base) * guide.along.conjugate()).real
        if kind == "length":
            body = self.bodies[name]
            return abs(self.places[body.to] - self.places[body.points[0]])
        one, two = self.places[name], self.places[coordinate[2]]
        return one.real * two.imag if kind == "product" else abs(two - one)

    # Its equations.

    def _move(self, body: str, at: complex, columns: list[str]) -> Complexes:
        """Velocity of the place `at` of a body, by the rates (x, y of its frame's origin, angle) of all bodies."""
        row = np.zeros(3 * len(columns), dtype=complex)
        if body in columns:
            k = 3 * columns.index(body)
            row[k : k + 3] = 1, 1j, 1j * (at - self.bodies[body.removesuffix(":rod")].origin)
        return row

    def _spin(self, body: str, columns: list[str]) -> Floats:
        row = np.zeros(3 * len(columns))
        if body in columns:
            row[3 * columns.index(body) + 2] = 1
        return row

    def _sliding(self) -> list[tuple[str, complex, complex, str, complex, bool, tuple[str, str]]]:
        """Every line: its body, a place on it, its direction; the body that slides, its point; whether it may turn.

        Last the link and the point whose pin it is that slides; none where it is the body itself.
        """
        lines = [
            (
                self.holder(g.guide, g.through), g.base, g.along,
                self.holder(g.slider, g.point), self.places[g.point], g.kind == "slot",
                (g.slider, g.point) if g.kind == "slot" else ("", ""),
            )
            for g in self.guides.values()
        ]  # fmt: skip
        for body in self.bodies.values():
            if body.to:
                at = self.places[body.to]
                lines.append((body.name, body.origin, body.turn, f"{body.name}:rod", at, False, ("", "")))
        return lines

    def _gaps(self, columns: list[str], off: Mapping[tuple[str, str], complex]) -> Iterator[tuple[Floats, float]]:
        """Constraints on the rates of the bodies `columns`: a row each, and what it comes to where pins are moved.

        `off` are pins, by link and point, and how far each goes off its place in that link.
        """
        for point, at in self.places.items():
            first, *others = self.owners(point)
            for other in others:
                row = self._move(self.holder(other, point), at, columns)
                row -= self._move(self.holder(first, point), at, columns)
                gap = off.get((first, point), 0j) - off.get((other, point), 0j)
                yield row.real, gap.real
                yield row.imag, gap.imag
        for guide, base, along, slider, at, turns, pin in self._sliding():
            relative = self._move(slider, at, columns) - self._move(guide, base, columns)
            relative -= self._spin(guide, columns) * 1j * (at - base)
            yield (along.conjugate() * relative).imag, -(along.conjugate() * off.get(pin, 0j)).imag
            if not turns:
                yield self._spin(slider, columns) - self._spin(guide, columns), 0.0
        for clamp in self.clamps.values():
            yield self._spin(clamp.second, columns) - self._spin(clamp.first, columns), 0.0
        for coupling in self.couplings.values():
            row = self.rate(coupling.coordinate, columns)
            for coordinate, (linear, wave) in coupling.terms.items():
                row = row - (linear + wave * math.cos(self.value(coordinate))) * self.rate(coordinate, columns)
            yield row, 0.0

    def equations(self, columns: list[str]) -> Floats:
        """Constraints, a row each, on the rates of the bodies `columns`; only rows that they take part in."""
        rows = [row for row, _ in self._gaps(columns, {}) if row.any()]
        return np.array(rows).reshape(-1, 3 * len(columns))

    def displaced(self, given: list[Coordinate], link: str, point: str, offset: complex) -> dict[str, complex]:
        """How far each point of each link goes, as ``link.point``, where the pin at one lies off its place in a link.

        The pin stays in the other links, and so on the line of a slot; what is given is held.
        """
        columns, pin = self.rigid(), (link, point)
        gaps = list(self._gaps(columns, {pin: offset}))
        for coordinate in given:
            guide = self.guides.get(coordinate[1]) if coordinate[0] == "slide" else None
            slot = guide is not None and guide.kind == "slot" and (guide.slider, guide.point) == pin
            gap = -(guide.along.conjugate() * offset).real if slot else 0.0
            gaps.append((self.rate(coordinate, columns), gap))
        rows, right = (np.array(part) for part in zip(*gaps, strict=True))
        moving = np.linalg.lstsq(rows, right, rcond=None)[0]
        return {
            f"{owner}.{place}": complex(self._move(self.holder(owner, place), at, columns) @ moving)
            for place, at in self.places.items()
            for owner in self.owners(place)
        }

    def rate(self, coordinate: Coordinate, columns: list[str]) -> Floats:
        """Derivative of a coordinate by the rates of the bodies."""
        kind, name = coordinate[:2]
        if kind == "angle":
            return self._spin(name, columns) - self._spin(coordinate[2], columns)
        if kind in ("slide", "length"):
            if kind == "slide":
                g = self.guides[name]
                ends = (self.holder(g.guide, g.through), g.base, g.along, self.holder(g.slider, g.point), g.point)
            else:
                body = self.bodies[name]
                ends = (name, body.origin, body.turn, f"{name}:rod", body.to)
            guide, base, along, slider, point = ends
            relative = self._move(slider, self.places[point], columns) - self._move(guide, base, columns)
            return (along.conjugate() * relative).real
        moves = [
            self._move(self.holder(self.owners(point)[0], point), self.places[point], columns)
            for point in coordinate[1:]
        ]
        if kind in ("x", "y"):
            return moves[0].real if kind == "x" else moves[0].imag
        one, two = self.places[name], self.places[coordinate[2]]
        if kind == "product":
            return moves[0].real * two.imag + one.real * moves[1].imag
        span = two - one
        return (span.conjugate() * (moves[1] - moves[0])).real / abs(span)

    def system(self, given: list[Coordinate]) -> Floats:
        """Constraints and given coordinates, in rows; square if there are as many as the mobility."""
        columns = self.rigid()
        return np.vstack([self.equations(columns), *(self.rate(c, columns)[None] for c in given)])

    def velocities(self, given: list[Coordinate], rates: list[float], wanted: list[Coordinate]) -> list[float]:
        """Rates of coordinates in the pose drawn, for rates of the given ones."""
        matrix, columns = self.system(given), self.rigid()
        right = np.zeros(len(matrix))
        right[len(right) - len(rates) :] = rates
        moving = np.linalg.solve(matrix, right)
        return [float(self.rate(c, columns) @ moving) for c in wanted]

    # How it is told.

    def moved(self, factor: complex, shift: complex = 0j, *, mirror: bool = False) -> Layout:
        """The same drawing turned and scaled by `factor`, then shifted; mirrored in the x axis before that."""

        def place(z: complex) -> complex:
            return factor * (z.conjugate() if mirror else z) + shift

        def turned(u: complex) -> complex:
            return (u.conjugate() if mirror else u) * factor / abs(factor)

        made = copy.deepcopy(self)
        made.places = {name: place(z) for name, z in self.places.items()}
        for body in made.bodies.values():
            if body.name != GROUND:
                body.origin, body.turn = place(body.origin), turned(body.turn)
        for guide in made.guides.values():
            guide.base, guide.along = place(guide.base), turned(guide.along)
            if guide.guide == GROUND and not guide.through:
                # The world's origin does not move with the drawing.
                guide.through = f"{guide.name}_origin"
                made.places[guide.through] = guide.base
                made.bodies[GROUND].points.append(guide.through)
        return made

    def angle(self, z: complex) -> float:
        """Angle of a vector in the layout's unit."""
        return math.degrees(cmath.phase(z)) if self.unit == "deg" else cmath.phase(z)

    def pose(self, given: dict[str, Coordinate]) -> dict[str, float]:
        """Values of coordinates in the pose drawn, in the study's units."""
        values = {name: self.value(c) for name, c in given.items()}
        return {
            name: math.degrees(v) if given[name][0] == "angle" and self.unit == "deg" else v
            for name, v in values.items()
        }

    def text(self, rng: Random | None = None, names: dict[str, str] | None = None, rough: float = 0.0) -> str:
        """The study: in a shuffled order with `rng`, with other names, on a drawing displaced by up to `rough`."""
        names = names or {}

        def name(old: str) -> str:
            return names.get(old, old)

        def order(items: dict) -> dict:
            pairs = list(items.items())
            if rng is not None:
                rng.shuffle(pairs)
            return {name(key): value for key, value in pairs}

        def displaced(z: complex) -> list[float]:
            if rough and rng is not None:
                z += rough * complex(rng.uniform(-1, 1), rng.uniform(-1, 1))
            return [z.real, z.imag]

        sketch = {
            point: displaced(at)
            for point, at in self.places.items()
            if point not in self.undrawn
            and (GROUND not in self.owners(point) or (self.bodies[GROUND].style == "measured" and not rough))
        }
        joints: dict[str, object] = {g.name: self._guide(g, name) for g in self.guides.values()}
        for clamp in self.clamps.values():
            joints[clamp.name] = {"fixed": [name(clamp.first), name(clamp.second)], "point": name(clamp.point)}
            if clamp.told or rough:
                turn = self.bodies[clamp.second].turn / self.bodies[clamp.first].turn
                joints[clamp.name]["angle"] = self.angle(turn)  # type: ignore[index]
        section: dict[str, object] = {
            "links": order({body.name: self._link(body, name, bool(rough)) for body in self.bodies.values()}),
            "drives": order({drive: _told(c, name) for drive, c in self.drives.items()}),
            "sketch": order(sketch),
        }
        if joints:
            section["joints"] = order(joints)
        if self.couplings:
            section["couplings"] = order({key: self._follower(c, name) for key, c in self.couplings.items()})
        if self.measures:
            section["measures"] = order({key: _measure(c, name) for key, c in self.measures.items()})
        study = {"units": {"angle": self.unit}, "mechanism": section}
        return yaml.dump(study, Dumper=DUMPER, sort_keys=False, default_flow_style=None, width=110)

    def _follower(self, coupling: Follower, name: Renaming) -> dict[str, str]:
        def written(coordinate: Coordinate) -> str:
            return f"{name(coordinate[1])}.{coordinate[0]}"

        def unit(coordinate: Coordinate) -> float:
            return math.degrees(1) if coordinate[0] == "angle" and self.unit == "deg" else 1.0

        own = unit(coupling.coordinate)
        text = repr(coupling.constant * own)
        for coordinate, (linear, wave) in coupling.terms.items():
            text += f" + {linear * own / unit(coordinate)!r}*{written(coordinate)}"
            if wave:
                # An angle's sine knows the study's unit; a length is a number of radians.
                at = written(coordinate)
                at = at if coordinate[0] == "angle" or self.unit == "rad" else f"{math.degrees(1)!r}*{at}"
                text += f" + {wave * own!r}*sin({at})"
        return {"set": written(coupling.coordinate), "to": text, "wheels": "none"}

    def _link(self, body: Body, name: Renaming, rough: bool) -> object:
        local = {point: (self.places[point] - body.origin) / body.turn for point in body.points}
        told = {name(point): [z.real, z.imag] for point, z in local.items()}
        measured = not rough and body.style.startswith("measured")
        if body.name == GROUND or body.style in ("frame", "measured"):
            return {"points": list(told)} if measured else told
        ends = [name(point) for point in ([*body.points[:1], body.to] if body.to else body.points[:2])]
        others = {point: told[point] for point in told if point not in ends}
        if body.to:
            link: dict[str, object] = {"from": ends[0], "to": ends[1], "telescopic": True}
        else:
            length = abs(self.places[body.points[1]] - self.places[body.points[0]])
            if body.style == "pair" and not others:
                return [*ends, length]
            link = {"from": ends[0], "to": ends[1]} | ({} if measured else {"length": length})
        return link | ({"points": others} if others else {})

    def _guide(self, guide: Guide, name: Renaming) -> dict[str, object]:
        line, slider = self.bodies[guide.guide], self.bodies[guide.slider]
        joint: dict[str, object] = {"slot": name(line.name)}
        if guide.kind == "prismatic":
            joint = {"prismatic": [name(line.name), name(slider.name)]}
        if guide.toward:
            joint["through"] = [name(guide.through), name(guide.toward)]
        else:
            if guide.through:
                joint["through"] = name(guide.through)
            if guide.along != line.turn:
                joint["direction"] = self.angle(guide.along / line.turn)
        if guide.kind == "slot" or len(slider.points) > 1 or slider.to:
            joint["point"] = name(guide.point)
        if guide.kind == "prismatic" and slider.turn != guide.along:
            joint["angle"] = self.angle(slider.turn / guide.along)
        return joint


def _told(coordinate: Coordinate, name: Renaming) -> dict[str, str]:
    kind, target = coordinate[:2]
    drive = {kind: name(target)}
    if kind == "angle" and coordinate[2] != GROUND:
        drive["from"] = name(coordinate[2])
    return drive


def _measure(coordinate: Coordinate, name: Renaming) -> object:
    kind, one, two = coordinate
    if kind == "product":
        return f"{name(one)}.x * {name(two)}.y"
    return {"angle": [name(two), name(one)]} if kind == "angle" else {kind: [name(one), name(two)]}
