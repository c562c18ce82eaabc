"""What the drives give over a motion: effort and power of each, with peak, mean and root mean square."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.questions.friction import SMOOTH
from mechdesign.report.figures import style
from mechdesign.report.figures.joints import NOTHING, place_in_words
from mechdesign.report.figures.panels import (
    MAX_PANELS,
    Along,
    clear_of_ticks,
    legend_below,
    quantity,
    stack,
    tick_abscissa,
)
from mechdesign.report.figures.pictures import picture

_FEW_PANELS = 4  # more of them are lower
_TALL, _LOW = 1.75, 1.3  # inches
# A peak beyond so many times the root mean square, near a singularity, leaves the axis.
_BEYOND = 6.0
_CURVES = {"effort": style.BLUE, "power": style.GREEN}
_RMS: dict[str, Any] = {"color": style.VERMILION, "linestyle": (0, (6, 2)), "linewidth": 1.3}
_SMOOTH: dict[str, Any] = {"color": style.BLUE, "linestyle": (0, (3, 1.5)), "linewidth": 1.0}
_MEAN: dict[str, Any] = {"color": style.INK, "linestyle": (0, (1.5, 1.5)), "linewidth": 1.3}


@picture(DynamicsView, "efforts", order=20)
def efforts_figure(view: DynamicsView) -> Figure | None:
    """Effort and power of every drive over a motion; None where the drives have nothing to do."""
    over, arrays = view.swept, view.drawn.motion.arrays
    if over is None:
        return None
    names = [f"{drive}_{kind}" for kind in _CURVES for drive in view.study.mechanism.drives]
    names = [name for name in names if name in arrays and np.isfinite(view.column(name)).any()]
    names = [name for name in names if np.nanmax(np.abs(view.column(name))) > _rounding(view, name)]
    if not names:
        return None
    names = names[:MAX_PANELS]
    tall = _LOW if len(names) > _FEW_PANELS else _TALL
    figure, panels = stack(len(names), "Efforts of the drives", over.label, tall=tall)
    for axes, name in zip(panels, names, strict=True):
        _panel(view, axes, name, over)
    tick_abscissa(panels[-1], over)
    panels[-1].set_xlim(float(over.values.min()), float(over.values.max()))
    clear_of_ticks(figure, panels)
    looks = {"root mean square": _RMS, "mean": _MEAN}
    if any(name.startswith(SMOOTH) for name in arrays):
        looks["effort without friction"] = _SMOOTH
    handles = [Line2D([], [], label=words, **look) for words, look in looks.items()]
    ring = Line2D([], [], color=style.INK, marker="o", markersize=7, markerfacecolor="none", linestyle="", label="peak")
    legend_below(figure, [*handles, ring], [str(handle.get_label()) for handle in (*handles, ring)])
    return figure


def _rounding(view: DynamicsView, name: str) -> float:
    """Below this an effort or power is rounding beside the forces of the joints."""
    joints, _ = view.joints
    largest = max((joint.peak for joint in joints), default=0.0)
    return NOTHING * 1e-3 * largest * (view.study.mechanism.size if name.endswith("_effort") else 0.0)


def _panel(view: DynamicsView, axes: Axes, name: str, over: Along) -> None:
    """One column with its numbers in words."""
    extremes = view.result.tables["extremes"]
    row = extremes.take(extremes.where(output=name))
    unit, values = str(row["unit"][0]), view.column(name)
    low, high, size, at, mean, rms = (float(row[key][0]) for key in ("min", "max", "peak", "peak_at", "mean", "rms"))
    drive, _, kind = name.rpartition("_")
    axes.plot(over.values, values, color=_CURVES[kind], linewidth=1.8)
    if kind == "effort" and (smooth := view.drawn.motion.arrays.get(f"{SMOOTH} {drive}")) is not None:
        axes.plot(over.values, smooth, **_SMOOTH)
    axes.axhline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)
    words = "without bound"
    if np.isfinite(size):
        place = at if over.name else at + 1
        value = high if high >= -low else low
        axes.plot(place, value, "o", color=style.INK, markersize=7, markerfacecolor="none", markeredgewidth=1.6,
                  clip_on=False, zorder=5)  # fmt: skip
        mean = 0.0 if abs(mean) < NOTHING * size else mean
        axes.axhline(-rms if high <= 0 else rms, **_RMS)
        axes.axhline(mean, **_MEAN)
        words = (
            f"peak {quantity(value, unit)} at {place_in_words(view.study, over, place)}, "
            f"rms {quantity(rms, unit)}, mean {quantity(mean, unit)}"
        )
    else:
        usual = _BEYOND * float(np.nanmedian(np.abs(values)))
        axes.set_ylim(max(np.nanmin(values, initial=0.0), -usual), min(np.nanmax(values, initial=0.0), usual))
    axes.set_ylabel(style.axis_label(kind, unit))
    type_size = 6.5 if style.narrow() else 9.5
    axes.set_title(style.folded(f"{drive}: {words}", type_size, style.width() - 1.0), loc="left", fontsize=type_size)
