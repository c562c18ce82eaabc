"""A sweep on whichever workers, in parts, and gone on with: the same bytes."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.studies import IN_LINE

from mechdesign.experiments import sweep as room

STUDY = (
    IN_LINE
    + """\
kinematics: {sweep: {crank: {from: 0, to: 360, step: 30}}, outputs: [B.x, rod.angle]}
requirements:
  - {result: kinematics.extremes.B.x.range, at_least: r + 25}
  - {result: kinematics.rod.angle, abs: true, at_most: 22}
"""
)
# Batches of cases of one assembly and of both; some cannot be loaded, or have poses that do not assemble.
VARY = [
    "--vary", "mechanism.parameters.r=-1,20,24,28,32,36,40,44", "--vary", "mechanism.branch=side,follow",
    "--vary", "mechanism.parameters.l=30:120:10",
]  # fmt: skip
RANKED = ["--maximize", "kinematics.B.x.range", "--minimize", "kinematics.rod.angle.peak", "--sort"]
ASKED = {"plain": ["--results", "kinematics.B.x.mean"], "ranked": RANKED}
POOLS = """\
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
def threads():
    return ThreadPoolExecutor(2)
def processes():
    return ProcessPoolExecutor(2)
"""


@pytest.fixture(params=ASKED)
def asked(request, folder, invoke):
    """A sweep of 160 cases in three batches, with its file as it is without any workers."""
    (folder / "press.yaml").write_text(STUDY)
    (folder / "sweep_pools.py").write_text(POOLS)
    arguments = ["sweep", "press.yaml", *VARY, *ASKED[request.param], "--no-plots", "--quiet"]
    assert invoke(*arguments, "--out", "alone", "--jobs", "1").exit_code == 3
    return arguments


def files(name: str) -> dict[str, bytes]:
    found = {path.name: path.read_bytes() for path in Path(name).iterdir() if path.suffix in (".csv", ".json")}
    assert {"sweep.csv", "manifest.json"} <= found.keys()
    return found


@pytest.mark.nightly
def test_on_workers(asked, invoke):
    with Path("alone/sweep.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert len(table) == 160
    assert {row["exit_code"] for row in table} == {"0", "1", "3"}
    workers = {
        "two": ["--jobs", "2"],
        "threads": ["--executor", "sweep_pools:threads"],
        "processes": ["--executor", "sweep_pools:processes"],
    }
    for name, options in workers.items():
        assert invoke(*asked, "--out", name, *options).exit_code == 3
        assert files(name) == files("alone")
    pytest.importorskip("distributed")
    options = ["--out", "dask", "--executor", "dask:local", "--jobs", "2"]
    done = subprocess.run([sys.executable, "-m", "mechdesign", *asked, *options], check=False, timeout=120)
    assert done.returncode == 3
    assert files("dask") == files("alone")


@pytest.mark.nightly
def test_in_shards(asked, invoke):
    for k in (2, 3, 1):
        assert invoke(*asked, "--out", "parts", "--shard", f"{k}/3").exit_code == 0
    assert invoke("merge", "press.yaml", "--no-plots", "--quiet", "--out", "parts").exit_code == 3
    assert files("parts") == files("alone")


@pytest.mark.nightly
@pytest.mark.parametrize("batches", [1, 2])
def test_gone_on_with(asked, invoke, monkeypatch, batches):
    answers, begun = room.answers, []

    def interrupted(*given, begin=0, **options):
        begun.append(begin)
        for number, answered in enumerate(answers(*given, begin=begin, **options)):
            if len(begun) == 1 and number == batches:
                raise KeyboardInterrupt
            yield answered

    monkeypatch.setattr(room, "answers", interrupted)
    assert invoke(*asked, "--out", "later").exit_code == 130
    assert files("later")["sweep.csv"] != files("alone")["sweep.csv"]
    assert invoke(*asked, "--out", "later", "--resume").exit_code == 3
    assert begun == [0, 64 * batches]
    assert files("later") == files("alone")
