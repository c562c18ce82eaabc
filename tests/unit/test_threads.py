"""The same bytes however many threads linear algebra may use."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
import scipy.linalg  # noqa: F401 - its library of linear algebra is another than NumPy's
from threadpoolctl import threadpool_info, threadpool_limits

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"


def texts(command, study, changes, **options):
    result = getattr(mechdesign, command)(mechdesign.load(study, changes), **options)
    tables = {name: {key: values.tolist() for key, values in table.to_dict().items()}
              for name, table in result.tables.items()}  # fmt: skip
    return repr(tables) + repr(result.files)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("command", "name", "changes", "jobs"),
    [("workspace", "two_rpr", [], 1), ("optimize", "gallery/path_synthesis", ["optimize.evaluations=500"], 2)],
)
def test_tables_do_not_depend_on_threads(command, name, changes, jobs):
    study = CONFIGS / f"{name}.yaml"
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            found.append(texts(command, study, changes, jobs=jobs))
    assert found[0] == found[1]


@pytest.mark.nightly
def test_files_do_not_depend_on_threads(tmp_path):
    study = CONFIGS / "two_rpr.yaml"
    code = "from mechdesign.door.cli.app import main; main()"
    for threads in ("1", "2"):
        change = "workspace.indices=[inverse_condition, sigma_min]"
        arguments = ["workspace", str(study), "--quiet", "--out", str(tmp_path / threads), "--set", change]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
        subprocess.run(
            [sys.executable, "-c", code, *arguments], env=environment, check=True, timeout=120, capture_output=True
        )
    ours, theirs = ({file.name: file.read_bytes() for file in (tmp_path / n).iterdir()} for n in ("1", "2"))
    assert ours == theirs
    assert any(name.endswith(".png") for name in ours)


def numbers():
    return {each["filepath"]: each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


@pytest.mark.slow
def test_what_was_set_before_comes_back(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    seen = []

    class Watch:
        """Numbers of threads while something is computed, which it interrupts."""

        def start(self, total, stage):
            pass

        def update(self, n):
            seen.append((set(numbers().values()), os.environ["OPENBLAS_NUM_THREADS"]))
            raise ZeroDivisionError

    study = mechdesign.load(CONFIGS / "two_rpr.yaml", ["workspace.scan.rays=12"])
    with threadpool_limits(2, user_api="blas"):
        before = numbers()
        assert set(before.values()) == {2}
        with contextlib.suppress(ZeroDivisionError):
            mechdesign.workspace(study, progress=Watch())
        assert seen == [({1}, "1")]
        assert numbers() == before
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ
