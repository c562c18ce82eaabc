"""Pieces of regions: what hangs together, found from the intervals of neighbouring panels.

Within a panel every interval of a ray (its slot) goes on from ray to ray. Where two panels meet, slots hang together
that overlap on the ray between them. A piece is what hangs together so; where the scan is less than a turn it ends at
its sides. The first piece of a design is the one that holds the point's place in the sketch, or else the largest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.rays import SAME, Designs, Intervals, trace
from mechdesign.analyses.region.rules import cubic, spread
from mechdesign.mechanism.variant import drawn, elsewhere
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Rays beside the ends of panels (radians, but never more than this part of the panel), until one meets what the panel's
# other rays meet. Nearer than the first, breaks have been put together.
BESIDE, PART = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2), 0.125
# Pieces that only touch in a point overlap twice as much twice as far from it: of others there is less than so much.
TOUCHES = 1.75
# Not at half of a panel: by symmetry a single point may divide the ray there.
MIDDLE = 0.4871
# Nodes of the area by which pieces are put in order; as parts of all areas that near to each other are equal, and
# smaller ones are slits that rounding has left.
NODES, EQUAL, NOTHING = 8, 1e-4, 1e-10


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of the regions of all designs.

    Parameters
    ----------
    scan : (float, float)
    number : ndarray of int, shape (designs,)
        How many pieces each region has; 0 where it is empty.
    drawn : ndarray of bool, shape (designs,)
        Whether the first of several pieces holds the point's place in the sketch.
    slots : ndarray of int, shape (panels,)
        Intervals of each panel's rays, for designs of several pieces; else 0.
    piece : ndarray of int, shape (slots of all panels,)
        Of each slot of each panel, outwards; -1 where it has no area.
    """

    designs: Designs
    panels: Panels
    scan: tuple[float, float]
    number: Ints
    drawn: Flags
    slots: Ints
    piece: Ints

    @staticmethod
    def of(designs: Designs, panels: Panels, scan: tuple[float, float], samples: int) -> Pieces:
        """Find the pieces of all regions.

        Parameters
        ----------
        scan : (float, float)
            First and last angle of the rays.
        samples : int
            Samples of each ray.
        """
        some = _doubtful(panels, scan, designs.count)
        none = np.zeros(0, dtype=np.intp)
        found = Pieces(
            designs, panels, scan, panels.closes.astype(np.intp), np.ones(designs.count, dtype=bool),
            np.zeros(len(panels.low), dtype=np.intp), none,
        )  # fmt: skip
        if not some.any():
            return found
        of_some = np.flatnonzero(some[panels.design])
        slots = found.slots.copy()
        slots[of_some] = found._traced(of_some, MIDDLE, samples).counts
        found = replace(found, slots=slots)
        label, parts = found._joined(of_some, samples)
        owner = np.full(parts, -1)
        owner[label] = panels.design[found._panel]
        several = np.bincount(owner, minlength=designs.count) > 1
        label, slots = label[several[owner[label]]], np.where(several[panels.design], slots, 0)
        number = np.where(several, np.bincount(owner, minlength=designs.count), found.number)
        found = replace(found, slots=slots, piece=label, number=number)
        return found._ordered(owner, np.flatnonzero(several), samples) if several.any() else found

    def only(self, piece: int) -> tuple[Designs, Panels]:
        """The designs with their regions taken for one piece of each (from 0), and its panels."""
        if not self.slots.any():
            return self.designs, self.panels
        has = np.bincount(self._panel[self.piece == piece], minlength=len(self.slots)) > 0
        use = has | (self.slots == 0)
        panels = replace(
            self.panels, design=self.panels.design[use], low=self.panels.low[use], high=self.panels.high[use],
            intervals=self.panels.intervals[use],
        )  # fmt: skip
        whole = self.designs
        return _OnePiece(whole.field, whole.places, whole.count, whole.about, self, piece), panels

    def all(self) -> Iterator[tuple[Designs, Panels]]:
        """Each piece of a single design, as `only`."""
        return (self.only(piece) for piece in range(int(self.number[0])))

    @property
    def _panel(self) -> Ints:
        """Panel of each slot."""
        return np.repeat(np.arange(len(self.slots)), self.slots)

    @property
    def _first(self) -> Ints:
        """First slot of each panel."""
        return np.cumsum(self.slots) - self.slots

    def _traced(self, panel: Ints, place: float | Floats, samples: int) -> Intervals:
        """Rays of panels, at a part of their width."""
        panels = self.panels
        theta = panels.low[panel] + place * (panels.high - panels.low)[panel]
        return trace(self.designs, panels.design[panel], theta, panels.reach[panels.design[panel]], samples)

    def _joined(self, panel: Ints, samples: int) -> tuple[Ints, int]:
        """A label for each slot of the panels, the same where they hang together, and the number of labels."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        panels, total = self.panels, int(self.slots.sum())
        after = panel + 1
        meets = np.isin(after, panel)
        one, other = panel[meets], after[meets]
        same = (panels.design[one] == panels.design[other]) & (panels.high[one] == panels.low[other])
        one, other = one[same], other[same]
        if _is_turn(self.scan):
            start = panel[panels.low[panel] == self.scan[0]]
            stop = panel[panels.high[panel] == self.scan[1]]
            _, at_start, at_stop = np.intersect1d(panels.design[start], panels.design[stop], return_indices=True)
            one, other = np.concatenate([one, stop[at_stop]]), np.concatenate([other, start[at_start]])
        low, high = self._ends(panel, -1, samples), self._ends(panel, 1, samples)
        pairs = []
        for a in range(int(self.slots[one].max(initial=0))):
            for b in range(int(self.slots[other].max(initial=0))):
                some = np.flatnonzero((a < self.slots[one]) & (b < self.slots[other]))
                i, j = self._first[one[some]] + a, self._first[other[some]] + b
                near, far = np.minimum(high[1][:, i], low[1][:, j]) - np.maximum(high[0][:, i], low[0][:, j])
                joined = (near > 0) & (far < TOUCHES * near)
                pairs.append(np.stack([i[joined], j[joined]]))
        edges = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0), dtype=np.intp)
        graph = coo_array((np.ones(edges.shape[1]), (edges[0], edges[1])), shape=(total, total))
        parts, label = connected_components(graph, directed=False)
        return np.asarray(label, dtype=np.intp), int(parts)

    def _ends(self, panel: Ints, side: int, samples: int) -> Floats:
        """Both radii of each slot, beside an end of its panel and twice as far from it; shape (2, 2, slots)."""
        width = self.panels.high - self.panels.low
        radii = np.full((2, 2, int(self.slots.sum())), np.nan)
        for step in BESIDE:
            part = np.minimum(step / width[panel], PART)
            place = np.concatenate([part, 2 * part])
            found = self._traced(np.tile(panel, 2), place if side < 0 else 1 - place, samples)
            fits = (found.counts.reshape(2, -1) == self.slots[panel]).all(axis=0)
            ray = np.flatnonzero(np.tile(fits, 2)[found.ray])
            slot = np.arange(len(found.ray)) - np.searchsorted(found.ray, found.ray)
            far, of = np.divmod(found.ray[ray], len(panel))
            at = self._first[panel[of]] + slot[ray]
            radii[0, far, at], radii[1, far, at] = found.inner[ray], found.outer[ray]
            panel = panel[~fits]
            if not panel.size:
                break
        return radii

    def _ordered(self, owner: Ints, several: Ints, samples: int) -> Pieces:
        """Pieces numbered within each design: the sketch's first, then by area."""
        label, parts, designs = self.piece, len(owner), self.designs
        panel = np.flatnonzero(self.slots)
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        low, high = self.panels.low[panel], self.panels.high[panel]
        theta, density = spread(low, high, 0.5 + 0.5 * nodes[:, None], cubic)
        weight = (0.5 * density * weights[:, None]).ravel()
        design = np.tile(self.panels.design[panel], NODES)
        found = trace(designs, design, theta.ravel(), self.panels.reach[design], samples)
        slot = self.slots_of(design, theta.ravel(), found, samples)
        sector = 0.5 * weight[found.ray] * (found.outer - found.inner) * (found.outer + found.inner)
        area = np.bincount(label[slot], sector, parts)
        whole = np.bincount(owner, area, designs.count)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = area / whole[owner]
        held = self._holding(several, samples)
        share[label[held[held >= 0]]] = np.inf
        slit = share < NOTHING
        drawn = self.drawn.copy()
        drawn[several[held < 0]] = False
        # Of equal ones the first along the scan.
        order = np.lexsort((np.arange(parts), -np.round(share / EQUAL), slit, owner))
        rank = np.empty(parts, dtype=np.intp)
        rank[order] = np.arange(parts) - np.searchsorted(owner[order], owner[order])
        rank[slit] = -1
        number = self.number - np.bincount(owner[slit & (owner >= 0)], minlength=designs.count)
        return replace(self, piece=rank[label], drawn=drawn, number=number)

    def _holding(self, design: Ints, samples: int) -> Ints:
        """The slot that holds the point's place in the sketch; -1 where none does."""
        place = self._sketched(design) - self.designs.about
        reach = self.panels.reach[design]
        theta = self.scan[0] + (np.angle(place) - self.scan[0]) % (2 * np.pi)
        # At the centre of the scan one ray is as good as another.
        centre = np.abs(place) <= SAME * reach
        theta = np.where(centre, self.scan[0] + MIDDLE * (self.scan[1] - self.scan[0]), theta)
        radius = np.where(centre, 0.0, np.abs(place))
        held = np.full(len(design), -1, dtype=np.intp)
        known = np.flatnonzero(np.isfinite(place) & (theta <= self.scan[1]))
        if not known.size:
            return held
        found = trace(self.designs, design[known], theta[known], reach[known], samples)
        slot = self.slots_of(design[known], theta[known], found, samples)
        at = radius[known][found.ray]
        inside = (found.inner <= at) & (at <= found.outer)
        held[known[found.ray[inside]]] = slot[inside]
        return held

    def _sketched(self, design: Ints) -> Complexes:
        """The point's place in the sketch of each design: its drives as drawn, as far as it can be assembled so."""
        field, places = self.designs.field, self.designs.of(design)
        mechanism, (x, y) = field.mechanism, field.outputs[:2]
        if not places:
            sketch = mechanism.sketch_configuration
            return np.full(len(design), complex(float(sketch.value(x)), float(sketch.value(y))))
        poses = drawn(mechanism, places)
        found = np.asarray(poses.value(x) + 1j * poses.value(y), dtype=complex)
        found = np.where(poses.valid, found, complex(np.nan, np.nan))
        for k in [] if mechanism.forward.iterative else np.flatnonzero(~poses.valid).tolist():
            pose = elsewhere(mechanism, {name: value[k] for name, value in places.items()})
            found[k] = complex(float(pose.value(x)), float(pose.value(y)))
        return found

    def slots_of(self, design: Ints, theta: Floats, found: Intervals, samples: int) -> Ints:
        """The slot of each interval of rays of designs with several pieces; -1 where it is unknown."""
        panel = self._panel_at(design, theta)
        number, first = np.append(self.slots, -1), np.append(self._first, -1)
        order = np.arange(len(found.ray)) - np.searchsorted(found.ray, found.ray)
        plain = found.counts == number[panel]
        slot = np.where(plain[found.ray], first[panel][found.ray] + order, -1)
        # Rays through the end of a panel, or through a single point that divides them, are compared with their
        # neighbours' on either side.
        for step in BESIDE:
            left = np.flatnonzero(slot < 0)
            if not left.size:
                break
            rays, at = np.unique(found.ray[left], return_inverse=True)
            overlap = np.full(len(left), -np.inf)
            for turned in (theta[rays] - step, theta[rays] + step):
                if _is_turn(self.scan):
                    turned = self.scan[0] + (turned - self.scan[0]) % (2 * np.pi)
                beside = trace(self.designs, design[rays], turned, self.panels.reach[design[rays]], samples)
                there = self._panel_at(design[rays], turned)
                begin = np.searchsorted(beside.ray, np.arange(len(rays)))
                number_there = np.where(beside.counts == number[there], number[there], 0)
                for k in range(int(number_there.max(initial=0))):
                    has = k < number_there[at]
                    other = np.minimum(begin[at] + k, len(beside.ray) - 1)
                    more = np.minimum(found.outer[left], beside.outer[other])
                    more -= np.maximum(found.inner[left], beside.inner[other])
                    better = has & (more > overlap)
                    overlap = np.where(better, more, overlap)
                    slot[left[better]] = first[there[at[better]]] + k
        return slot

    def _panel_at(self, design: Ints, theta: Floats) -> Ints:
        """Panel of each ray; -1 where there is none."""
        panel = np.flatnonzero(self.slots)
        names, rank = np.unique(self.panels.design[panel], return_inverse=True)
        # One key for design and angle.
        start, room = self.scan[0], 8.0
        key = room * rank + self.panels.low[panel] - start
        at = (
            np.searchsorted(key, room * np.searchsorted(names, design) + np.clip(theta - start, 0, 7), side="right") - 1
        )
        here = panel[np.maximum(at, 0)]
        inside = (at >= 0) & (self.panels.design[here] == design) & (theta <= self.panels.high[here])
        return np.where(inside, here, -1)


@dataclass(frozen=True, eq=False)
class _OnePiece(Designs):
    """Designs whose rays meet one piece of their region only."""

    pieces: Pieces
    piece: int

    def traced(self, design: Ints, theta: Floats, reach: Floats, samples: int, slack: float) -> Intervals:
        """As `Designs.traced`."""
        pieces = self.pieces
        found = pieces.designs.traced(design, theta, reach, samples, slack)
        rays = np.flatnonzero(pieces.number[design] > 1)
        if not rays.size:
            return found
        numbered = np.full(len(design), -1)
        numbered[rays] = np.arange(len(rays))
        some = np.flatnonzero(numbered[found.ray] >= 0)
        part = replace(
            found, ray=numbered[found.ray[some]], inner=found.inner[some], outer=found.outer[some],
            beyond=found.beyond[rays],
        )  # fmt: skip
        slot = pieces.slots_of(design[rays], theta[rays], part, samples)
        keep = np.ones(len(found.ray), dtype=bool)
        keep[some] = np.where(slot >= 0, pieces.piece[slot] == self.piece, self.piece == 0)
        return found.kept(keep)


def _is_turn(scan: tuple[float, float]) -> bool:
    return scan[1] - scan[0] >= 2 * np.pi * (1 - 1e-12)


def _doubtful(panels: Panels, scan: tuple[float, float], count: int) -> Flags:
    """Designs whose region may have several pieces: several intervals a ray, or rays between that meet nothing."""
    doubtful = np.bincount(panels.design[panels.intervals != 1], minlength=count) > 0
    apart = panels.low[1:] != panels.high[:-1]
    begins = np.append(True, apart | (panels.design[1:] != panels.design[:-1]))[: len(panels.low)]
    runs = np.bincount(panels.design[begins], minlength=count)
    if _is_turn(scan):
        at_start, at_stop = (
            np.bincount(panels.design[end], minlength=count)
            for end in (panels.low == scan[0], panels.high == scan[1])
        )  # fmt: skip
        runs = runs - (at_start & at_stop)
    return np.asarray(doubtful | (runs > 1))
