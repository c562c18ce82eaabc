"""Outcomes as JUnit XML, which every CI server shows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from mechdesign.cli.execution import Outcome


def to_xml(answers: Sequence[Outcome]) -> str:
    """A suite a study; a case a command, and a case a requirement.

    A requirement that is not met is a failure; whatever kept a command from its result is an error.
    """
    report = JUnitXml("mechdesign")
    for study, group in groupby(answers, key=lambda given: given.study):
        suite = TestSuite(study or "mechdesign")
        for given in group:
            suite.add_testcases(_cases(given))
        report.add_testsuite(suite)
    report.update_statistics()  # type: ignore[no-untyped-call]
    text = report.tostring()  # type: ignore[no-untyped-call]
    body = text.decode() if isinstance(text, bytes) else str(text)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n'


def _cases(given: Outcome) -> list[TestCase]:
    name = ".".join(part for part in ("mechdesign", given.study) if part)
    case = TestCase(given.command or "run", classname=name, time=round(given.seconds, 3))
    if given.exit_code > 1:
        error = Error(given.failed.splitlines()[0] if given.failed else "failed", type_=f"exit code {given.exit_code}")
        error.text = given.failed
        case.result = [error]
    cases = [case]
    for verdict in given.verdicts:
        case = TestCase(f"{given.command}: {verdict.requirement}", classname=name, time=0)
        if not verdict.met:
            case.result = [Failure(str(verdict), type_="requirement")]
        cases.append(case)
    return cases
