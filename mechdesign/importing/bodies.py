"""The rigid bodies of a sketch: links that are one body are merged, links that nothing holds are left out."""

from __future__ import annotations

from itertools import combinations

from mechdesign.errors import StudyError
from mechdesign.importing.sketch import GROUND, Sketch


class Bodies:
    """The body to which each link of a sketch belongs, the ground among them, and the points of each body.

    Links that are fastened to each other, and links that share two points, are one body, with the name of its first
    link. `points` leaves out bodies that nothing joins to the ground, and those of a single pin that carry nothing.
    """

    def __init__(self, sketch: Sketch) -> None:
        self.sketch = sketch
        self._groups = {GROUND: {GROUND}} | {name: {name} for name in sketch.links}
        for weld in sketch.welds:
            for other in weld[1:]:
                self._merge(weld[0], other)
        while pair := self._sharing_two():
            self._merge(*pair)
        self._take_out_idle()

    def of(self, link: str) -> str:
        """The body of a link."""
        return next(name for name, group in self._groups.items() if link in group)

    def links(self, body: str) -> list[str]:
        """The links that a body is made of."""
        return [link for link in self.sketch.links if link in self._groups[body]]

    def at(self, point: str) -> list[str]:
        """The bodies that have a point."""
        return [body for body, points in self.points.items() if point in points]

    def _merge(self, one: str, other: str) -> None:
        first, second = sorted((self.of(one), self.of(other)), key=[*self._groups].index)
        if first != second:
            if self._telescopic(first) or self._telescopic(second):
                raise StudyError(
                    f"{one!r} and {other!r} are fastened to each other, and one of them changes its length"
                )
            self._groups[first] |= self._groups.pop(second)

    def _telescopic(self, body: str) -> bool:
        return any(self.sketch.links[link].telescopic for link in self.links(body))

    def _all_points(self, body: str) -> list[str]:
        own = self.sketch.fixed if body == GROUND else []
        return list(dict.fromkeys([*own, *(p for link in self.links(body) for p in self.sketch.links[link].points)]))

    def _sharing_two(self) -> tuple[str, str] | None:
        """Two rigid bodies that share two points at different places."""
        owners: dict[str, list[str]] = {}
        for body in self._groups:
            if not self._telescopic(body):
                for point in self._all_points(body):
                    owners.setdefault(point, []).append(body)
        shared: dict[tuple[str, str], str] = {}
        for point, bodies in owners.items():
            for pair in combinations(bodies, 2):
                if self.sketch.distance(shared.setdefault(pair, point), point) > 0:
                    return pair
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
        reached, before = {GROUND}, 0
        while len(reached) > before:
            before = len(reached)
            reached = reached.union(*(tie for tie in ties if tie & reached))
        for body in [body for body in self.points if body not in reached]:
            sketch.omitted.append(f"link {body!r}, which nothing joins to the ground")
            del self.points[body]
        for body, group in self._groups.items():
            if body != GROUND and len(group) > 1:
                sketch.choices.append(f"{' and '.join(map(repr, sorted(group)))} are one rigid link")
        held = sorted(self._groups[GROUND] - {GROUND})
        if held:
            sketch.choices.append(f"part of the ground: {', '.join(map(repr, held))}")
