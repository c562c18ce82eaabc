"""Rates of a motion: of the drives, or of the coordinates that the poses give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value, picked
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization
from mechdesign.mechanism.forces import Moving
from mechdesign.mechanism.jacobians import Jacobian
from mechdesign.mechanism.outputs import second
from mechdesign.motion.motion import SolvedPoses, radians
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text.units import Units


@dataclass(frozen=True, eq=False)
class DriveRates:
    """Velocities and accelerations of the drives, or of as many coordinates (radians and lengths); nan where none."""

    velocities: Sequence[Value]
    accelerations: Sequence[Value]

    def take(self, index: Ints | int) -> DriveRates:
        """Those of some poses, or of one; numbers are the same at all."""
        return DriveRates(*(
            [picked(value, index) for value in values]
            for values in (self.velocities, self.accelerations)
        ))  # fmt: skip


def drive_rates(
    section: MotionSection, solved: SolvedPoses, linear: Linearization
) -> DriveRates:  # fmt: skip
    """Rates of the drives at some poses, as a section asks for them: constant ones, or those of the motion.

    At a speed v along the path of a point, of length s, a coordinate c that the path gives has the velocity c'(s) v
    and the acceleration c''(s) v^2. In a motion over time its derivatives by time are known.

    `linear` is the mechanism at the solved poses.
    """
    mechanism, units, poses = solved.motion.mechanism, solved.motion.units, solved.poses
    section = poses.section(section)
    inverse = section.inverse(mechanism.drives)
    names = solved.names if inverse else mechanism.drives
    coordinates = [mechanism.coordinate(name) for name in names]
    if section.speed is None and section.motion is None:
        rates = constant_rates(mechanism, units, section, names)
    else:
        pace = 1.0 if section.speed is None else section.speed
        nowhere = np.full(poses.count, np.nan)
        rates = DriveRates(*(
            [radians(units, c, derivatives.get(c.name, nowhere) * pace**order) for c in coordinates]
            for order, derivatives in enumerate(poses.rates, 1)
        ))  # fmt: skip
    return inverse_rates(mechanism, linear, coordinates, rates) if inverse else rates


def moving_at(section: MotionSection, solved: SolvedPoses, linear: Linearization) -> Moving:
    """Velocities and accelerations of a mechanism at some poses; it stands still where a section has no rates."""
    if not section.rated:
        return Moving()
    drives = drive_rates(section, solved, linear)
    velocity = linear.velocity(drives.velocities)
    return Moving(velocity, linear.acceleration(velocity, drives.accelerations))


def constant_rates(mechanism: Mechanism, units: Units, section: MotionSection, names: Sequence[str]) -> DriveRates:
    """Rates of some coordinates, as a section gives them in numbers."""
    coordinates = [mechanism.coordinate(name) for name in names]
    return DriveRates(*(
        [radians(units, c, numbers.get(c.name, 0.0)) for c in coordinates]
        for numbers in (section.rates, section.accelerations)
    ))  # fmt: skip


def inverse_rates(
    mechanism: Mechanism, linear: Linearization, coordinates: Sequence[Coordinate], rates: DriveRates
) -> DriveRates:
    """Drive rates that give as many coordinates their velocities v and accelerations a, at a flat batch.

    With J the derivatives of the coordinates by the drives q, J q' = v and J q'' = a - b, where b is what the
    coordinates accelerate by while q'' = 0. Where J is singular there are none.
    """
    matrix, good = _inverted(mechanism, linear, coordinates)
    speeds = _solve(matrix, good, rates.velocities)
    velocity = linear.velocity(speeds)
    coasting = linear.acceleration(velocity, [0.0] * len(coordinates))
    own = [second(linear.configuration, coordinate, velocity, velocity, coasting) for coordinate in coordinates]
    return DriveRates(speeds, _solve(matrix, good, [a - b for a, b in zip(rates.accelerations, own, strict=True)]))


def _inverted(mechanism: Mechanism, linear: Linearization, coordinates: Sequence[Coordinate]) -> tuple[Floats, Flags]:
    """J of the given coordinates, and where it is regular.

    It is so by its determinant over the lengths of its rows (at least 1), all without units.
    """
    matrix, pure = unitless(mechanism, linear, coordinates)
    lengths = np.maximum(np.sqrt(np.einsum("...ij,...ij->...i", pure, pure)), 1.0)
    return matrix, np.abs(np.linalg.det(np.nan_to_num(pure / lengths[..., None]))) >= STALLED


def unitless(
    mechanism: Mechanism, linear: Linearization, coordinates: Sequence[Coordinate]
) -> tuple[Floats, Floats]:  # fmt: skip
    """Jacobian of some coordinates by the drives, and the same with lengths in sizes of the mechanism."""
    matrix, size = Jacobian.of(linear, coordinates).matrix, mechanism.size
    rows = np.array([1 / size if c.quantity == "length" else 1.0 for c in coordinates])
    columns = np.array([size if mechanism.quantity(name) == "length" else 1.0 for name in mechanism.drives])
    return matrix, matrix * rows[:, None] * columns


def _solve(matrix: Floats, good: Flags, right: Sequence[Value]) -> list[Floats]:
    safe = np.where(good[..., None, None], matrix, np.eye(matrix.shape[-1]))
    sides = np.stack([np.broadcast_to(np.asarray(side, dtype=float), good.shape) for side in right], axis=-1)
    solution = np.linalg.solve(safe, sides[..., None])[..., 0]
    return [np.where(good, solution[..., k], np.nan) for k in range(len(right))]
