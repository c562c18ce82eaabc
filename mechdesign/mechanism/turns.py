"""Which of its turns an angle is told in.

A rotation leaves a whole number of turns open. Where a motion, a given value or a nominal pose says more, a
configuration keeps for each angle, by its name, a value that it lies within half a turn of (`Configuration.near`), and
everything that reads the angle, expressions and their derivatives included, takes it there.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate

TURN = 2 * np.pi


def angles_of(coordinates: Iterable[Coordinate]) -> dict[str, Coordinate]:
    """The angles among coordinates and in their expressions, by name."""
    found: dict[str, Coordinate] = {}
    for coordinate in coordinates:
        if coordinate.kind == "angle":
            found[coordinate.name] = coordinate
        found |= angles_of(coordinate.parts)
    return found


def nearest(angle: Value, near: Value) -> Value:
    """An angle in the turn in which it lies within half a turn of `near`."""
    return angle + TURN * np.round((near - angle) / TURN)


def within(low: Value, high: Value) -> Value:
    """Value that an angle lies within half a turn of where it lies between two limits, if it ever does.

    Between limits a turn apart or more every angle has a turn: it is told in the one nearest to zero.
    """
    middle, room = (low + high) / 2, np.maximum((high - low) / 2 - np.pi, 0.0)
    return np.clip(0.0, middle - room, middle + room)
