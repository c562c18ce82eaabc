"""Completion in a shell: of commands, studies, and values; it loads nothing heavy."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SHELL = shutil.which("bash")


@pytest.mark.nightly
@pytest.mark.skipif(SHELL is None, reason="there is no bash")
def test_bash_completes_what_is_typed(folder):
    """The script that is installed, in a bash of its own: it defines a function that a Tab calls."""
    (folder / "deep").mkdir()
    (folder / "deep/other.yaml").touch()
    (folder / "notes.txt").touch()
    tools = folder / "tools"
    tools.mkdir()
    (tools / "mechdesign").write_text(f"#!{sys.executable}\nfrom mechdesign.__main__ import main\nmain()\n")
    (tools / "mechdesign").chmod(0o755)
    environment = os.environ | {"HOME": str(folder), "PATH": f"{tools}:{os.environ['PATH']}"}

    def bash(script):
        command = [SHELL, "--norc", "-c", f"{script}\ntrue"]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=120).stdout

    bash("mechdesign --install-completion")
    assert "mechdesign" in (folder / ".bashrc").read_text()
    typed = {
        ("wat",): ["watch"],
        ("run", "s"): ["slider.yaml"],
        ("run", "slider.yaml", "deep/"): ["deep/other.yaml"],
        # A shell completes these by itself.
        ("run", "de"): [],
        ("kinematics", "--style", "p"): ["paper"],
        ("watch", "slider.yaml", "k"): ["kinematics"],
        ("new", "fo"): ["four_bar"],
        ("new", "cam_"): ["cam_arm", "cam_dwell"],
        ("docs", "comp"): ["compare"],
        ("synthesize", "--set", "synthesis.judge.t"): ["synthesis.judge.tolerance"],
    }
    lines = [
        f"COMP_WORDS=(mechdesign {' '.join(words)}); COMP_CWORD={len(words)}; "
        '_mechdesign_completion mechdesign; echo "${COMPREPLY[@]}"'
        for words in typed
    ]
    script = next(Path(folder).rglob("mechdesign.sh"))
    told = bash("\n".join([f". {script}", *lines])).splitlines()
    assert [line.split() for line in told] == list(typed.values())


@pytest.mark.parametrize(
    ("shell", "told"),
    [
        ("powershell", "slider.yaml:::"),
        pytest.param("zsh", '"slider.yaml"', marks=pytest.mark.nightly),
        pytest.param("fish", "slider.yaml", marks=pytest.mark.nightly),
        pytest.param("bash", "slider.yaml", marks=pytest.mark.nightly),
    ],
)
def test_every_shell_is_told_studies(folder, shell, told):
    """By the variables that the script of each sets; it names the variable that says which shell asks."""
    settings = {
        "_TYPER_COMPLETE_ARGS": "mechdesign run s", "_TYPER_COMPLETE_WORD_TO_COMPLETE": "s",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args", "COMP_WORDS": "mechdesign run s", "COMP_CWORD": "2",
    }  # fmt: skip

    def asked(what):
        environment = os.environ | settings | {"_MECHDESIGN_COMPLETE": f"{what}_{shell}"}
        code = "import sys; sys.argv[0] = 'mechdesign'; from mechdesign.__main__ import main; main()"
        command = [sys.executable, "-c", code]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    assert told in asked("complete")
    assert f"complete_{shell}" in asked("source")


def test_completion_imports_nothing_heavy(folder):
    code = (
        "import sys\nfrom mechdesign.__main__ import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'scipy', 'matplotlib', 'pydantic', 'yaml'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    for words in ("run s", "docs comp"):
        settings = {"_MECHDESIGN_COMPLETE": "complete_bash", "COMP_WORDS": f"mechdesign {words}", "COMP_CWORD": "2"}
        command = [sys.executable, "-c", code]
        done = subprocess.run(
            command, env=os.environ | settings, capture_output=True, text=True, check=False, timeout=120
        )
        assert not done.returncode, done.stderr
