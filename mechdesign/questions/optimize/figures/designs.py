"""Words of designs in pictures: their variables, axes and titles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis
from mechdesign.ground.errors import counted
from mechdesign.ground.numerals import in_powers, numeral, printed
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.judge import DesignSet
from mechdesign.questions.optimize.variables import Design, variables_of

FEW = 1000  # so many designs have larger dots
GREY_DOTS: dict[str, Any] = {"marker": ".", "color": style.FAINT, "markeredgewidth": 0, "alpha": 0.6}
OUTLYING = 3.0  # ranges of the middle half of some values
_MARGIN, _AROUND_CHOICES = 0.02, 0.2  # around an axis of numbers, and of choices; of their range
MAX_TICKS = 8  # of an axis with a number at each choice


def listed(designs: DesignSet, design: Design) -> list[str]:
    """``l_a = 1 mm`` for each variable of a design."""
    return [f"{name} = {value_text(value)} {printed(designs.unit_of(name))}".rstrip()
            for name, value in design.items()]  # fmt: skip


def value_text(value: float | str) -> str:
    """A value of a variable or a goal in words, where it is very small or large with a power of ten."""
    if isinstance(value, str):
        return value
    if value and not 1e-4 <= abs(value) < 1e6:
        return in_powers(value)
    return numeral(value, 4 if abs(value) < 1e4 else 6)


def quantity_axis(designs: DesignSet, name: str, **options: Any) -> Axis:
    """The axis of a variable or a goal."""
    return Axis(name, designs.unit_of(name), **options)


def variable_axis(designs: DesignSet, name: str) -> Axis:
    """The axis of a variable with the places of its choices, unless they are many numbers."""
    variable = variables_of(designs.study)[name]
    axis = quantity_axis(designs, name, margin=_MARGIN if variable.choices is None else _AROUND_CHOICES)
    if variable.choices is None or not (variable.words or len(variable.choices) <= MAX_TICKS):
        return axis
    words = variable.words or [value_text(choice) for choice in variable.choices]
    places = range(len(words)) if variable.words else [float(choice) for choice in variable.choices]
    return replace(axis, ticks=places, words=words)


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


def goals_apart(designs: DesignSet) -> list[int]:
    """Goals that are not variables themselves."""
    return [k for k, goal in enumerate(designs.goals) if goal.name not in designs.variables]


def on_front(designs: DesignSet, front: Table) -> Ints:
    """Rows of the designs whose goals are those of a front's designs."""
    best = set(zip(*(front[goal.name].tolist() for goal in designs.goals), strict=True))
    return np.flatnonzero([tuple(values) in best for values in designs.values.tolist()])
