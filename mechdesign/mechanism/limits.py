"""Limits of motion that a study states, as margins: positive inside, zero at the limit, negative outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism.algebra import Value, norm2, wrap
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.model import Term
from mechdesign.mechanism.turns import TURN, within


@dataclass(frozen=True)
class Bound:
    """A limit with its coordinate looked up; `drive` where it is that of a drive, whose turns count."""

    coordinate: Coordinate
    minimum: Term | None
    maximum: Term | None
    label: str
    drive: bool = False

    def scale(self, size: float) -> float:
        """What rounding in this limit's margins is measured by, for a mechanism of a given size."""
        if self.coordinate.kind == "distance":
            return size**2
        return 2 * np.pi if self.coordinate.quantity == "angle" else size

    def margins(self, configuration: Configuration, places: Mapping[str, Value]) -> list[tuple[str, Value]]:
        """Margins of this limit, each named; distances and legs as differences of squares, quadratic in positions.

        An angle between bounds is judged modulo a turn: it holds if (value - min) mod turn <= max - min. Where the
        turns of a drive count (it is given, or followed along a motion) its value itself is judged, and so is any angle
        that is followed between bounds a turn apart or more.
        """
        low, high = self.ends(places)
        if self.coordinate.kind == "distance":
            a, b = configuration.nodes[self.coordinate.node], configuration.nodes[self.coordinate.other]
            value = norm2(b - a)
            low, high = _squared(low), _squared(high)
        elif self.coordinate.kind == "slide" and self.coordinate.slide in configuration.graph.telescopic:
            value = _squared(configuration.slides[self.coordinate.slide])
            low, high = _squared(low), _squared(high)
        else:
            value = configuration.value(self.coordinate)
            if self.coordinate.quantity == "angle" and low is not None and high is not None:
                half = (high - low) / 2
                away = value - (low + half)
                whole = half >= np.pi
                # A drive is told within its limits, if it can be, or as it is given.
                margin = half - np.abs(away if self.drive else np.where(whole, away, wrap(away)))
                if self.coordinate.name not in configuration.counted:
                    # A full turn leaves nothing out; its margin is a number, for margins are interpolated.
                    margin = np.where(whole, np.pi, margin)
                return [(self.label, margin)]
        found = []
        if low is not None:
            found.append((f"{self.label} min", value - low))
        if high is not None:
            found.append((f"{self.label} max", high - value))
        return found

    @property
    def of_angle(self) -> bool:
        """Whether it is that of an angle between two ends."""
        return self.coordinate.quantity == "angle" and self.minimum is not None and self.maximum is not None

    def counts(self, places: Mapping[str, Value]) -> bool:
        """Whether it depends on the turns of an angle: in an expression, or between ends a turn apart or more."""
        low, high = self.ends(places)
        return self.coordinate.kind == "expression" or (self.of_angle and bool(np.any(high - low >= TURN)))

    def turn(self, places: Mapping[str, Value]) -> dict[str, Value]:
        """Value that a drive's angle is told near, so that it lies within its limits; nothing of other limits."""
        return {self.coordinate.name: within(*self.ends(places))} if self.drive and self.of_angle else {}

    def ends(self, places: Mapping[str, Value]) -> tuple[Value, Value]:
        """Smallest and largest value where the places have given values; None for a side that is left open."""
        low, high = (places[end] if isinstance(end, str) else end for end in (self.minimum, self.maximum))
        return low, high


def _squared(value: Value | None) -> Value | None:
    return None if value is None else value * np.abs(value)
