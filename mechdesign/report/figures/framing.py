"""The window of a drawing: where things are in it, and how large it is on paper, with one scale for x and y."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.layout import fitting

PAD = 0.5  # inches around what is drawn, for symbols and names
MIN_HEIGHT = 1.5  # inches, of a window
MAX_HEIGHT = 5.3  # inches
MAX_TILE_HEIGHT = 4.0  # inches, of one of several windows
TITLE = 0.36  # inches above a window for a line of words
# Inches beside a window; left and below for axis labels.
LEFT = 0.78
BELOW = 0.55
ABOVE = 0.12
RIGHT = 0.15
_LEGEND_ROW = 0.19


class Window(NamedTuple):
    """Part of the plane about `middle`; a length is drawn `scale` times as many inches long."""

    middle: complex
    scale: float
    width: float
    height: float


def extent(places: Complexes | Iterable[complex]) -> tuple[complex, float, float]:
    """Middle, width and height of what lies at these places; nan are no places."""
    finite = np.asarray(places if isinstance(places, np.ndarray) else list(places), dtype=complex).reshape(-1)
    finite = finite[np.isfinite(finite)]
    x, y = finite.real, finite.imag
    middle = complex((x.min() + x.max()) / 2, (y.min() + y.max()) / 2)
    return middle, max(float(np.ptp(x)), 1e-9), max(float(np.ptp(y)), 1e-9)


def fit(places: Complexes | Iterable[complex], width: float, height: float, pad: float = PAD) -> Window:
    """A window `width` inches wide and at most `height` inches high that shows all of the places."""
    middle, wide, tall = extent(places)
    scale = min((width - 2 * pad) / wide, (height - 2 * pad) / tall)
    return Window(middle, scale, width, max(scale * tall + 2 * pad, min(MIN_HEIGHT, height)))


def windows(
    window: Window,
    unit: str,
    count: int = 1,
    columns: int = 1,
    *,
    gap: float = LEFT,
    above: float = ABOVE,
    top: float = 0.0,
    below: float = BELOW,
    stretch: float = 1.0,
) -> tuple[Figure, list[Axes]]:
    """A figure of `count` windows in rows; inches between columns, above each window, above all and below all of them.

    Where the gap between columns has room for it each has an axis label of its own, or else the first one. Lengths
    along y are drawn `stretch` times as large as those along x, which the window's scale is of.
    """
    rest = style.width() - LEFT - columns * window.width - (columns - 1) * gap
    figure, panels = style.page(
        count, columns, window.height, left=LEFT, right=rest, top=top + above, bottom=below, across=gap, down=above
    )
    half_width, half_height = window.width / 2 / window.scale, window.height / 2 / window.scale / stretch
    for k, axes in enumerate(panels):
        axes.set_xlim(window.middle.real - half_width, window.middle.real + half_width)
        axes.set_ylim(window.middle.imag - half_height, window.middle.imag + half_height)
        axes.set_aspect(stretch)
        lowest, first = k + columns >= count, k % columns == 0 or gap >= LEFT
        axes.tick_params(labelleft=first, labelbottom=lowest)
        axes.set_xlabel(style.axis_label("x", unit) if lowest else "")
        axes.set_ylabel(style.axis_label("y", unit) if first else "")
    return figure, panels


def framed(
    places: Complexes | Iterable[complex], unit: str, *, height: float, above: float = ABOVE, pad: float = PAD
) -> tuple[Figure, Axes]:
    """A figure with one window as wide as the page; `above` it, inches are left for a title."""
    figure, (axes,) = windows(fit(places, style.width() - LEFT - RIGHT, height, pad), unit, above=above)
    return figure, axes


def column_width(columns: int, gap: float) -> float:
    """Width of each of some windows side by side, by the gap between them; inches."""
    return (style.width() - LEFT - RIGHT - gap * (columns - 1)) / columns


def tiled(
    places: Complexes, count: int, most: int, *, gap: float, pads: tuple[float, float], page: float, least: float
) -> tuple[int, Window]:
    """In how many columns (at most `most`) windows of one scale become largest, and the window of each.

    In inches: the gap between columns, what is left free around the places in one column and in several, the height of
    all rows together, about, and the least height of a window.
    """

    def window(columns: int) -> Window:
        height = min(max(page / -(-count // columns), least), MAX_TILE_HEIGHT)
        return fit(places, column_width(columns, gap), height, pads[columns > 1])

    fitted = {columns: window(columns) for columns in range(1, min(count, most) + 1)}
    return max(fitted.items(), key=lambda item: item[1].scale)


def legend_at_left(figure: Figure, handles: Sequence[Line2D], columns: int) -> None:
    """One legend at the bottom from the left edge of drawings on; a narrow page is made higher for its rows."""
    labels = [str(handle.get_label()) for handle in handles]
    if style.narrow():
        columns = fitting(labels, style.width() - LEFT)
    style.grow(figure, below=_LEGEND_ROW * (-(-len(labels) // columns) - 1))
    place = (LEFT / style.width() - 0.02, 0.0)
    figure.legend(handles, labels, loc="lower left", ncols=columns, bbox_to_anchor=place)
