"""The Pareto front of an optimisation in pictures, and the designs of it that are marked."""

from __future__ import annotations

from itertools import combinations
from string import ascii_uppercase

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.questions.optimize.figures.designs import head, label, listed, value_text
from mechdesign.questions.optimize.judge import Designs
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import fitting
from mechdesign.results import Table

_FRONT_MARKS = "so^DvPX"


def front_figure(designs: Designs, front: Table) -> Figure:
    """Every feasible design, those of the front, and the knee; a panel each pair of goals."""
    pairs = list(combinations(range(len(designs.goals)), 2))
    columns = 1 if style.narrow() else min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    figure = style.new_figure(4.8 if len(pairs) == 1 else 0.8 + 2.9 * rows)
    for number, pair in enumerate(pairs):
        _front(figure.add_subplot(rows, columns, number + 1), designs, front, pair)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    labels = [style.folded(words, 9.0, style.width() - 0.6) for words in labels]
    figure.legend(handles, labels, loc="outside lower left", ncols=1 if len(labels) > 2 else fitting(labels))
    number = int(designs.feasible.sum())
    head(figure, f"Pareto front: {len(front)} of {number} feasible designs")
    return figure


def _front(axes: Axes, designs: Designs, front: Table, pair: tuple[int, int]) -> None:
    goals = [designs.goals[k] for k in pair]
    x, y = designs.values[designs.feasible][:, pair].T
    axes.plot(x, y, ".", color=style.FAINT, markersize=3, alpha=0.5, markeredgewidth=0, label="feasible designs")
    along, up = (np.asarray(front[goal.name], dtype=float) for goal in goals)
    order = np.argsort(along, kind="stable")
    axes.plot(along[order], up[order], "o-" if len(designs.goals) == 2 else "o", color=style.BLUE, linewidth=1.2,
              markersize=4.0 if len(front) < 200 else 2.2,
              label="front: no other is better in every goal")  # fmt: skip
    for (name, row), marker in zip(marked(designs, front), _FRONT_MARKS, strict=False):
        knee = name == "knee"
        words = listed(chosen(designs, front, row))
        axes.plot(along[row], up[row], "*" if knee else marker, color=style.VERMILION, markeredgecolor="white",
                  markersize=15 if knee else 9, linestyle="none", label=f"{name}, {words}", zorder=5,
                  clip_on=False)  # fmt: skip
    across, upwards = (f"{label(designs, g.name)}, {'less' if g.smallest else 'more'} is better" for g in goals)
    axes.set_xlabel(across)
    axes.set_ylabel(style.folded(upwards, 10.0, 2.8) if style.narrow() else upwards)
    if style.narrow():
        axes.locator_params(axis="x", nbins=4)
    # Designs far worse than the front would press it into a corner.
    for values, every, limit in ((along, x, axes.set_xlim), (up, y, axes.set_ylim)):
        low, high = float(values.min()), float(values.max())
        span = (high - low) or abs(high) or 1.0
        limit(max(float(every.min()), low - 0.6 * span) - 0.04 * span,
              min(float(every.max()), high + 0.6 * span) + 0.04 * span)  # fmt: skip


def growth_figure(growth: Table) -> Figure:
    """Hypervolume of the front over the number of designs, and its growth by the last tenth of them."""
    figure = style.new_figure(3.2)
    axes = figure.add_subplot()
    axes.plot(growth["designs"], growth["hypervolume"], "o-", color=style.BLUE, markersize=4)
    axes.set_xlabel("designs evaluated")
    axes.set_ylabel("hypervolume of the front")
    axes.set_title(
        f"Growth of the front: {100 * growth['growth'][-1]:.2g} % by the last tenth of the designs", loc="left"
    )
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
    lines = [f"{variable} = {value_text(value)}" for variable, value in chosen(designs, front, row).items()]
    lines += [f"{goal.column} = {front[goal.name][row]:.3g} {designs.unit_of(goal.name)}" for goal in designs.goals]
    return "\n".join([name, *(line.strip().replace(" ", "\N{NO-BREAK SPACE}") for line in lines)])
