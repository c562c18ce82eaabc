"""A mechanism before a change in grey dashes under the one after it, and a legend that names both."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.errors import printable
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.drawing import draw_ghost
from mechdesign.report.figures.framing import LEFT
from mechdesign.report.figures.layout import fitting
from mechdesign.report.figures.marks import Trace
from mechdesign.report.figures.scene import Sweep, ranks

COLOR = "#666666"
DASHES = (0, (4, 2))
_ORDER = 2.45  # below the paths of the study now
_LEGEND_ROW = 0.2  # inches


def draw_line(axes: Axes, places: Complexes, width: float) -> None:
    """A curve of the study before."""
    axes.plot(places.real, places.imag, color=COLOR, linestyle=DASHES, linewidth=width, zorder=_ORDER)


def draw_pose(axes: Axes, mechanism: Mechanism, configuration: Configuration, index: int = 0) -> None:
    """The mechanism before, in a pose."""
    draw_ghost(axes, mechanism, configuration, index, dashes=DASHES, alpha=0.9)


def draw_sweep(axes: Axes, sweep: Sweep) -> None:
    """The mechanism before in its first pose, and the paths of its points."""
    ranked = ranks(sweep.study)
    for point, path in sweep.traces.items():
        draw_line(axes, path, 1.5 if ranked[point] == 2 else 0.8)
    if len(sweep.valid):
        draw_pose(axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]))


def both_named(before: Before | None) -> list[Trace]:
    """What a legend shows of the study now and of that before; nothing without one."""
    if before is None:
        return []
    # As they are: a dollar would begin a formula.
    names = [printable(name).replace("$", r"\$") for name in before.names]
    looks: tuple[dict[str, Any], ...] = ({"color": style.INK}, {"color": COLOR, "linestyle": DASHES})
    return [Trace([], [], label=f"{name} ({when})", look=look)
            for name, when, look in zip(names, ("now", "before"), looks, strict=True)]  # fmt: skip


def name_both(figure: Figure, before: Before | None) -> None:
    """A legend above all panels, for which the page is made higher; none without a study before."""
    if before is None:
        return
    handles = [Line2D([], [], label=mark.label, **mark.look) for mark in both_named(before)]
    columns = fitting([mark.label for mark in both_named(before)])
    style.grow(figure, above=0.1 + _LEGEND_ROW * (2 // columns))
    place = (LEFT / style.width() - 0.02, 1.0)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=place, ncols=columns, borderaxespad=0.2)
