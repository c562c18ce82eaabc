"""One run in parts, and on executors: the same files as without."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import mechdesign
from mechdesign.work import shards
from mechdesign.work.shards import FILE, Shard

from .conftest import SLIDER, answer

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


def test_four_shards_merged_are_one_run(studies, invoke):
    names = ["two_link_arm.yaml", "straight_line_synthesis.yaml", "offset_slider_crank.yaml"]
    common = ["--no-plots", "--set", "seed=3"]
    assert invoke("run", *names, *common, "--out", "whole").exit_code == 0
    for k in (3, 1, 4, 2):
        told = invoke("run", *names, *common, "--out", "parts", "--shard", f"{k}/4", "--jobs", 1 + k % 2)
        assert told.exit_code == 0
        assert f"sweep: shard {k}/4 is kept" in told.stderr
        assert f"optimize: shard {k}/4 is kept in parts/straight_line_synthesis/optimize/shard_{k}_of_4" in told.stderr
        assert not [*Path("parts").rglob("*.csv")]
    kept = shards._read(studies / "parts/two_link_arm/reliability/shard_2_of_4" / FILE)[1]
    # Chunks of samples at three poses, and replicates of Sobol' indices.
    counts = [len(each.values) for each in pickle.loads(kept).values()]
    assert len(counts) == 2
    assert all(counts)
    # The changes and the seed are those of the shards.
    merged = invoke("merge", *names, "--no-plots", "--out", "parts")
    assert merged.exit_code == 0
    assert "two_link_arm: as its shards, with seed=3" in merged.stderr
    assert content("parts") == content("whole")
    # A second time there is nothing to do.
    again = invoke("merge", *names, "--no-plots", "--out", "parts")
    assert again.exit_code == 0
    assert "they are whole" in again.stderr


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
        for k in (1, 2):
            assert invoke("run", "plain.yaml", "--no-plots", "--out", "other", "--shard", f"{k}/2").exit_code == 0

    def fail(study, **options):
        raise AssertionError("it was computed")

    analysis(fail)
    before = content("parts") if Path("parts").exists() else {}
    done = invoke("merge", "plain.yaml", "--no-plots", "--out", "parts")
    assert done.exit_code == 2
    assert "parts/kinematics: there are no shards" in done.stderr
    assert (content("parts") if Path("parts").exists() else {}) == before


def test_what_is_not_divided_is_computed_once_by_the_merge_of_all_shards(studies, invoke, analysis):
    (studies / "plain.yaml").write_text(SLIDER)
    asked = ("plain.yaml", "--no-plots", "--out", "parts")
    computed = []
    analysis(lambda study, **options: computed.append(study) or answer())
    assert invoke("run", *asked, "--shard", "1/2").exit_code == 0
    done = invoke("merge", *asked)
    assert (done.exit_code, "shards are missing: 2/2" in done.stderr, len(computed)) == (2, True, 0)
    assert invoke("run", *asked, "--shard", "2/2").exit_code == 0
    notes = Path("parts/kinematics/shard_1_of_2/notes.txt")
    notes.write_text("of the user")
    for _ in range(2):
        assert invoke("merge", *asked).exit_code == 0
    assert len(computed) == 1
    assert [*Path("parts").rglob("shard_*")] == [notes.parent]
    assert [*notes.parent.iterdir()] == [notes]


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["two_link_arm", "slider_crank_tolerances"])
def test_shards_of_one_command(studies, invoke, name):
    asked = [f"{name}.yaml", *ARM, "--no-plots"]
    assert invoke("reliability", *asked, "--out", "whole").exit_code == 0
    for k in (1, 2):
        assert invoke("reliability", *asked, "--out", "parts", "--shard", f"{k}/2").exit_code == 0
    assert invoke("merge", *asked, "--out", "parts").exit_code == 0
    assert content("parts") == content("whole")


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
    asked = ["two_link_arm.yaml", *ARM, "--no-plots", "--out", "parts"]
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "parts/reliability: there are no shards; compute them with --shard 1/N to N/N" in told.stderr
    for k in (1, 3):
        invoke("run", *asked, "--shard", f"{k}/3")
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "parts/reliability: shards are missing: 2/3; compute them, e.g. with --shard 2/3" in told.stderr
    invoke("run", *asked, "--shard", "2/3", "--seed", 5)
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "shard_2_of_3/chunks: is a shard of something else; other than here: seed, study" in told.stderr
    invoke("run", *asked, "--shard", "2/3")
    kept = studies / "parts/reliability/shard_2_of_3" / FILE
    whole = kept.read_bytes()
    kept.write_bytes(whole[:-1])
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "shard_2_of_3/chunks: is not a whole shard" in told.stderr
    # A requeued job computes it anew; one that is whole is kept.
    assert "shard 2/3 is kept" in invoke("run", *asked, "--shard", "2/3", "--resume").stderr
    assert kept.read_bytes() == whole
    before = kept.stat().st_mtime_ns
    invoke("run", *asked, "--shard", "2/3", "--resume")
    assert kept.stat().st_mtime_ns == before
    invoke("run", *asked, "--shard", "2/4")
    told = invoke("merge", *asked)
    assert told.exit_code == 2
    assert "there are shards of " in told.stderr


def test_a_shard_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(mechdesign.MechdesignError, match="the shard could not be written: No such file"):
        shards.Taken(shards.Shard(1, 2)).write(tmp_path / "nowhere", {}, "run")


def test_a_shard_is_data_alone(tmp_path):
    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "made"),)

    taken = shards.Taken(Shard(1, 1))
    taken.kept = {"work 1": shards.Kept(1, [Evil()])}
    taken.write(tmp_path, {}, "run")
    folder = tmp_path / "shard_1_of_1"
    folder.mkdir()
    (tmp_path / FILE).rename(folder / FILE)
    with pytest.raises(shards.StudyError, match="is not a whole shard"):
        shards.merge(tmp_path, {})
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--shard", "5/4"], "--shard takes I/N"),
        (["--shard", "1/2", "--report"], "--shard and --report contradict each other"),
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
def test_what_is_no_executor_or_shard(studies, invoke, options, message):
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
