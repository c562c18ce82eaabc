"""What drives give over a motion: effort and power of each, with peak, mean and root mean square."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.joints import NOTHING, PEAK, place_in_words
from mechdesign.drawing.marks import Axis, Dots, Lines, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.panels import MAX_PANELS, Along, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.questions.friction import SMOOTH

# A peak beyond so many times the root mean square, near a singularity, leaves the axis.
_BEYOND = 6.0
_CURVES = {"effort": style.BLUE, "power": style.GREEN}
_RMS: dict[str, Any] = {"color": style.VERMILION, "linestyle": (0, (6, 2)), "linewidth": 1.3}
_SMOOTH: dict[str, Any] = {"color": style.BLUE, "linestyle": (0, (3, 1.5)), "linewidth": 1.0}
_MEAN: dict[str, Any] = {"color": style.INK, "linestyle": (0, (1.5, 1.5)), "linewidth": 1.3}


@picture(DynamicsView, "efforts", order=20)
def efforts_picture(view: DynamicsView) -> Picture | None:
    """Effort and power of every drive over a motion; None where the drives have nothing to do."""
    over, arrays = view.swept, view.drawn.motion.arrays
    if over is None:
        return None
    names = [f"{drive}_{kind}" for kind in _CURVES for drive in view.study.mechanism.drives]
    names = [name for name in names if name in arrays and np.isfinite(view.column(name)).any()]
    names = [name for name in names if np.nanmax(np.abs(view.column(name))) > _rounding(view, name)]
    panels = [_panel(view, name, over) for name in names[:MAX_PANELS]]
    return Picture("Efforts of the drives", panels, share="x") if panels else None


def _rounding(view: DynamicsView, name: str) -> float:
    """Below this an effort or power is rounding beside the forces of the joints."""
    joints, _ = view.joints
    largest = max((joint.peak for joint in joints), default=0.0)
    return NOTHING * 1e-3 * largest * (view.study.mechanism.size if name.endswith("_effort") else 0.0)


def _panel(view: DynamicsView, name: str, over: Along) -> Panel:
    """One column with its numbers in words."""
    extremes = view.result.tables["extremes"]
    row = extremes.take(extremes.where(output=name))
    unit, values = str(row["unit"][0]), view.column(name)
    high, size, at, mean, rms = (float(row[key][0]) for key in ("max", "peak", "peak_at", "mean", "rms"))
    drive, _, kind = name.rpartition("_")
    marks: list[PanelMark] = [
        Trace(over.values, values, look={"color": _CURVES[kind], "linewidth": 1.8}),
        Lines([0.0], look={"color": style.FAINT, "linewidth": 0.9, "zorder": 1.5}),
    ]
    if kind == "effort" and (smooth := view.drawn.motion.arrays.get(f"{SMOOTH} {drive}")) is not None:
        marks.append(Trace(over.values, smooth, label="effort without friction", look=_SMOOTH))
    if not np.isfinite(size):
        usual = _BEYOND * float(np.nanmedian(np.abs(values)))
        ends = max(np.nanmin(values, initial=0.0), -usual), min(np.nanmax(values, initial=0.0), usual)
        return Panel(marks, over.axis, Axis(kind, unit, ends=ends), f"{drive}: without bound")
    if np.isnan(at):
        return Panel(marks, over.axis, Axis(kind, unit), f"{drive}: {quantity(high, unit)} everywhere")
    place = at if over.name else at + 1
    # Of two ends that are equally large it is the one at this place.
    value = np.copysign(size, np.interp(place, over.values, values))
    mean = 0.0 if abs(mean) < NOTHING * size else mean
    marks.append(Dots([place], [value], label="peak", look=PEAK))
    marks.append(Lines([-rms if high <= 0 else rms], label="root mean square", look=_RMS))
    marks.append(Lines([mean], label="mean", look=_MEAN))
    words = (
        f"peak {quantity(value, unit)} at {place_in_words(view.study, over, place)}, "
        f"rms {quantity(rms, unit, size)}, mean {quantity(mean, unit, size)}"
    )
    return Panel(marks, over.axis, Axis(kind, unit), f"{drive}: {words}")
