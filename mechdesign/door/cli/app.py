"""The Typer application: one short function a command, which imports NumPy and the like only when it is called."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from copy import copy
from importlib import import_module
from inspect import Signature
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from mechdesign.commands import COMMANDS, MERGE, SENSITIVITIES, SWEEP
from mechdesign.door.cli import process
from mechdesign.door.cli.options import Options, parameters, with_kinds
from mechdesign.ground.errors import EXIT_CODES, Interrupted, StudyError

# Typer brings its own Click, or is built on the one that is installed.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]


@contextmanager
def _usage() -> Iterator[None]:
    """Tell a wrong use of the command line as other mistakes are told: in plain words, folded on a terminal."""
    try:
        yield
    except _UsageError as error:
        from mechdesign.door.cli.terminal import folded

        context, words = error.ctx, error.format_message()  # type: ignore[attr-defined]
        words = words.rstrip(".").replace("(Possible options: ", "(there is ")
        name = context.info_name if context is not None and context.parent is not None else ""
        command = f"mechdesign {name}".rstrip()
        message = f"{command}: {words[0].lower()}{words[1:]}\n{command} -h says what it takes"
        print(folded(message, sys.stderr), file=sys.stderr)
        raise typer.Exit(2) from None


# A line of a study that says what it is about.
_STUDY = re.compile(rb"^(mechanism|synthesis):", re.MULTILINE)
# Where there is none yet.
_FIRST_STEPS = (
    ("mechdesign new > study.yaml", "writes a commented study to change"),
    ("mechdesign run study.yaml --report", "answers it: open results/study/report.html"),
    ("mechdesign live study.yaml", "opens a page in which it is dragged"),
    ("mechdesign import FILE", "makes a study of another tool's file"),
    ("mechdesign docs WORD", "says what a word means, and which studies show it"),
)


class _Group(TyperGroup):
    """All commands."""

    alone = False  # whether it is called without arguments where there is no study

    def make_context(self, info_name: Any, args: list[str], parent: Any = None, **extra: Any) -> Any:
        self.alone = not args and not _is_study_here()
        # Without arguments there is the help.
        with _usage() if args else nullcontext():
            if "" in args:
                raise typer.BadParameter("an argument is empty, as of a variable of the shell that is not set")
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: Any) -> Any:
        with _usage():
            return super().invoke(ctx)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        super().format_epilog(ctx, formatter)
        if self.alone:
            with formatter.section("There is no study in this folder. To begin"):
                formatter.write_dl(_FIRST_STEPS, col_max=34)


def _is_study_here() -> bool:
    for file in (*Path().glob("*.yaml"), *Path().glob("*.yml")):
        with suppress(OSError):
            if file.is_file() and _STUDY.search(file.read_bytes()):
                return True
    return False


app = typer.Typer(
    name="mechdesign",
    cls=_Group,
    help="Design studies of planar mechanisms: one study file, seven questions, tables and pictures.",
    epilog="Exit codes: " + ". ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    no_args_is_help=True,
    # Without Rich, whose import takes a tenth of a second.
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@contextmanager
def _guard() -> Iterator[None]:
    """Turn an exception into a message on stderr and an exit code, without a traceback."""
    try:
        try:
            os.getcwd()
        except OSError as error:
            raise StudyError(f"the working folder is not there any more ({error.strerror}); change into one") from None
        yield
    except KeyboardInterrupt:
        print("interrupted; what was finished is whole", file=sys.stderr)
        raise typer.Exit(Interrupted.exit_code) from None
    except typer.Exit:
        raise
    except Exception as error:
        from mechdesign.door.cli.annotations import annotate, of_error
        from mechdesign.door.cli.docs import explained
        from mechdesign.door.cli.terminal import folded

        code, message = explained(error)
        print(folded(message, sys.stderr), file=sys.stderr)
        annotate("error", of_error(error, message))
        raise typer.Exit(code) from None


def _show_version(show: bool) -> None:
    if show:
        from platform import python_version, system

        from mechdesign.ground.versions import VERSION, installed

        libraries = ", ".join(f"{name} {installed(name.lower())}" for name in ("NumPy", "SciPy", "Matplotlib"))
        print(f"mechdesign {VERSION}\nPython {python_version()} on {system()}, {libraries}")
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            help="Print the versions of mechdesign and of what its numbers come from, and exit.",
        ),
    ] = False,
) -> None:
    """Options before the command."""


class _Command(TyperCommand):
    """A command whose `--report` may stand without a kind."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, with_kinds(args))


def _add(name: str, action: str, takes: str, short: str, long: str) -> None:
    """Add a command: its function, ``module.function`` of this package, what it takes, and its help."""
    module, _, function = action.partition(".")

    def command(**said: Any) -> None:
        with _guard():
            options = Options(name, **said)
            with _placed(options):
                answer: Callable[[Options], int] = getattr(import_module(f"mechdesign.door.cli.{module}"), function)
                raise typer.Exit(answer(options))

    command.__signature__ = Signature([*parameters(name, takes)])  # type: ignore[attr-defined]
    app.command(name, cls=_Command, short_help=short or None, help=long)(command)


def _placed(options: Options) -> AbstractContextManager[None]:
    """Context in which long computations run on the workers of `--executor`."""
    if options.executor is None:
        return nullcontext()
    from mechdesign.ground.work.chunks import on
    from mechdesign.ground.work.executors import named

    return on(named(options.executor, options.jobs))


_LOOKS = "no_plots formats style"
_COMMON = f"overrides seed jobs json quiet strict {_LOOKS} allow_files report"
_ALONE = f"path out {_COMMON}"
_MANY = f"paths out {_COMMON} animate junit fail_fast"
_OWN = {
    "kinematics": "animate all_modes before",
    "workspace": "before",
    "optimize": "resume executor",
    "reliability": "executor",
    "sensitivities": "executor",
}
for _name, _question in (*COMMANDS.items(), (SENSITIVITIES.name, SENSITIVITIES)):
    _takes = f"{_ALONE} {_OWN.get(_name, '')}"
    _add(_name, "execution.question", _takes, _question.question, f"{_question.question} {_question.answer}")
_add(
    SWEEP.name, "sweep.sweep",
    f"path out vary method samples cases results maximize minimize sort {_COMMON} junit resume executor shard",
    SWEEP.question, f"{SWEEP.question} {SWEEP.answer}",
)  # fmt: skip
_add(
    "run", "batch.run", f"{_MANY} resume verify executor shard",
    "Answer every question that each study asks.",
    "Answer every question that each study asks, each in a folder of its own; one summary for all.",
)  # fmt: skip
_add(
    MERGE, "batch.run", f"{_MANY} executor",
    "Put together what runs with --shard computed.",
    "Put together what runs with --shard computed: what a run without it gives, byte by byte. What they changed, "
    "such as by --set and --seed, is kept with them; --out is given again.",
)  # fmt: skip
_add(
    "check", "check.check", f"paths out overrides quiet strict {_LOOKS} allow_files",
    "Validate only: joints, mobility, plan of solution.",
    "Validate only: say the joints, the mobility and how the mechanism is solved, and draw the sketch.",
)  # fmt: skip
_add(
    "export", "export.export", "path to! at rate paper out overrides quiet strict allow_files",
    "Write a file for other tools: parts to cut, a drawing, a simulator's model.",
    "Write a file for other tools: every link as a part to cut at 1:1, the mechanism as a drawing, the layers in which "
    "nothing meets, a drawing sheet, a model for MuJoCo, curves, the motion for a controller, the study as JSON.",
)  # fmt: skip
_add(
    "watch", "watch.watch",
    f"path! commands out overrides seed jobs quiet strict {_LOOKS} report animate allow_files",
    "Answer a study's questions again whenever it is saved.",
    "Answer a study's questions, or only some, now and whenever it or a file that it names is saved. Mistakes are "
    "told, and it goes on until Ctrl-C.",
)  # fmt: skip
_add(
    "live", "live.live", "path! port no_browser overrides seed quiet allow_files",
    "Change a study by hand: a page in which dimensions are dragged.",
    "Open a page on this machine in which the mechanism moves, its pivots and dimensions are dragged, and every answer "
    "follows; what the hand changes can be saved into the study. It goes on until Ctrl-C.",
)  # fmt: skip
_add(
    "compare", "compare.compare", "old! new! rtol atol junit json quiet",
    "Say what moved between two folders of results.",
    "Say what moved between two folders of results, of one command, a study or many: rows are matched by their poses "
    "and keys, folders by their paths. Exit codes: 0 equal within the tolerance, 1 something moved, is missing or is "
    "new, 2 there is nothing to compare.",
)  # fmt: skip
_add("new", "importing.new", "template", "", "Print a commented study to start from.")
_add(
    "import", "importing.import_study", "source! out drive unit scale",
    "Make a study of another tool's file or share address.",
    "Make a commented study that runs of a mechanism that PMKS+, Linkage or pylinkage has saved, of tables of joints "
    "and links, or of a DXF sketch. Nothing is fetched: a share address holds the whole mechanism.",
)  # fmt: skip


def _words(incomplete: str) -> list[str]:
    """Commands and options that complete a word; completing keys of the study would take a second."""
    commands = _group().commands
    options = {
        flag for command in commands.values() for param in command.params for flag in param.opts if flag[0] == "-"
    }
    return sorted(word for word in {*commands, *options} if word.startswith(incomplete))


def _group() -> Any:
    import typer.main

    return typer.main.get_command(app)


@app.command("docs", context_settings={"ignore_unknown_options": True})
def docs(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[WORD]...",
            help="Keys of the study (kinematics.sweep, sweep), commands, options, indices, units, ...",
            show_default=False,
            autocompletion=_words,
        ),
    ] = None,
) -> None:
    """Say what words mean; without any, which there are."""
    with _guard():
        from mechdesign.door.cli.docs import show

        show(words or (), _group().commands)


@app.command("schema", short_help="Print the JSON Schema of the study file.")
def schema() -> None:
    """Print the JSON Schema of the study file, with which editors complete and check it."""
    with _guard():
        import json

        from mechdesign.door.cli.terminal import emit
        from mechdesign.study.schema.study_file import schema as study_schema

        emit(json.dumps(study_schema(), indent=2, ensure_ascii=False) + "\n")


def answer() -> None:
    """Do what the command line says; of a command that is named first, Typer prepares that one alone."""
    asked = copy(app)
    named = [command for command in app.registered_commands if command.name in sys.argv[1:2]]
    asked.registered_commands = named or app.registered_commands
    asked()


def main() -> None:
    """The command in a process of its own."""
    process.run(answer)
