"""`run`: every question of every study, one summary, and a JUnit report for CI."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign.cli import terminal
from mechdesign.cli.execution import Outcome, answer, claim, folder, load_study, tell
from mechdesign.cli.options import Options
from mechdesign.commands import COMMANDS
from mechdesign.errors import Interrupted, StudyError, explain
from mechdesign.threads import one_thread

if TYPE_CHECKING:
    from mechdesign.results import Table
    from mechdesign.study import Study

_OUTCOMES = {
    0: "done",
    1: "requirement not met",
    2: "wrong study",
    3: "cannot be assembled",
    4: "failed",
    Interrupted.exit_code: "interrupted",
}


def questions(study: Study) -> tuple[str, ...]:
    """The commands a study asks for: those with a section or a requirement; how it moves, if it asks for nothing."""
    from mechdesign.report.requirements import command_of

    judged = {command_of(requirement) for requirement in study.requirements}
    asked = [command for command in COMMANDS if command in study.questions or command in judged]
    return tuple(asked) or ("kinematics",)


@one_thread()
def run(paths: Sequence[Path], options: Options) -> int:
    """Answer every question of the studies; returns the exit code, the highest of them all.

    A study or question that fails does not stop the others, unless `options.fail_fast`. An interrupt ends the run; the
    summary and the JUnit file then tell what was finished.
    """
    answers: list[Outcome] = []
    try:
        for given in _answers(paths or [None], options):
            answers.append(given)
            if given.exit_code and options.fail_fast:
                break
    except KeyboardInterrupt:
        terminal.say("interrupted; what was finished is whole")
        answers.append(Outcome("", "", Path(), Interrupted.exit_code, 0, failed="interrupted"))
    terminal.show(_summary(answers), as_json=options.json)
    if options.junit is not None:
        from mechdesign.cli.junit import to_xml
        from mechdesign.report.writer import write_file

        write_file(options.junit, to_xml(answers).encode())
    return max(given.exit_code for given in answers)


def _answers(paths: Sequence[Path | None], options: Options) -> Iterator[Outcome]:
    """Answers of all studies in order; every study is read before the first is computed."""
    studies: list[Study] = []
    for path in paths:
        try:
            studies.append(load_study(path, options))
        except Exception as error:
            yield _failure(path.stem if path else "study", "check", Path(), error)
    owners: dict[str, Path | None] = {}
    for study in studies:
        label = study.label
        try:
            claim(owners, study)
        except StudyError as error:
            yield _failure(label, "check", Path(), error)
            continue
        root = folder(study, "", options, several=len(paths) > 1)
        for command in questions(study):
            yield _ask(study, command, root / command, options)


def _ask(study: Study, command: str, directory: Path, options: Options) -> Outcome:
    label = study.label
    try:
        given = answer(study, command, directory, options)
    except Exception as error:
        return _failure(label, command, directory, error)
    tell(given, options)
    return given


def _failure(label: str, command: str, directory: Path, error: Exception) -> Outcome:
    code, message = explain(error)
    terminal.say(message if code == 2 else f"{label}: {command}: {message}")
    return Outcome(label, command, directory, code, 0, failed=message)


def _summary(answers: Sequence[Outcome]) -> Table:
    import numpy as np

    from mechdesign.results import Column, Table

    answers = [given for given in answers if given.command]

    def words(values: list[str]) -> np.ndarray[tuple[int], np.dtype[np.str_]]:
        return np.array(values, dtype=np.str_)

    def met(given: Outcome) -> str:
        return f"{sum(verdict.met for verdict in given.verdicts)}/{len(given.verdicts)}" if given.verdicts else ""

    return Table(
        "summary",
        (
            Column("study", words([given.study for given in answers])),
            Column("command", words([given.command for given in answers])),
            Column("outcome", words([_OUTCOMES[given.exit_code] + " (kept)" * given.kept for given in answers])),
            Column("exit_code", np.array([given.exit_code for given in answers], dtype=int)),
            Column("requirements", words([met(given) for given in answers])),
            Column("rows", np.array([given.rows for given in answers], dtype=int)),
            Column("warnings", np.array([len(given.warnings) for given in answers], dtype=int)),
            Column("directory", words([str(given.directory) if given.rows else "" for given in answers])),
        ),
        meaning="what became of each question",
    )
