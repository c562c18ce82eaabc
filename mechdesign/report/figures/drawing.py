"""A mechanism drawn into axes: links, joints, slides, ground, drives and names, with symbols in points on paper."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.patheffects import Normal, TickedStroke
from matplotlib.transforms import Affine2D, ScaledTranslation, Transform

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.graph import GROUND
from mechdesign.report.figures import style
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.scene import Guide, Scene, hull, pose

BAR = 8.0  # width of a link, points
PIN = 3.6  # radius of a joint
GROUND_HEIGHT = 13.0  # height of the ground symbol
SLIDER_SIZE = (22.0, 13.0)  # points, along its guide and across
ARC = 25.0  # radius of an angle drive's arrow
FORCE = 34.0  # length of a force's arrow
_GHOST = "#777777"
_STEEL = "#777777"
Color = str | tuple[float, float, float]
DRIVE_COLOR = style.VERMILION
LINK_COLORS = (style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, "#8A6A2A", "#5B4FA2", "#6E6E6E")
Travel = Mapping[str, tuple[float, float]]
_MIN_SWEEP = 0.2  # radians; a smaller angle gets an arrow of the positive sense instead
_NESTING = 9.0  # points between the arrows of drives at one pivot
_PUSH = 30.0  # length of a straight arrow, points


def lighter(color: str, share: float = 0.62) -> Color:
    """A colour mixed with white."""
    red, green, blue = (1 - (1 - part) * (1 - share) for part in to_rgb(color))
    return red, green, blue


def darker(color: str, share: float = 0.3) -> Color:
    """A colour mixed with black, for text."""
    red, green, blue = (part * (1 - share) for part in to_rgb(color))
    return red, green, blue


@dataclass(frozen=True)
class Pen:
    """Draws symbols on axes; `order` lifts a drawing above those of lower order, `alpha` makes it faint."""

    axes: Axes
    alpha: float = 1.0
    order: float = 3.0
    size: float = 1.0

    def _line(self, ends: Sequence[complex], lift: float, width: float, color: Color, **more: Any) -> Line2D:
        line = Line2D(
            [end.real for end in ends], [end.imag for end in ends], lw=width * self.size, color=color, alpha=self.alpha,
            zorder=self.order + lift, **more,
        )  # fmt: skip
        self.axes.add_line(line)
        return line

    def _at(self, place: complex, turn: float = 0.0) -> Transform:
        """Points on paper, turned about and moved to a place of the drawing."""
        figure = self.axes.get_figure(root=True)
        assert figure is not None
        # The stubs ask for an affine transform; any that maps the place to pixels will do.
        moved = ScaledTranslation(place.real, place.imag, self.axes.transData)  # type: ignore[arg-type]
        return Affine2D().rotate(turn).scale(self.size / 72) + figure.dpi_scale_trans + moved

    def _symbol(self, path: Path, transform: Transform, lift: float, **look: Any) -> None:
        self.axes.add_artist(
            PathPatch(path, transform=transform, alpha=self.alpha, zorder=self.order + lift, clip_on=True, **look)
        )

    def line(self, ends: Sequence[complex], color: str, dashes: Any = "-") -> None:
        """A link as a thin line along its points: for ghosts."""
        self._line(ends, 0.1, 1.3, color, solid_capstyle="round", solid_joinstyle="round", linestyle=dashes)

    def bar(self, ends: Sequence[complex], color: str, width: float = BAR) -> None:
        """A link as a bar with round ends along a line of points."""
        self._line(ends, 0.1, width, color, solid_capstyle="round", solid_joinstyle="round")
        self._line(ends, 0.11, width - 2.4, lighter(color), solid_capstyle="round", solid_joinstyle="round")

    def plate(self, corners: Sequence[complex], color: str, rank: int = 0) -> None:
        """A link with more than two points as a plate with round corners; a higher rank lies on a lower one."""
        vertices = [(corner.real, corner.imag) for corner in corners]
        below = 0.1 * (1 - 0.5**rank)
        for lift, width, shade in ((below, BAR, color), (below, BAR - 2.4, lighter(color))):
            self.axes.add_patch(
                Polygon(vertices, closed=True, facecolor=shade, edgecolor=shade, lw=width * self.size,
                        joinstyle="round", alpha=self.alpha, zorder=self.order + lift)
            )  # fmt: skip

    def slot(self, ends: Sequence[complex]) -> None:
        """The slit in a bar in which a pin slides."""
        self._line(ends, 0.12, BAR - 3.4, "white", solid_capstyle="round")

    def leg(self, base: complex, tip: complex, color: str) -> None:
        """A telescopic leg: cylinder from the base, rod to the tip."""
        middle = base + 0.58 * (tip - base)
        self._line((base, tip), 0.1, 3.6, color, solid_capstyle="round")
        self._line((base, tip), 0.11, 1.6, lighter(color), solid_capstyle="round")
        collar = base + 0.12 * (tip - base)
        self._line((collar, middle), 0.12, BAR + 3, color, solid_capstyle="butt")
        inset = 1.2 / max(BAR, 1.0) * 0.02 * (tip - base)
        self._line((collar + inset, middle - inset), 0.13, BAR + 0.6, lighter(color), solid_capstyle="butt")

    def pin(self, place: complex) -> None:
        """A revolute joint."""
        self._symbol(Path.circle(radius=PIN), self._at(place), 0.5, facecolor="white", edgecolor=style.INK, lw=1.5)

    def clamp(self, place: complex) -> None:
        """A fixed joint."""
        half = PIN
        square = Path([(-half, -half), (half, -half), (half, half), (-half, half), (-half, -half)], closed=True)
        self._symbol(square, self._at(place), 0.5, facecolor=style.INK, edgecolor=style.INK, lw=1.0)

    def tracer(self, place: complex, color: str) -> None:
        """A point of one link only: an output, a coupler point."""
        self._symbol(Path.circle(radius=PIN - 0.8), self._at(place), 0.5, facecolor=color, edgecolor=style.INK, lw=1.0)

    def pivot(self, place: complex) -> None:
        """The ground symbol under a pivot: triangle and hatch."""
        foot = -GROUND_HEIGHT + 3
        triangle = Path([(0, 0), (-8, foot), (8, foot), (0, 0)], closed=True)
        self._symbol(triangle, self._at(place), 0.0, facecolor="#EEEEEE", edgecolor=style.INK, lw=1.2)
        vertices: list[tuple[float, float]] = [(-12, foot), (12, foot)]
        for k in range(5):
            x = -10 + 5.5 * k
            vertices += [(x, foot), (x - 4, foot - 4)]
        codes = [Path.MOVETO, Path.LINETO] * 6
        self._symbol(Path(vertices, codes), self._at(place), 0.0, facecolor="none", edgecolor=style.INK, lw=1.1)

    def rail(self, start: complex, end: complex) -> None:
        """A guide fixed to the ground: the slide's line, and a hatched rail under it."""
        self._line((start, end), 0.0, 0.8, _STEEL, linestyle=(0, (9, 3, 2, 3)))
        along = (end - start) / abs(end - start)
        # The rail is on the lower side.
        down = -1j * along if (-1j * along).imag <= 0 else 1j * along
        figure = self.axes.get_figure(root=True)
        assert figure is not None
        shift = down * (SLIDER_SIZE[1] / 2 + 1.2) * self.size / 72
        offset = self.axes.transData + ScaledTranslation(shift.real, shift.imag, figure.dpi_scale_trans)
        # Ticks stand to the left of the path's direction: run so that this is away from the slider.
        first, last = (start, end) if (1j * along * down.conjugate()).real > 0 else (end, start)
        line = self._line((first, last), 0.0, 1.2, style.INK, transform=offset)
        line.set_path_effects([TickedStroke(angle=135, spacing=5.5, length=0.9), Normal()])

    def block(self, place: complex, direction: complex, color: str) -> None:
        """A slider on its guide."""
        half, high = SLIDER_SIZE[0] / 2, SLIDER_SIZE[1] / 2
        corners = [(-half, -high), (half, -high), (half, high), (-half, high), (-half, -high)]
        where = self._at(place, math.atan2(direction.imag, direction.real))
        self._symbol(Path(corners, closed=True), where, 0.2, facecolor=lighter(color), edgecolor=color, lw=1.4)

    def turn(self, place: complex, start: float, sweep: float, radius: float, color: str) -> None:
        """An angle drive: a curved arrow from the angle `start` (radians), with the line it is measured from."""
        self.arc(place, start, sweep, radius, color)
        base = (radius + 9) * np.exp(1j * start)
        self._symbol(
            Path([(0, 0), (base.real, base.imag)]), self._at(place), 0.3, facecolor="none", edgecolor=color, lw=0.9,
            linestyle=(0, (3, 2)),
        )  # fmt: skip

    def arc(self, place: complex, start: float, sweep: float, radius: float, color: str) -> None:
        """A curved arrow about a place, from the angle `start` over `sweep` (radians); the radius in points."""
        angles = start + np.linspace(0.0, sweep, 48)
        # The head is as long on the arc as it looks; a small angle has a small head.
        head = min(7.0, 0.7 * abs(sweep) * radius)
        stem = radius * np.exp(1j * angles[np.abs(angles - start) <= abs(sweep) - 0.6 * head / radius])
        sign = math.copysign(1.0, sweep)
        tip = radius * np.exp(1j * angles[-1])
        tangent = 1j * sign * np.exp(1j * (angles[-1] - sign * head / (2 * radius)))
        self._arrow(stem, complex(tip), complex(tangent), head, self._at(place), color)

    def push(self, place: complex, direction: complex, length: float, away: float, color: str) -> None:
        """A length or slide drive: a straight arrow (points) beside a line through the place."""
        where = self._at(place, math.atan2(direction.imag, direction.real))
        stem = np.array([-length / 2, length / 2 - 4]) + 1j * away
        self._arrow(stem, complex(length / 2, away), 1.0, 7.0, where, color)

    def force(self, place: complex, direction: complex, color: str) -> None:
        """A force: an arrow that ends at the place where it acts."""
        where = self._at(place, math.atan2(direction.imag, direction.real))
        self._arrow(np.array([-FORCE - PIN, -PIN - 6], dtype=complex), complex(-PIN), 1.0, 9.0, where, color)

    def _arrow(self, stem: np.ndarray, tip: complex, along: complex, head: float, where: Transform, color: str) -> None:
        if len(stem) > 1:
            vertices = np.column_stack([stem.real, stem.imag])
            self._symbol(Path(vertices), where, 0.6, facecolor="none", edgecolor=color, lw=1.7, capstyle="butt")
        back = tip - head * along
        wings = [tip, back + 0.45j * head * along, back - 0.45j * head * along, tip]
        triangle = Path([(wing.real, wing.imag) for wing in wings], closed=True)
        self._symbol(triangle, where, 0.6, facecolor=color, edgecolor="none")


def point_labels(scene: Scene) -> list[Label]:
    """Names of points; what slides in a line has none but its own."""
    slid = {guide.point for guide in scene.guides if guide.slider is not None}
    labels = []
    for name, kind in scene.kinds().items():
        if kind != "none" or name in slid:
            reach = SLIDER_SIZE[1] / 2 if name in slid else PIN
            labels.append(Label(name, (scene.points[name],), style.INK, reach + 4, size=10.5))
    return labels


def _draw_drives(pen: Pen, scene: Scene) -> list[Label]:
    """Draw an arrow for each drive, and return their names.

    That of an angle runs from the line it is measured from, that of a length or slide in its positive sense.
    """
    labels: list[Label] = []
    turned: list[complex] = []
    for name, drive in scene.description.drives.items():
        if drive.kind == "angle":
            place = scene.points[scene.pivot(drive.target, drive.reference)]
            radius = ARC + _NESTING * turned.count(place)
            turned.append(place)
            start = cmath.phase(scene.rotations[drive.reference])
            sweep = cmath.phase(scene.rotations[drive.target] / scene.rotations[drive.reference])
            if abs(sweep) < _MIN_SWEEP:
                sweep = 4 * _MIN_SWEEP
            pen.turn(place, start, sweep, radius, DRIVE_COLOR)
            labels.append(Label(name, (place,), DRIVE_COLOR, radius + 4, start + sweep / 2))
            continue
        if drive.kind == "length":
            ends = scene.description.links[drive.target].ends
            assert ends is not None
            base, leg = scene.points[ends[0]], scene.points[ends[1]] - scene.points[ends[0]]
            place, along, away = base + 0.36 * leg, leg / abs(leg), BAR / 2 + 6
        else:
            guide = next(guide for guide in scene.guides if guide.joint == drive.target)
            place, along, away = guide.pin, guide.along, SLIDER_SIZE[1] / 2 + 6
        pen.push(place, along, _PUSH, away, DRIVE_COLOR)
        labels.append(Label(name, (place,), DRIVE_COLOR, away + 5, cmath.phase(1j * along)))
    return labels


def _slide_labels(scene: Scene) -> list[Label]:
    return [
        Label(guide.joint, (guide.pin,), style.FAINT, SLIDER_SIZE[1] / 2 + 8, -math.pi / 3, 9, optional=True)
        for guide in scene.guides
        if guide.joint not in scene.description.drives
    ]


def link_labels(scene: Scene, colors: Mapping[str, str]) -> list[Label]:
    """Names of the moving links that are no drive."""
    labels = []
    for name in scene.description.links:
        places = [scene.points[point] for point in scene.link_points(name)]
        if name == GROUND or name in scene.description.drives or not places:
            continue
        anchors: tuple[complex, ...]
        if len(places) == 1:
            anchors, reach, heading = (places[0],), SLIDER_SIZE[1] / 2 + 4, -math.pi / 2
        elif len(corners := hull(places)) > 2:
            # The middle of a plate is its own best place.
            anchors, reach, heading = (sum(corners) / len(corners),), 0.0, 0.0
        else:
            run = places[1] - places[0]
            anchors = tuple(places[0] + share * run for share in (0.5, 0.4, 0.6, 0.3, 0.7))
            reach, heading = BAR / 2 + 3, cmath.phase(1j * run if (1j * run).imag >= 0 else -1j * run)
        labels.append(Label(name, anchors, darker(colors[name]), reach, heading, 9, optional=True))
    return labels


def link_colors(mechanism: Mechanism) -> dict[str, str]:
    """The colour of each link, the same in every picture."""
    moving = [name for name in mechanism.description.links if name != GROUND]
    return {name: LINK_COLORS[k % len(LINK_COLORS)] for k, name in enumerate(moving)} | {GROUND: style.INK}


def draw_mechanism(
    axes: Axes,
    mechanism: Mechanism,
    configuration: Configuration,
    index: int = 0,
    *,
    faint: bool = False,
    labels: bool = True,
    drives: bool = True,
    travel: Travel | None = None,
    size: float = 1.0,
) -> None:
    """Draw a mechanism in one pose of a batch; a pose that cannot be assembled draws nothing.

    Sizes of symbols are in points on paper, so that limits may change after drawing; only labels need final limits.
    They keep off what is drawn before.

    Parameters
    ----------
    index : int
        Pose in the flattened batch.
    faint : bool
        Pale and below what is drawn otherwise, without labels and drives: for further poses.
    travel : mapping, optional
        Range of each slide (lengths from the line's origin), which its guide should cover.
    size : float
        Of the symbols; 1 for a drawing as wide as the page.
    """
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=0.22, order=2.0, size=size) if faint else Pen(axes, size=size)
    for point in scene.pivots():
        pen.pivot(scene.points[point])
    _draw_guides(pen, scene, colors, travel or {})
    for rank, (name, body) in enumerate(bodies(scene)):
        if len(body) > 2:
            pen.plate(body, colors[name], rank)
        elif len(body) == 2:
            pen.bar(body, colors[name])
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            pen.leg(scene.points[link.ends[0]], scene.points[link.ends[1]], colors[name])
    for point, kind in scene.kinds().items():
        if kind == "pin":
            pen.pin(scene.points[point])
        elif kind == "clamp":
            pen.clamp(scene.points[point])
        elif kind == "tracer":
            owner = next(name for name in scene.description.links if point in scene.link_points(name))
            pen.tracer(scene.points[point], colors[owner])
    if faint:
        return
    named = _draw_drives(pen, scene) if drives else []
    if labels:
        # The most needed first.
        named = [*point_labels(scene), *named, *_slide_labels(scene), *link_labels(scene, colors)]
        place_labels(axes, named, covered(axes), order=pen.order + 2)


def draw_ghost(
    axes: Axes, mechanism: Mechanism, configuration: Configuration, index: int, *, dashes: Any = "-",
    alpha: float = 0.4,
) -> None:  # fmt: skip
    """Draw a further pose as thin grey lines, which lie below the paths and do not look like them."""
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    pen = Pen(axes, alpha=alpha, order=2.0)
    for _, body in bodies(scene):
        if len(body) > 1:
            pen.line([*body, *(body[:1] if len(body) > 2 else [])], _GHOST, dashes)
    for link in scene.description.links.values():
        if link.telescopic and link.ends:
            pen.line([scene.points[end] for end in link.ends], _GHOST, dashes)
    for guide in scene.guides:
        if guide.owner != GROUND:
            pen.line(reach(scene, guide, (guide.pin,)), _GHOST, dashes)


def bodies(scene: Scene) -> list[tuple[str, list[complex]]]:
    """Outline of each moving rigid link, the largest first so that none hides another."""
    found = []
    for name, link in scene.description.links.items():
        if name != GROUND:
            points = link.points if link.telescopic else scene.link_points(name)
            found.append((name, hull([scene.points[point] for point in points])))
    return sorted(found, key=lambda item: -_area(item[1]))


def _area(corners: list[complex]) -> float:
    turned = zip(corners, corners[1:] + corners[:1], strict=True)
    return abs(sum((a.conjugate() * b).imag for a, b in turned)) / 2 if len(corners) > 2 else 0.0


def _draw_guides(pen: Pen, scene: Scene, colors: Mapping[str, str], travel: Travel) -> None:
    for guide in scene.guides:
        start, end = guide.ends(travel, scene.span)
        if guide.owner == GROUND:
            pen.rail(start, end)
        else:
            pen.bar(reach(scene, guide, (start, end)), colors[guide.owner])
            if guide.slider is None:
                pen.slot((start, end))
        if guide.slider is not None:
            pen.block(guide.pin, guide.along, colors[guide.slider])


def reach(scene: Scene, guide: Guide, places: Iterable[complex]) -> list[complex]:
    """Ends of the line that a link carries: from its own points to where something slides."""
    own = [scene.points[point] for point in scene.link_points(guide.owner)]
    along = [((place - guide.origin) * guide.along.conjugate()).real for place in (*own, *places)]
    return [guide.origin + s * guide.along for s in (min(along), max(along))]
