"""Pictures of an optimisation, whatever its method: score, goals, designs, front, convergence, and the optimum."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.report.figures.kinematics.paths import paths_figure
from mechdesign.report.figures.mechanism import mechanism_figure
from mechdesign.report.figures.optimize.many import convergence, front_figure, parallel_axes
from mechdesign.report.figures.optimize.scores import goal_maps, in_words, score_curves, score_surface
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.sweep import Sweep
from mechdesign.report.figures.workspace import workspace_figure
from mechdesign.report.figures.workspace.regions import regions
from mechdesign.results import Result
from mechdesign.study import Study

# A map of fewer designs is no map.
FEWEST = 9
_NEVER = "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}"


def figures(study: Study, result: Result) -> Gallery:
    """``CPI`` (the score over the variables), ``indices``, ``designs``, ``pareto``, ``convergence`` and ``optimum``."""
    assert study.optimize is not None
    compared: Comparison = result.drawn["compared"]
    designs, found = compared.designs, Gallery()
    if len(designs.variables) == 2 and len(designs) >= FEWEST:
        found.add("CPI", score_surface, compared)
        if len(designs.goals) > 1:
            found.add("indices", goal_maps, compared)
    else:
        found.add("CPI", score_curves, compared)
    if len(designs.variables) > 2:
        found.add("designs", parallel_axes, compared)
    if "pareto" in result.tables:
        found.add("pareto", front_figure, compared, result.tables["pareto"])
    if study.optimize.method == "search":
        found.add("convergence", convergence, compared)
    found.add("optimum", _optimum, result, compared)
    return found


def _optimum(result: Result, compared: Comparison) -> Figure:
    """The best design itself: in its workspace where that was judged, in its motion where that was."""
    words = in_words(compared, compared.best)
    best, own = result.drawn["best"]()
    if own.command == "workspace":
        return workspace_figure(best, own, regions(best, own)[0], f"the best design, {words}")
    goals = compared.designs.goals
    if any(each.command == "kinematics" for each in goals) and own.drawn["motion"].poses.motion:
        figure = paths_figure(Sweep.of(own.drawn["motion"]), above=0.4)
        figure.axes[0].set_title(f"The best design, {words}", loc="left")
        return figure
    # A title may be broken between variables only.
    return mechanism_figure(best, own, f"The best design, {words.replace(' = ', _NEVER)}")
