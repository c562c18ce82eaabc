"""Loads anywhere on a mechanism as wrenches on its network of joints and beams, in a batch of poses.

A load on an elastic link acts on the beams at its foot. The pieces of the beams below that foot bear its wrench; in the
piece in which it lies it is an initial strain, by the part of the piece below it. A load that is linear along a beam is
that of three forces on each piece, at its Gauss points: what they do is of the fourth degree in their place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, Vector, cross
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.graph import GROUND, rod_of
from mechdesign.questions.stiffness.bodies import link_of
from mechdesign.questions.stiffness.elements import BeamLine, Piece, beam_line, piece_freedoms
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.schema import CrossSection

# Force per length of a beam at places of its line, shape (n,).
Density = Callable[[Complexes], Vector]


@dataclass(frozen=True, eq=False)
class Wrench:
    """A force at a place, and a moment about it, in n poses or alike in all, of the load number `case`."""

    case: int
    place: Vector
    force: Vector
    moment: Value = 0.0

    def about(self, origin: Complexes) -> Floats:
        """The wrench (fx, fy, mz) about an origin, shape (3, n)."""
        force = np.broadcast_to(np.asarray(self.force, dtype=complex), origin.shape)
        return np.stack([force.real, force.imag, self.moment + cross(self.place - origin, force)])


@dataclass(eq=False)
class Applied:
    """Loads on a network in n poses, each a case of its own.

    Parameters
    ----------
    vertices : list of (str, Wrench)
        Wrenches with the vertices on which they act; those on beams on the vertex at their beginning.
    lumps : dict
        By elastic link, wrenches on its beams with their distance (n,) along these.
    densities : dict
        By elastic link, loads that are spread along its beams.
    """

    network: Network
    configuration: Configuration
    cases: int
    vertices: list[tuple[str, Wrench]] = field(default_factory=list)
    lumps: dict[str, list[tuple[Floats, Wrench]]] = field(default_factory=dict)
    densities: dict[str, list[tuple[int, Density]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        #: By elastic link, the first stretch of its beams.
        self.beams = {edge.name: edge for edge in reversed(self.network.edges) if edge.beam}

    def add(self, case: int, forces: Forces) -> None:
        """Add forces and moments to a load."""
        nodes, graph = self.configuration.nodes, self.configuration.graph
        for node, force in enumerate(forces.nodes):
            if np.any(force):
                vertex = self.network.pins.get(graph.nodes[node], GROUND)
                self.vertices.append((vertex, Wrench(case, nodes[node], force)))
        for body, force, moment, arm in forces.parts:
            self._on_body(body, Wrench(case, nodes[forces.bases[body]] + arm, force, moment))

    def spread(self, case: int, link: str, density: Density) -> None:
        """Add a force per length, linear along each beam of an elastic link, to a load."""
        self.densities.setdefault(link, []).append((case, density))
        line = self._line(link)
        for piece in line.between(line.starts[0], line.starts[-1]):
            self.vertices += [(self.beams[link].a, wrench) for _, wrench in _gauss(case, density, piece)]

    def on_beams(
        self, link: str, piece: Piece, profile: CrossSection, origin: Complexes
    ) -> Iterator[tuple[int, Floats, Floats]]:
        """What acts above the beginning of a piece of beams: the case, the wrench that all of the piece bears, and the
        twist of its end against its beginning by what acts within it, shapes (3, n), about an origin.
        """
        line = self._line(link)
        lumps = [*self.lumps.get(link, ())]
        for case, density in self.densities.get(link, ()):
            lumps += _gauss(case, density, piece)
            for above in line.between(piece.start + piece.length, line.starts[-1]):
                lumps += _gauss(case, density, above)
        end = piece.start + piece.length
        for distance, wrench in lumps:
            borne = wrench.about(origin)
            inside = np.where(distance < end, np.clip(distance - piece.start, 0.0, piece.length), 0.0)
            below = Piece(piece.start, piece.middle + (inside - piece.length) / 2 * piece.along, piece.along, inside)
            strain = sum(
                twist * (compliance * np.sum(twist * borne, axis=0))
                for twist, compliance in piece_freedoms(below, profile, origin)
            )
            yield wrench.case, borne * (distance >= end), np.asarray(strain)

    def _on_body(self, body: str, wrench: Wrench) -> None:
        link = link_of(body)
        edge = self.beams.get(link)
        if edge is None or edge.beam is None or (edge.beam.link.telescopic and body != rod_of(link)):
            own = {vertex for _, vertex in self.network.points.get(link, ())}
            self.vertices.append((body if body in self.network.paths else min(own), wrench))
            return
        self.vertices.append((edge.a, wrench))
        self.lumps.setdefault(link, []).append((self._line(link).foot("", self._all(wrench.place)), wrench))

    def _line(self, link: str) -> BeamLine:
        beam = self.beams[link].beam
        assert beam is not None
        return beam_line(beam.link, self.configuration)

    def _all(self, place: Vector) -> Complexes:
        return np.broadcast_to(np.asarray(place, dtype=complex), self.configuration.shape)


def borne(network: Network, vertices: Iterable[tuple[str, Wrench]], cases: int, origin: Complexes) -> Floats:
    """Wrenches about an origin, shape (n, edges, 3, cases), on the edges from the ground to their vertices."""
    through = np.zeros((len(origin), len(network.edges), 3, cases))
    for vertex, wrench in vertices:
        for k, sign in network.paths[vertex]:
            through[:, k, :, wrench.case] += sign * wrench.about(origin).T
    return through


def _gauss(case: int, density: Density, piece: Piece) -> Iterator[tuple[Floats, Wrench]]:
    """Three forces on a piece that stand for a force per length, with their distances along the beams."""
    for place, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
        at = piece.middle + place * piece.length / 2 * piece.along
        force = weight / 2 * piece.length * density(at)
        yield piece.start + (1 + place) * piece.length / 2, Wrench(case, at, force)
