"""What is given away: the wheel and the sdist as a stranger has them, and the recipe of a conda package."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

import mechdesign

ROOT = Path(__file__).parents[2]
RECIPE = ROOT / "packaging" / "conda" / "recipe.yaml"
# Packages that have another name there.
CONDA = {"matplotlib": "matplotlib-base"}


@pytest.mark.nightly
def test_the_artefacts_work_outside_of_the_checkout(tmp_path: Path) -> None:
    command = [sys.executable, str(ROOT / ".ci" / "artefacts"), "--out", str(tmp_path)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=390, env=environment)
    assert done.returncode == 0, done.stderr
    wheel = f"mechdesign-{mechdesign.__version__}-py3-none-any.whl"
    assert {path.name for path in tmp_path.iterdir()} == {wheel, f"mechdesign-{mechdesign.__version__}.tar.gz"}
    assert f"{wheel}: works with Python 3" in done.stdout


def test_the_conda_recipe_wants_what_the_package_wants() -> None:
    recipe = yaml.safe_load(RECIPE.read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert recipe["context"]["version"] == mechdesign.__version__
    assert f">={recipe['context']['python_min']}" == project["requires-python"]
    python, *packages = recipe["requirements"]["run"]
    assert python == "python >=${{ python_min }}"
    wanted = [re.fullmatch(r"([\w-]+)(>=.+)", package) for package in project["dependencies"]]
    assert packages == [f"{CONDA.get(match[1], match[1])} {match[2]}" for match in wanted if match]
    (script,) = recipe["build"]["python"]["entry_points"]
    assert script == f"mechdesign = {project['scripts']['mechdesign']}"


def test_the_conda_recipe_is_one() -> None:
    rattler_build = pytest.importorskip("rattler_build", reason="pip install 'mechdesign[packaging]' parses the recipe")
    recipe = rattler_build.Stage0Recipe.from_file(RECIPE)
    (package,) = recipe.render(rattler_build.VariantConfig())
    assert f"version='{mechdesign.__version__}'" in repr(package)
