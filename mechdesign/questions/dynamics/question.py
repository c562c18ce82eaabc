"""What a study asks of the forces of a motion, and these forces at solved poses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.curve.motion import Curve
from mechdesign.mechanism.algebra import Value, angle_of, quiet
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.forces import Forces, Motion, inertia, springs
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.model import Mass
from mechdesign.mechanism.statics import Contact, Joints, balance, reactions
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.dynamics.schema import DynamicsSection
from mechdesign.questions.kinematics.rates import drive_rates
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.loads import Loading, coordinates_in
from mechdesign.questions.poses import SolvedPoses, followed_angles
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.poses import MotionSection


@dataclass(frozen=True, eq=False)
class ForceQuestion:
    """What a study asks of the forces of a motion.

    Parameters
    ----------
    section : DynamicsSection
        Gravity and loads.
    pace : MotionSection
        The section that gives the rates: its own, or that of kinematics.
    """

    study: Study
    section: DynamicsSection
    pace: MotionSection
    poses: Poses

    @property
    def drives(self) -> list[Coordinate]:
        """The mechanism's drives."""
        return [self.study.mechanism.coordinate(name) for name in self.study.mechanism.drives]

    @property
    def moves(self) -> bool:
        """Whether there are rates; else the mechanism stands still in each pose."""
        return bool(self.pace.rates or self.pace.accelerations or self.pace.speed)

    @cached_property
    def watched(self) -> list[Coordinate]:
        """Coordinates whose angles are followed along the motion: drives and those in loads."""
        return [*self.drives, *coordinates_in(self.study, self.section.loads)]

    @cached_property
    def curve(self) -> Curve | None:
        """The motion between its poses; None of listed poses and grids."""
        if not self.poses.followed or len(self.poses.groups) > 1:
            return None
        plan = self.study.mechanism.plan(self.poses.groups[0].names)
        return Curve(self.study, self.poses, followed_angles(self.study.mechanism, plan, self.watched))

    @cached_property
    def joints(self) -> Joints:
        """The joints of the mechanism; pins are those on which loads and springs act."""
        mechanism = self.study.mechanism
        graph: Graph = mechanism.graph
        points = [load.at for load in self.section.loads if load.at is not None]
        points += [point for load in self.section.loads for point in load.between or ()]
        points += [p for spring in mechanism.description.springs.values() if not spring.turning for p in spring.between]
        return Joints(mechanism.description, graph, frozenset(graph.node(p) for p in points if "." not in p))

    @cached_property
    def borne(self) -> list[str]:
        """Name of each contact's force in the table of extremes: its joint, and what it acts on where it has several."""
        counts = Counter(contact.joint for contact in self.joints.contacts)
        return [
            f"{contact.joint}_force" if counts[contact.joint] == 1 else f"{contact.joint}_force_on_{contact.on}"
            for contact in self.joints.contacts
        ]

    @cached_property
    def units(self) -> dict[str, str]:
        """Columns of a row a pose, without what is given, and of joint forces, with their units."""
        label = self.study.units.label
        units = {f"{d.name}_effort": label("moment" if d.quantity == "angle" else "force") for d in self.drives}
        if self.moves:
            units |= {f"{drive.name}_power": label("power") for drive in self.drives}
        units |= {"shaking.x": label("force"), "shaking.y": label("force"), "shaking": label("force"),
                  "shaking_moment": label("moment")}  # fmt: skip
        if self.moves:
            units["kinetic_energy"] = label("moment")
        units["potential_energy"] = label("moment")
        return units | dict.fromkeys(self.borne, label("force"))


@dataclass(frozen=True, eq=False)
class Borne:
    """What drives and joints bear at n poses.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        The columns of `ForceQuestion.units`, nan at singular poses.
    forces : complex ndarray, shape (n, contacts)
        Force of each contact of the question's joints.
    moments, normals : ndarray, shape (n, contacts)
    conditioning : ndarray, shape (n,)
        How far the drives are from a singularity.
    """

    columns: Mapping[str, Floats]
    forces: np.ndarray
    moments: Floats
    normals: Floats
    conditioning: Floats


@quiet
def bear(question: ForceQuestion, poses: Poses, solved: SolvedPoses) -> Borne:
    """Efforts, joint forces and energies at solved poses; `poses` are those of which they have the rows."""
    study, configuration = question.study, solved.configuration
    mechanism, section = study.mechanism, poses.section(question.section, solved.rows)
    linear = mechanism.linearize(configuration)
    conditioning = np.broadcast_to(np.asarray(regularity(linear)), configuration.shape)
    motion, velocities = Motion(), None
    if question.moves:
        rates = drive_rates(study, question.pace, poses, solved, linear)
        velocity = linear.velocity(rates.velocities)
        motion, velocities = Motion(velocity, linear.acceleration(velocity, rates.accelerations)), rates.velocities
    forces = Forces(configuration)
    Loading(study, section.loads, poses, solved.rows).add(forces, motion)
    description = mechanism.description
    energy = springs(forces, mechanism.geometry, list(description.springs.values()), motion)
    gravity = section.gravity[0] + 1j * section.gravity[1]
    energy += inertia(forces, mechanism.geometry, description.masses, motion, gravity, study.units.inertia_factor)
    held = balance(linear, forces)
    columns: dict[str, Value] = {}
    for k, drive in enumerate(question.drives):
        columns[f"{drive.name}_effort"] = held.efforts[k]
        if velocities is not None:
            columns[f"{drive.name}_power"] = held.efforts[k] * velocities[k]
    whole, columns["shaking_moment"] = forces.total
    columns |= {"shaking.x": whole.real, "shaking.y": whole.imag, "shaking": np.abs(whole)}
    columns |= {"kinetic_energy": energy.kinetic, "potential_energy": energy.potential}
    found = reactions(question.joints, held)
    shape = (*configuration.shape, len(found))
    borne, moments, normals = np.empty(shape, dtype=complex), np.empty(shape), np.empty(shape)
    regular = conditioning >= STALLED
    for k, reaction in enumerate(found):
        borne[..., k], moments[..., k], normals[..., k] = reaction
        columns[question.borne[k]] = np.abs(borne[..., k])
    for table in (borne, moments, normals):
        table[~regular] = np.nan
    return Borne(
        {name: np.where(regular, columns[name], np.nan) for name in question.units}, borne, moments, normals,
        conditioning,
    )  # fmt: skip


def force_question(study: Study, poses: Poses) -> ForceQuestion:
    """What a study asks; without rates or poses of its own it takes those of kinematics."""
    section = study.dynamics
    assert section is not None
    pace: MotionSection = section if section.moves or study.kinematics is None else study.kinematics
    return ForceQuestion(study, section, pace, poses)
