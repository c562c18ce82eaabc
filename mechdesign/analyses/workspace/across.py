"""Cuts of a region over a range: which values of the range serve at a point of a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.field import Field, Places
from mechdesign.analyses.region.rays import Designs, trace
from mechdesign.analyses.workspace.slices import VALUE, Sliced
from mechdesign.numerics.arrays import Complexes, Floats, Ints

# Values that are looked at, of the whole range.
VALUES = 25
# Names among the dimensions by which a point and the margin that is looked at are given.
X, Y, FIRST, MARGIN = "x of the point", "y of the point", "first value", "margin"


@dataclass(frozen=True, eq=False)
class _Turned(Field):
    """Some margins seen along the range: places are values above a first one, which is among the dimensions.

    Parameters
    ----------
    rows : tuple of int
        The margins; none for the one of each ray that is among the dimensions, negated.
    """

    sliced: Sliced | None = None
    rows: tuple[int, ...] = ()

    @staticmethod
    def of(sliced: Sliced, rows: tuple[int, ...]) -> _Turned:
        """These margins of a field."""
        return _Turned(sliced.mechanism, sliced.plan, sliced.held, sliced.same_assembly, sliced.length, sliced, rows)

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Of those margins."""
        assert self.sliced is not None
        return tuple(self.sliced.labels[k] for k in self.rows) or (("limit", MARGIN),)

    @property
    def rounding(self) -> Floats:
        """Of those margins."""
        assert self.sliced is not None
        return self.sliced.rounding[list(self.rows)] if self.rows else np.zeros(1)

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """Those margins, shape (margins, *z.shape)."""
        assert self.sliced is not None
        sizes = dict(places)
        point = np.asarray(sizes.pop(X)) + 1j * np.asarray(sizes.pop(Y))
        margin = sizes.pop(MARGIN, None)
        sizes[VALUE] = sizes.pop(FIRST) + z.real
        dear = margin is not None or any(self.sliced.labels[k][1].startswith("assembly") for k in self.rows)
        found = self.sliced.margins(np.broadcast_to(point, z.shape), sizes, assembly=dear)
        if margin is None:
            return found[list(self.rows)]
        # Outside one margin, whatever the others are; unknown is not outside.
        index = np.broadcast_to(np.asarray(margin, dtype=np.intp), z.shape)
        return -np.take_along_axis(found, index[None], axis=0)


@dataclass(frozen=True, eq=False)
class Across:
    """Rays in the plane of radius and value.

    Parameters
    ----------
    sliced : Sliced
    theta : ndarray, shape (rays,)
    about : complex
        Where rays start.
    low, high : float
        The range.
    every : bool
        Whether what is outside is looked at: where any one margin is negative.
    own : ndarray of int, shape (rays,)
        The margin that is zero where the ray is looked at.
    """

    sliced: Sliced
    theta: Floats
    about: complex
    low: float
    high: float
    every: bool
    own: Ints

    def margins(self, ray: Ints, radius: Floats, value: Floats) -> Floats:
        """Margins, negated where what is outside is looked at, and the distances from both ends of the range."""
        z = self.about + radius * np.exp(1j * self.theta[ray])
        found = self.sliced.margins(z, {VALUE: value})
        return np.concatenate([-found if self.every else found, [value - self.low, self.high - value]])

    def cut(self, ray: Ints, radius: Floats) -> tuple[Ints, Floats, Ints]:
        """Intervals of the range at points of rays, see `extremes.Cut`."""
        z = self.about + radius * np.exp(1j * self.theta[ray])
        lane, count = np.arange(len(ray)), len(self.sliced.labels)
        places = {X: z.real, Y: z.imag, FIRST: np.full(len(z), self.low)}
        ends = np.tile([[self.low], [self.high]], len(ray))
        names = np.tile([[count], [count + 1]], len(ray))
        if self.every:
            values = np.linspace(self.low, self.high, VALUES)[:, None]
            at = self.sliced.margins(np.broadcast_to(z, (VALUES, len(z))), {VALUE: values})
            some = np.any(at < 0, axis=1).T.copy()
            # It may be negative between these values, too.
            some[lane, self.own[ray]] = True
            lane, margin = np.nonzero(some)
            places = {name: place[lane] for name, place in places.items()} | {MARGIN: margin}
            which, ends, _ = self._within((), places, ends[:, lane], names[:, lane])
            names = np.where(ends == np.array([[self.low], [self.high]]), names[:, :1], margin[which])
            return lane[which], ends, names
        # First those where others end with a square root, so that what is thin beside them is met.
        closures = np.flatnonzero(self.sliced.singular)
        for rows in (closures, np.setdiff1d(np.arange(count), closures)):
            if rows.size and len(lane):
                which, ends, names = self._within(tuple(rows), places, ends, names)
                lane, places = lane[which], {name: place[which] for name, place in places.items()}
        return lane, ends, names

    def _within(self, rows: tuple[int, ...], places: Places, ends: Floats, names: Ints) -> tuple[Ints, Floats, Ints]:
        """Parts of intervals where some margins are positive: which interval, ends and their names."""
        n = ends.shape[1]
        designs = Designs(_Turned.of(self.sliced, rows), {**places, FIRST: ends[0]}, n, 0j)
        found = trace(designs, np.arange(n), np.zeros(n), ends[1] - ends[0], VALUES)
        which, label = found.ray, np.stack([found.enters, found.leaves])
        own = np.array(rows or (0,))[label]
        part = ends[0, which] + np.stack([found.inner, found.outer])
        return which, np.where(label < 0, ends[:, which], part), np.where(label < 0, names[:, which], own)
