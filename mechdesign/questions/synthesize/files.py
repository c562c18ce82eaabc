"""Solutions as study files, which every other command runs; and their yields once they are made."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from mechdesign.questions.look import ask
from mechdesign.questions.synthesize.declared import DRIVE, POINT
from mechdesign.questions.synthesize.solutions import Solution
from mechdesign.questions.synthesize.tasks import Task
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.schema.variable import plainly

# A requirement allows this part more than the largest error, and this part of the task's size.
_SLACK, _ROUNDING = 1e-3, 1e-7
# Poses of a full turn at which made linkages are judged beside the positions.
_AROUND = 36


def study_data(study: Study, task: Task, solution: Solution, name: str) -> dict[str, Any]:
    """The study of a solution as data: its mechanism, the task as targets, and its errors as a requirement."""
    factor, kind = study.units.angle_factor, solution.kind
    mechanism: dict[str, Any] = copy.deepcopy(dict(kind.data))
    for (place, declared), value in zip(
        kind.mechanism.description.places.items(), solution.values.tolist(), strict=True
    ):
        _put(mechanism, place, plainly(value / factor if declared.quantity == "angle" else value))
    first = solution.poses.take((0, 0))
    mechanism["sketch"] = {point: _pair(complex(first.point(point))) for point in mechanism["sketch"]}
    output, targets = task.targets(solution)
    mechanism["targets"] = targets
    positions = [{DRIVE: plainly(angle / factor)} for angle in solution.angles.tolist()]
    most = max(float(solution.errors.max()) * (1 + _SLACK), _ROUNDING * task.size) / task.error_factor
    data: dict[str, Any] = {
        "name": name,
        "units": study.resolved["units"],
        "seed": study.seed,
        "mechanism": mechanism,
        "kinematics": {"poses": positions, "outputs": [*targets]},
        "requirements": [{"result": f"kinematics.{output}_error", "at_most": float(f"{most:.4g}"), "abs": True}],
    }
    judge = task.section.judge
    if judge is not None:
        around = solution.angles
        if solution.full_turn:
            turn = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
            around = np.concatenate([around, around.min() + turn])
        judged = study.resolved["synthesis"]["judge"]
        tolerances = dict(judged.get("dimensions", {}))
        if judge.tolerance is not None:
            lengths = [place for place, declared in kind.mechanism.description.places.items()
                       if declared.quantity == "length" and place not in task.apart]  # fmt: skip
            tolerances = dict.fromkeys(lengths, float(judge.tolerance)) | tolerances
        limit = {POINT: {"radius": float(judge.within)}} if output == POINT else {output: float(judge.within)}
        course = [plainly(angle) for angle in np.unique(around / factor).tolist()]
        data["reliability"] = {
            "dimensions": tolerances, "path": {DRIVE: course}, "outputs": [output], "limits": limit,
            "methods": ["monte_carlo"], "samples": judge.samples, "sobol": 0,
        }  # fmt: skip
        if judge.clearances:
            data["reliability"]["clearances"] = judged["clearances"]
    return data


def _put(mechanism: dict[str, Any], place: str, value: float) -> None:
    """Write a dimension into the data of a mechanism by the name of its place."""
    owner, *rest = place.split(".")
    entry = mechanism["links"].get(owner) or mechanism.get("joints", {}).get(owner)
    if rest == ["length"] and isinstance(entry, list):
        entry[2] = value
    elif len(rest) == 1:
        entry[rest[0]] = value
    else:
        points = entry.get("points", entry)
        points[rest[0]]["xy".index(rest[1])] = value


def _pair(place: complex) -> list[float]:
    return [plainly(place.real), plainly(place.imag)]


class _Dumper(yaml.SafeDumper):
    """Writes every pose where it stands, and no reference to another."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def study_text(data: Mapping[str, Any], heading: str) -> str:
    """A study of a solution as the text of a file."""
    lines = "".join(f"# {line}\n" for line in heading.splitlines())
    text: str = yaml.dump(
        dict(data), Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=120, allow_unicode=True
    )
    return lines + text


def judged_share(study: Study, data: Mapping[str, Any]) -> tuple[float, float, float]:
    """The yield of a solution, and the ends of its interval.

    Raises
    ------
    StudyError
        Where the task's `judge` names what the linkage does not have.
    """
    made = load_data(data, (), None, study.folder)
    table = ask(made, "reliability").tables["reliability"]
    rows = table.take(table["scope"] == "cycle")
    return tuple(float(rows[name][0]) for name in ("reliability", "low", "high"))  # type: ignore[return-value]
