"""A sketch as a study has it: bodies with their frames, names of the study, and what its drives go through."""

from __future__ import annotations

import cmath
import math

from mechdesign.ground.errors import StudyError
from mechdesign.study.importing.bodies import MergedLinks
from mechdesign.study.importing.names import Names, distinct
from mechdesign.study.importing.sketch import GROUND, FileDrive, FileSketch, Force, Slide

Span = tuple[float, float]
"""First and last value of a drive, in degrees or the unit of length."""


class Draft:
    """What of a sketch stands in its study: points of each body, slides that carry a link, and drives by their names.

    Raises
    ------
    StudyError
        If an input moves nothing.
    """

    def __init__(self, sketch: FileSketch) -> None:
        self.sketch = sketch
        self.bodies = MergedLinks(sketch)
        self.names = Names()
        self.places = dict(sketch.points)
        self.points = {body: self._from_pivot(body) for body in self.bodies.points}
        self._marks()
        self.loads = self._forces()
        for points in self.points.values():
            for point in points:
                self.point(point)
        self._frames = {body: self._frame(body) for body in self.points}
        self.moving = [body for body in self.points if body != GROUND]
        for body in self.moving:
            self.link(body)
        self.slides = {name: slide for name, slide in sketch.slides.items() if self._carries(name, slide)}
        self.drives = self._drives()

    def _from_pivot(self, body: str) -> list[str]:
        """The points of a body, from those by which it turns: its angle counts from there."""
        points = self.bodies.points
        bases = [
            drive.base for drive in self.sketch.drives if drive.kind == "angle" and self.bodies.of(drive.of) == body
        ]
        pivots = {point for base in [*bases, GROUND] for point in points.get(self.bodies.of(base), ())}
        return sorted(points[body], key=lambda point: body != GROUND and point not in pivots)

    def point(self, name: str) -> str:
        """The study's name of a point."""
        return self.names.make("point", name)

    def link(self, body: str) -> str:
        """The study's name of a body."""
        return "ground" if body == GROUND else self.names.make("link", body)

    def joint(self, slide: str) -> str:
        """The study's name of a slide."""
        return self.names.make("slide", slide)

    def _marks(self) -> None:
        """Give a wheel that has its axis alone a second point, which shows how it is turned."""
        for gears in self.sketch.gears:
            distance = self.sketch.distance(*gears.axes)
            for link, axis, share in ((gears.follower, 0, 1), (gears.leader, 1, abs(gears.ratio))):
                body = self.bodies.of(link)
                if body in self.points and body != GROUND and len(self.points[body]) == 1:
                    mark = f"{body}_mark"
                    self.places[mark] = self.places[gears.axes[axis]] + 0.8 * distance * share / (1 + abs(gears.ratio))
                    self.points[body].append(mark)
                    self.sketch.choices.append(f"{mark!r} is a point on wheel {body!r}, which shows how it is turned")

    def _forces(self) -> list[tuple[str, str, Force]]:
        """Point and body of each force; the body gets a point where it acts."""
        loads = []
        for force in self.sketch.forces:
            body = self.bodies.of(force.link)
            if body == GROUND or body not in self.points:
                self.sketch.omitted.append(f"force {force.name!r}, which acts on what does not move")
                continue
            point = next((name for name in self.points[body] if self.places[name] == force.place), None)
            if point is None:
                point = distinct(force.name, self.places.__contains__)
                self.places[point] = force.place
                self.points[body].append(point)
            loads.append((point, body, force))
        return loads

    def _frame(self, body: str) -> tuple[complex, float]:
        """Origin and angle of a body's frame; of a link with several points it leads from the first to another."""
        if body == GROUND:
            return 0j, 0.0
        origin, *others = (self.places[point] for point in self.points[body])
        return origin, cmath.phase(next((place for place in others if place != origin), origin + 1) - origin)

    def turn(self, body: str) -> float:
        """Angle of a body's frame in the sketch."""
        return self._frames[body][1]

    def local(self, body: str, place: complex) -> complex:
        """A place of the sketch in a body's frame."""
        return self.turned_back(body, place - self._frames[body][0])

    def turned_back(self, body: str, vector: complex) -> complex:
        """A vector of the sketch in a body's frame."""
        return vector * cmath.rect(1.0, -self.turn(body))

    def _carries(self, name: str, slide: Slide) -> bool:
        guide = self.bodies.of(slide.guide)
        carried = [body for body in self.points if slide.point in self.points[body] and body != guide]
        if guide in self.points and carried and guide not in self.riders(slide):
            return True
        self.sketch.omitted.append(f"slide {name!r}, which carries no link or belongs to none")
        return False

    def riders(self, slide: Slide) -> list[str]:
        """The bodies that a slide moves without turning them."""
        return list(dict.fromkeys(self.bodies.of(link) for link in slide.riders))

    def direction(self, slide: Slide) -> float:
        """Angle of a slide's line in the sketch."""
        if len(slide.through) == 1:
            return slide.direction
        begin, end = (self.places[point] for point in slide.through)
        return cmath.phase(end - begin)

    def _slid(self, slide: Slide) -> float:
        """How far along its line the point of a slide is in the sketch."""
        way = self.places[slide.point] - self.places[slide.through[0]]
        return (way * cmath.rect(1.0, -self.direction(slide))).real

    def _drives(self) -> dict[str, FileDrive]:
        drives = {}
        for drive in self.sketch.drives:
            if drive.kind == "slide":
                if drive.of not in self.slides:
                    raise StudyError(f"the input {drive.of!r} moves a slide that carries no link")
                drives[self.joint(drive.of)] = drive
                continue
            body = self.bodies.of(drive.of)
            if body == GROUND or body not in self.points:
                raise StudyError(f"the input moves link {drive.of!r}, which is part of the ground or joined to nothing")
            if self.bodies.of(drive.base) not in self.points:
                raise StudyError(
                    f"the input moves link {drive.of!r} from link {drive.base!r}, which is joined to nothing"
                )
            drives[self.link(body)] = drive
        return drives

    def start(self, name: str) -> float:
        """Value of a drive in the sketch, in degrees or the unit of length."""
        drive = self.drives[name]
        if drive.kind == "slide":
            return self._slid(self.sketch.slides[drive.of])
        if drive.kind == "length":
            return self.sketch.distance(*self.sketch.links[drive.of].points)
        turn = self.turn(self.bodies.of(drive.of)) - self.turn(self.bodies.of(drive.base))
        return math.degrees(math.remainder(turn, 2 * math.pi))

    def span(self, name: str) -> Span:
        """Where a drive may go: through a turn, or where the file says it goes."""
        drive, start = self.drives[name], self.start(name)
        if drive.span is not None:
            return drive.factor * drive.span[0], drive.factor * drive.span[1]
        if drive.kind == "angle":
            return start, start + 360
        if drive.kind == "slide" and len(through := self.sketch.slides[drive.of].through) == 2:
            return 0.0, self.sketch.distance(*through)
        reach = self.sketch.size()
        return (max(start - reach, start / 10) if drive.kind == "length" else start - reach), start + reach

    def period(self, name: str) -> float:
        """Time of a turn of a drive, or of its way to and fro."""
        drive = self.drives[name]
        low, high = self.span(name)
        way = abs(high - low) * (2 if drive.span is not None else 1)
        return way / abs(drive.rate)

    def turned(self, body: str) -> bool:
        """Whether a drive turns a body."""
        return any(drive.kind == "angle" and self.bodies.of(drive.of) == body for drive in self.drives.values())
