"""The Pareto front of an optimisation in pictures, and the designs of it that are marked."""

from __future__ import annotations

from itertools import combinations
from string import ascii_uppercase

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.questions.optimize.figures.designs import FEW, legend, listed, sheet
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.optimize.goals import Goal
from mechdesign.questions.optimize.judge import Designs
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import fitting
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table

_FRONT_MARKS = "so^DvPX"
_LONGEST_NAME = 22  # letters of a goal in one line along an axis of several panels
_ROW = 2.2  # inches


@picture(DesignsView, "pareto", order=50)
def pareto_figure(view: DesignsView) -> Figure | None:
    """The front, if several goals have one."""
    return front_figure(view.designs, view.front) if view.front is not None else None


def front_figure(designs: Designs, front: Table) -> Figure:
    """Every feasible design, those of the front, and the knee; a panel each pair of goals."""
    shown = pairs(designs)
    columns = 1 if style.narrow() else min(len(shown), 2)
    rows = -(-len(shown) // columns)
    low = style.narrow() or len(shown) > 1
    lines = style.line(10.0) * 2 * low
    figure, panels = sheet(
        len(shown), columns, 3.3 if len(shown) == 1 else min(_ROW, 5.6 / rows),
        f"Pareto front: {len(front)} of {int(designs.feasible.sum())} feasible designs", left=0.9 + lines,
        above=0.62, below=0.55 + lines, across=0.9 + lines, down=0.85 + lines,
    )  # fmt: skip
    for axes, pair in zip(panels, shown, strict=True):
        _front(axes, designs, front, pair)
        for axis, goal in zip((axes.xaxis, axes.yaxis), pair, strict=True):
            axis.set_label_text(_goal_label(designs, designs.goals[goal], folded=low))
    handles, labels = figure.axes[0].get_legend_handles_labels()
    labels = [style.folded(words, 9.0, style.width() - 0.6) for words in labels]
    legend(figure, handles, labels, 1 if len(labels) > 2 else fitting(labels))
    return figure


def pairs(designs: Designs) -> list[tuple[int, int]]:
    """The goals of each panel, along and up."""
    return [*combinations(range(len(designs.goals)), 2)]


def _front(axes: Axes, designs: Designs, front: Table, pair: tuple[int, int]) -> None:
    goals = [designs.goals[k] for k in pair]
    x, y = designs.values[designs.feasible][:, pair].T
    axes.plot(x, y, ".", color=style.FAINT, markersize=3 if len(x) > FEW else 5, alpha=0.6, markeredgewidth=0,
              label="feasible designs")  # fmt: skip
    along, up = (np.asarray(front[goal.name], dtype=float) for goal in goals)
    order = np.argsort(along, kind="stable")
    # Between two designs of the front nothing is known to be better than the worse of the two.
    axes.plot(along[order], up[order], "o-" if len(designs.goals) == 2 else "o", color=style.BLUE, linewidth=1.2,
              markersize=4.0 if len(front) < 200 else 2.2,
              drawstyle="steps-post" if goals[0].smallest else "steps-pre",
              label="front: no other is better in every goal")  # fmt: skip
    for (name, row), marker in zip(marked(designs, front), _FRONT_MARKS, strict=False):
        knee = name == "knee"
        words = ", ".join(listed(designs, chosen(designs, front, row)))
        axes.plot(along[row], up[row], "*" if knee else marker, color=style.VERMILION, markeredgecolor="white",
                  markersize=15 if knee else 9, linestyle="none", label=f"{name}, {words}", zorder=5,
                  clip_on=False)  # fmt: skip
    if style.narrow():
        axes.locator_params(axis="x", nbins=4)
    # Designs far worse than the front would press it into a corner.
    inside = np.ones(len(x), dtype=bool)
    for values, every, limit in ((along, x, axes.set_xlim), (up, y, axes.set_ylim)):
        low, high = float(values.min()), float(values.max())
        span = (high - low) or abs(high) or 1.0
        start, end = max(float(every.min()), low - 0.6 * span), min(float(every.max()), high + 0.6 * span)
        limit(start - 0.04 * span, end + 0.04 * span)
        inside &= (start - 0.04 * span <= every) & (every <= end + 0.04 * span)
    if outside := int(np.sum(~inside)):
        axes.set_title(f"{outside} worse designs outside", loc="right", fontsize=8.5)


def _goal_label(designs: Designs, goal: Goal, *, folded: bool) -> str:
    """Name, unit and sense of a goal, in a line each where they are `folded`; a long name is broken after its dot."""
    name = goal.name.replace(".", ".\n", 1) if folded and len(goal.name) > _LONGEST_NAME else goal.name
    words = style.axis_label(name, designs.unit_of(goal.name))
    sense = f"{'less' if goal.smallest else 'more'} is better"
    return (",\n" if folded else ", ").join((words, sense))


@picture(DesignsView, "hypervolume", order=60)
def growth_figure(view: DesignsView) -> Figure | None:
    """Hypervolume of the front over the number of designs, and its growth by the last tenth of them."""
    if view.front is None:
        return None
    growth = view.result.tables["hypervolume"]
    words = f"Growth of the front: {100 * growth['growth'][-1]:.2g} % by the last tenth of the designs"
    figure, (axes,) = sheet(1, 1, 2.2, words)
    axes.plot(growth["designs"], growth["hypervolume"], "o-", color=style.BLUE, markersize=4)
    axes.set_xlabel("designs evaluated")
    axes.set_ylabel("hypervolume of the front")
    axes.margins(x=0.02)
    return figure


def marked(designs: Designs, front: Table) -> list[tuple[str, int]]:
    """Designs of a front that are shown, and their rows: the best of each goal, and the knee between them."""
    marks: dict[int, str] = {}
    for letter, goal in zip(ascii_uppercase, designs.goals, strict=False):
        best = np.argmin if goal.smallest else np.argmax
        marks.setdefault(int(best(front[goal.name])), f"{letter}: best {goal.name}")
    marks.setdefault(int(np.argmax(front["knee"])), "knee")
    # Along the first goal, as the front runs.
    return [(marks[row], row) for row in sorted(marks)]


def chosen(designs: Designs, front: Table, row: int) -> dict[str, float | str]:
    return {name: front[name][row].item() for name in designs.variables}


def described(designs: Designs, front: Table, name: str, row: int) -> str:
    """Lines that name a design of a front, its variables and its goals; none is broken at a space."""
    lines = listed(designs, chosen(designs, front, row))
    lines += [f"{goal.column} = {front[goal.name][row]:.3g} {style.printed(designs.unit_of(goal.name))}"
              for goal in designs.goals]  # fmt: skip
    return "\n".join([name, *(line.strip().replace(" ", "\N{NO-BREAK SPACE}") for line in lines)])
