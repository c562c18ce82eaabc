"""Solutions as study files, which every other command runs; and what they are worth once they are made."""

from __future__ import annotations

import copy
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.ground.errors import printable
from mechdesign.questions.look import ask
from mechdesign.questions.synthesize.declared import DRIVE, POINT
from mechdesign.questions.synthesize.solutions import Judged, Solution
from mechdesign.questions.synthesize.tasks import Task
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.schema.variable import plainly
from mechdesign.study.variants import in_one_line

# A requirement allows this part more than the largest error, and this part of the task's size.
_SLACK, _ROUNDING = 1e-3, 1e-7
# Poses of a full turn at which made linkages are judged beside the positions.
_AROUND = 36
# Letters of a line.
_WIDTH = 120


def study_data(study: Study, task: Task, solution: Solution, name: str) -> dict[str, Any]:
    """The study of a solution as data: its mechanism, the task as targets of its path, its errors as a requirement."""
    factor, kind, judge = study.units.angle_factor, solution.kind, task.section.judge
    mechanism: dict[str, Any] = copy.deepcopy(dict(kind.data))
    places = kind.mechanism.description.places
    for (place, declared), value in zip(places.items(), solution.values.tolist(), strict=True):
        _put(mechanism, place, plainly(value / factor if declared.quantity == "angle" else value))
    first = solution.poses.take((0, 0))
    mechanism["sketch"] = {point: _plain(complex(first.point(point))) for point in mechanism["sketch"]}
    output, targets = task.targets(solution)
    angles, again = solution.angles, []
    if solution.full_turn and task.closed:
        # A closed path ends where it begins, a turn later.
        turn = 2 * np.pi if angles[-1] > angles[0] else -2 * np.pi
        angles, again = np.append(angles, angles[0] + turn), [0]
    mechanism["targets"] = {name: _plain([*rows, *(rows[k] for k in again)]) for name, rows in targets.items()}
    most = max(float(solution.errors.max()) * (1 + _SLACK), _ROUNDING * task.size) / task.error_factor
    data: dict[str, Any] = {
        "name": name,
        "units": study.resolved["units"],
        "seed": study.seed,
        "mechanism": mechanism,
        "kinematics": {"path": {DRIVE: _plain((angles / factor).tolist())}, "outputs": [*targets]},
        "requirements": [{"result": f"kinematics.{output}_error", "at_most": float(f"{most:.4g}"), "abs": True}],
    }
    if judge is not None and judge.loads:
        data["dynamics"] = {"loads": study.resolved["synthesis"]["judge"]["loads"]}
    if judge is None or judge.within is None:
        return data
    around = solution.angles
    if solution.full_turn:
        around = np.concatenate([around, around.min() + np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)])
    judged = study.resolved["synthesis"]["judge"]
    tolerances = dict(judged.get("dimensions", {}))
    if judge.tolerance is not None:
        lengths = [place for place, declared in places.items()
                   if declared.quantity == "length" and place not in task.apart]  # fmt: skip
        tolerances = dict.fromkeys(lengths, float(judge.tolerance)) | tolerances
    limit = {POINT: {"radius": float(judge.within)}} if output == POINT else {output: float(judge.within)}
    data["reliability"] = {
        "dimensions": tolerances, "path": {DRIVE: _plain(np.unique(around / factor).tolist())}, "outputs": [output],
        "limits": limit, "methods": ["monte_carlo"], "samples": judge.samples, "sobol": 0,
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


def _plain(value: Any) -> Any:
    """Numbers as a file has them: a place as a pair, rows as lists."""
    if isinstance(value, complex):
        value = [value.real, value.imag]
    return [*map(_plain, value)] if isinstance(value, list) else plainly(value)


def study_text(data: Mapping[str, Any], heading: Sequence[str]) -> str:
    """A study of a solution as the text of a file, under comments: what fits into a line stands in one."""
    comments = [f"# {line}" for text in heading for line in textwrap.wrap(printable(text), _WIDTH - 2)]
    return "\n".join([*comments, *_lines(data), ""])


def _lines(data: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    for key, value in data.items():
        line = indent + in_one_line(key, value)
        if len(line) <= _WIDTH or not isinstance(value, dict | list):
            yield line
        elif isinstance(value, dict):
            yield f"{indent}{in_one_line(key, None).removesuffix(' null')}"
            yield from _lines(value, f"{indent}  ")
        else:
            first, *parts = (in_one_line("k", part).removeprefix("k: ") for part in value)
            line = f"{indent}{in_one_line(key, None).removesuffix('null')}[{first}"
            for part in parts:
                if len(line) + len(part) + 3 > _WIDTH:
                    yield f"{line},"
                    line = f"{indent}  {part}"
                else:
                    line += f", {part}"
            yield f"{line}]"


def judged(study: Study, data: Mapping[str, Any]) -> Judged:
    """What a solution is worth: its yield with the ends of the interval, and the greatest effort of its drive.

    Raises
    ------
    StudyError
        Where the task's `judge` names what the linkage does not have.
    """
    made, answer = load_data(data, (), None, study.folder), Judged()
    if made.reliability is not None:
        table = ask(made, "reliability").tables["reliability"]
        rows = table.take(table["scope"] == "cycle")
        answer = Judged(*(float(rows[name][0]) for name in ("reliability", "low", "high")))
    if made.dynamics is not None:
        table = ask(made, "dynamics").tables["extremes"]
        rows = table.take(table.where(output=f"{DRIVE}_effort"))
        answer = answer._replace(effort=float(max(np.abs([rows["min"][0], rows["max"][0]]))))
    return answer
