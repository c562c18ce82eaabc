"""Elastic deflections among the errors: the stiffness section's mechanism under a load at its point.

A deflection is the compliance at the nominal pose times the load, fixed or random: error += C(pose) F. The stiffness
model gives it for its points, for the angles of rigid links, and for the angles of links with two ends. It is an error
of positions and angles only: velocities and accelerations are those of the unloaded mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.motion.rows import Poses
from mechdesign.questions.reliability.question import Channel
from mechdesign.questions.reliability.schema.section import ReliabilitySection, links_meant
from mechdesign.questions.reliability.schema.variation import LOADS
from mechdesign.questions.stiffness.body import Body, ask, by_forces
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class Elastic:
    """Derivatives of channels by fx, fy, mz, shape (channels, 3, poses), nan at poses that do not hold the load.

    `load` is the mean load, shape (3, poses), or (3, 1) where all poses have the same.
    """

    flexibility: Floats
    load: Floats

    @property
    def offset(self) -> Floats:
        """Mean errors, shape (channels, poses)."""
        return np.asarray((self.flexibility * self.load).sum(axis=1))

    @property
    def held(self) -> Flags:
        """Whether a pose holds the load, shape (poses,)."""
        return np.asarray(np.isfinite(self.flexibility).all(axis=(0, 1)))

    def take(self, poses: Sequence[int] | Ints) -> Elastic:
        """The deflections at these poses."""
        return Elastic(self.flexibility[:, :, poses], _of_poses(self.load, poses))

    def of(self, channels: Sequence[Channel], some: Sequence[Channel]) -> Elastic:
        """The deflections of some of the channels that it is of."""
        return replace(self, flexibility=self.flexibility[[channels.index(channel) for channel in some]])

    def errors(self, loads: Mapping[str, Floats], count: int) -> Floats:
        """Deflections of `count` mechanisms at a single pose, shape (channels, count), from deviations of the load."""
        force = np.repeat(self.load, count, axis=1)
        for row, name in zip(force, LOADS, strict=True):
            row += loads.get(name, 0.0)
        return np.asarray(self.flexibility[:, :, 0] @ force)


@dataclass(frozen=True, eq=False)
class Elasticity:
    """The loaded mechanism, from which deflections at poses are computed.

    Parameters
    ----------
    ends : mapping of (str, int) to str
        Vertex of the stiffness network that carries a link's point, by link and node; empty for the ground.
    pins : mapping of int to tuple of str
        Vertices whose mean displacement is that of a point named without its link, by node.
    bodies : mapping of str to str
        Vertex of each rigid link; empty for the ground.
    lines : mapping of str to (int, int)
        Nodes of the two ends between which the x axis of an elastic link runs.
    """

    mechanism: Mechanism
    question: Body
    load: Floats
    ends: Mapping[tuple[str, int], str]
    pins: Mapping[int, tuple[str, ...]]
    bodies: Mapping[str, str]
    lines: Mapping[str, tuple[int, int]]

    def knows(self, channel: Channel) -> bool:
        """Whether the stiffness model gives the deflection of a channel."""
        return channel.order == 0 and channel.coordinate is not None and self._knows(channel.coordinate)

    def _knows(self, coordinate: Coordinate) -> bool:
        kind = coordinate.kind
        if kind == "parameter":
            return True
        if kind == "expression":
            return all(self._knows(part) for part in coordinate.parts)
        if kind == "angle":
            return {coordinate.body, coordinate.reference} <= self.bodies.keys() | self.lines.keys()
        points = ((link, node) in self.ends if link else node in self.pins for link, node in coordinate.ends)
        return kind != "slide" and all(points)

    def at(self, configuration: Configuration, channels: Sequence[Channel], poses: Ints | None = None) -> Elastic:
        """Deflections of channels in a flat batch of configurations; nan where one is not assembled.

        `poses` are the rows of the batch where poses differ in their load or stiffness.
        """
        flexibility = np.zeros((len(channels), 3, *configuration.shape))
        deflected = [(k, channel.coordinate) for k, channel in enumerate(channels)
                     if channel.coordinate is not None and self.knows(channel)]  # fmt: skip
        assembled = np.flatnonzero(np.isfinite(configuration.point(self.question.given.at)))
        flexibility[:, :, np.setdiff1d(np.arange(configuration.shape[0]), assembled)] = np.nan
        if len(assembled):
            part = configuration.take(assembled)
            rates, held = self._rates(part, self.question if poses is None else self.question.take(poses[assembled]))
            for k, coordinate in deflected:
                moved = np.broadcast_to(first(part, coordinate, rates), (self.question.size, len(assembled)))
                # A distance of zero has no derivative: its vector has.
                moved = np.nan_to_num(moved) if coordinate.kind == "distance" else moved
                flexibility[k, : self.question.size, assembled] = np.where(held, moved, np.nan).T
        return Elastic(flexibility, self.load if poses is None else _of_poses(self.load, poses))

    def _rates(self, configuration: Configuration, question: Body) -> tuple[Rates, Flags]:
        """Displacements by unit loads, which are the leading axis, and whether poses hold them."""
        loaded = by_forces(question, configuration)
        moved, held = loaded.displacements, np.asarray(np.isfinite(loaded.held.compliance).all(axis=(1, 2)))
        origin = configuration.point(question.given.at)
        graph, places = self.mechanism.graph, configuration.nodes

        def shift(node: int, vertex: str) -> Value:
            if not vertex:
                return 0.0
            dx, dy, turn = np.moveaxis(moved[vertex], 0, -1)
            return np.asarray(dx + 1j * dy + 1j * turn * (places[node] - origin))

        ends = {(link, node): shift(node, vertex) for (link, node), vertex in self.ends.items()}
        nodes: list[Value] = [0.0] * len(graph.nodes)
        for node, vertices in self.pins.items():
            nodes[node] = sum(shift(node, vertex) for vertex in vertices) / len(vertices)
        turned: dict[str, Value] = {body: moved[vertex][:, 2].T for body, vertex in self.bodies.items() if vertex}
        for link, (tail, head) in self.lines.items():
            turned[link] = np.imag((ends[link, head] - ends[link, tail]) / (places[head] - places[tail]))
        return Rates(nodes, [0.0] * graph.classes, [0.0] * len(graph.slides), turned, ends=ends), held


def _of_poses(load: Floats, poses: Sequence[int] | Ints) -> Floats:
    return load if load.shape[1] == 1 else load[:, poses]


def elasticity(study: Study, poses: Poses) -> tuple[Elasticity | None, list[Caution]]:
    """The loaded mechanism of a study, or of designs at their poses, None without a load; and warnings."""
    stiffness = study.stiffness
    if stiffness is None:
        return None, []
    section = poses.section(ReliabilitySection.of(study))
    loads = poses.section(stiffness).wrenches if section.load is None else [section.load]
    why = ""
    if len(loads) > 1:
        why = (
            f"the stiffness section has {len(loads)} loads, and errors are those of the unloaded mechanism; name one, "
            f"for example reliability.load: [{', '.join(f'{part:g}' for part in loads[0] or (0.0, 0.0, 0.0))}]"
        )
    elif loads == [None]:
        why = (
            f"the load of the stiffness section does not act on {stiffness.at} alone: errors are those of the unloaded "
        )
        why += "mechanism"
    notes = [Caution("assumed", why)] if why else []
    single = (loads[0] if len(loads) == 1 else None) or (0.0, 0.0, 0.0)
    load = np.stack(np.broadcast_arrays(*map(np.atleast_1d, single)))
    if not load.any() and not set(LOADS).intersection(section.dimensions):
        return None, notes
    question, mechanism = ask(study).at(poses), study.mechanism
    network, graph, links = question.network, mechanism.graph, mechanism.description.links
    ends = {(GROUND, graph.node(point)): "" for point in links[GROUND].points}
    bodies, lines = {GROUND: ""}, dict[str, tuple[int, int]]()
    for link, points in network.points.items():
        carried = {(link, graph.node(point)): vertex for point, vertex in points if vertex in network.paths}
        corners = [(link, graph.node(point)) for point in links[link].corners]
        if len(carried) == len(points) and len({*carried.values()}) == 1:
            bodies[link] = next(iter(carried.values()))
        elif len(corners) == 2 and carried.keys() >= {*corners}:
            lines[link] = corners[0][1], corners[1][1]
        ends |= carried
    # A point named without its link is the ground's where the ground has it, else that of the first link.
    pins: dict[int, tuple[str, ...]] = {node: (vertex,) for (_, node), vertex in reversed(ends.items())}
    if stiffness.at == stiffness.point:
        pins[graph.node(stiffness.at)] = (network.target,)
    for point, owners in links_meant(section, stiffness, graph).items():
        node = graph.node(point)
        if point in stiffness.bearings and (len(owners) == 1 or point != stiffness.at):
            pins[node] = (ends[owners[0], node],) if len(owners) == 1 else network.pin(point) or pins[node]
    return Elasticity(mechanism, question, load, ends, pins, bodies, lines), notes


def cautions(study: Study, loaded: Elasticity, channels: Sequence[Channel]) -> list[Caution]:
    """Warnings of channels whose deflection is not known, or whose name could mean two points or angles."""
    positions = [(channel.name, channel.coordinate) for channel in channels
                 if channel.order == 0 and channel.coordinate is not None]  # fmt: skip
    warnings = []
    lost = ", ".join(channel.name for channel in channels if not loaded.knows(channel))
    if lost:
        words = (
            f"the deflection under the load is not known of {lost}: their errors are those of the unloaded mechanism"
        )
        warnings.append(Caution("incomplete", words))
    graph, section, assumed = loaded.mechanism.graph, loaded.question.given, list[str]()
    for point, links in links_meant(study.reliability, section, graph).items():
        about = [name for name, coordinate in positions if ("", graph.node(point)) in coordinate.ends]
        if about and len(links) > 1 and point in section.bearings and point != section.at:
            ends = " and ".join(f"{link}.{point}" for link in links)
            assumed.append(
                f"{', '.join(about)}: the pin {point} gives, and {point} is midway between its ends {ends}; name one "
                "of them where that is meant"
            )
    for link in filter(section.elastic.__contains__, loaded.lines):
        about = [name for name, coordinate in positions
                 if any(link in (turn.body, turn.reference) for turn in angles_of([coordinate]).values())]  # fmt: skip
        if about:
            ends = " to ".join(graph.nodes[node] for node in loaded.lines[link])
            assumed.append(f"{', '.join(about)}: {link} bends, and its angle is that of the line from {ends}")
    return [*warnings, *(Caution("assumed", words) for words in assumed)]
