"""The command line in this process, with a study as its standard input."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from typer.testing import CliRunner, Result

from mechdesign.door.cli.app import app


def ask(*arguments: object, study: str) -> Result:
    """Its exit code and what it writes; "-" among the arguments stands for the study."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], input=study)


def checked(study: str) -> list[str]:
    """The lines of `mechdesign check`."""
    done = ask("check", "-", "--no-plots", study=study)
    assert done.exit_code == 0, done.stderr
    return done.stdout.splitlines()


def exported(name: str, study: str, overrides: Mapping[str, Any] | None = None, **said: str) -> tuple[bytes, list[str]]:
    """What a file of `mechdesign export` holds, and the warnings; `said` are further options."""
    options = [f"--{key}={value}" for key, value in said.items()]
    options += [
        f"--set={key}={yaml.safe_dump(value, default_flow_style=True)}" for key, value in (overrides or {}).items()
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        done = ask("export", "-", "--to", name, "--out", file, *options, study=study)
        assert done.exit_code == 0, done.stderr
        return file.read_bytes(), [line for line in done.stderr.splitlines() if "warning: " in line]
