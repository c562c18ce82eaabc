"""The mechanism in several poses of its motion, with the paths of its points."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism, link_colors
from mechdesign.report.figures.framing import ABOVE, framed
from mechdesign.report.figures.scene import link_points
from mechdesign.report.figures.sweep import Sweep, ranks

TALLEST = 5.6
# Ghosts for that many moving links at most, and how much of a ghost is colour.
_GHOSTS = ((3, 7, 0.42), (5, 6, 0.38), (8, 4, 0.32), (10**6, 2, 0.3))
# Line width and share of colour of a path by the rank of its point.
_LOOKS = {2: (2.2, 1.0), 1: (1.1, 0.9), 0: (0.9, 0.55)}
_MARKS = 240  # places of a path that names keep off


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
    avoid = np.concatenate([_thinned(path) for path in sweep.places.values()])
    first = int(sweep.valid[0])
    draw_mechanism(axes, sweep.mechanism, sweep.configuration, first, travel=sweep.travel, avoid=avoid)
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


def _thinned(path: Complexes) -> Complexes:
    known = path[np.isfinite(path)]
    return known[np.unique(np.linspace(0, len(known) - 1, _MARKS).astype(int))] if len(known) else known
