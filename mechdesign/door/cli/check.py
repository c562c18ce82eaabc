"""`check`: describe studies and find their mistakes without computing anything."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from mechdesign.commands import COMMANDS
from mechdesign.door.cli import terminal
from mechdesign.door.cli.annotations import annotate, of_error
from mechdesign.door.cli.batch import source_of, study_files
from mechdesign.door.cli.docs import explained
from mechdesign.door.cli.execution import load_source
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.places import claim, extras, folder
from mechdesign.door.report.names import MECHANISM
from mechdesign.door.report.requirements import foresee, on_warnings
from mechdesign.door.report.writer import check_sketch, write_sketch
from mechdesign.ground.errors import Problem, StudyError, printable
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism.describe import describe, sketch_doubts
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.dynamics.question import weighed_beams
from mechdesign.questions.reliability.schema.section import in_words
from mechdesign.questions.synthesize.words import task
from mechdesign.study import Study


@one_thread()
def check(options: Options) -> int:
    """Validate studies, describe their mechanisms on stdout and draw them; returns the highest exit code."""
    worst = 0
    owners: dict[str, Path | None] = {}
    files = study_files(options.paths)
    for path in files:
        try:
            study = load_source(source_of(path, options), options)
            label = study.label
            drawn = not (options.no_plots or study.is_task)
            if drawn:
                claim(owners, study)
                directory, output = folder(study, "check", options, several=len(files) > 1), extras("check", options)
                check_sketch(directory, study, output)
            if not options.quiet:
                terminal.emit_words("\n".join([printable(f"{label}: {study.name}"), *_described(study), ""]))
            cautions = assumed(study) if study.dynamics is not None else []
            doubts = cautions if study.is_task else [*sketch_doubts(study.mechanism), *cautions]
            for caution in cautions:
                terminal.say(f"{label}: warning: {caution} [{caution.kind}]", quiet=options.quiet)
            for warning in study.warnings:
                terminal.say(f"{label}: warning: {warning} [suspect]", quiet=options.quiet)
            annotate("warning", study.warnings)
            for verdict in on_warnings(study, doubts):
                if not verdict.met:
                    terminal.say(f"{label}: requirement: {verdict}")
                    worst = max(worst, 1)
            _foresee(study)
            if drawn:
                terminal.say(f"{label}: {write_sketch(directory, study, output)}", quiet=options.quiet)
                if len(files) == 1:
                    terminal.suggest(directory / f"{MECHANISM}.{options.kinds.split(',')[0]}", quiet=options.quiet)
        except Exception as error:
            code, message = explained(error)
            terminal.say(message)
            annotate("error", of_error(error, message))
            worst = max(worst, code)
    return worst


def _described(study: Study) -> Iterator[str]:
    """The mechanism of a study, if it has one, and its task."""
    if not study.is_task:
        yield describe(study.mechanism)
        yield from in_words(study.reliability, study.mechanism.graph, study.sizes)
        yield from _massless(study)
    yield from task(study)


def _massless(study: Study) -> list[str]:
    """Links of a study of dynamics that have neither a mass nor beams with a density, as a line."""
    if study.dynamics is None:
        return []
    description = study.mechanism.description
    weighed = {GROUND, *description.masses, *weighed_beams(study)}
    links = [link for link in description.links if link not in weighed]
    return [f"massless: {', '.join(links)}"] if links else []


def _foresee(study: Study) -> None:
    """Check that results named by requirements, matrix and sensitivities exist; all mistakes are raised together."""
    looks: list[Callable[[], object]] = [partial(foresee, study, COMMANDS, goals=True)]
    # Both import all questions.
    if study.matrix is not None:
        from mechdesign.experiments import sweep

        looks.append(partial(sweep.prepared, study))
    if study.sensitivities is not None:
        from mechdesign.experiments import sensitivities

        looks.append(partial(sensitivities.prepared, study))
    problems: dict[Problem, None] = {}
    for look in looks:
        try:
            look()
        except StudyError as error:
            problems |= dict.fromkeys(error.problems)
    if problems:
        raise StudyError([*problems])
