"""Where the axes of a picture are, so that a page can move a cursor through them."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.drawing.layout import OVER, PLANE

POINTS = 72.0  # an inch


def axes_of(figure: Figure) -> list[list[Any]]:
    """Axes over a sweep or a path, and those of places.

    A list each: the label of what it is over, or `PLANE`; the left, right, upper and lower edge in points from the
    upper left corner of the picture; the values at the left and right edge, and of places those at the lower and upper
    edge too.
    """
    entries = []
    for axes in figure.axes:
        label = str(axes.get_label())
        if label == PLANE:
            entries.append([PLANE, *box(axes), *_rounded(axes.get_xlim()), *_rounded(axes.get_ylim())])
        elif label.startswith(OVER) and axes.get_xscale() == "linear":
            entries.append([label.removeprefix(OVER), *box(axes), *_rounded(axes.get_xlim())])
    return entries


def box(axes: Axes) -> list[float]:
    """The left, right, upper and lower edge in points from the upper left corner of the picture."""
    wide, tall = (POINTS * inches for inches in axes.get_figure(root=True).get_size_inches())  # type: ignore[union-attr]
    place = axes.get_position()
    return [round(wide * place.x0, 1), round(wide * place.x1, 1),
            round(tall * (1 - place.y1), 1), round(tall * (1 - place.y0), 1)]  # fmt: skip


def _rounded(limits: tuple[float, float]) -> list[float]:
    return [float(f"{limit:.6g}") for limit in limits]
