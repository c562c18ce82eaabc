"""`check`: what a study says, without computing anything."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mechdesign.cli import terminal
from mechdesign.cli.execution import load_study, study_label
from mechdesign.cli.failure import explain
from mechdesign.cli.options import Options


def check_studies(paths: Sequence[Path | None], options: Options) -> int:
    """Validate studies and describe their mechanisms on stdout; returns the highest exit code."""
    worst = 0
    for path in paths:
        try:
            study = load_study(path, options)
        except Exception as error:
            code, message = explain(error)
            terminal.say(message)
            worst = max(worst, code)
            continue
        if not options.quiet:
            terminal.emit(f"{study_label(study)}: {study.name}\n{study.mechanism.describe()}\n")
    return worst
