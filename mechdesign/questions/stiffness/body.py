"""The body or the pin whose stiffness a study asks, its legs and network, and how it is held in a batch of poses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.errors import StudyError
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.stiffness.compliance import Held, put
from mechdesign.questions.stiffness.elements import spread
from mechdesign.questions.stiffness.force_method import Loaded, load, twists_of
from mechdesign.questions.stiffness.legs import Leg, find_legs, hold_by_legs
from mechdesign.questions.stiffness.network import Network, build_bodies, build_network
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.stiffness.tables import Springs
from mechdesign.study import Study
from mechdesign.study.poses import Poses


@dataclass(frozen=True, eq=False)
class Body:
    """The body, or the pin, whose stiffness is asked, with its legs and its network, for any number of poses.

    Parameters
    ----------
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
    poses, rows : optional
        All poses, and the rows of those in which the body is, where designs differ in numbers of the section.
    """

    given: StiffnessSection
    legs: tuple[Leg, ...] | None
    network: Network
    size: int
    condensed: bool
    extent: float
    poses: Poses | None = None
    rows: Ints | None = None

    def at(self, poses: Poses, rows: Ints) -> Body:
        """The body in some of the poses."""
        return replace(self, poses=poses, rows=rows)

    def take(self, index: Ints) -> Body:
        """The body in the poses `index` of its own."""
        return self if self.rows is None else replace(self, rows=self.rows[index])

    @cached_property
    def section(self) -> StiffnessSection:
        """The section with the numbers of the poses: arrays where designs differ in them."""
        if self.poses is None or self.rows is None:
            return self.given
        return self.poses.section(self.given, self.rows)

    @property
    def loads(self) -> Floats:
        """Loads (fx, fy, mz) in each pose, shape (poses, loads, 3); of a single pose where all poses have the same."""
        parts = np.broadcast_arrays(*(part for load in self.section.loads for part in load))
        return np.stack(parts, axis=-1).reshape(-1, len(self.given.loads), 3)

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
    standing = build_bodies(mechanism, links[0] if lone else link, point, section)
    carried = build_bodies(mechanism, None, point, section) if lone else standing
    network = build_network(carried)
    legs = find_legs(standing, list(mechanism.description.links))
    condensed = section.link is None and (lone or link is not None)
    return Body(section, legs, network, 2 if section.link is None else 3, condensed, mechanism.size or 1.0)


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


def by_forces(body: Body, configuration: Configuration) -> Loaded:
    """The body, and the effects of unit loads, in a batch of assembled poses, by the force method."""
    return load(twists_of(body.network, body.section, configuration, body.length(configuration)), body.size)
