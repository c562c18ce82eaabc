"""A mechanism drawn into axes, with symbols in points on paper."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.patheffects import Normal, TickedStroke
from matplotlib.transforms import Affine2D, Affine2DBase, ScaledTranslation, Transform

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import callouts, shapes, style
from mechdesign.report.figures.labels import Label, covered, place_labels, rows
from mechdesign.report.figures.marks import LateMark
from mechdesign.report.figures.scene import Still
from mechdesign.report.figures.shapes import Line, Shape, Strut, Symbol

_WIDE, _SMALL = 0.6, 0.7  # part of the page below which a panel has smaller symbols, and their size


@dataclass(frozen=True, eq=False)
class Posed(LateMark):
    """A mechanism in a pose; one that cannot be assembled draws nothing.

    Sizes of symbols are in points on paper; names keep off what is drawn before.

    Parameters
    ----------
    faint : bool
        Pale and below what is drawn otherwise, without names and drives: for further poses.
    ghost : bool
        As thin grey lines below the paths.
    names, drives : bool
        Whether they are drawn.
    more : sequence of Label
        What else is written, where the mechanism's own names leave room.
    """

    scene: Still | None
    faint: bool = False
    ghost: bool = False
    names: bool = True
    drives: bool = True
    more: Sequence[Label] = ()

    def draw(self, axes: Axes) -> None:
        scene = self.scene
        if scene is None:
            return
        if self.ghost:
            draw(axes, shapes.ghost_shapes(scene, self.look.get("linestyle", "-")), order=2.0,
                 alpha=self.look.get("alpha", 0.4))  # fmt: skip
            return
        drawn = shapes.mechanism_shapes(scene)
        if self.faint:
            draw(axes, drawn, order=2.0, alpha=0.22)
            return
        arrows, named = callouts.drive_shapes(scene) if self.drives else ([], [])
        draw(axes, [*drawn, *arrows])
        if self.names:
            # The most important first.
            named = [*callouts.point_labels(scene), *named, *callouts.slide_labels(scene)]
            write(axes, [*named, *callouts.spring_labels(scene), *self.more, *callouts.link_labels(scene)])


def write(axes: Axes, labels: Sequence[Label]) -> None:
    """Write labels where they cover least of what is drawn."""
    place_labels(axes, labels, covered(axes), order=6.0)


def _size(axes: Axes) -> float:
    """Size of symbols, smaller in a narrow panel."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return 1.0 if axes.bbox.width > _WIDE * style.width() * figure.dpi else _SMALL


def draw(axes: Axes, drawn: Iterable[Shape], *, order: float = 3.0, alpha: float = 1.0) -> None:
    """Draw shapes; `order` lifts them above drawings of lower order."""
    size = _size(axes)
    for shape in drawn:
        if isinstance(shape, Symbol):
            axes.add_artist(
                PathPatch(_path(shape), transform=_at(axes, shape, size), facecolor=shape.fill or "none",
                          edgecolor=shape.edge or "none", lw=shape.width, linestyle=shape.dashes, alpha=alpha,
                          zorder=order + shape.layer, clip_on=True)
            )  # fmt: skip
        elif isinstance(shape, Strut):
            axes.add_artist(
                PathPatch(_lines(shape.outlines), transform=_Between(axes, shape.places, size), lw=shape.width * size,
                          facecolor=shape.fill or "none", edgecolor=shape.color, capstyle=shape.cap, joinstyle="round",
                          alpha=alpha, zorder=order + shape.layer, clip_on=True)
            )  # fmt: skip
        elif shape.filled:
            axes.add_patch(
                Polygon(rows(np.array(shape.places)), closed=True, facecolor=shape.color, edgecolor=shape.color,
                        lw=shape.width * size, joinstyle="round", alpha=alpha, zorder=order + shape.layer)
            )  # fmt: skip
        else:
            axes.add_line(_line(axes, shape, order, alpha, size))


def _line(axes: Axes, line: Line, order: float, alpha: float, size: float) -> Line2D:
    artist = Line2D(
        *rows(np.array(line.places)).T, lw=line.width * size, color=line.color, alpha=alpha, zorder=order + line.layer,
        linestyle=line.dashes, solid_capstyle=line.cap, solid_joinstyle="round",
    )  # fmt: skip
    if line.rail:
        figure = axes.get_figure(root=True)
        assert figure is not None
        shift = line.rail * size / 72
        artist.set_transform(axes.transData + ScaledTranslation(shift.real, shift.imag, figure.dpi_scale_trans))
        spacing = shapes.TICK_SPACING
        ends = axes.transData.transform(rows(np.array(line.places)))
        # A rail without room for a tick has none.
        if 72 / figure.dpi * np.hypot(*np.ptp(ends, axis=0)) > 2 * spacing:
            ticks = TickedStroke(angle=shapes.TICK_ANGLE, spacing=spacing, length=shapes.TICK / spacing)
            artist.set_path_effects([ticks, Normal()])
    return artist


def _path(symbol: Symbol) -> Path:
    if symbol.radius:
        return Path.circle(radius=symbol.radius)
    return _lines(symbol.outlines, closed=symbol.fill is not None)


def _lines(outlines: Iterable[Sequence[complex]], *, closed: bool = False) -> Path:
    """Lines as one path."""
    lines = (rows(np.array([*line, *line[:closed]])) for line in outlines)
    return Path.make_compound_path(*(Path(line, closed=closed) for line in lines))


class _Between(Affine2DBase):
    """From shares of the way between two places of the drawing, and points on paper across, to pixels."""

    def __init__(self, axes: Axes, places: tuple[complex, complex], size: float) -> None:
        super().__init__()
        self.axes, self.places, self.size = axes, places, size
        self.set_children(axes.transData)

    def get_matrix(self) -> Floats:
        """The matrix for the limits of the axes now."""
        begin, end = self.axes.transData.transform(rows(np.array(self.places)))
        way = end - begin
        figure = self.axes.get_figure(root=True)
        assert figure is not None
        left = np.array([-way[1], way[0]]) / (np.hypot(*way) or 1.0) * self.size * figure.dpi / 72
        return np.array([[way[0], left[0], begin[0]], [way[1], left[1], begin[1]], [0.0, 0.0, 1.0]])


def _at(axes: Axes, symbol: Symbol, size: float) -> Transform:
    """Transform from points on paper to the place and direction of a symbol."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    # The stubs ask for an affine transform; any that maps the place to pixels will do.
    moved = ScaledTranslation(symbol.place.real, symbol.place.imag, axes.transData)  # type: ignore[arg-type]
    turned = Affine2D().rotate(cmath.phase(symbol.direction)).scale(size / 72)
    return turned + figure.dpi_scale_trans + moved
