"""The Pareto front of an optimisation in pictures, and the designs of it that are marked."""

from __future__ import annotations

from itertools import combinations
from string import ascii_uppercase

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Dots, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.figures.designs import FEW, GREY_DOTS, goals_apart, listed
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.optimize.judge import DesignSet

_FRONT_MARKS = "so^DvPX"


@picture(DesignsView, "pareto", order=50)
def pareto_picture(view: DesignsView) -> Picture | None:
    """The front, if several goals have one."""
    return front_picture(view.designs, view.front) if view.front is not None else None


def front_picture(designs: DesignSet, front: Table) -> Picture:
    """Every feasible design, those of the front, and the knee; a panel each pair of goals."""
    title = f"Pareto front: {len(front)} of {int(designs.feasible.sum())} feasible designs"
    return Picture(title, [_front(designs, front, pair) for pair in pairs(designs)], across=2)


def pairs(designs: DesignSet) -> list[tuple[int, int]]:
    """The goals of each panel, along and up."""
    return [*combinations(range(len(designs.goals)), 2)]


def _front(designs: DesignSet, front: Table, pair: tuple[int, int]) -> Panel:
    goals, every = [designs.goals[k] for k in pair], designs.values[designs.feasible][:, pair].T
    fronts = [np.asarray(front[goal.name], dtype=float) for goal in goals]
    order = np.argsort(fronts[0], kind="stable")
    # Between two designs of the front nothing is known to be better than the worse of the two.
    steps = {"color": style.BLUE, "linewidth": 1.2, "marker": "o", "markersize": 4.0 if len(front) < 200 else 2.2,
             "linestyle": "-" if len(designs.goals) == 2 else "none",
             "drawstyle": "steps-post" if goals[0].smallest else "steps-pre"}  # fmt: skip
    marks: list[PanelMark] = [
        Dots(*every, label="feasible designs", look=GREY_DOTS | {"markersize": 3 if every.shape[1] > FEW else 5}),
        Trace(*(values[order] for values in fronts), label="front: no other is better in every goal", look=steps),
    ]
    for (name, row), marker in zip(marked(designs, front), _FRONT_MARKS, strict=False):
        knee = name == "knee"
        look = {"marker": "*" if knee else marker, "color": style.VERMILION, "markeredgecolor": "white",
                "markersize": 15 if knee else 9, "zorder": 5, "clip_on": False}  # fmt: skip
        words = ", ".join(listed(designs, chosen(designs, front, row)))
        marks.append(Dots(*([values[row]] for values in fronts), label=f"{name}, {words}", look=look))
    # Designs far worse than the front would press it into a corner.
    inside, axes = np.ones(every.shape[1], dtype=bool), []
    for goal, values, all_of in zip(goals, fronts, every, strict=True):
        low, high = float(values.min()), float(values.max())
        span = (high - low) or abs(high) or 1.0
        start = max(float(all_of.min()), low - 0.6 * span) - 0.04 * span
        end = min(float(all_of.max()), high + 0.6 * span) + 0.04 * span
        inside &= (start <= all_of) & (all_of <= end)
        sense = f"{'less' if goal.smallest else 'more'} is better"
        words = f"{style.axis_label(goal.name, designs.unit_of(goal.name))}, {sense}"
        axes.append(Axis(words, ends=(start, end)))
    outside = int(np.sum(~inside))
    return Panel(marks, axes[0], axes[1], aside=f"{outside} worse designs outside" if outside else "", size=1.2)


@picture(DesignsView, "hypervolume", order=60)
def growth_picture(view: DesignsView) -> Picture | None:
    """Hypervolume of the front over the number of designs, and its growth by the last tenth of them."""
    if view.front is None:
        return None
    growth = view.result.tables["hypervolume"]
    words = f"Growth of the front: {100 * growth['growth'][-1]:.2g} % by the last tenth of the designs"
    curve = Trace(growth["designs"], growth["hypervolume"], look={"marker": "o", "color": style.BLUE, "markersize": 4})
    panel = Panel([curve], Axis("designs evaluated", margin=0.02), Axis("hypervolume of the front"))
    return Picture(words, [panel])


def marked(designs: DesignSet, front: Table) -> list[tuple[str, int]]:
    """Designs of a front that are shown, and their rows: the best of each goal, and the knee between them."""
    marks: dict[int, str] = {}
    for letter, goal in zip(ascii_uppercase, designs.goals, strict=False):
        best = np.argmin if goal.smallest else np.argmax
        marks.setdefault(int(best(front[goal.name])), f"{letter}: best {goal.name}")
    marks.setdefault(int(np.argmax(front["knee"])), "knee")
    # Along the first goal, as the front runs.
    return [(marks[row], row) for row in sorted(marks)]


def chosen(designs: DesignSet, front: Table, row: int) -> dict[str, float | str]:
    return {name: front[name][row].item() for name in designs.variables}


def described(designs: DesignSet, front: Table, name: str, row: int) -> str:
    """Lines that name a design of a front, its variables and its goals; none is broken at a space."""
    lines = listed(designs, chosen(designs, front, row))
    for goal in (designs.goals[k] for k in goals_apart(designs)):
        lines.append(f"{goal.column} = {numeral(front[goal.name][row], 3)} {printed(designs.unit_of(goal.name))}")
    return "\n".join([name, *(line.strip().replace(" ", "\N{NO-BREAK SPACE}") for line in lines)])
