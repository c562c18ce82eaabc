"""The command `import`: a study on stdout or in a file, messages in place of both."""

import mechdesign

ARM = """{"joints": [{"name": "O", "x": 0, "y": 0, "ground": "yes", "drive": "60 rpm"}, {"name": "P", "x": 3, "y": 4}],
 "links": [{"name": "arm", "joints": ["O", "P"]}]}"""


def test_a_file_becomes_a_study_that_runs(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.json").write_text(ARM)
    printed = invoke("import", "arm.json")
    assert printed.exit_code == 0
    assert mechdesign.load(text=printed.stdout).mechanism.drives == ("arm",)
    written = invoke("import", "arm.json", "--out", "arm.yaml", "--unit", "cm", "--scale", "2")
    assert written.exit_code == 0
    assert "length: 10" in (tmp_path / "arm.yaml").read_text()
    assert invoke("kinematics", "arm.yaml", "--no-plots", "--quiet").exit_code == 0
    again = invoke("import", "arm.json", "--out", "arm.yaml")
    assert (again.exit_code, "is there already" in again.stderr) == (2, True)


def test_what_cannot_be_imported_is_a_message(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.json").write_text(ARM.replace("60 rpm", "no"))
    for arguments, message in (
        (["arm.json"], "choose with --drive"),
        (["arm.json", "--drive", "Q"], "--drive Q"),
        (["none.dxf"], "cannot be read"),
        (["arm.json", "--drive", "O", "--out", "arm.json/arm.yaml"], "could not be written"),
    ):
        done = invoke("import", *arguments)
        assert done.exit_code == (4 if "arm.json/arm.yaml" in arguments else 2)
        assert message in done.stderr
    assert invoke("import", "arm.json", "--drive", "O", "--out", "new/arm.yaml").exit_code == 0
