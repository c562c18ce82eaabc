"""A raster of a region: which cells of a box around the region lie inside it.

Rays about one point may miss a piece of a region; cells miss no piece that is larger than a cell. The raster therefore
tells how long the rays have to be, and between which two of them a piece or a hole is hidden. The area of its cells is
a check on the integrals, with which it shares only the margins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.ground.numerics.roots import AROUND, lowest_near
from mechdesign.region.crossings import passed
from mechdesign.region.intervals import Intervals
from mechdesign.region.rays import Scanned, ray_through

# Fraction by which a box is widened, so that rounding leaves no part of the region outside.
ROOM = 1e-6
# Cells whose margins are computed at once.
BLOCK = 1 << 17
# Error of the area of a boundary cell, as a fraction of the cell, if all boundary cells err alike.
EDGE = 0.5
# Sampling distances of the successive parabolas that lead to the minimum of a margin (cells).
PARABOLAS = (1.0, 0.1)
# Longest step of a parabola in x and y (cells).
FARTHEST = 1.0
# How often a cell that may hold a sliver is divided.
DIVISIONS = 3
# Parts of a divided cell in x, and in y.
PARTS = 4
# Rows and columns that are added around those of the scan.
RING = 2
# How often a box is doubled while its outermost cells lie inside, where the mechanism's dimensions bound nothing.
DOUBLINGS = 12


@dataclass(frozen=True, eq=False)
class Raster:
    """Cells of a box around the region of each design, judged by their centres.

    A circle larger than the one around a cell holds a centre: the raster misses no piece that holds such a circle.

    Parameters
    ----------
    low : complex ndarray, shape (designs,)
        Lower left corner of each box.
    cell : complex ndarray, shape (designs,)
        Width (real part) and height (imaginary part) of a cell.
    inside : ndarray of bool, shape (designs, rows, columns)
        Whether the centre of each cell lies in the region.
    holes, slivers : (ndarray of int, complex ndarray)
        Designs and places in holes, and where slivers of the region are or may be, that hold no centre.
    cut : ndarray of bool, shape (designs,)
        Whether margins of the assembly exclude a centre within the scan that no other margin excludes.
    """

    designs: Scanned
    low: Complexes
    cell: Complexes
    inside: Flags
    holes: tuple[Ints, Complexes]
    slivers: tuple[Ints, Complexes]
    cut: Flags

    @staticmethod
    def of(designs: Scanned) -> Raster:
        """Compute the margins at the centres of all cells of each design, `effort.cells` in x and in y."""
        cells, (begin, end) = designs.effort.cells, designs.scan
        low, high, bounded = _box(designs)
        of_assembly = sum(name.startswith("assembly ") for _, name in designs.field.labels)
        for _ in range(DOUBLINGS):
            empty = np.zeros(0, dtype=np.intp), np.zeros(0, dtype=complex)
            blank, cut = np.zeros((designs.count, cells, cells), dtype=bool), np.zeros(designs.count, dtype=bool)
            raster, holes = (
                Raster(designs, low, (high - low) / cells, blank, empty, empty, cut),
                [empty],
            )
            slivers = [empty]
            for chunk, part, z in raster._centres(np.arange(designs.count)):
                scanned, inside = ray_through(z - designs.about, begin) <= end, np.zeros(z.shape, dtype=bool)
                for mode in designs.members:
                    is_inside, margins, away = mode.look(z.reshape(-1, len(chunk)), chunk)
                    own, margins = is_inside.reshape(z.shape), margins.reshape(-1, *z.shape)
                    away = away.reshape(margins.shape)
                    cut[chunk] |= (scanned & ~(margins[len(margins) - of_assembly :] > 0)).any(axis=(0, 1, 2))
                    holes.append(raster._between_centres(mode, chunk, z, margins, own))
                    slivers.append(raster._thin(mode, chunk, z, margins, away, own, scanned & ~inside))
                    inside |= own
                raster.inside[chunk, *part] = np.moveaxis(scanned & inside, 2, 0)
            rim = raster.inside.copy()
            rim[:, 1:-1, 1:-1] = False
            open_ = rim.any(axis=(1, 2)) & ~bounded
            if not open_.any():
                break
            size = np.where(open_, high - low, 0)
            low, high = low - 0.5 * size, high + 0.5 * size
        (owners, places), (thin_owners, thin_places) = zip(*holes, strict=True), zip(*slivers, strict=True)
        return replace(
            raster, holes=(np.concatenate(owners), np.concatenate(places)),
            slivers=(np.concatenate(thin_owners), np.concatenate(thin_places)),
        )  # fmt: skip

    def _thin(
        self, mode: Scanned, designs: Ints, place: Complexes, margins: Floats, away: Floats, inside: Flags,
        scanned: Flags,
    ) -> tuple[Ints, Complexes]:  # fmt: skip
        """Designs and places of slivers: points of the region in cells without an inside centre in or beside them.

        Cells that no margin excludes are divided once, and again while that takes no more points than the raster has.
        In cells left then slivers may be that are thinner still.
        """
        row, column, lane = _open(margins, away, *np.nonzero(scanned & ~_spread(inside)))
        design, place, cell = designs[lane], place[row, column, lane], self.cell[designs[lane]]
        cell_design, witness, cell_of_part = design, np.full(len(lane), np.nan, dtype=complex), np.arange(len(lane))
        parts = (np.arange(PARTS) - 0.5 * (PARTS - 1))[:, None]
        x, y = (part.reshape(-1, 1) for part in np.meshgrid(parts, parts))
        for division in range(DIVISIONS):
            if not len(design) or (division and len(design) * len(x) > inside.size):
                break
            cell = cell / PARTS
            part = place + x * cell.real + 1j * y * cell.imag
            is_inside, margins, away = mode.look(part, design, assembly=True)
            hit = is_inside.any(axis=0)
            witness[cell_of_part[hit]] = part[is_inside.argmax(axis=0), np.arange(len(design))][hit]
            misses = np.nonzero(np.broadcast_to(~hit, (PARTS, PARTS, len(design))))
            shape = len(margins), PARTS, PARTS, len(design)
            row, column, lane = _open(margins.reshape(shape), away.reshape(shape), *misses)
            at = row * PARTS + column
            design, place, cell, cell_of_part = design[lane], part[at, lane], cell[lane], cell_of_part[lane]
        hit = ~np.isnan(witness)
        left = ~hit[cell_of_part]
        return np.concatenate([cell_design[hit], design[left]]), np.concatenate([witness[hit], place[left]])

    def _between_centres(
        self, mode: Scanned, designs: Ints, z: Complexes, margins: Floats, inside: Flags
    ) -> tuple[Ints, Complexes]:  # fmt: skip
        """Designs and places of holes between centres: a margin is negative there, but at no centre around.

        Parabolas lead from a centre where a margin is lower than beside it to the margin's minimum; they are exact for
        squared distances.
        """
        centre = margins[:, 1:-1, 1:-1]
        low = np.repeat(inside[None, 1:-1, 1:-1], len(margins), axis=0)
        for beside in (margins[:, 1:-1, :-2], margins[:, 1:-1, 2:], margins[:, :-2, 1:-1], margins[:, 2:, 1:-1]):
            low &= centre <= beside
        margin, row, column, lane = np.nonzero(low)
        place, cell = z[row + 1, column + 1, lane], self.cell[designs[lane]]
        every, places = np.arange(len(lane)), mode.of(designs[lane])
        converges = np.ones(len(lane), dtype=bool)
        for step in PARABOLAS:
            x, y = step * cell.real, step * cell.imag
            around = place + x * AROUND.real[:, None] + 1j * y * AROUND.imag[:, None]
            values = mode.field.margins(around, places)[margin, :, every].T
            (dx, dy), low, fall = lowest_near(values)
            converges &= low & (np.maximum(np.abs(dx), np.abs(dy)) < FARTHEST / step)
            # Twice the depth of the parabola, which only approximates the margin.
            converges &= values[0] + fall < 0
            place = place + np.where(converges, x * dx, 0.0) + 1j * np.where(converges, y * dy, 0.0)
        return designs[lane[converges]], place[converges]

    @property
    def area(self) -> tuple[Floats, Floats]:
        """Cell area inside each design, and its error, both of shape (designs,)."""
        inside, cell_area = self.inside, self.cell.real * self.cell.imag
        edge = np.zeros(inside.shape, dtype=bool)
        for axis in (1, 2):
            first, last = inside.take([0], axis), inside.take([-1], axis)
            edge |= np.diff(inside, axis=axis, prepend=first) | np.diff(inside, axis=axis, append=last)
        return inside.sum(axis=(1, 2)) * cell_area, EDGE * edge.sum(axis=(1, 2)) * cell_area

    @property
    def reach(self) -> Floats:
        """Distance from the centre of the rays to the farthest corner of each box."""
        size = self.inside.shape[1] * self.cell
        corners = self.low + np.stack([0 * size, size.real + 0j, 1j * size.imag, size])
        return np.asarray(np.abs(corners - self.designs.about).max(axis=0))

    def hidden(self, searched: Ints, design: Ints, angle: Floats, intervals: Intervals) -> tuple[Ints, Floats]:
        """Designs and angles of further rays, to pieces and holes that the given rays miss in the `searched` designs.

        The given rays ascend by design and angle; each design has at least those at both ends of the scan.
        """
        begin, end = self.designs.scan
        rays, ends = design + 1j * angle, intervals.by_ray(intervals.inner, intervals.outer)
        owners, angles = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
        for owner, z, inside in self._looked_at(searched):
            offset = z - self.designs.about
            theta, radius = ray_through(offset, begin), np.abs(offset)
            within = (theta < end) & (theta > begin)
            owner, theta, radius, inside = owner[within], theta[within], radius[within], inside[within]
            gap_of = np.searchsorted(rays, owner + 1j * theta) - 1
            before, after = _hold(ends, gap_of, radius), _hold(ends, gap_of + 1, radius)
            passed = np.where(inside, ~before & ~after, before & after)
            owner, theta, inside, left_ray = owner[passed], theta[passed], inside[passed], gap_of[passed]
            # Between two rays: a ray to the piece, and one to the hole, that is farthest from both.
            aside = np.minimum(theta - angle[left_ray], angle[left_ray + 1] - theta)
            kind = 2 * left_ray + inside
            order = np.lexsort((-aside, kind))
            chosen = order[np.append(True, np.diff(kind[order]) > 0)[: len(order)]]
            owners.append(owner[chosen])
            angles.append(theta[chosen])
        return np.concatenate(owners), np.concatenate(angles)

    def _looked_at(self, designs: Ints) -> Iterator[tuple[Ints, Complexes, Flags]]:
        """Design, place and whether it is inside, of the centres of all cells and of the slivers of some designs."""
        for chunk, at, z in self._centres(designs):
            yield np.broadcast_to(chunk, z.shape).ravel(), z.ravel(), np.moveaxis(self.inside[chunk, *at], 0, 2).ravel()
        owner, place = self.slivers
        chosen = np.isin(owner, designs)
        yield owner[chosen], place[chosen], np.ones(int(chosen.sum()), dtype=bool)

    def _centres(self, designs: Ints) -> Iterator[tuple[Ints, tuple[slice, slice], Complexes]]:
        """Chunks of the designs, the rows and columns around the scan, and the cell centres there.

        The centres are of shape (rows, columns, designs of the chunk).
        """
        size, about = self.inside.shape[1], self.designs.about
        steps, (least, most) = np.arange(size) + 0.5, _sides(self.designs.scan)
        step = max(1, BLOCK // size**2)
        for k in range(0, len(designs), step):
            chunk = designs[k : k + step]
            low, cell = self.low[chunk], self.cell[chunk]
            window = []
            for begin, width, centre, first, last in (
                (low.imag, cell.imag, about.imag, least.imag, most.imag),
                (low.real, cell.real, about.real, least.real, most.real),
            ):
                position = (centre - begin) / width
                start = int(np.clip(position.min() - RING, 0, size - 1)) if first == 0 else 0
                stop = int(np.clip(position.max() + 1 + RING, 1, size)) if last == 0 else size
                window.append(slice(start, stop))
            y, x = steps[window[0], None, None], steps[window[1], None]
            yield chunk, (window[0], window[1]), low.real + x * cell.real + 1j * (low.imag + y * cell.imag)


def _sides(scan: tuple[float, float]) -> tuple[complex, complex]:
    """Least x and y, and largest, of the origin and the unit vectors of a scan."""
    begin, end = scan
    quarters = 0.5 * np.pi * np.arange(np.ceil(begin / (0.5 * np.pi)), np.floor(end / (0.5 * np.pi)) + 1)
    directions = np.round(np.exp(1j * np.array([begin, *quarters, end])), 9)
    x, y = directions.real, directions.imag
    return complex(x.min(initial=0), y.min(initial=0)), complex(x.max(initial=0), y.max(initial=0))


def _spread(cells: Flags) -> Flags:
    """Cells (rows, columns, designs) and their eight neighbours."""
    for axis in (0, 1):
        before = np.moveaxis(cells, axis, 0)
        after = before.copy()
        after[1:] |= before[:-1]
        after[:-1] |= before[1:]
        cells = np.moveaxis(after, 0, axis)
    return cells


def _open(margins: Floats, away: Floats, row: Ints, column: Ints, lane: Ints) -> tuple[Ints, Ints, Ints]:
    """Cells that no margin excludes: each margin exceeds zero when its change to a neighbouring cell is added.

    Margins, and how far angles are `away` from the middle of their limits, are of shape (margins, rows, columns,
    lanes).
    """
    for margin, from_middle in zip(margins, away, strict=True):
        largest = margin[row, column, lane]
        below = np.flatnonzero(~(largest > 0))
        largest[below] = _most(margin, from_middle, row[below], column[below], lane[below])
        excluded = np.flatnonzero(~(largest > 0))
        beside = _beside(margin, row[excluded], column[excluded])
        unknown = np.isnan([largest[excluded], *(margin[*place, lane[excluded]] for place in beside)]).any(axis=0)
        if unknown.any():
            # A margin that is unknown there or beside, at a stretched leg, is judged by the neighbouring cells as well.
            some, of = excluded[unknown], lane[excluded[unknown]]
            places = ((rows[unknown], columns[unknown]) for rows, columns in beside)
            around = [_most(margin, from_middle, *place, of) for place in places]
            largest[some] = np.fmax.reduce([largest[some], *around])
        keep = largest > 0
        row, column, lane = row[keep], column[keep], lane[keep]
    return row, column, lane


def _most(margin: Floats, away: Floats, row: Ints, column: Ints, lane: Ints) -> Floats:
    """A margin at cells plus its largest change to a neighbouring cell; nan where it is unknown.

    The margin of an angle is positive on the way from one side of its limits to the other.
    """
    value, change = margin[row, column, lane], np.zeros(len(row))
    for place in _beside(margin, row, column):
        change = np.fmax(change, np.abs(margin[*place, lane] - value))
        change[passed(away[row, column, lane], away[*place, lane])] = np.inf
    return value + np.minimum(change, np.finfo(float).max)


def _beside(margin: Floats, row: Ints, column: Ints) -> list[tuple[Ints, Ints]]:
    """Rows and columns of the four neighbours of cells; beyond the rim the cell itself."""
    rows, columns = margin.shape[:2]
    return [
        (np.maximum(row - 1, 0), column), (np.minimum(row + 1, rows - 1), column),
        (row, np.maximum(column - 1, 0)), (row, np.minimum(column + 1, columns - 1)),
    ]  # fmt: skip


def _hold(ends: Floats, ray: Ints, radius: Floats) -> Flags:
    """Whether each radius lies in an interval of its ray; `ends` are inner and outer radii, (2, intervals, rays)."""
    holds = np.zeros(ray.shape, dtype=bool)
    for inner, outer in zip(*ends, strict=True):
        holds |= (inner[ray] <= radius) & (radius <= outer[ray])
    return holds


def _box(designs: Scanned) -> tuple[Complexes, Complexes, Flags]:
    """Lower left and upper right corners of a box for each design, shape (designs,), and whether it holds the region.

    The box follows from the lengths of links, the strokes and the limits of distances alone: two points of a link are
    no farther apart than the link is long, and what slides along the ground moves no farther than its stroke. Where
    these do not bound the point, the box is a guess: the sum of all lengths about its place in the sketch.
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
            ends = np.nan_to_num(turn * stroke, nan=0.0, posinf=np.inf, neginf=-np.inf)
            steps.append((edge.tail, edge.head, along + ends.min(axis=0), along + ends.max(axis=0)))
    for bound in mechanism.bounds:
        if bound.coordinate.kind == "distance" and bound.limit.max is not None:
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
    # Where the dimensions close in no pose, a corner may lie on the wrong side of the other.
    least = 1e-9 * guess
    size = np.maximum(size.real * (1 + ROOM), least) + 1j * np.maximum(size.imag * (1 + ROOM), least)
    return middle - size, middle + size, bounded
