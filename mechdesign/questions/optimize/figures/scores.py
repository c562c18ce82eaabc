"""Scores and goals of the designs over their variables, and along a search."""

from __future__ import annotations

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from matplotlib.tri import Triangulation

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.optimize.figures.designs import (
    FEW,
    enlarge_dots,
    folded,
    label,
    legend,
    listed,
    on_front,
    outside,
    sheet,
    tick,
    usual,
    value_text,
)
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.optimize.judge import Designs
from mechdesign.questions.optimize.variables import variables_of
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import fitting
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table

MAP_LEVELS = 14
FEW_COLORS = 9
MARKERS = "osD^vP*X<>"
# More lines than this merge into a blot: of more designs some are drawn, evenly spread in the order of their score.
MAX_LINES = 300
# Scattered designs: the best in each of so many steps of a variable is taken. A grid has at most so many values.
ENVELOPE_STEPS = 40
MAX_VALUES = 200
ENOUGH = 25  # scattered designs in a step
_MARGIN = 0.05
# Fewer designs of a grid are drawn as cells, without interpolation.
FEWEST_OF_FIELD = 1000
_LETTER = 0.08  # inches
_NUMBERS = 0.65  # inches of the numbers of an axis
_BAR = 0.95  # inches of a bar of colours with its name


@picture(DesignsView, "CPI", "objective", order=10)
def score_figure(view: DesignsView) -> dict[str, Figure]:
    """The score of all goals, or the objective of one, over the variables."""
    name = "CPI" if len(view.designs.goals) > 1 else "objective"
    return {name: score_surface(view.designs) if view.mapped else score_curves(view.designs, view.front)}


def score_curves(designs: Designs, front: Table | None = None) -> Figure:
    """Every design's score over each variable, and the best design at each value of it [S1, Fig. 3(a)].

    Of a single variable also the goals of that design; of a Pareto front the designs that are on it.
    """
    winner = designs.best
    many, count, one = len(designs.goals) > 1, len(designs.variables), designs.goals[0]
    across = min(count, 3) if count > 2 and not style.narrow() else 1
    down = -(-count // across)
    score = designs.cpi if many else designs.values[:, 0]
    score_label = "CPI" if many else label(designs, one.name)
    feasible = np.flatnonzero(designs.feasible & np.isfinite(score))
    steep, smallest = not many and _steep(score[feasible]), not many and one.smallest
    near = usual(score[feasible], smallest=smallest)
    efficient = on_front(designs, front) if front is not None else np.zeros(0, dtype=np.intp)
    among = "" if count == 1 else " over each variable"
    better = "" if many else f", {'less' if one.smallest else 'more'} is better"
    if not (steep or near.all()):
        better += f"; {outside(near)}"
    axis = f"Composite performance index of ({', '.join(goal.name for goal in designs.goals)})" if many else one.name
    figure, panels = sheet(
        count, across, (min(2.2, 5.2 / down) if across == 1 else 1.75), f"{axis}{among}{better}",
        left=_NUMBERS + style.line(10.0) * (1 + folded(score_label).count("\n")), above=0.65,
        across=0.3, down=0.85, sharey=True,
    )  # fmt: skip
    for number, (axes, (name, column)) in enumerate(zip(panels, designs.variables.items(), strict=True)):
        runs = [feasible[run] for run in _envelope(column[feasible], score[feasible], count > 1, smallest=smallest)]
        if count > 1:
            size = 3 if len(feasible) > FEW else 5
            axes.plot(column[feasible], score[feasible], ".", color=style.FAINT, markersize=size, markeredgewidth=0,
                      label="designs")  # fmt: skip
        if len(efficient):
            axes.plot(column[efficient], score[efficient], ".", color=style.BLUE, markersize=5, markeredgewidth=0,
                      label="on the front")  # fmt: skip
        axes.locator_params(axis="x", nbins=6)
        chosen_only = tick(axes.xaxis, designs, name)
        best = np.concatenate(runs) if runs else np.zeros(0, dtype=np.intp)
        # There are no values between choices.
        for place, run in enumerate(runs):
            words = score_label if count == 1 else "best near each value"
            axes.plot(
                column[run],
                score[run],
                "_" if chosen_only else "-",
                color=style.INK,
                markersize=18,
                markeredgewidth=2.0,
                linewidth=1.6 if count > 1 else 2.0,
                label="" if place else words,
            )
        for k, color in zip(range(len(designs.goals)) if many and count == 1 else (), style.PALETTE, strict=False):
            dashes = style.DASHES[(k + 1) % len(style.DASHES)]
            axes.plot(column[best], designs.share(k)[best], color=color, linestyle=dashes,
                      label=f"{designs.goals[k].name}, normalised")  # fmt: skip
        axes.plot(column[winner], score[winner], "o", color=style.VERMILION, markersize=6.5, label="best", zorder=4)
        words = f"best: {listed(designs, {name: designs.design(winner)[name]})[0]}"
        axes.set_title(words, loc="right", fontsize=9, color=style.VERMILION)
        axes.set_xlabel(label(designs, name))
        axes.set_ylabel("" if number % across else "index" if many and count == 1 else folded(score_label))
        axes.margins(x=0.2 if chosen_only else 0.02)
        if steep:
            axes.set_yscale("log")
        elif not near.all():
            axes.set_ylim(*_margined(score[feasible][near]))
    handles, labels = figure.axes[0].get_legend_handles_labels()
    legend(figure, handles, labels, fitting(labels) if style.narrow() else 5)
    return figure


def _envelope(along: Floats, score: Floats, several: bool, *, smallest: bool) -> list[Ints]:
    """The best of the designs at each value along a variable, in runs of neighbouring values.

    Of `several` variables those that are scattered have each a value of its own: the best in each of some steps, where
    it holds so many designs that its best tells of the step rather than of chance.
    """
    values, place = np.unique(along, return_inverse=True)
    if several and (len(values) > MAX_VALUES or 2 * len(values) > len(along) > ENVELOPE_STEPS):
        steps = (along - values[0]) / (values[-1] - values[0]) * ENVELOPE_STEPS
        place = np.minimum(steps.astype(np.intp), ENVELOPE_STEPS - 1)
        full = np.bincount(place, minlength=ENVELOPE_STEPS) >= ENOUGH
        full &= 2 * full.sum() > len(full)
    else:
        full = np.ones(len(values), dtype=bool)
    order = np.lexsort([score if smallest else -score, place])
    first = order[np.unique(place[order], return_index=True)[1]]
    first = first[full[place[first]]]
    runs = np.split(first, np.flatnonzero(np.diff(place[first]) > 1) + 1)
    return [run.astype(np.intp) for run in runs if len(run)]


def _margined(values: Floats) -> tuple[float, float]:
    """Ends of an axis that shows values."""
    low, high = float(values.min()), float(values.max())
    return low - _MARGIN * (high - low), high + _MARGIN * (high - low)


def _steep(values: Floats) -> bool:
    """Whether values differ so much that only a logarithmic scale separates them."""
    finite = values[np.isfinite(values)]
    return bool((finite > 0).all() and finite.max() > 30 * finite.min())


def score_surface(designs: Designs) -> Figure:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    goals = [goal.name for goal in designs.goals]
    many = len(goals) > 1
    title = f"CPI over the design variables, and the best designs for weights of ({', '.join(goals)})"
    title = title if many else f"{goals[0]} over the design variables"
    figure, (axes,) = sheet(1, 1, 3.6, title, right=_BAR + 0.1)
    smallest = not many and designs.goals[0].smallest
    filled, extend = _fill(axes, designs, designs.cpi if many else designs.values[:, 0], smallest=smallest)
    axis = "composite performance index CPI" if many else label(designs, goals[0])
    digits = FuncFormatter(lambda value, _: f"{value:.3g}")
    bar = axes.inset_axes((1.02, 0, 0.03, 1))
    style.color_bar(figure, filled, axis, cax=bar, format=digits, extend=extend).minorticks_off()
    shown = [*dict.fromkeys(designs.winners.tolist())]
    for k, row in enumerate(shown):
        merits = designs.merits(row) if many else "best"
        words = f"{', '.join(listed(designs, designs.design(row)))}: {merits}"
        words = style.folded(words, 9.0, style.width() - 0.6)
        place = [column[row] for column in designs.variables.values()]
        axes.plot(*place, MARKERS[k % len(MARKERS)], color=style.VERMILION, markeredgecolor="white", markersize=8,
                  linestyle="none", label=words, clip_on=False, zorder=5)  # fmt: skip
    handles, labels = axes.get_legend_handles_labels()
    columns = fitting(labels) if style.narrow() else 2 if len(shown) > 3 else 1
    legend(figure, handles, labels, columns)
    return figure


@picture(DesignsView, "indices", order=30)
def goal_maps(view: DesignsView) -> Figure | None:
    """Each goal over two variables, side by side."""
    designs, goals = view.designs, view.designs.goals
    if not view.mapped or len(goals) < 2:
        return None
    columns = 1 if style.narrow() else min(len(goals), 3)
    figure, panels = sheet(len(goals), columns, 1.5, "Each goal over the design variables", above=0.7, below=1.2,
                           across=0.45, down=1.5)  # fmt: skip
    for number, (axes, goal) in enumerate(zip(panels, goals, strict=True)):
        filled, extend = _fill(axes, designs, designs.values[:, number], smallest=goal.smallest)
        place = axes.inset_axes((0, -0.5, 1, 0.06))
        style.color_bar(figure, filled, cax=place, orientation="horizontal", extend=extend)
        place.locator_params(nbins=4)
        axes.set_title(label(designs, goal.name), loc="left")
        if number % columns:
            axes.set_ylabel("")
    return figure


def _fill(axes: Axes, designs: Designs, values: Floats, *, smallest: bool) -> tuple[ScalarMappable, str]:
    """Contours over two variables whose bounds may depend on each other; cells of few designs, dots of scattered.

    Also returned is at which end of the bar of colours far worse designs lie beyond it.
    """
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
    near = usual(z, smallest=smallest)
    norm: Normalize = Normalize(z[near].min(), z[near].max())
    levels, extend = style.levels(z[near].min(), z[near].max(), MAP_LEVELS), "neither"
    if _steep(z) and len(designs.goals) == 1:
        levels, norm = np.geomspace(z.min(), z.max(), MAP_LEVELS + 1), LogNorm(z.min(), z.max())
    elif not near.all():
        extend = "max" if smallest else "min"
    if not on_a_grid or len(steps[0]) < 2 or len(steps[1]) < 2 or len(z) < 4:
        order = np.argsort(designs.cpi[inside] if any(goal.smallest for goal in designs.goals) else z)
        axes.margins(0.03)
        dots = axes.scatter(x[order], y[order], c=z[order], s=14, cmap=style.COLORMAP, norm=norm, linewidths=0)
        return dots, extend
    if len(z) < FEWEST_OF_FIELD:
        half = np.array([np.median(np.diff(step)) / 2 for step in steps])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
        cells = PolyCollection(np.column_stack([x, y])[:, None] + corners, array=z, cmap=style.COLORMAP, norm=norm)
        axes.add_collection(cells)
        axes.margins(0.02)
        return cells, extend
    # In steps of the grid triangles are well shaped; those that span missing designs are left out.
    scaled = [(v - v.min()) / np.median(np.diff(step)) for v, step in zip((x, y), steps, strict=True)]
    mesh = Triangulation(*scaled)
    corners = np.stack([mesh.x[mesh.triangles], mesh.y[mesh.triangles]])
    mesh = Triangulation(x, y, mesh.triangles, mask=(np.ptp(corners, axis=2) > 2.01).any(axis=0))
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP, norm=norm, extend=extend)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled, extend


@picture(DesignsView, "designs", order=40)
def designs_figure(view: DesignsView) -> Figure | None:
    """All designs with more than two variables."""
    return parallel_axes(view.designs) if len(view.designs.variables) > 2 else None


def parallel_axes(designs: Designs) -> Figure:
    """Each feasible design a line across its variables and goals, the colour its score, the best of all on top."""
    names = [*designs.variables, *(goal.name for goal in designs.goals)]
    columns = np.column_stack([*designs.variables.values(), designs.values])
    rows = np.flatnonzero(designs.feasible)
    near = np.logical_and.reduce([usual(designs.values[rows, k], smallest=goal.smallest)
                                  for k, goal in enumerate(designs.goals)])  # fmt: skip
    rows = rows[near]
    low, high = columns[rows].min(axis=0), columns[rows].max(axis=0)
    rows = rows[np.argsort(designs.cpi[rows], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MAX_LINES)).astype(int))]
    heights = np.where(high > low, (columns - low) / np.where(high > low, high - low, 1.0), 0.5)
    upright, titles = style.narrow(), [label(designs, name) for name in names]
    shown = f"{min(len(rows), MAX_LINES)} of " if min(len(rows), MAX_LINES) < len(near) else ""
    heading = f"{shown}{len(near)} feasible designs, the best on top" + f"; {outside(near)}" * (not near.all())
    lines_below = max(map(len, titles)) * _LETTER if upright else style.line(9.0) * 3
    figure, (axes,) = sheet(1, 1, 2.9, heading, left=0.2, right=_BAR, above=0.65, below=0.4 + lines_below)
    places = np.arange(len(names))
    lines = [np.column_stack([places, heights[row]]) for row in rows]
    score = designs.cpi[rows]
    norm = style.steps(style.levels(float(score.min()), float(score.max()), FEW_COLORS), *score[[0, -1]].tolist())
    drawn = LineCollection(lines, array=score, cmap=style.COLORMAP, norm=norm, linewidths=0.8)
    axes.add_collection(drawn)
    axes.plot(places, heights[designs.best], "o-", color=style.VERMILION, linewidth=2.2, label="best", clip_on=False,
              zorder=4)  # fmt: skip
    size = 7.0 if upright else 8.5
    for place, (name, *ends) in enumerate(zip(names, low, high, strict=True)):
        words = variables_of(designs.study)[name].words if place < len(designs.variables) else ()
        bottom, top = (words[int(end)] if words else value_text(float(end)) for end in ends)
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
    axis = "sum of the normalised goals" if len(designs.goals) > 1 else "normalised goal"
    style.color_bar(figure, drawn, axis, cax=axes.inset_axes((1.01, 0, 0.03, 1)))
    return figure


@picture(DesignsView, "convergence", order=70)
def convergence_figure(view: DesignsView) -> Figure | None:
    """The convergence of a search."""
    searched = view.study.optimize is not None and view.study.optimize.method == "search"
    return convergence(view.designs) if searched else None


def convergence(designs: Designs) -> Figure:
    """The best score found so far over the number of designs evaluated, a line a row of weights."""
    beside = 2.2 if len(designs.goals) > 1 and not style.narrow() else 0.2
    axis = "" if len(designs.goals) > 1 else folded(label(designs, designs.goals[0].name))
    left = _NUMBERS + style.line(10.0) * (1 + axis.count("\n"))
    figure, (axes,) = sheet(1, 1, 2.6, "Convergence of the search", left=left, right=beside)
    count = np.arange(1, len(designs) + 1)
    if len(designs.goals) > 1:
        for row, dashes in zip(designs.weights, cycle(style.DASHES), strict=False):
            so_far = np.maximum.accumulate(np.nan_to_num(designs.score(row), nan=-np.inf))
            finite = np.isfinite(so_far)
            weights = ", ".join(f"{weight:g}" for weight in row)
            axes.step(count[finite], so_far[finite] / so_far[-1], where="post", label=f"({weights})", linestyle=dashes)
        axes.set_ylabel("best score so far / best")
        goals = ", ".join(own.name for own in designs.goals)
        place = {"loc": "lower right"} if style.narrow() else {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
        axes.legend(title=style.folded(f"weights of ({goals})", 9.0, 2.0), title_fontsize=9, alignment="left", **place)
    else:
        (goal,) = designs.goals
        values = np.where(designs.feasible, designs.values[:, 0], np.inf if goal.smallest else -np.inf)
        so_far = (np.minimum if goal.smallest else np.maximum).accumulate(values)
        finite = np.isfinite(so_far)
        axes.plot(count[designs.feasible], values[designs.feasible], ".", color=style.FAINT, markersize=3,
                  markeredgewidth=0, label="designs")  # fmt: skip
        axes.step(count[finite], so_far[finite], where="post", color=style.BLUE, label="best so far")
        enlarge_dots(axes.legend(loc="upper right", frameon=True, framealpha=0.85, edgecolor="none"))
        best_values = so_far[finite]
        if (best_values > 0).all() and best_values.max() > 20 * best_values.min():
            axes.set_yscale("log")
        axes.set_ylabel(axis)
    axes.set_xlabel("designs evaluated")
    axes.margins(x=0.01)
    return figure
