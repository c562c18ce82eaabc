"""Limits of motion that a study states, as margins: positive inside, zero at the limit, negative outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism.algebra import Value, norm2, wrap
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.model import Term


@dataclass(frozen=True)
class Bound:
    """A limit with its coordinate looked up."""

    coordinate: Coordinate
    minimum: Term | None
    maximum: Term | None
    label: str

    def scale(self, size: float) -> float:
        """What rounding in this limit's margins is measured by, for a mechanism of a given size."""
        if self.coordinate.kind == "distance":
            return size**2
        return 2 * np.pi if self.coordinate.quantity == "angle" else size

    def margins(self, configuration: Configuration, places: Mapping[str, Value]) -> list[tuple[str, Value]]:
        """Margins of this limit, each named; distances and legs as differences of squares, quadratic in positions.

        An angle between bounds is judged modulo a turn: it holds if (value - min) mod turn <= max - min.
        """

        def term(value: Term) -> Value:
            return places[value] if isinstance(value, str) else value

        low = None if self.minimum is None else term(self.minimum)
        high = None if self.maximum is None else term(self.maximum)
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
                margin = half - np.abs(wrap(value - (low + half)))
                # A full turn leaves nothing out; its margin is a number, for margins are interpolated.
                return [(self.label, np.where(half >= np.pi, np.pi, margin))]
        found = []
        if low is not None:
            found.append((f"{self.label} min", value - low))
        if high is not None:
            found.append((f"{self.label} max", high - value))
        return found


def _squared(value: Value | None) -> Value | None:
    return None if value is None else value * np.abs(value)
