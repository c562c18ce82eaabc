"""Problems with known Pareto fronts, as measures of parameters between 0 and 1."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from helpers.studies import study_of
from mechdesign.study import Study

HEAD = """\
mechanism:
  parameters: {{{parameters}}}
  links: {{ground: {{O: [0, 0]}}, arm: [O, P, 10]}}
  drives: [arm]
  sketch: {{P: [10, 0]}}
optimize: {{method: pareto, minimize: [{goals}], variables: {{{variables}}}}}
"""


def functions(count: int, formulas: Mapping[str, str], goals: list[str], *changes: str) -> Study:
    """A study of functions of the parameters ``x1``, ``x2`` ..."""
    names = [f"x{k + 1}" for k in range(count)]
    parameters = [f"{name}: 0.5" for name in names] + [f'{name}: "{formula}"' for name, formula in formulas.items()]
    variables = [f"{name}: {{from: 0, to: 1}}" for name in names]
    texts = {"parameters": parameters, "goals": goals, "variables": variables}
    return study_of(HEAD.format(**{name: ", ".join(text) for name, text in texts.items()}), *changes)


def _summed(first: int, last: int, term: str) -> str:
    return " + ".join(term.format(f"x{k}") for k in range(first, last + 1))


@dataclass(frozen=True)
class Front:
    """A problem.

    Parameters
    ----------
    study : callable
        From the number of variables, and overrides, to the study.
    goals : list of str
    hypervolume : float
        Of the true front, up to the corner 1.1 in every goal.
    """

    study: Callable[..., Study]
    goals: list[str]
    hypervolume: float


def _zdt(count: int, formula: str, *changes: str) -> Study:
    formulas = {"g": f"1 + 9/{count - 1}*({_summed(2, count, '{}')})", "f2": formula}
    return functions(count, formulas, ["x1", "f2"], *changes)


def zdt1(count: int, *changes: str) -> Study:
    return _zdt(count, "g*(1 - sqrt(x1/g))", *changes)


def zdt3(count: int, *changes: str) -> Study:
    return _zdt(count, "g*(1 - sqrt(x1/g) - x1/g*sin(1800*x1))", *changes)


def dtlz2(count: int, *changes: str) -> Study:
    formulas = {
        "g": f"1 + {_summed(3, count, '({} - 0.5)**2')}", "f1": "g*cos(90*x1)*cos(90*x2)",
        "f2": "g*cos(90*x1)*sin(90*x2)", "f3": "g*sin(90*x1)",
    }  # fmt: skip
    return functions(count, formulas, ["f1", "f2", "f3"], *changes)


# [Zitzler, Deb & Thiele, 2000] by 200,001 points of the true fronts; DTLZ2 is an eighth of the unit sphere [Deb et al.,
# Scalable test problems for evolutionary multiobjective optimization, 2005].
FRONTS: Mapping[str, Front] = {
    "zdt1": Front(zdt1, ["x1", "f2"], 0.87664),
    "zdt3": Front(zdt3, ["x1", "f2"], 1.33176),
    "dtlz2": Front(dtlz2, ["f1", "f2", "f3"], 1.331 - np.pi / 6),
}
