"""What Windows and macOS do otherwise, as far as it can be shown here: names, files that are open, letters, texts.

`test_other_systems.py` runs whole commands where files, signals and processes are as there.
"""

from __future__ import annotations

import io
import json
import ntpath
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

import mechdesign
from mechdesign.door.cli import process
from mechdesign.door.cli.options import _studies
from mechdesign.ground import files
from mechdesign.ground.work import chunks
from mechdesign.study.variants import changed_data, in_text

from .conftest import SLIDER


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def held(monkeypatch):
    """Names of files that another program has open: Windows neither replaces nor removes them."""
    names = set()

    def refusing(refused, which):
        def call(*paths, **further):
            if any(Path(path).name in names and os.path.exists(path) for path in paths[:which]):
                raise PermissionError(13, "The process cannot access the file because it is being used by another")
            return refused(*paths, **further)

        return call

    monkeypatch.setattr(os, "replace", refusing(os.replace, 2))
    monkeypatch.setattr(os, "unlink", refusing(os.unlink, 1))
    return names


@pytest.mark.parametrize(
    ("command", "name", "place"),
    [
        ("run slider.yaml --no-plots --out out", "motion.csv", "out/kinematics"),
        pytest.param(
            "run slider.yaml --no-plots --out out", "manifest.json", "out/kinematics", marks=pytest.mark.nightly
        ),
        pytest.param("run slider.yaml --out out", "motion.png", "out/kinematics", marks=pytest.mark.nightly),
        ("kinematics slider.yaml --no-plots --report --out out", "report.html", "out"),
        pytest.param("run slider.yaml --no-plots --junit ci/gate.xml", "gate.xml", "ci", marks=pytest.mark.nightly),
        pytest.param(
            "export slider.yaml --to study.json --out out/study.json", "study.json", "out", marks=pytest.mark.nightly
        ),
    ],
)
def test_a_file_that_is_open_elsewhere_is_named_and_nothing_is_half_written(folder, invoke, held, command, name, place):
    assert invoke(*command.split()).exit_code == 0
    before = contents(folder / place)
    (folder / "slider.yaml").write_text(SLIDER.replace("120]", "130]"))
    held.add(name)
    done = invoke(*command.split())
    assert done.exit_code == 4
    told = "cannot be replaced: it is open in another program, or write-protected; close it there, and try again"
    assert f"{name}: {told}" in done.stderr
    after = contents(folder / place)
    for record in (before, after):
        record.pop(".mechdesign.json", None)  # lists both, of which either may be there
    assert after == before
    held.clear()
    assert invoke(*command.split()).exit_code == 0
    assert contents(folder / place) != before


@pytest.mark.parametrize(
    ("file", "label"),
    [
        ("aux.yaml", "_aux"),
        ("CON.yaml", "_CON"),
        ("com1.v2.yaml", "_com1.v2"),
        ("a:b.yaml", "a_b"),
        ('a<b>"c|d?e*.yaml', "a_b__c_d_e_"),
        ("arm. .yaml", "arm"),
        ("ends in dot..yaml", "ends in dot"),
        ("console.yaml", "console"),
        ("B\N{LATIN SMALL LETTER O WITH DIAERESIS}ck.yaml", "B\N{LATIN SMALL LETTER O WITH DIAERESIS}ck"),
    ],
)
def test_results_have_a_folder_that_windows_takes(folder, analysis, invoke, file, label):
    (folder / file).write_text(SLIDER)
    assert invoke("run", file, "--no-plots").exit_code == 0
    assert [path.name for path in (folder / "results").iterdir() if path.is_dir()] == [label]
    assert mechdesign.load(folder / file).label == label


def test_a_copy_of_a_table_has_a_name_that_windows_takes(folder, invoke):
    (folder / "a:b.csv").write_text("0,100\n90,60\n")
    study = SLIDER.replace("  sketch", "  targets: {B.x: 'a:b.csv'}\n  sketch")
    goal = (
        "optimize: {variables: {r: {from: 40, to: 41, step: 1}}, method: grid, minimize: [kinematics.B.x_error.rms]}\n"
    )
    (folder / "slider.yaml").write_text(study + goal)
    for _ in range(2):
        done = invoke("optimize", "slider.yaml", "--no-plots", "--out", "out")
        assert done.exit_code == 0, done.stderr
    assert (folder / "out/input_a_b.csv").exists()


@pytest.mark.parametrize("file", ["Slider.yaml", "SLIDER.yml", "slider..yaml", "slider:.yaml"])
def test_two_studies_have_no_folder_that_windows_takes_for_one(folder, analysis, invoke, file):
    (folder / file).write_text(SLIDER)
    done = invoke("run", "slider.yaml", file, "--no-plots")
    if file == "slider:.yaml":
        assert done.exit_code == 0
        assert {path.name for path in (folder / "results").iterdir() if path.is_dir()} == {"slider", "slider_"}
    else:
        assert done.exit_code == 2
        assert "its results would overwrite those of slider.yaml; rename one of the files" in done.stderr


def test_a_file_of_another_case_is_not_replaced_where_it_is_the_same(folder, invoke):
    (folder / "out").mkdir()
    (folder / "out/Motion.csv").write_text("mine")
    assert invoke("kinematics", "slider.yaml", "--no-plots", "--out", "out").exit_code == 0
    # A second name of the file stands for a folder that knows no case.
    (folder / "in").mkdir()
    (folder / "in/Motion.csv").write_text("mine")
    os.link(folder / "in/Motion.csv", folder / "in/mOTION.CSV")
    done = invoke("kinematics", "slider.yaml", "--no-plots", "--out", "in")
    assert done.exit_code == 2
    assert "is no result of mechdesign's, and would be replaced" in done.stderr


@pytest.mark.parametrize("name", ["C:x.csv", r"..\x.csv", "a/b", "..", "x\0"])
def test_a_manifest_names_no_file_of_another_folder_or_drive(name):
    assert not files.proper(name)


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_texts_of_other_systems_are_read(folder, encoding, ending):
    """As Notepad saves them, or the > of PowerShell, with a table beside."""
    table = "0,0\n10,5\n20,0\n".replace("\n", ending).encode(encoding)
    (folder / "table.csv").write_bytes(table)
    study = SLIDER.replace("[A, B, 120]", "[A, B, 120]  # l\N{LATIN SMALL LETTER E WITH ACUTE}ngth")
    study = study.replace("  sketch", "  targets: {B.x: table.csv}\n  sketch")
    (folder / "slider.yaml").write_bytes(study.replace("\n", ending).encode(encoding))
    loaded = mechdesign.load("slider.yaml")
    assert loaded.mechanism.description.places["rod.length"].nominal == 120
    assert [text.splitlines() for _, _, text in loaded.inputs()] == [["0,0", "10,5", "20,0"]]


def test_a_study_in_a_code_page_says_what_to_do(folder, invoke):
    (folder / "slider.yaml").write_bytes(f"# L\N{LATIN SMALL LETTER E WITH ACUTE}ver\n{SLIDER}".encode("cp1252"))
    done = invoke("check", "slider.yaml", "--no-plots")
    assert done.exit_code == 2
    assert "is not a text file in UTF-8" in done.stderr
    assert "save" in done.stderr


def test_a_changed_study_keeps_its_line_ends(folder):
    (folder / "slider.yaml").write_bytes(SLIDER.replace("\n", "\r\n").encode("utf-8-sig"))
    study = mechdesign.load("slider.yaml")
    text = in_text(study, changed_data(study, {"rod.length": 130.0}))
    assert "rod: [A, B, 130.0]" in text
    assert text.count("\r\n") == text.count("\n") == SLIDER.count("\n")


@pytest.mark.parametrize("place", [r"C:\studies\arm.yaml", r"\\server\share\arm.yaml"])
def test_a_place_with_a_drive_stands_whole_in_a_message(place):
    with pytest.raises(mechdesign.StudyError) as error:
        mechdesign.load(place)
    assert str(error.value).startswith(f"{place}: cannot be read")


def test_a_table_behind_backslashes_says_what_every_system_reads(folder):
    text = SLIDER.replace("  sketch", "  targets: {B.x: data\\table.csv}\n  sketch")
    with pytest.raises(mechdesign.StudyError, match=r"cannot be read.*every system reads / between folders"):
        mechdesign.load(text=text)


def test_there_is_no_way_between_two_drives(monkeypatch):
    monkeypatch.setattr(os.path, "relpath", ntpath.relpath)
    monkeypatch.setattr(os.path, "abspath", str)
    monkeypatch.setattr(ntpath, "abspath", ntpath.normpath)
    assert files.way(r"D:\data\curve.csv", r"C:\studies") == r"D:\data\curve.csv"
    assert files.way(r"C:\data\curve.csv", r"C:\studies").replace("\\", "/") == "../data/curve.csv"


def test_results_on_another_drive_than_the_study(folder, invoke, monkeypatch):
    def relpath(path, start="."):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    (folder / "table.csv").write_text("0,0\n10,5\n20,0\n")
    (folder / "slider.yaml").write_text(SLIDER.replace("  sketch", "  targets: {B.x: table.csv}\n  sketch"))
    monkeypatch.setattr(os.path, "relpath", relpath)
    done = invoke("kinematics", "slider.yaml", "--no-plots", "--out", "out")
    assert done.exit_code == 0, done.stderr
    content = json.loads((folder / "out/manifest.json").read_text())
    assert content["inputs_in"] == folder.as_posix()
    assert invoke("run", "--verify", "out").exit_code == 0


def test_no_more_processes_begin_than_the_system_can_wait_for(monkeypatch):
    """On Windows 61, whatever is asked; on a computer of 96 processors, too."""
    monkeypatch.setattr(chunks, "_MOST", 61)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(96)), raising=False)
    assert (chunks.worker_count(None), chunks.worker_count(100), chunks.worker_count(4)) == (61, 61, 4)


def test_a_study_is_completed_behind_a_backslash(folder, monkeypatch):
    monkeypatch.setattr(os, "sep", "\\")
    assert _studies("sl") == ["slider.yaml"]
    assert _studies("nothere\\sl") == []


class Console(io.RawIOBase):
    """A console that takes letters, in the way of that of Windows, which is no file."""

    def __init__(self):
        self.shown = b""

    def writable(self):
        return True

    def write(self, data):
        self.shown += bytes(data)
        return len(data)


def test_the_console_of_windows_stays_what_letters_go_to():
    console = Console()
    old = io.TextIOWrapper(io.BufferedWriter(console), "utf-8", write_through=True)
    stream = process._stream(process._Unfailing(2), old)
    stream.write("90\N{DEGREE SIGN}\n")
    stream.flush()
    assert console.shown == "90\N{DEGREE SIGN}\n".encode()


@pytest.mark.parametrize(
    ("encoding", "told"),
    [
        ("cp1252", "–, -inf, 2*10^-6 N·mm², 3 µm ?"),
        ("cp437", "-, -∞, 2*10^-6 N·mm², 3 µm ?"),
        ("ascii", "-, -inf, 2*10^-6 N*mm^2, 3 um ?"),
    ],
)
def test_what_a_code_page_lacks_is_written_in_other_letters(tmp_path, encoding, told):
    with (tmp_path / "out").open("wb") as file:
        stream = process._stream(process._Unfailing(file.fileno()), SimpleNamespace(encoding=encoding))
        stream.write("\N{EN DASH}, \N{MINUS SIGN}\N{INFINITY}, 2\N{MIDDLE DOT}10⁻⁶ N·mm², 3 µm \N{SNOWMAN}\n")
        stream.flush()
    assert (tmp_path / "out").read_bytes().decode(encoding) == told + "\n"


@pytest.mark.parametrize(
    "arguments", [["--help"], pytest.param(["docs"], marks=pytest.mark.nightly), ["new"], ["run", "--help"]]
)
def test_code_pages_of_consoles_have_the_letters_of_help(invoke, arguments):
    """But the Greek letter that a unit may be written with, beside the sign."""
    letters = {*invoke(*arguments).stdout} - {"\N{GREEK SMALL LETTER MU}"}
    for encoding in ("cp1252", "cp437"):
        assert not {letter for letter in letters if not letter.encode(encoding, "ignore")}
