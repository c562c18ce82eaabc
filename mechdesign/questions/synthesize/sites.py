"""Where the frame, or the body, has room for pivots and pins: everywhere, in a box, on a line, at given points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.questions.synthesize.schema import Region

# Points are in place within this part of the size of the task.
_SLACK = 1e-6
_EVERYWHERE = (-np.inf, np.inf)
_NONE = np.empty(0, dtype=complex)


@dataclass(frozen=True, eq=False)
class Site:
    """Where dyads are joined to the frame or to the body; a slide is in place where it runs through such a point.

    Parameters
    ----------
    centre, size, reach : complex, float, float
        Middle and size of the task, and how many sizes away samples are where the site has no end.
    given : ndarray of complex
        Given points; without them it is a box with sides along `axis` and across it.
    origin, axis : complex
        A place and a direction (of size 1), from which the box counts.
    ends : pair of pairs
        Ends of the box along its sides; equal where it is a line.
    """

    centre: complex
    size: float
    reach: float
    given: Complexes = field(default_factory=lambda: _NONE)
    origin: complex = 0j
    axis: complex = 1.0 + 0j
    ends: tuple[tuple[float, float], tuple[float, float]] = (_EVERYWHERE, _EVERYWHERE)

    @classmethod
    def of(
        cls, places: Sequence[tuple[float, float]] | Region | None, centre: complex, size: float, reach: float,
        factor: float,
    ) -> Site:  # fmt: skip
        """What a study gives; `factor` is radians in its unit of angle."""
        if places is None:
            return cls(centre, size, reach)
        if not isinstance(places, Region):
            return cls(centre, size, reach, np.array([complex(*place) for place in places]))
        if places.through is not None:
            line = _EVERYWHERE, (0.0, 0.0)
            return cls(centre, size, reach, _NONE, complex(*places.through), places.along(factor), line)
        x, y = (side if isinstance(side, tuple) else _EVERYWHERE if side is None else (side, side)
                for side in (places.x, places.y))  # fmt: skip
        return cls(centre, size, reach, ends=(x, y))

    @property
    def fixed(self) -> tuple[bool, bool]:
        """Along which of its sides a point has no choice."""
        along, across = (low == high or len(self.given) > 0 for low, high in self.ends)
        return along, across

    @property
    def slack(self) -> float:
        """Within what points are in place."""
        return _SLACK * self.size

    @property
    def around(self) -> list[Site]:
        """The sites of two points: beside a single given point the other has a choice."""
        return [self, Site(self.centre, self.size, self.reach)] if len(self.given) == 1 else [self]

    @property
    def within_reach(self) -> Site:
        """The part of it that is a box within reach."""
        if len(self.given):
            return self
        own, half = (self.centre - self.origin) / self.axis, self.reach * self.size / np.sqrt(2)
        x, y = (ends if np.isfinite(ends).all() else (max(ends[0], side - half), min(ends[1], side + half))
                for side, ends in zip((own.real, own.imag), self.ends, strict=True))  # fmt: skip
        return replace(self, ends=(x, y))

    def scaled(self, centre: complex, size: float) -> Site:
        """The site in lengths of a size from a centre."""
        x, y = ((low / size, high / size) for low, high in self.ends)
        return replace(
            self, centre=(self.centre - centre) / size, size=self.size / size, given=(self.given - centre) / size,
            origin=(self.origin - centre) / size, ends=(x, y),
        )  # fmt: skip

    def samples(self, random: np.random.Generator, count: int) -> Complexes:
        """Points of it; each given one equally often."""
        if len(self.given):
            return np.asarray(np.resize(self.given, count))
        circle = np.sqrt(random.uniform(size=count)) * np.exp(1j * random.uniform(-np.pi, np.pi, count))
        own = (self.centre + self.reach * self.size * circle - self.origin) / self.axis
        x, y = (side if np.isinf(ends[0]) else random.uniform(*ends, count)
                for side, ends in zip((own.real, own.imag), self.ends, strict=True))  # fmt: skip
        return np.asarray(self.origin + self.axis * (x + 1j * y))

    def normals(self, random: np.random.Generator, count: int) -> Complexes:
        """Normals of lines through points of it: that of the line that it is, else any."""
        along, across = self.fixed
        if along != across:
            return np.full(count, self.axis if along else 1j * self.axis)
        return np.asarray(np.exp(1j * random.uniform(0, np.pi, count)))

    def holds(self, places: Complexes) -> Flags:
        """Which places lie in it."""
        return np.asarray(np.abs(places - self.nearest(places)) <= self.slack)

    def nearest(self, places: Complexes) -> Complexes:
        """The points of it that are nearest to places."""
        if len(self.given):
            return np.asarray(self.given[np.abs(places[..., None] - self.given).argmin(axis=-1)])
        own = (places - self.origin) / self.axis
        x, y = (np.clip(side, *ends) for side, ends in zip((own.real, own.imag), self.ends, strict=True))
        return np.asarray(self.origin + self.axis * (x + 1j * y))

    def crossed(self, places: Complexes, normals: Complexes) -> Complexes:
        """Of lines through places the points in it that are nearest to its centre; some point if they pass it by."""
        way = 1j * normals
        feet = places + ((self.centre - places) * np.conj(way)).real * way
        if len(self.given):
            gaps = np.abs(((self.given - feet[:, None]) * np.conj(normals)[:, None]).real)
            return np.asarray(feet + ((self.given[gaps.argmin(axis=1)] - feet) * np.conj(way)).real * way)
        own, step = (feet - self.origin) / self.axis, way / self.axis
        begin, end = np.full(len(feet), -np.inf), np.full(len(feet), np.inf)
        for place, rate, ends in zip((own.real, own.imag), (step.real, step.imag), self.ends, strict=True):
            first, last = np.sort([(ends[0] - place) / rate, (ends[1] - place) / rate], axis=0)
            begin, end = np.fmax(begin, first), np.fmin(end, last)
        part = np.minimum(np.maximum(begin, 0.0), end)
        return np.asarray(feet + np.where(np.isfinite(part), part, 0.0) * way)

    def free(self, places: Complexes, uphill: Floats) -> Floats:
        """Along which sides places may move down a slope, shape (count, 2), as numbers 1 or 0."""
        own = (places - self.origin) / self.axis
        sides = []
        for fixed, place, (low, high), up in zip(
            self.fixed, (own.real, own.imag), self.ends, uphill.T, strict=True
        ):  # fmt: skip
            sides.append(~((place <= low) & (up > 0) | (place >= high) & (up < 0)) & (not fixed))
        return np.stack(sides, axis=1).astype(float)
