"""Cuts of a region over a range: which values of the range serve at a point of a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.field import Field, Places
from mechdesign.analyses.workspace.rays import Designs, Floats, Ints, trace
from mechdesign.analyses.workspace.slices import VALUE, Sliced

Complex = NDArray[np.complex128]
# Values that are looked at, of the whole range.
VALUES = 25
# Names among the dimensions by which a point and the margin that is looked at are given.
X, Y, MARGIN = "x of the point", "y of the point", "margin"


@dataclass(frozen=True, eq=False)
class _Turned(Field):
    """A field seen along its range: places are values above the lowest, the point is among the dimensions."""

    sliced: Sliced | None = None
    low: float = 0.0
    every: bool = False

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Of one margin, or of all."""
        assert self.sliced is not None
        return (("limit", "margin"),) if self.every else self.sliced.labels

    def margins(self, z: Complex, places: Places, *, assembly: bool = True) -> Floats:
        """All margins, or that which is named, negated."""
        assert self.sliced is not None
        sizes = dict(places)
        point = np.asarray(sizes.pop(X)) + 1j * np.asarray(sizes.pop(Y))
        margin = sizes.pop(MARGIN, None)
        sizes[VALUE] = self.low + z.real
        found = self.sliced.margins(np.broadcast_to(point, z.shape), sizes, assembly=assembly or self.every)
        if margin is None:
            return found
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
        found = np.where(np.isnan(found), np.nan, -found) if self.every else found
        return np.concatenate([found, [value - self.low, self.high - value]])

    def cut(self, ray: Ints, radius: Floats) -> tuple[Ints, Floats, Ints]:
        """Intervals of the range at points of rays, see `extremes.Cut`."""
        z = self.about + radius * np.exp(1j * self.theta[ray])
        lane, places, count = np.arange(len(ray)), {X: z.real, Y: z.imag}, len(self.sliced.labels)
        margin: Ints = np.zeros(0, dtype=np.intp)
        if self.every:
            values = np.linspace(self.low, self.high, VALUES)[:, None]
            at = self.sliced.margins(np.broadcast_to(z, (VALUES, len(z))), {VALUE: values})
            some = np.any(at < 0, axis=1).T.copy()
            # It may be negative between these values, too.
            some[lane, self.own[ray]] = True
            lane, margin = np.nonzero(some)
            places = {X: z.real[lane], Y: z.imag[lane], MARGIN: margin}
        base = self.sliced
        field = _Turned(
            base.mechanism, base.plan, base.held, base.same_assembly, base.length, base, self.low, self.every
        )
        rays, width = len(lane), self.high - self.low
        found = trace(Designs(field, places, rays, 0j), np.arange(rays), np.zeros(rays), np.full(rays, width), VALUES)
        owner = lane[found.ray]
        names = np.stack([found.enters, found.leaves])
        if self.every:
            names = np.where(names < 0, names, margin[found.ray])
        names = np.where(names < 0, count + np.array([[0], [1]]), names)
        return owner, self.low + np.stack([found.inner, found.outer]), names
