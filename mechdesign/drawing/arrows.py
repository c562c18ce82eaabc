"""Vectors drawn into a panel to one scale, of which a legend shows one of a round size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.path import Path
from matplotlib.text import Text

from mechdesign.drawing import style
from mechdesign.drawing.marks import LateMark
from mechdesign.drawing.panels import quantity, round_down
from mechdesign.ground.numerics.arrays import Complexes

_HEAD, _HEAD_SHARE = 8.5, 0.6  # points, a head's length, and of its arrow at most
_ORDER = 4.8  # above links and pins, below names
_FILLED_HEAD = Path([(-1, 0.36), (0, 0), (-1, -0.36), (-1, 0.36)], closed=True)
_OPEN_HEAD = Path([(-1, 0.42), (0, 0), (-1, -0.42)])
# By the order of rates.
RATES: tuple[dict[str, Any], ...] = (
    {"color": style.INK, "linestyle": "-", "linewidth": 1.7},
    {"color": style.VERMILION, "linestyle": (0, (3, 1.4)), "linewidth": 1.5},
)


@dataclass(frozen=True, eq=False)
class Arrows(LateMark):
    """Vectors from places, in lengths of the drawing; dashed ones have an open head.

    Parameters
    ----------
    size : float
        What a vector of a drawn length of one stands for, or of an inch of the layout where that is `on_paper`; 0 where
        the legend does not say.
    unit : str
        Of the size.
    """

    places: Complexes
    vectors: Complexes
    size: float = 0.0
    unit: str = ""
    on_paper: bool = False

    @property
    def symbol(self) -> float:
        return 5.0 if self.size else 0.0

    def draw(self, axes: Axes) -> None:
        points = 72 * axes.bbox.width / style.dots() / float(np.ptp(axes.get_xlim()))
        for place, vector in zip(self.places.tolist(), self.vectors.tolist(), strict=True):
            tip, head = place + vector, self._head(float(np.angle(vector)), points * abs(vector))
            axes.add_line(Line2D([place.real, tip.real], [place.imag, tip.imag], zorder=_ORDER, label=self.label,
                                 **self.look, **head))  # fmt: skip

    def _head(self, angle: float, points: float) -> dict[str, Any]:
        """The head at the end of an arrow of a direction and a length on paper."""
        filled, color = self.look["linestyle"] == "-", self.look["color"]
        head = MarkerStyle(_FILLED_HEAD if filled else _OPEN_HEAD, "full" if filled else "none")
        size = 2 * min(_HEAD, _HEAD_SHARE * points)
        return {"marker": head.rotated(rad=angle), "markevery": [1], "markersize": size, "markeredgecolor": color,
                "markerfacecolor": color if filled else "none", "markeredgewidth": 0.2 if filled else 1.5,
                "solid_capstyle": "butt", "dash_capstyle": "butt"}  # fmt: skip

    def size_symbol(self, handle: Artist, words: Text, inches: float) -> None:
        if self.size:
            assert isinstance(handle, Line2D)
            inches = 1.0 if self.on_paper else inches
            room = self.symbol * float(words.get_fontsize())
            value = round_down(room / 72 / inches * self.size)
            length = 72 * inches * value / self.size
            handle.set_data([room - length, room], np.asarray(handle.get_ydata())[:2])
            handle.set(**self._head(0.0, length))
            words.set_text(f"{self.label} {quantity(value, self.unit)}")
