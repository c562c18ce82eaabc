"""Mistakes and warnings as annotations that GitHub shows beside the lines of a change."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from mechdesign.door.cli import terminal
from mechdesign.door.report.requirements import Verdict, judged_by
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechdesignError, Problem, StudyError
from mechdesign.study import Study

# https://docs.github.com/en/actions/reference/workflow-commands-for-github-actions
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = _DATA | str.maketrans({":": "%3A", ",": "%2C"})


def annotate(level: str, problems: Iterable[Problem]) -> None:
    """Write an ``error`` or ``warning`` annotation for each problem to stderr, if GitHub runs the command."""
    if os.environ.get("GITHUB_ACTIONS") != "true":
        return
    for problem in problems:
        # An option, or the name in brackets of a study given as a text, is no file.
        file = problem.file if os.path.exists(problem.file) else ""
        place = {"file": _in_repository(file), "line": problem.line or "", "col": problem.column or ""}
        where = ",".join(f"{name}={str(value).translate(_PROPERTY)}" for name, value in place.items() if value)
        option = problem.file if problem.file.startswith("--") and not file else ""
        message = ": ".join(filter(None, (option, problem.key, problem.message)))
        terminal.say(f"::{level}{' ' * bool(where)}{where}::{message.translate(_DATA)}")


def _in_repository(file: str) -> str:
    """Path of a file from the root of the repository, whatever the working directory."""
    top = os.environ.get("GITHUB_WORKSPACE", "")
    path = Path(os.path.abspath(file))
    return path.relative_to(top).as_posix() if file and top and path.is_relative_to(top) else file


def of_error(error: Exception, message: str, study: Study | None = None) -> Sequence[Problem]:
    """Problems of an error with their places, else one problem of the whole study file."""
    if isinstance(error, StudyError) and any(problem.file for problem in error.problems):
        return error.problems
    file = str(study.path) if study is not None and study.path is not None else ""
    return [Problem(str(error) if isinstance(error, MechdesignError) else message, file=file)]


def of_verdicts(study: Study, command: str, verdicts: Sequence[Verdict]) -> Iterator[Problem]:
    """Requirements and barred warnings of a command that are not met, with their places in the study."""
    places = [("requirements", index) for index in judged_by(study, command)] + [("fail_on",)] * len(study.barred)
    for place, verdict in zip(places, verdicts, strict=True):
        if not verdict.met:
            yield study.problem(f"requirement: {verdict}", *place)


def of_warnings(study: Study, command: str, warnings: Sequence[Caution]) -> Iterator[Problem]:
    """Warnings of a command with their places: line and column if they concern the study file."""
    placed = {str(problem): problem for problem in study.warnings}
    for warning in warnings:
        file = str(study.path) if study.path is not None else ""
        yield placed.get(str(warning)) or Problem(f"{study.label}: {command}: {warning}", file=file)
