"""Connected pieces of regions, from the intervals of neighbouring panels.

Within a panel each interval continues from ray to ray. Where two panels meet, intervals are connected if they overlap
on the ray between them. A piece is a set of connected intervals; a scan of less than a turn cuts it at both sides. The
first piece of a design is the one that holds the point's place in the sketch, or else the largest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import picked
from mechdesign.mechanism.mechanism import drawn, elsewhere
from mechdesign.region.intervals import SAME_ROOT, Intervals
from mechdesign.region.panels import MIDDLE, Panels, find_panels
from mechdesign.region.rays import Scanned, is_turn
from mechdesign.region.rules import cubic, spread

# Distances of rays from the end of a panel (radians), tried one after the other until a ray meets as many intervals as
# the panel's other rays; then the ray that stands for the panel does, as all of it may be no wider than a break is
# known. Breaks nearer to each other than the first distance have been made one.
BESIDE = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
# The largest such distance, as a fraction of the panel.
PART = 0.125
# Two pieces that only touch at a point overlap beside it in proportion to the distance: at twice the distance twice as
# much. Intervals are connected if the overlap grows by less than this factor.
TOUCHES = 1.75
# Quadrature nodes of a panel for the areas by which pieces are ordered.
NODES = 8
# Areas that differ by less than this fraction of the region are equal.
EQUAL = 1e-4
# Pieces smaller than this fraction of the region are slits that rounding leaves.
SLIT = 1e-10
# Number of the piece of an interval that overlaps no interval of the rays on either side.
UNKNOWN = -2


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of the regions of all designs.

    Parameters
    ----------
    number : ndarray of int, shape (designs,)
        Number of pieces of each region; 0 where it is empty.
    drawn : ndarray of bool, shape (designs,)
        Whether the first of several pieces holds the point's place in the sketch.
    counts : ndarray of int, shape (panels,)
        Number of intervals of each panel's rays in designs of several pieces; 0 in the other designs.
    piece : ndarray of int, shape (panels, largest count)
        Piece of each interval of a panel, outwards; -1 beyond its last interval, and where an interval has no area.
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
        pieces = Pieces(panels, number, drawn, counts, np.zeros((len(counts), 0), dtype=np.intp))
        panel = np.flatnonzero(_doubtful(panels)[panels.design])
        if not panel.size:
            return pieces
        counts[panel] = panels.intervals[panel]
        label = pieces._joined()
        owner = np.full(label.max(initial=-1) + 1, -1)
        owner[label[label >= 0]] = np.repeat(panels.design, counts)
        number = np.bincount(owner, minlength=designs)
        several = number > 1
        pieces = replace(
            pieces, piece=label, number=np.where(several, number, pieces.number),
            counts=np.where(several[panels.design], counts, 0),
        )  # fmt: skip
        return pieces._ordered(owner, np.flatnonzero(several)) if several.any() else pieces

    def only(self, piece: int) -> Panels:
        """The panels of one piece of each design (from 0), whose rays meet no other piece."""
        if not self.counts.any():
            return self.panels
        use = (self.piece == piece).any(axis=1) | (self.counts == 0)
        of_panels = {name: getattr(self.panels, name)[use] for name in ("design", "low", "high", "intervals")}
        return _OnePiece(**{**vars(self.panels), **of_panels}, pieces=self, piece=piece)

    def all(self) -> Iterator[Panels]:
        """The panels of each piece of a single design."""
        return (self.only(piece) for piece in range(int(self.number[0])))

    def _joined(self) -> Ints:
        """A label for each interval of each panel, the same for connected ones; -1 beyond a panel's last interval."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        panels, has = self.panels, np.arange(self.counts.max()) < self.counts[:, None]
        number = np.where(has, np.cumsum(has).reshape(has.shape) - 1, -1)
        lower = np.flatnonzero((panels.design[1:] == panels.design[:-1]) & (panels.high[:-1] == panels.low[1:]))
        upper = lower + 1
        if is_turn(panels.designs.scan):
            begin, end = panels.designs.scan
            start, stop = np.flatnonzero(panels.low == begin), np.flatnonzero(panels.high == end)
            _, at_start, at_stop = np.intersect1d(panels.design[start], panels.design[stop], return_indices=True)
            lower, upper = np.concatenate([lower, stop[at_stop]]), np.concatenate([upper, start[at_start]])
        below = self._ends(1)[:, :, lower, :, None]
        above = self._ends(-1)[:, :, upper, None, :]
        overlap, overlap_farther = np.minimum(below[1], above[1]) - np.maximum(below[0], above[0])
        pair, a, b = np.nonzero((overlap > 0) & (overlap_farther < TOUCHES * overlap))
        # Where one assembly mode takes over from another the next interval of a ray begins at the end of the last.
        inner, outer = self._ends(-1)[:, 0]
        panel, slot = np.nonzero(inner[:, 1:] - outer[:, :-1] <= SAME_ROOT * panels.reach[panels.design][:, None])
        ends = [number[lower[pair], a], number[panel, slot]], [number[upper[pair], b], number[panel, slot + 1]]
        edges, total = tuple(np.concatenate(side) for side in ends), int(has.sum())
        graph = coo_array((np.ones(len(edges[0])), edges), shape=(total, total))
        label = np.full(has.shape, -1)
        label[has] = connected_components(graph, directed=False)[1]
        return label

    def _ends(self, side: int) -> Floats:
        """Radii of the intervals of each panel beside its lower end (`side` -1) or its upper one (1).

        Shape (2, 2, panels, largest count): inner and outer radii, at a distance from the end and at twice that.
        """
        panels = self.panels
        width = panels.high - panels.low
        radii = np.full((2, 2, len(width), self.counts.max()), np.nan)
        panel = np.flatnonzero(self.counts)
        for step in (*BESIDE, np.inf):
            distance, tested = np.minimum(step / width[panel], PART) * np.array([[1], [2]]), np.tile(panel, 2)
            place = MIDDLE if np.isinf(step) else (distance if side < 0 else 1 - distance).ravel()
            theta = panels.low[tested] + place * width[tested]
            traced = panels.trace(panels.design[tested], theta)
            complete = (traced.counts.reshape(2, -1) == self.counts[panel]).all(axis=0)
            farther, panel_of = np.divmod(traced.ray, len(panel))
            used = complete[panel_of]
            interval_at = farther[used], panel[panel_of[used]], traced.slot[used]
            radii[0][interval_at], radii[1][interval_at] = traced.inner[used], traced.outer[used]
            panel = panel[~complete]
            if not panel.size:
                break
        return radii

    def _ordered(self, owner: Ints, several: Ints) -> Pieces:
        """Pieces numbered within each design: first the one that holds the sketch's place, then by decreasing area."""
        parts, designs = len(owner), len(self.number)
        panel = np.flatnonzero(self.counts)
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        low, high = self.panels.low[panel], self.panels.high[panel]
        theta, density = spread(low, high, 0.5 + 0.5 * nodes[:, None], cubic)
        weight = (0.5 * density * weights[:, None]).ravel()
        design = np.tile(self.panels.design[panel], NODES)
        traced = self.panels.trace(design, theta.ravel())
        label = self.of_intervals(design, theta.ravel(), traced)
        sector = 0.5 * weight[traced.ray] * (traced.outer - traced.inner) * (traced.outer + traced.inner)
        area = np.bincount(label[label >= 0], sector[label >= 0], parts)
        share = area / np.bincount(owner, area, designs)[owner]
        sketched = self._holding(several)
        share[sketched[sketched >= 0]] = np.inf
        slit = share < SLIT
        drawn = self.drawn.copy()
        drawn[several[sketched < 0]] = False
        # Pieces of equal area are ordered along the scan.
        order = np.lexsort((np.arange(parts), -np.round(share / EQUAL), slit, owner))
        rank = np.empty(parts + 1, dtype=np.intp)
        rank[order] = np.arange(parts) - np.searchsorted(owner[order], owner[order])
        rank[:-1][slit] = rank[-1] = -1
        number = self.number - np.bincount(owner[slit], minlength=designs)
        return replace(self, piece=rank[self.piece], drawn=drawn, number=number)

    def _holding(self, design: Ints) -> Ints:
        """The label of the piece that holds the point's place in the sketch, of each design; -1 where none does."""
        theta, traced, inside = self.panels.through(design, self._sketched(design))
        label = np.full(len(design), -1, dtype=np.intp)
        label[traced.ray[inside]] = self.of_intervals(design, theta, traced)[inside]
        return label

    def _sketched(self, design: Ints) -> Complexes:
        """The point's place in the sketch of each design, with the drives as drawn if it can be assembled so."""
        field, places = self.panels.designs.field, self.panels.designs.of(design)
        mechanism, (x, y) = field.mechanism, field.outputs[:2]
        poses = drawn(mechanism, places)
        valid = np.broadcast_to(poses.valid, design.shape)
        place = np.where(valid, poses.value(x) + 1j * poses.value(y), complex(np.nan, np.nan))
        for k in [] if mechanism.forward.iterative else np.flatnonzero(~valid).tolist():
            pose = elsewhere(mechanism, {name: picked(value, k) for name, value in places.items()})
            place[k] = complex(float(pose.value(x)), float(pose.value(y)))
        return place

    @cached_property
    def _last(self) -> list[tuple[tuple[bytes, bytes, float], tuple[Intervals, Ints]]]:
        """The rays that were traced last."""
        return []

    def met(self, design: Ints, theta: Floats, slack: float) -> tuple[Intervals, Ints]:
        """Intervals of rays and the piece of each; the same rays are asked for by piece after piece."""
        rays = design.tobytes(), theta.tobytes(), slack
        if not (self._last and self._last[0][0] == rays):
            traced = self.panels.trace(design, theta, slack)
            self._last[:] = [(rays, (traced, self.of_intervals(design, theta, traced)))]
        return self._last[0][1]

    def of_intervals(self, design: Ints, theta: Floats, traced: Intervals) -> Ints:
        """The piece of each interval of traced rays; -1 where it has no area, 0 in a design of one piece."""
        piece = np.where(self.number[design[traced.ray]] > 1, self._of_counted(design, theta, traced), 0)
        # A ray at the end of a panel, or through a single point that divides an interval, is compared with two rays
        # beside it: an interval belongs to the piece that it overlaps most there.
        for step in BESIDE:
            open_rays = np.unique(traced.ray[piece == UNKNOWN])
            if not open_rays.size:
                break
            turned = (theta[open_rays] + step * np.array([[-1], [1]])).ravel()
            if is_turn(self.panels.designs.scan):
                begin = self.panels.designs.scan[0]
                turned = begin + (turned - begin) % (2 * np.pi)
            owner = np.tile(design[open_rays], 2)
            beside = self.panels.trace(owner, turned)
            names = self._of_counted(owner, turned, beside)
            undecided = np.flatnonzero(np.isin(traced.ray, open_rays))
            ray = np.searchsorted(open_rays, traced.ray[undecided])
            ends = beside.by_ray(beside.inner, beside.outer, names)
            inner, outer, labels = np.concatenate([ends[..., ray], ends[..., len(open_rays) + ray]], axis=1)
            overlap = np.minimum(traced.outer[undecided], outer) - np.maximum(traced.inner[undecided], inner)
            overlap = np.where(np.isnan(overlap) | (labels == UNKNOWN), -np.inf, overlap)
            if len(overlap):
                best = overlap.argmax(axis=0), np.arange(len(undecided))
                piece[undecided] = np.where(np.isinf(overlap[best]), UNKNOWN, labels[best])
        return piece

    def _of_counted(self, design: Ints, theta: Floats, traced: Intervals) -> Ints:
        """The piece of each interval; `UNKNOWN` where a ray has more or fewer intervals than the rays of its panel."""
        panels = self.panels
        # NumPy orders complex numbers by both parts.
        panel = np.searchsorted(panels.design + 1j * panels.low, design + 1j * theta, side="right") - 1
        regular = (panel >= 0) & (panels.design[panel] == design) & (theta <= panels.high[panel])
        regular &= traced.counts == self.counts[panel]
        slot = np.minimum(traced.slot, self.piece.shape[1] - 1)
        return np.where(regular[traced.ray], self.piece[panel[traced.ray], slot], UNKNOWN)


@dataclass(frozen=True, eq=False)
class _OnePiece(Panels):
    """Panels whose rays meet a single piece of each region."""

    pieces: Pieces
    piece: int

    def trace(self, design: Ints, theta: Floats, slack: float = 0.0) -> Intervals:
        """As `Panels.trace`, with the intervals of the piece only."""
        traced, piece = self.pieces.met(design, theta, slack)
        return traced.kept((piece == self.piece) | ((piece == UNKNOWN) & (self.piece == 0)))


def counted(designs: Scanned, cuts: tuple[float, ...] = ()) -> tuple[Panels, Pieces | None]:
    """The panels that count, of the first piece of each design or of all pieces in any assembly, and the pieces.

    Several designs whose pieces all count are not divided: None. `cuts` and errors as in `find_panels`.
    """
    panels, first = find_panels(designs, cuts), designs.field.same_assembly
    pieces = Pieces.of(panels) if first or designs.count == 1 else None
    return pieces.only(0) if pieces is not None and first else panels, pieces


def _doubtful(panels: Panels) -> Flags:
    """Designs whose region may have several pieces: some rays meet several intervals, or none among others that do."""
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
