"""What a picture declares: panels with marks, their axes, titles and notes; `layout` draws it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.text import Text
from numpy.typing import ArrayLike

from mechdesign.drawing import style
from mechdesign.drawing.contours import Grid, color_bar, contour_lines, filled
from mechdesign.ground.numerics.arrays import Complexes, Floats

Way = Literal["x", "y"]


@dataclass(frozen=True, eq=False, kw_only=True)
class PanelMark:
    """Something drawn into a panel.

    Parameters
    ----------
    label : str
        Its entry of the legend: marks of one label, also of several panels, are one entry.
    look : mapping
        Colour, dashes, marker, as Matplotlib names them.
    """

    label: str = ""
    look: Mapping[str, Any] = field(default_factory=dict)

    @property
    def late(self) -> bool:
        """Whether it needs the final size of the panel, such as symbols and names of a size on paper."""
        return False

    @property
    def arrows(self) -> bool:
        """Whether it has arrows about what a plane shows, for which there is room."""
        return False

    @property
    def height(self) -> float:
        """Inches that it needs; 0 where the panel has the height of its kind."""
        return 0.0

    @property
    def symbol(self) -> float:
        """Length of its symbol in a legend, in font sizes; 0 for the usual one."""
        return 0.0

    def draw(self, axes: Axes) -> Any:
        """Draw it; returns what a legend shows of it."""
        raise NotImplementedError

    def size_symbol(self, handle: Artist, words: Text, inches: float) -> None:
        """Fit its symbol and words in a legend to the scale of the panel, in which a length of one has some inches."""


class LateMark(PanelMark):
    """A mark that needs the final size of the panel; a legend shows a line in its look."""

    @property
    def late(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class Trace(PanelMark):
    """A curve."""

    x: ArrayLike
    y: ArrayLike

    def draw(self, axes: Axes) -> Any:
        return axes.plot(self.x, self.y, **self.look)[0]


@dataclass(frozen=True, eq=False)
class Dots(Trace):
    """Places, each with a marker; with intervals about them along x or y, shape (2, n), from the place."""

    along_x: Floats | None = field(default=None, kw_only=True)
    along_y: Floats | None = field(default=None, kw_only=True)

    def draw(self, axes: Axes) -> Any:
        look = {"marker": "o", "linestyle": "none"} | dict(self.look)
        if self.along_x is None and self.along_y is None:
            return axes.plot(self.x, self.y, **look)[0]
        return axes.errorbar(self.x, self.y, xerr=self.along_x, yerr=self.along_y, **look)


@dataclass(frozen=True, eq=False)
class Bars(PanelMark):
    """Bars along x, the first on top: the values of `number` (of `count`) at each name; `written` stand at their ends.

    A name is wide as 1, its place is its number.
    """

    values: Floats
    number: int = 0
    count: int = 1
    written: Sequence[str] = ()

    def draw(self, axes: Axes) -> Any:
        look = {"color": style.PALETTE[self.number % len(style.PALETTE)]} | dict(self.look)
        if hatch := look.pop("hatch", style.HATCHES[self.number % len(style.HATCHES)]):
            look |= {"hatch": hatch, "edgecolor": "white", "linewidth": 0}
        tall = 0.8 / self.count
        places = np.arange(len(self.values)) + (self.number + 0.5) * tall - 0.4
        drawn = axes.barh(places, self.values, 0.94 * tall if self.count > 1 else tall, **look)
        if self.written:
            for words in axes.bar_label(drawn, self.written, padding=2, fontsize=style.small()):
                words.set_in_layout(False)
        return drawn


@dataclass(frozen=True, eq=False)
class Area(PanelMark):
    """What lies between two curves."""

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike

    def draw(self, axes: Axes) -> Any:
        return axes.fill_between(self.x, self.low, self.high, **{"linewidth": 0} | dict(self.look))


@dataclass(frozen=True, eq=False)
class Steps(PanelMark):
    """Filled counts between edges."""

    counts: Floats
    edges: Floats

    def draw(self, axes: Axes) -> Any:
        return axes.stairs(self.counts, self.edges, fill=True, **self.look)


@dataclass(frozen=True, eq=False)
class Lines(PanelMark):
    """Straight lines across a panel at values of x or of y."""

    values: Sequence[float] | Floats
    at: Way = "y"

    def draw(self, axes: Axes) -> Any:
        line = axes.axvline if self.at == "x" else axes.axhline
        drawn = [line(float(value), **self.look) for value in self.values]
        return drawn[-1] if drawn else None


@dataclass(frozen=True, eq=False)
class Zone(PanelMark):
    """What lies between two values of x or of y, across a panel."""

    low: float
    high: float
    at: Way = "y"

    def draw(self, axes: Axes) -> Any:
        span = axes.axvspan if self.at == "x" else axes.axhspan
        return span(self.low, self.high, **{"linewidth": 0} | dict(self.look))


@dataclass(frozen=True, eq=False)
class Words(PanelMark):
    """Text at a place, `shift` points beside it; `inside` counts x, y or both in parts of the panel."""

    x: float
    y: float
    text: str
    shift: tuple[float, float] = (0.0, 0.0)
    inside: Literal["", "x", "y", "xy"] = ""

    def draw(self, axes: Axes) -> None:
        places: dict[str, Any] = {"": "data", "xy": axes.transAxes, "x": axes.get_yaxis_transform(),
                                  "y": axes.get_xaxis_transform()}  # fmt: skip
        words = axes.annotate(self.text, (self.x, self.y), self.shift, places[self.inside], "offset points",
                              **{"fontsize": style.small()} | dict(self.look))  # fmt: skip
        words.set_in_layout(False)


@dataclass(frozen=True, eq=False)
class Contours(PanelMark):
    """Values over patches of a plane in steps of colour, with a bar of them named by the label; None has no value.

    Parameters
    ----------
    words : sequence of str
        What stands at the levels of the bar, in place of their numbers.
    everywhere : bool
        The same value everywhere, without a bar.
    """

    patches: Sequence[Grid]
    norm: BoundaryNorm | None
    outline: Sequence[Complexes] = ()
    words: Sequence[str] = ()
    everywhere: bool = False

    def draw(self, axes: Axes) -> None:
        axes.grid(visible=False)
        if self.norm is None or self.outline:
            axes.set_facecolor("#EEEEEE")
        if self.norm is None:
            return
        levels = np.asarray(self.norm.boundaries)
        filled(axes, self.patches, self.norm, contour_lines(self.patches, levels))
        for curve in self.outline:
            axes.plot(curve.real, curve.imag, color=style.INK, linewidth=1.2)
        if not self.everywhere:
            bar = color_bar(axes, ScalarMappable(self.norm, style.COLORMAP), ticks=levels)
            if self.words:
                bar.ax.set_yticks(levels, self.words)


@dataclass(frozen=True, eq=False)
class Own(PanelMark):
    """What a function draws into the axes; it returns what a legend shows."""

    function: Callable[[Axes], Any]

    def draw(self, axes: Axes) -> Any:
        return self.function(axes)


@dataclass(frozen=True, eq=False)
class Late(LateMark):
    """What a function draws into the axes at last."""

    function: Callable[[Axes], Any]

    def draw(self, axes: Axes) -> Any:
        return self.function(axes)


@dataclass(frozen=True, eq=False)
class Coloured(Own):
    """A map that a function draws: it returns what a bar of colours shows, which `bar` names, and options of that.

    Panels side by side whose bars have one name have one bar.
    """

    bar: str = ""

    def draw(self, axes: Axes) -> None:
        drawn, options = self.function(axes)
        color_bar(axes, drawn, self.bar, **options)


@dataclass(frozen=True)
class Axis:
    """An axis of a panel.

    Parameters
    ----------
    ends : tuple of float or None
        Where it begins and ends; None follows the data.
    ticks : sequence of float
        Where its ticks stand, if that is given; with `words` these in place of numbers, else at 0, 1, 2.
    over : bool
        Whether a sweep or path runs along it: a report moves a cursor through it.
    margin : float, optional
        Part of the range beyond the data.
    numbers : bool
        Whether it has numbers.
    """

    name: str = ""
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    ends: tuple[float | None, float | None] = (None, None)
    ticks: Sequence[float] = ()
    words: Sequence[str] = ()
    over: bool = False
    margin: float | None = None
    numbers: bool = True

    @property
    def label(self) -> str:
        """Name and unit."""
        return style.axis_label(self.name, self.unit)


@dataclass(frozen=True)
class Panel:
    """Marks over two axes.

    Parameters
    ----------
    aside : str
        Words at the right of the title.
    equal : float
        How many times longer lengths are drawn along y than along x; 0 where the axes have scales of their own.
    shows : ndarray of complex, optional
        Places of a plane in which a mechanism is drawn: the axes show all of them, and room for its symbols and names.
    plane : bool
        Whether a page marks points in it as the mechanism moves.
    bare : bool
        Whether it is drawn without its axes.
    legend : str
        Where its marks are named: in the legend of the picture, in one beside it (on a narrow page above), or inside.
    size : float
        Height over that of others.
    """

    marks: Sequence[PanelMark]
    x: Axis = Axis()
    y: Axis = Axis()
    title: str = ""
    aside: str = ""
    equal: float = 0.0
    shows: Complexes | None = None
    plane: bool = False
    bare: bool = False
    legend: Literal["", "beside", "best", "upper right", "lower right"] = ""
    heading: str = ""  # of a legend of its own
    size: float = 1.0

    @property
    def bars(self) -> list[Bars]:
        """Its bars."""
        return [mark for mark in self.marks if isinstance(mark, Bars)]

    @property
    def kind(self) -> Literal["bars", "map", "plane", "equal", ""]:
        """By which panels have room side by side."""
        if self.shows is not None:
            return "plane"
        if any(isinstance(mark, Contours | Coloured) for mark in self.marks):
            return "map"
        return "bars" if self.bars else "equal" if self.equal else ""


@dataclass(frozen=True)
class Picture:
    """Panels under a title, with one legend below them.

    Parameters
    ----------
    across : int
        Most panels side by side.
    share : str
        Axes that all panels share, ``x``, ``y`` or both; in a ``grid`` columns share x, and rows y.
    """

    title: str
    panels: Sequence[Panel | None]
    notes: Sequence[str] = ()
    across: int = 1
    share: Literal["", "x", "y", "xy", "grid"] = ""

    def marks(self) -> Iterator[PanelMark]:
        """Those of all panels."""
        for panel in self.panels:
            yield from panel.marks if panel is not None else ()
