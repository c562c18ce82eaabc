"""Columns that moved between two results: old and new over the pose, or new against old."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.report.comparison.differences import Difference
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import MAX_PANELS

# Inches.
_HEIGHT = 2.2
_COLUMNS = 2
_MARGINS = {"left": 0.95, "right": 0.25, "top": 0.85, "bottom": 0.6}
_ACROSS = 0.95
_DOWN = 0.95
_TITLE_SIZE = 9.0
_ALIKE = 0.03  # of their range: curves that are nearer to each other cannot be told apart


def differences_figure(moved: Sequence[Difference]) -> Figure:
    """A panel a column, of those that moved most for the size of their old values; use inside `style.context`."""
    shown = moved[:MAX_PANELS]
    columns = 1 if style.narrow() else min(_COLUMNS, len(shown))
    figure, panels = style.page(len(shown), columns, _HEIGHT, across=_ACROSS, down=_DOWN, **_MARGINS)
    room = panels[0].get_position().width * style.width()
    for axes, difference in zip(panels, shown, strict=True):
        assert difference.values is not None
        if difference.along is None:
            axes.plot(*difference.values, "o", color=style.VERMILION, markersize=4, linestyle="none")
            both = np.concatenate(difference.values)
            ends = [both[np.isfinite(both)].min(initial=np.inf), both[np.isfinite(both)].max(initial=-np.inf)]
            if ends[0] < ends[1]:
                axes.plot(ends, ends, color=style.FAINT, linewidth=1.0, zorder=1)
            axes.set_xlabel(style.axis_label("old", difference.unit))
            axes.set_ylabel(style.axis_label("new", difference.unit))
        else:
            order = np.argsort(difference.along.values, kind="stable")
            x, (old, new) = difference.along.values[order], (values[order] for values in difference.values)
            if _alike(old, new):
                axes.plot(x, new - old, color=style.VERMILION, label="new − old")
                axes.axhline(0.0, color=style.FAINT, linewidth=1.0, zorder=1)
            else:
                axes.plot(x, old, color=style.BLUE, linestyle=style.DASHES[0], label="old")
                axes.plot(x, new, color=style.VERMILION, linestyle=style.DASHES[1], label="new")
            axes.set_xlabel(style.axis_label(difference.along.name, difference.along.unit))
            axes.set_ylabel(style.axis_label("value", difference.unit))
            axes.legend(loc="best")
        name = f"{difference.folder}/{difference.table}: {difference.column}".removeprefix("./")
        axes.set_title(style.folded(name, _TITLE_SIZE, room), fontsize=_TITLE_SIZE, loc="left")
    style.name_powers(panels)
    left = len(moved) - len(shown)
    more = f"; {left} more in differences.csv" if left else ""
    figure.text(0.01, 1 - 0.1 / figure.get_figheight(), f"What moved most{more}", va="top", fontsize=11)
    return figure


def _alike(old: Floats, new: Floats) -> bool:
    """Whether two curves lie over each other, so that only their difference is seen."""
    apart, both = np.abs(new - old), np.concatenate([old, new])
    finite = both[np.isfinite(both)]
    return bool(len(finite) and np.nanmax(apart, initial=0.0) < _ALIKE * np.ptp(finite))
