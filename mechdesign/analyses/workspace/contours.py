"""Zero curves of a function on a grid: where its lines are crossed or touched is found, then put in order.

A line may also be crossed twice between two nodes, and a small loop crosses none: both are looked for where the
magnitude of the function has a dip. Cells with a side crossed twice are divided, as those in which curves may cross and
those about a node where a curve turns back; a small loop is found by rays about its dip. Two long curves so near to
each other that too many cells would have to be divided are told as one between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.workspace.chains import SAME, chains
from mechdesign.analyses.workspace.minima import CROSSED, TOUCHED, dips
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# Values at fractional rows and columns of a grid.
Function = Callable[[Floats, Floats], Floats]
# Roots are found to this part of a grid line's piece; one where the function does not vanish is a gap in its domain.
ACCURACY, VANISHES = 1e-13, 1e-6
# Values below this part of the largest are rounding.
NOISE = 1e-14
# Into how many cells one is divided along each line, how often, and how many cells at a time at most.
PARTS, DEPTH, MOST = 4, 5, 1000
# Rays of a loop within a cell.
RAYS = 32
# Steps to a cell's four nodes, and to its sides: (row, column, direction) of left, lower, right, upper in turn.
DOWN, RIGHT = 0, 1
SIDES = ((0, 0, DOWN), (1, 0, RIGHT), (0, 1, DOWN), (0, 0, RIGHT))


@dataclass(frozen=True, eq=False)
class _Grids:
    """Grids that cover parts of the whole grid, each with a line more on every side, for the dips of its outer lines.

    Parameters
    ----------
    rows, columns : ndarray, shape (grids, m) and (grids, n)
        Places of the lines in the whole grid.
    values : ndarray, shape (grids, m, n)
        nan beyond the whole grid.
    """

    rows: Floats
    columns: Floats
    values: Floats
    function: Function
    noise: float

    def at(self, which: Ints, row: Floats, column: Floats) -> tuple[Floats, Floats]:
        """Places of fractional lines of grids in the whole grid; lines are evenly spaced."""
        found = []
        for lines, place in ((self.rows, row), (self.columns, column)):
            found.append(lines[which, 0] + place * (lines[which, 1] - lines[which, 0]))
        return found[0], found[1]

    def dips(self, axes: Sequence[int], lanes: tuple[Ints, ...], beside: Floats) -> tuple[Ints, Floats]:
        """What becomes of the magnitude near nodes (grid, row, column), along an axis or both; see `minima.dips`."""
        which, *node = lanes
        sign = np.sign(self.values[lanes])

        def sample(left: Ints, place: Floats) -> Floats:
            full = np.stack([np.broadcast_to(node[k][left, None], place.shape[1:]).astype(float) for k in range(2)])
            full[list(axes)] = place
            flat = full.reshape(2, -1)
            row, column = self.at(np.repeat(which[left], place.shape[2]), flat[0], flat[1])
            return sign[left, None] * self.function(row, column).reshape(place.shape[1:])

        centre = np.stack([node[axis].astype(float) for axis in axes])
        return dips(sample, centre, beside, self.noise)


def zero_curves(values: Floats, function: Function) -> list[Floats]:
    """Curves on which a function is zero, also without changing its sign; single points where it is so only there.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        The function at the grid's nodes.
    function : callable
        The function at fractional rows and columns of the grid.

    Returns
    -------
    list of ndarray, shape (2, points)
        Rows and columns.
    """
    m, n = values.shape
    noise = NOISE * float(np.nanmax(np.abs(values), initial=0.0))
    bordered = np.pad(values, 1, constant_values=np.nan)[None]
    grids = _Grids(np.arange(-1.0, m + 1)[None], np.arange(-1.0, n + 1)[None], bordered, function, noise)
    places, links, loops = [np.zeros((2, 0))], [np.zeros((2, 0), dtype=np.intp)], []
    for level in range(DEPTH + 1):
        at, pairs, divided, small = _level(grids, last=level == DEPTH)
        links.append(pairs + sum(place.shape[1] for place in places))
        places.append(at)
        loops += small
        if not len(divided[0]):
            break
        grids = _finer(grids, divided, (m, n))
    return [*chains(np.concatenate(places, axis=1), np.concatenate(links, axis=1)), *loops]


def _level(grids: _Grids, last: bool) -> tuple[Floats, Ints, tuple[Ints, ...], list[Floats]]:
    """Points on the grids' lines, pairs of them that cells link, cells to divide, and what lies within cells."""
    sides = tuple(np.full((3, *grids.values.shape), -1, dtype=np.intp) for _ in range(2))
    crossed, touched, twice = range(3)
    points = [np.zeros((2, 0))]
    known = 0
    for direction in (DOWN, RIGHT):
        for kind, lanes, place in (
            (crossed, *_crossings(grids, direction)), *_touched(grids, direction, (touched, twice)),
        ):  # fmt: skip
            row, column = grids.at(lanes[0], *place)
            sides[direction][kind][lanes] = known + np.arange(len(row))
            known += len(row)
            points.append(np.stack([row, column]))
    # Sides of each cell, shape (kinds, grids, rows, columns, 4); of the outermost cells nothing is asked.
    _, _, m, n = sides[0].shape
    cells = np.stack([sides[d][:, :, 1 + r : m - 2 + r, 1 + c : n - 2 + c] for r, c, d in SIDES], axis=-1)
    doubtful = np.asarray((cells[twice] >= 0).any(axis=-1) | (cells[crossed] >= 0).all(axis=-1))
    doubtful |= _turning(sides[DOWN][crossed], sides[RIGHT][crossed])
    many = np.count_nonzero(doubtful) > MOST
    if many:
        cells[touched] = np.maximum(cells[touched], cells[twice])
    if many or last:
        doubtful[:] = False
    pairs = [_linked(grids, cells[crossed], ~doubtful, saddles=True), _linked(grids, cells[touched], ~doubtful)]
    bare = np.asarray((cells < 0).all(axis=(0, -1)))
    return np.concatenate(points, axis=1), np.concatenate(pairs, axis=1), np.nonzero(doubtful), _within(grids, bare)


def _turning(down: Ints, right: Ints) -> Flags:
    """Cells at a node most of whose lines are crossed beside it, by the points on the pieces after each node."""
    met = (down >= 0).astype(int) + (right >= 0)
    met[:, 1:] += down[:, :-1] >= 0
    met[:, :, 1:] += right[:, :, :-1] >= 0
    tips = met > 2
    tips = tips[:, :-1] | tips[:, 1:]
    return np.asarray((tips[:, :, :-1] | tips[:, :, 1:])[:, 1:-1, 1:-1])


def _crossings(grids: _Grids, direction: int) -> tuple[tuple[Ints, ...], tuple[Floats, Floats]]:
    """Pieces of lines that are crossed, by (grid, row, column) of their first node, and where."""
    first, second = _neighbours(grids.values, direction)
    which, row, column = np.nonzero((first > 0) != (second > 0))
    inner = _inner(grids, (row, column), direction)
    which, row, column = which[inner], row[inner], column[inner]
    low, high = first[which, row, column], second[which, row, column]
    down, right = float(direction == DOWN), float(direction == RIGHT)

    def evaluate(lanes: Ints, t: Floats) -> Floats:
        return grids.function(*grids.at(which[lanes], row[lanes] + t * down, column[lanes] + t * right))

    zero, nan = np.zeros(len(low)), np.full(len(low), np.nan)
    t = bracketed_roots(evaluate, zero, low, zero + 1, high, nan, nan, zero + ACCURACY)
    with np.errstate(invalid="ignore"):
        size = np.fmax(np.abs(low), np.abs(high))
        good = np.abs(evaluate(np.arange(len(low)), t)) <= VANISHES * size
    lanes = (which[good], row[good], column[good])
    return lanes, (row[good] + t[good] * down, column[good] + t[good] * right)


def _neighbours(values: Floats, direction: int) -> tuple[Floats, Floats]:
    return (values[:, :-1], values[:, 1:]) if direction == DOWN else (values[:, :, :-1], values[:, :, 1:])


def _inner(grids: _Grids, node: tuple[Ints, Ints], direction: int) -> Flags:
    """Which pieces of lines, by their first node, are sides of cells that are looked at."""
    inner = np.ones(len(node[0]), dtype=bool)
    for axis in range(2):
        inner &= (node[axis] >= 1) & (node[axis] < grids.values.shape[1 + axis] - 1 - (axis == direction))
    return inner


def _touched(
    grids: _Grids, direction: int, kinds: tuple[int, int]
) -> list[tuple[int, tuple[Ints, ...], tuple[Floats, Floats]]]:
    """Pieces of lines with dips: those where zero is touched, and those that are crossed twice."""
    size = np.moveaxis(np.abs(grids.values), 1 + direction, 1)
    sign = np.moveaxis(np.sign(grids.values), 1 + direction, 1)
    before, here, after = size[:, :-2], size[:, 1:-1], size[:, 2:]
    low = (here < before) & (here <= after) & (after > grids.noise)
    low &= (sign[:, 1:-1] == sign[:, :-2]) & (sign[:, 1:-1] == sign[:, 2:])
    which, along, across = np.nonzero(low)
    beside = np.maximum(before, after)[low]
    node = (along + 1, across) if direction == DOWN else (across, along + 1)
    kind, (place,) = grids.dips([direction], (which, *node), beside)
    # At a node itself it belongs to the piece after it.
    piece = np.floor(place + SAME).astype(np.intp)
    found: list[tuple[int, tuple[Ints, ...], tuple[Floats, Floats]]] = []
    for told, wanted in zip(kinds, (TOUCHED, CROSSED), strict=True):
        first = (piece, across) if direction == DOWN else (across, piece)
        some = np.flatnonzero((kind == wanted) & _inner(grids, first, direction))
        line = across.astype(np.float64)
        full = (place, line) if direction == DOWN else (line, place)
        lanes = (which[some], first[0][some], first[1][some])
        found.append((told, lanes, (full[0][some], full[1][some])))
    return found


def _linked(grids: _Grids, sides: Ints, whole: Flags, *, saddles: bool = False) -> Ints:
    """Pairs of points that cells link, shape (2, pairs); `sides` holds numbers of points, -1 where there is none."""
    met = np.count_nonzero(sides >= 0, axis=-1)
    pairs = [-np.sort(-sides[whole & (met == 2)], axis=-1)[:, :2]]
    if saddles:
        which, row, column = np.nonzero(whole & (met == 4))
        middle = grids.function(*grids.at(which, np.asarray(row + 1.5), np.asarray(column + 1.5)))
        first = (middle > 0) == (grids.values[which, row + 1, column + 1] > 0)
        left, lower, right, upper = sides[which, row, column].T
        pairs.append(np.stack([left, np.where(first, lower, upper)], axis=-1))
        pairs.append(np.stack([right, np.where(first, upper, lower)], axis=-1))
    return np.concatenate(pairs).T


def _within(grids: _Grids, bare: Flags) -> list[Floats]:
    """Loops and single points inside cells whose sides the curves do not meet."""
    size, sign = np.abs(grids.values), np.sign(grids.values)
    inner = (slice(None), slice(1, -1), slice(1, -1))
    steps = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]
    low, beside = np.ones(size[inner].shape, dtype=bool), np.zeros(size[inner].shape)
    for r, c in steps:
        other = (slice(None), slice(1 + r, size.shape[1] - 1 + r), slice(1 + c, size.shape[2] - 1 + c))
        low &= (size[inner] <= size[other]) & (sign[inner] == sign[other])
        beside = np.fmax(beside, size[other])
    which, row, column = np.nonzero(low & (beside > grids.noise))
    lanes = (which, row + 1, column + 1)
    kind, place = grids.dips([0, 1], lanes, beside[which, row, column])
    cell = np.floor(place + SAME).astype(np.intp) - 1
    inside = ((cell >= 0) & (cell < np.array(bare.shape[1:])[:, None])).all(axis=0) & (kind > 0)
    inside[inside] = bare[which[inside], *cell[:, inside]]
    found = []
    for lane in np.flatnonzero(inside):
        if kind[lane] == TOUCHED:
            found.append(np.stack(grids.at(which[lane : lane + 1], *place[:, lane, None])))
        else:
            found.append(_loop(grids, which[lane : lane + 1], place[:, lane], cell[:, lane] + 1))
    return found


def _loop(grids: _Grids, which: Ints, dip: Floats, cell: Ints) -> Floats:
    """A closed curve about a dip within a cell, on rays to the cell's sides."""
    turn = 2 * np.pi * np.arange(RAYS) / RAYS
    way = np.stack([np.cos(turn), np.sin(turn)])
    # A dip may lie on a side of its cell: along that side there is none to meet.
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.where(way > 0, (cell[:, None] + 1 - dip[:, None]) / way, (cell[:, None] - dip[:, None]) / way)
    way = way * np.min(np.where(way == 0, np.inf, ends), axis=0)

    def evaluate(lanes: Ints, t: Floats) -> Floats:
        return grids.function(*grids.at(np.repeat(which, len(lanes)), *(dip[:, None] + t * way[:, lanes])))

    zero, nan, every = np.zeros(RAYS), np.full(RAYS, np.nan), np.arange(RAYS)
    t = bracketed_roots(
        evaluate, zero, evaluate(every, zero), zero + 1, evaluate(every, zero + 1), nan, nan, zero + ACCURACY
    )
    closed = np.append(t, t[0])
    place = dip[:, None] + closed * np.append(way, way[:, :1], axis=1)
    return np.stack(grids.at(np.repeat(which, RAYS + 1), *place))


def _finer(grids: _Grids, cells: tuple[Ints, ...], shape: tuple[int, int]) -> _Grids:
    """Divided cells as grids of their own."""
    which, row, column = cells
    steps = np.arange(-1, PARTS + 2) / PARTS
    rows = grids.at(which[:, None], row[:, None] + 1 + steps, column[:, None] + 1 + steps)
    at_row, at_column = (lines for lines in rows)
    full = np.broadcast_arrays(at_row[:, :, None], at_column[:, None, :])
    outside = np.zeros(full[0].shape, dtype=bool)
    for place, count in zip(full, shape, strict=True):
        outside |= (place < 0) | (place > count - 1)
    values = np.full(outside.shape, np.nan)
    values[~outside] = grids.function(full[0][~outside], full[1][~outside])
    return _Grids(at_row, at_column, values, grids.function, grids.noise)
