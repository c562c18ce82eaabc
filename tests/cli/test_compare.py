"""Baselines: `compare` of two folders of results, and `run --verify` of what a manifest says."""

import csv
import hashlib
import io
import json
from pathlib import Path

import numpy as np
import pytest
from junitparser import JUnitXml

from mechdesign.door.report import manifest
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Table

from .conftest import SLIDER, answer

ARM = Path(__file__).parents[2] / "configs" / "two_link_arm.yaml"
GIVEN = "requirements: [{result: kinematics.B.x, where: {theta: 0}, at_most: 0.5}]\n"


def motion(theta=(0.0, 45.0, 90.0), x=(1 / 3, np.nan, 3.0), **more):
    """A result of `kinematics` with these positions; further columns by their names."""
    columns = [Column("theta", np.array(theta), "deg", "drive"), Column("B.x", np.array(x), "mm", "position")]
    columns += [Column(name, np.array(values)) for name, values in more.items()]
    return answer(tables={"motion": Table("motion", tuple(columns))})


@pytest.fixture
def results(folder, analysis, invoke):
    """Write the results of an analysis of the test's making into a folder of the working directory."""
    (folder / "slider.yaml").write_text(SLIDER + GIVEN)

    def write(name, result, *options):
        analysis(lambda study, **ignored: result)
        done = invoke("kinematics", "slider.yaml", "--no-plots", "--quiet", "--out", name, *options)
        assert done.exit_code in (0, 1), done.stderr

    return write


@pytest.fixture
def compared(invoke):
    """Compare folders `old` and `new`: the exit code and the differences by what they are about."""

    def compare(*options):
        done = invoke("compare", "old", "new", *options)
        return done, list(csv.DictReader(io.StringIO(done.stdout)))

    return compare


def short(differences):
    return {(each["table"], each["column"], each["change"]) for each in differences}


def test_the_same_results_are_equal_in_any_order_of_rows(results, compared):
    same = motion(x=(np.inf, np.nan, 3.0))
    results("old", same)
    results("new", motion((90.0, 0.0, 45.0), (3.0, np.inf, np.nan)))
    done, differences = compared()
    assert (done.exit_code, differences) == (0, [])
    assert "0 differences in 1 table with 2 columns" in done.stderr


def test_what_moved_by_how_much_and_where(results, compared):
    results("old", motion())
    results("new", motion((90.0, 45.0, 0.0), (3.25, np.nan, 0.375)))
    done, [moved] = compared()
    assert done.exit_code == 1
    assert short([moved]) == {("motion", "B.x", "moved")}
    assert (moved["rows"], moved["row"], moved["old"], moved["new"], moved["unit"]) == (
        "2",
        "theta 90",
        "3",
        "3.25",
        "mm",
    )
    assert (float(moved["largest"]), float(moved["relative"])) == pytest.approx((0.25, 0.25 / 3))


def test_nan_and_a_number_are_infinitely_apart(results, compared):
    results("old", motion())
    results("new", motion(x=(1 / 3, 2.0, 3.0)))
    done, [moved] = compared("--rtol", "1000", "--atol", "1000")
    assert (done.exit_code, moved["largest"], moved["old"], moved["new"]) == (1, "inf", "nan", "2")


def test_what_rounding_leaves_of_zero_is_no_difference(results, compared):
    results("old", motion(x=(0.0, np.nan, 3.0)))
    results("new", motion(x=(2e-16, np.nan, 3.0)))
    assert compared()[0].exit_code == 0
    assert compared("--atol", "0")[0].exit_code == 1


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--rtol", "1e-5"), 0),
        (("--rtol", "1e-7"), 1),
        (("--atol", "1e-5"), 0),
    ],
)
def test_tolerances(results, compared, options, code):
    results("old", motion())
    results("new", motion(x=(1 / 3 + 1e-6, np.nan, 3.0)))
    done, _ = compared(*options)
    assert done.exit_code == code


def test_a_manifest_is_the_result_that_it_describes(folder, results, invoke):
    results("old", motion())
    results("new/deep", motion(x=(1 / 3, np.nan, 4.0)))
    for old in ("old/manifest.json", "old"):
        done = invoke("compare", old, "new/deep/manifest.json")
        assert (done.exit_code, done.stdout.splitlines()[1:]) == (
            1,
            [".,motion,B.x,moved,1,1,0.333333333333,3,4,theta 90,mm"],
        )


def test_missing_and_new_tables_columns_and_rows(folder, results, compared):
    results("old", motion(gone=(1, 2, 3)))
    (folder / "slider.yaml").write_text(SLIDER.replace("to: 90, step: 45", "to: 90, step: 30"))
    more = motion((0.0, 30.0, 60.0, 90.0), (1 / 3, 1.0, 2.0, 3.0), made=(1, 2, 3, 4))
    table = more.tables["motion"]
    results("new", answer(tables={"motion": table, "limits": Table("limits", table.columns)}))
    done, differences = compared()
    assert done.exit_code == 1
    assert short(differences) == {
        ("limits", "", "new"),
        ("motion", "gone", "missing"),
        ("motion", "made", "new"),
        ("motion", "", "missing"),
        ("motion", "", "new"),
    }
    rows = {each["change"]: (each["rows"], each["row"]) for each in differences if each["row"]}
    assert rows == {"missing": ("1", "theta 45"), "new": ("2", "theta 30")}


def test_what_was_computed_from_something_else_is_noted(results, compared):
    results("old", motion())
    results("new", motion(), "--set", "mechanism.parameters.r=41", "--seed", "7")
    done, _ = compared()
    assert done.exit_code == 0
    assert "note: study: mechanism.parameters.r 40 -> 41" in done.stderr
    assert "note: seed: 0 -> 7" in done.stderr


def test_words_that_changed_are_told(results, compared):
    results("old", motion(state=("open", "shut", "open")))
    results("new", motion(state=("open", "shut", "shut")))
    _, [moved] = compared()
    assert (moved["column"], moved["row"], moved["old"], moved["new"]) == ("state", "theta 90", "open", "shut")


def test_limits_are_matched_within_the_tolerance_in_any_order(results, compared):
    """Where a limit lies is found, not given: of as many of a kind each is the next along the motion."""

    def limits(*rows):
        theta, kind = zip(*rows, strict=True)
        columns = Column("theta", np.array(theta), "deg"), Column("kind", np.array(kind))
        return answer(tables=motion().tables | {"limits": Table("limits", columns)})

    results("old", limits((10.0, "stop"), (80.0, "dead point"), (80.0, "stop")))
    results("new", limits((80.0, "stop"), (10.5, "stop"), (80.0, "dead point")))
    _, [moved] = compared()
    assert (moved["column"], moved["change"], moved["largest"]) == ("theta", "moved", "0.5")
    assert moved["row"].startswith("theta 10")
    assert compared("--rtol", "0.06")[0].exit_code == 0
    results("new", limits((80.0, "stop"), (80.0, "dead point")))
    assert [(each["change"], each["rows"]) for each in compared()[1]] == [("missing", "1")]


def test_drawn_samples_are_left_out(results, compared):
    for name, value in (("old", 1.0), ("new", 2.0)):
        drawn = {table: Table(table, (Column("x", np.array([value])),)) for table in ("histogram", "samples")}
        results(name, answer(tables=motion().tables | drawn))
    done, differences = compared()
    assert (done.exit_code, differences) == (0, [])
    assert "in 1 table" in done.stderr


def test_a_comparison_as_a_table_and_for_a_build_server(folder, results, compared):
    results("old/slider/kinematics", motion())
    results("new/slider/kinematics", motion(x=(0.25, np.nan, 3.0)))
    results("new/other/kinematics", motion())
    _, differences = compared("--junit", "junit.xml")
    assert short(differences) == {("motion", "B.x", "moved"), ("", "", "new")}
    suites = {
        suite.name: [(case.name, bool(case.result)) for case in suite] for suite in JUnitXml.fromfile("junit.xml")
    }
    assert suites == {"slider/kinematics": [("motion", True)], "other/kinematics": [("result", True)]}


def test_nothing_to_compare(folder, results, compared):
    results("old/kinematics", motion())
    done, _ = compared()
    assert done.exit_code == 2
    assert "new: there is no such folder of results" in done.stderr
    results("new/elsewhere", motion())
    done, _ = compared()
    assert done.exit_code == 2
    assert "no result stands in both folders; old has kinematics; new has elsewhere" in done.stderr
    results("new/kinematics", motion())
    (folder / "new/kinematics/motion.csv").write_text("theta\n1\n")
    done, _ = compared()
    assert done.exit_code == 2
    assert "motion.csv: is not the table that its manifest describes" in done.stderr


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("study", {"resolved": "a text"}),
        ("tool", ["mechdesign"]),
        ("requirements", [{"requirement": "x at most 1"}]),
        ("tables", {"motion.csv": {"columns": [{"name": ["theta"], "unit": "", "meaning": ""}]}}),
        ("command", []),
        ("seed", "1"),
        ("files", {}),
        ("files", ["motion.csv"]),
        ("files", {"motion.csv": "no hash"}),
        ("files", {"motion.csv": 64 * "0", "../slider.yaml": 64 * "0"}),
        ("overrides", {}),
        ("all_modes", 1),
    ],
)
def test_a_manifest_of_another_hand_is_none(folder, results, compared, invoke, key, value):
    for side in ("old", "new"):
        results(f"{side}/kinematics", motion())
    path = folder / "new/kinematics/manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    for done in (compared()[0], invoke("run", "--verify", "new")):
        assert done.exit_code == 2
        assert "manifest.json: is not a manifest that mechdesign wrote" in done.stderr


def test_verify_compares_which_files_there_are(folder, analysis, invoke):
    """Another in the manifest, or one less, is told, though every hash is that of its file."""
    analysis(lambda study, **ignored: answer(files={"notes.txt": "words"}))
    invoke("kinematics", "slider.yaml", "--no-plots", "--out", "old")
    path = folder / "old/manifest.json"
    content = json.loads(path.read_text())
    (folder / "old/more.txt").write_text("more")
    more = content["files"] | {"more.txt": hashlib.sha256(b"more").hexdigest()}
    for files, name in ((more, "more.txt"), ({"motion.csv": content["files"]["motion.csv"]}, "notes.txt")):
        path.write_text(json.dumps(content | {"files": files}))
        done = invoke("run", "--verify", "old")
        assert done.exit_code == 1
        assert short(csv.DictReader(io.StringIO(done.stdout))) == {(name, "", "bytes")}


def test_jobs_give_no_difference_and_a_manifest_is_repeated(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    for name, jobs in (("old", 1), ("new", 2)):
        run = ("--jobs", jobs, "--seed", 3, "--set", "mechanism.parameters.r1=11")
        assert invoke("run", ARM, "--no-plots", "--quiet", "--out", name, *run).exit_code in (0, 1)
    done = invoke("compare", "old", "new", "--rtol", "0", "--atol", "0")
    assert done.exit_code == 0, done.stdout
    assert invoke("run", "--verify", "old").exit_code == 0
    table = tmp_path / "old/kinematics/motion.csv"
    header, first, *rest = table.read_text().splitlines(keepends=True)
    table.write_text("".join([header, first.replace("30,60,", "30,60.5,"), *rest]))
    done = invoke("run", "--verify", "old/kinematics/manifest.json", "--json")
    assert done.exit_code == 1
    [moved] = json.loads(done.stdout)
    assert (moved["column"], moved["old"], moved["new"]) == ("theta2", "60.5", "60")


def test_verify_finds_files_beside_the_study_or_the_manifest(folder, invoke, monkeypatch):
    (folder / "studies").mkdir()
    (folder / "elsewhere").mkdir()
    (folder / "studies/angles.csv").write_text("0\n45\n")
    text = SLIDER[: SLIDER.index("kinematics:")] + "kinematics: {path: {theta: angles.csv}}\n"
    (folder / "studies/arm.yaml").write_text(text)
    assert invoke("kinematics", "studies/arm.yaml", "--no-plots", "--out", "deep/old").exit_code == 0
    monkeypatch.chdir(folder / "elsewhere")
    assert invoke("run", "--verify", "../deep/old").exit_code == 0
    (folder / "deep/old").rename(folder / "old")
    done = invoke("run", "--verify", "../old")
    assert done.exit_code == 2
    assert "angles.csv cannot be read: No such file" in done.stderr
    (folder / "studies/angles.csv").rename(folder / "old/angles.csv")
    assert invoke("run", "--verify", "../old").exit_code == 0
    (folder / "old/angles.csv").write_text("0\n60\n")
    done = invoke("run", "--verify", "../old")
    assert done.exit_code == 1
    assert "input angles.csv: another file" in done.stderr


def test_verify_tells_files_whose_bytes_are_others(analysis, invoke, folder):
    # A text that hangs on how the study is written, which its manifest has not.
    analysis(lambda study, **ignored: answer(tables=motion().tables, files={"study.yaml": study.text.decode()}))
    invoke("kinematics", "slider.yaml", "--no-plots", "--out", "old")
    assert invoke("run", "--verify", "old").exit_code == 0
    table, text = folder / "old/motion.csv", folder / "old/study.yaml"
    table.write_text(table.read_text().replace("90,3\n", "90,3.0\n"))
    text.write_text("other")
    done = invoke("run", "--verify", "old")
    assert done.exit_code == 1
    assert short(csv.DictReader(io.StringIO(done.stdout))) == {("motion", "", "bytes"), ("study.yaml", "", "bytes")}


@pytest.mark.parametrize("damage", [None, "theta,B.x,valid\n0,1,1,1\n"])
def test_verify_goes_on_after_a_table_that_cannot_be_read(analysis, invoke, folder, damage):
    analysis(lambda study, **ignored: answer(tables=motion().tables))
    for name in ("old/a", "old/b"):
        invoke("kinematics", "slider.yaml", "--no-plots", "--out", name)
    (folder / "old/a/motion.csv").unlink()
    if damage is not None:
        (folder / "old/a/motion.csv").write_text(damage)
    done = invoke("run", "--verify", "old")
    assert done.exit_code == 1
    assert short(csv.DictReader(io.StringIO(done.stdout))) == {("motion", "", "bytes")}
    assert "1 difference in 1 table" in done.stderr


def test_a_huge_manifest_is_none(folder, monkeypatch):
    monkeypatch.setattr(manifest, "_MOST_BYTES", 10)
    (folder / "manifest.json").write_text('{"files": {}}')
    assert manifest.read(folder) is None


def test_verify_takes_no_other_study(results, invoke):
    results("old", motion())
    done = invoke("run", "slider.yaml", "--verify", "old")
    assert (done.exit_code, "beside it stand no studies" in done.stderr) == (2, True)
    done = invoke("run", "--verify", "old", "--seed", 2)
    assert (done.exit_code, "no options but --jobs" in done.stderr) == (2, True)
    done = invoke("run", "--verify", "nowhere")
    assert (done.exit_code, "there is no such folder" in done.stderr) == (2, True)
