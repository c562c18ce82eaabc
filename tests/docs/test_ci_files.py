"""The files for CI servers and clusters that the site shows: they parse, and so does every command in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer.main
import yaml

from mechdesign.door.cli.app import app

FOLDER = Path(__file__).parents[2] / "docs" / "ci"
GROUP = typer.main.get_command(app)


def commands(path: Path) -> list[list[str]]:
    """Commands of this package in a file, their variables replaced by what a scheduler sets."""
    text = path.read_text(encoding="utf-8")
    lines = (
        [step["run"] for job in yaml.safe_load(text)["jobs"].values() for step in job["steps"] if "run" in step]
        if path.suffix == ".yml"
        else text.splitlines()
    )
    text = re.sub(r"\$\{?\w+\}?", "8", "\n".join(lines))
    found = re.findall(r"(?m)^(?:\s*exec )?\s*mechdesign (.*?)(?: \|\| true)?$", text)
    return [shlex.split(line) for line in found]


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.iterdir()))
def test_every_command_line_is_one(name: str) -> None:
    found = commands(FOLDER / name)
    assert len(found) >= 2
    for command, *arguments in found:
        assert command in GROUP.commands
        # What is unknown, or lacks, is an error.
        GROUP.commands[command].make_context(command, arguments)
