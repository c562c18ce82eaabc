"""The Pareto front of two goals, or of each pair of more, with its knee."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.report.figures import style
from mechdesign.report.figures.optimize.designs import Designs
from mechdesign.results import Table


def front_figure(designs: Designs, front: Table) -> Figure:
    """Every feasible design, those of the front, and the knee; a panel each pair of goals."""
    pairs = list(combinations(designs.goals, 2))
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    figure = style.new_figure(style.WIDTH, 4.8 if len(pairs) == 1 else 0.8 + 2.9 * rows)
    knee = np.flatnonzero(np.asarray(front["knee"]).astype(bool))
    for number, pair in enumerate(pairs):
        axes = figure.add_subplot(rows, columns, number + 1)
        _panel(axes, designs, front, pair, knee, joined=len(designs.goals) == 2)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2 if len(labels) > 2 else 3)
    number = int(designs.feasible.sum())
    figure.suptitle(f"Pareto front: {len(front)} of {number} feasible designs", x=0.01, ha="left", fontsize=11)
    return figure


def _panel(
    axes: Axes, designs: Designs, front: Table, pair: tuple[str, str], knee: np.ndarray, *, joined: bool
) -> None:
    x, y = (designs[goal][designs.feasible] for goal in pair)
    axes.plot(x, y, ".", color=style.FAINT, markersize=3, alpha=0.5, markeredgewidth=0, label="feasible designs")
    along, up = (np.asarray(front[goal], dtype=float) for goal in pair)
    order = np.argsort(along, kind="stable")
    size = 4.0 if len(front) < 200 else 2.2
    axes.plot(along[order], up[order], "o-" if joined else "o", color=style.BLUE, linewidth=1.2, markersize=size,
              label="front: no other is better in every goal")  # fmt: skip
    for row in knee:
        axes.plot(along[row], up[row], "*", color=style.VERMILION, markeredgecolor="white", markersize=15,
                  linestyle="none", label=f"knee: {designs.in_words(front, int(row))}", zorder=5)  # fmt: skip
    across, upwards = (f"{designs.label(goal)}, {'less' if designs.goals[goal] else 'more'} is better" for goal in pair)
    axes.set_xlabel(across)
    axes.set_ylabel(upwards)
    # Designs far worse than the front would press it into a corner.
    for values, every, limit in ((along, x, axes.set_xlim), (up, y, axes.set_ylim)):
        low, high = float(values.min()), float(values.max())
        span = (high - low) or abs(high) or 1.0
        limit(max(float(every.min()), low - 0.6 * span) - 0.04 * span,
              min(float(every.max()), high + 0.6 * span) + 0.04 * span)  # fmt: skip
