"""The Typer application: one thin function a command; whatever is heavy is imported by the command that needs it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from mechdesign.cli import options as given
from mechdesign.cli.execution import BUILT_IN
from mechdesign.cli.failure import guard
from mechdesign.cli.options import Options
from mechdesign.commands import COMMANDS

app = typer.Typer(
    name="mechdesign",
    help="Design studies of planar mechanisms: one study file, four questions, tables and pictures.",
    epilog="Exit codes: 0 done, 1 a requirement not met, 2 wrong command or study, 3 the mechanism cannot do it, "
    "4 numerical failure or unwritable results, 130 interrupted.",
    add_completion=False,
    no_args_is_help=True,
    # Rich would cost --help a tenth of a second.
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        import mechdesign

        print(f"mechdesign {mechdesign.__version__}")
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""


def _command(name: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """A question's command, with its help."""
    asked = COMMANDS[name]
    return app.command(name, short_help=asked.question, help=f"{asked.question} {asked.answer}")


def _add_question(name: str) -> None:
    @_command(name)
    def question(
        study: given.StudyArgument = None,
        out: given.Out = None,
        overrides: given.Overrides = None,
        seed: given.Seed = None,
        jobs: given.Jobs = None,
        json: given.Json = False,
        quiet: given.Quiet = False,
        no_plots: given.NoPlots = False,
    ) -> None:
        with guard():
            from mechdesign.cli.execution import ask

            options = Options(out, tuple(overrides or ()), seed, jobs, json, quiet, not no_plots)
            raise typer.Exit(ask(study, name, options))


@_command("kinematics")
def kinematics(
    study: given.StudyArgument = None,
    out: given.Out = None,
    overrides: given.Overrides = None,
    seed: given.Seed = None,
    jobs: given.Jobs = None,
    json: given.Json = False,
    quiet: given.Quiet = False,
    no_plots: given.NoPlots = False,
    animate: given.Animate = False,
    all_modes: given.AllModes = False,
) -> None:
    """The question of motion, with the options that only it has."""
    with guard():
        from mechdesign.cli.execution import ask

        options = Options(
            out, tuple(overrides or ()), seed, jobs, json, quiet, not no_plots, animate=animate, all_modes=all_modes
        )
        raise typer.Exit(ask(study, "kinematics", options))


@_command("optimize")
def optimize(
    study: given.StudyArgument = None,
    out: given.Out = None,
    overrides: given.Overrides = None,
    seed: given.Seed = None,
    jobs: given.Jobs = None,
    json: given.Json = False,
    quiet: given.Quiet = False,
    no_plots: given.NoPlots = False,
    resume: given.ResumeDesigns = False,
) -> None:
    """The question of the best dimensions, which may take long and be gone on with."""
    with guard():
        from mechdesign.cli.execution import ask

        options = Options(out, tuple(overrides or ()), seed, jobs, json, quiet, not no_plots, resume=resume)
        raise typer.Exit(ask(study, "optimize", options))


for _name in COMMANDS:
    if _name not in ("kinematics", "optimize"):
        _add_question(_name)


@app.command("run", short_help="Answer every question that each study asks.")
def run(
    studies: given.StudiesArgument = None,
    out: given.OutAll = None,
    overrides: given.Overrides = None,
    seed: given.Seed = None,
    jobs: given.Jobs = None,
    json: given.Json = False,
    quiet: given.Quiet = False,
    no_plots: given.NoPlots = False,
    animate: given.Animate = False,
    junit: given.Junit = None,
    fail_fast: given.FailFast = False,
    resume: given.Resume = False,
) -> None:
    """Answer every question that each study asks, each in a folder of its own; one summary for all."""
    with guard():
        from mechdesign.cli import batch

        options = Options(
            out, tuple(overrides or ()), seed, jobs, json, quiet, not no_plots,
            animate=animate, fail_fast=fail_fast, resume=resume,
        )  # fmt: skip
        raise typer.Exit(batch.run(studies or [], options, junit))


@app.command("check", short_help="Validate only: joints, mobility, plan of solution.")
def check(
    studies: given.StudiesArgument = None,
    out: given.OutDrawings = None,
    overrides: given.Overrides = None,
    quiet: given.Quiet = False,
    no_plots: given.NoPlots = False,
) -> None:
    """Validate only: say the joints, the mobility and how the mechanism is solved, and draw the sketch."""
    with guard():
        from mechdesign.cli.checking import check_studies

        options = Options(out, tuple(overrides or ()), quiet=quiet, plots=not no_plots)
        raise typer.Exit(check_studies(studies or [None], options))


@app.command("new")
def new(
    template: Annotated[
        str | None,
        typer.Argument(metavar="[TEMPLATE]", help="Name of a template; a wrong name lists them.", show_default=False),
    ] = None,
) -> None:
    """Print a commented study to start from."""
    with guard():
        from mechdesign.cli.terminal import emit
        from mechdesign.study import template as template_text

        emit(template_text(template or BUILT_IN))


@app.command("schema", short_help="Print the JSON Schema of the study file.")
def schema() -> None:
    """Print the JSON Schema of the study file, with which editors complete and check it."""
    with guard():
        import json

        from mechdesign.cli.terminal import emit
        from mechdesign.study import schema as study_schema

        emit(json.dumps(study_schema(), indent=2, ensure_ascii=False) + "\n")


def main() -> None:
    """Entry point of the `mechdesign` command."""
    for stream in (sys.stdout, sys.stderr):
        # A name in a study must not fail on a terminal that lacks its letters.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    app()
