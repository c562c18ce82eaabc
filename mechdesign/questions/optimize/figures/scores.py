"""Scores and goals of the designs over their variables, and along a search."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import FuncFormatter

from mechdesign.drawing import style
from mechdesign.drawing.contours import colour_steps, round_levels
from mechdesign.drawing.marks import (
    Axis,
    Coloured,
    Dots,
    Panel,
    PanelMark,
    Picture,
    Trace,
    Words,
)
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.figures.designs import (
    FEW,
    GREY_DOTS,
    goals_apart,
    listed,
    on_front,
    outside,
    quantity_axis,
    usual,
    value_text,
    variable_axis,
)
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.optimize.judge import DesignSet
from mechdesign.questions.optimize.variables import variables_of

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


@picture(DesignsView, "CPI", "objective", order=10)
def score_picture(view: DesignsView) -> dict[str, Picture]:
    """The score of all goals, or the objective of one, over the variables."""
    name = "CPI" if len(view.designs.goals) > 1 else "objective"
    return {name: score_map(view.designs) if view.mapped else score_curves(view.designs, view.front)}


def score_curves(designs: DesignSet, front: Table | None = None) -> Picture:
    """Every design's score over each variable, and the best design at each value of it [S1, Fig. 3(a)].

    Of a single variable also the goals of that design; of a Pareto front the designs that are on it.
    """
    many, several, one = len(designs.goals) > 1, len(designs.variables) > 1, designs.goals[0]
    score = designs.cpi if many else designs.values[:, 0]
    feasible = np.flatnonzero(designs.feasible & np.isfinite(score))
    steep, smallest = not many and _steep(score[feasible]), not many and one.smallest
    near = usual(score[feasible], smallest=smallest)
    title = (
        one.name if not many else f"Composite performance index of ({', '.join(goal.name for goal in designs.goals)})"
    )
    title += " over each variable" * several
    title += "" if many else f", {'less' if one.smallest else 'more'} is better"
    cut = not (steep or near.all())
    ends = _margined(score[feasible][near]) if cut else (None, None)
    axis = Axis("index" if many and not several else "CPI") if many else quantity_axis(designs, one.name)
    axis = replace(axis, scale="log" if steep else "linear", ends=ends)
    winner, label = designs.best, "CPI" if many else axis.label
    efficient = on_front(designs, front) if front is not None else np.zeros(0, dtype=np.intp)
    panels = []
    for name, column in designs.variables.items():
        marks: list[PanelMark] = []
        if several:
            look = GREY_DOTS | {"alpha": 1.0, "markersize": 3 if len(feasible) > FEW else 5}
            marks.append(Dots(column[feasible], score[feasible], label="designs", look=look))
        if len(efficient):
            look = GREY_DOTS | {"alpha": 1.0, "color": style.BLUE, "markersize": 5}
            marks.append(Dots(column[efficient], score[efficient], label="on the front", look=look))
        runs = [feasible[run] for run in _envelope(column[feasible], score[feasible], several, smallest=smallest)]
        # There are no values between choices.
        choices = variables_of(designs.study)[name].choices is not None
        look = {"color": style.INK, "linestyle": "none" if choices else "-", "marker": "_" if choices else "",
                "markersize": 18, "markeredgewidth": 2.0, "linewidth": 1.6 if several else 2.0}  # fmt: skip
        words = "best near each value" if several else label
        marks += [Trace(column[run], score[run], label=words, look=look) for run in runs]
        best = np.concatenate(runs) if runs else np.zeros(0, dtype=np.intp)
        for k, color in zip(range(len(designs.goals)) if many and not several else (), style.PALETTE, strict=False):
            look = {"color": color, "linestyle": style.DASHES[(k + 1) % len(style.DASHES)]}
            words = f"{designs.goals[k].name}, normalised"
            marks.append(Trace(column[best], designs.shares[best, k], label=words, look=look))
        look = {"color": style.VERMILION, "markersize": 6.5, "zorder": 4}
        marks.append(Dots([column[winner]], [score[winner]], label="best", look=look))
        words = f"best: {listed(designs, {name: designs.design(winner)[name]})[0]}"
        panels.append(Panel(marks, variable_axis(designs, name), axis, aside=words))
    return Picture(title, panels, (outside(near),) * cut, 3 if len(panels) > 2 else 1, "y")


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


def score_map(designs: DesignSet) -> Picture:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    goals = [goal.name for goal in designs.goals]
    many = len(goals) > 1
    title = f"CPI over the design variables, and the best designs for weights of ({', '.join(goals)})"
    title = title if many else f"{goals[0]} over the design variables"
    name = "composite performance index CPI" if many else quantity_axis(designs, goals[0]).label
    smallest = not many and designs.goals[0].smallest
    field = _map(designs, designs.cpi if many else designs.values[:, 0], name, smallest=smallest)
    look = {"color": style.VERMILION, "markeredgecolor": "white", "markersize": 8, "clip_on": False, "zorder": 5}
    best = [
        Dots(*([column[row]] for column in designs.variables.values()),
             look=look | {"marker": MARKERS[k % len(MARKERS)]},
             label=f"{', '.join(listed(designs, designs.design(row)))}: {designs.merits(row) if many else 'best'}")
        for k, row in enumerate(dict.fromkeys(designs.winners.tolist()))
    ]  # fmt: skip
    return Picture(title, [replace(field, marks=[*field.marks, *best])])


@picture(DesignsView, "indices", order=30)
def goal_maps(view: DesignsView) -> Picture | None:
    """Each goal over two variables, side by side."""
    designs, goals = view.designs, view.designs.goals
    if not view.mapped or len(goals) < 2:
        return None
    maps = [replace(_map(designs, designs.values[:, k], "", smallest=goal.smallest),
                    title=quantity_axis(designs, goal.name).label)
            for k, goal in enumerate(goals)]  # fmt: skip
    return Picture("Each goal over the design variables", maps, across=2)


def _map(designs: DesignSet, values: Floats, name: str, *, smallest: bool) -> Panel:
    """Values over two variables, with a bar of colours of this name."""
    mark = Coloured(partial(_fill, designs=designs, values=values, smallest=smallest), bar=name)
    x, y = (variable_axis(designs, variable) for variable in designs.variables)
    return Panel([mark], x, y)


def _fill(axes: Axes, designs: DesignSet, values: Floats, *, smallest: bool) -> tuple[ScalarMappable, dict[str, Any]]:
    """Contours over two variables whose bounds may depend on each other; cells of few designs, dots of scattered.

    Also returned is at which end of the bar of colours far worse designs lie beyond it.
    """
    axes.grid(visible=False)
    inside = designs.feasible & np.isfinite(values)
    x, y, z = (column[inside] for column in (*designs.variables.values(), values))
    steps = [np.unique(np.round(v, 9)) for v in (x, y)]
    on_a_grid = len(steps[0]) * len(steps[1]) <= 4 * len(z)
    near = usual(z, smallest=smallest)
    norm: Normalize = Normalize(z[near].min(), z[near].max())
    levels = round_levels(z[near].min(), z[near].max(), MAP_LEVELS)
    options: dict[str, Any] = {"extend": "neither"}
    if _steep(z) and len(designs.goals) == 1:
        levels, norm = np.geomspace(z.min(), z.max(), MAP_LEVELS + 1), LogNorm(z.min(), z.max())
        options["format"] = FuncFormatter(lambda value, _: numeral(value, 3))
    elif not near.all():
        options["extend"] = "max" if smallest else "min"
    if not on_a_grid or len(steps[0]) < 2 or len(steps[1]) < 2 or len(z) < 4:
        order = np.argsort(designs.cpi[inside] if any(goal.smallest for goal in designs.goals) else z)
        axes.margins(0.03)
        dots = axes.scatter(x[order], y[order], c=z[order], s=14, cmap=style.COLORMAP, norm=norm, linewidths=0)
        return dots, options
    table = np.full((len(steps[1]), len(steps[0])), np.nan)
    table[tuple(np.searchsorted(step, np.round(v, 9)) for step, v in zip(steps[::-1], (y, x), strict=True))] = z
    field = np.ma.masked_invalid(table)
    axes.margins(0.02)
    if len(z) < FEWEST_OF_FIELD:
        return axes.pcolormesh(*steps, field, cmap=style.COLORMAP, norm=norm, shading="nearest"), options
    filled = axes.contourf(*steps, field, levels=levels, cmap=style.COLORMAP, norm=norm, extend=options["extend"])
    axes.contour(*steps, field, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    return filled, options


@picture(DesignsView, "designs", order=40)
def designs_picture(view: DesignsView) -> Picture | None:
    """All designs with more than two variables."""
    return parallel_axes(view.designs) if len(view.designs.variables) > 2 else None


def parallel_axes(designs: DesignSet) -> Picture:
    """Each feasible design a line across its variables and goals, the colour its score, the best of all on top."""
    others = goals_apart(designs)
    names = [*designs.variables, *(designs.goals[k].name for k in others)]
    columns = np.column_stack([*designs.variables.values(), designs.values[:, others]])
    rows = np.flatnonzero(designs.feasible)
    near = np.logical_and.reduce([usual(designs.values[rows, k], smallest=goal.smallest)
                                  for k, goal in enumerate(designs.goals)])  # fmt: skip
    rows = rows[near]
    low, high = columns[rows].min(axis=0), columns[rows].max(axis=0)
    rows = rows[np.argsort(designs.cpi[rows], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MAX_LINES)).astype(int))]
    heights = np.where(high > low, (columns - low) / np.where(high > low, high - low, 1.0), 0.5)
    places, words = np.arange(len(names)), list[PanelMark]()
    for place, (name, *ends) in enumerate(zip(names, low, high, strict=True)):
        choices = variables_of(designs.study)[name].words if place < len(designs.variables) else ()
        bottom, top = (choices[int(end)] if choices else value_text(float(end)) for end in ends)
        words += [Words(place, 0.0, bottom, (0, -4), look={"ha": "center", "va": "top"}),
                  Words(place, 1.0, top, (0, 4), look={"ha": "center", "va": "bottom"})]  # fmt: skip
    marks = [
        Coloured(partial(_lines, [np.column_stack([places, heights[row]]) for row in rows], designs.cpi[rows]),
                 bar="sum of the normalised goals" if len(designs.goals) > 1 else "normalised goal"),
        Trace(places, heights[designs.best], label="best",
              look={"color": style.VERMILION, "marker": "o", "linewidth": 2.2, "clip_on": False, "zorder": 4}),
        *(Trace([place, place], [0, 1], look={"color": style.INK, "linewidth": 0.8, "zorder": 3}) for place in places),
        *words,
    ]  # fmt: skip
    titles = [quantity_axis(designs, name).label for name in names]
    x = Axis(words=titles, ends=(-0.3, len(names) - 0.7))
    shown = f"{len(rows)} of " if len(rows) < len(near) else ""
    title = f"{shown}{len(near)} feasible designs, the best on top" + f"; {outside(near)}" * (not near.all())
    return Picture(title, [Panel(marks, x, Axis(ends=(-0.12, 1.12), numbers=False))])


def _lines(lines: list[Floats], score: Floats, axes: Axes) -> tuple[ScalarMappable, dict[str, Any]]:
    """Lines in steps of colour."""
    norm = colour_steps(round_levels(float(score.min()), float(score.max()), FEW_COLORS), *score[[0, -1]].tolist())
    drawn = LineCollection(lines, array=score, cmap=style.COLORMAP, norm=norm, linewidths=0.8)
    axes.add_collection(drawn)
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    return drawn, {}


@picture(DesignsView, "convergence", order=70)
def convergence_picture(view: DesignsView) -> Picture | None:
    """The convergence of a search."""
    searched = view.study.optimize is not None and view.study.optimize.method == "search"
    return convergence(view.designs) if searched else None


def convergence(designs: DesignSet) -> Picture:
    """The best score found so far over the number of designs evaluated, a line a row of weights."""
    count, along = np.arange(1, len(designs) + 1), Axis("designs evaluated", margin=0.01)
    if len(designs.goals) > 1:
        marks: list[PanelMark] = []
        for row, dashes in zip(designs.weights, cycle(style.DASHES), strict=False):
            so_far = np.maximum.accumulate(np.nan_to_num(designs.score(row), nan=-np.inf))
            finite, look = np.isfinite(so_far), {"linestyle": dashes, "drawstyle": "steps-post"}
            weights = ", ".join(f"{weight:g}" for weight in row)
            marks.append(Trace(count[finite], so_far[finite] / so_far[-1], label=f"({weights})", look=look))
        heading = f"weights of ({', '.join(own.name for own in designs.goals)})"
        panel = Panel(marks, along, Axis("best score so far / best"), legend="beside", heading=heading)
        return Picture("Convergence of the search", [panel])
    (goal,) = designs.goals
    values = np.where(designs.feasible, designs.values[:, 0], np.inf if goal.smallest else -np.inf)
    so_far = (np.minimum if goal.smallest else np.maximum).accumulate(values)
    finite = np.isfinite(so_far)
    best = so_far[finite]
    axis = quantity_axis(designs, goal.name)
    if (best > 0).all() and best.max() > 20 * best.min():
        axis = replace(axis, scale="log")
    look = GREY_DOTS | {"markersize": 3, "alpha": 1.0}
    steps = {"color": style.BLUE, "drawstyle": "steps-post"}
    marks = [Dots(count[designs.feasible], values[designs.feasible], label="designs", look=look),
             Trace(count[finite], best, label="best so far", look=steps)]  # fmt: skip
    return Picture("Convergence of the search", [Panel(marks, along, axis)])
