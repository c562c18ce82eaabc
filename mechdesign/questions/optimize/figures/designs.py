"""Words of designs in pictures: their variables, axes and titles."""

from __future__ import annotations

import re

from matplotlib.axis import Axis
from matplotlib.figure import Figure

from mechdesign.questions.optimize.judge import Designs
from mechdesign.questions.optimize.variables import Design, variables_of
from mechdesign.report.figures import style

NAME_LETTERS = 14  # of a name in one line below an axis
MAX_TICKS = 8  # of an axis with a number at each choice


def label(designs: Designs, name: str) -> str:
    """Name and unit of a variable or a goal, for an axis."""
    return style.axis_label(name, designs.unit_of(name))


def listed(design: Design) -> str:
    """``l_a = 1, section = tube``."""
    return ", ".join(f"{name} = {value_text(value)}" for name, value in design.items())


def value_text(value: float | str) -> str:
    """A value of a variable in words."""
    return value if isinstance(value, str) else f"{value:.4g}"


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


def head(figure: Figure, words: str) -> None:
    """A title above all panels."""
    figure.suptitle(style.folded(words, 11.0, style.width() - 0.2), x=0.01, ha="left", fontsize=11)
