"""Pictures of an optimisation, whatever its method: score, goals, designs, front, convergence, and the optimum."""

from __future__ import annotations

from mechdesign.report.figures.optimize.designs import designs_of
from mechdesign.report.figures.optimize.fronts import front_figure
from mechdesign.report.figures.optimize.optimum import optimum_figure
from mechdesign.report.figures.optimize.parallel import convergence, parallel_axes
from mechdesign.report.figures.optimize.scores import goal_maps, score_curves, score_surface
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result
from mechdesign.study import Study

# A map of fewer designs is no map.
FEWEST = 9


def figures(study: Study, result: Result) -> Gallery:
    """``CPI`` (the score over the variables), ``indices``, ``designs``, ``pareto``, ``convergence`` and ``optimum``."""
    assert study.optimize is not None
    designs = designs_of(study, result)
    found = Gallery()
    if len(designs.names) == 2 and len(designs.table) >= FEWEST:
        found.add("CPI", score_surface, designs)
        if len(designs.goals) > 1:
            found.add("indices", goal_maps, designs)
    else:
        found.add("CPI", score_curves, designs)
    if len(designs.names) > 2:
        found.add("designs", parallel_axes, designs)
    if "pareto" in result.tables:
        found.add("pareto", front_figure, designs, result.tables["pareto"])
    if study.optimize.method == "search":
        found.add("convergence", convergence, designs)
    found.add("optimum", optimum_figure, result, designs)
    return found
