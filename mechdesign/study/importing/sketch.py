"""The mechanism that a file of another tool shows, whatever the tool: points, links, slides, drives, gears, forces.

Points, links and slides have the names of the file; `names` makes names of a study from them.
Lengths are in the unit of the sketch, angles in radians, positive counter-clockwise, speeds per second.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.names import clean

# Most points, and most links, of a file; most points on links; and the largest number.
MOST = 1000
MOST_ENDS = 5000
# The ground among links, whose names are not empty.
GROUND = ""
LARGEST = 1e12


@dataclass
class FileLink:
    """A rigid body by its points, or a telescopic link of two points, whose length is driven."""

    points: list[str]
    telescopic: bool = False
    mass: float | None = None
    center: complex | None = None  # in the sketch
    inertia: float | None = None


@dataclass(frozen=True)
class Slide:
    """A point that moves along a straight line of a link, the guide.

    The line goes `through` one point of the guide in a `direction`, or through two. Of the point's links the `riders`
    do not turn against the guide; without any the point turns as it slides.
    """

    point: str
    guide: str
    through: tuple[str, ...]
    direction: float = 0.0
    riders: tuple[str, ...] = ()
    limited: bool = False  # whether it stays between its two points


@dataclass(frozen=True)
class FileDrive:
    """A driven link's angle from another link, the length of a telescopic link, or a slide."""

    kind: Literal["angle", "length", "slide"]
    of: str
    base: str = GROUND
    speed: float | None = None
    span: tuple[float, float] | None = None  # values between which it goes to and fro; None: a turn
    held: bool = False

    @property
    def factor(self) -> float:
        """What a number of the sketch is in the study: degrees of an angle, else the same."""
        return math.degrees(1) if self.kind == "angle" else 1.0

    @property
    def rate(self) -> float:
        """Speed in degrees or lengths a second; 0 where the file says none."""
        return self.factor * (self.speed or 0.0)


@dataclass(frozen=True)
class Gears:
    """Two links whose wheels mesh, or have a belt or chain; they turn as the ratio says against the link of their axes.

    `ratio` is what the follower turns by for each turn of the leader, `radius` that of the follower's pulley.
    """

    follower: str
    leader: str
    ratio: float
    axes: tuple[str, str]
    belt: bool = False
    radius: float | None = None


@dataclass(frozen=True)
class Force:
    """A force at a place of a link; a `local` one turns with the link."""

    name: str
    link: str
    place: complex
    vector: complex
    local: bool


@dataclass
class FileSketch:
    """The mechanism of a file. `choices` say how the file was read, `omitted` what the study leaves out.

    The paths of `traced` points are what the file asks for.
    """

    tool: str
    name: str = ""
    units: dict[str, str] = field(default_factory=lambda: {"length": "mm"})
    inertia_unit: str = ""
    points: dict[str, complex] = field(default_factory=dict)
    traced: set[str] = field(default_factory=set)
    links: dict[str, FileLink] = field(default_factory=dict)
    fixed: list[str] = field(default_factory=list)
    welds: list[tuple[str, ...]] = field(default_factory=list)
    slides: dict[str, Slide] = field(default_factory=dict)
    # Points that go no farther from a second one than a third is: on an arc from its middle.
    reaches: list[tuple[str, str, str]] = field(default_factory=list)
    drives: list[FileDrive] = field(default_factory=list)
    gears: list[Gears] = field(default_factory=list)
    forces: list[Force] = field(default_factory=list)
    dynamic: bool = False  # whether masses and forces are asked about
    gravity: bool = False
    choices: list[str] = field(default_factory=list)
    omitted: list[str] = field(default_factory=list)

    def add_point(self, name: str, x: Any, y: Any, *, traced: bool = False, fixed: bool = False) -> None:
        """Add a point.

        Raises
        ------
        StudyError
            If there is one of this name, or its coordinates are no numbers.
        """
        _check_new("joint", name, self.points)
        self.points[name] = complex(number(x, f"x of joint {name!r}"), number(y, f"y of joint {name!r}"))
        if traced:
            self.traced.add(name)
        if fixed:
            self.fixed.append(name)

    def add_link(self, name: str, points: Iterable[str], *, telescopic: bool = False) -> FileLink:
        """Add a link through points that the sketch has.

        Raises
        ------
        StudyError
            If there is one of this name, or a point is missing.
        """
        _check_new("link", name, self.links)
        listed = list(dict.fromkeys(points))
        for point in listed:
            if point not in self.points:
                raise StudyError(f"link {cut(name)!r} has the joint {cut(point)!r}, which the file does not have")
        self.links[name] = FileLink(listed, telescopic)
        if sum(len(link.points) for link in self.links.values()) > MOST_ENDS:
            raise StudyError(f"the links of the file have more than {MOST_ENDS} joints together; take a part of it")
        return self.links[name]

    def fix(self, points: Iterable[str]) -> None:
        """Put points on the ground; those that the sketch does not have are passed over."""
        self.fixed += [point for point in points if point in self.points and point not in self.fixed]

    def add_line(self, point: str, place: complex, angle: float) -> str:
        """Let a point slide along a fixed line through a place, and return the name of the slide."""
        line, slide = clean(f"{point}_line"), clean(f"{point}_slide")
        self.add_point(line, place.real, place.imag, fixed=True)
        self.slides[slide] = Slide(point, GROUND, (line,), angle)
        return slide

    def add_track(self, point: str, ends: Sequence[str], *, limited: bool = False) -> None:
        """Let a point slide along the line of two points of the ground or of one link.

        Raises
        ------
        StudyError
            If nothing has both points, or the point is one of them.
        """
        one, other = ends
        self.slides[clean(f"{point}_slide")] = Slide(point, self._guide(point, ends), (one, other), limited=limited)

    def add_arc(self, point: str, ends: Sequence[str], radius: float) -> None:
        """Let a point move on the arc between two points of the ground or of one link: with a link about its centre.

        Of the two arcs of the radius it is on that which is nearest to it.

        Raises
        ------
        StudyError
            If nothing has both ends, or the radius is too small for them.
        """
        guide, place = self._guide(point, ends), self.points[point]
        begin, end = (self.points[name] for name in ends)
        middle, half = (begin + end) / 2, (end - begin) / 2
        if not 0 < abs(half) <= radius:
            raise StudyError(
                f"{point!r} moves on an arc of radius {radius:.6g}, and its ends are {2 * abs(half):.6g} apart"
            )
        across = 1j * half / abs(half)
        far = across * math.sqrt((radius - abs(half)) * (radius + abs(half)))
        center = min((middle + far, middle - far), key=lambda center: abs(abs(place - center) - radius))
        side = math.copysign(1.0, ((place - middle) * across.conjugate()).real)
        added = {f"{point}_center": center, f"{point}_middle": center + side * radius * across}
        for name, at in added.items():
            self.add_point(name, at.real, at.imag, fixed=guide == GROUND)
            if guide != GROUND:
                self.links[guide].points.append(name)
        self.add_link(f"{point}_arc", (f"{point}_center", point))
        self.reaches.append((point, f"{point}_middle", ends[0]))
        self.choices.append(
            f"{point!r} moves on an arc: link '{point}_arc' holds it about the arc's centre, '{point}_center'"
        )

    def _guide(self, point: str, ends: Sequence[str]) -> str:
        """What has the two ends of the path of a point: the ground, or a link."""
        one, other = ends
        guides = [GROUND] if {one, other} <= {*self.fixed} else self.links_with(one, other)
        if not guides or point in ends:
            raise StudyError(f"{point!r} slides on the line of {one!r} and {other!r}, which are on no common link")
        return guides[0]

    def links_with(self, *points: str) -> list[str]:
        """The links that have all of these points."""
        return [name for name, link in self.links.items() if {*points} <= {*link.points}]

    def moving_at(self, point: str) -> list[str]:
        """The links that have a point, but those whose points are all on the ground."""
        return [name for name in self.links_with(point) if not {*self.links[name].points} <= {*self.fixed}]

    def turned_at(self, point: str) -> list[str]:
        """The moving links that a pin joins, after the ground where it is fixed there."""
        return [GROUND] * (point in self.fixed) + self.moving_at(point)

    def drive_at(self, point: str, speed: float | None = None) -> FileDrive:
        """The drive that moves a point along its slide, or turns the two links that a pin joins.

        Raises
        ------
        StudyError
            If the pin does not join two links, the ground among them.
        """
        for name, slide in self.slides.items():
            if slide.point == point:
                return FileDrive("slide", name)
        links = self.turned_at(point)
        if len(links) != 2:
            raise StudyError(
                f"the drive at joint {point!r} turns one link against another, or against the ground; {len(links)} "
                "meet there: name the link that is driven"
            )
        return FileDrive("angle", links[1], links[0], speed)

    def distance(self, one: str, other: str) -> float:
        """Distance of two points."""
        return abs(self.points[other] - self.points[one])

    def size(self) -> float:
        """The larger side of the sketch."""
        xs, ys = [place.real for place in self.points.values()], [place.imag for place in self.points.values()]
        return max(max(xs) - min(xs), max(ys) - min(ys))


def _check_new(noun: str, name: str, present: dict[str, Any]) -> None:
    if not name:
        raise StudyError(f"a {noun} without a name")
    if name in present:
        raise StudyError(f"two {noun}s have the name {cut(name)!r}")
    if len(present) >= MOST:
        raise StudyError(f"the file has more than {MOST} {noun}s; take a part of it")


def mapping(raw: Any, noun: str) -> dict[str, Any]:
    """A mapping of a file.

    Raises
    ------
    StudyError
        If it is none.
    """
    if not isinstance(raw, dict):
        raise StudyError(f"a {noun} is {cut(repr(raw))}, not a mapping")
    return raw


def listed(raw: Any, meaning: str) -> list[Any]:
    """A list of a file.

    Raises
    ------
    StudyError
        If it is none.
    """
    if not isinstance(raw, list):
        raise StudyError(f"{cut(meaning)} is {cut(repr(raw))}, not a list")
    return raw


def number(raw: Any, meaning: str) -> float:
    """A finite number of a file.

    Raises
    ------
    StudyError
        If it is none, or beyond `LARGEST`.
    """
    try:
        value = math.nan if isinstance(raw, bool) else float(raw)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not abs(value) <= LARGEST:
        raise StudyError(f"{cut(meaning)} is {cut(repr(raw))}, not a number of a sensible size")
    return value
