"""Scores and goals of the designs over their variables, and along a search."""

from __future__ import annotations

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from matplotlib.tri import Triangulation

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.optimize.figures.designs import folded, head, label, listed, tick, value_text
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.optimize.judge import Designs
from mechdesign.questions.optimize.variables import variables_of
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import fitting
from mechdesign.report.figures.pictures import picture

MAP_LEVELS = 14
MARKERS = "osD^vP*X<>"
# More lines than this merge into a blot: of more designs some are drawn, evenly spread in the order of their score.
MAX_LINES = 300
# Scattered designs: the best in each of so many steps of a variable is taken. A grid has at most so many values.
ENVELOPE_STEPS = 40
MAX_VALUES = 200
# Fewer designs of a grid are drawn as cells, without interpolation.
FEWEST_OF_FIELD = 1000
_LETTER = 0.08  # inches


@picture(DesignsView, "CPI", "objective", order=10)
def score_figure(view: DesignsView) -> dict[str, Figure]:
    """The score of all goals, or the objective of one, over the variables."""
    name = "CPI" if len(view.designs.goals) > 1 else "objective"
    return {name: score_surface(view.designs) if view.mapped else score_curves(view.designs)}


def score_curves(designs: Designs) -> Figure:
    """Every design's score over each variable, and the best design near each value of it [S1, Fig. 3(a)].

    Of a single variable also the goals of that design.
    """
    winner = designs.best
    many, count, one = len(designs.goals) > 1, len(designs.variables), designs.goals[0]
    across = min(count, 3) if count > 2 and not style.narrow() else 1
    down = -(-count // across)
    figure = style.new_figure(0.9 + (2.9 if across == 1 else 2.5) * down)
    score = designs.cpi if many else designs.values[:, 0]
    score_label = "CPI" if many else label(designs, one.name)
    feasible = np.flatnonzero(designs.feasible & np.isfinite(score))
    steep = not many and _steep(score[feasible])
    for number, (name, column) in enumerate(designs.variables.items()):
        axes = figure.add_subplot(down, across, number + 1)
        best = feasible[_envelope(column[feasible], score[feasible], count > 1, smallest=not many and one.smallest)]
        if count > 1:
            axes.plot(column[feasible], score[feasible], ".", color=style.FAINT, markersize=3, markeredgewidth=0,
                      label="designs")  # fmt: skip
        axes.locator_params(axis="x", nbins=6)
        chosen_only = tick(axes.xaxis, designs, name)
        # There are no values between choices.
        axes.plot(column[best], score[best], "_" if chosen_only else "-", color=style.INK, markersize=18,
                  markeredgewidth=2.0, linewidth=1.6 if count > 1 else 2.0,
                  label="best near each value" if count > 1 else score_label)  # fmt: skip
        for k, color in zip(range(len(designs.goals)) if many and count == 1 else (), style.PALETTE, strict=False):
            dashes = style.DASHES[(k + 1) % len(style.DASHES)]
            axes.plot(column[best], designs.share(k)[best], color=color, linestyle=dashes,
                      label=f"{designs.goals[k].name}, normalised")  # fmt: skip
        axes.plot(column[winner], score[winner], "o", color=style.VERMILION, markersize=6.5, label="best", zorder=4)
        words = f"best: {listed({name: designs.design(winner)[name]})}"
        axes.set_title(words, loc="right", fontsize=9, color=style.VERMILION)
        axes.set_xlabel(label(designs, name))
        axes.set_ylabel("" if number % across else "index" if many and count == 1 else folded(score_label))
        axes.margins(x=0.2 if chosen_only else 0.02)
        if steep:
            axes.set_yscale("log")
    among = "" if count == 1 else " over each variable"
    better = "" if many else f", {'less' if one.smallest else 'more'} is better"
    what = f"Composite performance index of ({', '.join(goal.name for goal in designs.goals)})" if many else one.name
    head(figure, f"{what}{among}{better}")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=fitting(labels) if style.narrow() else 5)
    return figure


def _envelope(along: Floats, score: Floats, several: bool, *, smallest: bool) -> Ints:
    """The best of the designs at each value along a variable, in order.

    Of `several` variables those that are scattered have each a value of its own: the best in each of some steps.
    """
    values, place = np.unique(along, return_inverse=True)
    if several and (len(values) > MAX_VALUES or 2 * len(values) > len(along) > ENVELOPE_STEPS):
        steps = (along - values[0]) / (values[-1] - values[0]) * ENVELOPE_STEPS
        place = np.minimum(steps.astype(np.intp), ENVELOPE_STEPS - 1)
    order = np.lexsort([score if smallest else -score, place])
    return np.asarray(order[np.unique(place[order], return_index=True)[1]], dtype=np.intp)


def _steep(values: Floats) -> bool:
    """Whether values differ so much that only a logarithmic scale separates them."""
    finite = values[np.isfinite(values)]
    return bool((finite > 0).all() and finite.max() > 30 * finite.min())


def score_surface(designs: Designs) -> Figure:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    goals = [goal.name for goal in designs.goals]
    many = len(goals) > 1
    figure = style.new_figure(5.2)
    axes = figure.add_subplot()
    filled = _fill(axes, designs, designs.cpi if many else designs.values[:, 0])
    what = "composite performance index CPI" if many else label(designs, goals[0])
    digits = FuncFormatter(lambda value, _: f"{value:.3g}")
    style.color_bar(figure, filled, what, ax=axes, pad=0.02, format=digits).minorticks_off()
    shown = [*dict.fromkeys(designs.winners.tolist())]
    for k, row in enumerate(shown):
        merits = designs.merits(row) if many else "best"
        words = f"{', '.join(map(value_text, designs.design(row).values()))}: {merits}"
        words = style.folded(words, 9.0, style.width() - 0.6)
        place = [column[row] for column in designs.variables.values()]
        axes.plot(*place, MARKERS[k % len(MARKERS)], color=style.VERMILION, markeredgecolor="white", markersize=8,
                  linestyle="none", label=words, clip_on=False, zorder=5)  # fmt: skip
    title = f"CPI over the design variables, and the best designs for weights of ({', '.join(goals)})"
    title = title if many else f"{goals[0]} over the design variables"
    axes.set_title(style.folded(title, 11.0, 0.78 * style.width()), loc="left")
    handles, labels = axes.get_legend_handles_labels()
    columns = fitting(labels) if style.narrow() else 2 if len(shown) > 3 else 1
    figure.legend(handles, labels, loc="outside lower left", ncols=columns)
    return figure


@picture(DesignsView, "indices", order=30)
def goal_maps(view: DesignsView) -> Figure | None:
    """Each goal over two variables, side by side."""
    designs, goals = view.designs, view.designs.goals
    if not view.mapped or len(goals) < 2:
        return None
    columns = 1 if style.narrow() else min(len(goals), 3)
    rows = -(-len(goals) // columns)
    figure = style.new_figure(0.3 + 2.7 * rows)
    for number, goal in enumerate(goals):
        axes = figure.add_subplot(rows, columns, number + 1)
        filled = _fill(axes, designs, designs.values[:, number])
        style.color_bar(figure, filled, ax=axes, location="bottom", pad=0.02).ax.locator_params(nbins=4)
        axes.set_title(label(designs, goal.name), loc="left")
        if number % columns:
            axes.set_ylabel("")
    return figure


def _fill(axes: Axes, designs: Designs, values: Floats) -> ScalarMappable:
    """Contours over two variables whose bounds may depend on each other; cells of few designs, dots of scattered."""
    across, up = designs.variables
    axes.set_xlabel(label(designs, across))
    axes.set_ylabel(label(designs, up))
    tick(axes.xaxis, designs, across)
    tick(axes.yaxis, designs, up)
    axes.grid(visible=False)
    inside = designs.feasible & np.isfinite(values)
    x, y, z = (column[inside] for column in (*designs.variables.values(), values))
    steps = [np.unique(np.round(v, 9)) for v in (x, y)]
    on_a_grid = len(steps[0]) * len(steps[1]) <= 4 * len(z)
    if not on_a_grid or len(steps[0]) < 2 or len(steps[1]) < 2 or len(z) < 4:
        order = np.argsort(designs.cpi[inside] if any(goal.smallest for goal in designs.goals) else z)
        axes.margins(0.03)
        return axes.scatter(x[order], y[order], c=z[order], s=14, cmap=style.COLORMAP, linewidths=0)
    levels, norm = style.levels(z.min(), z.max(), MAP_LEVELS), None
    if _steep(z) and len(designs.goals) == 1:
        levels, norm = np.geomspace(z.min(), z.max(), MAP_LEVELS + 1), LogNorm(z.min(), z.max())
    if len(z) < FEWEST_OF_FIELD:
        half = np.array([np.median(np.diff(step)) / 2 for step in steps])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
        cells = PolyCollection(np.column_stack([x, y])[:, None] + corners, array=z, cmap=style.COLORMAP, norm=norm)
        axes.add_collection(cells)
        axes.margins(0.02)
        return cells
    # In steps of the grid triangles are well shaped; those that span missing designs are left out.
    scaled = [(v - v.min()) / np.median(np.diff(step)) for v, step in zip((x, y), steps, strict=True)]
    mesh = Triangulation(*scaled)
    corners = np.stack([mesh.x[mesh.triangles], mesh.y[mesh.triangles]])
    mesh = Triangulation(x, y, mesh.triangles, mask=(np.ptp(corners, axis=2) > 2.01).any(axis=0))
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP, norm=norm)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled


@picture(DesignsView, "designs", order=40)
def designs_figure(view: DesignsView) -> Figure | None:
    """All designs with more than two variables."""
    return parallel_axes(view.designs) if len(view.designs.variables) > 2 else None


def parallel_axes(designs: Designs) -> Figure:
    """Each feasible design a line across its variables and goals, the colour its score, the best of all on top."""
    names = [*designs.variables, *(goal.name for goal in designs.goals)]
    rows = np.flatnonzero(designs.feasible)
    rows = rows[np.argsort(designs.cpi[rows], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MAX_LINES)).astype(int))]
    columns = np.column_stack([*designs.variables.values(), designs.values])
    low, high = columns[designs.feasible].min(axis=0), columns[designs.feasible].max(axis=0)
    heights = np.where(high > low, (columns - low) / np.where(high > low, high - low, 1.0), 0.5)
    upright, titles = style.narrow(), [label(designs, name) for name in names]
    figure = style.new_figure(4.2 + upright * _LETTER * max(map(len, titles)))
    axes = figure.add_subplot()
    places = np.arange(len(names))
    lines = [np.column_stack([places, heights[row]]) for row in rows]
    drawn = LineCollection(lines, array=designs.cpi[rows], cmap=style.COLORMAP, linewidths=0.8, alpha=0.75)
    axes.add_collection(drawn)
    axes.plot(places, heights[designs.best], "o-", color=style.VERMILION, linewidth=2.2, label="best", clip_on=False,
              zorder=4)  # fmt: skip
    size = 7.0 if upright else 8.5
    for place, (name, *ends) in enumerate(zip(names, low, high, strict=True)):
        words = variables_of(designs.study)[name].words if place < len(designs.variables) else ()
        bottom, top = (words[int(end)] if words else f"{end:.4g}" for end in ends)
        axes.axvline(place, color=style.INK, linewidth=0.8, zorder=3)
        axes.text(place, -0.03, bottom, ha="center", va="top", fontsize=size)
        axes.text(place, 1.03, top, ha="center", va="bottom", fontsize=size)
    axes.set_xlim(-0.3, len(names) - 0.7)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xticks(places, titles if upright else map(folded, titles), rotation=90 if upright else 0)
    axes.tick_params(axis="x", length=0, pad=18)
    axes.set_yticks([])
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False)
    shown = f"{len(rows)} of " if len(rows) < designs.feasible.sum() else ""
    axes.set_title(f"{shown}{int(designs.feasible.sum())} feasible designs, the best on top", loc="left", pad=20)
    what = "sum of the normalised goals" if len(designs.goals) > 1 else "normalised goal"
    style.color_bar(figure, drawn, what, ax=axes, pad=0.02)
    return figure


@picture(DesignsView, "convergence", order=70)
def convergence_figure(view: DesignsView) -> Figure | None:
    """The convergence of a search."""
    searched = view.study.optimize is not None and view.study.optimize.method == "search"
    return convergence(view.designs) if searched else None


def convergence(designs: Designs) -> Figure:
    """The best score found so far over the number of designs evaluated, a line a row of weights."""
    figure = style.new_figure(3.6)
    axes = figure.add_subplot()
    count = np.arange(1, len(designs) + 1)
    if len(designs.goals) > 1:
        for row, dashes in zip(designs.weights, cycle(style.DASHES), strict=False):
            so_far = np.maximum.accumulate(np.nan_to_num(designs.score(row), nan=-np.inf))
            known = np.isfinite(so_far)
            weights = ", ".join(f"{weight:g}" for weight in row)
            axes.step(count[known], so_far[known] / so_far[-1], where="post", label=f"({weights})", linestyle=dashes)
        axes.set_ylabel("best score so far / best")
        goals = ", ".join(each.name for each in designs.goals)
        axes.legend(title=f"weights of ({goals})", loc="upper left", bbox_to_anchor=(1.01, 1.0), title_fontsize=9,
                    alignment="left")  # fmt: skip
    else:
        (goal,) = designs.goals
        values = np.where(designs.feasible, designs.values[:, 0], np.inf if goal.smallest else -np.inf)
        so_far = (np.minimum if goal.smallest else np.maximum).accumulate(values)
        known = np.isfinite(so_far)
        axes.plot(count[designs.feasible], values[designs.feasible], ".", color=style.FAINT, markersize=3,
                  markeredgewidth=0, label="designs")  # fmt: skip
        axes.step(count[known], so_far[known], where="post", color=style.BLUE, label="best so far")
        axes.legend(loc="upper right", frameon=True, framealpha=0.85, edgecolor="none")
        best_values = so_far[known]
        if (best_values > 0).all() and best_values.max() > 20 * best_values.min():
            axes.set_yscale("log")
        axes.set_ylabel(folded(label(designs, goal.name)))
    axes.set_xlabel("designs evaluated")
    axes.set_title("Convergence of the search", loc="left")
    axes.margins(x=0.01)
    return figure
