"""`mechdesign export`: where files go, and what they never replace."""

from pathlib import Path


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
