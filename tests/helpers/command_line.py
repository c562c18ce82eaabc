"""The command line in this process, with a study as its standard input."""

from __future__ import annotations

from typer.testing import CliRunner, Result

from mechdesign.cli.app import app


def ask(*arguments: object, study: str) -> Result:
    """Its exit code and what it writes; "-" among the arguments stands for the study."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], input=study)


def checked(study: str) -> list[str]:
    """The lines of `mechdesign check`."""
    done = ask("check", "-", "--no-plots", study=study)
    assert done.exit_code == 0, done.stderr
    return done.stdout.splitlines()
