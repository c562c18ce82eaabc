"""`check` and `new`: what needs a study's text but no analysis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mechdesign.cli import terminal
from mechdesign.cli.execution import BUILT_IN, load_study, study_label
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


def template_text(name: str | None) -> str:
    """A commented study to start from.

    Raises
    ------
    StudyError
        If there is no template of that name; the message lists those there are.
    """
    from mechdesign.errors import StudyError
    from mechdesign.study import template, templates

    known = templates()
    name = name or BUILT_IN
    if name not in known:
        raise StudyError(f"no template {name!r}; there are {', '.join(sorted(known))}")
    return template(name)
