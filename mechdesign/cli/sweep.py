"""`sweep`: the cases of a matrix that the study or the command line gives."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mechdesign.cli.batch_record import failure, name_of
from mechdesign.cli.execution import ask
from mechdesign.cli.options import Options
from mechdesign.cli.outcome import Outcome
from mechdesign.cli.summary import junit
from mechdesign.errors import Interrupted, Problem, StudyError
from mechdesign.experiments.schema.matrix import RANGE
from mechdesign.records import check_replaceable
from mechdesign.report.writer import write_file
from mechdesign.study.text.document import in_yaml, read


@dataclass(frozen=True)
class Matrix:
    """The options that make the cases; those left out are the study's."""

    vary: Sequence[str] | None = None
    method: str | None = None
    samples: int | None = None
    cases: Path | None = None
    results: Sequence[str] | None = None
    maximize: Sequence[str] | None = None
    minimize: Sequence[str] | None = None
    sort: bool = False

    def overrides(self, study: Path | None) -> Iterator[str]:
        """The options as overrides of the section ``matrix``; new cases replace the study's whole design of cases.

        Raises
        ------
        StudyError
            If a text is no entry with its values, or both entries and a file are given.
        """
        if self.vary and self.cases is not None:
            raise StudyError("--vary and --cases contradict each other: the cases of a file are as they are")
        if self.vary or self.cases is not None:
            yield from (f"matrix.{key}=" for key in ("vary", "method", "samples", "cases"))
        if self.vary:
            varied = [_varied(option) for option in self.vary]
            names = [name for name, _ in varied]
            for name in names:
                if names.count(name) > 1:
                    raise StudyError(f"--vary {name} is given twice; list its values with commas between them")
            yield f"matrix.vary={in_yaml(dict(varied))}"
        if self.cases is not None:
            here = study is not None or Path("study.yaml").exists()
            beside = study.parent if study is not None else Path()
            # The built-in study lies elsewhere.
            file = os.path.relpath(self.cases, beside) if here else os.path.abspath(self.cases)
            yield f"matrix.cases={in_yaml(file)}"
        if self.maximize or self.minimize:
            yield from (f"matrix.best.{key}=" for key in ("maximize", "minimize"))
        lists = {"results": self.results, "best.maximize": self.maximize, "best.minimize": self.minimize}
        values: dict[str, Any] = {"method": self.method, "samples": self.samples, "best.sort": self.sort or None}
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
    """The mistakes of overrides from `Matrix.overrides`, with the options that gave them."""
    written = re.compile(r"--set matrix\.(?:best\.)?(\w+)=.*")
    return StudyError([replace(problem, file=written.sub(r"--\1", problem.file)) for problem in error.problems])


def sweep(path: Path | None, options: Options, matrix: Matrix) -> int:
    """Answer the cases of a study; returns the exit code, the highest of them all."""
    outcome, label = None, name_of(path)
    if options.junit is not None:
        check_replaceable(options.junit)
    try:
        changes = (*(options.overrides or ()), *matrix.overrides(path))
        outcome = ask("sweep", path, replace(options, overrides=changes))
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
