"""Maps of results over the poses of a workspace, or of a grid of two coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import coordinate_label, moving_names, title
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Extend = Literal["neither", "min", "max", "both"]

# Inches.
_LEFT = 0.75
_BELOW = 0.55
_BAR = 1.1
_TOP = 0.7
_GAP = 0.5
_MAX_HEIGHT = 5.2


@dataclass(frozen=True, eq=False)
class Plane:
    """Poses in the plane of the two coordinates that vary, shape (lines, nodes), and the lines that are joined."""

    names: tuple[str, str]
    x: Floats
    y: Floats
    equal: bool
    patches: tuple[slice, ...]


def plane(study: Study, poses: Poses) -> Plane | None:
    """The plane of a grid over two coordinates; None for every other choice of poses."""
    names = moving_names(poses)
    if poses.listed or len(poses.grid) != 2 or len(names) != 2 or min(poses.grid) < 3:
        return None
    x, y = (poses.values[name].reshape(poses.grid) for name in names)
    quantities = {study.mechanism.quantity(name) for name in names}
    return Plane((names[0], names[1]), x, y, quantities == {"length"}, poses.patches or (slice(None),))


def map_sheet(
    study: Study, over: Plane, parts: list[tuple[str, Floats]], heading: str, note: str, *, logarithmic: bool = False
) -> Figure:
    """Maps side by side, or two by two, each with its own bar of colours."""
    columns = min(len(parts), 2)
    lines = -(-len(parts) // columns)
    wide = (style.WIDTH - 0.1) / columns - _LEFT - _BAR
    spans = np.ptp(over.x[np.isfinite(over.x)]), np.ptp(over.y[np.isfinite(over.y)])
    tall = min(_MAX_HEIGHT / lines, wide * float(spans[1] / spans[0]) * 1.02 if over.equal else 0.8 * wide)
    tall = max(tall, 1.2)
    figure, grid = style.page(
        len(parts), columns, tall, left=_LEFT, right=_BAR + 0.1, top=_TOP, bottom=_BELOW, across=_LEFT + _BAR,
        down=_BELOW + _GAP,
    )  # fmt: skip
    title(figure, heading, note, left=_LEFT)
    for axes, (name, values) in zip(grid, parts, strict=True):
        bar = axes.inset_axes((1 + 0.12 / wide, 0, 0.14 / wide, 1))
        _map(figure, axes, bar, over, values, logarithmic)
        axes.set_title(name, loc="left", fontsize=9.5)
        axes.set_xlabel(coordinate_label(study, over.names[0]))
        axes.set_ylabel(coordinate_label(study, over.names[1]))
    return figure


def _map(figure: Figure, axes: Axes, bar: Axes, over: Plane, values: Floats, logarithmic: bool) -> None:
    known = np.isfinite(values) & ((values > 0) | (not logarithmic))
    axes.grid(visible=False)
    axes.set_facecolor("#EEEEEE")
    if over.equal:
        axes.set_aspect("equal")
    if not known.any():
        bar.set_visible(False)
        return
    if not logarithmic:
        levels = style.levels(float(values[known].min()), float(np.quantile(values[known], 0.97)), 9)
    else:
        levels = _powers(values[known])
        # Between nodes powers are interpolated; below the last level is all that is smaller, even 0.
        values, levels = np.log10(np.maximum(values, 1e-3 * levels[0])), np.log10(levels)
    shown = np.ma.masked_invalid(values)
    ends = bool(shown.min() < levels[0]), bool(shown.max() > levels[-1])
    extend: Extend = "both" if all(ends) else "min" if ends[0] else "max" if ends[1] else "neither"
    norm = BoundaryNorm(levels, 256, extend=extend)
    for patch in over.patches:
        axes.contourf(over.x[patch], over.y[patch], shown[patch], levels=levels, cmap=style.COLORMAP, norm=norm,
                      extend=extend)  # fmt: skip
        axes.contour(over.x[patch], over.y[patch], shown[patch], levels=levels, colors="white", linewidths=0.5,
                     linestyles="solid", alpha=0.7)  # fmt: skip
        if over.equal:
            for end in (0, -1):
                axes.plot(over.x[patch, end], over.y[patch, end], color=style.INK, linewidth=1.2)
    style.color_bar(figure, ScalarMappable(norm, style.COLORMAP), cax=bar, ticks=levels)
    if logarithmic:
        bar.set_yticks(levels, [_power(10.0**level) for level in levels])
    bar.tick_params(labelsize=8)


def _powers(values: Floats) -> Floats:
    """Levels 1, 2, 5 times powers of ten where values lie close, powers of ten where they do not.

    What a twentieth of the values lies beyond, as near a singularity, gets no levels of its own.
    """
    smallest, largest = (max(float(value), 1e-16) for value in np.quantile(values, (0.05, 0.95)))
    powers = 10.0 ** np.arange(np.floor(np.log10(smallest)), np.ceil(np.log10(largest)) + 1)
    if len(powers) > 4:
        step = -(-len(powers) // 9)
        return np.asarray(powers[::-1][::step][::-1])
    fine = np.outer(powers, (1, 2, 5)).ravel()
    kept = (fine >= 0.4 * smallest) & (fine <= 2.5 * largest)
    return fine[kept] if np.count_nonzero(kept) > 1 else fine


def _power(level: float) -> str:
    digit, power = f"{level:.0e}".split("e")
    ten = f"10$^{{{int(power)}}}$"
    return ten if digit == "1" else f"{digit}\N{MIDDLE DOT}{ten}"
