"""C programs of the same work, to compare with in one run: their folder is named by MECHDESIGN_FLOORS."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Compile a program by name; skips where there is no gcc, or no folder of programs is named."""

    def build(name: str) -> Path:
        folder, compiler = os.environ.get("MECHDESIGN_FLOORS"), shutil.which("gcc")
        if folder is None or compiler is None:
            pytest.skip(f"needs gcc, and the folder of {name}.c in MECHDESIGN_FLOORS")
        program = tmp_path_factory.mktemp("floors") / name
        flags = ["-O3", "-march=native", "-ffast-math", "-fopenmp", "-mprefer-vector-width=512"]
        subprocess.run([compiler, *flags, str(Path(folder) / f"{name}.c"), "-o", str(program), "-lm"], check=True)
        return program

    return build
