"""The designs found best, as study files which run as they are, and with their own answer, which a picture shows."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.analyses.optimize.variables import in_words
from mechdesign.analyses.shown import solve_shown
from mechdesign.analyses.workspace.analysis import workspace
from mechdesign.errors import MechdesignError
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.variants import changed_data, rewritten, variant


def optimum_files(study: Study, compared: Comparison, marked: Mapping[str, int]) -> tuple[dict[str, str], list[str]]:
    """Texts by file name, ``optimum.yaml`` for the first row of weights, ``optimum_2.yaml`` ..., and what is wrong.

    Parameters
    ----------
    marked : mapping of str to int
        Further designs worth a file, by its name without the suffix.
    """
    goals = [each.name for each in compared.designs.goals]
    wanted = {}
    for row, winner in enumerate(compared.winners.tolist()):
        weights = ", ".join(f"{each} {weight:g}" for each, weight in zip(goals, compared.weights[row], strict=True))
        name = f"optimum_{row + 1}" if row else "optimum"
        wanted[name] = winner, f"Optimum of {study.name} for the weights {weights}"
    wanted |= {name: (k, f"{name.capitalize()} of the Pareto front of {study.name}") for name, k in marked.items()}
    files: dict[str, str] = {}
    doubts = []
    for name, (k, heading) in wanted.items():
        numbers = {variable: float(column[k]) for variable, column in compared.designs.variables.items()}
        heading = f"{heading}: {in_words(numbers)}"
        data = changed_data(study, numbers)
        try:
            if not _assembles_alike(study, numbers, data):
                data = _drawn_anew(study, numbers)
                if not _assembles_alike(study, numbers, data):
                    doubts.append(f"{name}.yaml: its sketch chooses another assembly than the optimum's; mend it")
        except MechdesignError as error:
            doubts.append(f"{name}.yaml: {str(error).splitlines()[0]}")
        text, beside = rewritten(study, data, heading)
        files |= {f"{name}.yaml": text, **beside}
    return files, doubts


def _assembles_alike(study: Study, numbers: Mapping[str, float], data: Mapping[str, Any]) -> bool:
    """Whether the study of this data has the assembly in which the design was evaluated."""
    try:
        alone = load_bytes(yaml.safe_dump(dict(data), sort_keys=False).encode(), study.path or Path("study.yaml"))
    except MechdesignError:
        return False
    return alone.mechanism.forward.modes == variant(study, numbers).mechanism.forward.modes


def _drawn_anew(study: Study, numbers: Mapping[str, float]) -> dict[str, Any]:
    """The data of a design with the sketch as it assembles."""
    data = changed_data(study, numbers)
    assembled = variant(study, numbers).mechanism.sketch_configuration
    points = {name: np.asarray(assembled.point(name)).item() for name in data["mechanism"]["sketch"]}
    data["mechanism"]["sketch"] = {name: [point.real, point.imag] for name, point in points.items()}
    return data


def best_design(compared: Comparison) -> tuple[Study, Result]:
    """The design that is best on the whole as a study, and its workspace where that was judged, or else its motion."""
    numbers = {name: float(column[compared.best]) for name, column in compared.designs.variables.items()}
    best = variant(compared.study, numbers)
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
