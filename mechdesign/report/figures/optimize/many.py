"""Many designs at once: as lines across parallel axes, their Pareto front, and how a search came to its optimum."""

from __future__ import annotations

import re
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.report.figures import style
from mechdesign.report.figures.optimize.scores import label
from mechdesign.results import Table

# More lines than that are one blot: of more designs every so many are drawn, in the order of their score.
MOST = 300
_LETTERS = 14  # of a name in one line below an axis


def parallel_axes(compared: Comparison) -> Figure:
    """Each feasible design a line across its variables and goals, the colour its score, the best of all on top."""
    designs = compared.designs
    names = [*designs.variables, *(each.name for each in designs.goals)]
    rows = np.flatnonzero(designs.feasible)
    rows = rows[np.argsort(compared.cpi[rows], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST)).astype(int))]
    columns = np.column_stack([*designs.variables.values(), compared.values])
    low, high = columns[designs.feasible].min(axis=0), columns[designs.feasible].max(axis=0)
    heights = np.where(high > low, (columns - low) / np.where(high > low, high - low, 1.0), 0.5)
    figure = style.new_figure(4.2)
    axes = figure.add_subplot()
    places = np.arange(len(names))
    lines = [np.column_stack([places, heights[row]]) for row in rows]
    drawn = LineCollection(lines, array=compared.cpi[rows], cmap=style.COLORMAP, linewidths=0.8, alpha=0.75)
    axes.add_collection(drawn)
    axes.plot(places, heights[compared.best], "o-", color=style.VERMILION, linewidth=2.2, label="best", clip_on=False,
              zorder=4)  # fmt: skip
    for place, ends in enumerate(zip(low, high, strict=True)):
        axes.axvline(place, color=style.INK, linewidth=0.8, zorder=3)
        axes.text(place, -0.03, f"{ends[0]:.4g}", ha="center", va="top", fontsize=8.5)
        axes.text(place, 1.03, f"{ends[1]:.4g}", ha="center", va="bottom", fontsize=8.5)
    axes.set_xlim(-0.3, len(names) - 0.7)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xticks(places, [_folded(label(compared, name)) for name in names])
    axes.tick_params(axis="x", length=0, pad=18)
    axes.set_yticks([])
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False)
    shown = f"{len(rows)} of " if len(rows) < designs.feasible.sum() else ""
    axes.set_title(f"{shown}{int(designs.feasible.sum())} feasible designs, the best on top", loc="left", pad=20)
    what = "sum of the normalised goals" if len(designs.goals) > 1 else "normalised goal"
    style.color_bar(figure, drawn, what, ax=axes, pad=0.02)
    return figure


def _folded(name: str) -> str:
    """A long name on two or more lines, broken after its dots, underscores and spaces."""
    lines = [""]
    for part in re.findall(r"[^._ ]*[._ ]?", name):
        if lines[-1] and len(lines[-1]) + len(part) > _LETTERS:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def convergence(compared: Comparison) -> Figure:
    """The best score found so far over the number of designs evaluated, a line a row of weights."""
    designs = compared.designs
    figure = style.new_figure(3.6)
    axes = figure.add_subplot()
    count = np.arange(1, len(designs) + 1)
    if len(designs.goals) > 1:
        for row in compared.weights:
            so_far = np.maximum.accumulate(np.nan_to_num(compared.score(row), nan=-np.inf))
            known = np.isfinite(so_far)
            weights = ", ".join(f"{weight:g}" for weight in row)
            axes.step(count[known], so_far[known] / so_far[-1], where="post", label=f"({weights})")
        axes.set_ylabel("best score so far / best")
        goals = ", ".join(each.name for each in designs.goals)
        axes.legend(title=f"weights of ({goals})", loc="upper left", bbox_to_anchor=(1.01, 1.0), title_fontsize=9,
                    alignment="left")  # fmt: skip
    else:
        (goal,) = designs.goals
        values = np.where(designs.feasible, compared.values[:, 0], np.inf if goal.smallest else -np.inf)
        so_far = (np.minimum if goal.smallest else np.maximum).accumulate(values)
        known = np.isfinite(so_far)
        axes.step(count[known], so_far[known], where="post", color=style.BLUE)
        found = so_far[known]
        if (found > 0).all() and found.max() > 20 * found.min():
            axes.set_yscale("log")
        axes.set_ylabel(f"best {label(compared, goal.name)} so far")
    axes.set_xlabel("designs evaluated")
    axes.set_title("Convergence of the search", loc="left")
    axes.margins(x=0.01)
    return figure


def front_figure(compared: Comparison, front: Table) -> Figure:
    """Every feasible design, those of the front, and the knee; a panel each pair of goals."""
    pairs = list(combinations(range(len(compared.designs.goals)), 2))
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    figure = style.new_figure(4.8 if len(pairs) == 1 else 0.8 + 2.9 * rows)
    for number, pair in enumerate(pairs):
        _front(figure.add_subplot(rows, columns, number + 1), compared, front, pair)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2 if len(labels) > 2 else 3)
    number = int(compared.designs.feasible.sum())
    figure.suptitle(f"Pareto front: {len(front)} of {number} feasible designs", x=0.01, ha="left", fontsize=11)
    return figure


def _front(axes: Axes, compared: Comparison, front: Table, pair: tuple[int, int]) -> None:
    designs = compared.designs
    goals = [designs.goals[k] for k in pair]
    x, y = compared.values[designs.feasible][:, pair].T
    axes.plot(x, y, ".", color=style.FAINT, markersize=3, alpha=0.5, markeredgewidth=0, label="feasible designs")
    along, up = (np.asarray(front[goal.name], dtype=float) for goal in goals)
    order = np.argsort(along, kind="stable")
    axes.plot(along[order], up[order], "o-" if len(designs.goals) == 2 else "o", color=style.BLUE, linewidth=1.2,
              markersize=4.0 if len(front) < 200 else 2.2,
              label="front: no other is better in every goal")  # fmt: skip
    for row in np.flatnonzero(front["knee"]):
        words = ", ".join(f"{name} = {front[name][row]:.4g}" for name in designs.variables)
        axes.plot(along[row], up[row], "*", color=style.VERMILION, markeredgecolor="white", markersize=15,
                  linestyle="none", label=f"knee: {words}", zorder=5)  # fmt: skip
    across, upwards = (f"{label(compared, g.name)}, {'less' if g.smallest else 'more'} is better" for g in goals)
    axes.set_xlabel(across)
    axes.set_ylabel(upwards)
    # Designs far worse than the front would press it into a corner.
    for values, every, limit in ((along, x, axes.set_xlim), (up, y, axes.set_ylim)):
        low, high = float(values.min()), float(values.max())
        span = (high - low) or abs(high) or 1.0
        limit(max(float(every.min()), low - 0.6 * span) - 0.04 * span,
              min(float(every.max()), high + 0.6 * span) + 0.04 * span)  # fmt: skip
