"""Summaries of many questions: a table, JUnit for CI, and a line for each failure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from mechdesign.door.cli.outcome import Outcome
from mechdesign.experiments.columns import SUMMARY
from mechdesign.ground.errors import printable, printable_lines
from mechdesign.ground.results import Table

if TYPE_CHECKING:
    from junitparser import TestCase

_SKIPPED = re.compile(r'(?<=") skipped="\d+"')


def in_brief(outcome: Outcome) -> str:
    """The reason of a failed question, in one line."""
    why = [outcome.failed.splitlines()[0]] if outcome.failed else []
    why += [str(verdict) for verdict in outcome.verdicts if not verdict.met]
    return f"  {outcome.study}: {outcome.command}: {outcome.word}: {'; '.join(why)}"


def summary(outcomes: Sequence[Outcome]) -> Table:
    """Table of the outcomes, one row for each question."""
    rows = [outcome for outcome in outcomes if outcome.command]
    return SUMMARY.table(SUMMARY.columns(
        {}, study=[outcome.study for outcome in rows], command=[outcome.command for outcome in rows],
        outcome=[outcome.word + " (kept)" * outcome.kept for outcome in rows],
        exit_code=[outcome.exit_code for outcome in rows], requirements=[
            f"{sum(verdict.met for verdict in outcome.verdicts)}/{len(outcome.verdicts)}" if outcome.verdicts else ""
            for outcome in rows
        ],
        rows=[outcome.rows for outcome in rows], warnings=[len(outcome.warnings) for outcome in rows],
        directory=[str(outcome.directory) if outcome.rows else "" for outcome in rows],
    ))  # fmt: skip


def junit(outcomes: Sequence[Outcome]) -> str:
    """JUnit XML for CI servers: a suite for each study, with a case for each command and each requirement.

    A requirement that is not met is a failure, a command without a result an error, a command not reached skipped.
    """
    from junitparser import Error, Failure, Skipped, TestCase

    suites: dict[str, list[TestCase]] = {}
    for outcome in outcomes:
        study = printable(outcome.study)
        name, cases = f"mechdesign.{study}".rstrip("."), suites.setdefault(study or "mechdesign", [])
        case = TestCase(outcome.command or "run", classname=name, time=round(outcome.seconds, 3))
        if outcome.exit_code > 1:
            failed = printable_lines(outcome.failed)
            error = Error(failed.partition("\n")[0] or "failed", type_=f"exit code {outcome.exit_code}")
            error.text = failed
            case.result = [error]
        if outcome.left:
            case.result = [Skipped("the run ended before it")]
        if outcome.warnings:
            case.system_out = "\n".join(f"warning: {printable(str(warning))}" for warning in outcome.warnings)
        cases.append(case)
        for verdict in outcome.verdicts:
            case = TestCase(f"{outcome.command}: {printable(verdict.requirement)}", classname=name, time=0)
            if not verdict.met:
                case.result = [Failure(printable(str(verdict)), type_="requirement")]
            cases.append(case)
    return junit_text(suites)


def junit_text(suites: Mapping[str, Sequence[TestCase]]) -> str:
    """The text of a JUnit report of some suites, with its counts."""
    from junitparser import JUnitXml, TestSuite

    report = JUnitXml("mechdesign")
    for name, cases in suites.items():
        suite = TestSuite(name)
        for case in cases:
            suite.add_testcase(case)
        report.add_testsuite(suite)
    report.update_statistics()  # type: ignore[no-untyped-call]
    text = report.tostring()  # type: ignore[no-untyped-call]
    # Jenkins' schema (junit-10.xsd of its xunit plugin) allows this attribute in suites only.
    body = _SKIPPED.sub("", text.decode(), count=1)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n'
