"""Pieces of regions: what hangs together, found from the intervals of neighbouring panels.

Within a panel every interval of a ray goes on from ray to ray. Where two panels meet, intervals hang together that
overlap on the ray between them. A piece is what hangs together so; where the scan is less than a turn it ends at
its sides. The first piece of a design is the one that holds the point's place in the sketch, or else the largest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.rays import Intervals, is_turn
from mechdesign.analyses.region.rules import cubic, spread
from mechdesign.mechanism.algebra import picked
from mechdesign.mechanism.mechanism import drawn, elsewhere
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Rays beside the ends of panels (radians, but never more than this part of the panel), until one meets what the panel's
# other rays meet. Nearer than the first, breaks have been put together.
BESIDE = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
PART = 0.125
# Pieces that only touch in a point overlap twice as much twice as far from it: of others there is less than so much.
TOUCHES = 1.75
# Nodes of the area by which pieces are put in order.
NODES = 8
# Areas as near as this, as parts of the whole, are equal; smaller ones than the second are slits that rounding leaves.
EQUAL = 1e-4
SLIT = 1e-10
# The piece of an interval that overlaps none on the rays on either side.
UNKNOWN = -2


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of the regions of all designs.

    Parameters
    ----------
    number : ndarray of int, shape (designs,)
        How many pieces each region has; 0 where it is empty.
    drawn : ndarray of bool, shape (designs,)
        Whether the first of several pieces holds the point's place in the sketch.
    counts : ndarray of int, shape (panels,)
        Intervals of each panel's rays, for designs of several pieces; else 0.
    piece : ndarray of int, shape (panels, most intervals)
        Of each interval of each panel, outwards; -1 where there is none, or it has no area.
    """

    panels: Panels
    number: Ints
    drawn: Flags
    counts: Ints
    piece: Ints

    @staticmethod
    def of(panels: Panels) -> Pieces:
        """Find the pieces of all regions."""
        counts, designs = np.zeros(len(panels.low), dtype=np.intp), len(panels.closes)
        number, drawn = panels.closes.astype(np.intp), np.ones(designs, dtype=bool)
        found = Pieces(panels, number, drawn, counts, np.zeros((len(counts), 0), dtype=np.intp))
        panel = np.flatnonzero(_doubtful(panels)[panels.design])
        if not panel.size:
            return found
        counts[panel] = panels.intervals[panel]
        label = found._joined()
        owner = np.full(label.max(initial=-1) + 1, -1)
        owner[label[label >= 0]] = np.repeat(panels.design, counts)
        number = np.bincount(owner, minlength=designs)
        several = number > 1
        found = replace(
            found, piece=label, number=np.where(several, number, found.number),
            counts=np.where(several[panels.design], counts, 0),
        )  # fmt: skip
        return found._ordered(owner, np.flatnonzero(several)) if several.any() else found

    def only(self, piece: int) -> Panels:
        """The panels of one piece of each design (from 0), whose rays meet nothing else."""
        whole = self.panels
        if not self.counts.any():
            return whole
        use = (self.piece == piece).any(axis=1) | (self.counts == 0)
        own = {name: getattr(whole, name)[use] for name in ("design", "low", "high", "intervals")}
        return _OnePiece(**{**vars(whole), **own}, pieces=self, piece=piece)

    def all(self) -> Iterator[Panels]:
        """The panels of each piece of a single design."""
        return (self.only(piece) for piece in range(int(self.number[0])))

    def _joined(self) -> Ints:
        """A label for each interval of each panel, the same where they hang together; -1 where there is none."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        panels, has = self.panels, np.arange(self.counts.max()) < self.counts[:, None]
        number = np.where(has, np.cumsum(has).reshape(has.shape) - 1, -1)
        one = np.flatnonzero((panels.design[1:] == panels.design[:-1]) & (panels.high[:-1] == panels.low[1:]))
        other = one + 1
        if is_turn(panels.designs.scan):
            begin, end = panels.designs.scan
            start, stop = np.flatnonzero(panels.low == begin), np.flatnonzero(panels.high == end)
            _, at_start, at_stop = np.intersect1d(panels.design[start], panels.design[stop], return_indices=True)
            one, other = np.concatenate([one, stop[at_stop]]), np.concatenate([other, start[at_start]])
        before = self._ends(1)[:, :, one, :, None]
        after = self._ends(-1)[:, :, other, None, :]
        near, far = np.minimum(before[1], after[1]) - np.maximum(before[0], after[0])
        pair, a, b = np.nonzero((near > 0) & (far < TOUCHES * near))
        edges, total = (number[one[pair], a], number[other[pair], b]), int(has.sum())
        graph = coo_array((np.ones(len(pair)), edges), shape=(total, total))
        label = np.full(has.shape, -1)
        label[has] = connected_components(graph, directed=False)[1]
        return label

    def _ends(self, side: int) -> Floats:
        """Both radii of each interval, beside an end of its panel and twice as far; (2, 2, panels, most intervals)."""
        panels = self.panels
        width = panels.high - panels.low
        radii = np.full((2, 2, len(width), self.counts.max()), np.nan)
        panel = np.flatnonzero(self.counts)
        for step in BESIDE:
            part = np.minimum(step / width[panel], PART)
            place, both = np.concatenate([part, 2 * part]), np.tile(panel, 2)
            theta = panels.low[both] + (place if side < 0 else 1 - place) * width[both]
            found = panels.trace(panels.design[both], theta)
            fits = (found.counts.reshape(2, -1) == self.counts[panel]).all(axis=0)
            far, of = np.divmod(found.ray, len(panel))
            use = fits[of]
            at = far[use], panel[of[use]], found.slot[use]
            radii[0][at], radii[1][at] = found.inner[use], found.outer[use]
            panel = panel[~fits]
            if not panel.size:
                break
        return radii

    def _ordered(self, owner: Ints, several: Ints) -> Pieces:
        """Pieces numbered within each design: the sketch's first, then by area."""
        parts, designs = len(owner), len(self.number)
        panel = np.flatnonzero(self.counts)
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        low, high = self.panels.low[panel], self.panels.high[panel]
        theta, density = spread(low, high, 0.5 + 0.5 * nodes[:, None], cubic)
        weight = (0.5 * density * weights[:, None]).ravel()
        design = np.tile(self.panels.design[panel], NODES)
        found = self.panels.trace(design, theta.ravel())
        label = self.of_intervals(design, theta.ravel(), found)
        sector = 0.5 * weight[found.ray] * (found.outer - found.inner) * (found.outer + found.inner)
        area = np.bincount(label[label >= 0], sector[label >= 0], parts)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = area / np.bincount(owner, area, designs)[owner]
        held = self._holding(several)
        share[held[held >= 0]] = np.inf
        slit = share < SLIT
        drawn = self.drawn.copy()
        drawn[several[held < 0]] = False
        # Of equal ones the first along the scan.
        order = np.lexsort((np.arange(parts), -np.round(share / EQUAL), slit, owner))
        rank = np.empty(parts + 1, dtype=np.intp)
        rank[order] = np.arange(parts) - np.searchsorted(owner[order], owner[order])
        rank[:-1][slit] = rank[-1] = -1
        number = self.number - np.bincount(owner[slit], minlength=designs)
        return replace(self, piece=rank[self.piece], drawn=drawn, number=number)

    def _holding(self, design: Ints) -> Ints:
        """The piece that holds the point's place in the sketch; -1 where none does."""
        theta, found, inside = self.panels.through(design, self._sketched(design))
        held = np.full(len(design), -1, dtype=np.intp)
        held[found.ray[inside]] = self.of_intervals(design, theta, found)[inside]
        return held

    def _sketched(self, design: Ints) -> Complexes:
        """The point's place in the sketch of each design: its drives as drawn, as far as it can be assembled so."""
        field, places = self.panels.designs.field, self.panels.designs.of(design)
        mechanism, (x, y) = field.mechanism, field.outputs[:2]
        poses = drawn(mechanism, places)
        valid = np.broadcast_to(poses.valid, design.shape)
        found = np.where(valid, poses.value(x) + 1j * poses.value(y), complex(np.nan, np.nan))
        for k in [] if mechanism.forward.iterative else np.flatnonzero(~valid).tolist():
            pose = elsewhere(mechanism, {name: picked(value, k) for name, value in places.items()})
            found[k] = complex(float(pose.value(x)), float(pose.value(y)))
        return found

    def of_intervals(self, design: Ints, theta: Floats, found: Intervals) -> Ints:
        """The piece of each interval of rays; -1 where it has no area, 0 for all of a design of one piece."""
        piece = np.where(self.number[design[found.ray]] > 1, self._of_counted(design, theta, found), 0)
        # Rays through the end of a panel, or through a single point that divides them, are compared with two beside.
        for step in BESIDE:
            left = np.unique(found.ray[piece == UNKNOWN])
            if not left.size:
                break
            turned = (theta[left] + step * np.array([[-1], [1]])).ravel()
            if is_turn(self.panels.designs.scan):
                begin = self.panels.designs.scan[0]
                turned = begin + (turned - begin) % (2 * np.pi)
            owner = np.tile(design[left], 2)
            beside = self.panels.trace(owner, turned)
            names = self._of_counted(owner, turned, beside)
            some = np.flatnonzero(np.isin(found.ray, left))
            at = np.searchsorted(left, found.ray[some])
            ends = beside.by_ray(beside.inner, beside.outer, names)
            inner, outer, told = np.concatenate([ends[..., at], ends[..., len(left) + at]], axis=1)
            overlap = np.minimum(found.outer[some], outer) - np.maximum(found.inner[some], inner)
            overlap = np.where(np.isnan(overlap) | (told == UNKNOWN), -np.inf, overlap)
            if len(overlap):
                best = overlap.argmax(axis=0), np.arange(len(some))
                piece[some] = np.where(np.isinf(overlap[best]), UNKNOWN, told[best])
        return piece

    def _of_counted(self, design: Ints, theta: Floats, found: Intervals) -> Ints:
        """The piece of each interval of rays; unknown where a ray has more or fewer of them than its panel."""
        panels = self.panels
        # NumPy orders complex numbers by both parts.
        panel = np.searchsorted(panels.design + 1j * panels.low, design + 1j * theta, side="right") - 1
        plain = (panel >= 0) & (panels.design[panel] == design) & (theta <= panels.high[panel])
        plain &= found.counts == self.counts[panel]
        slot = np.minimum(found.slot, self.piece.shape[1] - 1)
        return np.where(plain[found.ray], self.piece[panel[found.ray], slot], UNKNOWN)


@dataclass(frozen=True, eq=False)
class _OnePiece(Panels):
    """Panels whose rays meet one piece of each region only."""

    pieces: Pieces
    piece: int

    def trace(self, design: Ints, theta: Floats, slack: float = 0.0) -> Intervals:
        """As `Panels.trace`."""
        found = super().trace(design, theta, slack)
        piece = self.pieces.of_intervals(design, theta, found)
        return found.kept((piece == self.piece) | ((piece == UNKNOWN) & (self.piece == 0)))


def _doubtful(panels: Panels) -> Flags:
    """Designs whose region may have several pieces: several intervals a ray, or rays between that meet nothing."""
    scan, count = panels.designs.scan, len(panels.closes)
    doubtful = np.bincount(panels.design[panels.intervals != 1], minlength=count) > 0
    apart = panels.low[1:] != panels.high[:-1]
    begins = np.append(True, apart | (panels.design[1:] != panels.design[:-1]))[: len(panels.low)]
    runs = np.bincount(panels.design[begins], minlength=count)
    if is_turn(scan):
        ends = (panels.low == scan[0], panels.high == scan[1])
        at_start, at_stop = (np.bincount(panels.design[end], minlength=count) for end in ends)
        runs = runs - (at_start & at_stop)
    return np.asarray(doubtful | (runs > 1))
