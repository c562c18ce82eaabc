"""A planar frame by finite elements: beams, springs and rigid bars, and joints as constraints.

Written to check the stiffness analysis; it shares nothing with it but geometry. Every node has (ux, uy, phi); bodies
meet only where a joint says so, so two bodies hinged at a point have a node each there. Constraints are kept exactly:
the stiffness matrix is taken on the space of displacements that they allow.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

ELEMENTS = 3  # per beam; a uniform beam needs one, more exercise the assembly
FREE = 1e-12  # share of the largest stiffness (lengths near one) below which a motion is free


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

    def turn_together(self, a: int, b: int) -> None:
        """Equal rotations."""
        self._constrain((a, 2, 1.0), (b, 2, -1.0))

    def clamp(self, a: int, b: int) -> None:
        """Equal displacements and rotations."""
        self.hinge(a, b)
        self.turn_together(a, b)

    def stay(self, a: int, b: int, direction: complex) -> None:
        """Equal displacements along a direction."""
        u = direction / abs(direction)
        self._constrain((a, 0, u.real), (a, 1, u.imag), (b, 0, -u.real), (b, 1, -u.imag))

    def slide(self, a: int, b: int, direction: complex) -> None:
        """Nodes at one place, free to move apart along a direction only."""
        self.stay(a, b, 1j * direction)
        self.turn_together(a, b)

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

    def beam(self, a: int, b: int, axial: float, bending: float, shearing: float = np.inf) -> None:
        """An elastic beam of stiffness EA, EI and shear stiffness (factor times GA) from node to node."""
        inner = [self.node(p) for p in np.linspace(self.places[a], self.places[b], ELEMENTS + 1)[1:-1].tolist()]
        nodes = [a, *inner, b]
        for i, j in pairwise(nodes):
            freedoms = np.array([3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2])
            self.springs.append((freedoms, _element(self.places[j] - self.places[i], axial, bending, shearing)))

    def respond(self, node: int, loads: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (3 nodes, loads) under loads (3, loads) at a node, and motions (3 nodes, k) that are free.

        Where a load drives a free motion, the displacements are those of the rest.
        """
        count = 3 * len(self.places)
        matrix = np.zeros((count, count))
        for freedoms, stiffness in self.springs:
            matrix[np.ix_(freedoms, freedoms)] += stiffness
        rows = np.zeros((len(self.constraints), count))
        for k, row in enumerate(self.constraints):
            for freedom, factor in row.items():
                rows[k, freedom] += factor
        moves = np.eye(count)
        if len(rows):
            _, sizes, right = np.linalg.svd(rows)
            moves = right[np.count_nonzero(sizes > 1e-10 * sizes[0]) :].T
        values, vectors = np.linalg.eigh(moves.T @ matrix @ moves)
        firm = values > FREE * values.max(initial=0.0)
        applied = np.zeros((count, 3 if loads is None else loads.shape[1]))
        applied[3 * node : 3 * node + 3] = np.eye(3) if loads is None else loads
        modes = moves @ vectors
        moved = modes[:, firm] @ ((modes[:, firm].T @ applied) / values[firm][:, None])
        return moved, modes[:, ~firm]

    def compliance(self, node: int) -> np.ndarray:
        """Displacements (ux, uy, phi) of a node, a column for each unit load at it; nan where it moves freely."""
        moved, free = self.respond(node)
        here = slice(3 * node, 3 * node + 3)
        if free.size and np.abs(free[here]).max() > 1e-7:
            return np.full((3, 3), np.nan)
        return moved[here]


def _element(span: complex, axial: float, bending: float, shearing: float) -> np.ndarray:
    """Stiffness matrix of one beam element in world axes; with shear, Przemieniecki's (1968, Sec. 5.6)."""
    length = abs(span)
    soft = 12 * bending / (shearing * length**2)
    stretch, lift, tilt = axial / length, 12 * bending / length**3 / (1 + soft), 6 * bending / length**2 / (1 + soft)
    near, far = (bending / length * factor / (1 + soft) for factor in (4 + soft, 2 - soft))
    local = np.array(
        [
            [stretch, 0, 0, -stretch, 0, 0],
            [0, lift, tilt, 0, -lift, tilt],
            [0, tilt, near, 0, -tilt, far],
            [-stretch, 0, 0, stretch, 0, 0],
            [0, -lift, -tilt, 0, lift, -tilt],
            [0, tilt, far, 0, -tilt, near],
        ]
    )
    c, s = span.real / length, span.imag / length
    turned = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    return turned.T @ local @ turned
