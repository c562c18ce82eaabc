"""Files of the user's stay: a run replaces what the manifest of its folder lists, and nothing that a study reads."""

from __future__ import annotations

import json
import os
import shutil
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

import mechdesign
from mechdesign.commands import QUESTIONS
from mechdesign.door.exporting.exports import exports
from mechdesign.door.reference.tables import tables
from mechdesign.door.report.names import names
from mechdesign.ground.errors import StudyError

from .conftest import SLIDER, answer

MINE = b"0\n30\n60\n"
BY_FILE = SLIDER[: SLIDER.index("kinematics:")] + "kinematics: {path: {theta: motion.csv}}\n"
ROOT = Path(__file__).parents[2]


def refused(done, name):
    """Ends with 2 before anything is computed, and names the file."""
    return done.exit_code == 2 and name in done.stderr and "rows in" not in done.stderr


@pytest.fixture
def uncomputed(analysis):
    def fail(study, **options):
        raise AssertionError("it was computed")

    analysis(fail)


@pytest.mark.parametrize("arguments", [("kinematics", "slider.yaml", "--out", "."), ("run", "slider.yaml")])
def test_an_input_is_not_replaced_by_a_result(folder, invoke, uncomputed, arguments):
    place = folder if arguments[0] == "kinematics" else folder / "results/slider/kinematics"
    place.mkdir(parents=True, exist_ok=True)
    (place / "motion.csv").write_bytes(MINE)
    (folder / "slider.yaml").write_text(BY_FILE.replace("motion.csv", os.path.relpath(place / "motion.csv")))
    assert refused(invoke(*arguments), "motion.csv: is read here")
    assert (place / "motion.csv").read_bytes() == MINE
    assert {path.name for path in place.iterdir()} <= {"motion.csv", "slider.yaml", "results"}


def test_an_input_that_a_manifest_lists_is_not_replaced_and_not_removed(folder, analysis, invoke):
    assert invoke("kinematics", "slider.yaml", "--no-plots", "--out", ".").exit_code == 0
    (folder / "other.yaml").write_text(BY_FILE)
    (folder / "motion.csv").write_bytes(MINE)
    for command in ("kinematics", "stiffness"):
        assert refused(invoke(command, "other.yaml", "--no-plots", "--out", "."), "motion.csv: is read here")
        assert (folder / "motion.csv").read_bytes() == MINE


def test_a_study_is_not_removed_with_the_results_that_it_stands_among(folder, analysis, invoke):
    analysis(lambda study, **options: answer(files={"optimum.yaml": SLIDER}))
    assert invoke("kinematics", "slider.yaml", "--no-plots", "--out", "out").exit_code == 0
    assert refused(invoke("kinematics", "out/optimum.yaml", "--no-plots", "--out", "out"), "optimum.yaml")
    assert (folder / "out/optimum.yaml").read_text() == SLIDER


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("motion.csv", ("--no-plots",)), ("manifest.json", ("--no-plots",)), ("paths.svg", ("--format", "png,svg")),
        ("report.html", ("--no-plots", "--report")), ("report.json", ("--no-plots", "--report")),
        ("motion.gif", ("--animate",)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("what", ["file", "link", "dangling", "folder"])
def test_what_no_manifest_lists_stays(folder, invoke, uncomputed, name, options, what):
    """Also a folder of that name, and a link, wherever it leads."""
    (folder / "out").mkdir()
    (folder / "mine").write_bytes(MINE)
    place = folder / "out" / name
    if what == "file":
        place.write_bytes(MINE)
    elif what == "folder":
        place.mkdir()
    else:
        place.symlink_to("../mine" if what == "link" else "nowhere")
    assert refused(invoke("kinematics", "slider.yaml", "--out", "out", *options), name)
    assert [path.name for path in (folder / "out").iterdir()] == [name]
    assert (folder / "mine").read_bytes() == MINE


def test_other_files_are_in_no_way(folder, analysis, invoke):
    for name in ("angles.csv", "photo.png", "notes.html", "package.json"):
        (folder / name).write_bytes(MINE)
    (folder / "slider.yaml").write_text(BY_FILE.replace("motion.csv", "angles.csv"))
    for _ in range(2):
        assert invoke("kinematics", "slider.yaml", "--out", ".").exit_code == 0
    assert all((folder / name).read_bytes() == MINE for name in ("angles.csv", "photo.png", "notes.html"))


def test_a_manifest_of_another_program_lists_nothing_of_ours(folder, invoke, uncomputed):
    (folder / "thesis.csv").write_bytes(MINE)
    (folder / "manifest.json").write_text('{"name": "app", "files": {"thesis.csv": "", "motion.csv": ""}}')
    assert refused(invoke("kinematics", "slider.yaml", "--no-plots", "--out", "."), "manifest.json")
    assert (folder / "thesis.csv").read_bytes() == MINE


def test_a_link_that_a_manifest_lists_is_not_followed(folder, analysis, invoke):
    arguments = ("kinematics", "slider.yaml", "--no-plots", "--out", "out")
    assert invoke(*arguments).exit_code == 0
    (folder / "out/motion.csv").rename(folder / "moved.csv")
    (folder / "out/motion.csv").symlink_to("../moved.csv")
    kept = (folder / "moved.csv").read_bytes()
    assert refused(invoke(*arguments, "--seed", 2), "motion.csv: is a link")
    assert (folder / "moved.csv").read_bytes() == kept


def test_a_file_that_comes_while_it_is_computed_stays(folder, analysis, invoke):
    def compute(study, **options):
        (folder / "out/unforeseen.csv").write_bytes(MINE)
        return answer(files={"unforeseen.csv": "words"})

    analysis(compute)
    done = invoke("kinematics", "slider.yaml", "--no-plots", "--out", "out")
    assert (done.exit_code, "unforeseen.csv" in done.stderr) == (2, True)
    assert {path.name for path in (folder / "out").iterdir()} == {"unforeseen.csv"}
    assert (folder / "out/unforeseen.csv").read_bytes() == MINE


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("junit", ("run", "slider.yaml", "--junit", "junit")),
        ("slider.yaml", ("run", "slider.yaml", "--junit", "slider.yaml")),
        ("junit", ("sweep", "slider.yaml", "--junit", "junit")),
        ("junit", ("compare", "results", "results", "--junit", "junit")),
        ("junit", ("run", "--verify", "results", "--junit", "junit")),
        ("out/summary.csv", ("run", "slider.yaml", "other.yaml", "--out", "out")),
        ("out/index.html", ("run", "slider.yaml", "other.yaml", "--out", "out", "--report")),
        ("out/report.html", ("run", "slider.yaml", "--out", "out", "--report")),
        ("out/mechanism.png", ("check", "slider.yaml", "--out", "out")),
        ("out/dimensions.svg", ("check", "slider.yaml", "--out", "out", "--format", "png,svg")),
        ("out/unfinished.npz", ("sweep", "slider.yaml", "--out", "out", "--vary", "mechanism.parameters.r=40,41")),
    ],
)  # fmt: skip
@pytest.mark.parametrize("link", [False, True])
def test_every_writer_leaves_what_is_not_its_own(folder, invoke, uncomputed, name, arguments, link):
    (folder / "out").mkdir()
    (folder / "other.yaml").write_text(SLIDER)
    content = SLIDER.encode() if name == "slider.yaml" else MINE
    if link and name != "slider.yaml":
        (folder / "mine").write_bytes(content)
        (folder / name).symlink_to(folder / "mine")
    else:
        (folder / name).write_bytes(content)
    done = invoke(*arguments)
    assert refused(done, name), done.stderr
    assert (folder / name).read_bytes() == content
    assert (folder / name).is_symlink() == (link and name != "slider.yaml")


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_own_files_are_replaced(folder, analysis, invoke, kind):
    """Of every writer, a second time: also what no manifest lists."""
    (folder / "other.yaml").write_text(SLIDER)
    values = iter((1.0, 2.0, 3.0, 4.0) * 2)
    for _ in range(2):
        run = ("run", "slider.yaml", "other.yaml", "--no-plots", "--report", "--junit", "junit.xml", "--jobs", 1)
        for out in ("one", "two"):
            analysis(lambda study, **options: answer(counts={"poses": int(next(values))}))
            assert invoke(*run, "--out", out).exit_code == 0
        assert invoke("check", "slider.yaml", "--out", "drawn", "--format", kind).exit_code == 0
        moved = folder / "two/slider/kinematics/motion.csv"
        moved.write_text(moved.read_text().replace("90,3,", "90,4,"))
        done = invoke("compare", "one", "two", "--junit", "junit.xml", "--quiet")
        assert done.exit_code == 1, done.stderr
    assert {path.name for path in (folder / "drawn").iterdir()} == {
        ".mechdesign.json",
        f"mechanism.{kind}", f"dimensions.{kind}"}  # fmt: skip


def test_a_junit_file_replaces_none_an_empty_one_or_its_own(folder, analysis, invoke):
    assert invoke("run", "slider.yaml", "--no-plots", "--junit", "/dev/null").exit_code == 0
    (folder / "empty").touch()
    for name in ("empty", "new.xml", "empty"):
        assert invoke("run", "slider.yaml", "--no-plots", "--junit", name).exit_code == 0
        assert "mechdesign" in (folder / name).read_text()
    text = (folder / "new.xml").read_text() + "<!-- by hand -->"
    (folder / "new.xml").write_text(text)
    done = invoke("run", "slider.yaml", "--no-plots", "--junit", "new.xml")
    assert refused(done, "new.xml: is no result of mechdesign's, or was changed since it was written")
    assert (folder / "new.xml").read_text() == text


# A study of which everything can be exported, whose drives take its motion from a file.
CUT = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 25]
    rod: {from: A, to: B, length: 90, points: {P: [45, 20]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [25, 0], B: [75, 55]}
  plates: {width: 14, pin: 5}
kinematics: {sweep: {theta: {from: 0, to: 90, step: 45}}, rates: {theta: 60 rpm}, outputs: [P]}
"""
WRITERS = [
    ("kinematics", "cut.yaml", "--out", "FOLDER", "--format", "png,svg,pdf", "--report", "--animate"),
    (
        "sweep",
        "cut.yaml",
        "--out",
        "FOLDER",
        "--report",
        "--vary",
        "mechanism.plates.pin=4,5",
        "--results",
        "kinematics.P.x.max",
    ),
    ("run", "cut.yaml", "slider.yaml", "--out", "FOLDER", "--no-plots", "--report"),
    ("check", "cut.yaml", "--out", "FOLDER", "--format", "png,svg,pdf"),
    ("compare", "old", "new", "--junit", "FOLDER/report.xml"),
    *(("export", "cut.yaml", "--to", name, "--out", "FOLDER") for name in exports()),
    ("export", "cut.yaml", "--to", "study.json", "--out", "FOLDER/mine.json"),
    ("import", "slider.dxf", "--out", "FOLDER/study.yaml"),
    ("run", "slider.yaml", "--no-plots", "--junit", "FOLDER/report.xml"),
]


def files_of(place):
    return {path.relative_to(place): path.read_bytes() for path in place.rglob("*") if path.is_file()}


@pytest.mark.nightly
@pytest.mark.parametrize("arguments", WRITERS, ids=" ".join)
def test_files_of_the_user_that_look_like_ours_stay(folder, invoke, arguments):
    """Whoever keeps copies of what mechdesign writes, or writes such files by hand, finds them as they were."""
    (folder / "cut.yaml").write_text(CUT)
    for name, end in (("old", 90), ("new", 45)):
        override = f"kinematics.sweep.theta.to={end}"
        assert invoke("kinematics", "slider.yaml", "--no-plots", "--out", name, "--set", override).exit_code == 0

    def ask(place):
        return invoke(*(word.replace("FOLDER", place) for word in arguments))

    (folder / "ours").mkdir()
    if arguments[0] == "import":
        (folder / "ours/study.yaml").write_text(SLIDER)
    else:
        done = ask("ours")
        assert done.exit_code in (0, 1), done.stderr
        # Its own files it replaces.
        assert ask("ours").exit_code == done.exit_code
    copies = {path: data for path, data in files_of(folder / "ours").items()
              if path.name not in ("manifest.json", ".mechdesign.json")}  # fmt: skip
    assert copies
    for path in copies:
        (folder / "mine").mkdir()
        (folder / "mine" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "mine" / path).write_bytes(copies[path])
        done = ask("mine")
        assert done.exit_code == 2, (path, done.stderr)
        assert path.name in done.stderr
        left = files_of(folder / "mine")
        # One of several studies does not stop the others.
        assert left[path] == copies[path], path
        assert arguments[0] == "run" or len(left) == 1, path
        shutil.rmtree(folder / "mine")


def test_an_export_replaces_nothing_that_the_study_reads(folder, invoke):
    """Not even a file that it wrote itself."""
    (folder / "motion.csv").write_bytes(MINE)
    (folder / "by_file.yaml").write_text(BY_FILE)
    assert refused(invoke("export", "by_file.yaml", "--to", "motion.csv", "--out", "."), "motion.csv: is read here")
    assert (folder / "motion.csv").read_bytes() == MINE
    assert invoke("export", "slider.yaml", "--to", "study.json", "--out", ".").exit_code == 0
    data = (folder / "study.json").read_bytes()
    assert invoke("export", "slider.yaml", "--to", "study.json", "--out", ".").exit_code == 0
    done = invoke("export", "study.json", "--to", "study.json", "--out", ".", "--set", "mechanism.parameters.r=41")
    assert refused(done, "study.json: is read here")
    assert (folder / "study.json").read_bytes() == data


def test_an_export_that_was_edited_stays(folder, invoke):
    arguments = ("export", "slider.yaml", "--to", "mechanism.svg", "--out", "drawn")
    assert invoke(*arguments).exit_code == 0
    edited = (folder / "drawn/mechanism.svg").read_bytes() + b"<!-- by hand -->"
    (folder / "drawn/mechanism.svg").write_bytes(edited)
    assert refused(invoke(*arguments), "mechanism.svg: is no result of mechdesign's, or was changed")
    assert (folder / "drawn/mechanism.svg").read_bytes() == edited


def test_results_that_another_study_of_the_same_run_reads_stay(folder, invoke):
    assert invoke("run", "slider.yaml", "--no-plots").exit_code == 0
    made = folder / "results/slider/kinematics/motion.csv"
    angles = "results/slider/kinematics/angles.csv"
    made.with_name("angles.csv").write_bytes(MINE)
    content = json.loads(made.with_name("manifest.json").read_text())
    content["files"]["angles.csv"] = ""
    made.with_name("manifest.json").write_text(json.dumps(content))
    (folder / "second.yaml").write_text(BY_FILE.replace("motion.csv", angles))
    done = invoke("run", "slider.yaml", "second.yaml", "--no-plots")
    assert (done.exit_code, "angles.csv: is read here" in done.stderr) == (2, True)
    assert made.with_name("angles.csv").read_bytes() == MINE


def test_temporary_files_of_others_stay(folder, analysis, invoke):
    (folder / "out").mkdir()
    for name in (".notes.csv.99999999.tmp", ".mechdesign.motion.csv.99999999.tmp"):
        (folder / "out" / name).write_bytes(MINE)
    assert invoke("kinematics", "slider.yaml", "--no-plots", "--out", "out").exit_code == 0
    assert [path.name for path in (folder / "out").glob(".*")] == [".notes.csv.99999999.tmp"]


def test_a_record_of_another_program_stays(folder, invoke):
    (folder / ".mechdesign.json").write_bytes(MINE)
    done = invoke("export", "slider.yaml", "--to", "mechanism.svg", "--out", ".")
    assert refused(done, ".mechdesign.json")
    assert (folder / ".mechdesign.json").read_bytes() == MINE


def test_an_answer_in_python_leaves_them_too(folder):
    (folder / "motion.csv").write_bytes(MINE)
    answered = mechdesign.kinematics(mechdesign.load("slider.yaml"))
    with pytest.raises(StudyError, match=r"motion.csv: is no result"):
        answered.save(".", plots=False)
    assert (folder / "motion.csv").read_bytes() == MINE


@pytest.mark.parametrize("label", ["summary.csv", "index.html"])
def test_no_study_has_the_name_of_a_file_about_all(folder, analysis, invoke, label):
    (folder / f"{label}.yaml").write_text(SLIDER)
    done = invoke("run", "slider.yaml", f"{label}.yaml", "--no-plots", "--report", "--out", "out")
    assert (done.exit_code, "rename the study" in done.stderr) == (2, True)
    assert (folder / "out/summary.csv").is_file()
    assert (folder / "out/index.html").is_file()


def test_names_of_files_are_foreseen():
    """Every table of the reference, and every file of the shipped results, is one that its command may write."""
    listed = [(command, f"{table.name}.csv") for command, table in tables() if command in QUESTIONS]
    for path in (ROOT / "results").rglob("manifest.json"):
        content = json.loads(path.read_text(encoding="utf-8"))
        listed += [(content["command"], name) for name in content["files"]]
    unforeseen = [
        (command, name)
        for command, name in listed
        if not any(fnmatchcase(name, pattern) for pattern in names(command, "png", animate=True))
    ]
    assert len(listed) > 500
    assert not unforeseen
