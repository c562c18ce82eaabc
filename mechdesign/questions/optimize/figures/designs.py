"""Words of designs in pictures: their variables, axes and titles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from mechdesign.errors import counted
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.optimize.judge import Designs
from mechdesign.questions.optimize.variables import Design, variables_of
from mechdesign.report.figures import style
from mechdesign.results import Table

NAME_LETTERS = 14  # of a name in one line below an axis
# Inches: beside the panels, above and below them, and between them.
_LEFT, _RIGHT, _ABOVE, _BELOW, _ACROSS = 0.85, 0.2, 0.45, 0.55, 0.95
_LEGEND_LINE = 0.19
_LEGEND_DOT = 8.0  # points
FEW = 1000  # so many designs have larger dots
OUTLYING = 3.0  # ranges of the middle half of some values
MAX_TICKS = 8  # of an axis with a number at each choice


def label(designs: Designs, name: str) -> str:
    """Name and unit of a variable or a goal, for an axis."""
    return style.axis_label(name, designs.unit_of(name))


def listed(designs: Designs, design: Design) -> list[str]:
    """``l_a = 1 mm`` for each variable of a design."""
    return [f"{name} = {value_text(value)} {style.printed(designs.unit_of(name))}".rstrip()
            for name, value in design.items()]  # fmt: skip


def value_text(value: float | str) -> str:
    """A value of a variable or a goal in words, where it is very small or large with a power of ten."""
    if isinstance(value, str):
        return value
    return f"{value:.4g}" if value == 0 or 1e-4 <= abs(value) < 1e6 else style.in_powers(value)


def folded(name: str) -> str:
    """A long name on two or more lines, broken after its dots, underscores and spaces."""
    lines = [""]
    for part in re.findall(r"[^._ ]*[._ ]?", name):
        if lines[-1] and len(lines[-1]) + len(part) > NAME_LETTERS:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def tick(axis: Axis, designs: Designs, name: str) -> bool:
    """Name the places of a variable's choices along an axis, unless they are many numbers; whether it has choices."""
    variable = variables_of(designs.study)[name]
    if variable.choices is not None and (variable.words or len(variable.choices) <= MAX_TICKS):
        words = variable.words or [value_text(choice) for choice in variable.choices]
        axis.set_ticks(range(len(words)) if variable.words else variable.choices, [*map(folded, words)])
    return variable.choices is not None


def sheet(
    count: int, columns: int, tall: float, heading: str, *, left: float = _LEFT, right: float = _RIGHT,
    above: float = _ABOVE, below: float = _BELOW, across: float = _ACROSS, down: float = 0.0, **shared: bool,
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Panels of a height in rows under a heading; inches above the panels, below them, between columns and rows."""
    words = style.folded(heading, 11.0, style.width() - 0.2)
    above += style.line(11.0) * words.count("\n")
    figure, axes = style.page(
        count, columns, tall, left=left, right=right, top=above, bottom=below, across=across, down=down, **shared
    )
    figure.text(0.1 / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=11)
    return figure, axes


def legend(figure: Figure, handles: Sequence[Any], labels: Sequence[str], columns: int) -> None:
    """One legend below all panels, for which the page is made higher."""
    rows = -(-len(labels) // columns)
    lines = sum(max(label.count("\n") + 1 for label in labels[row::rows]) for row in range(rows))
    style.grow(figure, below=_LEGEND_LINE * lines + 0.05)
    enlarge_dots(figure.legend(handles, labels, loc="lower left", ncols=columns, borderaxespad=0.3))


def enlarge_dots(legend: Legend) -> None:
    """Dots of a legend as large as can be seen: one alone is lost where thousands are drawn."""
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and handle.get_marker() == ".":
            handle.set(markersize=_LEGEND_DOT, alpha=1.0)


def usual(values: Floats, *, smallest: bool) -> Flags:
    """Values that an axis shows: all, unless outliers on the worse side would take more than half of it.

    These lie beyond three times the range of the middle half of the values from it [Tukey 1977].
    """
    worse = values if smallest else -values
    low, high = np.quantile(worse, (0.25, 0.75))
    near = worse <= high + OUTLYING * (high - low)
    if np.ptp(worse) < 2 * np.ptp(worse[near]) or np.ptp(worse[near]) == 0:
        return np.ones(len(values), dtype=bool)
    return np.asarray(near)


def outside(near: Flags) -> str:
    """How many values an axis does not show."""
    return f"{counted(int((~near).sum()), 'far worse design')} outside"


def on_front(designs: Designs, front: Table) -> Ints:
    """Rows of the designs whose goals are those of a front's designs."""
    best = set(zip(*(front[goal.name].tolist() for goal in designs.goals), strict=True))
    return np.flatnonzero([tuple(values) in best for values in designs.values.tolist()])
