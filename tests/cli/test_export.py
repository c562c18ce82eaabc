"""`mechdesign export`: where files go, and what they never replace."""

from pathlib import Path

import pytest

import mechdesign

from .conftest import SLIDER


def test_a_file_goes_to_results_or_to_out_and_replaces_only_its_own_kind(folder, invoke):
    done = invoke("export", "slider.yaml", "--to", "layers.csv", "--set", "mechanism.plates={width: 10}")
    assert (done.exit_code, done.stdout) == (0, "")
    assert Path("results/slider/export/layers.csv").read_text().startswith("item,kind,first_layer")
    for _ in range(2):
        done = invoke("export", "slider.yaml", "--to", "parts.svg", "--out", "sheet.svg", "--quiet")
        assert (done.exit_code, done.stderr) == (0, "")
    assert Path("sheet.svg").exists()
    done = invoke("export", "slider.yaml", "--to", "parts.dxf", "--out", "cut")
    assert done.exit_code == 0
    assert Path("cut/parts.dxf").exists()
    assert "the study has no mechanism.plates: links are taken as" in done.stderr
    Path("mine.dxf").write_text("of another program")
    done = invoke("export", "slider.yaml", "--to", "parts.dxf", "--out", "mine.dxf")
    assert done.exit_code == 2
    assert "mine.dxf: is no result of mechdesign's" in done.stderr


def test_wrong_poses_and_names_are_told(folder, invoke):
    for arguments, code, words in (
        (("--to", "part.dxf"), 2, "there is no 'part.dxf' to export; did you mean 'parts.dxf'?"),
        (("--to", "mechanism.svg", "--at", "60"), 2, "--at is a pose such as theta=60, not '60'"),
        (("--to", "mechanism.svg", "--at", "theta=60 mm"), 2, "'60 mm' is a length, where an angle is expected"),
        (("--to", "mechanism.svg", "--at", "theta=30, theta=40"), 2, "--at gives theta twice"),
        (
            ("--to", "parts.svg", "--at", "theta=60", "--rate", "1 kHz"),
            0,
            "--rate has no effect on parts.svg",
        ),
        (("--to", "mechanism.svg", "--at", "B.x=500"), 3, "cannot be assembled"),
        (("--to", "parts.dxf", "--strict"), 1, "requirement: "),
    ):
        done = invoke("export", "slider.yaml", *arguments)
        assert done.exit_code == code, arguments
        assert words in " ".join(done.stderr.split()), arguments


@pytest.mark.parametrize(
    ("rate", "words"),
    [("10 MHz", "at most 1000000 are possible: ask for a lower --rate"), ("1e3 Hz", ""), ("2.5 kHz", ""),
     ("1 GHz", "at most"), ("500", "--rate is a rate such as '1 kHz'"),
     ("0 Hz", "--rate is a rate"), ("1e-320 Hz", "--rate is a rate")],
)  # fmt: skip
def test_a_rate_of_any_prefix_is_read_and_one_too_high_is_told_the_bound(folder, invoke, rate, words):
    (folder / "slider.yaml").write_text(SLIDER + "  rates: {theta: 60 rpm}\n")
    done = invoke("export", "slider.yaml", "--to", "motion.csv", "--rate", rate, "--out", ".")
    assert (done.exit_code, words in done.stderr) == (2 * bool(words), True), done.stderr
    if not words:
        # A quarter of a turn at 1 Hz.
        hertz = {"1e3 Hz": 1000, "2.5 kHz": 2500}[rate]
        assert len(Path("motion.csv").read_text().splitlines()) == hertz // 4 + 2


@pytest.mark.parametrize("letter", ["\x7f", "\x85", "\x9f", "\u2028", "\u2029", "\ufeff", "\U000e0001"])
def test_a_study_as_json_keeps_every_letter_of_its_name(folder, invoke, letter):
    text = f'name: "a\\U{ord(letter):08x}b"\n' + SLIDER.partition("\n")[2]
    (folder / "slider.yaml").write_text(text, encoding="utf-8")
    assert invoke("export", "slider.yaml", "--to", "study.json", "--out", ".").exit_code == 0
    assert invoke("check", "study.json", "--no-plots").exit_code == 0
    assert mechdesign.load("study.json").name == f"a{letter}b"


def test_a_study_as_json_names_files_that_lie_anywhere(folder, invoke):
    (folder / "deep").mkdir()
    (folder / "angles.csv").write_text("0\n45\n")
    head = SLIDER[: SLIDER.index("kinematics:")]
    for name in ("../angles.csv", str(folder / "angles.csv")):
        (folder / "deep/slider.yaml").write_text(head + f"kinematics: {{path: {{theta: {name}}}}}\n")
        done = invoke("export", "deep/slider.yaml", "--to", "study.json", "--out", "made", "--allow-files")
        assert (done.exit_code, "(../angles.csv)" in done.stderr) == (0, True), done.stderr
