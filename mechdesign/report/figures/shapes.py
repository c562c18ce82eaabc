"""Symbols of mechanism drawings: sizes in points on paper, places in the study's lengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
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

from mechdesign.report.figures.style import INK

BAR = 8.0  # width of a link, points
PIN = 3.6  # radius of a joint
GROUND_HEIGHT = 13.0  # height of the ground symbol
SLIDER_SIZE = (22.0, 13.0)  # points, along its guide and across
ARC = 25.0  # radius of an angle drive's arrow
_STEEL = "#777777"
Color = str | tuple[float, float, float]


def lighter(color: str, share: float = 0.62) -> Color:
    """A colour mixed with white."""
    red, green, blue = (1 - (1 - part) * (1 - share) for part in to_rgb(color))
    return red, green, blue


def darker(color: str, share: float = 0.3) -> Color:
    """A colour mixed with black, for text."""
    red, green, blue = (part * (1 - share) for part in to_rgb(color))
    return red, green, blue


def rail_side(along: complex) -> complex:
    """Unit vector from a slide's line to its rail: the lower side."""
    return -1j * along if (-1j * along).imag <= 0 else 1j * along


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

    def line(self, ends: Sequence[complex], color: str) -> None:
        """A link as a thin line along its points: for ghosts."""
        self._line(ends, 0.1, 1.9, color, solid_capstyle="round", solid_joinstyle="round")

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
        self._symbol(Path.circle(radius=PIN), self._at(place), 0.5, facecolor="white", edgecolor=INK, lw=1.5)

    def clamp(self, place: complex) -> None:
        """A fixed joint."""
        half = PIN
        square = Path([(-half, -half), (half, -half), (half, half), (-half, half), (-half, -half)], closed=True)
        self._symbol(square, self._at(place), 0.5, facecolor=INK, edgecolor=INK, lw=1.0)

    def tracer(self, place: complex, color: str) -> None:
        """A point of one link only: an output, a coupler point."""
        self._symbol(Path.circle(radius=PIN - 0.8), self._at(place), 0.5, facecolor=color, edgecolor=INK, lw=1.0)

    def pivot(self, place: complex) -> None:
        """The ground symbol under a pivot: triangle and hatch."""
        foot = -GROUND_HEIGHT + 3
        triangle = Path([(0, 0), (-8, foot), (8, foot), (0, 0)], closed=True)
        self._symbol(triangle, self._at(place), 0.0, facecolor="#EEEEEE", edgecolor=INK, lw=1.2)
        vertices: list[tuple[float, float]] = [(-12, foot), (12, foot)]
        for k in range(5):
            x = -10 + 5.5 * k
            vertices += [(x, foot), (x - 4, foot - 4)]
        codes = [Path.MOVETO, Path.LINETO] * 6
        self._symbol(Path(vertices, codes), self._at(place), 0.0, facecolor="none", edgecolor=INK, lw=1.1)

    def rail(self, start: complex, end: complex) -> None:
        """A guide fixed to the ground: the slide's line, and a hatched rail under it."""
        self._line((start, end), 0.0, 0.8, _STEEL, linestyle=(0, (9, 3, 2, 3)))
        along = (end - start) / abs(end - start)
        down = rail_side(along)
        figure = self.axes.get_figure(root=True)
        assert figure is not None
        shift = down * (SLIDER_SIZE[1] / 2 + 1.2) * self.size / 72
        offset = self.axes.transData + ScaledTranslation(shift.real, shift.imag, figure.dpi_scale_trans)
        # Ticks stand to the left of the path's direction: run so that this is away from the slider.
        first, last = (start, end) if (1j * along * down.conjugate()).real > 0 else (end, start)
        line = self._line((first, last), 0.0, 1.2, INK, transform=offset)
        line.set_path_effects([TickedStroke(angle=135, spacing=5.5, length=0.9), Normal()])

    def block(self, place: complex, direction: complex, color: str) -> None:
        """A slider on its guide."""
        half, high = SLIDER_SIZE[0] / 2, SLIDER_SIZE[1] / 2
        corners = [(-half, -high), (half, -high), (half, high), (-half, high), (-half, -high)]
        where = self._at(place, math.atan2(direction.imag, direction.real))
        self._symbol(Path(corners, closed=True), where, 0.2, facecolor=lighter(color), edgecolor=color, lw=1.4)

    def turn(self, place: complex, start: float, sweep: float, radius: float, color: str) -> None:
        """An angle drive: a curved arrow from the angle `start` (radians), with the line it is measured from."""
        angles = start + np.linspace(0.0, sweep, 48)
        # The head is as long on the arc as it looks; a small angle has a small head.
        head = min(7.0, 0.7 * abs(sweep) * radius)
        stem = radius * np.exp(1j * angles[np.abs(angles - start) <= abs(sweep) - 0.6 * head / radius])
        sign = math.copysign(1.0, sweep)
        tip = radius * np.exp(1j * angles[-1])
        tangent = 1j * sign * np.exp(1j * (angles[-1] - sign * head / (2 * radius)))
        self._arrow(stem, complex(tip), complex(tangent), head, self._at(place), color)
        base = (radius + 9) * np.exp(1j * start)
        self._symbol(
            Path([(0, 0), (base.real, base.imag)]), self._at(place), 0.3, facecolor="none", edgecolor=color, lw=0.9,
            linestyle=(0, (3, 2)),
        )  # fmt: skip

    def push(self, place: complex, direction: complex, length: float, away: float, color: str) -> None:
        """A length or slide drive: a straight arrow (points) beside a line through the place."""
        where = self._at(place, math.atan2(direction.imag, direction.real))
        stem = np.array([-length / 2, length / 2 - 4]) + 1j * away
        self._arrow(stem, complex(length / 2, away), 1.0, 7.0, where, color)

    def _arrow(self, stem: np.ndarray, tip: complex, along: complex, head: float, where: Transform, color: str) -> None:
        if len(stem) > 1:
            vertices = np.column_stack([stem.real, stem.imag])
            self._symbol(Path(vertices), where, 0.6, facecolor="none", edgecolor=color, lw=1.7, capstyle="butt")
        back = tip - head * along
        wings = [tip, back + 0.45j * head * along, back - 0.45j * head * along, tip]
        triangle = Path([(wing.real, wing.imag) for wing in wings], closed=True)
        self._symbol(triangle, where, 0.6, facecolor=color, edgecolor="none")
