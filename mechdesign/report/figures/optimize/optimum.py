"""The best design itself: in its workspace where that was judged, in its motion where that was."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from mechdesign.analyses.optimize.goals import goal
from mechdesign.analyses.poses import study_poses
from mechdesign.analyses.workspace.analysis import workspace
from mechdesign.report.figures.kinematics.paths import paths_figure
from mechdesign.report.figures.mechanism import mechanism_figure
from mechdesign.report.figures.optimize.designs import Designs
from mechdesign.report.figures.sweep import is_motion, solve_sweep
from mechdesign.report.figures.workspace import workspace_figure
from mechdesign.report.figures.workspace.regions import regions
from mechdesign.study.variants import variant

if TYPE_CHECKING:
    from mechdesign.study import Study

_NEVER = "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}"


def optimum_figure(study: Study, designs: Designs) -> Figure:
    """The mechanism with the variables of the optimum that is best on the whole."""
    row = designs.chosen()
    best = variant(study, {name: float(designs.optimum[name][row]) for name in designs.names})
    words = designs.in_words(designs.optimum, row)
    asked = {goal(name).command for name in designs.goals}
    if "workspace" in asked and best.workspace is not None:
        # The region is drawn, not its indices.
        plain = dataclasses.replace(best, workspace=best.workspace.model_copy(update={"indices": ()}))
        result = workspace(plain)
        if "local" in result.tables:
            return workspace_figure(plain, regions(plain, result)[0], f"the best design, {words}")
    if "kinematics" in asked and is_motion(study_poses(best, "kinematics")):
        figure = paths_figure(solve_sweep(best), above=0.4)
        figure.axes[0].set_title(f"The best design, {words}", loc="left")
        return figure
    # A title may be broken between variables only.
    return mechanism_figure(best, f"The best design, {words.replace(' = ', _NEVER)}")
