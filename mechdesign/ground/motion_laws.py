"""Laws by which a coordinate moves from one value to another: the rise s from 0 to 1 over the way u from 0 to 1.

Each law is declared by its rise alone; velocity and acceleration are its derivatives. [Norton, *Design of Machinery*,
chapter on cam design; Rothbart, *Cams*; VDI 2143.]
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints


@dataclass(frozen=True)
class Phase:
    """Part of a law from ``begin`` on, ``s = sum of powers[j] u^j + sum of Im(wave exp(i frequency u))/frequency``.

    `waves` are pairs of a wave and its frequency.
    """

    begin: float
    powers: tuple[float, ...]
    waves: tuple[tuple[complex, float], ...] = ()


@dataclass(frozen=True)
class PhaseTable:
    """Phases as arrays: their powers, shape (..., powers), waves and frequencies, shape (..., waves)."""

    powers: Floats
    waves: Complexes
    frequencies: Floats

    @classmethod
    def of(cls, phases: Sequence[Phase]) -> PhaseTable:
        """A row each phase."""
        widest, most = (max(len(getattr(phase, part)) for phase in phases) for part in ("powers", "waves"))
        powers = np.array([[*phase.powers, *[0.0] * (widest - len(phase.powers))] for phase in phases])
        waves = np.array([[*phase.waves, *[(0.0, 1.0)] * (most - len(phase.waves))] for phase in phases], dtype=complex)
        waves = waves.reshape(len(phases), most, 2)
        return cls(powers, waves[..., 0], waves[..., 1].real)

    @classmethod
    def of_powers(cls, powers: Floats) -> PhaseTable:
        """Polynomials, shape (phases, powers)."""
        return cls(powers, np.empty((len(powers), 0), dtype=complex), np.empty((len(powers), 0)))

    def take(self, rows: Ints | int) -> PhaseTable:
        """Those of some rows."""
        return PhaseTable(self.powers[rows], self.waves[rows], self.frequencies[rows])

    def rise(self, u: Floats, order: int) -> Floats:
        """The rise of a phase at a place of each, shape (n,), or its derivative of some order."""
        powers = self.powers
        for _ in range(order):
            powers = powers[..., 1:] * np.arange(1, powers.shape[-1])
        s = np.zeros(np.shape(u))
        for column in np.moveaxis(powers, -1, 0)[::-1]:
            s = s * u + column
        for wave, frequency in zip(np.moveaxis(self.waves, -1, 0), np.moveaxis(self.frequencies, -1, 0), strict=True):
            if wave.any():
                s += (wave * 1j**order * np.exp(1j * frequency * u)).imag * frequency ** (order - 1.0)
        return s


@dataclass(frozen=True)
class Law:
    """A law, and its peak velocity and acceleration.

    A move by h in the time T has the peak velocity ``velocity h/T`` and the peak acceleration ``acceleration h/T^2``.
    `falling` are the phases of a move to a smaller value, where these are others.
    """

    words: str
    phases: tuple[Phase, ...]
    velocity: float
    acceleration: float
    falling: tuple[Phase, ...] = ()

    @property
    def meaning(self) -> str:
        """What it is, and its peaks."""
        return (
            f"{self.words}; peak velocity {self.velocity:.4g} h/T and acceleration {self.acceleration:.4g} h/T^2 of a "
            "move by h in the time T"
        )

    @property
    def ways(self) -> tuple[tuple[Phase, ...], tuple[Phase, ...]]:
        """Its phases in a move to a larger value, and in one to a smaller."""
        return self.phases, self.falling or self.phases


_SLOW = math.pi / (4 + math.pi)  # scale of the modified sine
_DOUBLE = Phase(0, (3 / 8,), ((-0.5j * math.pi, math.pi), (0.25j * math.pi, 2 * math.pi)))

LAWS = {
    "constant": Law("constant velocity, which jumps at both ends", (Phase(0, (0, 1)),), 1, 0),
    "harmonic": Law(
        "half a wave of a cosine; the acceleration jumps at both ends",
        (Phase(0, (0.5,), ((-0.5j * math.pi, math.pi),)),), math.pi / 2, math.pi**2 / 2,
    ),
    "double_harmonic": Law(
        "(1 - cos(pi u))/2 - (1 - cos(2 pi u))/8, a fall the same backwards; the acceleration is zero at the lower end "
        "and largest at the upper one, where it jumps unless a return by the same law follows at once",
        (_DOUBLE,), 3 * math.sqrt(3) * math.pi / 8, math.pi**2,
        (replace(_DOUBLE, powers=(5 / 8,), waves=((-0.5j * math.pi, math.pi), (-0.25j * math.pi, 2 * math.pi))),),
    ),
    "cycloidal": Law(
        "a whole sine wave of acceleration, without jumps",
        (Phase(0, (0, 1), ((-1, 2 * math.pi),)),), 2, 2 * math.pi,
    ),
    "polynomial345": Law(
        "10 u^3 - 15 u^4 + 6 u^5, without jumps of acceleration",
        (Phase(0, (0, 0, 0, 10, -15, 6)),), 15 / 8, 10 / math.sqrt(3),
    ),
    "polynomial4567": Law(
        "35 u^4 - 84 u^5 + 70 u^6 - 20 u^7, without jumps of acceleration and jerk",
        (Phase(0, (0, 0, 0, 0, 35, -84, 70, -20)),), 35 / 16, 84 / math.sqrt(125),
    ),
    "modified_sine": Law(
        "a slow sine wave of acceleration between two fast quarters, without jumps",
        (
            Phase(0, (0, _SLOW), ((-_SLOW, 4 * math.pi),)),
            Phase(
                1 / 8, (2 / (4 + math.pi), _SLOW), ((-3 * _SLOW * cmath.exp(1j * math.pi / 3), 4 * math.pi / 3),)
            ),
            Phase(7 / 8, (4 / (4 + math.pi), _SLOW), ((-_SLOW, 4 * math.pi),)),
        ), 4 * _SLOW, 4 * math.pi * _SLOW,
    ),
    "trapezoidal": Law(
        "trapezoidal velocity, as drives have it: a third of the time each speeds up, goes evenly and slows down; the "
        "acceleration jumps",
        (Phase(0, (0, 0, 9 / 4)), Phase(1 / 3, (-1 / 4, 3 / 2)), Phase(2 / 3, (-5 / 4, 9 / 2, -9 / 4))), 3 / 2, 9 / 2,
    ),
}  # fmt: skip
