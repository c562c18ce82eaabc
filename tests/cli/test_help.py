"""Help: every command and option has it, and it is quick."""

import subprocess
import sys

import pytest
import typer.main

from mechdesign.commands import QUESTIONS
from mechdesign.door.cli.app import app

GROUP = typer.main.get_command(app)
EVERY = ("--out", "--set", "--seed", "--jobs", "--json", "--quiet", "--no-plots")


@pytest.mark.parametrize("name", sorted(GROUP.commands))
def test_every_command_and_parameter_has_help(name, invoke):
    command = GROUP.commands[name]
    assert command.help
    assert all(getattr(parameter, "help", None) for parameter in command.params)
    shown = invoke(name, "--help")
    assert shown.exit_code == 0
    assert " ".join(command.help.split())[:40] in " ".join(shown.stdout.split())


def test_every_question_is_a_command():
    assert set(GROUP.commands) > set(QUESTIONS)


@pytest.mark.parametrize("name", [*QUESTIONS, "run"])
def test_options_that_stand_everywhere(name):
    known = {option for parameter in GROUP.commands[name].params for option in parameter.opts}
    assert known >= set(EVERY)
    assert (name == "run") == ({"--junit", "--fail-fast", "--resume"} <= known)
    assert (name in ("kinematics", "run")) == ("--animate" in known)
    assert (name == "kinematics") == ("--all-modes" in known)


def test_options_of_check():
    known = {option for parameter in GROUP.commands["check"].params for option in parameter.opts}
    assert known >= {"--out", "--set", "--quiet", "--no-plots"}


@pytest.mark.parametrize("arguments", [["--help"], ["reliability", "--help"], ["docs", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments):
    code = (
        "import sys\nfrom mechdesign.door.cli.app import main\n"
        f"sys.argv = ['mechdesign', *{arguments!r}]\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "heavy = {'numpy', 'scipy', 'matplotlib', 'yaml', 'rich'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr


def test_no_command_shows_the_help_and_where_no_study_is_how_to_begin(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "compose.yaml").write_text("services: {}\n")
    alone = invoke()
    assert "kinematics" in alone.output
    _, steps = alone.output.split("There is no study in this folder. To begin:\n")
    assert "mechdesign new > study.yaml " in steps
    assert "There is no study" not in invoke("--help").output
    # The steps are commands that there are.
    assert {line.split()[1] for line in steps.splitlines() if line.startswith("  mechdesign")} <= {*GROUP.commands}
    (tmp_path / "mine.yml").write_text(invoke("new").stdout)
    beside = invoke()
    assert "kinematics" in beside.output
    assert "There is no study" not in beside.output
