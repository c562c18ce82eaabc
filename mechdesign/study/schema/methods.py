"""The methods of reliability, declared once: schema, checks, tables, pictures and `auto` follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Method:
    """A way to errors and probabilities of failure.

    Parameters
    ----------
    name : str
        In studies and tables.
    words : str
        In pictures.
    meaning : str
        What it computes, in a line.
    accuracy : int
        The higher, the nearer to the truth: where there is room for one method only, it is the one that stands.
    color : str
        A colour of `mechdesign.report.figures.style`; vermilion is left to limits.
    marker : str
        Matplotlib's, of values.
    dashes : str
        Of the line through computed values; values of made mechanisms have none, but whiskers.
    sampled : bool
        Whether made mechanisms are solved at random.
    errors : bool
        Whether their errors are drawn as they are made, so that moments, densities and whole cycles follow.
    precise : bool
        Whether it ends where the precision asked is reached.
    step : int
        Its place among the steps of `auto` (`rung` of its module), which begins with plain samples; 0: none.
    module : str
        Where its ``run(task)`` is; imported when it is asked, for a study is read without numerics.
    """

    name: str
    words: str
    meaning: str
    accuracy: int = 0
    color: str = "YELLOW"
    marker: str = "h"
    dashes: Literal["-", "--", ":", "-."] = "-."
    sampled: bool = False
    errors: bool = False
    precise: bool = False
    step: int = 0
    module: str = ""

    @property
    def place(self) -> str:
        """The module."""
        return self.module or f"mechdesign.analyses.reliability.methods.{self.name}"


METHODS: dict[str, Method] = {}


def register(method: Method) -> None:
    """Make a method known to studies, analyses and pictures."""
    METHODS[method.name] = method


for _method in (
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
):  # fmt: skip
    register(_method)
