"""Files for CI servers and clusters, those of this repository and those that the site shows: they parse, and what they
run is there."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main
import yaml
from helpers import command_line

from mechdesign.door.cli.app import app

ROOT = Path(__file__).parents[2]
SHOWN = sorted((ROOT / "docs" / "ci").iterdir())
OURS = sorted((ROOT / ".github" / "workflows").iterdir())
GROUP = typer.main.get_command(app)
# What a scheduler or a server sets.
VARIABLE = re.compile(r"\$\{\{[^}]*\}\}|\$\{?\w+\}?")


def workflow(path: Path) -> dict[Any, Any]:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def steps(path: Path) -> Iterator[dict[str, Any]]:
    for job in workflow(path)["jobs"].values():
        yield from job["steps"]


def lines(path: Path) -> list[str]:
    """What a file runs, line by line, each variable replaced by a number."""
    text = path.read_text(encoding="utf-8")
    run = "\n".join(step.get("run", "") for step in steps(path)) if path.suffix == ".yml" else text
    return VARIABLE.sub("8", run).splitlines()


@pytest.mark.parametrize("path", SHOWN, ids=lambda path: path.name)
def test_every_command_line_of_a_shown_file_is_one(path: Path) -> None:
    calls = [re.match(r"\s*(?:exec |\w+= )?mechdesign (.*?)(?: \|\| true)?$", line) for line in lines(path)]
    commands = [shlex.split(call[1]) for call in calls if call]
    assert len(commands) >= 2
    for command, *arguments in commands:
        assert command in GROUP.commands
        # What is unknown, or lacks, is an error.
        GROUP.commands[command].make_context(command, arguments)


def test_what_is_wrong_is_shown_once_and_what_was_wrong_before_a_change_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four parts read each study; and a change that mends one would be shown the mistake that it mends."""
    calls = [step.get("run", "").removesuffix(" || true") for step in steps(ROOT / "docs/ci/github.yml")]
    shown = {}
    for folder in ("configs", "before/configs"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "wiper.yaml").write_text("mechanism: {}\n")
    monkeypatch.chdir(tmp_path)
    for call in [call for call in calls if re.search("mechdesign (run|merge)", call)]:
        setting, command = re.fullmatch(r"(?:GITHUB_ACTIONS=(\w*) )?mechdesign (.*)", VARIABLE.sub("1", call)).groups()
        monkeypatch.setenv("GITHUB_ACTIONS", "true" if setting is None else setting)
        done = command_line.ask(*shlex.split(command), study="")
        assert done.exit_code == 2
        shown[" ".join(command.split()[:2])] = done.stderr.count("::error file=")
    assert shown == {"run configs": 0, "merge configs": 1, "run before/configs": 0}


@pytest.mark.parametrize("path", [*SHOWN[:1], *OURS], ids=lambda path: path.name)
def test_a_workflow_may_read_alone_ends_and_says_which_actions_it_takes(path: Path) -> None:
    content = workflow(path)
    assert content["permissions"] == {"contents": "read"}
    for job in content["jobs"].values():
        assert job["timeout-minutes"] <= 360  # more a hosted runner does not give
        assert {job.get("needs")} <= {None, *content["jobs"]}
    for step in steps(path):
        assert ("run" in step) != ("uses" in step)
        assert re.fullmatch(r"actions/[\w-]+@v\d+", step.get("uses", "actions/checkout@v4"))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_our_workflows_run_what_a_desk_runs(path: Path) -> None:
    """Scripts of `.ci` alone, with files of tests that exist, for each value of a matrix."""
    for job in workflow(path)["jobs"].values():
        searches = job.get("strategy", {}).get("matrix", {}).get("search", [""])
        for run in [step["run"] for step in job["steps"] if "run" in step]:
            for search in searches:
                program, script, *arguments = shlex.split(run.replace("${{ matrix.search }}", search))
                first = (ROOT / script).read_text(encoding="utf-8").split("\n", 1)[0]
                assert first.removeprefix("#!/usr/bin/env ").removesuffix("3") == program
                assert arguments[:1] in ([], ["nightly"], ["tests"])
                assert all((ROOT / argument).exists() for argument in arguments if argument.startswith("tests/"))


def test_every_random_search_goes_on_for_an_hour_at_night() -> None:
    (searches,) = (
        job["strategy"]["matrix"]["search"]
        for job in workflow(ROOT / ".github/workflows/nightly.yml")["jobs"].values()
        if "strategy" in job
    )
    assert {f"test_hunt_{search}.py" for search in searches} == {
        path.name for path in (ROOT / "tests/hunt").glob("test_*.py")
    }
