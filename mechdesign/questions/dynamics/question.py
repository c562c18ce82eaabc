"""What a study asks of the forces of a motion, and these forces at solved poses."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Strands
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, Vector, angle_of, norm2
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization
from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.elements.links import Mass
from mechdesign.mechanism.forces import Energy, Forces, Moving, inertia, inertia_force, springs
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.mechanism.outputs import first, pulled
from mechdesign.mechanism.statics import Balance, Reaction, balance, reactions
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.rows import PoseNumbers, Poses
from mechdesign.questions.dynamics.open_moments import chain_network, with_open_moments
from mechdesign.questions.dynamics.schema import DynamicsSection, column_kinds
from mechdesign.questions.friction import JointFriction, Slipping
from mechdesign.questions.kinematics.moved import AT_REST, MovedQuestion, Static, watched
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.loads import Loading, size_in_sketch
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.stiffness.applied import Applied, Density
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.study import Study
from mechdesign.study.schema.loads import Load
from mechdesign.study.schema.motions import CourseText
from mechdesign.study.schema.poses import MotionSection

# Parts of what a joint bears, as columns of its own.
PARTS = ("fx", "fy", "moment", "magnitude", "angle", "normal")
# Before the name of a coupling that no wheels make: its effort, which pictures show.
COUPLING = "effort of"


@dataclass(frozen=True, eq=False)
class ForceQuestion:
    """What a study asks of the forces of a motion: its columns, and their values at solved poses."""

    study: Study
    section: DynamicsSection
    joints: Joints
    moves: bool  # whether there are rates; else the mechanism stands still in each pose
    tempo: float  # about how fast, by which rounding between the poses is judged; see `MovedQuestion.tempo`
    subset: frozenset[str] | None = None  # columns of `statics` that are computed; None for all, with parts
    rubbing: Floats | None = None  # friction of a motion in time, shape (contacts, instants)

    @classmethod
    def of(cls, study: Study, *, moves: bool, tempo: float = 0.0) -> ForceQuestion:
        """What the section `dynamics` of a study asks."""
        section = DynamicsSection.of(study)
        return cls(study, section, section.joints(study.mechanism), moves, tempo)

    @cached_property
    def friction(self) -> JointFriction | None:
        """Friction in the joints, if the study gives any."""
        mechanism = self.study.mechanism
        return JointFriction(mechanism, self.joints) if mechanism.description.friction else None

    @property
    def forces(self) -> list[str]:
        """Names of the contacts' forces."""
        return self.joints.names

    @cached_property
    def statics(self) -> list[Static]:
        """Columns of a row a pose, and of the size of each joint's force."""
        mechanism, label = self.study.mechanism, self.study.units.label
        moment = self.size * mechanism.size
        sizes = {"force": self.size, "moment": moment, "power": moment * self.tempo, "none": 1.0}
        of_drive = {f"{drive}_{word}": (f"<drive>_{word}", {"drive": drive})
                    for drive in mechanism.drives for word in ("effort", "power")}  # fmt: skip
        kinds = column_kinds(mechanism, self.joints, moving=self.moves)
        magnitudes = {"shaking", *self.forces}
        return [
            Static(name, label(kind), *of_drive.get(name, (name, {})), sizes[kind], name in magnitudes)
            for name, kind in kinds.items()
        ]

    @cached_property
    def parts(self) -> dict[str, float]:
        """Columns of what each joint or coupling bears, by the names of `strands`, and their sizes.

        Directions jump by a turn: they are those of the poses.
        """
        sizes = {"fx": self.size, "fy": self.size, "moment": self.size * (self.study.mechanism.size or 1.0),
                 "normal": self.size}  # fmt: skip
        names = self.strands.names
        return {f"{name}.{part}": size for name in names for part, size in sizes.items()} | dict.fromkeys(
            names, self.size
        )

    @property
    def strands(self) -> Strands:
        """The rows of ``joint_forces.csv`` in each pose."""
        return Strands(tuple(name for name, *_ in self.borne_by), PARTS, "magnitude")

    @cached_property
    def size(self) -> float:
        """About how large the forces are: weights, inertia, springs and loads, all in the same direction.

        What is balanced is the rounding of these. Loads that follow the motion count as in the sketch.
        """
        mechanism, length = self.study.mechanism, self.study.mechanism.size

        def size(term: Term | Value) -> float:
            return abs(float(mechanism.geometry.term(term, {})))

        pull = self.study.units.inertia_factor * (math.hypot(*self.section.gravity) + length * self.tempo**2)
        forces = [pull * size(mass.mass) for mass in mechanism.description.masses.values()]
        for spring in mechanism.description.springs.values():
            way, arm = (np.pi, length) if spring.turning else (length, 1.0)
            constant, stiffness, _, damping = spring.pull(size)
            forces.append((abs(constant) + (stiffness + damping * self.tempo) * way) / arm)
        forward = self.section.forward
        span = forward.duration if forward is not None else 2 * np.pi / max(self.tempo, np.finfo(float).tiny)
        for load in self.section.loads:
            for _, quantity, kind in load.numbers:
                largest = size_in_sketch(self.study, quantity, self.tempo, span)
                forces.append(largest / (length if kind == "moment" else 1.0))
        return sum(forces)

    def lean(self, names: Collection[str]) -> ForceQuestion:
        """The question for some of the columns of `statics` and `parts` alone."""
        return replace(self, subset=frozenset(names))

    def _counts(self, name: str) -> bool:
        """Whether a column, or one of those that begin with it, is computed."""
        return self.subset is None or any(own == name or own.startswith(f"{name}.") for own in self.subset)

    def columns(
        self, poses: PoseNumbers, linear: Linearization, moving: Moving
    ) -> Mapping[str, Value]:  # fmt: skip
        """Efforts, powers, shaking forces and energies, and what joints bear: parts of it as ``A_force.fx``.

        Of a subset of the columns joint forces are computed only if one is among them.
        """
        columns, held = self._held(poses, linear, moving)
        if any(self._counts(name) for name in self.forces):
            borne, stiffness = self._borne(held), self.study.stiffness
            moments = any(self._counts(f"{name}.moment") for name in self.forces)
            if moments and self.joints.open and stiffness is not None and isinstance(held, Balance):
                section = poses.section(stiffness)
                applied = Applied(chain_network(self.joints, self.study.mechanism, section), linear.configuration, 1)
                self.apply(applied, 0, poses, moving)
                borne = with_open_moments(
                    borne, self.joints, applied, section, self.study.mechanism.size, held.couplings
                )  # fmt: skip
            for name, reaction in zip(self.forces, borne, strict=True):
                columns |= self._parts(name, reaction) if self._counts(name) else {}
        whole = held.balance if isinstance(held, Slipping) else held
        columns |= self._turned(linear.configuration, whole)
        if self.subset is None:
            for name, contact in zip(self.forces, self.joints.contacts, strict=True):
                if contact.engaged is not None:
                    place = np.asarray(whole.pressing[contact.joint].place)
                    columns |= {f"{name}.x": place.real, f"{name}.y": place.imag}
        return columns

    @property
    def borne_by(self) -> list[tuple[str, str, str, str]]:
        """Rows of what is borne: name of the column, joint, on what, by what; joints, then couplings without wheels."""
        contacts = [(name, c.joint, c.on, c.by) for name, c in zip(self.forces, self.joints.contacts, strict=True)]
        turned = [(_moment_on(coupling, body), coupling, body, coupling) for coupling, body in self.turned]
        return [*contacts, *turned]

    @cached_property
    def turned(self) -> list[tuple[str, str]]:
        """Couplings that no wheels make, a controller or a hidden gear, with each link that they turn."""
        drawn, couplings = self.study.mechanism.sketch_configuration, self.without_wheels
        return [(name, body) for name, (_, gap) in couplings.items() for body in pulled(drawn, gap, 1.0).bodies
                if body != GROUND]  # fmt: skip

    @cached_property
    def without_wheels(self) -> dict[str, tuple[int, Coordinate]]:
        """By such a coupling its number and its gap."""
        wheels = {pair.coupling for pair in self.study.mechanism.engaged}
        names = zip(self.study.mechanism.description.couplings, self.joints.couplings, strict=True)
        return {name: (k, own.gap) for k, (name, own) in enumerate(names) if name not in wheels}

    def _turned(self, configuration: Configuration, held: Balance) -> dict[str, Value]:
        """Moments of these couplings, and no forces."""
        efforts = {} if self.subset is not None else self.without_wheels
        columns: dict[str, Value] = {f"{COUPLING} {name}": held.couplings[k] for name, (k, _) in efforts.items()}
        pulling = {name for name, body in self.turned if self._counts(_moment_on(name, body))}
        for name, (number, gap) in self.without_wheels.items() if pulling else ():
            for body, moment in pulled(configuration, gap, held.couplings[number]).bodies.items():
                columns |= self._parts(_moment_on(name, body), Reaction(0.0, moment, np.nan))
        return columns

    def _held(
        self, poses: PoseNumbers, linear: Linearization, moving: Moving
    ) -> tuple[dict[str, Value], Balance | Slipping]:
        """Efforts, powers, shaking forces and energies, and the equilibrium that they follow from."""
        mechanism = self.study.mechanism
        forces, energy = self.acting(poses, linear.configuration, moving)
        columns: dict[str, Value] = {}
        if self.friction is None:
            held: Balance | Slipping = balance(linear, forces, mechanism.engaged)
        else:
            back = self.subset is None or "back_efficiency" in self.subset
            held = self.friction.solve(linear, forces, moving.velocity, back=back, given=self.rubbing)
            columns |= held.columns
        for drive, effort in zip(mechanism.drives, held.efforts, strict=True):
            columns[f"{drive}_effort"] = effort
            if moving.velocity is not None:
                rate = first(linear.configuration, mechanism.coordinate(drive), moving.velocity)
                columns[f"{drive}_power"] = effort * rate
        whole, columns["shaking_moment"] = forces.total
        columns |= {"shaking.x": whole.real, "shaking.y": whole.imag, "shaking": np.abs(whole)}
        columns |= {"kinetic_energy": energy.kinetic} if moving.velocity is not None else {}
        columns["potential_energy"] = energy.potential
        return columns, held

    def acting(self, poses: PoseNumbers, configuration: Configuration, moving: Moving) -> tuple[Forces, Energy]:
        """Loads, springs, weights and inertia forces of all masses at some poses, and the energies."""
        return self.forces_at(poses, configuration, moving, self.masses(poses, configuration.places))

    def _borne(self, held: Balance | Slipping) -> list[Reaction]:
        return held.reactions if isinstance(held, Slipping) else reactions(self.joints, held)

    def forces_at(
        self, poses: PoseNumbers, configuration: Configuration, moving: Moving, masses: Mapping[str, Mass]
    ) -> tuple[Forces, Energy]:
        """What acts on the mechanism: loads, springs, and weights and inertia of some masses; and their energies."""
        study, section = self.study, poses.section(self.section)
        geometry, gravity = study.mechanism.geometry, section.gravity[0] + 1j * section.gravity[1]
        forces = Forces(configuration)
        Loading(study, section.loads, poses).add(forces, moving)
        energy = springs(forces, geometry, list(study.mechanism.description.springs.values()), moving)
        energy += inertia(forces, geometry, masses, moving, gravity, study.units.inertia_factor)
        return forces, energy

    def apply(self, applied: Applied, case: int, poses: PoseNumbers, moving: Moving) -> None:
        """Add what acts to a load on the network of stiffness; the mass of beams is spread along them."""
        masses, gravity = self.study.mechanism.description.masses, poses.section(self.section).gravity
        forces, _ = self.forces_at(poses, applied.configuration, moving, masses)
        applied.add(case, forces)
        stiffness = poses.section(StiffnessSection.of(self.study))
        for link in weighed_beams(self.study):
            if link not in masses and link in applied.beams:
                profile = stiffness.sections[stiffness.elastic[link]]
                assert profile.density is not None
                weight = self.study.units.inertia_factor * profile.density * profile.extent[0]
                applied.spread(case, link, _density(forces, moving, link, weight, gravity[0] + 1j * gravity[1]))

    def masses(self, poses: PoseNumbers, places: Mapping[str, Value]) -> dict[str, Mass]:
        """Masses of bodies: those given, and of other links those of their beams."""
        return {**self._beams(poses, places), **self.study.mechanism.description.masses}

    def _beams(self, poses: PoseNumbers, places: Mapping[str, Value]) -> dict[str, Mass]:
        """Masses of the links that have beams with a density: thin bars along them, from corner to corner."""
        stiffness, mechanism = self.study.stiffness, self.study.mechanism
        if stiffness is None:
            return {}
        sections, masses = poses.section(stiffness).sections, dict[str, Mass]()
        for name in weighed_beams(self.study):
            link, section = mechanism.description.links[name], sections[stiffness.elastic[name]]
            assert section.density is not None
            corners = [mechanism.geometry.place(name, point, places) for point in link.corners]
            spans = [(b - a, (a + b) / 2) for a, b in pairwise(corners)]
            bars = [section.density * section.extent[0] * np.abs(along) for along, _ in spans]
            mass = sum(bars)
            center = sum(bar * middle for bar, (_, middle) in zip(bars, spans, strict=True)) / mass
            turning = sum(bar * (norm2(along) / 12 + norm2(middle - center))
                          for bar, (along, middle) in zip(bars, spans, strict=True))  # fmt: skip
            masses[name] = Mass(mass, (center.real, center.imag), turning)
        return masses

    def _parts(self, name: str, reaction: Reaction) -> Mapping[str, Value]:
        force = np.asarray(reaction.force, dtype=complex)
        values = (force.real, force.imag, reaction.moment, np.abs(force),
                  angle_of(force) / self.study.units.angle_factor, reaction.normal)  # fmt: skip
        return {f"{name}.{part}": value for part, value in zip(PARTS, values, strict=True)} | {name: np.abs(force)}


def _moment_on(coupling: str, body: str) -> str:
    """Name of the columns of what a coupling without wheels does to a link."""
    return f"{coupling}_moment_on_{body}"


def weighed_beams(study: Study) -> list[str]:
    """Links that have the mass of their beams where they are given none; a telescopic link has no beam of its own."""
    links, stiffness = study.mechanism.description.links, study.stiffness
    elastic = stiffness.elastic.items() if stiffness is not None else ()
    return [
        name for name, profile in elastic
        if stiffness is not None and stiffness.sections[profile].density is not None and not links[name].telescopic
    ]  # fmt: skip


def _density(forces: Forces, moving: Moving, link: str, weight: Value, gravity: Vector) -> Density:
    """Weight and inertia force of a link's beams per length; `weight` is a force per acceleration and length."""
    base = forces.configuration.nodes[forces.bases[link]]
    return lambda place: inertia_force(forces, moving, link, weight, gravity, place - base)


def pace(study: Study) -> MotionSection:
    """The section that gives the rates of a study's dynamics: its own, or without any that of kinematics."""
    own = study.dynamics
    return own if own is not None and own.moves else KinematicsSection.of(study)


@dataclass(frozen=True, eq=False)
class DynamicQuestion(MovedQuestion):
    """What a study asks of the forces of its motion at every pose; without rates of its own those of kinematics.

    Parameters
    ----------
    forces : ForceQuestion or None
        None where of some columns none is one of the forces.
    """

    forces: ForceQuestion | None = None

    @classmethod
    def of(cls, study: Study, poses: Poses) -> Self:
        """Read what a study asks at some poses.

        Raises
        ------
        StudyError
            If the study has no section 'dynamics', and without what it would say nothing acts.
        """
        section, rated = DynamicsSection.of(study), pace(study)
        rates = {key: getattr(rated, key) for key in ("rates", "accelerations", "speed", "motion")}
        rates["means"] = section.means or rated.means
        if section.forward is not None:
            # What efforts bring about is a motion over time, whose poses are there already.
            rates = {"motion": dict.fromkeys(study.mechanism.drives, CourseText(held=0.0))}
        moving = KinematicsSection().model_copy(update=rates)
        # The coordinates that the expressions of the loads follow are watched.
        loaded = moving.model_copy(update={"loads": section.loads})
        outputs = [output.name for output in expand_outputs(study, default_outputs(study.mechanism))]
        question = cls(
            replace(study.with_sections(kinematics=loaded), targets={}), moving, study.motion(poses), poses,
            [*watched(study, loaded, outputs), *study.mechanism.windings.values()],
            moving.inverse(study.mechanism.drives),
        )  # fmt: skip
        forces = ForceQuestion.of(study, moves=moving.rated, tempo=question.tempo)
        if study.dynamics is None and not forces.size and not (moving.rated and weighed_beams(study)):
            message = (
                "is missing, and without it nothing acts on the mechanism: give gravity and masses of links, loads, or "
                "rates of kinematics; for example {gravity: [0, -9.81 m/s^2]}"
            )
            raise StudyError([study.problem(message, "dynamics")])
        return replace(question, forces=forces)

    @property
    def acting(self) -> ForceQuestion:
        """The forces that are asked."""
        assert self.forces is not None
        return self.forces

    @property
    def statics(self) -> list[Static]:
        return self.forces.statics if self.forces is not None else []

    @property
    def parts(self) -> Mapping[str, float]:
        return self.forces.parts if self.forces is not None else {}

    @property
    def loads(self) -> tuple[Load, ...]:
        return self.forces.section.loads if self.forces is not None else ()

    @property
    def passes_singularities(self) -> bool:
        return self.forces is not None and set(self.poses.names) != set(self.study.mechanism.drives)

    def lean(self, names: Collection[str]) -> Self:
        forced = any(name in names for name in (*(static.name for static in self.statics), *self.parts))
        if forced:
            return replace(self, forces=self.acting.lean(names))
        return replace(
            self, forces=None, inverse=False, section=self.section.model_copy(update=AT_REST),
            watched=[coordinate for coordinate in self.watched if coordinate.name in names],
        )  # fmt: skip

    def moved(self, solved: SolvedPoses) -> tuple[Mapping[str, Value], Linearization]:
        arrays, linear, moving = self.positions(solved)
        if self.forces is not None:
            regular = np.asarray(arrays["conditioning"]) >= STALLED
            columns = self.forces.columns(solved.poses, linear, moving)
            arrays |= {name: np.where(regular, values, np.nan) for name, values in columns.items()}
        return arrays, linear
