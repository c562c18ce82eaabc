"""Rigid links held by springs, by their energy: displacements under small loads, of numbers alone.

A link is (dx, dy, turn) of what it has at the world's origin; the ground is any link that is not among them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

BOTH = (1 + 0j, 1j)


class RigidLinks:
    """Links by name, the springs between them, and what is held rigidly."""

    def __init__(self, links: Sequence[str]) -> None:
        self.links = list(links)
        self.energy, self.held = np.zeros((3 * len(links),) * 2), list[np.ndarray]()

    def moves(self, link: str, place: complex, along: complex) -> np.ndarray:
        """The displacement of a place of a link along a direction, as a row."""
        row = np.zeros((len(self.links), 3))
        if link in self.links:
            row[self.links.index(link)] = along.real, along.imag, (1j * place * along.conjugate()).real
        return row.ravel()

    def turns(self, link: str) -> np.ndarray:
        """The turn of a link, as a row."""
        row = np.zeros((len(self.links), 3))
        row[self.links.index(link), 2] = 1.0
        return row.ravel()

    def hold(self, row: np.ndarray, stiffness: float | None = None) -> None:
        """What a row says is resisted by a spring, or does not happen."""
        if stiffness is None:
            self.held.append(row)
        else:
            self.energy += stiffness * np.outer(row, row)

    def pin(self, one: str, other: str, place: complex, stiffness: float | None = None) -> None:
        """Two links at a place, in every direction."""
        for along in BOTH:
            self.hold(self.moves(one, place, along) - self.moves(other, place, along), stiffness)

    def under(self, link: str, place: complex, force: Sequence[float]) -> np.ndarray:
        """Displacements under a force at a place of a link; a row times them is what the row says."""
        rows = np.array(self.held).reshape(-1, len(self.energy))
        whole = np.block([[self.energy, rows.T], [rows, np.zeros((len(rows),) * 2)]])
        load = sum(part * self.moves(link, place, along) for part, along in zip(force, BOTH, strict=True))
        return np.linalg.solve(whole, np.concatenate([load, np.zeros(len(rows))]))[: len(self.energy)]
