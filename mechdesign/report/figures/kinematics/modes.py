"""Every assembly mode of a mechanism, side by side: its first valid pose and the paths of its points."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from mechdesign.analyses.poses import study_poses
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import BELOW, LEFT, RIGHT, extent, fit, scale_of
from mechdesign.report.figures.kinematics.paths import draw_paths
from mechdesign.report.figures.sweep import Sweep, solve_sweep
from mechdesign.study import Study

MOST = 12
_TITLE, _NOTE, _GAP = 0.3, 0.3, 0.12  # inches above a panel, above all of them, and between two
_MOST_COLUMNS, _TALLEST, _LOWEST = 4, 4.0, 1.2  # panels beside one another; inches a panel is high
_TURNED = 0.6  # size of symbols in the smallest panels, next to 1 for one as wide as the page


def modes_figure(study: Study) -> Figure:
    """A panel an assembly that has a valid pose, at most `MOST`, on one scale; the sketch's own is named so."""
    names = study_poses(study, "kinematics").groups[0].names
    found: list[tuple[str, Sweep]] = []
    for assembly in assemblies(study.mechanism, names):
        title = f"{assembly.label} (as drawn)" if assembly.drawn else assembly.label
        found.append((title, solve_sweep(replace(study, mechanism=assembly.mechanism))))
    moving = [(title, sweep) for title, sweep in found if len(sweep.valid)]
    shown = moving[:MOST]
    notes = []
    if len(moving) > len(shown):
        notes.append(f"{len(shown)} of {len(moving)} assemblies")
    if len(found) > len(moving):
        notes.append(f"{len(found) - len(moving)} of {len(found)} assemblies have no valid pose")
    places = np.concatenate([sweep.extent for _, sweep in shown])
    _, wide, tall = extent(places)
    columns = max(
        range(1, min(len(shown), _MOST_COLUMNS) + 1),
        key=lambda count: scale_of(wide, tall, *_room(count, math.ceil(len(shown) / count)), _pad(count)),
    )
    rows = math.ceil(len(shown) / columns)
    window = fit(places, *_room(columns, rows), _pad(columns))
    above = _NOTE if notes else 0.0
    outer = BELOW + rows * (window.height + _TITLE) + above
    figure = style.new_figure(style.WIDTH, outer, layout=None)
    unit = study.units.label("length")
    for k, (title, sweep) in enumerate(shown):
        column, row = k % columns, k // columns
        left = LEFT + column * (window.width + _GAP)
        low = BELOW + (rows - 1 - row) * (window.height + _TITLE)
        axes = figure.add_axes(
            (left / style.WIDTH, low / outer, window.width / style.WIDTH, window.height / outer)
        )  # fmt: skip
        window.limit(axes)
        lowest = k + columns >= len(shown)
        axes.tick_params(labelleft=column == 0, labelbottom=lowest)
        axes.set_xlabel(style.axis_label("x", unit) if lowest else "")
        axes.set_ylabel(style.axis_label("y", unit) if column == 0 else "")
        axes.set_title(title, loc="left", fontsize=10)
        draw_paths(axes, sweep, width=0.8)
        draw_mechanism(
            axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]), labels=columns == 1, drives=False,
            travel=sweep.travel, size=_TURNED if columns > 1 else 1.0,
        )  # fmt: skip
    figure.text(LEFT / style.WIDTH, 1 - 0.22 / outer, "; ".join(notes), fontsize=10)
    return figure


def _pad(columns: int) -> float:
    """Inches around what a panel shows."""
    return 0.4 if columns == 1 else 0.2


def _room(columns: int, rows: int) -> tuple[float, float]:
    """Largest width and height of a panel, inches: all of them on about one screen."""
    width = (style.WIDTH - LEFT - RIGHT - _GAP * (columns - 1)) / columns
    return width, min(max(8.0 / rows, _LOWEST), _TALLEST)
