"""Pictures of an optimisation, whatever its method: score, goals, designs, front, convergence, and the optimum."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.questions.optimize.analysis import DrawnDesign, DrawnDesigns, drawn_design
from mechdesign.questions.optimize.figures.designs import (
    folded as folded,
)
from mechdesign.questions.optimize.figures.designs import (
    head as head,
)
from mechdesign.questions.optimize.figures.designs import (
    label as label,
)
from mechdesign.questions.optimize.figures.designs import (
    listed,
)
from mechdesign.questions.optimize.figures.designs import (
    tick as tick,
)
from mechdesign.questions.optimize.figures.designs import (
    value_text as value_text,
)
from mechdesign.questions.optimize.figures.front import chosen, described, front_figure, growth_figure, marked
from mechdesign.questions.optimize.figures.optimum import design_figure, designs_figure
from mechdesign.questions.optimize.figures.scores import (
    convergence,
    goal_maps,
    parallel_axes,
    score_curves,
    score_surface,
)
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.boundary import regions_figure, workspace_figure
from mechdesign.questions.workspace.figures.regions import regions
from mechdesign.report.figures import style
from mechdesign.report.figures.mechanism import sketch_and_first_pose
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result, Table
from mechdesign.study import Study

MIN_MAP_DESIGNS = 9
# Angles at which the outline of a contained shape is drawn.
_OUTLINE = np.linspace(0.0, 2 * np.pi, 1441)
_UNBROKEN_EQUALS = "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}"


def figures(study: Study, result: Result) -> Gallery:
    """``CPI`` (``objective`` of one goal), ``indices``, ``designs``, ``pareto``, ``hypervolume``,
    ``convergence``, ``optimum``."""
    assert study.optimize is not None
    drawn, gallery = DrawnDesigns.of(result), Gallery()
    designs = drawn.designs
    score = "CPI" if len(designs.goals) > 1 else "objective"
    if len(designs.variables) == 2 and len(designs) >= MIN_MAP_DESIGNS:
        gallery.add(score, score_surface, designs)
        if len(designs.goals) > 1:
            gallery.add("indices", goal_maps, designs)
    else:
        gallery.add(score, score_curves, designs)
    if len(designs.variables) > 2:
        gallery.add("designs", parallel_axes, designs)
    if "pareto" in result.tables:
        gallery.add("pareto", front_figure, designs, result.tables["pareto"])
        gallery.add("hypervolume", growth_figure, result.tables["hypervolume"])
    if study.optimize.method == "search":
        gallery.add("convergence", convergence, designs)
    gallery.add("optimum", _optimum, drawn, result.tables.get("pareto"))
    return gallery


def _optimum(drawn: DrawnDesigns, front: Table | None) -> Figure:
    """The best design: in its workspace if that was judged, else in its motion.

    Of a front those that are marked in it, side by side.
    """
    designs = drawn.designs
    if front is not None:
        parts = [(described(designs, front, name, row), drawn_design(designs, chosen(designs, front, row)))
                 for name, row in marked(designs, front)]  # fmt: skip
        moving = [(words, own.shown, own.motion) for words, own in parts
                  if own.shown is not None and own.shown.configuration.valid.any()]  # fmt: skip
        if len(parts) > 1 and len(moving) == len(parts):
            return designs_figure(moving)
        judged_regions = [(words, own.study, regions(own.study, own.region)[0]) for words, own in parts
                 if own.region is not None]  # fmt: skip
        if len(parts) > 1 and len(judged_regions) == len(parts):
            figure = regions_figure(judged_regions, "some designs of the front where they are best conditioned")
            for axes, (_, own) in zip(figure.axes, parts, strict=True):
                _draw_contained(axes, own)
            return figure
    best, words = drawn.best, listed(designs.design(designs.best))
    if best.region is not None:
        region = regions(best.study, best.region)[0]
        there = f", at {region.title}" if region.title else ""
        dotted = "; dotted: what it contains" if best.contained else ""
        title = f"the best design, {words}{there}{dotted}"
        figure = workspace_figure(best.study, DrawnRegion.of(best.region), region, title)
        _draw_contained(figure.axes[0], best)
        return figure
    # A title may be broken between variables only.
    words = f"The best design, {words}".replace(" = ", _UNBROKEN_EQUALS)
    if best.motion is not None:
        return design_figure(best.study, best.motion, words)
    return sketch_and_first_pose(best.study, best.shown, words)


def _draw_contained(axes: Axes, own: DrawnDesign) -> None:
    """Outline of what a workspace is to contain."""
    for shape, centre in own.contained:
        z = centre + shape.radius(_OUTLINE) * np.exp(1j * _OUTLINE)
        axes.plot(z.real, z.imag, color=style.INK, linestyle=":", linewidth=1.6, zorder=5)
