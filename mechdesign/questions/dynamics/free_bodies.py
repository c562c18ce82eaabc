"""What acts on each link in one pose, part by part: joint forces, weight, inertia, loads, springs and drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Vector
from mechdesign.mechanism.forces import Forces, Moving, center, inertia, springs
from mechdesign.mechanism.graph import rod_of
from mechdesign.mechanism.statics import PIN, Contact
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.rates import drive_rates
from mechdesign.questions.loads import Loading
from mechdesign.questions.poses import Shown, SolvedPoses
from mechdesign.study import Study


@dataclass(frozen=True)
class Action:
    """A force (x + iy) at a place, or a moment about it, on a link or on the pin of several ('').

    Its `kind` is ``joint``, ``weight``, ``inertia``, ``load``, ``spring`` or ``effort``, its `name` that of what acts.
    """

    kind: str
    name: str
    link: str
    place: complex
    force: complex = 0j
    moment: float = 0.0

    @property
    def size(self) -> float:
        """Size of the force."""
        return abs(self.force)


def mass_centers(study: Study, configuration: Configuration, index: int) -> dict[str, complex]:
    """Centre of mass of each body that has a mass, in one pose of a (flattened) batch."""
    mechanism = study.mechanism
    forces = Forces(configuration)
    centers = {body: center(forces, mechanism.geometry, body, mass)
               for body, mass in mechanism.description.masses.items()}  # fmt: skip
    return {body: _pick(configuration, place, index) for body, place in centers.items()}


def actions(motion: Motion, shown: Shown, index: int) -> list[Action]:
    """What acts on all links in the pose of that index among those shown; of a joint what it does to both sides."""
    return list(_Pose(motion, shown, index).actions())


class _Pose:
    """One pose with its rates."""

    def __init__(self, motion: Motion, shown: Shown, index: int) -> None:
        self.motion, self.question = motion, question_of(motion)
        self.study, self.poses = self.question.study, motion.question.poses
        self.rows = shown.rows[index : index + 1]
        self.configuration = shown.configuration.take(np.array([index]))
        self.moving = Moving()
        if self.question.moves:
            linear = self.study.mechanism.linearize(self.configuration)
            solved = SolvedPoses(self.rows, self.poses.groups[0].names, self.configuration)
            rates = drive_rates(self.study, motion.question.section, self.poses, solved, linear)
            velocity = linear.velocity(rates.velocities)
            self.moving = Moving(velocity, linear.acceleration(velocity, rates.accelerations))

    def actions(self) -> Iterator[Action]:
        """Those of joints first."""
        yield from self._joints()
        yield from self._masses()
        yield from self._loads()
        yield from self._springs()
        yield from self._efforts()

    def _place(self, node: int) -> complex:
        return _pick(self.configuration, self.configuration.nodes[node])

    def _joints(self) -> Iterator[Action]:
        for name, contact in zip(self.question.forces, self.question.joints.contacts, strict=True):
            x, y, moment = (self._value(f"{name}.{part}") for part in ("fx", "fy", "moment"))
            place, sides = self._place(contact.node), _sides(contact)
            if sides[0] != sides[1]:
                for side, sign in zip(sides, (1, -1), strict=True):
                    yield Action("joint", contact.joint, side, place, sign * complex(x, y), sign * moment)

    def _value(self, name: str) -> float:
        return float(np.nan_to_num(self.motion.arrays[name][self.rows[0]]))

    def _masses(self) -> Iterator[Action]:
        mechanism, section = self.study.mechanism, self.poses.section(self.question.section, self.rows)
        factor, still = self.study.units.inertia_factor, Moving()
        for body, mass in mechanism.description.masses.items():
            place = mass_centers(self.study, self.configuration, 0)[body]
            base = self._place(Forces(self.configuration).bases[body])
            for kind, gravity, moving in (("weight", complex(*section.gravity), still), ("inertia", 0j, self.moving)):
                forces = Forces(self.configuration)
                inertia(forces, mechanism.geometry, {body: mass}, moving, gravity, factor)
                force, moment = (_pick(self.configuration, part) for part in forces.bodies[body])
                turning = moment.real - ((place - base).conjugate() * force).imag
                yield Action(kind, kind, _link(body), place, force, turning)

    def _loads(self) -> Iterator[Action]:
        for load in self.question.section.loads:
            forces = Forces(self.configuration)
            Loading(self.study, [load], self.poses, self.rows).add(forces, self.moving)
            ends = (load.at,) if load.at is not None else load.between or ()
            yield from self._at_points("load", "load", forces, ends)
            if load.link is not None:
                moment = _pick(self.configuration, forces.bodies[load.link][1]).real
                yield Action("load", "load", load.link, self._base(load.link), 0j, moment)

    def _springs(self) -> Iterator[Action]:
        mechanism = self.study.mechanism
        for name, spring in mechanism.description.springs.items():
            forces = Forces(self.configuration)
            springs(forces, mechanism.geometry, [spring], self.moving)
            if not spring.turning:
                yield from self._at_points("spring", name, forces, spring.between)
                continue
            for link in spring.between:
                yield Action("spring", name, link, self._base(link), 0j,
                             _pick(self.configuration, forces.bodies[link][1]).real)  # fmt: skip

    def _at_points(self, kind: str, name: str, forces: Forces, ends: Sequence[str]) -> Iterator[Action]:
        """Forces at points: of one link, or of the pin there."""
        graph = self.configuration.graph
        for end in ends:
            node, link = graph.node(end), end.rpartition(".")[0]
            body = link if link in forces.bodies or not link else rod_of(link)
            force = forces.bodies[body][0] if link else forces.nodes[node]
            owner = _link(body) if link else _link(self.question.joints.sole.get(node, ""))
            yield Action(kind, name, owner, self._place(node), _pick(self.configuration, force))

    def _efforts(self) -> Iterator[Action]:
        mechanism = self.study.mechanism
        for drive in mechanism.drives:
            coordinate, effort = mechanism.coordinate(drive), self._value(f"{drive}_effort")
            if coordinate.kind == "angle":
                for body, sign in ((coordinate.body, 1), (coordinate.reference, -1)):
                    yield Action("effort", drive, _link(body), self._base(body), 0j, sign * effort)

    def _base(self, link: str) -> complex:
        bases = Forces(self.configuration).bases
        return self._place(bases[link]) if link in bases else 0j


def _pick(configuration: Configuration, values: Vector, index: int = 0) -> complex:
    return complex(np.broadcast_to(np.asarray(values, dtype=complex), configuration.shape).flat[index])


def _link(body: str) -> str:
    """The link of a body; of the rod of a telescopic leg the leg."""
    return body.partition(":")[0]


def _sides(contact: Contact) -> tuple[str, str]:
    """The links on both sides of a joint; '' is the pin of several."""
    one, other = ("" if body.startswith(PIN) else _link(body) for body in (contact.on, contact.by))
    return one, other
