"""The best design's own answer, which its picture shows."""

from __future__ import annotations

import dataclasses
from contextlib import suppress

import numpy as np

from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.analyses.shown import solve_shown
from mechdesign.analyses.workspace.analysis import workspace
from mechdesign.errors import MechdesignError
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.study.variants import variant


def best_design(compared: Comparison) -> tuple[Study, Result]:
    """The design that is best on the whole as a study, and its workspace where that was judged, or else its motion."""
    winner = compared.winners[np.argmax(compared.cpi[compared.winners])]
    best = variant(compared.study, {name: float(column[winner]) for name, column in compared.designs.variables.items()})
    if best.workspace is not None and any(each.command == "workspace" for each in compared.designs.goals):
        # The region is drawn, not its indices.
        plain = dataclasses.replace(best, workspace=best.workspace.model_copy(update={"indices": ()}))
        result = workspace(plain)
        if "local" in result.tables:
            return plain, result
    drawn = {}
    with suppress(MechdesignError):
        drawn["motion"] = solve_shown(best)
    return best, Result("kinematics", {}, drawn=drawn)
