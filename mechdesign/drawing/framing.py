"""The window of a drawing: where things are in it, and how large it is on paper, with one scale for x and y."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Late, Panel
from mechdesign.ground.numerics.arrays import Complexes

# Inches. The height of a window: at least, alone, beside others, of all of a page together, below others at least.
_LOWEST, _ALONE, _BESIDE, _TOGETHER, _BELOW = 1.5, 5.4, 4.0, 8.0, 1.2
# Inches about what a window shows: for symbols and names, for arrows, without any; of a small window this part at most.
_ROOM, _ROOM_OF_ARROWS, _NO_SYMBOLS = 0.42, 0.75, 0.1
_SHARE = 0.17


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


def fit(
    places: Complexes | Iterable[complex], width: float, height: float, pad: float, stretch: float = 1.0
) -> Window:  # fmt: skip
    """A window `width` inches wide and at most `height` inches high that shows all of the places, with room about them.

    Lengths along y are drawn `stretch` times as large as those along x, which the window's scale is of.
    """
    middle, wide, tall = extent(places)
    tall *= stretch
    scale = min((width - 2 * pad) / wide, (height - 2 * pad) / tall)
    return Window(middle, scale, width, max(scale * tall + 2 * pad, min(_LOWEST, height)))


def highest(columns: int, rows: int) -> float:
    """Inches of one of so many windows at most."""
    if rows < 2:
        return _ALONE if columns == 1 else _BESIDE
    return min(max(_TOGETHER / rows, _BELOW), _BESIDE)


def window_of(panel: Panel, wide: float, tall: float) -> Window:
    """The window of a panel of a width, and of a height at most."""
    assert panel.shows is not None
    symbols = any(mark.late and not isinstance(mark, Late) for mark in panel.marks)
    arrows = any(mark.arrows for mark in panel.marks)
    room = _ROOM_OF_ARROWS if arrows else min(_ROOM if symbols else _NO_SYMBOLS, _SHARE * min(wide, tall))
    return fit(panel.shows, wide, tall, room, panel.equal)


def fitting_windows(most: int) -> int:
    """Windows with arrows below each other that one page has room for, with title, key and legend."""
    return int(min(most, (style.tallest() - 2 * _ROOM_OF_ARROWS) / (2 * _ROOM_OF_ARROWS + 0.5)))
