"""Columns that moved between two results: old and new over the pose, or new against old."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.report.comparison.differences import Difference
from mechdesign.report.figures import style
from mechdesign.report.figures.marks import Axis, Dots, Lines, Panel, PanelMark, Picture, Trace
from mechdesign.report.figures.panels import MAX_PANELS

_ALIKE = 0.03  # of their range: curves that are nearer to each other cannot be told apart
_THIN = {"color": style.FAINT, "linewidth": 1.0, "zorder": 1}


def differences_picture(moved: Sequence[Difference]) -> Picture:
    """A panel a column, of those that moved most for the size of their old values."""
    left = len(moved) - MAX_PANELS
    more = f"; {left} more in differences.csv" if left > 0 else ""
    return Picture(f"What moved most{more}", [_panel(difference) for difference in moved[:MAX_PANELS]], across=2)


def _panel(difference: Difference) -> Panel:
    """Old and new of a column over the pose, where it has one."""
    assert difference.values is not None
    name = f"{difference.folder}/{difference.table}: {difference.column}".removeprefix("./")
    old, new = difference.values
    if difference.along is None:
        marks: list[PanelMark] = [Dots(old, new, look={"color": style.VERMILION, "markersize": 4})]
        both = np.concatenate([old, new])
        ends = [both[np.isfinite(both)].min(initial=np.inf), both[np.isfinite(both)].max(initial=-np.inf)]
        marks += [Trace(ends, ends, look=_THIN)] if ends[0] < ends[1] else []
        return Panel(marks, Axis("old", difference.unit), Axis("new", difference.unit), name)
    order = np.argsort(difference.along.values, kind="stable")
    x, old, new = difference.along.values[order], old[order], new[order]
    looks = ({"color": color, "linestyle": style.DASHES[k]} for k, color in enumerate((style.BLUE, style.VERMILION)))
    if _alike(old, new):
        marks = [Trace(x, new - old, label="new − old", look={"color": style.VERMILION}), Lines([0.0], look=_THIN)]
    else:
        marks = [Trace(x, values, label=words, look=look)
                 for values, words, look in zip((old, new), ("old", "new"), looks, strict=True)]  # fmt: skip
    return Panel(marks, Axis(difference.along.name, difference.along.unit), Axis("value", difference.unit), name)


def _alike(old: Floats, new: Floats) -> bool:
    """Whether two curves lie over each other, so that only their difference is seen."""
    apart, both = np.abs(new - old), np.concatenate([old, new])
    finite = both[np.isfinite(both)]
    return bool(len(finite) and np.nanmax(apart, initial=0.0) < _ALIKE * np.ptp(finite))
