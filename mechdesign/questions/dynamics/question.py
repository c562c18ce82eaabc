"""What a study asks of the forces of a motion, and these forces at solved poses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from mechdesign.expressions import Expression
from mechdesign.mechanism.algebra import Value, angle_of, norm2, quiet
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Forces, Moving, inertia, springs
from mechdesign.mechanism.model import Mass, Term
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.statics import Balance, Joints, Reaction, balance, reactions
from mechdesign.numerics.arrays import Ints
from mechdesign.questions.dynamics.schema import DynamicsSection, column_kinds
from mechdesign.questions.friction import Friction, Slipping
from mechdesign.questions.kinematics.question import MotionQuestion, Static, motion_question
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.loads import Loading
from mechdesign.questions.stiffness.elements import corners_of
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Parts of what a joint bears, as columns of its own.
PARTS = ("fx", "fy", "moment", "magnitude", "angle", "normal")


@dataclass(frozen=True, eq=False)
class ForceQuestion:
    """What a study asks of the forces of a motion; see `mechdesign.questions.kinematics.question.Borne`."""

    study: Study
    section: DynamicsSection
    moves: bool  # whether there are rates; else the mechanism stands still in each pose
    tempo: float = 0.0  # about how fast, by which rounding between the poses is judged; see `MotionQuestion.tempo`

    @cached_property
    def joints(self) -> Joints:
        """The joints of the mechanism."""
        return self.section.joints(self.study.mechanism)

    @cached_property
    def friction(self) -> Friction | None:
        """Friction in the joints, if the study gives any."""
        mechanism = self.study.mechanism
        return Friction(mechanism, self.joints) if mechanism.description.friction else None

    @property
    def forces(self) -> list[str]:
        """Names of the contacts' forces."""
        return self.joints.names

    @cached_property
    def statics(self) -> list[Static]:
        """Columns of a row a pose, and of the size of each joint's force."""
        mechanism, label = self.study.mechanism, self.study.units.label
        moment = self.size * (mechanism.size or 1.0)
        sizes = {"force": self.size, "moment": moment, "power": moment * self.tempo, "none": 1.0}
        of_drive = {f"{drive}_{word}": (f"<drive>_{word}", {"drive": drive})
                    for drive in mechanism.drives for word in ("effort", "power")}  # fmt: skip
        kinds = column_kinds(mechanism, self.joints, moving=self.moves)
        return [Static(name, label(kind), *of_drive.get(name, (name, {})), sizes[kind]) for name, kind in kinds.items()]

    @cached_property
    def size(self) -> float:
        """About how large the forces are: weights, inertia, springs and constant loads, all in the same direction.

        What is balanced is the rounding of these.
        """
        mechanism, length = self.study.mechanism, self.study.mechanism.size or 1.0

        def size(term: Term | Value) -> float:
            return abs(float(mechanism.geometry.term(term, {})))

        pull = self.study.units.inertia_factor * (math.hypot(*self.section.gravity) + length * self.tempo**2)
        forces = [pull * size(mass.mass) for mass in mechanism.description.masses.values()]
        for spring in mechanism.description.springs.values():
            way, arm = (np.pi, length) if spring.turning else (length, 1.0)
            give = (size(spring.stiffness) + size(spring.damping) * self.tempo) * way
            forces.append((size(spring.preload) + size(spring.push) + give) / arm)
        for load in self.section.loads:
            for _, quantity, kind in load.numbers:
                if not isinstance(quantity, Expression):
                    forces.append(abs(quantity) / (length if kind == "moment" else 1.0))
        return sum(forces)

    @quiet
    def columns(self, poses: Poses, linear: Linearization, rows: Ints, moving: Moving) -> Mapping[str, Value]:
        """Efforts, powers, shaking forces and energies, and parts of what joints bear, as ``A_force.fx``."""
        columns, held = self._held(poses, linear, rows, moving)
        for name, reaction in zip(self.forces, self._borne(held), strict=True):
            columns |= self._parts(name, reaction)
        return columns

    @quiet
    def values(
        self, names: Sequence[str], poses: Poses, linear: Linearization, rows: Ints | slice, moving: Moving
    ) -> list[Value]:
        """Some of the columns of `statics`; joint forces are computed only where one is among them."""
        columns, held = self._held(poses, linear, rows, moving)
        if not set(names).isdisjoint(self.forces):
            borne = zip(self.forces, self._borne(held), strict=True)
            columns |= {name: np.abs(reaction.force) for name, reaction in borne}
        return [columns[name] for name in names]

    def _held(
        self, poses: Poses, linear: Linearization, rows: Ints | slice, moving: Moving
    ) -> tuple[dict[str, Value], Balance | Slipping]:
        """Efforts, powers, shaking forces and energies, and the equilibrium that they follow from."""
        study, mechanism, section = self.study, self.study.mechanism, poses.section(self.section, rows)
        forces = Forces(linear.configuration)
        Loading(study, section.loads, poses, rows).add(forces, moving)
        description, gravity = mechanism.description, section.gravity[0] + 1j * section.gravity[1]
        energy = springs(forces, mechanism.geometry, list(description.springs.values()), moving)
        masses = {**self._beams(poses, rows, linear.configuration.places), **description.masses}
        energy += inertia(forces, mechanism.geometry, masses, moving, gravity, study.units.inertia_factor)
        columns: dict[str, Value] = {}
        if self.friction is None:
            held: Balance | Slipping = balance(linear, forces, mechanism.meshes)
        else:
            held = self.friction.solve(linear, forces, moving.velocity)
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

    def _borne(self, held: Balance | Slipping) -> list[Reaction]:
        return held.reactions if isinstance(held, Slipping) else reactions(self.joints, held)

    def _beams(self, poses: Poses, rows: Ints | slice, places: Mapping[str, Value]) -> dict[str, Mass]:
        """Masses of the links that have beams with a density: thin bars along them, from corner to corner."""
        stiffness, mechanism = self.study.stiffness, self.study.mechanism
        if stiffness is None:
            return {}
        sections, masses = poses.section(stiffness, rows).sections, dict[str, Mass]()
        for name in weighed_beams(self.study):
            link, section = mechanism.description.links[name], sections[stiffness.elastic[name]]
            assert section.density is not None
            corners = [mechanism.geometry.place(name, point, places) for point in corners_of(link)]
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


def weighed_beams(study: Study) -> list[str]:
    """Links that have the mass of their beams where they are given none; a telescopic link has no beam of its own."""
    links, stiffness = study.mechanism.description.links, study.stiffness
    elastic = stiffness.elastic.items() if stiffness is not None else ()
    return [
        name for name, profile in elastic
        if stiffness is not None and stiffness.sections[profile].density is not None and not links[name].telescopic
    ]  # fmt: skip


def force_question(study: Study, poses: Poses) -> MotionQuestion:
    """The motion of a study's dynamics with its forces, and nothing else; without rates those of kinematics."""
    section, own = study.dynamics, study.kinematics or KinematicsSection()
    assert section is not None
    pace = section if section.moves else own
    rates = {key: getattr(pace, key) for key in ("rates", "accelerations", "speed", "motion")}
    motion = KinematicsSection().model_copy(update={**rates, "outputs": (), "loads": section.loads})
    question = motion_question(replace(study, kinematics=motion, targets={}), poses)
    # The loads count among the forces, and here for the coordinates that their expressions follow.
    return replace(
        question, section=motion.model_copy(update={"loads": ()}), outputs=[], listed=[], square=False,
        borne=ForceQuestion(study, section, pace.rated, question.tempo),
    )  # fmt: skip
