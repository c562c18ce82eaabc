"""Arms, five-bars and 3-RRR with limits of angles, and their regions in the plane of the first leg's two angles.

A place of the point is met at one pair of the crank's angle and the rod's angle beside it, for each elbow. For a row
of crank angles the rod's angles at which anything ends are bisected, so that area and means are sums over the rows of
exact integrals: a limit may be as narrow as it likes.
"""

from __future__ import annotations

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
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
BISECTIONS = 45


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


def random_limits(rng: np.random.Generator, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits 2 to 180 degrees wide about angles."""
    width = np.radians(np.exp(rng.uniform(np.log(2), np.log(180), len(angles))))
    low = angles - width * rng.uniform(0.1, 0.9, len(angles))
    return low, low + width


def of_jacobian(one: Complex, two: Complex) -> tuple[np.ndarray, np.ndarray]:
    """Inverse condition number and resistivity, by the point's velocities at unit rates of the two drives."""
    size, total = np.abs(cross(one, two)), np.abs(one) ** 2 + np.abs(two) ** 2
    return 2 * size / (total + np.sqrt(np.maximum(total**2 - 4 * size**2, 0))), 1 / size


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
        """All sides of the elbows of the other legs."""
        return [()]

    def reached(self, z: Complex, pin: Complex, sides: Sides, same: bool) -> Flags:
        """Whether the other legs reach places within their limits, in the sketch's assembly if `same`."""
        raise NotImplementedError

    def indices(self, z: Complex, pin: Complex) -> tuple[np.ndarray, np.ndarray]:
        """Inverse condition number and resistivity in the sketch's mode."""
        raise NotImplementedError

    def circles(self, pin: Complex) -> list[tuple[Complex, float, float, complex, float]]:
        """Centre, radius and angle from the rod of a point that turns with it, and circles on which something ends."""
        return []

    def text(self, assembly: str) -> str:
        raise NotImplementedError

    @property
    def turn(self) -> float:
        """Angle from the first crank to its rod in the sketch."""
        return float(np.angle((self.point + self.corners[0] - self.pins[0]) / (self.pins[0] - self.bases[0])))

    def pose(self, angle: np.ndarray, turn: np.ndarray) -> tuple[Complex, Complex]:
        pin = self.bases[0] + self.cranks[0] * np.exp(1j * angle)
        return pin + self.rods[0] * np.exp(1j * (angle + turn)) - self.corners[0], pin

    def share(self, angle: np.ndarray, turn: np.ndarray, same: bool) -> np.ndarray:
        """1 where a pose counts, a half where the other elbow of the first leg reaches the place, too."""
        z, pin = self.pose(angle, turn)
        if same:
            return self.reached(z, pin, self.drawn, True).astype(float)
        other = 2 * np.angle(z + self.corners[0] - self.bases[0]) - angle
        beside = self.bases[0] + self.cranks[0] * np.exp(1j * other)
        here, there = (np.any([self.reached(z, a, mode, False) for mode in self.modes], axis=0) for a in (pin, beside))
        return np.asarray(here / (1.0 + (there & within(other, self.low[0], self.high[0]))))

    def turns(self, angle: np.ndarray, low: float, high: float, samples: int) -> np.ndarray:
        """Angles of the rod that are looked at: even ones, and one between any two at which something ends."""
        ends = []
        for centre, radius, offset, other, distance in self.circles(
            self.bases[0] + self.cranks[0] * np.exp(1j * angle)
        ):
            k = other - centre
            half = np.arccos((radius**2 + np.abs(k) ** 2 - distance**2) / (2 * radius * np.abs(k)))
            ends += [np.angle(k) + side * half - offset - angle for side in (1, -1)]
        inset = 1e-9 * (high - low)
        even = np.tile(np.linspace(low + inset, high - inset, samples), (len(angle), 1))
        if ends:
            between = np.sort((np.stack(ends, axis=1) - low) % (2 * np.pi) + low, axis=1)
            between = 0.5 * (between[:, 1:] + between[:, :-1])
            known = (between > low + inset) & (between < high - inset)
            even = np.concatenate([even, np.where(known, between, low + inset)], axis=1)
        return np.sort(even, axis=1)

    def integrals(self, same: bool, rows: int, samples: int, parts: int, index: bool) -> np.ndarray | None:
        """Area, and with `index` the means of inverse condition and resistivity; None where no row meets the sketch."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._integrals(same, rows, samples, parts, index)

    def _integrals(self, same: bool, rows: int, samples: int, parts: int, index: bool) -> np.ndarray | None:
        step = (self.high[0] - self.low[0]) / rows
        angle = self.low[0] + (np.arange(rows) + 0.5) * step
        low, high = (-np.pi, np.pi) if not same else (0.0, np.pi) if self.turn > 0 else (-np.pi, 0.0)
        turn = self.turns(angle, low, high, samples)
        value = np.pad(self.share(angle[:, None], turn, same), ((0, 0), (1, 1)))
        turn = np.pad(turn, ((0, 0), (1, 1)), constant_values=((0, 0), (low, high)))
        row, cell = np.nonzero(np.diff(value, axis=1))
        before, after, left, right = turn[row, cell], turn[row, cell + 1], value[row, cell], value[row, cell + 1]
        inner = (cell > 0) & (cell < turn.shape[1] - 2)
        for _ in range(BISECTIONS):
            middle = 0.5 * (before + after)
            first = self.share(angle[row], middle, same) == left
            before, after = np.where(inner & first, middle, before), np.where(inner & ~first, middle, after)
        edge = np.where(cell == 0, low, np.where(inner, 0.5 * (before + after), high))
        held = np.flatnonzero(np.append(row[1:] == row[:-1], False) & (right > 0))
        if same:
            own = self._with_sketch(row[held], edge[held], edge[held + 1], rows)
            if own is None:
                return None
            held = held[own]
        row, begin, end, share = row[held], edge[held], edge[held + 1], right[held]
        # In two where the rod passes over the stretched leg.
        row, share = np.tile(row, 2), np.tile(share, 2)
        begin, end = (np.concatenate([np.minimum(x, 0), np.maximum(x, 0)]) for x in (begin, end))
        scale = step * self.cranks[0] * self.rods[0] * share
        area = float((scale * np.abs(np.cos(begin) - np.cos(end))).sum())
        if not index:
            return np.array([area])
        wide = end > begin
        row, begin, end, scale = row[wide], begin[wide], end[wide], scale[wide]
        # Means grow like one over a root towards the ends.
        v = np.pi * ((np.arange(parts)[:, None] + 0.5 + 0.5 * NODES) / parts).ravel()
        at = begin[:, None] + (end - begin)[:, None] * 0.5 * (1 - np.cos(v))
        weight = (scale * (end - begin))[:, None] * 0.25 * np.pi * np.sin(v) * np.tile(WEIGHTS / parts, parts)
        means = [
            (weight * np.abs(np.sin(at)) * values).sum() for values in self.indices(*self.pose(angle[row][:, None], at))
        ]
        return np.array([area, *(mean / area for mean in means)])

    def _with_sketch(self, row: np.ndarray, begin: np.ndarray, end: np.ndarray, rows: int) -> Flags | None:
        """Which intervals hang together with the one that is nearest to the sketch."""
        first = np.searchsorted(row, np.arange(rows + 2))
        most = int(np.diff(first).max(initial=0))
        pairs = [np.zeros((2, 0), dtype=np.intp)]
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


@dataclass(frozen=True)
class Arm(Robot):
    """Two links, the second driven from the first."""

    @staticmethod
    def of(seed: int) -> Arm:
        rng = np.random.default_rng(seed)
        base, lengths, angles = (
            complex(*rng.uniform(-30, 30, 2)),
            rng.uniform(40, 120, 2),
            rng.uniform(-np.pi, np.pi, 2),
        )
        pin = base + lengths[0] * np.exp(1j * angles[0])
        point = complex(pin + lengths[1] * np.exp(1j * angles.sum()))
        limits = random_limits(rng, angles)
        return Arm(np.array([base]), lengths[:1], lengths[1:], *limits, point, np.array([pin]), np.zeros(1, complex))

    @property
    def turned(self) -> np.ndarray:
        return np.array([1.0, 0.0])

    def reached(self, z: Complex, pin: Complex, sides: Sides, same: bool) -> Flags:
        return within(np.angle((z - pin) / (pin - self.bases[0])), self.low[1], self.high[1])

    def indices(self, z: Complex, pin: Complex) -> tuple[np.ndarray, np.ndarray]:
        return of_jacobian(1j * (z - self.bases[0]), 1j * (z - pin))

    def turns(self, angle: np.ndarray, low: float, high: float, samples: int) -> np.ndarray:
        middle = (0.5 * (self.low[1] + self.high[1]) - low) % (2 * np.pi) + low
        even = Robot.turns(self, angle, low, high, samples)
        return np.sort(np.append(even, np.full((len(angle), 1), middle if middle < high else low), axis=1), axis=1)

    def text(self, assembly: str) -> str:
        return f"""
units: {{length: mm}}
mechanism:
  parameters: {{crank: {self.cranks[0]:.17g}}}
  links: {{ground: {{O: {told(self.bases[0])}}}, upper: [O, A, crank], fore: [A, P, {self.rods[0]:.17g}]}}
  drives: {{q0: {{angle: upper}}, q1: {{angle: fore, from: upper}}}}
  limits:{self.limits}
  sketch: {{A: {told(self.pins[0])}, P: {told(self.point)}}}
workspace: {{point: P, assembly: {assembly}, indices: [inverse_condition, resistivity]}}
"""


@dataclass(frozen=True)
class FiveBar(Robot):
    """A point of the first leg's rod, or its end C; the second leg meets C, at `end` in the frame of the first rod."""

    end: complex = 1.0

    @staticmethod
    def of(seed: int) -> FiveBar:
        rng = np.random.default_rng(seed)
        while True:
            bases = np.array([-1, 1]) * rng.uniform(20, 80, 2) + 1j * rng.uniform(-30, 30, 2)
            cranks, rods, angles = rng.uniform(60, 160, 2), rng.uniform(80, 170, 2), rng.uniform(-np.pi, np.pi, 2)
            # Place of the point with the rod's pin at 0 and C at 1.
            at = 1.0 if rng.random() < 0.4 else complex(rng.uniform(0.2, 1.3), rng.uniform(-0.5, 0.5))
            pins = bases + cranks * np.exp(1j * angles)
            good, pin = elbow(pins[1], complex(pins[0]), rods[0], rods[1], int(rng.choice([-1, 1])))
            if good and abs(np.sin(np.angle((pin - pins[0]) / (pin - pins[1])))) > 0.2:
                break
        point = complex(pins[0] + (pin - pins[0]) * at)
        rods[0] *= abs(at)
        limits = random_limits(rng, angles)
        return FiveBar(bases, cranks, rods, *limits, point, pins, np.zeros(1, complex), 1 / at)

    def moved(self, turn: complex, shift: complex, mirrored: bool) -> Self:
        other = super().moved(turn, shift, mirrored)
        return replace(other, end=complex(np.conj(self.end))) if mirrored else other

    @property
    def joint(self) -> complex:
        """C in the sketch."""
        return complex(self.pins[0] + (self.point - self.pins[0]) * self.end)

    @property
    def drawn(self) -> Sides:
        return (int(np.sign(cross(self.pins[1] - self.bases[1], self.joint - self.pins[1]))),)

    @property
    def modes(self) -> Sequence[Sides]:
        return [(-1,), (1,)]

    def second(self, z: Complex, pin: Complex, side: int) -> tuple[Flags, Complex, Complex]:
        joint = pin + (z - pin) * self.end
        return *elbow(joint, self.bases[1], self.cranks[1], self.rods[1], side), joint

    def reached(self, z: Complex, pin: Complex, sides: Sides, same: bool) -> Flags:
        good, other, joint = self.second(z, pin, *sides)
        good = good & within(np.angle(other - self.bases[1]), self.low[1], self.high[1])
        drawn = cross(self.joint - self.pins[0], self.joint - self.pins[1])
        return np.asarray(good & (cross(joint - pin, joint - other) * drawn > 0) if same else good)

    def indices(self, z: Complex, pin: Complex) -> tuple[np.ndarray, np.ndarray]:
        _, other, joint = self.second(z, pin, *self.drawn)
        bar, size = joint - other, cross(joint - other, joint - pin)
        one = 1j * (pin - self.bases[0]) - 1j * (z - pin) * cross(bar, pin - self.bases[0]) / size
        return of_jacobian(one, 1j * (z - pin) * cross(bar, other - self.bases[1]) / size)

    def circles(self, pin: Complex) -> list[tuple[Complex, float, float, complex, float]]:
        base, crank, rod = complex(self.bases[1]), self.cranks[1], self.rods[1]
        size, offset = self.rods[0] * abs(self.end), float(np.angle(self.end))
        ends = [(base, crank + rod), (base, abs(crank - rod))]
        ends += [(base + crank * np.exp(1j * angle), rod) for angle in (self.low[1], self.high[1])]
        # Where the rods are in line, the second crank's end lies on the first rod's line.
        lines = [(pin, size + rod, offset, base, crank), (pin, size - rod, offset, base, crank)]
        return [*((pin, size, offset, *circle) for circle in ends), *lines]

    def text(self, assembly: str) -> str:
        size = self.rods[0] * abs(self.end)
        return f"""
units: {{length: mm}}
mechanism:
  parameters: {{crank: {self.cranks[0]:.17g}}}
  links:
    ground: {{O0: {told(self.bases[0])}, O1: {told(self.bases[1])}}}
    left: [O0, A, crank]
    coupler: {{A: [0, 0], C: [{size:.17g}, 0], P: {told(size / self.end)}}}
    right: [O1, B, {self.cranks[1]:.17g}]
    rod: [B, C, {self.rods[1]:.17g}]
  drives: {{q0: {{angle: left}}, q1: {{angle: right}}}}
  limits:{self.limits}
  sketch: {{A: {told(self.pins[0])}, B: {told(self.pins[1])}, C: {told(self.joint)}, P: {told(self.point)}}}
workspace: {{point: P, assembly: {assembly}, indices: [inverse_condition, resistivity]}}
"""


@dataclass(frozen=True)
class Platform(Robot):
    """3-RRR, the platform held at the angle of the sketch, 0. The first leg has the narrowest limits."""

    length: float = 60.0

    def moved(self, turn: complex, shift: complex, mirrored: bool) -> Self:
        return replace(super().moved(turn, shift, mirrored), length=self.length * abs(turn))

    @staticmethod
    def of(seed: int) -> Platform:
        rng = np.random.default_rng(seed)
        while True:
            places = np.exp(1j * np.radians(np.array([-150, -30, 90]) + rng.uniform(-30, 30, 3)))
            bases, corners = (
                rng.uniform(120, 300, 3) * places,
                rng.uniform(20, 80, 3) * np.roll(places, rng.integers(3)),
            )
            cranks, rods, sides = rng.uniform(60, 220, 3), rng.uniform(60, 220, 3), rng.choice([-1, 1], 3)
            point = complex(*rng.uniform(-150, 150, 2))
            ends = point + corners
            legs = [elbow(ends[k], bases[k], cranks[k], rods[k], sides[k]) for k in range(3)]
            pins = np.array([pin for _, pin in legs])
            if all(good for good, _ in legs) and np.abs(np.sin(np.angle((ends - pins) / (pins - bases)))).min() > 0.2:
                break
        low, high = random_limits(rng, np.angle(pins - bases))
        order = np.argsort(high - low)
        bases, cranks, rods, low, high, pins, corners = (
            values[order] for values in (bases, cranks, rods, low, high, pins, corners)
        )
        return Platform(bases, cranks, rods, low, high, point, pins, corners)

    @property
    def drawn(self) -> Sides:
        bars = self.point + self.corners - self.pins
        return tuple(np.sign(cross(self.pins - self.bases, bars))[1:].astype(int).tolist())

    @property
    def modes(self) -> Sequence[Sides]:
        return [(one, two) for one in (-1, 1) for two in (-1, 1)]

    def legs(self, z: Complex, pin: Complex, sides: Sides) -> tuple[Flags, list[Complex]]:
        two, three = (
            elbow(z + self.corners[k], self.bases[k], self.cranks[k], self.rods[k], sides[k - 1]) for k in (1, 2)
        )
        return two[0] & three[0], [pin, two[1], three[1]]

    def determinant(self, z: Complex | complex, pins: Sequence[Complex]) -> np.ndarray:
        """Of the rows of the Jacobian, the directions of the rods and their moments."""
        bars = [z + corner - pin for corner, pin in zip(self.corners, pins, strict=True)]
        return np.asarray(sum(cross(self.corners[k], bars[k]) * cross(bars[k - 2], bars[k - 1]) for k in range(3)))

    def reached(self, z: Complex, pin: Complex, sides: Sides, same: bool) -> Flags:
        good, pins = self.legs(z, pin, sides)
        for k in (1, 2):
            good = good & within(np.angle(pins[k] - self.bases[k]), self.low[k], self.high[k])
        return good & (self.determinant(z, pins) * self.determinant(self.point, list(self.pins)) > 0) if same else good

    def indices(self, z: Complex, pin: Complex) -> tuple[np.ndarray, np.ndarray]:
        rows = []
        for k, end in enumerate(self.legs(z, pin, self.drawn)[1]):
            bar = z + self.corners[k] - end
            by_rate = cross(end - self.bases[k], bar)
            rows.append(
                np.stack([bar.real, bar.imag, cross(self.corners[k], bar) / self.length], axis=-1) / by_rate[..., None]
            )
        inverse = np.stack(rows, axis=-2)
        values = np.linalg.svd(inverse, compute_uv=False)
        return values[..., 2] / values[..., 0], self.length * np.abs(np.linalg.det(inverse))

    def circles(self, pin: Complex) -> list[tuple[Complex, float, float, complex, float]]:
        every = []
        for k in (1, 2):
            base, crank, rod = complex(self.bases[k]), self.cranks[k], self.rods[k]
            ends = [(base, crank + rod), (base, abs(crank - rod))]
            ends += [(base + crank * np.exp(1j * angle), rod) for angle in (self.low[k], self.high[k])]
            every += [(pin + self.corners[k] - self.corners[0], self.rods[0], 0.0, *circle) for circle in ends]
        return every

    def text(self, assembly: str) -> str:
        ground, corners, drawn, drives = (
            ", ".join(parts)
            for parts in (
                [f"O{k}: {told(self.bases[k])}" for k in range(3)],
                [f"C{k}: {told(self.corners[k])}" for k in range(3)],
                [f"A{k}: {told(self.pins[k])}, C{k}: {told(self.point + self.corners[k])}" for k in range(3)],
                [f"q{k}: {{angle: crank_{k}}}" for k in range(3)],
            )
        )
        cranks = ["crank", *(f"{crank:.17g}" for crank in self.cranks[1:])]
        legs = "".join(
            f"\n    crank_{k}: [O{k}, A{k}, {cranks[k]}]\n    rod_{k}: [A{k}, C{k}, {self.rods[k]:.17g}]"
            for k in range(3)
        )
        return f"""
units: {{length: mm}}
mechanism:
  parameters: {{crank: {self.cranks[0]:.17g}}}
  links:
    ground: {{{ground}}}{legs}
    platform: {{P: [0, 0], {corners}}}
  drives: {{{drives}}}
  limits:{self.limits}
  sketch: {{{drawn}, P: {told(self.point)}}}
workspace:
  {{point: P, at: {{platform.angle: 0}}, assembly: {assembly}, characteristic_length: {self.length:.17g},
   indices: [inverse_condition, resistivity]}}
"""


KINDS: dict[str, type[Arm] | type[FiveBar] | type[Platform]] = {"arm": Arm, "five_bar": FiveBar, "3-RRR": Platform}
