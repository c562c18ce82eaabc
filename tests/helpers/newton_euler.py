"""Bodies in motion by the equations of Newton and Euler, in body coordinates: x, y and angle of every rigid body.

Every joint takes some of the coordinates q away by constraints of its own, and every drive prescribes one more. With
the Jacobian J of all of them, rates solve J q' = b, accelerations J q'' = b' - J' q', and what holds the constraints
and moves the drives is mu in M q'' + h = Q + J^T mu. Nothing is shared with the vector loops of the package, which
gives positions alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from helpers.layouts import GROUND, Coordinate, Follower, Layout
from mechdesign.ground.numerics.arrays import Complexes, Floats

# What a constraint belongs to: ("pin", point, link), ("slide" | "tie", joint or leg) or ("drive", name).
Label = tuple[str, ...]


class Jet:
    """A function of the coordinates at some poses: its value, its gradient, and its second derivative at q'' = 0."""

    def __init__(self, value: Complexes, row: Complexes, bend: Complexes, rates: Floats) -> None:
        self.value, self.row, self.bend, self.rates = value, row, bend, rates

    @property
    def rate(self) -> Complexes:
        return np.asarray((self.row * self.rates).sum(axis=-1))

    def acceleration(self, accelerations: Floats) -> Complexes:
        return np.asarray((self.row * accelerations).sum(axis=-1) + self.bend)

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, self.row - other.row, self.bend - other.bend, self.rates)

    def __mul__(self, other: Jet) -> Jet:
        row = self.row * other.value[:, None] + self.value[:, None] * other.row
        bend = self.bend * other.value + 2 * self.rate * other.rate + self.value * other.bend
        return Jet(self.value * other.value, row, bend, self.rates)

    def conj(self) -> Jet:
        return Jet(self.value.conj(), self.row.conj(), self.bend.conj(), self.rates)

    @property
    def real(self) -> Jet:
        return Jet(self.value.real, self.row.real, self.bend.real, self.rates)

    @property
    def imag(self) -> Jet:
        return Jet(self.value.imag, self.row.imag, self.bend.imag, self.rates)


class Bodies:
    """The rigid bodies of a layout at poses, each with its frame's `origin` and the direction `turn` of its x axis.

    The frame of a leg's rod (``leg:rod``) has its origin at the far end.
    """

    def __init__(self, layout: Layout, origin: Mapping[str, Complexes], turn: Mapping[str, Complexes]) -> None:
        self.layout, self.origin, self.turn, self.names = layout, origin, turn, list(origin)
        self.poses = len(turn[self.names[0]])
        self.rates = self.accelerations = np.zeros((self.poses, 3 * len(self.names)))
        self.multipliers: dict[Label, Floats] = {}
        self.inertia = np.zeros((self.poses, 3 * len(self.names)))
        self.forces = np.zeros((self.poses, 3 * len(self.names)))

    # Where things are.

    def _none(self) -> Floats:
        return np.zeros((self.poses, 3 * len(self.names)))

    def angle(self, body: str, reference: str = GROUND) -> Jet:
        """Angle between the x axes of two bodies."""
        row, turn = self._none(), np.ones(self.poses, dtype=complex)
        for name, sign in ((body, 1), (reference, -1)):
            if name in self.names:
                row[:, 3 * self.names.index(name) + 2] += sign
                turn = turn * (self.turn[name] if sign > 0 else self.turn[name].conj())
        return Jet(np.angle(turn), row, np.zeros(self.poses), self.rates)

    def vector(self, body: str, local: complex) -> Jet:
        """A vector fixed in a body."""
        angle = self.angle(body)
        arm = np.exp(1j * angle.value) * local
        return Jet(arm, 1j * arm[:, None] * angle.row, -(angle.rate**2) * arm, self.rates)

    def place(self, body: str, local: complex) -> Jet:
        """A place of a body, in the world."""
        jet = self.vector(body, local)
        if body in self.names:
            k = 3 * self.names.index(body)
            jet.value = jet.value + self.origin[body]
            jet.row[:, k] += 1.0
            jet.row[:, k + 1] += 1j
        return jet

    def at(self, body: str, drawn: complex) -> Jet:
        """The place of a body that the drawing has at such a place."""
        return self.place(body, drawn if body == GROUND else (drawn - self._frame(body)) / self._direction(body))

    def point(self, link: str, point: str) -> Jet:
        """A point of a link."""
        return self.at(self.layout.holder(link, point), self.layout.places[point])

    def _frame(self, body: str) -> complex:
        link = self.layout.bodies[body.removesuffix(":rod")]
        return self.layout.places[link.to] if body.endswith(":rod") else link.origin

    def _direction(self, body: str) -> complex:
        return self.layout.bodies[body.removesuffix(":rod")].turn

    def coordinate(self, coordinate: Coordinate) -> Jet:
        """A coordinate of the layout."""
        kind, name = coordinate[:2]
        if kind == "angle":
            return self.angle(name, coordinate[2])
        if kind in ("x", "y"):
            jet = self.point(self.layout.owners(name)[0], name)
            return jet.real if kind == "x" else jet.imag
        return (self._line(name)[0].conj() * self._line(name)[1]).real

    def _line(self, name: str) -> tuple[Jet, Jet, str, str]:
        """Direction of a line, and from a place on it what slides; the bodies of both."""
        guide = self.layout.guides.get(name)
        if guide is None:
            rod = f"{name}:rod"
            return self.vector(name, 1 + 0j), self.place(rod, 0j) - self.place(name, 0j), name, rod
        body, slider = (
            self.layout.holder(guide.guide, guide.through), self.layout.holder(guide.slider, guide.point),
        )  # fmt: skip
        turn = 1 + 0j if body == GROUND else self._direction(body)
        way = self.at(slider, self.layout.places[guide.point]) - self.at(body, guide.base)
        return self.vector(body, guide.along / turn), way, body, slider

    def follower(self, coupling: Follower) -> Jet:
        """How far a coordinate is from where its coupling has it, but for a constant."""
        jet = self.coordinate(coupling.coordinate)
        for coordinate, (linear, wave) in coupling.terms.items():
            x = self.coordinate(coordinate)
            slope, curve = linear + wave * np.cos(x.value), -wave * np.sin(x.value)
            bend = slope * x.bend + curve * x.rate**2
            value = linear * x.value + wave * np.sin(x.value)
            jet = jet - Jet(value, slope[:, None] * x.row, bend, self.rates)
        return jet

    def line(self, name: str) -> Complexes:
        """Direction of a slide's line, in the world."""
        return self._line(name)[0].value

    # How they move.

    @property
    def constraints(self) -> dict[Label, list[Jet]]:
        """What every joint keeps, and every drive prescribes."""
        layout, found = self.layout, dict[Label, list[Jet]]()
        for point in layout.places:
            first, *others = layout.owners(point)
            for other in others:
                gap = self.point(other, point) - self.point(first, point)
                found["pin", point, other] = [gap.real, gap.imag]
        lines = {name: guide.kind == "slot" for name, guide in layout.guides.items()}
        for name, slot in (lines | {name: False for name, body in layout.bodies.items() if body.to}).items():
            along, way, guide, slider = self._line(name)
            found["slide", name] = [(along.conj() * way).imag]
            if not slot:
                found["tie", name] = [self.angle(slider, guide)]
        for clamp in layout.clamps.values():
            second, first = (layout.holder(link, clamp.point) for link in (clamp.second, clamp.first))
            found["tie", clamp.name] = [self.angle(second, first)]
        found |= {("coupling", name): [self.follower(c)] for name, c in layout.couplings.items()}
        return found | {("drive", name): [self.coordinate(c)] for name, c in layout.drives.items()}

    @property
    def gap(self) -> float:
        """How far the given positions are from what the pins and lines keep."""
        kept = [jet.value for (kind, *_), jets in self.constraints.items() if kind in ("pin", "slide") for jet in jets]
        return float(np.abs(kept).max()) if kept else 0.0

    def _jacobian(self) -> tuple[Floats, Floats]:
        jets = [jet for jets in self.constraints.values() for jet in jets]
        return np.stack([jet.row for jet in jets], axis=1), np.stack([jet.bend for jet in jets], axis=1)

    def move(self, rates: Mapping[str, Floats | float], accelerations: Mapping[str, Floats | float]) -> None:
        """Give the drives rates and accelerations, the same at all poses or one at each."""
        jacobian, _ = self._jacobian()
        right = np.zeros(jacobian.shape[:2])
        count = len(self.layout.drives)
        for k, name in enumerate(self.layout.drives, -count):
            right[:, k] = rates.get(name, 0.0)
        self.rates = np.linalg.solve(jacobian, right[..., None])[..., 0]
        for k, name in enumerate(self.layout.drives, -count):
            right[:, k] = accelerations.get(name, 0.0)
        self.accelerations = np.linalg.solve(jacobian, (right - self._jacobian()[1])[..., None])[..., 0]

    # What acts on them.

    def push(self, jet: Jet, force: Complexes | complex) -> None:
        """A force at a place, or with an angle for a place a moment."""
        self.forces = self.forces + (np.conj(jet.row) * np.broadcast_to(force, (self.poses,))[:, None]).real

    def weigh(self, body: str, mass: float, center: complex, moment: float, gravity: complex) -> tuple[Floats, Floats]:
        """A body's mass, at a place in its frame; returns its kinetic energy and that of its weight."""
        jet, angle = self.place(body, center), self.angle(body)
        pull = mass * jet.acceleration(self.accelerations)
        self.inertia = self.inertia + (np.conj(jet.row) * pull[:, None]).real
        self.inertia += moment * angle.row * angle.acceleration(self.accelerations)[:, None]
        self.push(jet, mass * gravity)
        energy = 0.5 * (mass * np.abs(jet.rate) ** 2 + moment * angle.rate**2)
        return energy, -mass * (gravity.conjugate() * jet.value).real

    def solve(self) -> None:
        """What holds the constraints and moves the drives, by what each belongs to."""
        jacobian, _ = self._jacobian()
        missing = (self.inertia - self.forces)[..., None]
        held = np.linalg.solve(jacobian.transpose(0, 2, 1), missing)[..., 0]
        k = 0
        for label, jets in self.constraints.items():
            self.multipliers[label] = held[:, k : k + len(jets)]
            k += len(jets)

    @cached_property
    def virtual(self) -> dict[str, Floats]:
        """By drive, its effort at each pose by virtual work: that of all forces where it moves alone."""
        jacobian, _ = self._jacobian()
        missing = self.inertia - self.forces
        moves = np.linalg.inv(jacobian)[..., -len(self.layout.drives) :]
        work = (moves * missing[..., None]).sum(axis=1)
        return dict(zip(self.layout.drives, work.T, strict=True))
