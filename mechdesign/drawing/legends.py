"""Legends: one below all panels of a picture, or beside, above and inside of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from mechdesign.drawing import style
from mechdesign.drawing.marks import Panel

_KEY = 18  # letters of a size and its arrow in a legend
_LEGEND_LETTERS, _LEGEND_SYMBOL = 14.75, 0.6  # an inch; inches
_BESIDE_LETTERS, _BESIDE_ROOM = 26, 2.0  # of a name in a legend beside a panel; inches
_LEGEND_DOT, _LEGEND_MARK = 8.0, 6.0  # points
_BESIDE_LEGEND: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
_ABOVE_LEGEND: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (-0.02, 1.0), "borderaxespad": 0.1}
_INSIDE_LEGEND: dict[str, Any] = {"frameon": True, "framealpha": 0.85, "edgecolor": "none"}


def page_legend(figure: Figure, entries: Mapping[str, Any], symbol: float) -> Legend:
    """One at the bottom of a page, in as many columns as the width holds; its symbols are so many letters long."""
    labels = [style.folded(label, 9.0, style.width() - _LEGEND_SYMBOL) for label in entries]
    return _enlarge_dots(figure.legend([*entries.values()], labels, loc="lower center",
                                       ncols=fitting(labels, more=_KEY if symbol else 0),
                                       borderaxespad=0.2, handlelength=symbol or None))  # fmt: skip


def fitting(labels: Sequence[str], width: float | None = None, more: int = 0) -> int:
    """Columns of a legend that a width (inches) holds, that of the page if none is given; `more` letters to each."""
    letters = int(_LEGEND_LETTERS * (width or style.width()))
    return max(1, min(len(labels), letters // (8 + more + max(map(style.letters, "\n".join(labels).split("\n"))))))


def panel_legend(axes: Axes, panel: Panel, entries: Mapping[str, Any], width: float) -> None:
    """One of a panel, beside it or inside; on a narrow page above it, in as many columns as a width holds."""
    names = legend_names([*entries])
    # The name of an upright axis may take a second line, which makes the panel narrower.
    outside = _ABOVE_LEGEND | {"ncols": fitting(names, width, more=1)} if style.narrow() else _BESIDE_LEGEND
    place = outside if panel.legend == "beside" else _INSIDE_LEGEND | {"loc": panel.legend}
    heading: dict[str, Any] = {"title": panel.heading or None, "title_fontsize": 9, "alignment": "left"}
    _enlarge_dots(axes.legend(entries.values(), names, **place, **heading))


def legend_names(labels: Sequence[str]) -> list[str]:
    """Entries of a legend beside a panel in few letters, where these tell them apart."""
    short = [style.folded(style.shortened(label, _BESIDE_LETTERS), 9.0, _BESIDE_ROOM) for label in labels]
    return short if len({*short}) == len({*labels}) else [style.folded(label, 9.0, _BESIDE_ROOM) for label in labels]


def _enlarge_dots(legend: Legend) -> Legend:
    """Dots of a legend as large as can be seen: one alone is lost where thousands are drawn."""
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and handle.get_linestyle() == "None" and handle.get_markersize() < _LEGEND_DOT:
            handle.set(markersize=_LEGEND_DOT if handle.get_marker() == "." else _LEGEND_MARK, alpha=1.0)
    return legend
