"""The methods of reliability, declared once: schema, checks, tables, pictures and `auto` follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Method:
    """A way to errors and probabilities of failure."""

    name: str  # in studies and tables
    words: str  # in pictures
    meaning: str  # what it computes, in a line
    accuracy: int = 0  # rank; where one method only is shown, it is that of the highest rank
    color: str = "YELLOW"  # of `mechdesign.report.figures.style`; vermilion is left to limits
    marker: str = "h"  # Matplotlib's, of values
    dashes: Literal["-", "--", ":", "-."] = "-."  # of computed values; those of made mechanisms have whiskers instead
    sampled: bool = False  # whether made mechanisms are solved at random
    errors: bool = False  # whether their errors are drawn as they are made: moments, densities, whole cycles follow
    precise: bool = False  # whether it ends where the precision asked is reached
    step: int = 0  # place among the steps of `auto` (`rung` of its module), which begins with plain samples; 0: none
    module: str = ""  # that of its ``run(task)``, imported when it is asked; by default the one of its name

    @property
    def place(self) -> str:
        """The module of its ``run(task)``."""
        return self.module or f"mechdesign.questions.reliability.methods.{self.name}"


_METHODS = (
    Method("analytic", "first order", "first-order errors, normal", 1, "BLUE", "D", "-"),
    Method("second_order", "second order", "second-order errors, normal about the shifted mean", 3, "SKY", "s", "--"),
    Method("monte_carlo", "Monte Carlo", "made mechanisms, drawn at random", 4, "INK", "o", sampled=True, errors=True),
    Method(
        "quasi_monte_carlo", "quasi Monte Carlo", "made mechanisms at scrambled Sobol points", 5, "FAINT", "^",
        sampled=True, errors=True,
    ),
    Method("form", "FORM", "tangents of the limits at their design points", 2, "GREEN", "P", ":", step=1),
    Method(
        "importance_sampling", "importance sampling", "made mechanisms drawn about the design points", 6, "PURPLE", "X",
        sampled=True, step=2,
    ),
    Method(
        "auto", "auto", "the cheapest of these that reaches the precision asked", 7, "ORANGE", "*",
        sampled=True, errors=True, precise=True,
    ),
)  # fmt: skip
METHODS = {method.name: method for method in _METHODS}
