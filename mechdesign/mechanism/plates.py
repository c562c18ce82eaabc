"""Links as flat plates: the convex hull of a link's points, widened on all sides, and discs for pins.

The distance of two convex hulls is the largest separation along any direction u,

    gap = max_u (min_k b_k . u - max_j a_j . u),

negative by the depth of what they have in common where they overlap. It is that along a normal to a side of one of
them, or along the line between two corners, so that all of these are tried.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.model import Description, Fixed, Link, Plates

# Diameter of a pin and thickness of a plate that a study leaves out, as parts of the width.
PIN, THICKNESS = 0.4, 0.25


def points_of(link: Link) -> tuple[str, ...]:
    """Names of a link's points, its ends first; of a telescopic one also the tip."""
    return tuple(dict.fromkeys((*(link.ends or ()), *link.points)))


def joined(description: Description) -> dict[str, tuple[str, ...]]:
    """Every point at which a pin, a slide or a clamp joins links, and these links."""
    links: dict[str, list[str]] = {}
    for name, link in description.links.items():
        for point in points_of(link):
            links.setdefault(point, []).append(name)
    for joint in description.joints.values():
        if not isinstance(joint, Fixed) and joint.line.link not in links[joint.point]:
            links[joint.point].append(joint.line.link)
    return {point: tuple(names) for point, names in links.items() if len(names) > 1}


@dataclass(frozen=True)
class Sizes:
    """Lengths of plates at some dimensions, in the study's unit; see `Plates`."""

    mechanism: Core
    plates: Plates
    places: Mapping[str, Value]

    def radius(self, link: str) -> Value:
        """Radius of the round ends of a link: half of its width."""
        return self._length(self.plates.widths.get(link, self.plates.width)) / 2

    def pin(self, point: str) -> Value:
        """Radius of the pin at a point."""
        diameter = self.plates.pins.get(point, self.plates.pin)
        return (PIN * self._length(self.plates.width) if diameter is None else self._length(diameter)) / 2

    @property
    def thickness(self) -> Value:
        """Thickness of every plate."""
        given = self.plates.thickness
        return THICKNESS * self._length(self.plates.width) if given is None else self._length(given)

    @property
    def kerf(self) -> Value:
        """Width of a cut."""
        return self._length(self.plates.kerf)

    def _length(self, term: str | float) -> Value:
        return self.mechanism.geometry.term(term, self.places)


@dataclass(frozen=True)
class Pair:
    """What may meet: the plate of a link, or with `pin` the pin at a point, and the plate of another link."""

    one: str
    other: str
    pin: bool = False

    @property
    def name(self) -> str:
        """Column of its clearance."""
        return f"{self.one}.{self.other}.clearance"


def pairs_of(description: Description) -> list[Pair]:
    """What may meet in the plane: links that no joint joins, unless their layers differ, and pins that pass a layer.

    A pin passes the layers between those of the links that it joins, if all of these are given.
    """
    plates = description.plates or Plates(0.0)
    layers, pins = plates.layers, joined(description)
    together = {frozenset(pair) for links in pins.values() for pair in combinations(links, 2)}
    pairs = [
        Pair(one, other)
        for one, other in combinations(description.links, 2)
        if frozenset((one, other)) not in together
        and (one not in layers or other not in layers or layers[one] == layers[other])
    ]
    for point, links in pins.items():
        if all(link in layers for link in links):
            between = range(min(layers[link] for link in links) + 1, max(layers[link] for link in links))
            pairs += [
                Pair(point, link, pin=True)
                for link in description.links
                if link not in links and layers.get(link) in between
            ]
    return pairs


@dataclass(frozen=True)
class Clearances:
    """Clearances of pairs at the poses of a configuration."""

    mechanism: Core
    plates: Plates
    configuration: Configuration

    @cached_property
    def sizes(self) -> Sizes:
        """Lengths of the plates."""
        return Sizes(self.mechanism, self.plates, self.configuration.places)

    def of(self, pair: Pair) -> Value:
        """Distance of the outlines of a pair; where they overlap minus the depth of it; nan of a pose that fails."""
        one, radius = self._pin(pair.one) if pair.pin else self._plate(pair.one)
        other, width = self._plate(pair.other)
        return gap(one, other) - radius - width

    def of_pins(self, one: str, other: str) -> Value:
        """Distance of two pins."""
        (first, radius), (second, width) = self._pin(one), self._pin(other)
        return gap(first, second) - radius - width

    def _plate(self, link: str) -> tuple[list[Vector], Value]:
        points = points_of(self.mechanism.description.links[link])
        return self._at(points), self.sizes.radius(link)

    def _pin(self, point: str) -> tuple[list[Vector], Value]:
        return self._at([point]), self.sizes.pin(point)

    def _at(self, points: Iterable[str]) -> list[Vector]:
        return [self.configuration.nodes[self.mechanism.graph.node(point)] for point in points]


@quiet
def gap(one: Sequence[Vector], other: Sequence[Vector]) -> Value:
    """Distance of the convex hulls of two sets of corners, arrays that broadcast; minus the depth where they overlap.

    It is exact, continuous, and nan where a corner is nan.
    """
    sides = [b - a for corners in (one, other) for a, b in combinations(corners, 2)]
    directions: list[Vector] = [turn * side for side in sides for turn in (1j, -1j)]
    directions += [b - a for a in one for b in other]
    largest: Value = -np.inf
    for direction in directions:
        length = np.abs(direction)
        along = np.conj(direction / length)
        near, far = ([np.real(corner * along) for corner in corners] for corners in (one, other))
        apart = np.minimum.reduce(np.broadcast_arrays(*far)) - np.maximum.reduce(np.broadcast_arrays(*near))
        largest = np.where(length > 0, np.fmax(largest, apart), largest)
    lost = np.isnan(sum(np.abs(corner) for corner in (*one, *other)))
    return np.where(lost, np.nan, np.where(np.isneginf(largest), 0.0, largest))
