"""The best design itself: in its workspace where that was judged, in its motion where that was."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.analyses.optimize.goals import goal
from mechdesign.report.figures.kinematics.paths import paths_figure
from mechdesign.report.figures.mechanism import mechanism_figure
from mechdesign.report.figures.optimize.designs import Designs
from mechdesign.report.figures.sweep import Sweep
from mechdesign.report.figures.workspace import workspace_figure
from mechdesign.report.figures.workspace.regions import regions
from mechdesign.results import Result

_NEVER = "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}"


def optimum_figure(result: Result, designs: Designs) -> Figure:
    """The mechanism with the variables of the optimum that is best on the whole."""
    words = designs.in_words(designs.optimum, designs.chosen())
    best, own = result.drawn["best"]()
    if own.command == "workspace":
        return workspace_figure(best, own, regions(best, own)[0], f"the best design, {words}")
    if any(goal(name).command == "kinematics" for name in designs.goals) and own.drawn["motion"].poses.motion:
        figure = paths_figure(Sweep.of(own.drawn["motion"]), above=0.4)
        figure.axes[0].set_title(f"The best design, {words}", loc="left")
        return figure
    # A title may be broken between variables only.
    return mechanism_figure(best, own, f"The best design, {words.replace(' = ', _NEVER)}")
