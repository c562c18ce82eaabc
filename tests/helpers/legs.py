"""Random arms, five-bars and 3-RRR with limits of angles, whose regions are known in the plane of the first leg."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from helpers.joint_plane import Complex, Flags, Robot, Sides, cross, elbow, of_inverse, of_jacobian, told, within


def random_limits(rng: np.random.Generator, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits 2 to 180 degrees wide about angles."""
    width = np.radians(np.exp(rng.uniform(np.log(2), np.log(180), len(angles))))
    low = angles - width * rng.uniform(0.1, 0.9, len(angles))
    return low, low + width


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

    def reached(self, z: Complex, pin: Complex, sides: Sides) -> Flags:
        return within(np.angle((z - pin) / (pin - self.bases[0])), self.low[1], self.high[1])

    def hidden(self, same: bool) -> bool:
        return False

    def indices(self, z: Complex, pin: Complex, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
        return of_jacobian(1j * (z - self.bases[0]), 1j * (z - pin))

    def ends(self, angle: np.ndarray, low: float, high: float) -> np.ndarray:
        every = (np.array([self.low[1], self.high[1], -self.low[1], -self.high[1]]) - low) % (2 * np.pi) + low
        more = np.tile(np.minimum(every, high), (len(angle), 1))
        return np.sort(np.append(super().ends(angle, low, high), more, axis=1), axis=1)

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

    def second(self, z: Complex, pin: Complex, side: int) -> tuple[Flags, Complex, Complex]:
        joint = pin + (z - pin) * self.end
        return *elbow(joint, self.bases[1], self.cranks[1], self.rods[1], side), joint

    def reached(self, z: Complex, pin: Complex, sides: Sides) -> Flags:
        good, other, _ = self.second(z, pin, *sides)
        return np.asarray(good & within(np.angle(other - self.bases[1]), self.low[1], self.high[1]))

    def kept(self, z: Complex, pin: Complex) -> Flags:
        _, other, joint = self.second(z, pin, *self.drawn)
        drawn = cross(self.joint - self.pins[0], self.joint - self.pins[1])
        return np.asarray(cross(joint - pin, joint - other) * drawn > 0)

    def hidden(self, same: bool) -> bool:
        # The joint on the other side of the line from the base to a point of the first rod.
        return not same and abs(self.end - 1) > 1e-12

    def indices(self, z: Complex, pin: Complex, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
        _, other, joint = self.second(z, pin, *sides)
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

    def legs(self, z: Complex, pin: Complex, sides: Sides) -> tuple[Flags, list[Complex]]:
        two, three = (
            elbow(z + self.corners[k], self.bases[k], self.cranks[k], self.rods[k], sides[k - 1]) for k in (1, 2)
        )
        return two[0] & three[0], [pin, two[1], three[1]]

    def determinant(self, z: Complex | complex, pins: Sequence[Complex]) -> np.ndarray:
        """Of the rows of the Jacobian, the directions of the rods and their moments."""
        bars = [z + corner - pin for corner, pin in zip(self.corners, pins, strict=True)]
        return np.asarray(sum(cross(self.corners[k], bars[k]) * cross(bars[k - 2], bars[k - 1]) for k in range(3)))

    def reached(self, z: Complex, pin: Complex, sides: Sides) -> Flags:
        good, pins = self.legs(z, pin, sides)
        for k in (1, 2):
            good = good & within(np.angle(pins[k] - self.bases[k]), self.low[k], self.high[k])
        return good

    def kept(self, z: Complex, pin: Complex) -> Flags:
        pins = self.legs(z, pin, self.drawn)[1]
        return np.asarray(self.determinant(z, pins) * self.determinant(self.point, list(self.pins)) > 0)

    def hidden(self, same: bool) -> bool:
        # The forward determinant.
        return same

    def indices(self, z: Complex, pin: Complex, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
        rows = []
        for k, end in enumerate(self.legs(z, pin, sides)[1]):
            bar = z + self.corners[k] - end
            by_rate = cross(end - self.bases[k], bar)
            rows.append([bar.real / by_rate, bar.imag / by_rate, cross(self.corners[k], bar) / self.length / by_rate])
        condition, size = of_inverse(rows)
        return condition, self.length * size

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
