"""The finite-element model of a study's mechanism in a pose, from its description alone.

Where things give, as the study's format has it: an elastic link is beams along its points (those of a binary link in
order along it), and a line that slides on it grows with a beam of its own; an elastic telescopic leg is a cantilever
from its beginning, where its actuator and its bearing sit; a motor sits at the joint of its two links, or else at their
first points; the bearing of a pin is between its two links, of a compound pin between each link and the pin, at a fixed
pin between each link and the ground.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from helpers.beam_model import Frame
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.model import Fixed, Link, Prismatic
from mechdesign.study import Study
from mechdesign.study.stiffness_models import Profile

GROUND = "ground"


def stiffnesses(profile: Profile) -> tuple[float, float, float]:
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


class Structure:
    """A mechanism in one pose of a batch (its `row`) as a frame; `asked` is the node whose compliance is asked."""

    def __init__(self, study: Study, poses: Configuration, row: int = 0) -> None:
        self.study, self.pose, self.frame = study, poses.take(np.array([row])), Frame()
        self.section, self.description = study.stiffness, study.mechanism.description
        self.nodes: dict[tuple[str, str], int] = {}
        self.there: dict[str, list[int]] = {}  # nodes at each point, before joints join them
        self.clamps: list[tuple[int, int]] = []
        for link in self.description.links.values():
            self._link(link)
        self._joints()
        self.asked = self._pins()
        for name in self.description.drives:
            self._drive(name)

    # Links.

    def place(self, point: str) -> complex:
        return complex(self.pose.point(point)[0])

    def turn(self, link: str) -> complex:
        return 1 + 0j if link == GROUND else complex(self.pose.rotation(link)[0])

    def number(self, term: str | float) -> float:
        return self.study.mechanism.nominal[term] if isinstance(term, str) else term

    def local(self, link: Link, point: str) -> complex:
        x, y = link.points[point]
        return complex(self.number(x), self.number(y))

    def origin(self, link: Link) -> complex:
        if link.name == GROUND:
            return 0j
        point = next(iter(link.points))
        return self.place(point) - self.local(link, point) * self.turn(link.name)

    def _node(self, link: str, point: str, place: complex) -> int:
        node = self.nodes[link, point] = self.frame.node(place)
        self.there.setdefault(point, []).append(node)
        return node

    def _hold(self, a: int, b: int, link: Link) -> None:
        """What is between two neighbouring places of a link."""
        section = self.section.elastic.get(link.name)
        if section is None or abs(self.frame.places[a] - self.frame.places[b]) < 1e-12:
            self.frame.rigid(a, b)
        else:
            self.frame.beam(a, b, *stiffnesses(self.section.sections[section]))

    def _link(self, link: Link) -> None:
        if link.name == GROUND:
            for point in link.points:
                self.frame.ground(self._node(GROUND, point, self.place(point)), 0, 1, 2)
            return
        order = list(link.points)
        if link.telescopic:
            self._leg(link)
            return
        if link.ends is not None:
            length = abs(self.local(link, link.ends[1]))
            inner = {p: self.local(link, p) for p in order if p not in link.ends}
            along = sorted(
                (p for p, z in inner.items() if abs(z.imag) <= 1e-9 * length and 0 < z.real < length),
                key=lambda p: inner[p].real,
            )
            order = [link.ends[0], *along, link.ends[1], *(p for p in inner if p not in along)]
        nodes = [self._node(link.name, point, self.place(point)) for point in order]
        for a, b in pairwise(nodes):
            self._hold(a, b, link)

    def _leg(self, link: Link) -> None:
        """A telescopic leg: a rigid body at its beginning, and a rod that slides there; an elastic rod bends."""
        tail, head = link.ends
        nodes = [self._node(link.name, point, self.place(point)) for point in link.points]
        for node in nodes[1:]:
            self.frame.rigid(nodes[0], node)
        foot = self.frame.node(self.place(tail))
        self.nodes[link.name, ":rod"] = foot
        self._hold(foot, self._node(link.name, head, self.place(head)), link)
        self._guide(link.name, self.nodes[link.name, tail], foot, self.turn(link.name))

    # Joints.

    def _joints(self) -> None:
        for name, joint in self.description.joints.items():
            if isinstance(joint, Fixed):
                one, two = (self.nodes[link, joint.point] for link in joint.links)
                self.clamps.append((one, two))
                continue
            line = joint.line
            link = self.description.links[line.link]
            if line.toward is not None:
                along = self.place(line.toward) - self.place(line.through)
            else:
                along = self.turn(line.link) * np.exp(1j * self.number(line.direction))
            base = self._base(link, line.through)
            at = self.frame.node(self.place(joint.point))
            if link.telescopic or link.name == GROUND:
                self.frame.rigid(base, at)
            else:
                self._hold(base, at, link)
            if isinstance(joint, Prismatic):
                slider = self.nodes[joint.slider, joint.point]
            else:
                slider = self.frame.node(self.place(joint.point))
                self.there[joint.point].append(slider)
            self._guide(name, at, slider, along)

    def _base(self, link: Link, through: str | None) -> int:
        """The node that a line goes through; the origin of a frame counts as the point before the first."""
        if through is not None:
            return self.nodes[link.name, through]
        for point in link.points:
            if self.local(link, point) == 0:
                return self.nodes[link.name, point]
        if (link.name, "") in self.nodes:
            return self.nodes[link.name, ""]
        node = self.nodes[link.name, ""] = self.frame.node(self.origin(link))
        if link.name == GROUND:
            self.frame.ground(node, 0, 1, 2)
        else:
            self._hold(node, self.nodes[link.name, next(iter(link.points))], link)
        return node

    def _guide(self, name: str, a: int, b: int, along: complex) -> None:
        """A slide, its drive and its bearing."""
        drive = next((d for d in self.description.drives.values() if d.kind != "angle" and d.target == name), None)
        if drive is not None and drive.name in self.section.actuators:
            self.frame.sliding_spring(a, b, along, self.section.actuators[drive.name])
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
        asked = None if self.section.link is None else self.nodes[self.section.link, self.section.at]
        for a, b in self.clamps:
            self.frame.clamp(a, b)
        for point, nodes in self.there.items():
            clusters = [{node} for node in nodes]
            for a, b in self.clamps:
                if a in nodes:
                    joined = set().union(*(c for c in clusters if c & {a, b}))
                    clusters = [c for c in clusters if not c & {a, b}] + [joined]
            pin = self.frame.node(self.place(point))
            if self.section.link is None and point == self.section.at:
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
        if name in self.section.actuators:
            self.frame.turning_spring(a, b, self.section.actuators[name])
        else:
            self.frame.turn_together(a, b)

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
