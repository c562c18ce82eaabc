"""Regions of robots with limits of angles in the plane of the first leg's two angles.

A place of the point is met at one pair of the crank's angle and the rod's angle beside it, for each elbow. For a row
of crank angles the rod's angles at which anything ends are crossings of circles, or bisected between samples where they
have no closed form, so that area and means are sums over the rows of exact integrals: a limit may be as narrow as it
likes.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Complex = np.ndarray
Flags = np.ndarray
# Sides of the elbows of the legs after the first.
Sides = tuple[int, ...]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
BISECTIONS = 45
# Widths of intervals (radians) that have no area, and in which rounding hides how means grow towards the ends.
NARROWEST, NARROW = 1e-9, 1e-7
# Samples near the ends of an interval, as parts of it: determinants go as the root of the distance.
CLOSE = np.array([1e-9, 1e-7, 1e-5, 1e-4])


def cross(a: Complex | complex, b: Complex | complex) -> np.ndarray:
    return np.asarray((np.conj(a) * b).imag)


def told(z: Complex | complex) -> str:
    return f"[{np.real(z):.17g}, {np.imag(z):.17g}]"


def within(angle: np.ndarray, low: float, high: float) -> Flags:
    return np.asarray((angle - low) % (2 * np.pi) <= high - low)


def elbow(z: Complex, base: complex, crank: float, rod: float, side: int) -> tuple[Flags, Complex]:
    """Whether a leg reaches places, and its elbow, from which the rod turns to `side` (1: anticlockwise)."""
    k = z - base
    distance = np.abs(k)
    along = (distance**2 + crank**2 - rod**2) / (2 * distance)
    square = crank**2 - along**2
    return square >= 0, base + k / distance * (along - 1j * side * np.sqrt(np.maximum(square, 0)))


def of_jacobian(one: Complex, two: Complex) -> tuple[np.ndarray, np.ndarray]:
    """Inverse condition number and resistivity, by the point's velocities at unit rates of the two drives."""
    size, total = np.abs(cross(one, two)), np.abs(one) ** 2 + np.abs(two) ** 2
    return 2 * size / (total + np.sqrt(np.maximum(total**2 - 4 * size**2, 0))), 1 / size


def of_inverse(rows: Sequence[Sequence[np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Inverse condition number of matrices of three rows, and the size of their determinants.

    The singular values are the roots of the eigenvalues of the matrix times its transpose, which solve a cubic.
    """
    (a, b, c), (d, e, f), (g, h, i) = rows
    size = np.abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    xx, yy, zz = (sum(v * v for v in row) for row in rows)
    xy, xz, yz = (sum(v * w for v, w in zip(rows[j], rows[k], strict=True)) for j, k in ((0, 1), (0, 2), (1, 2)))
    third = (xx + yy + zz) / 3
    x, y, z = xx - third, yy - third, zz - third
    radius = np.sqrt((x * x + y * y + z * z + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    half = 0.5 * (x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)) / radius**3
    angle = np.arccos(np.clip(half, -1, 1)) / 3
    largest = third + 2 * radius * np.cos(angle)
    middle = third + 2 * radius * np.cos(angle - 2 * np.pi / 3)
    # The smallest would be a difference: it follows from the product of all.
    return size / (largest * np.sqrt(middle)), size


@dataclass(frozen=True)
class Robot:
    """A crank about each of `bases` and a rod at its end; the first leg's ends in the point, less `corners`.

    Parameters
    ----------
    low, high : ndarray, shape (drives,)
        Limits of the drives (radians).
    point : complex
        Place of the point in the sketch.
    pins : ndarray
        Ends of the cranks there.
    """

    bases: Complex
    cranks: np.ndarray
    rods: np.ndarray
    low: np.ndarray
    high: np.ndarray
    point: complex
    pins: Complex
    corners: Complex

    @property
    def drawn(self) -> Sides:
        """Sides of the elbows of the other legs in the sketch."""
        return ()

    @property
    def modes(self) -> Sequence[Sides]:
        """All sides of the elbows of the other legs in the order in which they count: the sketch's first."""
        return list(itertools.product(*((side, -side) for side in self.drawn)))

    def reached(self, z: Complex, pin: Complex, sides: Sides) -> Flags:
        """Whether the other legs reach places within their limits."""
        raise NotImplementedError

    def kept(self, z: Complex, pin: Complex) -> Flags:
        """Whether the forward determinant has the sign of the sketch."""
        return np.ones(z.shape, dtype=bool)

    def indices(self, z: Complex, pin: Complex, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
        """Inverse condition number and resistivity."""
        raise NotImplementedError

    def circles(self, pin: Complex) -> list[tuple[Complex, float, float, complex, float]]:
        """Centre, radius and angle from the rod of a point that turns with it, and circles on which something ends."""
        return []

    def hidden(self, same: bool) -> bool:
        """Whether anything ends at angles of the rod that have no closed form."""
        raise NotImplementedError

    def text(self, assembly: str) -> str:
        raise NotImplementedError

    @property
    def turn(self) -> float:
        """Angle from the first crank to its rod in the sketch."""
        return float(np.angle((self.point + self.corners[0] - self.pins[0]) / (self.pins[0] - self.bases[0])))

    def pose(self, angle: np.ndarray, turn: np.ndarray) -> tuple[Complex, Complex]:
        pin = self.bases[0] + self.cranks[0] * np.exp(1j * angle)
        return pin + self.rods[0] * np.exp(1j * (angle + turn)) - self.corners[0], pin

    def claims(self, angle: np.ndarray, turn: np.ndarray, same: bool) -> np.ndarray:
        """Number of the mode, from 1, in which a pose counts; 0 where another mode counts before it, or none does.

        Each place counts once, in the first mode that reaches it; the sketch's elbow of the first leg is before the
        other one.
        """
        z, pin = self.pose(angle, turn)
        if same:
            return (self.reached(z, pin, self.drawn) & self.kept(z, pin)).astype(np.intp)
        number = self._first(z, pin)
        later = np.nonzero((number > 0) & (turn * self.turn < 0))
        z, angle = z[later], np.broadcast_to(angle, number.shape)[later]
        other = 2 * np.angle(z + self.corners[0] - self.bases[0]) - angle
        before = within(other, self.low[0], self.high[0])
        before[before] = self._first(z[before], self.bases[0] + self.cranks[0] * np.exp(1j * other[before])) > 0
        number[tuple(index[before] for index in later)] = 0
        return number

    def _first(self, z: Complex, pin: Complex) -> np.ndarray:
        number = np.zeros(np.broadcast_shapes(z.shape, pin.shape), dtype=np.intp)
        for k, mode in reversed(list(enumerate(self.modes, start=1))):
            number[self.reached(z, pin, mode)] = k
        return number

    def ends(self, angle: np.ndarray, low: float, high: float) -> np.ndarray:
        """Angles of the rod at which anything may end, ascending in each row of crank angles, from `low` to `high`."""
        ends = [np.full(angle.shape, end) for end in (low, 0.0, high)]
        for centre, radius, offset, other, distance in self.circles(
            self.bases[0] + self.cranks[0] * np.exp(1j * angle)
        ):
            k = other - centre
            half = np.arccos((radius**2 + np.abs(k) ** 2 - distance**2) / (2 * radius * np.abs(k)))
            ends += [np.angle(k) + side * half - offset - angle for side in (1, -1)]
            # A row may nearly touch a circle on which resistivity is infinite.
            ends += [np.angle(side * k) - offset - angle for side in (1, -1)]
        # Where the other elbow of the first leg meets the limits of its crank.
        for limit in (self.low[0], self.high[0]):
            aside = 0.5 * (limit - angle)
            beyond = np.arcsin(self.cranks[0] * np.sin(aside) / self.rods[0])
            ends += [aside + beyond, aside + np.pi - beyond]
        every = (np.stack(ends, axis=1) - low) % (2 * np.pi) + low
        every[:, 2] = high
        return np.sort(np.where(every <= high, every, low), axis=1)

    def integrals(self, same: bool, rows: int, samples: int, parts: int) -> np.ndarray | None:
        """Area and the means of inverse condition and resistivity; None where no row meets the sketch.

        Parameters
        ----------
        rows : int
            Crank angles.
        samples : int
            Samples of each interval in which something may end that has no closed form.
        parts : int
            Parts of an interval for the means.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._integrals(same, rows, samples, parts)

    def _intervals(self, same: bool, angle: np.ndarray, samples: int) -> tuple[np.ndarray, ...]:
        """Row, both ends and mode of the intervals of the rod's angle that count."""
        low, high = (-np.pi, np.pi) if not same else (0.0, np.pi) if self.turn > 0 else (-np.pi, 0.0)
        ends = self.ends(angle, low, high)
        row, cell = np.nonzero(np.diff(ends, axis=1) > NARROWEST)
        begin, end = ends[row, cell], ends[row, cell + 1]
        if self.hidden(same):
            part = 0.5 * (1 - np.cos(np.pi * (np.arange(samples) + 0.5) / samples))
            part = np.concatenate([CLOSE, part, 1 - CLOSE[::-1]])
            z, pin = self.pose(angle[row], 0.5 * (begin + end))
            open_ = self.reached(z, pin, self.drawn) if same else self._first(z, pin) > 0
            row, begin, end = row[open_], begin[open_], end[open_]
            places = begin[:, None] + (end - begin)[:, None] * part
            number = self.claims(angle[row][:, None], places, same)
            lane, at = np.nonzero(np.diff(number, axis=1))
            before, after, first = places[lane, at], places[lane, at + 1], number[lane, at]
            for _ in range(BISECTIONS):
                middle = 0.5 * (before + after)
                still = self.claims(angle[row[lane]], middle, same) == first
                before, after = np.where(still, middle, before), np.where(still, after, middle)
            owner = np.concatenate([np.arange(len(row)), lane])
            begins, numbers = np.concatenate([begin, after]), np.concatenate([number[:, 0], number[lane, at + 1]])
            order = np.lexsort((begins, owner))
            owner, begin, number = owner[order], begins[order], numbers[order]
            last = np.append(owner[1:] != owner[:-1], True)[: len(owner)]
            row, end = row[owner], np.where(last, end[owner], np.append(begin[1:], 0.0)[: len(owner)])
        else:
            number = self.claims(angle[row], 0.5 * (begin + end), same)
        counts = number > 0
        return tuple(values[counts] for values in (row, begin, end, number))

    def _integrals(self, same: bool, rows: int, samples: int, parts: int) -> np.ndarray | None:
        step = (self.high[0] - self.low[0]) / rows
        angle = self.low[0] + (np.arange(rows) + 0.5) * step
        row, begin, end, number = self._intervals(same, angle, samples)
        if same:
            own = self._with_sketch(row, begin, end, rows)
            if own is None:
                return None
            row, begin, end, number = (values[own] for values in (row, begin, end, number))
        scale = step * self.cranks[0] * self.rods[0]
        area = scale * float(np.abs(np.cos(begin) - np.cos(end)).sum())
        # Means grow like one over a root towards the ends.
        v = np.pi * ((np.arange(parts)[:, None] + 0.5 + 0.5 * NODES) / parts).ravel()
        weight = np.sin(v) * np.tile(WEIGHTS / parts, parts)
        means = np.zeros(2)
        for k, mode in enumerate(self.modes, start=1):
            own = np.flatnonzero((number == k) & (end - begin > NARROW))
            at = begin[own][:, None] + (end - begin)[own][:, None] * 0.5 * (1 - np.cos(v))
            weights = scale * (end - begin)[own][:, None] * 0.25 * np.pi * weight * np.abs(np.sin(at))
            values = self.indices(*self.pose(angle[row[own]][:, None], at), mode)
            means += [float((weights * value).sum()) for value in values]
        return np.array([area, *(means / area)])

    def _with_sketch(self, row: np.ndarray, begin: np.ndarray, end: np.ndarray, rows: int) -> Flags | None:
        """Which intervals hang together with the one that is nearest to the sketch."""
        first = np.searchsorted(row, np.arange(rows + 2))
        most = int(np.diff(first).max(initial=0))
        # What ends may divide that end nothing here.
        beside = np.flatnonzero((row[1:] == row[:-1]) & (begin[1:] <= end[:-1] + NARROWEST))
        pairs = [np.stack([beside, beside + 1])]
        for other in range(most):
            beside = first[row + 1] + other
            one = np.flatnonzero(beside < first[np.minimum(row + 2, rows + 1)])
            two = beside[one]
            meet = (begin[one] < end[two]) & (begin[two] < end[one])
            pairs.append(np.stack([one[meet], two[meet]]))
        one, two = np.concatenate(pairs, axis=1)
        size = len(row)
        _, piece = connected_components(coo_array((np.ones(len(one)), (one, two)), shape=(size, size)), directed=False)
        drawn = np.angle(self.pins[0] - self.bases[0])
        at = int((drawn - self.low[0]) % (2 * np.pi) / (self.high[0] - self.low[0]) * rows)
        near = np.flatnonzero(np.abs(row - at) <= 1)
        if not near.size:
            return None
        away = np.maximum(np.maximum(begin[near] - self.turn, self.turn - end[near]), 0) + 1e-6 * np.abs(row[near] - at)
        return np.asarray(piece == piece[near[away.argmin()]])

    def moved(self, turn: complex, shift: complex, mirrored: bool) -> Self:
        """The same robot turned and scaled by a complex number and moved, mirrored before that."""

        def place(z: Complex) -> Complex:
            return np.conj(z) if mirrored else z

        low, high = (-self.high, -self.low) if mirrored else (self.low, self.high)
        scale, angles = abs(turn), np.angle(turn) * self.turned
        return replace(
            self, bases=place(self.bases) * turn + shift, pins=place(self.pins) * turn + shift,
            point=complex(place(np.array(self.point)) * turn + shift), corners=place(self.corners) * turn,
            cranks=self.cranks * scale, rods=self.rods * scale, low=low + angles, high=high + angles,
        )  # fmt: skip

    @property
    def turned(self) -> np.ndarray:
        """Which limits turn with the robot: those of angles about the ground."""
        return np.ones(len(self.low))

    @property
    def limits(self) -> str:
        low, high = np.degrees([self.low, self.high])
        return "".join(f"\n    - {{drive: q{k}, min: {low[k]:.17g}, max: {high[k]:.17g}}}" for k in range(len(low)))
