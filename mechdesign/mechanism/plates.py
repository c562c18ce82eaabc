"""Links as flat plates: the convex hull of a link's points, widened on all sides, and discs for pins.

The distance of two convex hulls is the largest separation along any direction u,

    gap = max_u (min_k b_k . u - max_j a_j . u),

negative by the depth of what they have in common where they overlap. It is that along a normal to a side of one of
them, or along the line between two corners, so that all of these are tried.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.mechanism.algebra import Value, Vector, cross
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.elements.joints import Sliding
from mechdesign.mechanism.elements.plates import Plates
from mechdesign.mechanism.model import Description

# Diameter of a pin and thickness of a plate that a study leaves out, as parts of the width.
PIN, THICKNESS = 0.4, 0.25
# Directions in which a drawn outline is round.
_ROUND = np.exp(2j * np.pi * np.arange(48) / 48)
# Ending of the columns of clearances, and the column of the smallest.
CLEARANCE = "clearance"


def joined(description: Description) -> dict[str, tuple[str, ...]]:
    """Every point at which a pin, a slide or a clamp joins links, and these links."""
    links: dict[str, list[str]] = {}
    for name, link in description.links.items():
        for point in link.all_points:
            links.setdefault(point, []).append(name)
    for joint in description.joints.values():
        if isinstance(joint, Sliding) and joint.line.link not in links[joint.point]:
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

    @property
    def sheet(self) -> Value | None:
        """Width of the sheet on which parts lie; None where the study gives none."""
        return None if self.plates.sheet is None else self._length(self.plates.sheet)

    def _length(self, term: str | float) -> Value:
        return self.mechanism.geometry.term(term, self.places)


@dataclass(frozen=True)
class Item:
    """The plate of a link, or with `pin` the pin at a point, and the links that it joins."""

    name: str
    links: tuple[str, ...]
    pin: bool = False

    def __str__(self) -> str:
        return f"pin {self.name}" if self.pin else self.name


def plate_of(link: str) -> Item:
    """The plate of a link."""
    return Item(link, (link,))


def pins_of(description: Description) -> list[Item]:
    """The pins of all joints."""
    return [Item(point, links, pin=True) for point, links in joined(description).items()]


@dataclass(frozen=True)
class Pair:
    """Two items that may meet."""

    one: Item
    other: Item

    @property
    def name(self) -> str:
        """Column of their clearance."""
        return f"{self.one.name}.{self.other.name}.{CLEARANCE}"


def pairs_of(description: Description) -> list[Pair]:
    """What may meet: links that no joint joins, unless their layers differ, and pins with links whose layer they pass.

    A pin passes the layers between those of the links that it joins, if all of these are given.
    """
    layers = {} if description.plates is None else description.plates.layers
    pins = pins_of(description)
    together = {frozenset(pair) for pin in pins for pair in combinations(pin.links, 2)}
    pairs = [
        Pair(plate_of(one), plate_of(other))
        for one, other in combinations(description.links, 2)
        if frozenset((one, other)) not in together
        and (one not in layers or other not in layers or layers[one] == layers[other])
    ]
    for pin in pins:
        if all(link in layers for link in pin.links):
            ends = [layers[link] for link in pin.links]
            inside = [link for link, layer in layers.items() if min(ends) < layer < max(ends) and link not in pin.links]
            pairs += [Pair(pin, plate_of(link)) for link in inside]
    return pairs


@dataclass(frozen=True)
class Clearances:
    """Clearances of items at the poses of a configuration.

    `corners` are by link the places, in its frame, that its plate goes around; left out, its points.
    """

    mechanism: Core
    plates: Plates
    configuration: Configuration
    corners: Mapping[str, Sequence[complex]] = field(default_factory=dict)

    @cached_property
    def sizes(self) -> Sizes:
        """Lengths of the plates."""
        return Sizes(self.mechanism, self.plates, self.configuration.places)

    def of(self, one: Item, other: Item) -> Value:
        """Distance of two outlines; where they overlap minus the depth of it; nan of a pose that fails."""
        return gap(self.around(one), self.around(other)) - self._radius(one) - self._radius(other)

    def around(self, item: Item) -> list[Vector]:
        """Places in the world that an item goes around."""
        if item.pin:
            return [self._node(item.name)]
        link = self.mechanism.description.links[item.name]
        if item.name not in self.corners:
            return [self._node(point) for point in link.all_points]
        origin, along = self.mechanism.frame(item.name, self.configuration)
        tip = [self._node(link.tip)] if link.tip is not None else []
        return [*(origin + along * corner for corner in self.corners[item.name]), *tip]

    def outline(self, item: Item) -> Complexes:
        """The outline of an item in the one pose of a configuration, counter-clockwise, as places."""
        around = [complex(np.ravel(place)[0]) for place in self.around(item)]
        rounded = np.array(around)[:, None] + float(np.ravel(self._radius(item))[0]) * _ROUND
        return np.array(hull(rounded.ravel().tolist()))

    def moved(self, item: Item, link: str | None = None) -> Value:
        """The longest way of a place of an item from each pose to the next, shape (n - 1,); in a link's frame."""
        places = self.around(item)
        if link is not None:
            origin, along = self.mechanism.frame(link, self.configuration)
            places = [(place - origin) * np.conj(along) for place in places]
        ways = [np.abs(np.diff(place)) for place in places if np.ndim(place)]
        return np.maximum.reduce(ways) if ways else 0.0

    def _radius(self, item: Item) -> Value:
        return self.sizes.pin(item.name) if item.pin else self.sizes.radius(item.name)

    def _node(self, point: str) -> Vector:
        return self.configuration.nodes[self.mechanism.graph.node(point)]


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
        along = np.conj(np.divide(direction, length))
        near, far = ([np.real(corner * along) for corner in corners] for corners in (one, other))
        apart = np.minimum.reduce(np.broadcast_arrays(*far)) - np.maximum.reduce(np.broadcast_arrays(*near))
        largest = np.where(length > 0, np.fmax(largest, apart), largest)
    lost = np.isnan(sum(np.abs(corner) for corner in (*one, *other)))
    return np.where(lost, np.nan, np.where(np.isneginf(largest), 0.0, largest))


def common(one: Complexes, other: Complexes) -> Complexes:
    """What two convex outlines have in common, both counter-clockwise; empty where they are apart."""
    left = one.tolist()
    for begin, end in zip(other.tolist(), np.roll(other, -1).tolist(), strict=True):
        inside = [cross(end - begin, place - begin) for place in left]
        kept: list[complex] = []
        for k, (place, own) in enumerate(zip(left, inside, strict=True)):
            before, there = left[k - 1], inside[k - 1]
            if (own > 0) != (there > 0):
                kept.append(before + (place - before) * there / (there - own))
            kept += [place] if own > 0 else []
        left = kept
    return np.array(left, dtype=complex)


def hull(places: Iterable[complex], flat: float = 1e-12) -> list[complex]:
    """Corners of the convex hull, counter-clockwise; two where all lie on one line.

    A corner that stands out by less than `flat`, in squares of the size, counts as a place on a side.
    """
    ordered = sorted(set(places), key=lambda place: (place.real, place.imag))
    if len(ordered) < 3:
        return ordered
    size = max(abs(place - ordered[0]) for place in ordered)

    def half(sequence: Sequence[complex]) -> list[complex]:
        chain: list[complex] = []
        for place in sequence:
            while len(chain) > 1 and cross(chain[-1] - chain[-2], place - chain[-2]) <= flat * size**2:
                chain.pop()
            chain.append(place)
        return chain[:-1]

    return half(ordered) + half(ordered[::-1])
