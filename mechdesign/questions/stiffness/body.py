"""The body or the pin whose stiffness a study asks, its legs and network, and how it is held in a batch of poses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics.question import ForceQuestion, pace
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.loads import Loading
from mechdesign.questions.stiffness.applied import Applied
from mechdesign.questions.stiffness.bodies import build_bodies
from mechdesign.questions.stiffness.compliance import Held, put
from mechdesign.questions.stiffness.elements import spread
from mechdesign.questions.stiffness.force_method import Loaded, load, twists_of
from mechdesign.questions.stiffness.legs import Leg, find_legs, hold_by_legs
from mechdesign.questions.stiffness.network import Network, build_network
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.stiffness.screws import RIGID
from mechdesign.questions.stiffness.tables import Springs
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class Body:
    """The body, or the pin, whose stiffness is asked, with its legs and its network, for any number of poses.

    Parameters
    ----------
    study : Study
        The study that asks.
    given : StiffnessSection
        The section as the study gives it.
    legs : tuple of Leg or None
        The serial legs on which the body stands; None where it does not stand on such legs alone.
    network : Network
        All joints and beams that carry the body.
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        Whether the pin is a point of one link, its only one or the one that ``at`` names: this link turns freely under
        forces at the pin.
    extent : float
        Size of the mechanism.
    poses : Poses, optional
        Those in which the body is, where designs may differ in numbers of the section.
    """

    study: Study
    given: StiffnessSection
    legs: tuple[Leg, ...] | None
    network: Network
    size: int
    condensed: bool
    extent: float
    poses: Poses | None = None

    def at(self, poses: Poses) -> Body:
        """The body in some poses."""
        return replace(self, poses=poses)

    def take(self, index: Ints) -> Body:
        """The body in the poses `index` of its own."""
        return self if self.poses is None else self.at(self.poses.take(index))

    @cached_property
    def section(self) -> StiffnessSection:
        """The section with the numbers of the poses: arrays where designs differ in them."""
        return self.given if self.poses is None else self.poses.section(self.given)

    @property
    def loads(self) -> Floats:
        """Loads on the asked point (fx, fy, mz) in each pose, shape (poses, loads, 3), 0 of loads elsewhere.

        The first axis is 1 where the loads are the same in all poses.
        """
        wrenches = [wrench or (0.0, 0.0, 0.0) for wrench in self.section.wrenches]
        parts = np.broadcast_arrays(*(part for wrench in wrenches for part in wrench))
        return np.stack(parts, axis=-1).reshape(-1, len(wrenches), 3)

    @property
    def uneven(self) -> bool:
        """Whether loads move the asked point by more than its compliance times the load on it; see `Effects.moved`."""
        return bool(self.others) or any(self.network.one_sided)

    @property
    def others(self) -> list[int]:
        """Numbers of the loads that do not act on the asked point alone."""
        return [k for k, wrench in enumerate(self.given.wrenches) if wrench is None]

    def summed(self, configuration: Configuration) -> Floats:
        """Each load as a sum of unit loads and of the loads elsewhere, shape (n, size and loads elsewhere, loads)."""
        units = np.broadcast_to(self.loads[:, :, : self.size].swapaxes(1, 2),
                                (*configuration.shape, self.size, len(self.given.wrenches)))  # fmt: skip
        if not self.others:
            return units
        elsewhere = np.eye(len(self.given.wrenches))[self.others]
        return np.concatenate([units, np.broadcast_to(elsewhere, (*configuration.shape, *elsewhere.shape))], axis=1)

    def length(self, configuration: Configuration) -> Floats:
        """Length that stands for a radian where sizes are compared, shape (n,): the spread of the network's joints.

        No result depends on it.
        """
        return spread([edge.point for edge in self.network.edges], configuration, self.extent)


def ask(study: Study) -> Body:
    """The body whose stiffness the study asks, with its legs and its network.

    Raises
    ------
    StudyError
        If the study has no stiffness section.
    """
    section = study.stiffness
    if section is None:
        message = "is missing: say which point's stiffness is asked, for example {link: platform, at: P}"
        raise StudyError((study.problem(message, "stiffness"),))
    mechanism, point = study.mechanism, section.point
    link, links = section.bearer, mechanism.graph.links_at(point)
    lone = link is None and len(links) == 1
    loaded = _loaded_points(study, section)
    standing = build_bodies(mechanism, links[0] if lone else link, point, section)
    legs = find_legs(standing, list(mechanism.description.links))
    carried = build_bodies(mechanism, None if lone else link, point, section, loaded) if lone or loaded else standing
    network = build_network(carried, whole=None in section.wrenches)
    condensed = section.link is None and (lone or link is not None)
    return Body(study, section, legs, network, 2 if section.link is None else 3, condensed, mechanism.size)


def _loaded_points(study: Study, section: StiffnessSection) -> set[str]:
    """Points on whose pins loads elsewhere, and in dynamics springs, act."""
    loads = [load for load, wrench in zip(section.loads, section.wrenches, strict=False) if wrench is None]
    points = [point for load in loads for point in (load.at, *(load.between or ()))]
    if section.dynamics and study.dynamics is not None:
        joints, graph = study.dynamics.joints(study.mechanism), study.mechanism.graph
        points += [graph.nodes[node] for node in joints.loaded]
    return {point for point in points if point is not None and "." not in point}


def hold(body: Body, configuration: Configuration) -> tuple[Held, Iterable[Springs]]:
    """How the body is held in a batch of assembled poses of shape (n,), and the equivalent springs of its legs.

    The reciprocal wrenches of the legs are used where they hold the body in closed form (six times as fast as the force
    method), else the force method.
    """
    if body.legs is None:
        return by_forces(body, configuration).held, []
    length = body.length(configuration)
    held, springs = hold_by_legs(body.legs, body.section, configuration, length, body.size, body.condensed)
    rest = np.flatnonzero(held.rank == 0)
    if len(rest):
        put(held, rest, by_forces(body.take(rest), configuration.take(rest)).held)
    return held, springs


def by_forces(body: Body, configuration: Configuration, *, loads: bool = False) -> Loaded:
    """The body, and the effects of unit loads, in a batch of assembled poses, by the force method.

    With `loads` those of the study that do not act on the asked point alone follow them.
    """
    applied = _applied(body, configuration) if loads and body.others else None
    length = body.length(configuration)
    return load(twists_of(body.network, body.section, configuration, length, applied), body.size)


def under_loads(body: Body, configuration: Configuration) -> tuple[Loaded, list[tuple[Loaded, Floats]]]:
    """The body as `by_forces` has it with the study's loads; and how it is under these, with each load as in `summed`.

    Under each load those flanks of teeth and strands of belts work that it presses or pulls.
    """
    loaded, applied = by_forces(body, configuration, loads=True), body.summed(configuration)
    if not any(body.network.one_sided):
        return loaded, [(loaded, applied)]
    parts, length = [], body.length(configuration)
    elsewhere = _applied(body, configuration) if body.others else None
    for k in range(applied.shape[2]):
        own = applied[:, :, k : k + 1]
        effort, size = loaded.efforts @ own, np.abs(loaded.stress).max(axis=1, keepdims=True) @ np.abs(own)
        # An effort that is rounding presses no flank.
        sides = np.where(np.abs(effort) > RIGID * size, np.sign(effort), 0.0)[:, :, 0] * body.network.one_sided
        twists = twists_of(body.network, body.section, configuration, length, elsewhere, sides)
        parts.append((load(twists, body.size), own))
    return loaded, parts


def pushes(body: Body, configuration: Configuration) -> dict[int, list[tuple[complex, complex, float]]]:
    """By the number of each load elsewhere but that of dynamics, its places, forces and moments in a single pose."""
    forces: dict[int, list[tuple[complex, complex, float]]] = {}
    for _, wrench in _applied(body, configuration).vertices if body.others else ():
        k = body.others[wrench.case]
        if k < len(body.given.loads):
            place = np.broadcast_to(np.asarray(wrench.place, dtype=complex), configuration.shape)
            fx, fy, mz = wrench.about(place)[:, 0].tolist()
            forces.setdefault(k, []).append((complex(place[0]), complex(fx, fy), mz))
    return forces


def _applied(body: Body, configuration: Configuration) -> Applied:
    """The loads that do not act on the asked point alone."""
    study, poses = body.study, body.poses
    assert poses is not None
    applied = Applied(body.network, configuration, len(body.others))
    for case, k in enumerate(body.others):
        if k == len(body.given.loads):
            rated = pace(study)
            solved = SolvedPoses(study.motion(poses), np.arange(poses.count), configuration)
            moving = moving_at(rated, solved, study.mechanism.linearize(configuration))
            ForceQuestion.of(study, moves=rated.rated).apply(applied, case, poses, moving)
        else:
            forces = Forces(configuration)
            Loading(study, body.section.loads[k : k + 1], poses).add(forces, Moving())
            applied.add(case, forces)
    return applied
