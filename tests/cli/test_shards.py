"""One run in parts, and on executors: the same files as without."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mechdesign
from mechdesign.ground.work import shards
from mechdesign.ground.work.shards import FILE, Shard

from .conftest import SLIDER

CONFIGS = Path(__file__).parents[2] / "configs"
# The second chunk of samples is not whole.
ARM = ["--set", "reliability.samples=30000", "--set", "reliability.methods=[analytic, monte_carlo, form]"]


@pytest.fixture
def studies(folder):
    (folder / "slider.yaml").unlink()
    for name in ("two_link_arm", "gallery/slider_crank_tolerances", "gallery/straight_line_synthesis",
                 "gallery/offset_slider_crank"):  # fmt: skip
        (folder / Path(name).name).with_suffix(".yaml").write_text((CONFIGS / f"{name}.yaml").read_text())
    return folder


def content(folder):
    """Every file of a folder but its record; what a summary says of the folder itself is that of any."""
    found = {file.relative_to(folder): file.read_bytes() for file in Path(folder).rglob("[!.]*") if file.is_file()}
    return {name: data.replace(str(folder).encode() + b"/", b"") for name, data in found.items()}


@pytest.mark.nightly
def test_four_shards_merged_are_one_run(studies, invoke):
    names = ["two_link_arm.yaml", "straight_line_synthesis.yaml", "offset_slider_crank.yaml"]
    common = ["--no-plots", "--set", "seed=3"]
    assert invoke("run", *names, *common, "--out", "whole").exit_code == 0
    for k in (3, 1, 4, 2):
        told = invoke("run", *names, *common, "--out", "parts", "--shard", f"{k}/4", "--jobs", 1 + k % 2)
        assert told.exit_code == 0
        # Each study is answered by one shard, whose result is that of the whole run; the fourth has none.
        for name in names:
            assert (f"{Path(name).stem}: " in told.stderr) == (name in names[k - 1 : k])
        assert not Path("parts/summary.csv").exists()
    # The changes and the seed are those of the shards.
    for _ in range(2):
        merged = invoke("merge", *names, "--no-plots", "--out", "parts")
        assert merged.exit_code == 0
        assert "two_link_arm: as its shards, with seed=3" in merged.stderr
        assert content("parts") == content("whole")


@pytest.mark.parametrize("made", ["nothing", "results", "shards elsewhere"])
def test_without_shards_nothing_is_merged_and_nothing_computed(studies, invoke, analysis, made):
    """Not even what no shard would have a part of: a job that looks in a wrong folder is not green."""
    (studies / "plain.yaml").write_text(SLIDER)
    if made == "results":
        # Of another study, so that they are not those of a merge.
        (studies / "plain.yaml").write_text(SLIDER + "# older\n")
        assert invoke("run", "plain.yaml", "--no-plots", "--out", "parts").exit_code == 0
        (studies / "plain.yaml").write_text(SLIDER)
    elif made == "shards elsewhere":
        asked = ("--vary", "mechanism.parameters.r=30,40", "--results", "kinematics.B.x.max", "--out", "other")
        for k in (1, 2):
            assert invoke("sweep", "plain.yaml", *asked, "--no-plots", "--shard", f"{k}/2").exit_code == 0

    def fail(study, **options):
        raise AssertionError("it was computed")

    analysis(fail)
    before = content("parts") if Path("parts").exists() else {}
    done = invoke("merge", "plain.yaml", "--no-plots", "--out", "parts")
    assert done.exit_code == 2
    assert "parts/kinematics: there are no shards" in done.stderr
    assert (content("parts") if Path("parts").exists() else {}) == before


def test_a_run_without_the_studies_of_a_shard_is_not_merged(studies, invoke):
    (studies / "plain.yaml").write_text(SLIDER)
    (studies / "other.yaml").write_text(SLIDER)
    asked = ("plain.yaml", "other.yaml", "--no-plots", "--out", "parts")
    assert invoke("run", *asked, "--shard", "1/2").exit_code == 0
    done = invoke("merge", *asked)
    assert done.exit_code == 2
    assert "parts/other/kinematics: there are no shards and no whole results of this study, seed and" in done.stderr
    assert invoke("run", *asked, "--shard", "2/2").exit_code == 0
    assert invoke("merge", *asked).exit_code == 0
    # A result of other options is none of this run.
    (studies / "other.yaml").write_text(SLIDER + "# newer\n")
    assert invoke("merge", *asked).exit_code == 2


def test_merged_shards_of_cases_leave_what_is_not_theirs(studies, invoke):
    asked = ("offset_slider_crank.yaml", "--no-plots", "--out", "parts")
    for k in (1, 2):
        assert invoke("sweep", *asked, "--shard", f"{k}/2").exit_code == 0
    notes = Path("parts/shard_1_of_2/notes.txt")
    notes.write_text("of the user")
    for _ in range(2):
        assert invoke("merge", *asked).exit_code == 0
    assert [*Path("parts").rglob("shard_*")] == [notes.parent]
    assert [*notes.parent.iterdir()] == [notes]


@pytest.mark.nightly
def test_shards_of_cases_that_the_command_line_names(studies, invoke):
    asked = ["sweep", "offset_slider_crank.yaml", "--no-plots", "--vary", "mechanism.parameters.r=1.4:1.8:0.2"]
    assert invoke(*asked, "--out", "whole").exit_code == 0
    for k in (1, 2):
        assert invoke(*asked, "--out", "parts", "--shard", f"{k}/2").exit_code == 0
    assert invoke("merge", "offset_slider_crank.yaml", "--no-plots", "--out", "parts").exit_code == 0
    assert content("parts") == content("whole")


@pytest.mark.nightly
def test_shards_that_cannot_be_merged(studies, invoke):
    asked = ["offset_slider_crank.yaml", "--no-plots", "--out", "parts"]
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "parts/kinematics: there are no shards and no whole results" in told.stderr
    for k in (1, 3):
        invoke("sweep", *asked, "--shard", f"{k}/3")
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "parts: shards are missing: 2/3; compute them, e.g. with --shard 2/3" in told.stderr
    invoke("sweep", *asked, "--shard", "2/3", "--seed", 5)
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "shard_2_of_3/answers.npz: is a shard of something else: seed is 5, here 0\n" in told.stderr
    invoke("sweep", *asked, "--shard", "2/3")
    kept = studies / "parts/shard_2_of_3" / FILE
    whole = kept.read_bytes()
    for damaged in (whole[: len(whole) // 2], whole.replace(b"seed", b"deed"), b"no archive", b""):
        kept.write_bytes(damaged)
        told = invoke("merge", *asked)
        assert told.exit_code == 2
        assert "shard_2_of_3/answers.npz: is not a whole shard" in told.stderr
    # A requeued job computes it anew; one that is whole is kept.
    assert "shard 2/3 is kept" in invoke("sweep", *asked, "--shard", "2/3", "--resume").stderr
    before = kept.stat().st_mtime_ns
    invoke("sweep", *asked, "--shard", "2/3", "--resume")
    assert kept.stat().st_mtime_ns == before
    invoke("sweep", *asked, "--shard", "2/4")
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "there are shards of " in told.stderr


def test_a_shard_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(mechdesign.MechdesignError, match="the shard could not be written: No such file"):
        shards.write(tmp_path / "nowhere", Shard(1, 2), {}, [])


def test_a_shard_is_data_alone(tmp_path):
    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "made"),)

    (tmp_path / "shard_1_of_1").mkdir()
    empty = np.zeros(0)
    head = np.array([Evil()], dtype=object)
    np.savez(tmp_path / "shard_1_of_1" / FILE, head=head, counts=empty, rows=empty, words=np.zeros(0, np.uint8))
    with pytest.raises(mechdesign.StudyError, match="is not a whole shard"):
        shards.merge(tmp_path, {})
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("command", ["reliability", "optimize", "sensitivities"])
def test_one_computation_is_divided_by_an_executor_alone(studies, invoke, command):
    told = invoke(command, "two_link_arm.yaml", "--shard", "1/2")
    assert told.exit_code == 2
    assert "no such option: --shard" in told.stderr


@pytest.mark.parametrize(
    ("options", "message"), [(["--shard", "5/4"], "--shard takes I/N"), (["--shard", "1/2", "--report"], "contradict")]
)
def test_what_is_no_shard(studies, invoke, options, message):
    told = invoke("sweep", "offset_slider_crank.yaml", *options)
    assert told.exit_code == 2
    assert message in told.stderr
    assert not Path("results").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--executor", "dask"], "--executor takes dask:ADDRESS, dask:local or module:factory, not 'dask'"),
        (["--executor", "nowhere:two"], "--executor nowhere:two: No module named 'nowhere'"),
        (["--executor", "os:cpus"], "--executor os:cpus: module 'os' has no attribute 'cpus'"),
        (["--executor", "os:getcwd"], "--executor os:getcwd gives no concurrent.futures.Executor, but 'str'"),
        (["--executor", "os:mkdir"], "--executor os:mkdir: TypeError: "),
        (["--executor", "sys:exit"], "--executor sys:exit: SystemExit"),
        (["--executor", "..:two"], "--executor ..:two: TypeError: "),
        (["--executor", "dask:tcp://127.0.0.1:9"], "no scheduler answers there: "),
    ],
)
def test_what_is_no_executor(studies, invoke, options, message):
    told = invoke("reliability", "two_link_arm.yaml", *options)
    assert told.exit_code == 2
    assert message in told.stderr
    assert not Path("results").exists()


def test_dask_that_is_not_installed(studies, invoke, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    told = invoke("reliability", "two_link_arm.yaml", "--executor", "dask:local")
    assert told.exit_code == 2
    assert "needs dask, which is not installed: pip install 'mechdesign[cluster]'" in told.stderr


@pytest.mark.nightly
def test_the_same_files_on_executors(studies, invoke):
    (studies / "pools.py").write_text(
        "from concurrent.futures import ThreadPoolExecutor\ndef two():\n    return ThreadPoolExecutor(2)\n"
    )
    asked = ["reliability", "slider_crank_tolerances.yaml", *ARM, "--no-plots"]
    assert invoke(*asked, "--out", "here").exit_code == 0
    assert invoke(*asked, "--out", "two", "--executor", "pools:two").exit_code == 0
    assert content("two") == content("here")
    pytest.importorskip("distributed")
    arguments = [*asked, "--out", "dask", "--executor", "dask:local", "--jobs", "2"]
    done = subprocess.run(
        [sys.executable, "-m", "mechdesign", *arguments], capture_output=True, check=True, timeout=120
    )
    assert content("dask") == content("here")
    assert b"Traceback" not in done.stderr
