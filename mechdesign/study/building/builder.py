"""Names, places, links and the sketch of a validated mechanism section, from which its description is built."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping
from typing import Any

from mechdesign.ground.errors import suggestion
from mechdesign.ground.expressions import Expression
from mechdesign.mechanism.algebra import fit
from mechdesign.mechanism.elements.couplings import MEASURED
from mechdesign.mechanism.elements.declared import Physical, Quantity, Term
from mechdesign.mechanism.elements.links import Link, Mass
from mechdesign.mechanism.graph import GROUND, rod_of
from mechdesign.mechanism.model import Place
from mechdesign.study.building import section as models
from mechdesign.study.building.elements import Keys, Written
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import Context
from mechdesign.study.text.reporter import Reporter
from mechdesign.study.text.units import Amount, kind_of

ROOT: KeyPath = ("mechanism",)


# Sections of which the names of places begin with the section, and keys that these names leave out.
_PREFIXED, _BETWEEN = ("limits", "friction", "plates"), {"links": "points", "couplings": "cam"}


def place_name(path: KeyPath) -> str:
    """Name of the number at a path of the mechanism, which may go through a short form."""
    kind, *rest = path
    if kind == "links" and rest[1:] == [2]:
        return f"{rest[0]}.length"
    if rest[:1] == ["pins"]:
        return f"plates.{rest[1]}.pin"
    if rest[1:2] == [_BETWEEN.get(str(kind))]:
        del rest[1]
    if len(rest) > 2 and rest[-1] in (0, 1):
        rest[-1] = "xy"[int(rest[-1])]
    return ".".join(map(str, [kind, *rest] if kind in _PREFIXED or not rest else rest))


class Builder:
    """Builds the parts of a description; mistakes go to the reporter, and wrong parts are left out."""

    def __init__(
        self, section: models.MechanismSection, context: Context, reporter: Reporter, folder: Folder
    ) -> None:  # fmt: skip
        self.section = section
        self.parameter_values = context.parameters
        self.quantities = context.quantities
        self.units = context.units
        self.reporter = reporter
        self.folder = folder
        self.places: dict[str, Place] = {}
        self.formulas: dict[str, Expression] = {}
        self.measured: set[str] = set()
        self.links: dict[str, Link] = {}
        self.masses: dict[str, Mass] = {}
        self.sketch = {name: complex(x, y) for name, (x, y) in section.sketch.items()}

    def parameters(self, formulas: Mapping[str, Expression]) -> Parameters:
        """Parameters, of which some have formulas, with the places that depend on them."""
        factors = {
            name: self.units.angle_factor if place.quantity == "angle" else 1.0 for name, place in self.places.items()
        }
        kinds = {name: kind_of(text) for name, text in self.quantities.items()}
        drawn = [Amount.of(number).expression for point in self.section.sketch.values() for number in point]
        return Parameters(
            dict(self.parameter_values), dict(formulas), dict(self.formulas), factors, frozenset(self.measured),
            {name: kind for name, kind in kinds.items() if kind is not None},
            frozenset(name for expression in drawn if expression is not None for name in expression.names),
        )  # fmt: skip

    def report(self, path: Iterable[str | int], message: str, *, at_key: bool = False) -> None:
        """Note a problem at a path below ``mechanism``."""
        self.reporter.report((*ROOT, *path), message, at_key=at_key)

    def place(
        self, path: KeyPath, value: float, quantity: Quantity | Physical = "length", *, measured: bool = False,
        in_coupling: bool = False,
    ) -> str:  # fmt: skip
        """Register a number of the geometry, perhaps measured from the sketch, and return its name.

        It stands at a path below ``mechanism``; of what is no dimension of a part this is a name alone.
        """
        name = place_name(path)
        factor = self.units.angle_factor if quantity == "angle" else 1.0
        number = Amount.of(value)
        self.places[name] = Place(
            name, value * factor, quantity, path if len(path) > 1 else (), number.least, number.exclusive, in_coupling
        )
        if number.expression is not None:
            self.formulas[name] = number.expression
        if measured:
            self.measured.add(name)
        return name

    def parameters_in(self, expression: Expression) -> None:
        """Register the parameters that an expression of coordinates names."""
        for name in expression.names & self.parameter_values.keys():
            self.place((MEASURED + name,), Amount(self.parameter_values[name], "", Expression.parse(name)), "none")

    def numbers(self, given: Keys, *path: str, turning: bool = False) -> dict[str, Term]:
        """Register the numbers of an element that are given as places of the geometry; their names by their keys."""
        return {
            key: self.place((*path, key), value, size.kind_of(turning=turning)) for key, size, value in given.numbers()
        }

    def check_name(self, name: str, names: Iterable[str], noun: str, path: Iterable[str | int]) -> bool:
        """Whether a name is among the names; if not, report it with the nearest one (a missing ground only once)."""
        if name == GROUND and GROUND not in self.section.links:
            return False
        return self.reporter.check_name(name, names, noun, (*ROOT, *path))

    def check_named(self, noun: str, names: Iterable[str], path: KeyPath) -> bool:
        """Whether all names of a list are known links, points, drives or measures; each that is not is noted.

        `noun` says what they name, or the quantity that they give: an angle is that of links, a distance of points.
        """
        noun = {"angle": "link", "distance": "point"}.get(noun, noun)
        points = [*self.section.owners, *self.section.ends]
        candidates: Iterable[str] = points if noun == "point" else getattr(self.section, f"{noun}s")
        # No short circuit: every mistake is reported.
        right = [self.check_name(name, candidates, noun, (*path, k)) for k, name in enumerate(names)]
        return all(right)

    def check_distinct(self) -> None:
        """Names are distinct, and there is a ground."""
        section = self.section
        if GROUND not in section.links:
            fixed = [name for name, link in section.links.items() if link.from_ is None]
            cure = f"rename the link that does not move (is it {fixed[0]!r}?)" if fixed else "add 'ground: {O: [0, 0]}'"
            self.report(("links",), f"there is no 'ground', the fixed link whose frame is the world; {cure}")
        kinds: dict[str, str] = {}
        own: dict[str, Iterable[str]] = {"parameter": self.parameter_values, "point": section.owners}
        for kind in ("parameter", "link", "point", "joint", "measure", "spring", "coupling"):
            for name in own[kind] if kind in own else getattr(section, f"{kind}s"):
                path = self._where(name) if kind == "point" else (f"{kind}s", name)
                if kinds.setdefault(name, kind) != kind:
                    message = f"{name!r} is the name of a {kinds[name]} already; names are distinct"
                    self.report(path, message, at_key=True)
        for name, drive in section.drives.items():
            target = name if drive is None else drive.angle or drive.length or drive.slide
            if name in kinds and name != target:
                message = (
                    f"{name!r} is the name of a {kinds[name]} already; a drive may only bear that of what it drives"
                )
                self.report(("drives", name), message, at_key=True)

    def _where(self, point: str) -> KeyPath:
        link = self.section.owners[point][0]
        section = self.section.links[link]
        end = {section.from_: "from", section.to: "to"}.get(point)
        return ("links", link, end) if end else ("links", link, "points", point)

    def check_sketch(self) -> None:
        """Points of the sketch are points of links."""
        for name in self.section.sketch:
            if name not in self.section.owners:
                hint = suggestion(name, self.section.owners)
                self.report(("sketch", name), f"no link has a point {name!r}{hint}", at_key=True)

    def build_links(self) -> None:
        """Links with their points, and places for all their numbers."""
        order = [GROUND] * (GROUND in self.section.links) + self.section.moving
        for name in order:
            self.links[name] = self._link(name, self.section.links[name])
            self._weigh(name, self.section.links[name])
            if name == GROUND:
                # Points of the ground need not be in the sketch; if they are, the ground's own numbers count.
                for point, (x, y) in self.links[name].points.items():
                    self.sketch[point] = complex(self.nominal(x), self.nominal(y))

    def _weigh(self, name: str, section: Written[Link]) -> None:
        """Masses of a link's bodies, with places for their numbers."""
        path: KeyPath = ("links", name)
        bodies: list[tuple[str, KeyPath, Any]] = [(name, path, section), (rod_of(name), (*path, "rod"), section.rod)]
        for body, path, given in bodies:
            if given is None or given.mass is None:
                continue
            if name == GROUND:
                self.report(("links", name, "mass"), "the ground does not move: its mass changes nothing; leave it out")
                continue
            center = None
            if given.center is not None:
                x, y = (self.place((*path, "center", axis), at) for axis, at in enumerate(given.center))
                center = x, y
            mass, points = self.place((*path, "mass"), given.mass, "mass"), self._joined(name, section, body)
            if given.inertia == "rod":
                if len(points) != 2:
                    message = f"a rod runs between two joints, and {name!r} has {len(points)}; give the inertia"
                    self.report(("links", name, "inertia"), message)
                self.masses[body] = Mass(mass, center, points=points, slender=True)
                continue
            moment = 0.0 if given.inertia is None else given.inertia
            inertia = self.place((*path, "inertia"), moment, "moment_of_inertia")
            self.masses[body] = Mass(mass, center, inertia, points, left_out=given.inertia is None)

    def _joined(self, name: str, section: Written[Link], body: str) -> tuple[str, ...]:
        """The joints of a body, or where it has a single one its ends, or all its points."""
        if body != name:
            return (section.to or "",)
        own = [point for point in self.section.points_of(name) if not (section.telescopic and point == section.to)]
        joints = [point for point in own if point in self.section.joined]
        ends = [] if section.telescopic or section.from_ is None else own[:2]
        return tuple(next((some for some in (joints, ends) if len(some) > 1), own))

    def nominal(self, term: Term) -> float:
        """Nominal value of a term (angles in radians)."""
        return self.places[term].nominal if isinstance(term, str) else term

    def _link(self, name: str, section: Written[Link]) -> Link:
        ends, points = None, {}
        # The ground's frame is the world: without a length its two points stay where they are drawn.
        drawn = name == GROUND and section.length is None and not section.telescopic
        if section.from_ is not None and section.to is not None and not drawn:
            ends = (section.from_, section.to)
            points = self._ends(name, section, ends)
        own = [*section.points] if ends else self.section.points_of(name)
        given = {point: place for point, place in section.points.items() if place is not None}
        left_out = [point for point in own if point not in given]
        local = self._measured(name, left_out, given, ends) if left_out else {}
        for point in own:
            at = local.get(point, 0j)
            x, y = given.get(point, (at.real, at.imag))
            path: KeyPath = ("links", name, "points", point)
            terms = [self.place((*path, axis), value, measured=point not in given) for axis, value in enumerate((x, y))]
            points[point] = (terms[0], terms[1])
        start, end = ends or (None, None)
        return Link(name, start, end, telescopic=section.telescopic, points=points)

    def _ends(self, name: str, section: Written[Link], ends: tuple[str, str]) -> dict[str, tuple[Term, Term]]:
        """The ends of a binary link in its frame: at its origin and on its x axis, where it is not telescopic."""
        start, end = ends
        points: dict[str, tuple[Term, Term]] = {start: (0.0, 0.0)}
        if section.telescopic:
            if name == GROUND:
                self.report(("links", name), "the ground cannot be telescopic; a leg is a link of its own")
            return points
        length: float = section.length or 1.0
        if section.length is None and (drawn := self._drawn([start, end], ("links", name), "its length")):
            length = abs(drawn[1] - drawn[0])
            if length == 0.0:
                self.report(
                    ("links", name),
                    f"{start!r} and {end!r} are at one place in the sketch: no length to measure; give the length",
                )
                length = 1.0
        number = Amount.of(length)
        number.least, number.exclusive = 0.0, True
        points[end] = (self.place(("links", name, "length"), number, measured=section.length is None), 0.0)
        return points

    def _measured(
        self, name: str, measured: list[str], given: Mapping[str, tuple[Amount, Amount]], ends: tuple[str, str] | None
    ) -> dict[str, complex]:
        """Local coordinates of points without numbers, measured in the sketch.

        The ground's frame is the world; that of a binary link has its origin at the first end and its x axis towards
        the second, and one without given points so by its first two; one with given points is laid on the drawing by
        them.
        """
        path: KeyPath = ("links", name)
        free = not ends and name != GROUND
        if free and len(given) == 1:
            self.report(path, "one given point does not fix the link's frame on the sketch; give two, or none")
            return {}
        if free and not given and len(measured) < 2:
            return dict.fromkeys(measured, 0j)
        anchors = [*(ends or (given if free else ()))]
        drawn = self._drawn([*anchors, *measured], path, "the place of its points")
        if drawn is None:
            return {}
        places = drawn[len(anchors) :]
        start, turn, centre = 0j, 1 + 0j, 0j
        if free and given:
            local = [complex(x, y) for x, y in given.values()]
            start, turn, centre = sum(drawn[: len(local)]) / len(local), rotation(local, drawn), sum(local) / len(local)
        elif free or ends:
            if drawn[0] == drawn[1]:
                first, second = [*anchors, *measured][:2]
                self.report(
                    path, f"{first!r} and {second!r} are at one place in the sketch: no x axis; draw them apart"
                )
                return {}
            start, turn = drawn[0], (drawn[1] - drawn[0]) / abs(drawn[1] - drawn[0])
        coordinates = {point: (at - start) / turn + centre for point, at in zip(measured, places, strict=True)}
        if free and not given:
            # Without this, rounding would leave the second point off its axis.
            coordinates[measured[1]] = complex(coordinates[measured[1]].real, 0.0)
        return coordinates

    def _drawn(self, points: list[str], path: KeyPath, noun: str) -> list[complex] | None:
        missing = [point for point in points if point not in self.sketch]
        if missing:
            names = ", ".join(repr(point) for point in missing)
            self.report(path, f"{noun} is left out and so measured from the sketch, which lacks {names}", at_key=True)
            return None
        return [self.sketch[point] for point in points]

    def link_direction(self, name: str) -> float | None:
        """Angle of a link's x axis in the sketch (radians), None if too few of its points are drawn."""
        if name == GROUND:
            return 0.0
        link = self.links[name]
        if link.telescopic and link.ends is not None:
            a, b = (self.sketch.get(end) for end in link.ends)
            return None if a is None or b is None or a == b else cmath.phase(b - a)
        drawn = [point for point in link.points if point in self.sketch]
        local = [complex(*(self.nominal(term) for term in link.points[point])) for point in drawn]
        if len(drawn) < 2 or len(set(local)) < 2:
            return None
        turn = rotation(local, [self.sketch[point] for point in drawn])
        return cmath.phase(turn)


def rotation(local: list[complex], drawn: list[complex]) -> complex:
    """Unit complex number that turns local vectors best onto the first of the drawn ones (least squares)."""
    along = fit(local, drawn[: len(local)])
    return along / abs(along) if abs(along) > 0 and math.isfinite(abs(along)) else 1 + 0j
