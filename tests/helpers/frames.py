"""A study's mechanism in one pose as a frame of finite elements, built as a designer would draw it.

An elastic link given by its ends is a straight beam between them; given by its points alone it is beams from point to
point in the order listed. Whatever sits on the link - its other points, the pin in its slot, the slider on its line -
is welded there, where it is in this pose, to the nearest place of these beams by a rigid bracket. A rigid link is one
stiff body, and so is an elastic one that has no two points for a beam to lie between. An elastic telescopic leg is a
cantilever from its beginning, where its actuator and its bearing sit; a motor sits at the joint of its two links, or
else at their first points; the bearing of a pin is between its two links, of a compound pin between each link and the
pin, at a fixed pin between each link and the ground. A coupling without wheels keeps the sum of its coordinates' turns
and slides; teeth keep the displacements of their wheels, discs welded to the links at their axes, along a line.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from helpers.beam_model import Frame
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.elements.couplings import Coupling
from mechdesign.mechanism.elements.joints import Fixed, Prismatic
from mechdesign.mechanism.elements.links import Link
from mechdesign.questions.stiffness.schema import CouplingStiffness, CrossSection
from mechdesign.study import Study

GROUND = "ground"


def stiffnesses(profile: CrossSection) -> tuple[float, float, float]:
    """EA, EI and the shear stiffness of a section, by the formulas of textbooks."""
    if profile.width is not None and profile.height is not None:
        area, inertia, factor = profile.width * profile.height, profile.width * profile.height**3 / 12, 5 / 6
    elif profile.diameter is not None:
        outer, inner = profile.diameter / 2, (profile.inner_diameter or 0.0) / 2
        area, inertia = math.pi * (outer**2 - inner**2), math.pi * (outer**4 - inner**4) / 4
        m = inner / outer
        # Cowper (1966), Poisson's ratio 0.
        factor = 6 * (1 + m**2) ** 2 / (7 * (1 + m**2) ** 2 + 20 * m**2)
    else:
        area, inertia, factor = profile.area, profile.inertia, 5 / 6
    shearing = (profile.shear_factor or factor) * profile.G * area if profile.shear else np.inf
    return profile.E * area, profile.E * inertia, shearing


class Teeth(NamedTuple):
    """Two wheels, each given by its link and axis, and the forces on the first by the other: place and size of each."""

    wheels: tuple[tuple[str, str], tuple[str, str]]
    pushes: tuple[tuple[complex, complex], ...]


class Structure:
    """A mechanism in one pose of a batch (its `row`) as a frame; `asked` is the node whose compliance is asked."""

    def __init__(self, study: Study, poses: Configuration, row: int = 0, teeth: dict[str, Teeth] | None = None) -> None:
        self.study, self.pose, self.frame = study, poses.take(np.array([row])), Frame()
        self.section, self.description = study.stiffness, study.mechanism.description
        self.motors = {name: 1 / sum(1 / part for part in parts) for name, parts in self.section.actuators.items()}
        self.nodes: dict[tuple[str, str], int] = {}  # of each link: at its points, and where each line's slider is
        self.there: dict[str, list[int]] = {}  # nodes at each point, before joints join them
        self.pins: dict[str, int] = {}  # each in the middle of what it joins
        self.clamps: list[tuple[int, int]] = []
        self.guides: dict[str, tuple[int, int, complex]] = {}
        for link in self.description.links.values():
            self._link(link)
        self._joints()
        self.asked = self._pins()
        for name in self.description.drives:
            self._drive(name)
        for name, coupling in self.description.couplings.items():
            if name in (teeth or {}):
                self._teeth(teeth[name], self.section.couplings.get(name))
            else:
                self._coupling(coupling, self.section.couplings.get(name))

    # Links.

    def place(self, point: str) -> complex:
        return complex(self.pose.point(point)[0])

    def turn(self, link: str) -> complex:
        return 1 + 0j if link == GROUND else complex(self.pose.rotation(link)[0])

    def number(self, term: str | float) -> float:
        return self.study.mechanism.nominal[term] if isinstance(term, str) else term

    def seats(self, link: Link) -> dict[str, complex]:
        """What sits on a link, and where it is in the world: its points, and what slides along its lines."""
        found = {point: self.place(point) for point in link.points}
        for name, joint in self.description.joints.items():
            if not isinstance(joint, Fixed) and joint.line.link == link.name:
                found[name] = self.place(joint.point)
        return found

    def _node(self, link: str, seat: str, place: complex) -> int:
        node = self.nodes[link, seat] = self.frame.node(place)
        if seat not in self.description.joints:
            self.there.setdefault(seat, []).append(node)
        return node

    def _link(self, link: Link) -> None:
        section = self.section.elastic.get(link.name)
        if link.telescopic:
            self._leg(link, section)
            return
        nodes = [self._node(link.name, seat, place) for seat, place in self.seats(link).items()]
        corners = [self.place(point) for point in link.ends or link.points]
        if link.name == GROUND:
            for node in nodes:
                self.frame.ground(node, 0, 1, 2)
        elif section is None or len(corners) < 2:
            for node in nodes[1:]:
                self.frame.rigid(nodes[0], node)
        else:
            self._beams(link, corners, stiffnesses(self.section.sections[section]))

    def _beams(self, link: Link, corners: list[complex], stiffness: tuple[float, float, float]) -> None:
        """Beams from corner to corner, divided where something is welded on."""
        welds: list[list[tuple[float, str]]] = [[] for _ in corners[1:]]
        size = sum(abs(b - a) for a, b in pairwise(corners))
        names = list(link.ends or link.points)
        for seat, place in self.seats(link).items():
            if seat in names:
                # A corner itself: the beginning of its beam, or the end of the last.
                k = names.index(seat)
                welds[min(k, len(welds) - 1)].append((float(k == len(welds)), seat))
                continue
            options = []
            for k, (a, b) in enumerate(pairwise(corners)):
                share = min(1.0, max(0.0, ((place - a) / (b - a)).real)) if a != b else 0.0
                options.append((round(abs(place - a - share * (b - a)) / size, 9), k, share))
            _, k, share = min(options)
            welds[k].append((share, seat))
        before = None
        for (a, b), here in zip(pairwise(corners), welds, strict=True):
            first = before if before is not None else self.frame.node(a)
            last, length = first, 0.0
            for share, seat in [*sorted(here), (1.0, "")]:
                # What sits closer together than a beam could bend shares a node.
                if (share - length) * abs(b - a) > 1e-7 * size:
                    onward = self.frame.node(a + share * (b - a))
                    self.frame.beam(last, onward, *stiffness)
                    last, length = onward, share
                if seat:
                    self.frame.rigid(last, self.nodes[link.name, seat])
            before = last

    def _leg(self, link: Link, section: str | None) -> None:
        """A telescopic leg: a rigid body at its beginning, and a rod that slides there; an elastic rod bends."""
        tail, head = link.ends
        foot = self.nodes[link.name, ":rod"] = self.frame.node(self.place(tail))
        tip = self._node(link.name, head, self.place(head))
        if section is None or abs(self.place(head) - self.place(tail)) < 1e-12:
            self.frame.rigid(foot, tip)
        else:
            self.frame.beam(foot, tip, *stiffnesses(self.section.sections[section]))
        body = self._node(link.name, tail, self.place(tail))
        for seat, place in self.seats(link).items():
            if seat == tail:
                continue
            joint = self.description.joints.get(seat)
            on_rod = joint is not None and joint.line.through == head
            self.frame.rigid(tip if on_rod else body, self._node(link.name, seat, place))
        self._guide(link.name, body, foot, self.turn(link.name))

    # Joints.

    def _joints(self) -> None:
        for name, joint in self.description.joints.items():
            if isinstance(joint, Fixed):
                one, two = (self.nodes[link, joint.point] for link in joint.links)
                self.clamps.append((one, two))
                continue
            line = joint.line
            if line.toward is not None:
                along = self.place(line.toward) - self.place(line.through)
            else:
                along = self.turn(line.link) * np.exp(1j * self.number(line.direction))
            if isinstance(joint, Prismatic):
                slider = self.nodes[joint.slider, joint.point]
            else:
                slider = self.frame.node(self.place(joint.point))
                self.there[joint.point].append(slider)
            self._guide(name, self.nodes[line.link, name], slider, along)

    def _guide(self, name: str, a: int, b: int, along: complex) -> None:
        """A slide, its drive and its bearing."""
        self.guides[name] = a, b, along / abs(along)
        drive = next((d for d in self.description.drives.values() if d.kind != "angle" and d.target == name), None)
        if drive is not None and drive.name in self.motors:
            self.frame.sliding_spring(a, b, along, self.motors[drive.name])
        elif drive is not None:
            self.frame.stay(a, b, along)
        bearing = self.section.bearings.get(name)
        if bearing is not None and bearing.radial is not None:
            self.frame.sliding_spring(a, b, 1j * along, bearing.radial)
        else:
            self.frame.stay(a, b, 1j * along)
        if bearing is not None and bearing.moment is not None:
            self.frame.turning_spring(a, b, bearing.moment)
        else:
            self.frame.turn_together(a, b)

    def _pins(self) -> int:
        """Clamps, then pins, each with a node of its own; the node that the study asks."""
        link, _, at = self.section.at.rpartition(".")
        link = self.section.link or link
        asked = self.nodes[link, at] if link else None
        for a, b in self.clamps:
            self.frame.clamp(a, b)
        for point, nodes in self.there.items():
            clusters = [{node} for node in nodes]
            for a, b in self.clamps:
                if a in nodes:
                    joined = set().union(*(c for c in clusters if c & {a, b}))
                    clusters = [c for c in clusters if not c & {a, b}] + [joined]
            pin = self.pins[point] = self.frame.node(self.place(point))
            if not link and point == at:
                asked = pin
            ground = self.nodes.get((GROUND, point))
            bearing = self.section.bearings.get(point)
            for cluster in clusters:
                node = min(cluster)
                if ground in cluster or bearing is None or len(clusters) == 1:
                    self.frame.hinge(pin, node)
                    continue
                stiffness = bearing.radial * (2 if len(clusters) == 2 and ground is None else 1)
                for direction in (1, 1j):
                    self.frame.sliding_spring(pin, node, direction, stiffness)
            self.frame.ground(pin, 2)
        return asked

    def _drive(self, name: str) -> None:
        drive = self.description.drives[name]
        if drive.kind != "angle":
            return
        a, b = self._ends(drive.target, drive.reference)
        if name in self.motors:
            self.frame.turning_spring(a, b, self.motors[name])
        else:
            self.frame.turn_together(a, b)

    def _teeth(self, teeth: Teeth, gives: CouplingStiffness | None) -> None:
        """`force` is along the line of the teeth here."""
        terms = []
        for sign, (link, axis) in zip((1, -1), teeth.wheels, strict=True):
            node = self.nodes[link, axis]
            for place, push in teeth.pushes:
                way, arm = sign * push, place - self.place(axis)
                terms += [(node, 0, way.real), (node, 1, way.imag), (node, 2, (np.conj(arm) * way).imag)]
        self.frame.couple(terms, None if gives is None else gives.force)

    def _coupling(self, coupling: Coupling, gives: CouplingStiffness | None) -> None:
        unit, names = coupling.function.angle_unit, sorted(coupling.function.names)
        values = {
            name: float(np.ravel(self.pose.value(self.study.mechanism.coordinate(name)))[0])
            / (unit if name.endswith(".angle") else 1.0)
            for name in names
        }  # fmt: skip

        def moved(name: str, step: float) -> float:
            return float(coupling.function.evaluate(values | {name: values[name] + step}))

        factors = {coupling.set_: 1.0}
        for name in names:
            slope = (moved(name, 1e-4) - moved(name, -1e-4)) / 2e-4
            units = [unit if other.endswith(".angle") else 1.0 for other in (coupling.set_, name)]
            factors[name] = -slope * units[0] / units[1]
        terms = []
        for name, factor in factors.items():
            owner, _, kind = name.rpartition(".")
            if kind == "angle":
                a, b = self._ends(owner, GROUND)
                terms += [(a, 2, factor), (b, 2, -factor)]
                continue
            guide, slider, along = self.guides[owner]
            for node, way in ((slider, factor * along), (guide, -factor * along)):
                terms += [(node, 0, way.real), (node, 1, way.imag)]
        self.frame.couple(terms, None if gives is None else gives.moment or gives.force)

    def _ends(self, one: str, two: str) -> tuple[int, int]:
        """Where a motor holds two links: at the pin that joins them, themselves or what is clamped to them there."""
        for point, nodes in self.there.items():
            groups = []
            for link in (one, two):
                mine = {node for (body, at), node in self.nodes.items() if body == link and at == point}
                for _ in nodes:
                    mine |= {n for pair in self.clamps if mine & set(pair) for n in pair if n in nodes}
                groups.append(mine)
            if groups[0] and groups[1] and not groups[0] & groups[1]:
                return min(groups[0]), min(groups[1])
        return self._first(one), self._first(two)

    def _first(self, link: str) -> int:
        if (link, ":ground") not in self.nodes and link == GROUND and not self.description.links[GROUND].points:
            node = self.nodes[GROUND, ":ground"] = self.frame.node(0j)
            self.frame.ground(node, 0, 1, 2)
        points = list(self.description.links[link].points) or [":ground"]
        return self.nodes[link, points[0]]

    def compliance(self) -> np.ndarray:
        """C of what the study asks: of a pin only its displacements."""
        size = 2 if self.section.link is None else 3
        moved, free = self.frame.respond(self.asked)
        here = slice(3 * self.asked, 3 * self.asked + size)
        if free.size and np.abs(free[here]).max() > 1e-7:
            return np.full((size, size), np.nan)
        return moved[here, :size]


def posed(study: Study, row: int = 0, teeth: dict[str, Teeth] | None = None) -> Structure:
    """A study's mechanism in one of the poses that it lists for its stiffness."""
    pose = {name: [value] for name, value in study.stiffness.poses[row].items()}
    return Structure(study, study.mechanism.solve(pose).configuration, teeth=teeth)
