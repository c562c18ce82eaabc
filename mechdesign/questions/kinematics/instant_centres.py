"""Instant centres of velocity: the point at which two links have the same velocity, in every pose.

Two links with angular velocities w_a, w_b, of which a point at z_0, taken as fixed to each, moves at v_a and v_b, have
their centre at

    z = z_0 + i (v_a - v_b) / (w_a - w_b),

at infinity where they turn alike. The centres of three links in pairs lie on one line (Aronhold and Kennedy).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.outputs import Rates

# A centre farther away than this many sizes of the mechanism is at infinity.
FARTHEST = 1e9
# Links whose relative motion is below this part of the whole mechanism's do not move against each other.
AT_REST = 1e-11
# Relative motion of two links by its number in the column; 0 where it was not computed.
MOTIONS = ("", "rotation", "translation", "rest")
ROTATION, TRANSLATION, REST = 1, 2, 3
INFINITY = complex(np.inf, np.inf)


@dataclass(frozen=True)
class Centre:
    """Two links whose instant centre is asked."""

    one: str
    other: str

    @property
    def name(self) -> str:
        """``rod.ground``: what its columns begin with."""
        return f"{self.one}.{self.other}"

    @property
    def columns(self) -> tuple[str, str]:
        """Its coordinates."""
        return f"{self.name}.x", f"{self.name}.y"

    @property
    def turn(self) -> str:
        """Name of how fast one turns against the other: where it is 0, the centre is at infinity."""
        return f"{self.name}.turn"

    def at(
        self, mechanism: Mechanism, configuration: Configuration, velocity: Rates
    ) -> tuple[Complexes, Ints, Floats]:  # fmt: skip
        """Its place, how the links move against each other (`MOTIONS`) and turn so, shape of the batch.

        At infinity in a translation, nan where the links do not move against each other, and where the velocities of
        neither are known. A pin of both is their centre whatever the velocities.
        """
        graph, shape = mechanism.graph, configuration.shape
        frames = [graph.bodies[name][0] for name in (self.one, self.other)]
        points = [[point for body, point in graph.points if body == name] for name in (self.one, self.other)]
        pins = [point for point in points[0] if point in points[1]]

        def full(value: Vector, kind: type) -> np.ndarray:
            return np.broadcast_to(np.asarray(value, dtype=kind), shape)

        turns = [full(velocity.angles[frame], float) for frame in frames]
        nodes = [graph.node(names[0]) for names in points]
        places = [full(configuration.nodes[node], complex) for node in nodes]
        moves = [full(velocity.nodes[node], complex) for node in nodes]
        turn, size = turns[0] - turns[1], mechanism.size
        if pins and frames[0] != frames[1]:
            return configuration.point(pins[0]), np.full(shape, ROTATION), turn
        slip = moves[0] - moves[1] - 1j * turns[1] * (places[0] - places[1])
        scale = sum(size * np.abs(omega) for omega in velocity.angles) + sum(np.abs(move) for move in velocity.nodes)
        speed, bend = np.abs(slip), size * np.abs(turn)
        motion = np.where(bend * FARTHEST > speed, ROTATION, TRANSLATION)
        motion = np.where(np.maximum(speed, bend) <= AT_REST * scale, REST, motion)
        motion = np.where(np.isfinite(speed + bend), motion, 0)
        place = np.where(motion == ROTATION, places[0] + 1j * slip / turn, complex(np.nan, np.nan))
        return np.where(motion == TRANSLATION, INFINITY, place), motion, turn
