"""Solutions as study files, which every other command runs; and what they are worth once they are made."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.ground.errors import StudyError, printable
from mechdesign.questions.look import ask
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.own import OwnKind
from mechdesign.questions.synthesize.solutions import Solution, Worth
from mechdesign.questions.synthesize.tasks import Task
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.schema.variable import plainly
from mechdesign.study.variants import changed_data, in_one_line, rewritten

# A requirement allows this part more than the largest error, and this part of the task's size.
_SLACK, _ROUNDING = 1e-3, 1e-7
# Poses of a full turn at which made linkages are judged beside the positions.
_AROUND = 36
# Letters of a line.
_WIDTH = 120


def study_data(study: Study, task: Task, solution: Solution, name: str) -> dict[str, Any]:
    """The study of a solution as data: its mechanism, the task as targets of its path, its errors as a requirement."""
    factor, kind, judge = study.units.angle_factor, solution.kind, task.section.judge
    data = changed_data(kind.study, kind.shown(solution.values, factor))
    mechanism, places = data["mechanism"], kind.mechanism.description.places
    first = solution.poses.take((0, int(solution.poses.valid[0].argmax())))
    sketch = mechanism.get("sketch", {})
    mechanism["sketch"] = {point: _plain(complex(np.asarray(first.point(point)))) for point in sketch}
    output, targets = task.targets(solution)
    angles, again = solution.angles, []
    if solution.full_turn and task.closed:
        # A closed path ends where it begins, a turn later.
        turn = 2 * np.pi if angles[-1] > angles[0] else -2 * np.pi
        angles, again = np.append(angles, angles[0] + turn), [0]
    path = {kind.drive: _plain((angles / factor).tolist())}
    kinematics: dict[str, Any] = {"path": path, "outputs": [*targets]}
    result = f"{output}_error"
    targets = {name: _plain([*rows, *(rows[k] for k in again)]) for name, rows in targets.items()}
    if isinstance(kind, OwnKind) and task.free:
        # The motion of the study passes them, at whatever time.
        kinematics, result = kind.kinematics, f"targets.{output}.max_abs"
        targets = {output: {"curve": _plain(task.points.tolist()), "closed": task.closed}}
    mechanism["targets"] = {**mechanism.get("targets", {}), **targets}
    most = max(solution.max_error * (1 + _SLACK), _ROUNDING * task.size) / task.error_factor
    requirement = {"result": f"kinematics.{result}", "at_most": float(f"{most:.4g}"), "abs": True}
    head = {"name": name, "units": study.resolved["units"], "seed": study.seed}
    requirements = [*data.get("requirements", []), requirement]
    data = head | data | head | {"kinematics": kinematics, "requirements": requirements}
    if judge is not None and judge.loads:
        data["dynamics"] = {"loads": study.resolved["synthesis"]["judge"]["loads"]}
    if judge is None or judge.within is None:
        return data
    # Between the positions, all round, made linkages need only be assembled.
    around, wished = solution.angles, _plain(task.targets(solution)[1][output])
    if solution.full_turn:
        around = np.concatenate([around, around.min() + 2 * np.pi * np.arange(1, _AROUND) / _AROUND])
    order = np.argsort(around, kind="stable")
    wished = [*wished, *[None] * (len(around) - len(wished))]
    judged = study.resolved["synthesis"]["judge"]
    tolerances = dict(judged.get("dimensions", {}))
    if judge.tolerance is not None:
        lengths = [place for place, declared in places.items()
                   if declared.quantity == "length" and place not in task.apart]  # fmt: skip
        tolerances = dict.fromkeys(lengths, float(judge.tolerance)) | tolerances
    within = float(judge.within)
    limit: dict[str, Any] = {"radius": within} if output == kind.point else {"min": -within, "max": within}
    limit |= {"target": [wished[k] for k in order.tolist()], **({"timing": "free"} if task.free else {})}
    path = {kind.drive: _plain((around[order] / factor).tolist())}
    data["reliability"] = {
        "dimensions": tolerances, "path": path, "outputs": [output], "limits": {output: limit},
        "methods": ["monte_carlo"], "samples": judge.samples, "sobol": 0,
    }  # fmt: skip
    if judge.clearances:
        data["reliability"]["clearances"] = judged["clearances"]
    return data


def _plain(value: Any) -> Any:
    """Numbers as a file has them: a place as a pair, rows as lists."""
    if isinstance(value, complex):
        value = [value.real, value.imag]
    return [*map(_plain, value)] if isinstance(value, list) else plainly(value)


def study_files(file: str, kind: Kind, data: dict[str, Any], heading: Sequence[str]) -> dict[str, str]:
    """A study of a solution as the text of a file, under comments: what fits into a line stands in one.

    Of a study's own mechanism the text is the study's, with the files that it reads.
    """
    if isinstance(kind, OwnKind):
        text, beside = rewritten(kind.study, data, ". ".join(heading))
        return {file: text, **beside}
    comments = [f"# {line}" for text in heading for line in textwrap.wrap(printable(text), _WIDTH - 2)]
    return {file: "\n".join([*comments, *_lines(data), ""])}


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


def judged(study: Study, data: Mapping[str, Any]) -> Worth:
    """What a solution is worth: its yield with the ends of the interval, and the greatest effort of its drive.

    Raises
    ------
    StudyError
        Where the task's `judge` names what the linkage does not have.
    """
    try:
        made, answer = load_data(data, (), None, study.folder), Worth()
    except StudyError as error:
        places = [("synthesis", "judge", *problem.key.split(".")[1:]) for problem in error.problems]
        raise StudyError([
            study.problem(problem.message, *place) for problem, place in zip(error.problems, places, strict=True)
        ]) from None  # fmt: skip
    if made.reliability is not None:
        table = ask(made, "reliability").tables["reliability"]
        rows = table.take(table["scope"] == "cycle")
        answer = Worth(*(float(rows[name][0]) for name in ("reliability", "low", "high")))
    if made.dynamics is not None:
        table = ask(made, "dynamics").tables["extremes"]
        rows = table.take(table.where(output=f"{made.mechanism.drives[0]}_effort"))
        answer = answer._replace(effort=float(max(np.abs([rows["min"][0], rows["max"][0]]))))
    return answer
