"""`export`: files of a study for other tools."""

from __future__ import annotations

from pathlib import Path

from mechdesign.door.cli import terminal
from mechdesign.door.cli.annotations import annotate, of_warnings
from mechdesign.door.cli.execution import load_study
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.places import RESULTS
from mechdesign.door.exporting.exports import export_named
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.door.report.manifest import read_by
from mechdesign.door.report.requirements import on_warnings
from mechdesign.door.report.writer import write_file
from mechdesign.ground.files import check_writable
from mechdesign.ground.records import check_replaceable
from mechdesign.ground.work.threads import one_thread


@one_thread()
def export(options: Options) -> int:
    """Write one file of a study in a pose, with a rate or on a paper (see `PosedStudy`); returns the exit code."""
    to, declared = options.to, export_named(options.to)
    study = load_study(options.path, options)
    target = options.out or RESULTS / study.label / "export"
    if options.out is None or target.is_dir() or target.suffix != Path(to).suffix:
        target /= to
    check_writable(target.parent)
    check_replaceable(target, read_by(study))
    view = PosedStudy(study, options.at, options.rate, options.paper)
    content = declared.make(view)
    warnings = content.warnings + declared.ignored(view)
    for warning in warnings:
        terminal.say(f"{study.label}: export: warning: {warning} [{warning.kind}]", quiet=options.quiet)
    annotate("warning", of_warnings(study, "export", warnings))
    unmet = [verdict for verdict in on_warnings(study, warnings) if not verdict.met]
    for verdict in unmet:
        terminal.say(f"{study.label}: requirement: {verdict}")
    data = content.data.encode() if isinstance(content.data, str) else content.data
    write_file(target, data)
    terminal.say(f"{study.label}: {target}", quiet=options.quiet)
    return 1 if unmet else 0
