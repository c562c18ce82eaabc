"""The version: written once, told with those of the libraries that numbers come from."""

from __future__ import annotations

import platform
import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import mechdesign

ROOT = Path(__file__).parents[2]


def test_the_version_tells_those_of_what_numbers_come_from(invoke):
    told = invoke("--version").stdout
    libraries = ", ".join(f"{name} {version(name.lower())}" for name in ("NumPy", "SciPy", "Matplotlib"))
    assert told == (
        f"mechdesign {mechdesign.__version__}\nPython {platform.python_version()} on {platform.system()}, {libraries}\n"
    )


def test_the_version_is_written_once_and_the_changelog_begins_with_it():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dynamic"] == ["version"]
    entries = re.findall(r"^## \[(.+)\] - (.+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert entries[0][0] == mechdesign.__version__
    assert entries[-1][0] == "1.0.0"
    assert all(re.fullmatch(r"unreleased|\d{4}-\d\d-\d\d", day) for _, day in entries)
