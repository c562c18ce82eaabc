"""A planar frame by finite elements: beams, springs and rigid bars, and joints as constraints.

Written to check the stiffness analysis; it shares nothing with it but geometry. Every node has (ux, uy, phi); bodies
meet only where a joint says so, so two bodies hinged at a point have a node each there. Joints and rigid bars are kept
exactly, as conditions on the displacements. Every elastic element adds its deformations, each scaled so that its energy
is half its square: the total energy is least over all that the conditions allow, however short or stiff an element is.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr

FREE = 1e-7  # deformation of a motion of unit size (lengths and stiffnesses near one) below which it is free


class Frame:
    """A frame under construction; places are complex numbers."""

    def __init__(self) -> None:
        self.places: list[complex] = []
        self.constraints: list[dict[int, float]] = []
        self.deformations = 0

    def node(self, place: complex) -> int:
        """Add a free node."""
        self.places.append(place)
        return len(self.places) - 1

    def _constrain(self, *terms: tuple[int, int, float], give: dict[int, float] | None = None) -> None:
        """A sum of displacements is zero, or what deformations (from -1 downwards) `give`."""
        row = {-1 - number: -factor for number, factor in (give or {}).items()}
        for node, axis, factor in terms:
            row[3 * node + axis] = row.get(3 * node + axis, 0.0) + factor
        self.constraints.append(row)

    def _deform(self, count: int) -> range:
        self.deformations += count
        return range(self.deformations - count, self.deformations)

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

    def couple(self, terms: list[tuple[int, int, float]], stiffness: float | None) -> None:
        """A sum of displacements (node, axis, factor) is zero, or that of a spring."""
        if stiffness is None:
            self._constrain(*terms)
        else:
            self._spring(terms, stiffness)

    def _spring(self, terms: list[tuple[int, int, float]], stiffness: float) -> None:
        (number,) = self._deform(1)
        self._constrain(*terms, give={number: stiffness**-0.5})

    def beam(self, a: int, b: int, axial: float, bending: float, shearing: float = np.inf) -> None:
        """An elastic beam of stiffness EA, EI and shear stiffness (factor times GA) from node to node."""
        span = self.places[b] - self.places[a]
        # What the end does that the beginning, as a rigid body, would not: against the element's stiffness there.
        factor = np.linalg.inv(np.linalg.cholesky(_element(span, axial, bending, shearing)[3:, 3:])).T
        carried = {0: (a, 2, span.imag), 1: (a, 2, -span.real)}
        numbers = self._deform(3)
        for axis in range(3):
            terms = [(b, axis, 1.0), (a, axis, -1.0), *([carried[axis]] if axis in carried else [])]
            self._constrain(*terms, give=dict(zip(numbers, factor[axis], strict=True)))

    def respond(self, node: int, loads: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (3 nodes, loads) under loads (3, loads) at a node, and motions (3 nodes, k) that are free.

        Where a load drives a free motion, the displacements are those of the rest.
        """
        count = 3 * len(self.places)
        rows = np.zeros((len(self.constraints), count + self.deformations))
        for k, row in enumerate(self.constraints):
            for freedom, factor in row.items():
                rows[k, freedom] += factor
        turned, triangle, _ = qr(rows.T, pivoting=True)
        sizes = np.abs(np.diag(triangle))
        allowed = turned[:, np.count_nonzero(sizes > 1e-10 * sizes.max(initial=0.0)) :]
        moves = allowed[:count]
        # Deformations from -1 downwards stand last, in reverse.
        _, sizes, right = np.linalg.svd(allowed[count:])
        sizes = np.concatenate([sizes, np.zeros(len(right) - len(sizes))])
        firm = sizes > FREE
        modes = moves @ right.T
        applied = np.eye(3) if loads is None else loads
        pull = modes[3 * node : 3 * node + 3, firm].T @ applied
        return modes[:, firm] @ (pull / sizes[firm][:, None] ** 2), modes[:, ~firm]

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
