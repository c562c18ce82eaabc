"""Elastic deflections among the errors: the stiffness section's mechanism under a load at its point.

A deflection is the compliance of the nominal pose times the load, fixed or random: error += C(pose) F. It is known of
the points and rigid links that the stiffness model knows, and joins the errors of positions and angles; what moves
slowly under its load has the velocities and accelerations of the unloaded mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.reliability.question import Channel
from mechdesign.analyses.stiffness.analysis import Body
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.study import Study
from mechdesign.study.schema.variation import LOADS


@dataclass(frozen=True, eq=False)
class Elastic:
    """Errors of channels by each of fx, fy, mz, shape (channels, 3, poses), nan where the load is not held.

    `load` is the mean one, shape (3,).
    """

    flexibility: Floats
    load: Floats

    @property
    def offset(self) -> Floats:
        """Mean errors, shape (channels, poses)."""
        return np.asarray(np.einsum("ckp,k->cp", self.flexibility, self.load))

    @property
    def held(self) -> Flags:
        """Poses that hold the load."""
        return np.asarray(np.isfinite(self.flexibility).all(axis=(0, 1)))

    def take(self, poses: Sequence[int] | Ints) -> Elastic:
        """Some of the poses."""
        return replace(self, flexibility=self.flexibility[:, :, poses])

    def only(self, channels: Sequence[int]) -> Elastic:
        """Some of the channels."""
        return replace(self, flexibility=self.flexibility[list(channels)])

    def errors(self, loads: Mapping[str, Floats], count: int) -> Floats:
        """Deflections of `count` mechanisms at a single pose, shape (channels, count), from deviations of the load."""
        force = np.repeat(self.load[:, None], count, axis=1)
        for row, name in zip(force, LOADS, strict=True):
            row += loads.get(name, 0.0)
        return np.asarray(self.flexibility[:, :, 0] @ force)


@dataclass(frozen=True, eq=False)
class Elasticity:
    """The loaded mechanism, ready for any number of poses.

    `nodes` are the points whose displacement is known, and `bodies` the links whose rotation is, with the vertices of
    the stiffness network that bear them; of the ground the empty word.
    """

    mechanism: Mechanism
    asked: Body
    load: Floats
    nodes: Mapping[int, str]
    bodies: Mapping[str, str]

    def knows(self, channel: Channel) -> bool:
        """Whether a channel's deflection is known."""
        return channel.order == 0 and self._knows(channel.coordinate)

    def _knows(self, coordinate: Coordinate) -> bool:
        kind = coordinate.kind
        if kind == "parameter":
            return True
        if kind == "expression":
            return all(self._knows(part) for part in coordinate.parts)
        if kind == "angle":
            return coordinate.body in self.bodies and coordinate.reference in self.bodies
        nodes = (coordinate.node, coordinate.other) if kind == "distance" else (coordinate.node,)
        return kind != "slide" and all(node in self.nodes for node in nodes)

    def at(self, configuration: Configuration, channels: Sequence[Channel]) -> Elastic:
        """How channels yield in a flat batch of configurations; nan where one is not assembled."""
        flexibility = np.zeros((len(channels), 3, *configuration.shape))
        known = [k for k, channel in enumerate(channels) if self.knows(channel)]
        assembled = np.flatnonzero(np.isfinite(configuration.point(self.asked.section.at)))
        flexibility[:, :, np.setdiff1d(np.arange(configuration.shape[0]), assembled)] = np.nan
        if len(assembled):
            part = configuration.take(assembled)
            rates, held = self._rates(part)
            for k in known:
                moved = np.broadcast_to(first(part, channels[k].coordinate, rates), (self.asked.size, len(assembled)))
                flexibility[k, : self.asked.size, assembled] = np.where(held, moved, np.nan).T
        return Elastic(flexibility, self.load)

    def _rates(self, configuration: Configuration) -> tuple[Rates, Flags]:
        """What moves by unit loads, which are the leading axis, and which poses hold them."""
        from mechdesign.analyses.stiffness.force_method import load, twists_of

        asked = self.asked
        twists = twists_of(asked.network, asked.section, configuration, asked.length)
        loaded = load(twists, asked.size)
        moved, held = loaded.displacements, np.asarray(np.isfinite(loaded.held.compliance).all(axis=(1, 2)))
        origin = configuration.point(asked.section.at)
        graph = self.mechanism.graph
        nodes: list[Value] = [0.0] * len(graph.nodes)
        for node, vertex in self.nodes.items():
            if vertex:
                dx, dy, turn = np.moveaxis(moved[vertex], 0, -1)
                nodes[node] = dx + 1j * dy + 1j * turn * (configuration.nodes[node] - origin)
        turned = {body: moved[vertex][:, 2].T for body, vertex in self.bodies.items() if vertex}
        return Rates(nodes, [0.0] * graph.classes, [0.0] * len(graph.slides), turned), held


def elasticity(study: Study) -> tuple[Elasticity | None, list[str]]:
    """The loaded mechanism of a study, None where nothing loads it, and what is doubtful."""
    section, stiffness = study.reliability, study.stiffness
    assert section is not None
    if stiffness is None:
        return None, []
    loads = stiffness.loads if section.load is None else (section.load,)
    notes = []
    if len(loads) > 1:
        notes.append(
            f"the stiffness section has {len(loads)} loads, and errors are those of the unloaded mechanism; name one, "
            f"for example reliability.load: [{', '.join(f'{part:g}' for part in loads[0])}]"
        )
    load = np.array(loads[0] if len(loads) == 1 else (0.0, 0.0, 0.0))
    if not load.any() and not set(LOADS).intersection(section.dimensions):
        return None, notes
    from mechdesign.analyses.stiffness.analysis import ask

    asked, mechanism = ask(study), study.mechanism
    network, graph = asked.network, mechanism.graph
    nodes = {graph.node(point): "" for point in mechanism.description.links[GROUND].points}
    bodies = {GROUND: ""}
    for link, points in network.points.items():
        for point, vertex in points:
            if vertex in network.paths:
                nodes.setdefault(graph.node(point), vertex)
        vertices = {vertex for _, vertex in points}
        if len(vertices) == 1 and vertices <= network.paths.keys():
            bodies[link] = vertices.pop()
    nodes[graph.node(stiffness.at)] = network.asked
    if stiffness.link is not None:
        bodies[stiffness.link] = network.asked
    return Elasticity(mechanism, asked, load, nodes, bodies), notes


def unknown(loaded: Elasticity, channels: Sequence[Channel]) -> list[str]:
    """A warning that names the channels whose deflection is not known."""
    lost = [channel.name for channel in channels if not loaded.knows(channel)]
    if not lost:
        return []
    return [
        f"the deflection under the load is not known of {', '.join(lost)}: their errors are those of the unloaded "
        "mechanism"
    ]
