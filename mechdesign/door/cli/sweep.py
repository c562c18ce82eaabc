"""`sweep`: the cases of a matrix that the study or the command line gives."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechdesign.door.cli.batch_record import failure
from mechdesign.door.cli.execution import ask
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.outcome import Outcome
from mechdesign.door.cli.summary import junit
from mechdesign.door.report.writer import write_file
from mechdesign.experiments.schema.matrix import RANGE
from mechdesign.ground.errors import Interrupted, Problem, StudyError
from mechdesign.ground.files import way
from mechdesign.ground.records import check_replaceable
from mechdesign.study.loaded import folder_name
from mechdesign.study.text.document import in_yaml, read


def _overrides(options: Options) -> Iterator[str]:
    """The options that make the cases as overrides of the section ``matrix``; those left out are the study's.

    New cases replace the study's whole design of cases.

    Raises
    ------
    StudyError
        If a text is no entry with its values, or both entries and a file are given.
    """
    study, vary, cases = options.path, options.vary, options.cases
    if vary and cases is not None:
        raise StudyError("--vary and --cases contradict each other: the cases of a file are as they are")
    if vary or cases is not None:
        yield from (f"matrix.{key}=" for key in ("vary", "method", "samples", "cases"))
    if vary:
        varied = [_varied(option) for option in vary]
        names = [name for name, _ in varied]
        for name in names:
            if names.count(name) > 1:
                raise StudyError(f"--vary {name} is given twice; list its values with commas between them")
        yield f"matrix.vary={in_yaml(dict(varied))}"
    if cases is not None:
        here = study is not None or Path("study.yaml").exists()
        beside = study.parent if study is not None else Path()
        # The built-in study lies elsewhere.
        file = way(cases, beside) if here else os.path.abspath(cases)
        yield f"matrix.cases={in_yaml(file)}"
    if options.maximize or options.minimize:
        yield from (f"matrix.best.{key}=" for key in ("maximize", "minimize"))
    lists = {"results": options.results, "best.maximize": options.maximize, "best.minimize": options.minimize}
    values: dict[str, Any] = {
        "method": options.method, "samples": options.samples, "best.sort": options.sort or None
    }  # fmt: skip
    values |= {
        key: [name.strip() for text in texts for name in text.split(",")] for key, texts in lists.items() if texts
    }
    yield from (f"matrix.{key}={in_yaml(value)}" for key, value in values.items() if value is not None)


def _varied(text: str) -> tuple[str, Any]:
    """An entry and its values: a range, or a list separated by commas."""
    name, separator, values = text.partition("=")
    name, values = name.strip(), values.strip()
    label = f"--vary {text}"
    if not separator or not name or not values:
        raise StudyError([Problem("is <dotted name>=START:STOP:STEP, =LOW:HIGH or =VALUE,VALUE,...", file=label)])
    if RANGE.fullmatch(values):
        return name, values
    listed = read(f"[{values}]".encode(errors="surrogateescape"), label)
    if listed.problems:
        raise StudyError(listed.problems)
    return name, listed.data


def _as_typed(error: StudyError) -> StudyError:
    """The mistakes of `_overrides`, with the options that gave them."""
    written = re.compile(r"--set matrix\.(?:best\.)?(\w+)=.*")
    return StudyError([replace(problem, file=written.sub(r"--\1", problem.file)) for problem in error.problems])


def sweep(options: Options) -> int:
    """Answer the cases that a study and options make; returns the highest exit code of them."""
    outcome, label = None, folder_name(options.path)
    if options.junit is not None:
        check_replaceable(options.junit)
    try:
        outcome = ask(replace(options, overrides=[*(options.overrides or ()), *_overrides(options)]))
        return outcome.exit_code
    except KeyboardInterrupt as stop:
        words = str(stop) or "interrupted"
        outcome = Outcome(label, "sweep", Path(), Interrupted.exit_code, 0, failed=words)
        raise
    except Exception as wrong:
        error = _as_typed(wrong) if isinstance(wrong, StudyError) else wrong
        outcome = failure(label, "sweep", Path(), error)
        return outcome.exit_code
    finally:
        if options.junit is not None and outcome is not None:
            write_file(options.junit, junit([outcome]).encode())
