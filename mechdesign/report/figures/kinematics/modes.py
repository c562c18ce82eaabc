"""Every assembly mode of a mechanism, side by side: its first valid pose and the paths of its points."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import LEFT, RIGHT, extent, fit, scale_of, windows
from mechdesign.report.figures.kinematics.paths import draw_paths
from mechdesign.report.figures.sweep import Sweep
from mechdesign.results import Result
from mechdesign.study import Study

_TITLE, _NOTE, _GAP = 0.3, 0.3, 0.12  # inches above a panel, above all of them, and between two
_MOST_COLUMNS, _TALLEST, _LOWEST = 4, 4.0, 1.2  # panels beside one another; inches a panel is high
_TURNED = 0.6  # size of symbols in the smallest panels, next to 1 for one as wide as the page


def modes_figure(study: Study, result: Result) -> Figure:
    """A panel an assembly that has a valid pose, as many as the result carries, on one scale."""
    shown = [(title, Sweep.of(each)) for title, each in result.drawn["modes"].items()]
    found = result.counts["modes"]
    moving = int((result.tables["modes"]["valid"].reshape(found, -1) > 0).any(axis=1).sum())
    notes = []
    if moving > len(shown):
        notes.append(f"{len(shown)} of {moving} assemblies")
    if found > moving:
        notes.append(f"{found - moving} of {found} assemblies have no valid pose")
    places = np.concatenate([sweep.extent for _, sweep in shown])
    _, wide, tall = extent(places)
    columns = max(
        range(1, min(len(shown), _MOST_COLUMNS) + 1),
        key=lambda count: scale_of(wide, tall, *_room(count, math.ceil(len(shown) / count)), _pad(count)),
    )
    window = fit(places, *_room(columns, math.ceil(len(shown) / columns)), _pad(columns))
    unit, top = study.units.label("length"), _NOTE if notes else 0.0
    figure, grid = windows(window, unit, len(shown), columns, gap=_GAP, above=_TITLE, top=top)
    for axes, (title, sweep) in zip(grid, shown, strict=True):
        axes.set_title(title, loc="left", fontsize=10)
        draw_paths(axes, sweep, width=0.8)
        draw_mechanism(
            axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]), labels=columns == 1, drives=False,
            travel=sweep.travel, size=_TURNED if columns > 1 else 1.0,
        )  # fmt: skip
    figure.text(LEFT / style.WIDTH, 1 - 0.22 / figure.get_figheight(), "; ".join(notes), fontsize=10)
    return figure


def _pad(columns: int) -> float:
    """Inches around what a panel shows."""
    return 0.4 if columns == 1 else 0.2


def _room(columns: int, rows: int) -> tuple[float, float]:
    """Largest width and height of a panel, inches: all of them on about one screen."""
    width = (style.WIDTH - LEFT - RIGHT - _GAP * (columns - 1)) / columns
    return width, min(max(8.0 / rows, _LOWEST), _TALLEST)
