"""The Typer application: one thin function a command; whatever is heavy is imported by the command that needs it."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from inspect import Parameter, Signature
from typing import Annotated, Any

import typer

from mechdesign.cli import options as given
from mechdesign.cli import process
from mechdesign.cli.options import BUILT_IN, Options
from mechdesign.commands import COMMANDS, MERGE, SENSITIVITIES, SWEEP
from mechdesign.errors import EXIT_CODES, Interrupted

app = typer.Typer(
    name="mechdesign",
    help="Design studies of planar mechanisms: one study file, five questions, tables and pictures.",
    epilog="Exit codes: " + ". ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    add_completion=False,
    no_args_is_help=True,
    # Rich would cost --help a tenth of a second.
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@contextmanager
def _guard() -> Iterator[None]:
    """Turn what is raised inside into a message on stderr and an exit code; nobody sees a traceback."""
    try:
        yield
    except KeyboardInterrupt:
        print("interrupted; what was finished is whole", file=sys.stderr)
        raise typer.Exit(Interrupted.exit_code) from None
    except typer.Exit:
        raise
    except Exception as error:
        from mechdesign.cli.docs import explained

        code, message = explained(error)
        print(message, file=sys.stderr)
        raise typer.Exit(code) from None


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


def _add(name: str, takes: Sequence[Parameter], short: str, long: str) -> None:
    """Add a command: its arguments and options, and its help; what it runs is imported when it is called."""

    def command(**said: Any) -> None:
        with _guard():
            if name == "compare":
                from mechdesign.cli.compare import compare

                raise typer.Exit(compare(**said))
            chosen: dict[str, Any] = {
                key: said.pop(key) for key in ("vary", "method", "samples", "cases", "results") if key in said
            }
            study, options = said.pop("study"), Options(command=name, **said)
            with _placed(options):
                raise typer.Exit(_called(name, study, options, chosen))

    command.__signature__ = Signature(takes)  # type: ignore[attr-defined]
    app.command(name, short_help=short, help=long)(command)


def _called(name: str, study: Any, options: Options, chosen: Mapping[str, Any]) -> int:
    """The exit code of a command that takes studies; `chosen` is what the options say of a sweep's cases."""
    if name in COMMANDS or name == SENSITIVITIES.name:
        from mechdesign.cli.execution import ask

        return ask(name, study, options).exit_code
    if name == SWEEP.name:
        from mechdesign.cli.sweep import Matrix, sweep

        return sweep(study, options, Matrix(**chosen))
    if options.verify is not None:
        from mechdesign.cli.compare import verify

        return verify(study, options)
    from mechdesign.cli import batch

    return (batch.check if name == "check" else batch.run)(study, options)


def _placed(options: Options) -> AbstractContextManager[None]:
    """Where great work goes."""
    if options.executor is None:
        return nullcontext()
    from mechdesign.executors import named
    from mechdesign.parallel import on

    return on(named(options.executor, options.jobs))


for _name, _asked in (*COMMANDS.items(), (SENSITIVITIES.name, SENSITIVITIES)):
    _takes = (*given.COMMON, given.REPORT, *given.OWN.get(_name, ()))
    _add(_name, _takes, _asked.question, f"{_asked.question} {_asked.answer}")
_add(
    SWEEP.name,
    (
        *given.COMMON[:2], given.VARY, given.METHOD, given.SAMPLES, given.CASES, given.RESULTS, *given.COMMON[2:],
        given.REPORT, given.JUNIT, given.RESUME_DESIGNS, given.EXECUTOR, given.SHARD,
    ),
    SWEEP.question,
    f"{SWEEP.question} {SWEEP.answer}",
)  # fmt: skip
_add(
    "run",
    (
        given.STUDIES, given.OUT_ALL, *given.COMMON[2:], given.REPORTS, given.ANIMATE, given.JUNIT, given.FAIL_FAST,
        given.RESUME, given.VERIFY, given.EXECUTOR, given.SHARD,
    ),
    "Answer every question that each study asks.",
    "Answer every question that each study asks, each in a folder of its own; one summary for all.",
)  # fmt: skip
_add(
    MERGE,
    (
        given.STUDIES, given.OUT_ALL, *given.COMMON[2:], given.REPORTS, given.ANIMATE, given.JUNIT, given.FAIL_FAST,
        given.EXECUTOR,
    ),
    "Put together what runs with --shard computed.",
    "Put together what runs with --shard computed: what a run without it gives, byte by byte. Options that change "
    "numbers, such as --set and --seed, and --out are given again.",
)  # fmt: skip
_add(
    "check",
    (
        given.STUDIES,
        given.OUT_DRAWINGS,
        given.OVERRIDES,
        given.QUIET,
        given.NO_PLOTS,
        given.FORMAT,
        given.STYLE,
        given.ALLOW_FILES,
    ),
    "Validate only: joints, mobility, plan of solution.",
    "Validate only: say the joints, the mobility and how the mechanism is solved, and draw the sketch.",
)
_add(
    "compare",
    (
        given.OLD, given.NEW, given.RTOL, given.ATOL, given.TOLERANCES, given.OUT_DIFFERENCES, given.JUNIT, given.JSON,
        given.QUIET,
    ),
    "Say what moved between two folders of results.",
    "Say what moved between two folders of results, of one command, a study or many: rows are matched by their poses "
    "and keys, folders by their paths. Exit codes: 0 equal within the tolerance, 1 something moved, is missing or is "
    "new, 2 there is nothing to compare.",
)  # fmt: skip


@app.command("new")
def new(
    template: Annotated[
        str | None,
        typer.Argument(metavar="[TEMPLATE]", help="Name of a template; a wrong name lists them.", show_default=False),
    ] = None,
) -> None:
    """Print a commented study to start from."""
    with _guard():
        from mechdesign.cli.terminal import emit
        from mechdesign.study import template as template_text

        emit(template_text(template or BUILT_IN))


@app.command("docs", context_settings={"ignore_unknown_options": True})
def docs(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[WORD]...",
            help="Keys of the study (kinematics.sweep, sweep), commands, options, indices, units, ...",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Say what words mean; without any, which there are."""
    with _guard():
        import typer.main

        from mechdesign.cli.docs import show

        group: Any = typer.main.get_command(app)
        show(words or (), group.commands)


@app.command("schema", short_help="Print the JSON Schema of the study file.")
def schema() -> None:
    """Print the JSON Schema of the study file, with which editors complete and check it."""
    with _guard():
        import json

        from mechdesign.cli.terminal import emit
        from mechdesign.study import schema as study_schema

        emit(json.dumps(study_schema(), indent=2, ensure_ascii=False) + "\n")


def main() -> None:
    """The command in a process of its own."""
    process.run(app)
