"""Summaries of many questions: a table, JUnit for CI, and a line for each failure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign.cli.execution import Outcome
from mechdesign.errors import printable, printable_lines
from mechdesign.experiments.columns import SUMMARY
from mechdesign.results import Table

if TYPE_CHECKING:
    from junitparser import JUnitXml

_SKIPPED = re.compile(r'(?<=") skipped="\d+"')
_MARK = b'<testsuites name="mechdesign"'  # beginning of our JUnit files


def mark(path: Path) -> bytes:
    """Mark of files that a JUnit file may replace: older JUnit files of ours; any file if it is named ``*.xml``."""
    return b"" if path.suffix == ".xml" else _MARK


def in_brief(given: Outcome) -> str:
    """The reason of a failed question, in one line."""
    why = [given.failed.splitlines()[0]] if given.failed else []
    why += [str(verdict) for verdict in given.verdicts if not verdict.met]
    return f"  {given.study}: {given.command}: {given.word}: {'; '.join(why)}"


def summary(answers: Sequence[Outcome]) -> Table:
    """Table of the outcomes, one row for each question."""
    rows = [given for given in answers if given.command]
    return SUMMARY.table(SUMMARY.columns(
        {}, study=[given.study for given in rows], command=[given.command for given in rows],
        outcome=[given.shard or given.word + " (kept)" * given.kept for given in rows],
        exit_code=[given.exit_code for given in rows], requirements=[
            f"{sum(verdict.met for verdict in given.verdicts)}/{len(given.verdicts)}" if given.verdicts else ""
            for given in rows
        ],
        rows=[given.rows for given in rows], warnings=[len(given.warnings) for given in rows],
        directory=[str(given.directory) if given.rows else "" for given in rows],
    ))  # fmt: skip


def junit(answers: Sequence[Outcome]) -> str:
    """JUnit XML for CI servers: a suite for each study, with a case for each command and each requirement.

    A requirement that is not met is a failure, a command without a result an error, a command not reached skipped.
    """
    from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

    report = JUnitXml("mechdesign")
    for study, group in groupby(answers, key=lambda given: given.study):
        study = printable(study)
        suite, name = TestSuite(study or "mechdesign"), f"mechdesign.{study}".rstrip(".")
        for given in group:
            case = TestCase(given.command or "run", classname=name, time=round(given.seconds, 3))
            if given.exit_code > 1:
                failed = printable_lines(given.failed)
                error = Error(failed.partition("\n")[0] or "failed", type_=f"exit code {given.exit_code}")
                error.text = failed
                case.result = [error]
            if given.left:
                case.result = [Skipped("the run ended before it")]
            if given.warnings:
                case.system_out = "\n".join(f"warning: {printable(str(warning))}" for warning in given.warnings)
            suite.add_testcase(case)
            for verdict in given.verdicts:
                case = TestCase(f"{given.command}: {printable(verdict.requirement)}", classname=name, time=0)
                if not verdict.met:
                    case.result = [Failure(printable(str(verdict)), type_="requirement")]
                suite.add_testcase(case)
        report.add_testsuite(suite)
    return junit_text(report)


def junit_text(report: JUnitXml) -> str:
    """The text of a JUnit report, with its counts."""
    report.update_statistics()  # type: ignore[no-untyped-call]
    text = report.tostring()  # type: ignore[no-untyped-call]
    # Jenkins' schema (junit-10.xsd of its xunit plugin) allows this attribute in suites only.
    body = _SKIPPED.sub("", text.decode(), count=1)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n'
