"""The layer in which each link lies, so that no plate and no pin meets another over the motion.

A plate fills its layer. A pin passes the layers between those of the links that it joins, and for another pin those of
the links too. What meets in the plane at some pose must not share a layer; links that a pin joins always meet, and two
pins of one link always share its layer. A search with back-tracking finds the fewest layers, and among stacks of as
many those with the shortest pins.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mechdesign.door.exporting.exports import Content, export
from mechdesign.door.exporting.view import PosedStudy, several
from mechdesign.ground.cautions import Caution
from mechdesign.mechanism.graph import rod_of
from mechdesign.mechanism.plates import Clearances, Item, Pair, pins_of, plate_of

# Layers that the search for a stack tries at most, one link at a time.
MOST_TRIED = 100_000
# A search that allows meetings counts one of two plates as so many of a pin.
OF_PLATES = 100
HEAD = ("item", "kind", "first_layer", "last_layer", "from_mm", "to_mm")


@export("layers.csv", "the layer of each link in which nothing meets over the motion", order=20)
def layers_csv(view: PosedStudy) -> Content:
    """A row for each plate, rod and pin: its layers, and where it begins and ends above the lowest layer.

    The rod of a telescopic link lies in the layer of its body.
    """
    description, thickness = view.mechanism.description, view.millimetres * float(view.sizes.thickness)
    stack = stacked(tuple(description.links), pins_of(description), [*meetings_of(view)], view.plates.layers)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEAD)
    rows = list[tuple[str, str, int, int]]()
    for link, layer in stack.layers.items():
        rows.append((link, "plate", layer, layer))
        if description.links[link].tip is not None:
            rows.append((rod_of(link).replace(":", " "), "rod", layer, layer))
    for pin in pins_of(description):
        layers = [stack.layers[link] for link in pin.links]
        rows.append((pin.name, "pin", min(layers), max(layers)))
    for item, kind, first, last in rows:
        table.writerow((item, kind, first, last, f"{(first - 1) * thickness:.9g}", f"{last * thickness:.9g}"))
    return Content(text.getvalue(), view.assumed + view.unmoved + stack.cautions)


@dataclass(frozen=True)
class MeetingItems(Pair):
    """Two items that meet in the plane, at a pose in words."""

    pose: str

    @property
    def weight(self) -> int:
        """Its weight in a stack that has it."""
        return 1 if self.one.pin or self.other.pin else OF_PLATES

    def broken(self, layers: Mapping[str, int]) -> bool:
        """Whether both share a layer, among the links that are placed."""
        pins = self.one.pin and self.other.pin
        (begin, end), (first, last) = _span(self.one, layers, whole=pins), _span(self.other, layers, whole=pins)
        return max(begin, first) < min(end, last)

    @property
    def certain(self) -> bool:
        """Whether both share a layer in any stack: two pins of one link."""
        return self.one.pin and self.other.pin and not {*self.one.links}.isdisjoint(self.other.links)

    def __str__(self) -> str:
        return f"{self.one} and {self.other} ({self.pose})"


def _span(item: Item, layers: Mapping[str, int], *, whole: bool) -> tuple[float, float]:
    """Where an item begins and ends, in layers; nothing of one whose links have none.

    A `whole` pin counts in the plates that it joins and between them, else between them alone.
    """
    placed = [layers[link] for link in item.links if link in layers]
    if not placed:
        return 0.0, 0.0
    inside = 0.5 if item.pin and not whole else -0.5
    return min(placed) + inside, max(placed) - inside


@dataclass(frozen=True)
class Layering:
    """The layer of each link, from 1 at the bottom, what meets in it, and whether all stacks were tried."""

    layers: Mapping[str, int]
    meetings: Sequence[MeetingItems] = ()
    complete: bool = True

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """A warning where something meets."""
        if not self.meetings:
            return ()
        head = "no stack was found in which nothing meets"
        if self.complete or all(meeting.certain for meeting in self.meetings):
            head = "in whatever layers, something meets"
        return (Caution("infeasible", f"{head}; here {several(self.meetings)}"),)


def meetings_of(view: PosedStudy) -> Iterator[MeetingItems]:
    """What meets in the plane over the motion.

    Between two poses a distance changes by no more than the fastest corners move: what could meet there counts.
    """
    description = view.mechanism.description
    corners = {link: tuple(view.outline(link)) for link in description.links}
    clearances = Clearances(view.mechanism, view.plates, view.track.configuration, corners)
    plates, pins = [plate_of(link) for link in description.links], pins_of(description)
    shared = {frozenset(pair): pin.name for pin in pins for pair in combinations(pin.links, 2)}
    for one, other in combinations([*plates, *pins], 2):
        common = [link for link in one.links if link in other.links]
        point = shared.get(frozenset((one.name, other.name)))
        if point and not (one.pin or other.pin):
            pose = f"joined at {point}"
        elif common and not (one.pin and other.pin):
            # A pin and a plate that it joins.
            pose = ""
        else:
            pose = _first(view, clearances, one, other, common[0] if common else None)
        if pose:
            yield MeetingItems(one, other, pose)


def _first(view: PosedStudy, clearances: Clearances, one: Item, other: Item, link: str | None) -> str:
    """The first pose of the motion at which two items meet, in words; empty if they never do.

    How far they move is counted in the frame of a `link`, where one is given.
    """
    count = len(view.track.places)
    gap = np.broadcast_to(clearances.of(one, other), count)
    moved = clearances.moved(one, link) + clearances.moved(other, link)
    between = np.where(view.track.follows, (gap[1:] + gap[:-1] - moved) / 2, np.inf)
    least = np.minimum(gap, np.minimum(np.append(between, np.inf), np.append(np.inf, between)))
    row = np.flatnonzero(least < 0)
    return view.words(int(row[0])) if len(row) else ""


def stacked(
    links: Sequence[str], pins: Sequence[Item], meetings: Sequence[MeetingItems], given: Mapping[str, int]
) -> Layering:  # fmt: skip
    """The stack with the fewest layers in which nothing meets, and then the shortest pins; else the fewest meetings.

    Layers that are given are kept.
    """
    avoidable = [meeting for meeting in meetings if not meeting.certain]
    search, most = _Search(links, pins, avoidable, given), max([len(links), *given.values()])
    for count in range(max([1, *given.values()]), most + 1):
        layers = search.best(count)
        if layers is not None:
            return Layering(layers, [meeting for meeting in meetings if meeting.certain], not search.spent)
        if search.spent:
            break
    layers = _Search(links, pins, avoidable, given, strict=False).best(most)
    assert layers is not None
    return Layering(layers, [meeting for meeting in meetings if meeting.broken(layers)], not search.spent)


class _Search:
    """Back-tracking over the links, those that meet most of the placed ones first.

    Where it is not `strict`, meetings are allowed, and their number is what counts first.
    """

    def __init__(
        self, links: Sequence[str], pins: Sequence[Item], meetings: Sequence[MeetingItems], given: Mapping[str, int], *,
        strict: bool = True,
    ) -> None:  # fmt: skip
        self.pins, self.given, self.strict, self.tried = pins, given, strict, 0
        self.of_link = {
            link: [meeting for meeting in meetings if link in (*meeting.one.links, *meeting.other.links)]
            for link in links
        }
        self.order = [*links[:1]]
        while len(self.order) < len(links):
            left = [link for link in links if link not in self.order]
            self.order.append(max(left, key=self._met))

    def _met(self, link: str) -> tuple[bool, int]:
        """How much a link meets the placed ones; given layers come first."""
        others = [{*meeting.one.links, *meeting.other.links} for meeting in self.of_link[link]]
        return link in self.given, sum(not placed.isdisjoint(self.order) for placed in others)

    @property
    def spent(self) -> bool:
        """Whether it has tried as much as it may."""
        return self.tried >= MOST_TRIED

    def best(self, count: int) -> dict[str, int] | None:
        """The best stack of so many layers; None if there is none, or none was found."""
        self._least: tuple[int, int] | None = None
        self._cheapest: dict[str, int] | None = None
        self._place(0, {}, 0, count)
        return None if self._cheapest is None else {link: self._cheapest[link] for link in self.of_link}

    def _place(self, rank: int, layers: dict[str, int], broken: int, count: int) -> None:
        cost = broken, self._length(layers)
        if self.spent or (self._least is not None and cost >= self._least):
            return
        if rank == len(self.order):
            self._least, self._cheapest = cost, dict(layers)
            return
        link = self.order[rank]
        before = self._cost(link, layers)
        for layer in [self.given[link]] if link in self.given else range(1, count + 1):
            self.tried += 1
            layers[link] = layer
            new = self._cost(link, layers) - before
            if not (new and self.strict):
                self._place(rank + 1, layers, broken + new, count)
            del layers[link]

    def _cost(self, link: str, layers: Mapping[str, int]) -> int:
        """Weight of the meetings of a link that share a layer."""
        return sum(meeting.weight for meeting in self.of_link[link] if meeting.broken(layers))

    def _length(self, layers: Mapping[str, int]) -> int:
        """Layers that all pins pass."""
        total = 0
        for pin in self.pins:
            placed = [layers[link] for link in pin.links if link in layers]
            total += max(placed) - min(placed) if placed else 0
        return total
