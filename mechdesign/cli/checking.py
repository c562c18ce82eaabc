"""`check`: what a study says, without computing more than what its requirements' columns are called."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mechdesign.cli import terminal
from mechdesign.cli.execution import claim, folder, load_study
from mechdesign.cli.options import Options
from mechdesign.commands import COMMANDS
from mechdesign.errors import explain
from mechdesign.threads import one_thread


@one_thread()
def check_studies(paths: Sequence[Path | None], options: Options) -> int:
    """Validate studies, describe their mechanisms on stdout and draw them; returns the highest exit code."""
    from mechdesign.mechanism.describe import describe
    from mechdesign.report.requirements import foresee
    from mechdesign.study.schema.reliability import in_words

    worst = 0
    owners: dict[str, Path | None] = {}
    for path in paths:
        try:
            study = load_study(path, options)
            label = study.label
            if not options.quiet:
                clearances = in_words(study.reliability, study.mechanism.graph)
                terminal.emit("\n".join([f"{label}: {study.name}", describe(study.mechanism), *clearances, ""]))
            for warning in study.warnings:
                terminal.say(f"warning: {warning}", quiet=options.quiet)
            foresee(study, COMMANDS)
            if not options.no_plots:
                from mechdesign.report.writer import write_sketch

                claim(owners, study)
                directory = folder(study, "check", options, several=len(paths) > 1)
                terminal.say(f"{label}: {write_sketch(directory, study)}", quiet=options.quiet)
        except Exception as error:
            code, message = explain(error)
            terminal.say(message)
            worst = max(worst, code)
    return worst
