"""A raster of a region: which cells of a box that holds all of it lie inside.

Rays about one point may pass a piece of a region by; cells cannot, if the piece is larger than they are. So the raster
says how far rays have to go, and between which of them something is hidden; and the number of its cells is an area
that shares nothing with the integrals but the margins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.region.rays import Designs, Intervals, ray_through
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# A box is drawn wider by this share, so that rounding leaves nothing outside.
ROOM = 1e-6
# Cells looked at at once.
BLOCK = 1 << 17
# Share of their area by which cells on the boundary may be miscounted, if they all err alike.
EDGE = 0.5
# Steps of the parabolas that lead to the lowest place of a margin, as parts of a cell, and the places of each.
PARABOLAS = (1.0, 0.1)
AROUND = np.array([0, 1, -1, 1j, -1j, 1 + 1j])
# Farthest that such a place is from a centre (cells).
FARTHEST = 1.0
# Times that a cell is divided in which a sliver may lie, and parts each way.
DIVISIONS, PARTS = 3, 4
# Times that a box is doubled whose outermost cells lie inside, where the mechanism's dimensions give no bound.
DOUBLINGS = 12


@dataclass(frozen=True, eq=False)
class Raster:
    """Cells of a box around the region of each design, by their centres.

    A circle larger than the one around a cell always holds a centre: pieces that hold one are met. Of each design the
    lower left corner of the box, width and height of a cell, both complex, and whether the centres of the cells lie in
    the region, shape (designs, rows, columns). And places in holes, and in slivers of the region, that no centre met,
    with their designs, and the area in which slivers may lie that are still thinner.
    """

    designs: Designs
    low: Complexes
    cell: Complexes
    inside: Flags
    holes: tuple[Ints, Complexes]
    slivers: tuple[Ints, Complexes]
    unseen: Floats

    @staticmethod
    def of(designs: Designs) -> Raster:
        """Look at places of each design, as many as the effort says each way, those within the scan."""
        cells, (begin, end) = designs.effort.cells, designs.scan
        low, high, bounded = _box(designs)
        for _ in range(DOUBLINGS):
            none = np.zeros(0, dtype=np.intp), np.zeros(0, dtype=complex)
            blank = np.zeros((designs.count, cells, cells), dtype=bool)
            found, holes = (
                Raster(designs, low, (high - low) / cells, blank, none, none, np.zeros(designs.count)),
                [none],
            )
            slivers = [none]
            for some, z in found._centres(np.arange(designs.count)):
                inside, margins = designs.look(z, some)
                holes.append(found._between_centres(some, z, margins, inside))
                slivers.append(found._thin(some, z, margins, inside))
                inside &= ray_through(z - designs.about, begin) <= end
                found.inside[some] = inside.T.reshape(-1, cells, cells)
            rim = found.inside.copy()
            rim[:, 1:-1, 1:-1] = False
            open_ = rim.any(axis=(1, 2)) & ~bounded
            if not open_.any():
                break
            size = np.where(open_, high - low, 0)
            low, high = low - 0.5 * size, high + 0.5 * size
        (owners, places), (thin, within) = zip(*holes, strict=True), zip(*slivers, strict=True)
        return replace(
            found, holes=(np.concatenate(owners), np.concatenate(places)),
            slivers=(np.concatenate(thin), np.concatenate(within)),
        )  # fmt: skip

    def _thin(self, some: Ints, z: Complexes, margins: Floats, inside: Flags) -> tuple[Ints, Complexes]:
        """Designs and places in the region where no centre around is: cells that no margin excludes are divided.

        Once, and then as long as that takes no more places than the raster. Parts left are unseen where nothing is met
        in the cell and every margin is positive somewhere around.
        """
        size = self.inside.shape[1]
        shape = size, size, len(some)
        place, centre = z.reshape(shape), inside.reshape(shape)
        for axis in (0, 1):
            ahead, behind = (np.roll(centre, step, axis) for step in (1, -1))
            centre = centre | ahead | behind
        row, column, lane = np.nonzero(_open(margins.reshape(len(margins), *shape)) & ~centre)
        design, place, cell = some[lane], place[row, column, lane], self.cell[some[lane]]
        owner, found, whole = design, np.full(len(lane), np.nan, dtype=complex), np.arange(len(lane))
        rises = np.zeros(len(lane), dtype=bool)
        parts = (np.arange(PARTS) - 0.5 * (PARTS - 1))[:, None]
        x, y = (part.reshape(-1, 1) for part in np.meshgrid(parts, parts))
        for division in range(DIVISIONS):
            if not len(design) or (division and len(design) * len(x) > z.size):
                break
            cell = cell / PARTS
            part = place + x * cell.real + 1j * y * cell.imag
            good, margins = self.designs.look(part, design, assembly=True)
            met = good.any(axis=0)
            found[whole[met]] = part[good.argmax(axis=0), np.arange(len(design))][met]
            left = _open(margins.reshape(len(margins), PARTS, PARTS, len(design))) & ~met
            at, lane = np.nonzero(left.reshape(len(x), len(design)))
            design, place, cell, whole = design[lane], part[at, lane], cell[lane], whole[lane]
            rises = (np.fmax.reduce(margins, axis=1) > 0).all(axis=0)[lane]
        met = ~np.isnan(found)
        np.add.at(self.unseen, design, cell.real * cell.imag * (rises & ~met[whole]))
        return owner[met], found[met]

    def _between_centres(self, some: Ints, z: Complexes, margins: Floats, inside: Flags) -> tuple[Ints, Complexes]:
        """Designs and places where a margin is negative, though at the centres of all cells around it is not.

        From the lowest of neighbouring centres a parabola through the places around leads on: it is exact for squares
        of distances.
        """
        size = self.inside.shape[1]
        values = margins.reshape(len(margins), size, size, -1)
        here = values[:, 1:-1, 1:-1]
        low = np.repeat(inside.reshape(1, size, size, -1)[:, 1:-1, 1:-1], len(values), axis=0)
        for beside in (values[:, 1:-1, :-2], values[:, 1:-1, 2:], values[:, :-2, 1:-1], values[:, 2:, 1:-1]):
            low &= here <= beside
        margin, row, column, lane = np.nonzero(low)
        place, cell = z[(row + 1) * size + column + 1, lane], self.cell[some[lane]]
        each, places = np.arange(len(lane)), self.designs.of(some[lane])
        good = np.ones(len(lane), dtype=bool)
        for step in PARABOLAS:
            x, y = step * cell.real, step * cell.imag
            around = place + x * AROUND.real[:, None] + 1j * y * AROUND.imag[:, None]
            here, right, left, up, down, across = self.designs.field.margins(around, places)[margin, :, each].T
            with np.errstate(invalid="ignore", divide="ignore"):
                gx, gy = 0.5 * (right - left), 0.5 * (up - down)
                xx, yy, xy = right + left - 2 * here, up + down - 2 * here, across + here - right - up
                det = xx * yy - xy * xy
                dx, dy = (gy * xy - gx * yy) / det, (gx * xy - gy * xx) / det
                good &= (xx > 0) & (det > 0) & (np.maximum(np.abs(dx), np.abs(dy)) < FARTHEST / step)
                # To twice the depth of the parabola, as the margin is none exactly.
                good &= here + gx * dx + gy * dy < 0
            place = place + np.where(good, x * dx, 0.0) + 1j * np.where(good, y * dy, 0.0)
        return some[lane[good]], place[good]

    @property
    def area(self) -> tuple[Floats, Floats]:
        """Area of the cells inside of each design, and what that is not known to."""
        inside, one = self.inside, self.cell.real * self.cell.imag
        edge = np.zeros(inside.shape, dtype=bool)
        for axis in (1, 2):
            first, last = inside.take([0], axis), inside.take([-1], axis)
            edge |= np.diff(inside, axis=axis, prepend=first) | np.diff(inside, axis=axis, append=last)
        return inside.sum(axis=(1, 2)) * one, EDGE * edge.sum(axis=(1, 2)) * one

    @property
    def reach(self) -> Floats:
        """Distance from the centre of the rays to the farthest corner of each box."""
        size = self.inside.shape[1] * self.cell
        corners = self.low + np.stack([0 * size, size.real + 0j, 1j * size.imag, size])
        return np.asarray(np.abs(corners - self.designs.about).max(axis=0))

    @property
    def farthest(self) -> Floats:
        """Distance from the centre within which all cells inside lie, shape (designs,); 0 where there is none."""
        found = np.zeros(len(self.low))
        for some, z in self._centres(np.arange(len(self.low))):
            inside = self.inside[some].reshape(len(some), -1).T
            distance = np.where(inside, np.abs(z - self.designs.about), 0.0).max(axis=0)
            found[some] = np.where(distance > 0, distance + np.abs(self.cell[some]), 0.0)
        return found

    def hidden(self, some: Ints, design: Ints, angle: Floats, intervals: Intervals) -> tuple[Ints, Floats]:
        """Design and angle of further rays of some designs, to what rays passed by: pieces and holes between two.

        The rays ascend by design and angle; each design has at least those at both ends of the scan.
        """
        begin, end = self.designs.scan
        rays, ends = design + 1j * angle, intervals.by_ray(intervals.inner, intervals.outer)
        owners, angles = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
        for owner, z, inside in self._looked_at(some):
            way = z - self.designs.about
            theta, radius = ray_through(way, begin), np.abs(way)
            within = (theta < end) & (theta > begin)
            owner, theta, radius, inside = owner[within], theta[within], radius[within], inside[within]
            at = np.searchsorted(rays, owner + 1j * theta) - 1
            before, after = _hold(ends, at, radius), _hold(ends, at + 1, radius)
            passed = np.where(inside, ~before & ~after, before & after)
            owner, theta, inside, gap = owner[passed], theta[passed], inside[passed], at[passed]
            # Of the places between the same two rays the one farthest from both: a piece, and a hole.
            aside = np.minimum(theta - angle[gap], angle[gap + 1] - theta)
            kind = 2 * gap + inside
            order = np.lexsort((-aside, kind))
            chosen = order[np.append(True, np.diff(kind[order]) > 0)[: len(order)]]
            owners.append(owner[chosen])
            angles.append(theta[chosen])
        return np.concatenate(owners), np.concatenate(angles)

    def _looked_at(self, designs: Ints) -> Iterator[tuple[Ints, Complexes, Flags]]:
        """Designs, places, and whether they lie inside: centres of the cells of some designs, and in slivers."""
        for some, z in self._centres(designs):
            yield np.tile(some, len(z)), z.ravel(), self.inside[some].reshape(len(some), -1).T.ravel()
        owner, place = self.slivers
        own = np.isin(owner, designs)
        yield owner[own], place[own], np.ones(int(own.sum()), dtype=bool)

    def _centres(self, designs: Ints) -> Iterator[tuple[Ints, Complexes]]:
        """Some of the designs, and centres of their cells, shape (cells, designs), row by row."""
        size = self.inside.shape[1]
        place = np.arange(size) + 0.5
        x, y = np.tile(place, size)[:, None], np.repeat(place, size)[:, None]
        step = max(1, BLOCK // size**2)
        for k in range(0, len(designs), step):
            some = designs[k : k + step]
            low, cell = self.low[some], self.cell[some]
            yield some, low.real + x * cell.real + 1j * (low.imag + y * cell.imag)


def _open(margins: Floats) -> Flags:
    """Cells (rows, columns, lanes) none of whose margins falls so far below zero as it changes to the next cell."""
    change = np.zeros_like(margins)
    with np.errstate(invalid="ignore"):
        for axis in (1, 2):
            step = np.nan_to_num(np.abs(np.diff(margins, axis=axis)))
            last = [(0, 0)] * 4
            for pad in ((1, 0), (0, 1)):
                last[axis] = pad
                change = np.maximum(change, np.pad(step, last))
        most = margins + change
        around = [np.roll(most, step, axis) for axis in (1, 2) for step in (1, -1)]
        # What is unknown beside where a leg is stretched is as it is at the next cell.
        most = np.where(np.isnan(most), np.fmax.reduce(around), most)
        return np.asarray((most > 0).all(axis=0))


def _hold(ends: Floats, ray: Ints, radius: Floats) -> Flags:
    """Whether rays hold radii between the `ends` of one of their intervals."""
    held = np.zeros(ray.shape, dtype=bool)
    for inner, outer in zip(*ends, strict=True):
        held |= (inner[ray] <= radius) & (radius <= outer[ray])
    return held


def _box(designs: Designs) -> tuple[Complexes, Complexes, Flags]:
    """Corners of a box around the region of each design, shape (designs,), and whether it is known to hold all of it.

    From the lengths of links, strokes and limits of distance alone. Every point lies in a box. One pinned to another by
    a link is no farther from it than the link is long, and one that slides along the ground no farther than its stroke.
    Where nothing bounds the point, the box is a guess about its place in the sketch: the sum of all lengths.
    """
    field, count = designs.field, designs.count
    mechanism = field.mechanism
    graph, vectors = mechanism.graph, mechanism.geometry.vectors(designs.places)
    low, high = np.full((2, len(graph.nodes), count), -np.inf), np.full((2, len(graph.nodes), count), np.inf)
    low[:, 0], high[:, 0] = 0.0, 0.0
    places = {**mechanism.nominal, **designs.places}
    strokes = {b.coordinate.slide: b.ends(places) for b in mechanism.bounds if b.coordinate.kind == "slide"}
    # Steps from one node to another: the least and largest in x and y.
    steps: list[tuple[int, int, Floats, Floats]] = []
    for edge, w, d in zip(graph.edges, vectors.w, vectors.d, strict=True):
        stroke = np.zeros((2, 1, count))
        if edge.slide is not None:
            shortest, longest = strokes.get(edge.slide, (None, None))
            stroke[0] = -np.inf if shortest is None else shortest
            stroke[1] = np.inf if longest is None else longest
            if edge.slide in graph.telescopic:
                stroke[0] = np.maximum(stroke[0], 0.0)
        if edge.frame:
            size = np.abs(w) + np.abs(stroke).max(axis=0)
            steps.append((edge.tail, edge.head, -size, size))
        else:
            along, turn = (np.stack([np.real(v), np.imag(v)]).reshape(2, -1) for v in (w, d))
            with np.errstate(invalid="ignore"):
                ends = np.nan_to_num(turn * stroke, nan=0.0, posinf=np.inf, neginf=-np.inf)
            steps.append((edge.tail, edge.head, along + ends.min(axis=0), along + ends.max(axis=0)))
    for bound in mechanism.bounds:
        if bound.coordinate.kind == "distance" and bound.maximum is not None:
            size = np.abs(np.asarray(bound.ends(places)[1], dtype=float))
            steps.append((bound.coordinate.node, bound.coordinate.other, -size, size))
    for _ in graph.nodes:
        for tail, head, least, most in steps:
            low[:, head] = np.maximum(low[:, head], low[:, tail] + least)
            high[:, head] = np.minimum(high[:, head], high[:, tail] + most)
            low[:, tail] = np.maximum(low[:, tail], low[:, head] - most)
            high[:, tail] = np.minimum(high[:, tail], high[:, head] - least)
    node = field.outputs[0].node
    bounded = np.isfinite(low[:, node]).all(axis=0) & np.isfinite(high[:, node]).all(axis=0)
    sketch = mechanism.sketch_configuration
    drawn = complex(*(float(sketch.value(c)) for c in field.outputs[:2]))
    guess = sum(float(np.abs(z)) for z in sketch.nodes) + sum(np.abs(w) for w in vectors.w)
    guess = np.broadcast_to(np.asarray(guess, dtype=float), (count,))
    corner, other = (
        np.where(bounded, side[0, node] + 1j * np.where(bounded, side[1, node], 0.0), drawn + sign * guess * (1 + 1j))
        for side, sign in ((low, -1), (high, 1))
    )
    middle, size = 0.5 * (corner + other), 0.5 * (other - corner)
    # Where dimensions cannot close at all the corners are exchanged, or one.
    least = 1e-9 * guess
    size = np.maximum(size.real * (1 + ROOM), least) + 1j * np.maximum(size.imag * (1 + ROOM), least)
    return middle - size, middle + size, bounded
