"""The command line in this process."""

from __future__ import annotations

from click.testing import Result
from typer.testing import CliRunner

from mechdesign.cli.app import app


def invoke(*arguments: object) -> Result:
    """What a command says (`output`, `stdout`, `stderr`) and how it ends (`exit_code`)."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])
