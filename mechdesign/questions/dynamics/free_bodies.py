"""What acts on each link in one pose, part by part: joint forces, weight, inertia, loads, springs and drives."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, Vector
from mechdesign.mechanism.forces import Forces, Moving, center, inertia, springs
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.joint_contacts import PIN, Contact
from mechdesign.mechanism.loops import nothing
from mechdesign.mechanism.wheels import Mesh
from mechdesign.motion.question import PoseValues
from mechdesign.questions.dynamics.question import COUPLING
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.loads import Loading
from mechdesign.questions.poses import Shown
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class Acting:
    """A force (x + iy) at a place and a moment about it in n poses, on a link or on the pin of several (``pin:A``).

    Its `kind` is ``joint``, ``weight``, ``inertia``, ``load``, ``spring``, ``effort``, ``coupling`` or ``foundation``,
    its `name` that of what acts.
    What a joint does to its second body is a `reaction` to what it does to its first.
    """

    kind: str
    name: str
    link: str
    place: Complexes
    force: Complexes
    moment: Floats
    reaction: bool = False
    joint: str = ""  # along whose slide it pushes

    def at(self, index: int) -> Action:
        """The action in one of the poses; what is not known is 0 there."""
        force, moment = np.nan_to_num(self.force[index]), float(self.moment[index])
        whole, undetermined = float(np.nan_to_num(moment)), bool(np.isnan(moment))
        return Action(self.kind, self.name, self.link, complex(self.place[index]), complex(force), whole, undetermined)


@dataclass(frozen=True)
class Action:
    """What acts in one pose; see `Acting`."""

    kind: str
    name: str
    link: str
    place: complex
    force: complex = 0j
    moment: float = 0.0
    undetermined: bool = False  # whether equilibrium leaves its moment open

    @property
    def size(self) -> float:
        """Size of the force."""
        return abs(self.force)


def mass_centers(study: Study, configuration: Configuration, index: int) -> dict[str, complex]:
    """Centre of mass of each body that has a mass, in one pose of a (flattened) batch."""
    geometry, masses = study.mechanism.geometry, study.mechanism.description.masses
    forces = Forces(configuration)
    return {body: complex(_all(configuration, center(forces, geometry, body, mass)).flat[index])
            for body, mass in masses.items()}  # fmt: skip


def actions_on(motion: PoseValues, shown: Shown) -> list[Acting]:
    """All that acts on the links in the poses shown; of a joint what it does to both sides, unless it is one link.

    What drives and couplings push along a slide stands apart from what the slide bears across it and by friction, which
    ``joint_forces.csv`` has together.
    """
    return list(_Poses(motion, shown).acting())


class _Poses:
    """Poses with their rates."""

    def __init__(self, motion: PoseValues, shown: Shown) -> None:
        self.motion, self.question = motion, question_of(motion)
        self.study, self.poses = self.question.study, shown.solved.poses
        self.rows, self.configuration = shown.rows, shown.configuration
        self.linear = self.study.mechanism.linearize(self.configuration)
        self.moving = moving_at(motion.question.section, shown.solved, self.linear)

    def acting(self) -> Iterator[Acting]:
        """Those of joints first."""
        pushes = list(self._efforts())
        yield from self._joints(pushes)
        yield from self._masses()
        yield from self._loads()
        yield from self._springs()
        yield from pushes
        shaking = [self.motion.arrays[name][self.rows] for name in ("shaking.x", "shaking.y", "shaking_moment")]
        force, place = -shaking[0] - 1j * shaking[1], self.configuration.nodes[self.configuration.graph.bases[GROUND]]
        moment = -shaking[2] - (np.conj(place) * force).imag
        yield self._acting("foundation", "foundation", GROUND, place, force, moment, reaction=True)

    def _acting(
        self, kind: str, name: str, link: str, place: Vector, force: Vector = 0j, moment: Vector = 0.0,
        *, reaction: bool = False,
    ) -> Acting:  # fmt: skip
        """An action with a value in every pose."""
        at, way, turning = (_all(self.configuration, values) for values in (place, force, moment))
        return Acting(kind, name, link, at, way, turning.real, reaction)

    def _joints(self, pushes: Sequence[Acting]) -> Iterator[Acting]:
        """Contact forces: without what is pushed along their slides."""
        pushed = defaultdict[str, Vector](complex)
        for push in pushes:
            if push.joint and not push.reaction:
                pushed[push.joint] = pushed[push.joint] + push.force
        for name, contact in zip(self.question.forces, self.question.joints.contacts, strict=True):
            x, y, moment = (self.motion.arrays[f"{name}.{part}"][self.rows] for part in ("fx", "fy", "moment"))
            place, sides = contact.place(self.configuration), _sides(contact)
            if contact.engaged is not None:
                place = self.motion.arrays[f"{name}.x"][self.rows] + 1j * self.motion.arrays[f"{name}.y"][self.rows]
            if sides[0] != sides[1]:
                for k, (side, sign) in enumerate(zip(sides, (1, -1), strict=True)):
                    force = sign * (x + 1j * y - pushed[contact.joint])
                    pair, at = contact.engaged, place
                    if isinstance(pair, Mesh) and pair.belt:
                        # Where the belt leaves this wheel: nearest to its axis.
                        way = force / np.where(force == 0, 1.0, np.abs(force))
                        at = place + way * ((self.configuration.nodes[pair.nodes[k]] - place) * np.conj(way)).real
                    yield self._acting("joint", contact.joint, side, at, force, sign * moment, reaction=sign < 0)

    def _masses(self) -> Iterator[Acting]:
        geometry, section = self.study.mechanism.geometry, self.poses.section(self.question.section)
        factor, gravity = self.study.units.inertia_factor, section.gravity[0] + 1j * section.gravity[1]
        masses = self.question.masses(self.poses, self.configuration.places)
        for kind, fall, moving in (("weight", gravity, Moving()), ("inertia", 0j, self.moving)):
            forces = Forces(self.configuration)
            inertia(forces, geometry, masses, moving, fall, factor)
            yield from self._parts(kind, kind, forces)

    def _loads(self) -> Iterator[Acting]:
        for load in self.question.section.loads:
            forces = Forces(self.configuration)
            Loading(self.study, [load], self.poses).add(forces, self.moving)
            yield from self._parts("load", "load", forces)

    def _springs(self) -> Iterator[Acting]:
        for name, spring in self.study.mechanism.description.springs.items():
            forces = Forces(self.configuration)
            springs(forces, self.study.mechanism.geometry, [spring], self.moving)
            yield from self._parts("spring", name, forces)

    def _efforts(self) -> Iterator[Acting]:
        """What drives do, and couplings that no wheels make: moments on links, pushes along slides, forces on pins."""
        mechanism, arrays = self.study.mechanism, self.motion.arrays
        pulls = [("effort", name, mechanism.coordinate(name), arrays[f"{name}_effort"]) for name in mechanism.drives]
        pulls += [("coupling", name, gap, arrays[f"{COUPLING} {name}"])
                  for name, (_, gap) in self.question.without_wheels.items()]  # fmt: skip
        for kind, name, coordinate, effort in pulls:
            forces = Forces(self.configuration)
            forces.on_coordinate(coordinate, effort[self.rows])
            yield from self._parts(kind, name, forces)

    def _parts(self, kind: str, name: str, forces: Forces) -> Iterator[Acting]:
        """What forces are added up from: those on pins and links, and those along slides."""
        nodes = self.configuration.nodes
        for node, force in enumerate(forces.nodes):
            if not nothing(force):
                yield self._acting(kind, name, self._holder(node), nodes[node], force)
        for body, force, moment, arm in forces.parts:
            yield self._acting(kind, name, _link(body), nodes[forces.bases[body]] + arm, force, moment)
        for slide, push in forces.slides.items():
            yield from self._along(kind, name, slide, push)

    def _along(self, kind: str, name: str, slide: int, push: Value) -> Iterator[Acting]:
        """A push along a slide: on what slides, and against it on the guide; none where both are one link."""
        graph = self.configuration.graph
        joint = graph.slides[slide]
        (number,) = (k for k, edge in enumerate(graph.edges) if edge.slide == slide)
        for contact in (own for own in self.question.joints.contacts if own.joint == joint):
            sides, place = _sides(contact), self.configuration.nodes[contact.node]
            for side, sign in zip(sides, (1, -1), strict=True) if sides[0] != sides[1] else ():
                force = sign * push * self.linear.direction(number)
                yield replace(self._acting(kind, name, side, place, force, reaction=sign < 0), joint=joint)

    def _holder(self, node: int) -> str:
        """What bears a force at a node: the pin of several links, the one link there, or the ground."""
        pin = f"{PIN}{self.configuration.graph.nodes[node]}"
        joints = self.question.joints
        if any(pin in (contact.on, contact.by) for contact in joints.contacts):
            return pin
        return _link(joints.sole.get(node, GROUND))


def _all(configuration: Configuration, values: Vector) -> Complexes:
    return np.broadcast_to(np.asarray(values, dtype=complex), configuration.shape)


def _link(body: str) -> str:
    """The link of a body; of the rod of a telescopic leg the leg."""
    return body.partition(":")[0]


def _sides(contact: Contact) -> tuple[str, str]:
    """The links, or the pin of several, on both sides of a joint."""
    one, other = (body if body.startswith(PIN) else _link(body) for body in (contact.on, contact.by))
    return one, other


def body_in_words(link: str) -> str:
    """A link by its name; the pin of several as one."""
    return link.replace(PIN, "pin ", 1) if link.startswith(PIN) else link
