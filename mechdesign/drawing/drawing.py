"""A mechanism drawn into axes, with symbols in points on paper."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from mechdesign.drawing import callouts, shapes, style
from mechdesign.drawing.labels import Label, covered, paper, place_labels, rows
from mechdesign.drawing.marks import LateMark
from mechdesign.drawing.scene import Still
from mechdesign.drawing.shapes import Line, Shape, Symbol

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
    size, figure = _size(axes), axes.get_figure(root=True)
    assert figure is not None
    points = Affine2D().scale(1 / 72) + figure.dpi_scale_trans

    def at(place: complex) -> complex:
        return complex(*paper(axes, np.array([place]))[0])

    for shape in drawn:
        look: dict[str, Any] = {"alpha": alpha, "zorder": order + shape.layer, "clip_on": True}
        if isinstance(shape, Symbol):
            look |= {"linewidth": shape.width, "edgecolor": shape.edge or "none", "linestyle": shape.dashes}
        else:
            look |= {"linewidth": shape.width * size, "edgecolor": shape.color, "joinstyle": "round"}
        if isinstance(shape, Line) and not shape.rail:
            # In places of the drawing, as curves are.
            outline, closed = rows(np.array(shape.places)), shape.filled
            look |= {"facecolor": shape.color if closed else "none", "linestyle": shape.dashes, "capstyle": shape.cap}
            axes.add_patch(Polygon(outline, closed=closed, **look))
            continue
        if not isinstance(shape, Symbol):
            look["capstyle"] = shape.cap
        fill = None if isinstance(shape, Line) else shape.fill
        closed = fill is not None
        lines = (rows(np.array([*line, *line[:closed]])) for line in shape.on_paper(at, size))
        path = Path.make_compound_path(*(Path(line, closed=closed) for line in lines))
        if isinstance(shape, Symbol) and shape.radius:
            place = at(shape.place)
            path = Path.circle((place.real, place.imag), size * shape.radius)
        axes.add_artist(PathPatch(path, transform=points, facecolor=fill or "none", **look))
