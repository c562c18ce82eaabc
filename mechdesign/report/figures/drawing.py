"""A mechanism drawn into axes, with symbols in points on paper."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.patheffects import Normal, TickedStroke
from matplotlib.transforms import Affine2D, Affine2DBase, ScaledTranslation, Transform

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import shapes
from mechdesign.report.figures.labels import Label, covered, place_labels, rows
from mechdesign.report.figures.scene import pose
from mechdesign.report.figures.shapes import Dashes, Line, Shape, Strut, Symbol, Travel


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
    more: Sequence[Label] = (),
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
    more : sequence of Label
        What else is written, where the mechanism's own names leave room.
    """
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = shapes.link_colors(mechanism)
    drawn = shapes.mechanism_shapes(scene, colors, travel or {})
    if faint:
        draw(axes, drawn, order=2.0, alpha=0.22, size=size)
        return
    arrows, named = shapes.drive_shapes(scene) if drives else ([], [])
    draw(axes, [*drawn, *arrows], size=size)
    if labels:
        # The most important first.
        named = [*shapes.point_labels(scene), *named, *shapes.slide_labels(scene), *shapes.spring_labels(scene)]
        named += [*more, *shapes.link_labels(scene, colors)]
        place_labels(axes, named, covered(axes), order=5.0)


def draw_ghost(
    axes: Axes, mechanism: Mechanism, configuration: Configuration, index: int, *, dashes: Dashes = "-",
    alpha: float = 0.4,
) -> None:  # fmt: skip
    """Draw another pose as thin grey lines below the paths."""
    scene = pose(mechanism, configuration, index)
    if scene is not None:
        draw(axes, shapes.ghost_shapes(scene, dashes), order=2.0, alpha=alpha)


def draw(axes: Axes, drawn: Iterable[Shape], *, order: float = 3.0, alpha: float = 1.0, size: float = 1.0) -> None:
    """Draw shapes; `order` lifts them above drawings of lower order, `size` enlarges symbols and widths of lines."""
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
