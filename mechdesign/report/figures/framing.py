"""The window of a drawing: where things are in it, and how large it is on paper, with one scale for x and y."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style

PAD = 0.5  # inches around what is drawn, for symbols and names
LEAST = 1.5  # inches, height of a window
HIGHEST = 6.2  # inches, of a whole picture
# Inches left of a window and below it, for axis labels, and above and right of it.
LEFT, BELOW, ABOVE, RIGHT = 0.78, 0.55, 0.12, 0.15


@dataclass(frozen=True)
class Window:
    """Part of the plane about `middle`; a length is drawn `scale` times as many inches long."""

    middle: complex
    scale: float
    width: float
    height: float

    def limit(self, axes: Axes) -> None:
        """Give axes of this size on paper the window's limits."""
        half_width, half_height = self.width / 2 / self.scale, self.height / 2 / self.scale
        axes.set_xlim(self.middle.real - half_width, self.middle.real + half_width)
        axes.set_ylim(self.middle.imag - half_height, self.middle.imag + half_height)
        axes.set_aspect("equal")


def extent(places: Complexes | Iterable[complex]) -> tuple[complex, float, float]:
    """Middle, width and height of what lies at these places; nan are no places."""
    found = np.asarray(places if isinstance(places, np.ndarray) else list(places), dtype=complex).reshape(-1)
    found = found[np.isfinite(found)]
    x, y = found.real, found.imag
    middle = complex((x.min() + x.max()) / 2, (y.min() + y.max()) / 2)
    return middle, max(float(np.ptp(x)), 1e-9), max(float(np.ptp(y)), 1e-9)


def scale_of(wide: float, tall: float, width: float, height: float, pad: float = PAD) -> float:
    """Inches a length, so that what is `wide` by `tall` fits into that many inches."""
    return min((width - 2 * pad) / wide, (height - 2 * pad) / tall)


def fit(
    places: Complexes | Iterable[complex], width: float, height: float, pad: float = PAD
) -> Window:  # fmt: skip
    """A window `width` inches wide and at most `height` inches high that shows all of the places."""
    middle, wide, tall = extent(places)
    scale = scale_of(wide, tall, width, height, pad)
    return Window(middle, scale, width, max(scale * tall + 2 * pad, min(LEAST, height)))


def framed(
    places: Complexes | Iterable[complex], unit: str, *, height: float, above: float = ABOVE
) -> tuple[Figure, Axes]:
    """A figure with one window as wide as the page, its axes labelled; `above` it, inches are left for a title."""
    window = fit(places, style.WIDTH - LEFT - RIGHT, height)
    outer = window.height + BELOW + above
    figure = style.new_figure(style.WIDTH, outer, layout=None)
    axes = figure.add_axes(
        (LEFT / style.WIDTH, BELOW / outer, window.width / style.WIDTH, window.height / outer)
    )  # fmt: skip
    window.limit(axes)
    axes.set_xlabel(style.axis_label("x", unit))
    axes.set_ylabel(style.axis_label("y", unit))
    return figure, axes


def equal_canvas(places: np.ndarray, unit: str) -> tuple[Figure, Axes]:
    """Axes of one scale that hold the places, as large as the page allows."""
    low = complex(places.real.min(), places.imag.min())
    high = complex(places.real.max(), places.imag.max())
    wide, tall = max((high - low).real, 1e-9), max((high - low).imag, 1e-9)
    pad, left, below, above = 0.55, 0.68, 0.5, 0.35
    inches = min((style.WIDTH - left - 0.15 - 2 * pad) / wide, (HIGHEST - below - above - 2 * pad) / tall)
    width, height = style.WIDTH - left - 0.15, max(inches * tall + 2 * pad, 1.5)
    outer = height + below + above
    figure = style.new_figure(style.WIDTH, outer, layout=None)
    axes = figure.add_axes((left / style.WIDTH, below / outer, width / style.WIDTH, height / outer))
    middle = (low + high) / 2
    axes.set_xlim(middle.real - width / 2 / inches, middle.real + width / 2 / inches)
    axes.set_ylim(middle.imag - height / 2 / inches, middle.imag + height / 2 / inches)
    axes.set_aspect("equal")
    axes.set_xlabel(style.axis_label("x", unit))
    axes.set_ylabel(style.axis_label("y", unit))
    return figure, axes
