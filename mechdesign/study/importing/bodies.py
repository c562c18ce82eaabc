"""The rigid bodies of a sketch: links that are one body are merged, links that nothing holds are left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.graphs import pieces
from mechdesign.study.importing.sketch import GROUND, FileSketch


class MergedLinks:
    """The body to which each link of a sketch belongs, the ground among them, and the points of each body.

    Links that are fastened to each other, and links that share two points, are one body, with the name of its first
    link. `points` leaves out bodies that nothing joins to the ground, and those of a single pin that carry nothing.
    """

    def __init__(self, sketch: FileSketch) -> None:
        self.sketch = sketch
        self._groups = {GROUND: {GROUND}} | {name: {name} for name in sketch.links}
        self._order = {name: k for k, name in enumerate(self._groups)}
        self._body = {name: name for name in self._groups}
        for weld in sketch.welds:
            for other in weld[1:]:
                self._merge(weld[0], other)
        self._merge_sharing_two()
        self._take_out_idle()

    def of(self, link: str) -> str:
        """The body of a link."""
        return self._body[link]

    def links(self, body: str) -> list[str]:
        """The links that a body is made of."""
        return sorted(self._groups[body] - {GROUND}, key=self._order.__getitem__)

    def at(self, point: str) -> list[str]:
        """The bodies that have a point."""
        return [body for body, points in self.points.items() if point in points]

    def _merge(self, one: str, other: str) -> str:
        """Make one body of those of two links, and return it."""
        first, second = sorted((self.of(one), self.of(other)), key=self._order.__getitem__)
        if first != second:
            if self._telescopic(first) or self._telescopic(second):
                raise StudyError(
                    f"{one!r} and {other!r} are fastened to each other, and one of them changes its length"
                )
            joined = self._groups.pop(second)
            self._groups[first] |= joined
            self._body |= dict.fromkeys(joined, first)
        return first

    def _telescopic(self, body: str) -> bool:
        return any(self.sketch.links[link].telescopic for link in self.links(body))

    def _all_points(self, body: str) -> list[str]:
        own = self.sketch.fixed if body == GROUND else []
        return list(dict.fromkeys([*own, *(p for link in self.links(body) for p in self.sketch.links[link].points)]))

    def _merge_sharing_two(self) -> None:
        """Merge rigid bodies that share two points at different places; a body that grew is looked at again."""
        points = {body: self._all_points(body) for body in self._groups if not self._telescopic(body)}
        owners: dict[str, set[str]] = {}
        for body, own in points.items():
            for point in own:
                owners.setdefault(point, set()).add(body)
        pending = [*points]
        while pending:
            body = pending.pop()
            if body in self._groups and (other := self._sharing_two(body, points[body], owners)) is not None:
                merged = self._merge(body, other)
                gone = other if merged == body else body
                points[merged] = list(dict.fromkeys(points[merged] + points[gone]))
                for point in points.pop(gone):
                    owners[point] = owners[point] - {gone} | {merged}
                pending.append(merged)

    def _sharing_two(self, body: str, points: Iterable[str], owners: Mapping[str, set[str]]) -> str | None:
        """A body that shares two points at different places with this one."""
        shared: dict[str, str] = {}
        for point in points:
            for other in owners[point] - {body}:
                if self.sketch.distance(shared.setdefault(other, point), point) > 0:
                    return other
        return None

    def _take_out_idle(self) -> None:
        sketch = self.sketch
        self.points = {body: self._all_points(body) for body in self._groups}
        needed = {GROUND, *(self.of(link) for slide in sketch.slides.values() for link in slide.riders)}
        needed |= {self.of(link) for gears in sketch.gears for link in (gears.follower, gears.leader)}
        for body in [body for body, points in self.points.items() if len(points) < 2 and body not in needed]:
            del self.points[body]
        ties = [set(self.at(point)) for point in sketch.points]
        ties += [{self.of(slide.guide), *self.at(slide.point)} for slide in sketch.slides.values()]
        (reached,) = (piece for piece in pieces([{GROUND}, *ties]) if GROUND in piece)
        for body in [body for body in self.points if body not in reached]:
            sketch.omitted.append(f"link {body!r}, which nothing joins to the ground")
            del self.points[body]
        for body, group in self._groups.items():
            if body != GROUND and len(group) > 1:
                sketch.choices.append(f"{' and '.join(map(repr, sorted(group)))} are one rigid link")
        held = sorted(self._groups[GROUND] - {GROUND})
        if held:
            sketch.choices.append(f"part of the ground: {', '.join(map(repr, held))}")
