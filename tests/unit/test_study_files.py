"""Files that a study names: in its folder, of bounded size, and never quoted."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import mechdesign

ARM = "mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm], sketch: {P: [100, 0]}}\n"


def arm(folder: Path, file: str, **options: bool) -> mechdesign.Study:
    folder.mkdir(exist_ok=True)
    path = folder / "study.yaml"
    path.write_text(f"{ARM}kinematics: {{path: {{arm: {{file: '{file}'}}}}}}\n")
    return mechdesign.load(path, **options)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    file = tmp_path / "angles.csv"
    file.write_text("10\n20\n")
    return file


@pytest.mark.parametrize("how", ["above", "absolute", "link"])
def test_files_lie_in_the_folder_of_the_study_unless_allowed(tmp_path: Path, outside: Path, how: str) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "link.csv").symlink_to(outside)
    name = {"above": "../angles.csv", "absolute": str(outside), "link": "link.csv"}[how]
    with pytest.raises(
        mechdesign.StudyError, match=r"kinematics\.path: .* is not in the folder of the study; --allow-files"
    ):
        arm(folder, name)
    ((keys, _, content),) = arm(folder, name, allow_files=True).inputs()
    assert keys == ("kinematics", "path", "arm", "file")
    assert content == "10\n20\n"


def test_what_is_no_regular_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    for name in ("pipe.csv", "folder.csv", "/dev/zero", "\\0"):
        with pytest.raises(mechdesign.StudyError, match="cannot be read"):
            arm(tmp_path, name, allow_files=True)


def test_a_file_is_of_bounded_size(tmp_path: Path) -> None:
    with (tmp_path / "large.csv").open("wb") as stream:
        stream.truncate(10**10)
    with pytest.raises(mechdesign.StudyError, match=r"large\.csv cannot be read: larger than 50 MB"):
        arm(tmp_path, "large.csv")


def test_contents_are_not_quoted(tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("1\nhunter:x:0\n")
    with pytest.raises(mechdesign.StudyError, match=r"secret\.csv:2: ") as caught:
        arm(tmp_path, "secret.csv")
    assert "hunter" not in str(caught.value)


def test_only_what_the_schema_calls_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "mu").write_text("not to be read")
    (tmp_path / "study.yaml").write_text(
        ARM.replace("drives", "measures: {mu: P.x}, targets: {P.y: mu}, drives") + "kinematics: {path: {arm: [1, 2]}}\n"
    )
    study = mechdesign.load(tmp_path / "study.yaml")
    assert not list(study.inputs())
