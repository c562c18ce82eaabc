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
# Cells around those of the scan that are looked at, too.
RING = 2
# Times that a box is doubled whose outermost cells lie inside, where the mechanism's dimensions give no bound.
DOUBLINGS = 12


@dataclass(frozen=True, eq=False)
class Raster:
    """Cells of a box around the region of each design, by their centres.

    A circle larger than the one around a cell always holds a centre: pieces that hold one are met. Of each design the
    lower left corner of the box, width and height of a cell, both complex, and whether the centres of the cells lie in
    the region, shape (designs, rows, columns). And places in holes, and in slivers of the region, that no centre met,
    with their designs, and the area in which slivers may lie that are still thinner. And of which designs
    margins of the assembly exclude a centre that no other margin does.
    """

    designs: Designs
    low: Complexes
    cell: Complexes
    inside: Flags
    holes: tuple[Ints, Complexes]
    slivers: tuple[Ints, Complexes]
    unseen: Floats
    cut: Flags

    @staticmethod
    def of(designs: Designs) -> Raster:
        """Look at places of each design, as many as the effort says each way, those within the scan."""
        cells, (begin, end) = designs.effort.cells, designs.scan
        low, high, bounded = _box(designs)
        of_assembly = sum(name.startswith("assembly ") for _, name in designs.field.labels)
        for _ in range(DOUBLINGS):
            none = np.zeros(0, dtype=np.intp), np.zeros(0, dtype=complex)
            blank, cut = np.zeros((designs.count, cells, cells), dtype=bool), np.zeros(designs.count, dtype=bool)
            found, holes = (
                Raster(designs, low, (high - low) / cells, blank, none, none, np.zeros(designs.count), cut),
                [none],
            )
            slivers = [none]
            for some, part, z in found._centres(np.arange(designs.count)):
                good, margins = designs.look(z.reshape(-1, len(some)), some)
                inside, margins = good.reshape(z.shape), margins.reshape(-1, *z.shape)
                scanned = ray_through(z - designs.about, begin) <= end
                cut[some] = (scanned & ~(margins[len(margins) - of_assembly :] > 0)).any(axis=(0, 1, 2))
                holes.append(found._between_centres(some, z, margins, inside))
                slivers.append(found._thin(some, z, margins, inside, scanned))
                found.inside[some, *part] = np.moveaxis(scanned & inside, 2, 0)
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

    def _thin(
        self, some: Ints, place: Complexes, margins: Floats, inside: Flags, scanned: Flags
    ) -> tuple[Ints, Complexes]:  # fmt: skip
        """Designs and places in the region where no centre around is: cells that no margin excludes are divided.

        Once, and then as long as that takes no more places than the raster. Parts left are unseen where nothing is met
        in the cell and every margin is positive somewhere around.
        """
        row, column, lane = _open(margins, *np.nonzero(scanned & ~_spread(inside)))
        design, place, cell = some[lane], place[row, column, lane], self.cell[some[lane]]
        owner, found, whole = design, np.full(len(lane), np.nan, dtype=complex), np.arange(len(lane))
        rises = np.zeros(len(lane), dtype=bool)
        parts = (np.arange(PARTS) - 0.5 * (PARTS - 1))[:, None]
        x, y = (part.reshape(-1, 1) for part in np.meshgrid(parts, parts))
        for division in range(DIVISIONS):
            if not len(design) or (division and len(design) * len(x) > inside.size):
                break
            cell = cell / PARTS
            part = place + x * cell.real + 1j * y * cell.imag
            good, margins = self.designs.look(part, design, assembly=True)
            met = good.any(axis=0)
            found[whole[met]] = part[good.argmax(axis=0), np.arange(len(design))][met]
            unmet = np.nonzero(np.broadcast_to(~met, (PARTS, PARTS, len(design))))
            row, column, lane = _open(margins.reshape(len(margins), PARTS, PARTS, len(design)), *unmet)
            at = row * PARTS + column
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
        here = margins[:, 1:-1, 1:-1]
        low = np.repeat(inside[None, 1:-1, 1:-1], len(margins), axis=0)
        for beside in (margins[:, 1:-1, :-2], margins[:, 1:-1, 2:], margins[:, :-2, 1:-1], margins[:, 2:, 1:-1]):
            low &= here <= beside
        margin, row, column, lane = np.nonzero(low)
        place, cell = z[row + 1, column + 1, lane], self.cell[some[lane]]
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
        for some, part, z in self._centres(np.arange(len(self.low))):
            inside = np.moveaxis(self.inside[some, *part], 0, 2)
            distance = np.where(inside, np.abs(z - self.designs.about), 0.0).max(axis=(0, 1))
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
        for some, part, z in self._centres(designs):
            yield np.broadcast_to(some, z.shape).ravel(), z.ravel(), np.moveaxis(self.inside[some, *part], 0, 2).ravel()
        owner, place = self.slivers
        own = np.isin(owner, designs)
        yield owner[own], place[own], np.ones(int(own.sum()), dtype=bool)

    def _centres(self, designs: Ints) -> Iterator[tuple[Ints, tuple[slice, slice], Complexes]]:
        """Some of the designs, the rows and columns around the scan, and centres of the cells there.

        They are of shape (rows, columns, designs).
        """
        size, about = self.inside.shape[1], self.designs.about
        place, (least, most) = np.arange(size) + 0.5, _sides(self.designs.scan)
        step = max(1, BLOCK // size**2)
        for k in range(0, len(designs), step):
            some = designs[k : k + step]
            low, cell = self.low[some], self.cell[some]
            part = []
            for begin, width, centre, first, last in (
                (low.imag, cell.imag, about.imag, least.imag, most.imag),
                (low.real, cell.real, about.real, least.real, most.real),
            ):
                at = (centre - begin) / width
                start = int(np.clip(at.min() - RING, 0, size - 1)) if first == 0 else 0
                stop = int(np.clip(at.max() + 1 + RING, 1, size)) if last == 0 else size
                part.append(slice(start, stop))
            y, x = place[part[0], None, None], place[part[1], None]
            yield some, (part[0], part[1]), low.real + x * cell.real + 1j * (low.imag + y * cell.imag)


def _sides(scan: tuple[float, float]) -> tuple[complex, complex]:
    """Least and largest x and y of the directions of a scan, or 0 if that is beyond."""
    begin, end = scan
    quarters = 0.5 * np.pi * np.arange(np.ceil(begin / (0.5 * np.pi)), np.floor(end / (0.5 * np.pi)) + 1)
    way = np.round(np.exp(1j * np.array([begin, *quarters, end])), 9)
    return complex(way.real.min(initial=0), way.imag.min(initial=0)), complex(
        way.real.max(initial=0), way.imag.max(initial=0)
    )


def _spread(cells: Flags) -> Flags:
    """Cells (rows, columns, designs) with those around them."""
    for axis in (0, 1):
        before = np.moveaxis(cells, axis, 0)
        after = before.copy()
        after[1:] |= before[:-1]
        after[:-1] |= before[1:]
        cells = np.moveaxis(after, 0, axis)
    return cells


def _open(margins: Floats, row: Ints, column: Ints, lane: Ints) -> tuple[Ints, Ints, Ints]:
    """Those of the given cells none of whose margins falls so far below zero as it changes to the next cell.

    Margins are of shape (margins, rows, columns, lanes).
    """
    for margin in margins:
        most = margin[row, column, lane]
        below = np.flatnonzero(~(most > 0))
        most[below] = _most(margin, row[below], column[below], lane[below])
        unknown = np.flatnonzero(np.isnan(most))
        if unknown.size:
            # What is unknown beside where a leg is stretched is as it is at the next cell.
            beside = _beside(margin, row[unknown], column[unknown])
            most[unknown] = np.fmax.reduce([_most(margin, *place, lane[unknown]) for place in beside])
        keep = most > 0
        row, column, lane = row[keep], column[keep], lane[keep]
    return row, column, lane


def _most(margin: Floats, row: Ints, column: Ints, lane: Ints) -> Floats:
    """A margin at cells, and its change to the next cell, whichever is the largest."""
    here, change = margin[row, column, lane], np.zeros(len(row))
    with np.errstate(invalid="ignore"):
        for place in _beside(margin, row, column):
            change = np.fmax(change, np.abs(margin[*place, lane] - here))
        return here + np.minimum(change, np.finfo(float).max)


def _beside(margin: Floats, row: Ints, column: Ints) -> list[tuple[Ints, Ints]]:
    """Rows and columns of the cells beside some; at the rim those themselves."""
    rows, columns = margin.shape[:2]
    return [
        (np.maximum(row - 1, 0), column), (np.minimum(row + 1, rows - 1), column),
        (row, np.maximum(column - 1, 0)), (row, np.minimum(column + 1, columns - 1)),
    ]  # fmt: skip


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
            along, turn = (np.stack([v.real, v.imag]).reshape(2, -1) for v in (w, d))
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
