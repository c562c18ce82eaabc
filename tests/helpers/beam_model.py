"""A planar frame by finite elements: Euler-Bernoulli beams, and joints as Lagrange constraints.

Written to check the stiffness analysis; it shares nothing with it but geometry. Every node has (ux, uy, phi); bodies
meet only where a joint says so, so two bodies hinged at a point have a node each there.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

ELEMENTS = 3  # per beam; a uniform beam needs one, more exercise the assembly


class Frame:
    """A frame under construction; places are complex numbers."""

    def __init__(self) -> None:
        self.places: list[complex] = []
        self.springs: list[tuple[np.ndarray, np.ndarray]] = []  # (freedoms, stiffness matrix)
        self.constraints: list[dict[int, float]] = []

    def node(self, place: complex) -> int:
        """Add a free node."""
        self.places.append(place)
        return len(self.places) - 1

    def _constrain(self, *terms: tuple[int, int, float]) -> None:
        row: dict[int, float] = {}
        for node, axis, factor in terms:
            row[3 * node + axis] = row.get(3 * node + axis, 0.0) + factor
        self.constraints.append(row)

    def ground(self, node: int, *axes: int) -> None:
        """Hold some of a node's freedoms."""
        for axis in axes:
            self._constrain((node, axis, 1.0))

    def hinge(self, a: int, b: int) -> None:
        """Equal displacements."""
        for axis in (0, 1):
            self._constrain((a, axis, 1.0), (b, axis, -1.0))

    def clamp(self, a: int, b: int) -> None:
        """Equal displacements and rotations."""
        self.hinge(a, b)
        self._constrain((a, 2, 1.0), (b, 2, -1.0))

    def slide(self, a: int, b: int, direction: complex) -> None:
        """Nodes at one place, free to move apart along a direction only."""
        across = 1j * direction / abs(direction)
        self._constrain((a, 0, across.real), (a, 1, across.imag), (b, 0, -across.real), (b, 1, -across.imag))
        self._constrain((a, 2, 1.0), (b, 2, -1.0))

    def rigid(self, a: int, b: int) -> None:
        """A rigid bar between two nodes."""
        arm = self.places[b] - self.places[a]
        self._constrain((b, 0, 1.0), (a, 0, -1.0), (a, 2, arm.imag))
        self._constrain((b, 1, 1.0), (a, 1, -1.0), (a, 2, -arm.real))
        self._constrain((b, 2, 1.0), (a, 2, -1.0))

    def turning_spring(self, a: int, b: int, stiffness: float) -> None:
        """A spring between two rotations."""
        self._spring([(a, 2, 1.0), (b, 2, -1.0)], stiffness)

    def sliding_spring(self, a: int, b: int, direction: complex, stiffness: float) -> None:
        """A spring between two displacements along a direction."""
        u = direction / abs(direction)
        self._spring([(a, 0, u.real), (a, 1, u.imag), (b, 0, -u.real), (b, 1, -u.imag)], stiffness)

    def _spring(self, terms: list[tuple[int, int, float]], stiffness: float) -> None:
        gradient = np.array([factor for *_, factor in terms])
        self.springs.append(
            (np.array([3 * node + axis for node, axis, _ in terms]), stiffness * np.outer(gradient, gradient))
        )

    def beam(self, a: int, b: int, axial: float, bending: float) -> None:
        """An elastic beam of stiffness EA and EI from node to node."""
        inner = [self.node(p) for p in np.linspace(self.places[a], self.places[b], ELEMENTS + 1)[1:-1].tolist()]
        nodes = [a, *inner, b]
        for i, j in pairwise(nodes):
            freedoms = np.array([3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2])
            self.springs.append((freedoms, _element(self.places[j] - self.places[i], axial, bending)))

    def compliance(self, node: int) -> np.ndarray:
        """Displacements (ux, uy, phi) of a node, a column for each unit load at it."""
        count, held = 3 * len(self.places), len(self.constraints)
        matrix = np.zeros((count + held, count + held))
        for freedoms, stiffness in self.springs:
            matrix[np.ix_(freedoms, freedoms)] += stiffness
        # Constraints as large as the stiffness keep the system well conditioned; the multipliers are not used.
        size = np.abs(matrix).max()
        for k, row in enumerate(self.constraints):
            for freedom, factor in row.items():
                matrix[count + k, freedom] = matrix[freedom, count + k] = size * factor
        loads = np.zeros((count + held, 3))
        loads[3 * node + np.arange(3), np.arange(3)] = 1.0
        return np.linalg.solve(matrix, loads)[3 * node : 3 * node + 3]


def _element(span: complex, axial: float, bending: float) -> np.ndarray:
    """Stiffness matrix of one beam element in world axes."""
    length = abs(span)
    stretch, lift, tilt, turn = (
        axial / length,
        12 * bending / length**3,
        6 * bending / length**2,
        2 * bending / length,
    )
    local = np.array(
        [
            [stretch, 0, 0, -stretch, 0, 0],
            [0, lift, tilt, 0, -lift, tilt],
            [0, tilt, 2 * turn, 0, -tilt, turn],
            [-stretch, 0, 0, stretch, 0, 0],
            [0, -lift, -tilt, 0, lift, -tilt],
            [0, tilt, turn, 0, -tilt, 2 * turn],
        ]
    )
    c, s = span.real / length, span.imag / length
    turned = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    return turned.T @ local @ turned
