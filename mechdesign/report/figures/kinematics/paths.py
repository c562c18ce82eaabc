"""The mechanism in several poses of its motion, or in every assembly, with the paths of its points."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism, link_colors
from mechdesign.report.figures.framing import ABOVE, LEFT, RIGHT, extent, fit, framed, scale_of, windows
from mechdesign.report.figures.scene import link_points
from mechdesign.report.figures.sweep import Sweep, ranks
from mechdesign.results import Result
from mechdesign.study import Study

TALLEST = 5.6
# Ghosts for that many moving links at most, and how much of a ghost is colour.
_GHOSTS = ((3, 7, 0.42), (5, 6, 0.38), (8, 4, 0.32), (10**6, 2, 0.3))
# Line width and share of colour of a path by the rank of its point.
_LOOKS = {2: (2.2, 1.0), 1: (1.1, 0.9), 0: (0.9, 0.55)}
# Of panels side by side: inches above a panel, above all of them, and between two; the most of them, and their heights.
_TITLE, _NOTE, _GAP = 0.3, 0.3, 0.12
_MOST_COLUMNS, _HIGHEST, _LOWEST = 4, 4.0, 1.2
_TURNED = 0.6  # size of symbols in the smallest panels, next to 1 for one as wide as the page


def paths_figure(sweep: Sweep, *, above: float = ABOVE) -> Figure:
    """The first valid pose with its names, ghosts of later ones, and the path of every moving point.

    `above` it, inches are left for a title.
    """
    wanted = _wanted(sweep)
    places = np.concatenate([sweep.extent, *wanted])
    figure, axes = framed(places, sweep.study.units.label("length"), height=TALLEST, above=above)
    for path in wanted:
        axes.plot(
            path.real, path.imag, "o", color=style.VERMILION, linewidth=1.2, linestyle=(0, (1, 2.5)), markersize=3,
            zorder=3.7,
        )  # fmt: skip
    count = len(sweep.mechanism.description.links) - 1
    _, ghosts, share = next(entry for entry in _GHOSTS if count <= entry[0])
    # A closed motion ends where it begins: its last ghost would hide the first.
    some = sweep.valid[np.linspace(0, len(sweep.valid) - 1, ghosts + 1).round().astype(int)]
    for index in np.unique(some[1 : -1 if sweep.closed else None]):
        draw_ghost(axes, sweep.mechanism, sweep.configuration, int(index), share=share)
    draw_paths(axes, sweep)
    first = int(sweep.valid[0])
    draw_mechanism(axes, sweep.mechanism, sweep.configuration, first, travel=sweep.travel)
    return figure


def draw_paths(axes: Axes, sweep: Sweep, width: float = 1.0) -> None:
    """Draw the path of every moving point, the more boldly the more it tells."""
    section = sweep.study.kinematics
    asked = section.outputs if section is not None and section.outputs is not None else ()
    ranked = ranks(sweep.mechanism, tuple(asked))
    # Where no point tells more than the others, none is thin.
    lift = 2 - max(ranked.values(), default=2)
    colors = link_colors(sweep.mechanism)
    owners: dict[str, str] = {}
    for name, link in sweep.mechanism.description.links.items():
        if name != GROUND:
            for point in link_points(link):
                owners.setdefault(point, name)
    for point, path in sweep.places.items():
        if sweep.closed and sweep.poses.closed:
            # A closed path is listed without its begin at its end.
            path = np.append(path, path[0])
        line, share = _LOOKS[min(ranked[point] + lift, 2)]
        axes.plot(
            path.real, path.imag, color=colors[owners[point]], linewidth=line * width, alpha=share,
            zorder=2.5 + 0.1 * ranked[point], solid_joinstyle="round",
        )  # fmt: skip


def _wanted(sweep: Sweep) -> list[Complexes]:
    """Places that points should pass through, where the study says so by a table."""
    return [
        target.table[:, -2] + 1j * target.table[:, -1]
        for target in sweep.study.targets.values()
        if target.table is not None and len(target.coordinates) == 2
    ]


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
    return width, min(max(8.0 / rows, _LOWEST), _HIGHEST)
