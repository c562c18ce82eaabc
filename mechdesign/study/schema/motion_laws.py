"""Laws by which a coordinate moves from one value to another: the rise s from 0 to 1 over the time u from 0 to 1.

Each law is declared by its rise alone; velocity and acceleration are its derivatives. [Norton, *Design of Machinery*,
chapter on cam design; VDI 2143.]
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Phase:
    """Part of a law, ``s = sum of powers[j] u^j + Im(wave exp(i frequency u))/frequency``, from a time on."""

    begin: float
    powers: tuple[float, ...]
    wave: complex = 0.0
    frequency: float = 1.0


@dataclass(frozen=True)
class Law:
    """A law, and its peak velocity and acceleration.

    A move by h in the time T has the peak velocity ``velocity h/T`` and the peak acceleration ``acceleration h/T^2``.
    """

    words: str
    phases: tuple[Phase, ...]
    velocity: float
    acceleration: float

    @property
    def meaning(self) -> str:
        """What it is, and its peaks."""
        return (
            f"{self.words}; peak velocity {self.velocity:.4g} h/T and acceleration {self.acceleration:.4g} h/T^2 of a "
            "move by h in the time T"
        )


_SLOW = math.pi / (4 + math.pi)  # scale of the modified sine

LAWS = {
    "constant": Law("constant velocity, which jumps at both ends", (Phase(0, (0, 1)),), 1, 0),
    "harmonic": Law(
        "half a wave of a cosine; the acceleration jumps at both ends",
        (Phase(0, (0.5,), -0.5j * math.pi, math.pi),), math.pi / 2, math.pi**2 / 2,
    ),
    "cycloidal": Law(
        "a whole sine wave of acceleration, without jumps",
        (Phase(0, (0, 1), -1, 2 * math.pi),), 2, 2 * math.pi,
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
            Phase(0, (0, _SLOW), -_SLOW, 4 * math.pi),
            Phase(1 / 8, (2 / (4 + math.pi), _SLOW), -3 * _SLOW * cmath.exp(1j * math.pi / 3), 4 * math.pi / 3),
            Phase(7 / 8, (4 / (4 + math.pi), _SLOW), -_SLOW, 4 * math.pi),
        ), 4 * _SLOW, 4 * math.pi * _SLOW,
    ),
    "trapezoidal": Law(
        "trapezoidal velocity, as drives have it: a third of the time each speeds up, goes evenly and slows down; the "
        "acceleration jumps",
        (Phase(0, (0, 0, 9 / 4)), Phase(1 / 3, (-1 / 4, 3 / 2)), Phase(2 / 3, (-5 / 4, 9 / 2, -9 / 4))), 3 / 2, 9 / 2,
    ),
}  # fmt: skip
