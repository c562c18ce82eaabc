"""Loads of a study: forces at points, between points, and moments on links, as numbers or expressions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any

from pydantic import Field

from mechdesign.ground.expressions import Expression
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.motion.rules import TIME
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import Context, failure, read_expression, read_number, shown
from mechdesign.study.text.units import Amount

# Ending of a coordinate's name that stands for its velocity in an expression.
VELOCITY = "_velocity"
# Columns of a mechanism with friction, without units.
EFFICIENCIES = ("efficiency", "back_efficiency")

Quantity = Amount | Expression


def read_quantity(raw: Any, context: Context) -> Quantity:
    """A number, or an expression of parameters alone, as an amount; any other expression as it is."""
    if isinstance(raw, str):
        expression = read_expression(raw, context)
        if not expression.names <= context.parameters.keys():
            return expression
    return read_number(raw, context)


def _read_force(raw: Any, context: Context) -> tuple[Quantity, ...]:
    parts = raw if isinstance(raw, list) else [raw]
    if not 1 <= len(parts) <= 2 or (isinstance(raw, list) and len(parts) == 1):
        raise failure(f"a force is [fx, fy], or between two points one number, not {shown(raw)}")
    return tuple(read_quantity(part, context) for part in parts)


_FORCE = {"anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM]}


class Load(fields.Model):
    """A force at a point or between two points, or a moment on a link; expressions of the motion may give them."""

    at: fields.EndName | None = None
    """Point that the force acts at: its pin, or as rod.B link rod alone. Example: T"""
    between: Annotated[tuple[fields.EndName, fields.EndName] | None, fields.pair_of("a list of two points")] = None
    """Two points that a force pulls together. Example: [P, Q]"""
    force: Annotated[tuple[Quantity, ...] | None, fields.Read(_read_force, _FORCE)] = None
    """Force [fx, fy] along the world's axes; between two points one number. Expressions of coordinates, their
    velocities (``theta_velocity``) and ``time``, in the study's units. Example: [0, -20] Example: ["-0.1*P.x_velocity",
    0]
    """
    in_: fields.LinkName | None = Field(None, alias="in")
    """Link with which the directions of the force turn. Left out: the world's axes. Example: boom"""
    link: fields.LinkName | None = None
    """Link that the moment acts on. Example: boom"""
    moment: Annotated[Quantity | None, fields.Read(read_quantity, fields.NUMBER_FORM)] = None
    """Moment, counter-clockwise positive, or an expression. Example: 3000 Example: -50*sin(theta)"""

    def faults(self) -> Iterator[str]:
        places = self.given("at", "between")
        if len(places) > 1 or bool(places) != (self.force is not None) or (self.moment is None) != (self.link is None):
            yield "a load is {at: point, force: [fx, fy]}, {between: [P, Q], force: f} or {link: name, moment: m}"
        if self.force is None and self.moment is None:
            yield "a load needs a force or a moment"
        if self.force is not None and len(self.force) != (1 if self.between else 2):
            yield "a force at a point is [fx, fy], one between two points a single number"
        if self.in_ is not None and self.at is None:
            yield "'in' turns the directions of a force 'at' a point"

    @property
    def numbers(self) -> Iterator[tuple[KeyPath, Quantity, str]]:
        """Its numbers and expressions, with the key of each and its kind."""
        for k, part in enumerate(self.force or ()):
            yield ("force", k) if self.at is not None else ("force",), part, "force"
        if self.moment is not None:
            yield ("moment",), self.moment, "moment"


def joints_of(mechanism: Mechanism, loads: Iterable[Load], springs: Iterable[Spring] = ()) -> Joints:
    """The joints of a mechanism, where loads and springs act on some pins."""
    loads = tuple(loads)
    points = [load.at for load in loads if load.at is not None]
    points += [point for load in loads for point in load.between or ()]
    points += [point for spring in springs if not spring.turning for point in spring.between]
    graph = mechanism.graph
    loaded = frozenset(graph.node(point) for point in points if "." not in point and graph.is_point(point))
    return Joints(mechanism.description, graph, loaded, mechanism.engaged)


def check_friction(checker: Checker) -> None:
    """Check that equilibrium tells the moments of slides that bear them by the length of their guide."""
    mechanism = checker.compiled
    frictions = {} if mechanism is None else mechanism.description.friction
    if mechanism is None or not frictions:
        return
    for name in sorted(joints_of(mechanism, ()).open):
        if name in frictions and frictions[name].length is not None:
            message = (
                f"equilibrium leaves open which moment {name!r} bears in its chain of slides and clamps: leave out "
                "'length', and the force across it counts alone"
            )
            checker.report(("mechanism", "friction", name, "length"), message, at_key=True)


def check_loads(checker: Checker, loads: tuple[Load, ...], root: KeyPath, *, moving: bool, timed: bool) -> None:
    """Check names and units of loads; velocities need a motion with rates (`moving`), the time one over time."""
    mechanism = checker.mechanism
    points = [*mechanism.owners, *mechanism.ends]
    for index, load in enumerate(loads):
        path = (*root, index)
        for key, given in (("at", (load.at,)), ("between", load.between or ())):
            for point in given:
                if point is not None:
                    checker.check_name(point, points, "point", (*path, key))
        if load.between is not None and len({end.rpartition(".")[2] for end in load.between}) == 1:
            message = (
                f"{load.between[0]!r} and {load.between[1]!r} are one place: a force between them has no direction"
            )
            checker.report((*path, "between"), message)
        for key, link in (("in", load.in_), ("link", load.link)):
            if link is not None:
                checker.check_name(link, mechanism.links, "link", (*path, key))
        if load.link == GROUND:
            checker.report((*path, "link"), "the ground does not move: a moment on it does nothing; leave it out")
        listed = isinstance(checker.reporter.document.raw(path), list)
        for keys, quantity, kind in load.numbers:
            # Of [fx, fy, mz] the place in that list.
            place = (*path, {"force": keys[-1], "moment": 2}[kind]) if listed else (*path, *keys)
            if isinstance(quantity, Amount):
                checker.kind(place, kind)
                continue
            for name in sorted(quantity.names - checker.parameters.nominal.keys()):
                check_name(checker, name, place, moving=moving, timed=timed)


def check_name(checker: Checker, name: str, path: KeyPath, *, moving: bool, timed: bool) -> None:
    """Check a name in an expression of a load or an effort."""
    coordinate = name.removesuffix(VELOCITY)
    if name == TIME:
        if not timed:
            checker.report(path, "'time' needs poses over time: give 'motion'")
    elif coordinate != name and coordinate in checker.mechanism.coordinates:
        if not moving:
            checker.report(path, f"{name!r} needs velocities: give 'rates', a 'speed' or a 'motion'")
    else:
        others = [*checker.parameters.nominal, TIME]
        checker.coordinate(name, path, others=others)
