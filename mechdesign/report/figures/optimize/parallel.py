"""Designs of many variables as lines across parallel axes, and how a search came to its optimum."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.optimize.designs import Designs

# More lines than that are one blot: of more designs every so many are drawn, in the order of their score.
MOST = 300


def parallel_axes(designs: Designs) -> Figure:
    """Each feasible design a line across its variables and goals, the colour its score, the best of all on top."""
    names = [*designs.names, *designs.goals]
    score, best = designs.total(), designs.chosen()
    rows = np.flatnonzero(designs.feasible)
    rows = rows[np.argsort(score[rows], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST)).astype(int))]
    columns = [designs[name] for name in names]
    ends = [(column[designs.feasible].min(), column[designs.feasible].max()) for column in columns]
    figure = style.new_figure(style.WIDTH, 4.2)
    axes = figure.add_subplot()

    def heights(values: list[float]) -> Floats:
        return np.array([(v - a) / (b - a) if b > a else 0.5 for v, (a, b) in zip(values, ends, strict=True)])

    places = np.arange(len(names))
    lines = [np.column_stack([places, heights([float(column[row]) for column in columns])]) for row in rows]
    drawn = LineCollection(lines, array=score[rows], cmap=style.COLORMAP, linewidths=0.8, alpha=0.75)
    axes.add_collection(drawn)
    winner = heights([float(designs.optimum[name][best]) for name in names])
    axes.plot(places, winner, "o-", color=style.VERMILION, linewidth=2.2, label="best", clip_on=False, zorder=4)
    for place, (low, high) in enumerate(ends):
        axes.axvline(place, color=style.INK, linewidth=0.8, zorder=3)
        axes.text(place, -0.03, f"{low:.4g}", ha="center", va="top", fontsize=8.5)
        axes.text(place, 1.03, f"{high:.4g}", ha="center", va="bottom", fontsize=8.5)
    axes.set_xlim(-0.3, len(names) - 0.7)
    axes.set_ylim(-0.02, 1.02)
    labels = [designs.label(name).replace(".", ".\N{ZERO WIDTH SPACE}") for name in names]
    axes.set_xticks(places, [_folded(label) for label in labels])
    axes.tick_params(axis="x", length=0, pad=18)
    axes.set_yticks([])
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False)
    shown = f"{len(rows)} of " if len(rows) < designs.feasible.sum() else ""
    axes.set_title(f"{shown}{int(designs.feasible.sum())} feasible designs, the best on top", loc="left", pad=20)
    bar = figure.colorbar(drawn, ax=axes, pad=0.02)
    bar.set_label("sum of the normalised goals" if len(designs.goals) > 1 else "normalised goal")
    bar.outline.set_visible(False)
    return figure


def _folded(label: str, width: int = 14) -> str:
    """A long name on two or more lines, broken after its dots and underscores."""
    lines = [""]
    for part in label.replace(".\N{ZERO WIDTH SPACE}", ".|").replace("_", "_|").replace(" ", " |").split("|"):
        if lines[-1] and len(lines[-1]) + len(part) > width:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def convergence(designs: Designs) -> Figure:
    """The best score found so far over the number of designs evaluated, a line a row of weights."""
    figure = style.new_figure(style.WIDTH, 3.6)
    axes = figure.add_subplot()
    count = np.arange(1, len(designs.table) + 1)
    many = len(designs.goals) > 1
    if many:
        for row in range(len(designs.optimum)):
            so_far = np.maximum.accumulate(np.nan_to_num(designs.score(row), nan=-np.inf))
            known = np.isfinite(so_far)
            weights = ", ".join(f"{designs.optimum[f'w_{goal}'][row]:g}" for goal in designs.goals)
            axes.step(count[known], so_far[known] / so_far[-1], where="post", label=f"({weights})")
        axes.set_ylabel("best score so far / best")
        axes.legend(title=f"weights of ({', '.join(designs.goals)})", loc="upper left", bbox_to_anchor=(1.01, 1.0),
                    title_fontsize=9, alignment="left")  # fmt: skip
    else:
        (goal,) = designs.goals
        values = np.where(designs.feasible, designs[goal], np.inf if designs.goals[goal] else -np.inf)
        so_far = (np.minimum if designs.goals[goal] else np.maximum).accumulate(values)
        known = np.isfinite(so_far)
        axes.step(count[known], so_far[known], where="post", color=style.BLUE)
        found = so_far[known]
        if (found > 0).all() and found.max() > 20 * found.min():
            axes.set_yscale("log")
        axes.set_ylabel(f"best {designs.label(goal)} so far")
    axes.set_xlabel("designs evaluated")
    axes.set_title("Convergence of the search", loc="left")
    axes.margins(x=0.01)
    return figure
