"""The region of one design as patches between two boundary curves, and grids of nodes in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.region.intervals import SAME_ROOT
from mechdesign.region.panels import Panels
from mechdesign.region.rays import ray_through

# An interval is kept down to minus this width (fraction of the reach): rounding may exchange two equal ends.
SLACK = 1e-9
# Least number of rays of a panel.
FEWEST = 25
# Distances of a panel's first and last ray from its ends (fractions of the panel), tried one after the other while
# these rays meet other intervals than the rest.
BESIDE = (0.0, 1e-9, 1e-7, 1e-5)
# Nodes of a map along each ray, from boundary to boundary.
GRID = 33
# Distance of the outermost nodes from the boundary, where an index may be infinite (fraction of the interval).
INSET = 1e-6
# Places of a ray's nodes between the two curves.
FRACTIONS = np.clip(0.5 * (1 - np.cos(np.linspace(0, np.pi, GRID))), INSET, 1 - INSET)


class Border(NamedTuple):
    """A curve of a region's boundary: radii and places of shape (rays,), and the margin that is zero on it."""

    side: str  # of the patch: ``inner`` or ``outer``
    margin: int
    radius: Floats
    places: Complexes


@dataclass(frozen=True, eq=False)
class Patch:
    """The part of the region between one inner and one outer curve, over one panel.

    Parameters
    ----------
    about : complex
        Centre of the rays.
    theta, inner, outer : ndarray, shape (rays,)
        Angles of the rays, and the radii of both curves there.
    enters, leaves : int
        Margins that are zero on them; -1 where the patch begins at the centre of the scan, or another assembly mode
        goes on.
    piece : int
        Number of the piece of the region to which the patch belongs, from 1.
    """

    about: complex
    theta: Floats
    inner: Floats
    outer: Floats
    enters: int
    leaves: int
    piece: int = 1

    @property
    def edges(self) -> list[Border]:
        """Its curves that bound the region: not the centre of the rays, nor the ends of the scan."""
        turn = np.exp(1j * self.theta)
        both = (("inner", self.enters, self.inner), ("outer", self.leaves, self.outer))
        return [
            Border(side, margin, radius, self.about + radius * turn) for side, margin, radius in both if margin >= 0
        ]

    @property
    def grid(self) -> Complexes:
        """Nodes, shape (rays, GRID), denser towards both curves."""
        radius = self.inner[:, None] + FRACTIONS * (self.outer - self.inner)[:, None]
        return np.asarray(self.about + radius * np.exp(1j * self.theta)[:, None])

    @property
    def width(self) -> float:
        """Length of the widest interval."""
        return float(np.max(self.outer - self.inner))

    @property
    def middle(self) -> complex:
        """The middle of the widest interval, a place inside the patch."""
        k = int(np.argmax(self.outer - self.inner))
        return complex(self.about + 0.5 * (self.inner[k] + self.outer[k]) * np.exp(1j * self.theta[k]))

    def holds(self, z: Complexes) -> Flags:
        """Which places lie in the patch, its curves being interpolated between the rays."""
        radius, theta = np.abs(z - self.about), ray_through(z - self.about, self.theta[0])
        inner, outer = np.interp(theta, self.theta, self.inner), np.interp(theta, self.theta, self.outer)
        return np.asarray((theta <= self.theta[-1]) & (inner <= radius) & (radius <= outer))


def patches(panels: Panels, rays: int) -> Iterator[Patch]:
    """Patches of a single design, with about `rays` rays over all panels, among them the ends of each panel."""
    total = float(np.sum(panels.high - panels.low))
    in_modes = len(panels.designs.members) > 1
    for low, high in zip(panels.low, panels.high, strict=True):
        number = max(FEWEST, round(rays * (high - low) / total) + 1)
        # Denser towards the ends, where cusps are thin and corners sharp.
        theta = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.linspace(0, np.pi, number))
        steps = np.zeros(2, dtype=np.intp)
        for attempt in range(len(BESIDE)):
            # At its very ends a panel may meet the intervals of its neighbour, or lack one that vanishes.
            first, last = (high - low) * np.array(BESIDE)[steps]
            angles = np.clip(theta, low + first, high - last)
            traced = panels.trace(np.zeros(number, dtype=np.intp), angles, SLACK)
            near = SAME_ROOT * float(panels.reach[0])
            ray, inner, outer, enters, leaves = traced.modes(near) if in_modes else traced.whole(near)
            counts = np.bincount(ray, minlength=number)
            usual = _most(counts)
            lost = counts[[0, -1]] != usual
            if attempt == 0:
                lost |= (traced.counts[[0, -1]] != traced.counts[number // 2]).any()
            if not lost.any():
                break
            steps = np.minimum(steps + lost, len(BESIDE) - 1)
        kept = np.flatnonzero(counts == usual)
        begins = np.searchsorted(ray, kept)
        for slot in range(usual):
            row: Ints = begins + slot
            ends = _most(enters[row]), _most(leaves[row])
            yield Patch(panels.designs.about, angles[kept], inner[row], outer[row], *ends)


def patches_of_pieces(whole: Panels, pieces: Iterable[Panels], rays: int) -> list[Patch]:
    """Patches of a single design, by the panels of each piece, with about `rays` rays over the whole of them."""
    total = float(np.sum(whole.high - whole.low))
    all_patches = []
    for number, panels in enumerate(pieces, start=1):
        share = round(rays * float(np.sum(panels.high - panels.low)) / total)
        all_patches += [replace(patch, piece=number) for patch in patches(panels, share)]
    return all_patches


def _most(values: Ints) -> int:
    """The most frequent value of the rays: a ray through a corner may meet another margin than the rest."""
    names, counts = np.unique(values, return_counts=True)
    return int(names[np.argmax(counts)])
